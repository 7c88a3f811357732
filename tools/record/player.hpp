// A recording as a station that others join: what was told is told again, at any speed and from any moment,
// through segments like those of a run. Whoever shows a station, punctum-console above all, shows a recording
// too, and needs to know nothing of it.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/segment.hpp"
#include "rt/station/picture.hpp"
#include "rt/station/station.hpp"
#include "tools/record/recording_reader.hpp"
#include "tools/shared/replay_segments.hpp"

namespace punctum::tools {

struct Mark {
  double t_s = 0;
  std::string text;
};

class Player {
 public:
  // Reads the recording once, and makes the station. The error is one line.
  [[nodiscard]] static tl::expected<std::unique_ptr<Player>, std::string> open(const std::string& recording,
                                                                               const std::string& station);

  // Tells what was told up to that time of the run. A time before the present one: from the beginning,
  // without telemetry in between; so is one that is far ahead.
  void go_to(double t_s);
  // Answers whoever joins, and shows that it is there, and how it plays. True: somebody has asked for a stop
  // since the last call.
  [[nodiscard]] bool serve(double speed, bool playing);
  // What a console has asked for since the last call, one at a time.
  [[nodiscard]] bool next(ReplayWish& wish) { return (*wishes_)->queue.try_pop(wish); }

  [[nodiscard]] double now_s() const noexcept { return now_s_; }
  [[nodiscard]] double first_s() const noexcept { return first_s_; }
  [[nodiscard]] double last_s() const noexcept { return last_s_; }
  [[nodiscard]] const std::vector<Mark>& marks() const noexcept {
    return marks_;
  }  // faults, phases, commands
  [[nodiscard]] const std::string& ends() const noexcept {
    return ends_;
  }  // early, and why; empty: it does not

 private:
  struct Overview;
  Player(std::string recording, RecordingReader reader, hal::Rendezvous rendezvous)
      : recording_(std::move(recording)), reader_(std::move(reader)), rendezvous_(std::move(rendezvous)) {}
  [[nodiscard]] tl::expected<void, std::string> make_station(const std::string& station,
                                                             const std::string& scene);
  [[nodiscard]] tl::expected<void, std::string> make_controls(const std::string& station);
  [[nodiscard]] tl::expected<void, std::string> make_view(const std::string& station);
  void begin_again();
  void tell_newest();
  void tell_events(std::uint64_t up_to_tick);

  // Takes the messages of the recording.
  struct Teller {
    Player& player;
    void operator()(const v1::Telemetry& t) const;
    void operator()(const v1::Observation& o) const;
    void operator()(const v1::CellSurface& s) const;
    void operator()(const v1::Picture& p) const;
    void operator()(const v1::Event& e) const;
    void operator()(const v1::Status& s) const;
  };

  std::string recording_;
  RecordingReader reader_;
  hal::Rendezvous rendezvous_;
  std::optional<hal::Shared<const rt::CoreSegment>> made_core_;
  std::optional<hal::Shared<const rt::ObservationSegment>> made_observation_;
  std::optional<hal::Shared<rt::CoreSegment>> core_;
  std::optional<hal::Shared<rt::ObservationSegment>> observation_;
  std::optional<hal::Shared<rt::CommandSegment>> commands_;      // of the console
  std::optional<hal::Shared<const rt::ViewSegment>> made_view_;  // none: the recording has no pictures
  std::optional<hal::Shared<rt::ViewSegment>> view_;
  std::optional<hal::Shared<const rt::ViewerSegment>> viewer_;
  std::optional<hal::Shared<const ReplaySegment>> made_replay_;
  std::optional<hal::Shared<ReplaySegment>> replay_;
  std::optional<hal::Shared<ReplayWishSegment>> wishes_;
  std::vector<Mark> marks_;
  std::string ends_;
  double first_s_ = 0, last_s_ = 0, now_s_ = 0;
  bool over_ = false;                           // the file
  bool skipping_ = false;                       // to a moment: what lies between is not told
  std::deque<rt::Event> held_;                  // a recorder may write them before their tick
  std::uint64_t events_ = 0, told_events_ = 0;  // read since the beginning of the file; told, ever
  std::optional<rt::TelemetrySample> waiting_;  // the first one after now
  rt::TelemetrySample newest_;
  rt::Observation newest_observation_;
  rt::CellSurface newest_surface_;
  rt::PictureHead newest_picture_;
  std::string pixels_;  // of it
  std::vector<std::uint8_t> reduced_;
  bool telemetry_waits_ = false, observation_waits_ = false, surface_waits_ = false,
       picture_waits_ = false;  // to be told
};

}  // namespace punctum::tools
