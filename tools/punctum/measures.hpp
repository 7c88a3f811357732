// Measures a run tick by tick: the telemetry of the core beside the truth of the simulated plant, where there
// is one. Memory is bounded however long the run is.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/sim/bench.hpp"
#include "hal/sim/truth.hpp"
#include "rt/station/telemetry.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

// Mean and spread of a number that comes once per cell.
struct Spread {
  std::uint64_t n = 0;
  double mean = 0, m2 = 0, largest = 0;
  void add(double v) noexcept {
    ++n;
    const double d = v - mean;
    mean += d / static_cast<double>(n);
    m2 += d * (v - mean);
    if (n == 1 || v > largest) {
      largest = v;
    }
  }
  [[nodiscard]] double deviation() const noexcept {
    return n > 1 ? std::sqrt(m2 / static_cast<double>(n - 1)) : 0;
  }
};

// 8 .. 12 Hz, two second-order sections.
class TremorBand {
 public:
  explicit TremorBand(double rate_Hz);
  double next(double x) noexcept;

 private:
  double b_, a1_, a2_;
  std::array<std::array<double, 4>, 2> past_{};  // per section x1 x2 y1 y2
  bool first_ = true;
  double offset_ = 0;
};

struct PhaseSpan {
  std::uint32_t cell = 0;
  rt::Phase phase{};
  double start_s = 0, end_s = 0;
};

// Of one cell. An empty value: the run did not come to that.
struct CellMeasures {
  std::uint32_t cell = 0;
  std::optional<double> contact_delay_s;   // phase contact after true contact; < 0 = too early
  std::optional<double> puncture_delay_s;  // phase puncture after the outer membrane gave way
  std::optional<double> inner_delay_s;     // ... after the innermost one did
  std::optional<double>
      lateral_error_m;  // needle axis beside the cell's centre when the outer membrane gave way
  std::optional<double> lateral_contact_m;  // the same at first contact
  std::optional<double> beyond_puncture_m;  // deepest tip beyond where it stood at the puncture
  std::optional<double> withdrawal_s;
  double peak_force_N = 0;  // true, along the needle
  double max_depth_m = 0;   // true, past the undeformed outer membrane
  double peak_hand_N = 0;
  double E_fit_Pa = 0, E_fit_sd_Pa = 0;  // modulus by the force sensor, the last that was told; 0: none
  // The dose, as the time for which the injector is fully open with the tip in the cell. Asked: how long the
  // button was down there. Given: in truth where the cell is simulated, otherwise as the injector reports.
  double asked_s = 0;
  std::optional<double> injected_s;
  bool done = false;  // the core came to `clear`
  bool lost = false;  // in truth: torn, pierced through or off the pipette

  // A button is read once in a tick, and valve and line answer within some 10 ms. What is missing beyond that
  // and a tenth of the dose did not go into the cell.
  static constexpr double kDoseTolerance = 0.1, kDoseTolerance_s = 0.02;
  [[nodiscard]] bool underdosed() const noexcept {
    return injected_s.value_or(0) < (1 - kDoseTolerance) * asked_s - kDoseTolerance_s;
  }
};

// Where the needle is when a run ends.
struct Whereabouts {
  enum Where : std::uint8_t {
    unknown,   // the scene has a cell to enter, but nobody saw it or the needle
    no_cell,   // the scene has none
    outside,   // clear of the cell
    touching,  // it touches or dents the outer membrane
    inside,    // through the outer membrane
  };
  enum Source : std::uint8_t {
    nobody,
    core,   // its phases and its model of the membrane
    truth,  // of the simulated world
  };
  Where where = unknown;
  Source source = nobody;
  std::optional<double>
      depth_m{};  // of the tip, past the undeformed outer membrane along the axis; < 0: before it
};
// As report.json has them.
[[nodiscard]] constexpr const char* name(Whereabouts::Where where) noexcept {
  constexpr const char* names[] = {"unknown", "no cell", "outside", "touching", "inside"};
  return names[where];
}
[[nodiscard]] constexpr const char* name(Whereabouts::Source source) noexcept {
  constexpr const char* names[] = {"nobody", "core", "truth"};
  return names[source];
}

class Measures {
 public:
  explicit Measures(const Scene& scene);

  // One tick; `world` is the plant at that tick, null if nobody simulates.
  void tick(const rt::TelemetrySample& s, const sim::Snapshot* world);
  void finish();  // after the last tick
  // At the last tick, or in a later state of the simulated world.
  [[nodiscard]] Whereabouts whereabouts(const sim::Snapshot* later = nullptr) const;

  static constexpr std::size_t kKept = 1000;  // phases and cells listed one by one; all are counted
  std::vector<PhaseSpan> phases;
  std::vector<CellMeasures> cells;
  std::uint64_t phase_count = 0, cell_count = 0, cells_done = 0, cells_lost = 0;
  std::uint64_t cells_without_injection =
      0;                               // clear and whole, but nothing came out of the injector that is there
  std::uint64_t cells_underdosed = 0;  // clear and whole, but got clearly less than was asked
  double asked_s = 0, injected_s = 0;  // of all cells
  Spread contact_delay_s, puncture_delay_s, inner_delay_s, lateral_error_m, lateral_contact_m,
      beyond_puncture_m, withdrawal_s;
  double peak_force_N = 0, max_depth_m = 0, peak_hand_N = 0;
  Spread E_fit_Pa, E_fit_sd_Pa;

  // Estimated less true needle force, from contact until the outer membrane gives way.
  double force_error2 = 0, force_error_sum = 0, true_force2 = 0;
  std::uint64_t force_ticks = 0;

  // In truth, of the needle's glass from the dish floor and the holding pipette; none without them.
  std::optional<double> least_floor_m, least_holder_m;

  double tremor_hand2 = 0, tremor_tip2 = 0;
  std::uint64_t tremor_ticks = 0;

  std::uint64_t ticks = 0, gaps = 0;  // gaps: grid indices without a sample
  std::uint64_t observations = 0, stale_ticks = 0, stale_spells = 0;
  std::uint64_t blind_ticks = 0;  // without a fresh observation, also before the first one
  std::array<std::uint64_t, 16> alarm_ticks{};
  struct Fault {
    rt::Fault fault{};
    double t_s = 0;
  };
  std::vector<Fault> faults;  // as they were latched
  std::uint64_t fault_count = 0;
  double last_s = 0;
  rt::TelemetrySample last;

  // The button was down in this cell, and nothing came out of the injector that is there.
  [[nodiscard]] bool dose_kept_back() const noexcept;
  [[nodiscard]] std::optional<double> tremor_ratio() const;
  [[nodiscard]] std::optional<double> force_error_rms_N() const;

 private:
  void change_phase(const rt::TelemetrySample& s);
  void close_phase(double end_s);
  void close_cell();
  void begin(const rt::TelemetrySample& s);
  void see_changes(const rt::TelemetrySample& s);
  void add_fault(const rt::TelemetrySample& s);
  void count_vision(const rt::TelemetrySample& s);
  void measure_tremor(const rt::TelemetrySample& s, const sim::Snapshot& world);
  void compare_with_truth(const rt::TelemetrySample& s, const sim::Snapshot& world);
  void measure_delays(const rt::TelemetrySample& s, const sim::Truth& truth);
  void measure_dose_and_depth(const rt::TelemetrySample& s, const sim::Truth& truth, double delivered_s);

  [[nodiscard]] Whereabouts believed() const;

  sim::SimConfig sim_;
  bool has_phases_, has_injector_;
  double next_frame_s_;  // the longest wait for a recorded frame; 0: the frames are of this very needle
  double frame_came_s_ = 0;
  double position_scale_;
  double period_s_;
  std::vector<TremorBand> hand_band_, tip_band_;

  bool any_ = false;
  PhaseSpan open_;
  CellMeasures now_;
  bool closed_cell_ = true;
  bool was_contact_ = false;
  double true_contact_s_ = -1, phase_contact_s_ = -1, phase_puncture_s_ = -1, withdrawal_from_s_ = -1;
  double puncture_depth_m_ = 0;
  double delivered_s_ = 0;
  std::optional<Whereabouts> true_end_;  // at the last tick that had a cell
  bool zona_seen_ = false, puncture_seen_ = false;
  double clutch_until_s_ = 0;
};

}  // namespace punctum::tools
