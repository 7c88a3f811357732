// A running station as the gateway tells it: what is new in its segments, as messages; and what may be asked
// of it. It maps everything but its own queue of commands for reading only, and no process of the station
// waits for it.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "hal/browser/fingers.hpp"
#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/segment.hpp"
#include "rt/station/picture.hpp"
#include "rt/station/station.hpp"
#include "tools/console/parameters.hpp"
#include "tools/console/position_stream.hpp"
#include "tools/shared/replay_segments.hpp"
#include "tools/wire/messages.hpp"

namespace punctum::console {

struct Channel {
  const char* topic;
  const char* encoding;     // of its messages
  const char* schema_name;  // in the schema of tools/wire, or in messages.schema.json
};
enum ChannelId : std::uint8_t {
  telemetry,
  observation,
  surface,
  event,
  status,
  state,
  parameters,
  every_tick,
  picture,
  replay,
  fixtures
};
inline constexpr std::array<Channel, 11> kChannels = {{
    {"/punctum/telemetry", "protobuf", "punctum.v1.Telemetry"},
    {"/punctum/observation", "protobuf", "punctum.v1.Observation"},
    {"/punctum/surface", "protobuf", "punctum.v1.CellSurface"},
    {"/punctum/event", "protobuf", "punctum.v1.Event"},
    {"/punctum/status", "protobuf", "punctum.v1.Status"},
    {"/punctum/state", "json", "punctum.v1.State"},  // what an operator reads, in words
    {"/punctum/parameters", "json", "punctum.v1.Parameters"},
    {"/punctum/ticks", "protobuf", "punctum.v1.Ticks"},
    {"/punctum/picture", "protobuf", "punctum.v1.Picture"},
    {"/punctum/replay", "json", "punctum.v1.Replay"},  // of a recording that is played
    {"/punctum/fixtures", "json", "punctum.v1.Fixtures"},
}};
using ChannelSet = std::bitset<kChannels.size()>;

struct Told {
  ChannelId channel;
  std::uint64_t time_ns;  // since 1970, when it was read
  std::shared_ptr<const std::string> message;
  bool holds = false;  // until the next one that does: it is told once per change
};

class StationFeed {
 public:
  static constexpr double kPoll_s = 0.02;
  static constexpr double kState_s = 0.1;  // at least; at once when it changes
  static constexpr double kStatus_s = 1.0;
  static constexpr double kSilent_s = 0.5;  // without a tick: the core is silent
  static constexpr std::uint64_t kSamplesPerPoll = 4;
  static constexpr std::size_t kMostEvents = 256;   // that whoever comes late is told
  static constexpr std::size_t kMostAsked = 256;    // whose commands wait for the core's word
  static constexpr std::uint64_t kMostTicks = 512;  // in one message of every_tick
  static constexpr std::int64_t kLooks_ns =
      500'000'000;  // vision tells pictures so long after they were wanted

  // Refused while another console has joined.
  [[nodiscard]] static tl::expected<StationFeed, std::string> join(std::string_view station);

  // What is new since the last call, of the wanted channels. now_s never goes back.
  void poll(double now_s, ChannelSet wanted, std::vector<Told>& out);
  // For whoever begins to listen to a channel: what it has missed and needs.
  void catch_up(ChannelId channel, std::vector<Told>& out);
  // Latched by the core, which also says that it was; refused where the queue is full.
  [[nodiscard]] tl::expected<void, std::string> stop(const std::string& who);
  // Of whoever has control; refused with one line while the station takes none.
  [[nodiscard]] tl::expected<void, std::string> ask(const rt::Command& command, const std::string& who);
  // The hand of the station, where it is on the page; refused with one line where it is not.
  [[nodiscard]] tl::expected<void, std::string> move_hand(const browser::Fingers& fingers);
  void let_go_of_hand();
  // Of whoever may operate; refused with one line where no recording is played.
  [[nodiscard]] tl::expected<void, std::string> ask(const tools::ReplayWish& wish);
  // Why nothing but a stop is taken; empty: it is.
  [[nodiscard]] std::string refusal() const;
  [[nodiscard]] const Parameters& parameters_now() const { return parameters_; }

  // The clock that a message's time is of.
  [[nodiscard]] static std::uint64_t now_ns();
  [[nodiscard]] double run_s() const { return newest_.t_s; }
  [[nodiscard]] const std::string& station() const { return station_; }
  // Its parent has ended, and with it the station.
  [[nodiscard]] bool is_over() const;

 private:
  StationFeed() = default;
  void read_scene(int descriptor);
  [[nodiscard]] tl::expected<void, std::string> join_pictures(const hal::Joined& joined);
  [[nodiscard]] tl::expected<void, std::string> join_replay(const hal::Joined& joined);
  void read_telemetry(bool wanted, std::vector<Told>& out);
  void read_every_tick(bool wanted, std::vector<Told>& out);
  void read_picture(bool wanted, std::vector<Told>& out);
  [[nodiscard]] std::string replay_in_words(bool with_marks) const;
  void read_observation(bool wanted, std::vector<Told>& out);
  void read_surface(bool wanted, std::vector<Told>& out);
  void read_events(bool wanted, std::vector<Told>& out);
  void account_for(const rt::Event& happened);
  void remember(const std::string& who);
  void watch_core(double now_s);
  [[nodiscard]] std::string state_in_words() const;

  std::string station_;
  std::optional<hal::Shared<const rt::CoreSegment>> core_;
  std::optional<hal::Shared<const rt::ObservationSegment>> observation_;
  std::optional<hal::Shared<rt::CommandSegment>> commands_;
  hal::Descriptor parent_, core_process_;  // pidfd
  rt::TelemetrySample newest_;
  bool has_sample_ = false;
  std::uint64_t read_ = 0;  // samples of telemetry up to here were looked at
  std::uint64_t unusable_ = 0;
  std::uint64_t frame_ = 0, surface_ = 0;    // places in their slots, up to here
  std::optional<std::uint64_t> ticks_from_;  // told of every_tick up to here; none: nobody wants it
  std::uint64_t ticks_lost_ = 0;
  std::optional<hal::Shared<const rt::ViewSegment>> view_;  // none: vision looks at no picture
  std::optional<hal::Shared<rt::ViewerSegment>> viewer_;
  std::uint64_t viewed_ = 0;  // place of the picture that was told last, up to here
  v1::Picture picture_;
  v1::Ticks every_tick_;
  std::optional<hal::Shared<browser::FingersSegment>> fingers_;    // none: the hand is elsewhere
  std::optional<hal::Shared<const tools::ReplaySegment>> replay_;  // none: it is no recording
  std::optional<hal::Shared<tools::ReplayWishSegment>> replay_wishes_;
  std::vector<std::pair<double, std::string>> marks_;
  std::optional<PositionStream> stream_;  // none: the scene asks for none
  std::optional<hal::Follower<rt::EventRing>> events_;
  std::deque<Told> told_events_;
  std::optional<double> fault_at_s_;  // in the run
  std::uint64_t ticks_ = 0;
  double ticked_s_ = 0;
  const char* core_state_ = "waiting";
  std::uint64_t stops_asked_ = 0;
  Parameters parameters_;
  bool parameters_changed_ = false;
  std::string fixtures_;  // empty: the station does not tell its scene
  std::deque<std::string>
      asked_by_;       // of what stands in the queue, oldest first; a recording tells no answers
  std::string state_;  // newest
  double state_told_s_ = -1, status_told_s_ = -1, replay_told_s_ = -1;
};

}  // namespace punctum::console
