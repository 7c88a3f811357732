#include "hal/sim/valid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>

namespace punctum::sim {
namespace {

// Far above what any plant of this station comes to, far below what overflows in a reader.
constexpr double kMost_m = 1;
constexpr double kMost = 1e9;  // of every other number, in its SI unit
constexpr std::int64_t kLatest_ns = std::numeric_limits<std::int64_t>::max() / 8;
constexpr std::int64_t kLongestDelivery_ns = 60'000'000'000;
constexpr std::uint64_t kMostCells = 1U << 30;

bool within(double most, std::initializer_list<double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [most](double v) { return std::abs(v) <= most; });
}

bool within(double most, const double (&v)[3]) { return within(most, {v[0], v[1], v[2]}); }

bool points_within(double most, std::initializer_list<Point> points) {
  return std::all_of(points.begin(), points.end(),
                     [most](const Point& p) { return within(most, {p.x, p.y, p.z}); });
}

bool times(std::initializer_list<std::int64_t> list) {
  return std::all_of(list.begin(), list.end(),
                     [](std::int64_t t_ns) { return t_ns >= -kLatest_ns && t_ns <= kLatest_ns; });
}

// To read a bool that is neither 0 nor 1 is undefined.
bool is_bool(const bool& b) {
  unsigned char byte = 0;
  std::memcpy(&byte, &b, 1);
  return byte <= 1;
}

bool valid(const HandPlantState& s) {
  return points_within(kMost_m, {s.position_m}) &&
         points_within(kMost, {s.velocity_m_s, s.applied_N, s.commanded_N}) &&
         std::all_of(s.pending_N.begin(), s.pending_N.end(),
                     [](const Point& p) { return points_within(kMost, {p}); }) &&
         within(kMost, {s.tilt_rad[0], s.tilt_rad[1], s.work_J});
}

bool valid(const OperatorState& s) {
  const auto places = [](const auto& list) {
    return std::all_of(list.begin(), list.end(), [](const Point& p) { return points_within(kMost, {p}); });
  };
  return points_within(kMost, {s.intention_m, s.arm_target_m, s.wanted_tip_m, s.path_from_m, s.path_to_m,
                               s.hand_from_m, s.target_m, s.line, s.felt_offset_m, s.puncture_tip_m}) &&
         places(s.error_m) && places(s.tip_m) &&
         within(kMost, {s.next_look_s, s.activity_s, s.path_s, s.path_T_s, s.path_speed_m_s, s.stalled_s,
                        s.aware_s, s.enabling_s, s.tilt_rad[0], s.tilt_rad[1]}) &&
         std::isfinite(s.furthest_m) &&  // -1e300 before the needle has advanced
         s.activity <= Activity::strokes && s.resume <= Activity::strokes;
}

bool valid(const StagePlantState& s) {
  return points_within(kMost_m, {s.tip_m, s.set_point_m}) &&
         points_within(kMost, {s.axis, s.set_axis, s.velocity_m_s});
}

bool valid(const MembraneState& s) {
  return is_bool(s.punctured) && within(kMost, {s.puncture_time_s}) &&
         within(kMost_m, {s.puncture_depth_m, s.dimple_m}) && within(kMost, s.axis_m) &&
         within(kMost, s.lean);
}

bool valid(const CellState& s) {
  return valid(s.outer) && valid(s.inner) && is_bool(s.contact) && is_bool(s.attached) &&
         is_bool(s.far_wall_pierced) && is_bool(s.torn) &&
         within(kMost, {s.time_s, s.first_contact_time_s, s.clear_time_s, s.leak}) &&
         within(kMost_m, s.hole_m) && within(kMost_m, s.offset_m) && within(kMost_m, s.entry_m);
}

bool valid(const CellReading& r) {
  return points_within(kMost_m, {r.centre_m, r.entry_m}) && points_within(kMost, {r.force_N}) &&
         within(kMost_m, {r.R_m, r.R_inner_m, r.depth_m, r.wd_m, r.a_m, r.inner_wd_m, r.chord_m}) &&
         within(kMost, {r.membrane_N, r.outer_N, r.inner_N, r.drag_N, r.strain, r.pressure_Pa});
}

bool valid(const Failing& f) {
  return f.kind <= kLastFailure && f.channel <= kLastChannel && f.component <= kLastComponent;
}

}  // namespace

bool valid(const Snapshot& s) noexcept {
  return s.start_ns >= 0 && s.t_ns >= s.start_ns && s.t_ns <= kLatest_ns &&
         times({s.puncture_ns, s.zona_puncture_ns, s.estop.last_toggle_ns, s.estop.last_reset_ns,
                s.estop.opened_ns}) &&
         s.cell_index <= kMostCells && valid(s.hand) && valid(s.operator_state) && valid(s.stage) &&
         valid(s.cell) && valid(s.cell_reading) &&
         within(kMost, {s.injector.opening, s.injector.delivered_s}) &&
         within(kMost, {s.vacuum.pressure_Pa, s.vacuum.reading_Pa}) &&
         within(kMost, {s.force_sensor.lagged_N, s.force_sensor.reading_N}) &&
         std::all_of(s.failure.begin(), s.failure.end(), [](const Failing& f) { return valid(f); });
}

bool valid(const Exposure& e) noexcept {
  return e.exposure_ns >= 0 && e.exposure_ns <= kLatest_ns && e.deliver_ns >= 0 &&
         e.deliver_ns <= e.exposure_ns + kLongestDelivery_ns && valid(e.world);
}

bool newest_valid(const Bench& bench, Snapshot& out) noexcept {
  std::uint64_t index = bench.snapshots.head();
  for (std::uint64_t i = 0; i < kSnapshots && index > 0; ++i) {
    --index;
    if (bench.snapshots.read(index, out) == hal::Read::ok && valid(out)) {
      return true;
    }
  }
  return false;
}

}  // namespace punctum::sim
