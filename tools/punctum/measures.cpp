#include "tools/punctum/measures.hpp"

#include <algorithm>
#include <numbers>

namespace punctum::tools {
namespace {

constexpr double kTremorLow_Hz = 8, kTremorHigh_Hz = 12;
constexpr double kSettle_s = 1;  // of the band-pass, after the start and after the clutch

Whereabouts in_truth(const sim::Truth& truth) {
  Whereabouts w;
  w.source = Whereabouts::truth;
  w.depth_m = -truth.gap_m;
  w.where = truth.zona_punctured && truth.gap_m < 0 ? Whereabouts::inside
            : truth.contact                         ? Whereabouts::touching
                                                    : Whereabouts::outside;
  return w;
}

double norm(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

void keep_least(std::optional<double>& least, const std::optional<double>& now) {
  if (now && !(least && *least <= *now)) {
    least = now;
  }
}

}  // namespace

TremorBand::TremorBand(double rate_Hz) {
  const double f0 = std::sqrt(kTremorLow_Hz * kTremorHigh_Hz);
  const double w = 2 * std::numbers::pi * f0 / rate_Hz;
  const double alpha = std::sin(w) * (kTremorHigh_Hz - kTremorLow_Hz) / (2 * f0);
  b_ = alpha / (1 + alpha);
  a1_ = -2 * std::cos(w) / (1 + alpha);
  a2_ = (1 - alpha) / (1 + alpha);
}

double TremorBand::next(double x) noexcept {
  if (first_) {
    offset_ = x;  // begins at rest where the signal is
    first_ = false;
  }
  double v = x - offset_;
  for (auto& p : past_) {
    const double y = b_ * (v - p[1]) - a1_ * p[2] - a2_ * p[3];
    p = {v, p[0], y, p[2]};
    v = y;
  }
  return v;
}

Measures::Measures(const Scene& scene)
    : sim_(scene.sim.value_or(sim::SimConfig{})),
      has_phases_(scene.servo.phases.has_value()),
      has_injector_(scene.servo.injector.has_value()),
      next_frame_s_(scene.recorded ? 3 / scene.recorded->fps : 0),
      position_scale_(scene.servo.mapping.position_scale),
      period_s_(1 / scene.servo.rate_Hz),
      hand_band_(3, TremorBand(scene.servo.rate_Hz)),
      tip_band_(3, TremorBand(scene.servo.rate_Hz)) {}

bool Measures::dose_kept_back() const noexcept {
  return has_injector_ && now_.asked_s > 0 && now_.injected_s.value_or(0) < CellMeasures::kDoseTolerance_s;
}

std::optional<double> Measures::tremor_ratio() const {
  if (tremor_ticks == 0 || tremor_hand2 <= 0) {
    return std::nullopt;
  }
  return position_scale_ * std::sqrt(tremor_tip2 / tremor_hand2);
}

std::optional<double> Measures::force_error_rms_N() const {
  if (force_ticks == 0) {
    return std::nullopt;
  }
  return std::sqrt(force_error2 / static_cast<double>(force_ticks));
}

void Measures::close_phase(double end_s) {
  open_.end_s = end_s;
  ++phase_count;
  if (phases.size() < kKept) {
    phases.push_back(open_);
  }
}

void Measures::close_cell() {
  if (closed_cell_) {
    return;
  }
  closed_cell_ = true;
  ++cell_count;
  const bool whole = now_.done && !now_.lost;
  // Unknown is neither.
  const bool without = has_injector_ && now_.injected_s && *now_.injected_s <= 0;
  const bool too_little = has_injector_ && now_.injected_s && !without && now_.underdosed();
  cells_done += whole && !without && !too_little ? 1U : 0U;
  cells_without_injection += whole && without ? 1U : 0U;
  cells_underdosed += whole && too_little ? 1U : 0U;
  asked_s += now_.asked_s;
  injected_s += now_.injected_s.value_or(0);
  cells_lost += now_.lost ? 1U : 0U;
  const auto keep = [](const std::optional<double>& v, Spread& into) {
    if (v) {
      into.add(*v);
    }
  };
  keep(now_.contact_delay_s, contact_delay_s);
  keep(now_.puncture_delay_s, puncture_delay_s);
  keep(now_.inner_delay_s, inner_delay_s);
  keep(now_.lateral_error_m, lateral_error_m);
  keep(now_.lateral_contact_m, lateral_contact_m);
  keep(now_.beyond_puncture_m, beyond_puncture_m);
  keep(now_.withdrawal_s, withdrawal_s);
  if (now_.E_fit_Pa > 0) {
    E_fit_Pa.add(now_.E_fit_Pa);
    E_fit_sd_Pa.add(now_.E_fit_sd_Pa);
  }
  if (cells.size() < kKept) {
    cells.push_back(now_);
  }
}

void Measures::change_phase(const rt::TelemetrySample& s) {
  close_phase(s.t_s);
  const rt::Phase from = open_.phase;
  open_ = {s.cell, s.phase, s.t_s, s.t_s};
  if (s.cell != now_.cell) {
    close_cell();
    now_ = {};
    now_.cell = s.cell;
    closed_cell_ = false;
    was_contact_ = zona_seen_ = puncture_seen_ = false;
    true_contact_s_ = phase_contact_s_ = phase_puncture_s_ = withdrawal_from_s_ = -1;
  }
  switch (s.phase) {
    case rt::Phase::contact:
      if (from == rt::Phase::free) {
        phase_contact_s_ = s.t_s;
      }
      break;
    case rt::Phase::puncture:
      if (phase_puncture_s_ < 0) {
        phase_puncture_s_ = s.t_s;
      }
      break;
    case rt::Phase::withdrawal:
      if (withdrawal_from_s_ < 0) {
        withdrawal_from_s_ = s.t_s;
      }
      break;
    case rt::Phase::clear:
      if (withdrawal_from_s_ >= 0) {
        now_.withdrawal_s = s.t_s - withdrawal_from_s_;
      }
      now_.done = true;
      break;
    case rt::Phase::free:
    case rt::Phase::indentation:
    case rt::Phase::injection:
      break;
  }
}

void Measures::tick(const rt::TelemetrySample& s, const sim::Snapshot* world) {
  // Ticks without a sample, missed or recorded thinly, count as the one that follows them.
  const double since_last_s =
      any_ && s.tick > last.tick ? static_cast<double>(s.tick - last.tick) * period_s_ : period_s_;
  if (any_) {
    see_changes(s);
  } else {
    begin(s);
  }
  ++ticks;
  for (std::size_t i = 0; i < alarm_ticks.size(); ++i) {
    if ((s.alarms & (1U << i)) != 0) {
      ++alarm_ticks[i];
    }
  }
  if (has_injector_ && has_phases_ && !sim_.cell) {  // nobody knows better than the core
    const bool inside = s.phase == rt::Phase::puncture || s.phase == rt::Phase::injection;
    now_.asked_s += inside && (s.buttons & hal::kButtonInject) != 0 ? since_last_s : 0;
    now_.injected_s = now_.injected_s.value_or(0) + (inside && s.injector_open != 0 ? since_last_s : 0);
  }
  count_vision(s);
  const double hand_N = norm(s.force_N);
  now_.peak_hand_N = std::max(now_.peak_hand_N, hand_N);
  peak_hand_N = std::max(peak_hand_N, hand_N);

  if (s.E_fit_Pa > 0) {
    now_.E_fit_Pa = s.E_fit_Pa;
    now_.E_fit_sd_Pa = s.E_fit_sd_Pa;
  }

  if (world != nullptr) {
    measure_tremor(s, *world);
    const sim::GlassClearance clearance = sim::glass_clearance(sim_, *world);
    keep_least(least_floor_m, clearance.floor_m);
    keep_least(least_holder_m, clearance.holder_m);
    // The plant puts a fresh cell in place a tick or more before the core knows.
    if (world->has_cell != 0 && world->cell_index == s.cell) {
      compare_with_truth(s, *world);
    }
    delivered_s_ = world->injector.delivered_s;
  }
  last = s;
  last_s = s.t_s;
}

void Measures::begin(const rt::TelemetrySample& s) {
  any_ = true;
  open_ = {s.cell, s.phase, s.t_s, s.t_s};
  now_.cell = s.cell;
  closed_cell_ = !sim_.cell && !(has_phases_ && has_injector_);
  if (s.fault != rt::Fault::none) {
    add_fault(s);
  }
}

void Measures::see_changes(const rt::TelemetrySample& s) {
  if (s.phase != open_.phase || s.cell != open_.cell) {
    change_phase(s);
  }
  if (s.tick > last.tick + 1) {
    gaps += s.tick - last.tick - 1;
  }
  if (s.fault != last.fault && s.fault != rt::Fault::none) {
    add_fault(s);
  }
  if ((s.alarms & ~last.alarms & rt::alarm_vision_stale) != 0) {
    ++stale_spells;
  }
}

void Measures::add_fault(const rt::TelemetrySample& s) {
  ++fault_count;
  if (faults.size() < kKept) {
    faults.push_back({s.fault, s.t_s});
  }
}

void Measures::count_vision(const rt::TelemetrySample& s) {
  if (s.observations != observations) {
    frame_came_s_ = s.t_s;
  }
  // Recorded frames show another needle than the one that moves now: that the core does not believe them is
  // no failure to see.
  const bool blind = next_frame_s_ > 0 ? s.observations == 0 || s.t_s > frame_came_s_ + next_frame_s_
                                       : s.obs_age_s < 0 || (s.alarms & rt::alarm_vision_stale) != 0;
  if (blind) {
    ++blind_ticks;
  }
  observations = s.observations;
  stale_ticks = s.stale_ticks;
}

// Of hand and tip as they really move.
void Measures::measure_tremor(const rt::TelemetrySample& s, const sim::Snapshot& world) {
  if ((s.buttons & hal::kButtonClutch) != 0) {
    clutch_until_s_ = s.t_s + kSettle_s;
  }
  const bool counts = s.t_s > kSettle_s && s.t_s > clutch_until_s_;
  const hal::Vec3 hand = world.hand.position_m, tip = world.stage.tip_m;
  for (int i = 0; i < 3; ++i) {
    const double h = hand_band_[static_cast<std::size_t>(i)].next(hand[i]);
    const double t = tip_band_[static_cast<std::size_t>(i)].next(tip[i]);
    if (counts) {
      tremor_hand2 += h * h;
      tremor_tip2 += t * t;
    }
  }
  tremor_ticks += counts ? 1U : 0U;
}

void Measures::compare_with_truth(const rt::TelemetrySample& s, const sim::Snapshot& world) {
  const sim::Truth truth = sim::truth_of(sim_, world);
  true_end_ = in_truth(truth);
  measure_delays(s, truth);
  measure_dose_and_depth(s, truth, world.injector.delivered_s - delivered_s_);
  now_.lost = now_.lost || truth.lost;
  max_depth_m = std::max(max_depth_m, now_.max_depth_m);
  peak_force_N = std::max(peak_force_N, now_.peak_force_N);
  if ((s.phase == rt::Phase::contact || s.phase == rt::Phase::indentation) && truth.contact &&
      !truth.zona_punctured) {
    const double e = s.tip_force_N - truth.axial_force_N;
    force_error2 += e * e;
    force_error_sum += e;
    true_force2 += truth.axial_force_N * truth.axial_force_N;
    ++force_ticks;
  }
}

// The core's contact and puncture after the true ones, and how far beside the cell's centre the needle was.
void Measures::measure_delays(const rt::TelemetrySample& s, const sim::Truth& truth) {
  if (truth.contact && !was_contact_) {
    true_contact_s_ = s.t_s;
  }
  was_contact_ = truth.contact;
  if (truth.contact && !now_.lateral_contact_m) {
    now_.lateral_contact_m = truth.lateral_m;
  }
  if (truth.zona_punctured && !zona_seen_) {
    zona_seen_ = true;
    now_.lateral_error_m = truth.lateral_m;
    if (phase_contact_s_ >= 0 && true_contact_s_ >= 0) {
      now_.contact_delay_s = phase_contact_s_ - true_contact_s_;
    }
  }
  if (truth.zona_punctured && phase_puncture_s_ >= 0 && !now_.puncture_delay_s) {
    now_.puncture_delay_s = phase_puncture_s_ - truth.zona_puncture_s;
  }
  if (truth.punctured && phase_puncture_s_ >= 0 && !now_.inner_delay_s) {
    now_.inner_delay_s = phase_puncture_s_ - truth.puncture_s;
  }
}

void Measures::measure_dose_and_depth(const rt::TelemetrySample& s, const sim::Truth& truth,
                                      double delivered_s) {
  const double depth_m = -truth.gap_m;
  const bool inside = truth.zona_punctured && depth_m > 0;
  now_.injected_s = now_.injected_s.value_or(0) + (inside ? delivered_s : 0);
  if (has_injector_ && inside && (s.buttons & hal::kButtonInject) != 0) {
    now_.asked_s += period_s_;
  }
  if (truth.punctured) {
    if (!puncture_seen_) {
      puncture_seen_ = true;
      puncture_depth_m_ = depth_m;
    }
    now_.beyond_puncture_m = std::max(now_.beyond_puncture_m.value_or(0), depth_m - puncture_depth_m_);
  }
  if (truth.contact) {
    now_.max_depth_m = std::max(now_.max_depth_m, depth_m);
    now_.peak_force_N = std::max(now_.peak_force_N, truth.axial_force_N);
  }
}

// As the core saw it. Its model tells a depth once it knows a membrane; its phases, whether the tip is
// inside.
Whereabouts Measures::believed() const {
  Whereabouts w;
  w.source = Whereabouts::core;
  switch (last.phase) {
    case rt::Phase::free:
    case rt::Phase::clear:
      w.where = Whereabouts::outside;
      break;
    case rt::Phase::contact:
    case rt::Phase::indentation:
      w.where = Whereabouts::touching;
      break;
    case rt::Phase::puncture:
    case rt::Phase::injection:
    case rt::Phase::withdrawal:
      w.where = Whereabouts::inside;
      break;
  }
  const bool blind = last.obs_age_s < 0 || (last.alarms & rt::alarm_vision_stale) != 0;
  if (blind && w.where == Whereabouts::outside) {
    w.where = Whereabouts::unknown;  // that it touches nothing, only a fresh picture tells
  }
  if (last.R_m > 0 && norm(last.axis) > 0) {
    double depth_m = 0;
    for (int i = 0; i < 3; ++i) {
      depth_m += (last.tip_m[i] - last.entry_m[i]) * last.axis[i];
    }
    w.depth_m = depth_m;
    if (w.where == Whereabouts::inside && depth_m < 0) {
      w.where = Whereabouts::unknown;  // phase and depth contradict each other
    }
  }
  return w;
}

Whereabouts Measures::whereabouts(const sim::Snapshot* later) const {
  if (later != nullptr && later->has_cell != 0) {
    return in_truth(sim::truth_of(sim_, *later));
  }
  if (true_end_) {
    return *true_end_;
  }
  if (!has_phases_) {
    return {.where = Whereabouts::no_cell};
  }
  return any_ ? believed() : Whereabouts{};
}

void Measures::finish() {
  if (!any_) {
    return;
  }
  close_phase(last_s + period_s_);
  close_cell();
}

}  // namespace punctum::tools
