// A slow manipulator with a controller of its own: straight moves with a trapezoidal speed profile and a
// short queue. Its position is a closed form of the clock's time, so it needs no thread and no plant step.
#pragma once

#include <array>
#include <cstdint>

#include "hal/devices.hpp"

namespace punctum::sim {

using hal::Vec3;

struct PositionerParams {
  Vec3 start_m = Vec3::Zero();
  double speed_m_s = 2e-3;
  double acceleration_m_s2 = 10e-3;
  double travel_m = 12.5e-3;  // +- from the centre
};

class SimPositioner final : public hal::QueuedPositioner {
 public:
  static constexpr int kQueue = 4;  // moves that may wait behind the present one

  SimPositioner(const PositionerParams& params, const hal::Clock& clock) noexcept;

  [[nodiscard]] hal::Status read(hal::PositionerState& out) override;
  [[nodiscard]] bool move_to(const Vec3& position_m) override;
  void stop() override;

 private:
  // A straight motion that ends at rest: a move from rest, or the braking of one.
  struct Motion {
    Vec3 from_m = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();  // unit
    double length_m = 0;
    double top_m_s = 0;  // highest speed
    double ramp_s = 0;   // duration of the ramp at each end; braking has only the last one
    double total_s = 0;
    std::int64_t start_ns = 0;
  };
  struct Along {
    double way_m = 0;
    double speed_m_s = 0;
  };

  [[nodiscard]] Motion move(const Vec3& from_m, const Vec3& to_m, std::int64_t start_ns) const;
  [[nodiscard]] Along along(const Motion& motion, std::int64_t t_ns) const;
  [[nodiscard]] static std::int64_t end_ns(const Motion& motion);
  void advance(std::int64_t t_ns);  // takes moves from the queue as the ones before them end

  PositionerParams params_;
  const hal::Clock& clock_;
  Motion motion_;
  std::array<Vec3, kQueue> waiting_{};
  int queued_ = 0;
};

}  // namespace punctum::sim
