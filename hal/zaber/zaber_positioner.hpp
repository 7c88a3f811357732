// Three axes of Zaber devices as a queued positioner. For an ordinary thread: every call talks over the
// serial line and waits for the answers.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "hal/device_life.hpp"
#include "hal/zaber/config.hpp"
#include "hal/zaber/reply.hpp"
#include "hal/zaber/wire.hpp"

namespace punctum::zaber {

class ZaberPositioner final : public hal::Device, public hal::QueuedPositioner {
 public:
  static constexpr std::size_t kQueue = 4;  // moves that may wait behind the present one

  // clock: the station's, on which samples are dated.
  ZaberPositioner(const ZaberParams& params, const hal::Clock& clock, std::unique_ptr<Wire> wire)
      : params_(params), clock_(clock), wire_(std::move(wire)) {}

  // Asks every axis where it is and how far it goes; moves nothing, and homes nothing.
  [[nodiscard]] tl::expected<void, std::string> open() override;
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t /*first_tick_ns*/) override { return {}; }
  void safe_state() noexcept override;
  void close() noexcept override;

  // The next move of the queue begins in here: whoever has queued moves reads while they go on.
  [[nodiscard]] hal::Status read(hal::PositionerState& out) override;
  [[nodiscard]] bool move_to(const hal::Vec3& position_m) override;
  void stop() override;

  // What the fault is, in a few words; empty without one.
  [[nodiscard]] const std::string& why() const { return why_; }
  // Where an axis may stand.
  [[nodiscard]] const hal::Vec3& least_m() const { return least_m_; }
  [[nodiscard]] const hal::Vec3& most_m() const { return most_m_; }

 private:
  struct Answer {
    hal::Status status = hal::Status::no_data;  // ok: the rest is valid
    bool accepted = false;
    bool busy = false;
    std::array<char, 2> flag{'-', '-'};
    std::string data;
  };
  [[nodiscard]] Answer ask(const AxisParams& axis, std::string_view command);
  [[nodiscard]] Answer wait_for(const AxisParams& axis, int id);
  [[nodiscard]] tl::expected<double, std::string> ask_number(const AxisParams& axis,
                                                             std::string_view command);
  [[nodiscard]] tl::expected<void, std::string> open_axis(std::size_t axis);
  [[nodiscard]] bool trusted(const AxisParams& axis, const Answer& answer);
  [[nodiscard]] bool look();
  [[nodiscard]] bool begin(const hal::Vec3& position_m);
  void fail(std::string why);
  void stop_axes();

  const ZaberParams params_;
  const hal::Clock& clock_;
  std::unique_ptr<Wire> wire_;
  int id_ = 0;  // of the last command
  std::deque<hal::Vec3> queue_;
  hal::Vec3 least_m_ = hal::Vec3::Zero(), most_m_ = hal::Vec3::Zero();
  hal::Vec3 at_m_ = hal::Vec3::Zero();
  std::int64_t at_ns_ = 0;
  bool moving_ = false;
  bool gone_ = false;
  std::string why_;
};

}  // namespace punctum::zaber
