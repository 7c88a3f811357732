#include "hal/sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "hal/sim/valid.hpp"

namespace punctum::sim {
namespace {

ArmImpedance arm_of(const OperatorParams& p) { return {p.arm_stiffness_N_m, p.arm_damping_Ns_m}; }

}  // namespace

World::World(const SimConfig& config, Bench* bench, const SimulatedParts& simulated)
    : config_(config),
      simulated_(simulated),
      bench_(bench),
      operator_(config),
      hand_(config.hand, arm_of(config.operator_params), config.seed),
      stage_(config.stage, config.seed),
      estop_(config) {
  if (config.cell) {
    cell_.emplace(*config.cell, config.needle, config.holder, config.seed, 0);
  }
  if (config.injector && simulated.injector) {
    injector_.emplace(*config.injector, config.seed);
  }
  if (config.holder && simulated.vacuum) {
    vacuum_.emplace(*config.holder, config.seed);
  }
  if (config.force_sensor && simulated.force_sensor) {
    force_sensor_.emplace(*config.force_sensor, config.seed);
  }
  stage_placed_ = simulated.stage;
  snapshot_.has_cell = cell_ ? 1 : 0;
}

void World::begin(std::int64_t start_ns) NONBLOCKING {
  start_ns_ = start_ns;
  t_ns_ = start_ns;
  snapshot_.start_ns = start_ns;
  if (simulated_
          .hand) {  // the tremor shakes the hand before the run begins: the handle starts where the arm is
    operator_.step(0, 0, view());
    HandPlantState hand = hand_.state();
    hand.position_m = operator_.state().arm_target_m;
    hand_.restore(hand);
  }
  step_piece(start_ns);  // of no length: every device has a first reading
  take_snapshot();
}

World::~World() {
  if (bench_ != nullptr) {
    bench_->finished.store(1, std::memory_order_release);
  }
}

double World::seconds(std::int64_t t_ns) const NONBLOCKING {
  return static_cast<double>(t_ns - start_ns_) * 1e-9;
}

OperatorView World::view() const NONBLOCKING {
  OperatorView v;
  v.tip_m = stage_.state().tip_m;
  v.inward = config_.stage.axis.normalized();
  v.hand_m = hand_.state().position_m;
  v.powered = stage_.state().powered != 0 && stage_.state().quick_stopped == 0;
  v.relay_open = simulated_.estop && !estop_.power() && estop_.state().opened_ns != 0;
  v.cell = cell_.has_value();
  if (cell_) {
    v.centre_m = cell_->centre_m(snapshot_.cell);
    v.R_m = cell_->R_m();
    v.punctured = config_.cell->inner ? snapshot_.cell.inner.punctured : snapshot_.cell.outer.punctured;
    v.cell_index = snapshot_.cell_index;
  }
  return v;
}

void World::step(std::int64_t to_ns) NONBLOCKING {
  const bool first = snapshot_.tick == 0;  // it may fall on the start itself
  if (to_ns < t_ns_ || (to_ns == t_ns_ && !first)) {
    return;
  }
  // Pieces no longer than a millisecond; after a long halt of the process fewer, longer ones.
  const std::int64_t piece_ns = std::max(kPiece_ns, (to_ns - t_ns_) / kMostPieces);
  while (t_ns_ < to_ns) {
    step_piece(to_ns - t_ns_ <= piece_ns + kRest_ns ? to_ns : t_ns_ + piece_ns);
  }
  ++snapshot_.tick;
  take_snapshot();
  if (bench_ == nullptr) {
    return;
  }
  bench_->snapshots.push(snapshot_);
  expose();
  if (bench_->virtual_time.load(std::memory_order_relaxed) == 0) {
    bench_->now_ns.store(t_ns_, std::memory_order_release);
  }
}

void World::step_piece(std::int64_t to_ns) NONBLOCKING {
  const double from_s = seconds(t_ns_);
  const double to_s = seconds(to_ns);
  const double dt_s = static_cast<double>(to_ns - t_ns_) * 1e-9;
  const auto failure = failures_at(config_, bench_ != nullptr ? &bench_->failures : nullptr, to_s);
  const auto of = [&failure](Device d) { return failure[static_cast<std::size_t>(d)]; };
  std::copy(failure.begin(), failure.end(), snapshot_.failure.begin());

  if (simulated_.estop) {
    estop_.step(to_ns, from_s, to_s, operator_.state().reset != 0, of(Device::estop));
  }
  const bool power = !simulated_.estop || estop_.power();

  move_hand(to_ns, dt_s, power, of(Device::hand));
  const bool touches = stage_placed_;  // a real stage's first reading is a place, not a motion
  const StagePlantState before = stage_.state();
  move_stage(to_ns, dt_s, power, of(Device::stage));
  if (vacuum_) {
    vacuum_->step(to_ns, dt_s, of(Device::vacuum));
  }
  put_next_cell((hand_.state().buttons & hal::kButtonNextCell) != 0);
  if (touches) {
    touch(before, dt_s);
  }
  if (injector_) {
    injector_->step(to_ns, dt_s, power, of(Device::injector));
  }
  if (force_sensor_) {
    const double axial_N = -snapshot_.cell_reading.force_N.vec().dot(stage_.state().axis.vec());
    force_sensor_->step(to_ns, dt_s, axial_N, of(Device::force_sensor));
  }
  t_ns_ = to_ns;
}

void World::move_hand(std::int64_t to_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING {
  if (!simulated_.hand) {
    if (real_hand_) {
      hand_.follow_real(*real_hand_, dt_s);
    }
    return;
  }
  const Vec3 pulled_to_m = operator_.state().arm_target_m;
  operator_.step(seconds(t_ns_), seconds(to_ns), view());
  const OperatorState& after = operator_.state();
  hand_.set_grip(after.tilt_rad[0], after.tilt_rad[1], after.buttons | after.enabling);
  hand_.step(to_ns, dt_s, pulled_to_m, after.arm_target_m, power, failure);
}

void World::move_stage(std::int64_t to_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING {
  if (simulated_.stage) {
    stage_.step(to_ns, dt_s, power, failure);
  } else if (real_stage_) {
    stage_.follow_real(*real_stage_, stage_placed_ ? dt_s : 0);
    stage_placed_ = true;
  }
}

// On the button's rising edge, unless the needle touches the present cell.
void World::put_next_cell(bool button) NONBLOCKING {
  const bool edge = button && snapshot_.next_cell_was_down == 0;
  snapshot_.next_cell_was_down = button ? 1 : 0;
  if (!edge || !cell_ || snapshot_.cell_reading.contact != 0) {
    return;
  }
  ++snapshot_.cell_index;
  cell_->renew(config_.seed, static_cast<int>(snapshot_.cell_index));
  snapshot_.cell = CellState{};
}

// Moves the needle from `before` to where the stage is now, against the cell.
void World::touch(const StagePlantState& before, double dt_s) NONBLOCKING {
  if (!cell_) {
    return;
  }
  TipMotion motion;
  motion.tip_begin_m = before.tip_m;
  motion.tip_end_m = stage_.state().tip_m;
  motion.axis_begin = before.axis;
  motion.axis_end = stage_.state().axis;
  if (vacuum_) {
    motion.vacuum_Pa = vacuum_->state().pressure_Pa;
  }
  if (stage_.state().braking == 0) {
    motion.left_m = (stage_.state().set_point_m.vec() - before.tip_m.vec()).norm();
    motion.knee_m = config_.stage.velocity_max_m_s * config_.stage.lag_s;
    motion.lag_s = config_.stage.lag_s;
  }
  CellState& s = snapshot_.cell;
  s.time_s = seconds(t_ns_);
  const CellForce f = cell_->step(s, motion, dt_s);
  CellReading& r = snapshot_.cell_reading;
  r.centre_m = cell_->centre_m(s);
  r.R_m = cell_->R_m();
  r.R_inner_m = cell_->R_inner_m();
  r.entry_m = f.entry_m;
  r.depth_m = f.depth_m;
  r.wd_m = f.wd_m;
  r.a_m = f.a_m;
  r.inner_wd_m = f.inner_wd_m;
  r.chord_m = f.chord_m;
  r.force_N = f.force_N;
  r.membrane_N = f.membrane_N;
  r.outer_N = f.outer_N;
  r.inner_N = f.inner_N;
  r.drag_N = f.drag_N;
  r.strain = f.strain;
  r.pressure_Pa = f.pressure_Pa;
  r.contact = f.contact ? 1 : 0;
  r.aims_at_cell = f.aims_at_cell ? 1 : 0;
}

void World::take_snapshot() NONBLOCKING {
  Snapshot& s = snapshot_;
  s.t_ns = t_ns_;
  s.hand = hand_.state();
  s.operator_state = operator_.state();
  s.stage = stage_.state();
  s.estop = estop_.state();
  if (injector_) {
    s.injector = injector_->state();
  }
  if (vacuum_) {
    s.vacuum = vacuum_->state();
  }
  if (force_sensor_) {
    s.force_sensor = force_sensor_->state();
  }
  const auto when = [this](const MembraneState& m) {
    return m.punctured ? start_ns_ + to_ns(m.puncture_time_s) : std::int64_t{0};
  };
  s.zona_puncture_ns = when(s.cell.outer);
  s.puncture_ns = config_.cell && config_.cell->inner ? when(s.cell.inner) : s.zona_puncture_ns;
}

void World::expose() NONBLOCKING {
  if (!config_.microscope) {
    return;
  }
  const std::int64_t frame_ns = to_ns(1 / config_.microscope->fps);
  const auto frame = static_cast<std::uint64_t>((t_ns_ - start_ns_) / frame_ns);
  if (frame < next_frame_) {
    return;
  }
  next_frame_ = frame + 1;
  exposure_.frame = frame;
  exposure_.exposure_ns = t_ns_;
  const bool virtual_time = bench_->virtual_time.load(std::memory_order_relaxed) != 0;
  exposure_.deliver_ns = virtual_time ? t_ns_ + to_ns(config_.microscope->latency_s) : 0;
  exposure_.world = snapshot_;
  const std::uint64_t i = bench_->exposed.load(std::memory_order_relaxed);
  bench_->deliver_ns[i % kExposures].store(exposure_.deliver_ns, std::memory_order_relaxed);
  bench_->exposures.push(exposure_);
  bench_->exposed.store(i + 1, std::memory_order_release);
}

void World::restore(const Snapshot& from) NONBLOCKING {
  snapshot_ = from;
  start_ns_ = from.start_ns;
  t_ns_ = from.t_ns;
  operator_.restore(from.operator_state);
  hand_.restore(from.hand);
  stage_.restore(from.stage);
  estop_.restore(from.estop, from.t_ns);
  if (cell_) {
    cell_->renew(config_.seed, static_cast<int>(from.cell_index));
  }
  if (injector_) {
    injector_->restore(from.injector);
  }
  if (vacuum_) {
    vacuum_->restore(from.vacuum);
  }
  if (force_sensor_) {
    force_sensor_->restore(from.force_sensor);
  }
  if (config_.microscope) {
    next_frame_ = static_cast<std::uint64_t>((t_ns_ - start_ns_) / to_ns(1 / config_.microscope->fps)) + 1;
  }
}

UnattendedEnd run_unattended(const SimConfig& config, const Snapshot& from, Bench* bench, double for_s) {
  constexpr std::int64_t tick_ns = 1'000'000;
  constexpr double shut = 1e-3;  // of the injector's opening
  const auto world = std::make_unique<World>(config, bench, from.start_ns);
  world->restore(from);
  UnattendedEnd end;
  const auto at = [&from](const Snapshot& s) { return static_cast<double>(s.t_ns - from.t_ns) * 1e-9; };
  const auto first = [](double& since, bool now, double t) {
    if (!now) {
      since = -1;
    }
    if (now && since < 0) {
      since = t;
    }
  };
  const std::int64_t last_ns = from.t_ns + to_ns(for_s);
  for (std::int64_t t = from.t_ns + tick_ns; t <= last_ns; t += tick_ns) {
    world->step(t);
    const Snapshot& s = world->snapshot();
    first(end.relay_opened_s, s.estop.relay_closed == 0, at(s));
    first(end.stage_at_rest_s, s.stage.powered == 0 && s.stage.velocity_m_s.vec().isZero(0), at(s));
    first(end.gate_shut_s, s.injector.opening < shut, at(s));
    first(end.hand_force_off_s, s.hand.applied_N.vec().isZero(0), at(s));
  }
  end.last = world->snapshot();
  end.stage_moved_m = (end.last.stage.tip_m.vec() - from.stage.tip_m.vec()).norm();
  end.vacuum_kept = !config.holder || end.last.vacuum.pressure_Pa > 0.5 * config.holder->vacuum_Pa;
  end.cell_held = !config.cell || !end.last.cell.lost();
  end.safe = end.relay_opened_s >= 0 && end.stage_at_rest_s >= 0 && end.gate_shut_s >= 0 &&
             end.hand_force_off_s >= 0 && end.vacuum_kept;
  return end;
}

UnattendedEnd run_unattended(const SimConfig& config, Bench& bench, double for_s) {
  Snapshot newest;
  if (!newest_valid(bench, newest)) {
    return {};  // it died before its first tick
  }
  UnattendedEnd end = run_unattended(config, newest, &bench, for_s);
  bench.now_ns.store(end.last.t_ns, std::memory_order_release);
  return end;
}

}  // namespace punctum::sim
