#include "tools/wire/messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string>

#include "rt/forces/list.hpp"
#include "tools/shared/station_values.hpp"

namespace punctum::tools {
namespace {

void set(v1::Vector& to, const double (&from)[3]) {
  to.set_x(from[0]);
  to.set_y(from[1]);
  to.set_z(from[2]);
}

template <std::size_t N>
void set(google::protobuf::RepeatedPtrField<v1::Vector>& to, const double (&from)[N][3]) {
  to.Clear();
  for (const auto& vector : from) {
    set(*to.Add(), vector);
  }
}

void get(const v1::Vector& from, double (&to)[3]) {
  to[0] = from.x();
  to[1] = from.y();
  to[2] = from.z();
}

void get(const v1::MembraneSurface& from, rt::MembraneSurface& to) {
  const int rows = std::min(from.row_size(), rt::MembraneSurface::kControlPoints);
  for (int i = 0; i < rows; ++i) {
    const v1::MembraneSurface::Row& r = from.row(i);
    const double row[] = {r.middle_x_m(), r.middle_y_m(), r.radius_x_m(), r.radius_y_m(), r.depth_m()};
    std::copy(std::begin(row), std::end(row), to.control_m[i]);
  }
}

std::uint64_t value(const rt::Word& word) { return word.load(std::memory_order_relaxed); }

void set(v1::Histogram& to, const rt::TimeHistogram& from) {
  std::size_t used = rt::TimeHistogram::kBins;
  while (used > 0 && from.bin(used - 1) == 0) {
    --used;
  }
  to.clear_bin();
  for (std::size_t k = 0; k < used; ++k) {
    to.add_bin(from.bin(k));
  }
  to.set_overflow(from.overflow());
  to.set_max_us(from.max_us());
}

void set(v1::MembraneSurface& to, const rt::MembraneSurface& from) {
  for (const auto& row : from.control_m) {
    v1::MembraneSurface::Row& r = *to.add_row();
    r.set_middle_x_m(row[0]);
    r.set_middle_y_m(row[1]);
    r.set_radius_x_m(row[2]);
    r.set_radius_y_m(row[3]);
    r.set_depth_m(row[4]);
  }
}

void set(v1::Picture::Contour& to, const rt::SeenContour& from) {
  to.clear_x_px();
  to.clear_y_px();
  to.clear_sd_px();
  const std::size_t count = std::min<std::size_t>(from.count, rt::SeenContour::kMost);
  for (std::size_t i = 0; i < count; ++i) {
    to.add_x_px(static_cast<double>(from.point[i].x_px));
    to.add_y_px(static_cast<double>(from.point[i].y_px));
    to.add_sd_px(static_cast<double>(from.point[i].sd_px));
  }
}

void get(const v1::Picture::Contour& from, rt::SeenContour& to) {
  const int count = std::min({from.x_px_size(), from.y_px_size(), static_cast<int>(rt::SeenContour::kMost)});
  to.count = static_cast<std::uint32_t>(count);
  for (int i = 0; i < count; ++i) {
    to.point[static_cast<std::size_t>(i)] = {static_cast<float>(from.x_px(i)),
                                             static_cast<float>(from.y_px(i)),
                                             i < from.sd_px_size() ? static_cast<float>(from.sd_px(i)) : 0};
  }
}

// Text of shared memory may be anything, a string of a message is UTF-8: what is not plain becomes '?'.
template <std::size_t N>
std::string plain(const rt::Text<N>& text) {
  std::string s(bounded(text));
  std::replace_if(s.begin(), s.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return s;
}

template <class Enum, class Number>
Enum enumerator(Number number) {
  return static_cast<Enum>(static_cast<int>(number));
}

}  // namespace

void to_wire(const rt::TelemetrySample& from, v1::Telemetry& to) {
  to.set_tick(from.tick);
  to.set_t_s(from.t_s);
  to.set_phase(enumerator<v1::Phase>(from.phase));
  to.set_fault(enumerator<v1::Fault>(from.fault));
  to.set_stop(enumerator<v1::StopStage>(from.stop));
  to.set_estop(from.estop);
  to.set_alarms(from.alarms);
  to.set_buttons(from.buttons);
  to.set_cell(from.cell);
  set(*to.mutable_x_m(), from.x_m);
  set(*to.mutable_v_m_s(), from.v_m_s);
  set(*to.mutable_tip_m(), from.tip_m);
  set(*to.mutable_cmd_m(), from.cmd_m);
  set(*to.mutable_force_n(), from.force_N);
  to.mutable_effect_n()->Assign(from.effect_N, from.effect_N + rt::effect_count);
  to.set_guard_n(from.guard_N);
  to.set_wd_m(from.wd_m);
  to.set_a_m(from.a_m);
  to.set_r_m(from.R_m);
  to.set_tip_force_n(from.tip_force_N);
  to.set_sigma_d_pa(from.sigma_d_Pa);
  to.set_pressure_pa(from.pressure_Pa);
  set(*to.mutable_entry_m(), from.entry_m);
  set(*to.mutable_axis(), from.axis);
  set(*to.mutable_contact_force_n(), from.contact_force_N);
  to.set_obs_age_s(from.obs_age_s);
  to.set_sensor_n(from.sensor_N);
  to.set_vacuum_pa(from.vacuum_Pa);
  to.set_stored_energy_j(from.stored_energy_J);
  to.set_injected_energy_j(from.injected_energy_J);
  to.set_obs_gap_m(from.obs_gap_m);
  to.set_observations(from.observations);
  to.set_stale_ticks(from.stale_ticks);
  to.set_injector_open(from.injector_open != 0);
  to.set_unusable(from.unusable);
  to.set_wd_sd_m(from.wd_sd_m);
  to.set_r_sd_m(from.R_sd_m);
  to.set_tip_force_sd_n(from.tip_force_sd_N);
  to.set_obs_a_m(from.obs_a_m);
  to.set_obs_a_sd_m(from.obs_a_sd_m);
  to.set_e_fit_pa(from.E_fit_Pa);
  to.set_e_fit_sd_pa(from.E_fit_sd_Pa);
}

void to_wire(const rt::Observation& from, v1::Observation& to) {
  to.set_frame(from.frame);
  to.set_exposure_ns(from.exposure_ns);
  to.set_holder_ok(from.has(rt::Observation::holder_ok));
  to.set_tip_ok(from.has(rt::Observation::tip_ok));
  to.set_outer_ok(from.has(rt::Observation::outer_ok));
  to.set_inner_ok(from.has(rt::Observation::inner_ok));
  to.set_contact(from.has(rt::Observation::contact));
  to.set_punctured(from.has(rt::Observation::punctured));
  to.set_inner_punctured(from.has(rt::Observation::inner_punctured));
  set(*to.mutable_tip_m(), from.tip_m);
  set(*to.mutable_axis(), from.axis);
  set(*to.mutable_holder_m(), from.holder_m);
  to.set_holder_score(from.holder_score);
  set(*to.mutable_centre_m(), from.centre_m);
  to.set_r_m(from.R_m);
  to.set_r_inner_m(from.R_inner_m);
  set(*to.mutable_entry_m(), from.entry_m);
  to.set_gap_m(from.gap_m);
  to.set_wd_m(from.wd_m);
  to.set_a_m(from.a_m);
  to.set_membrane_velocity_m_s(from.membrane_velocity_m_s);
  set(*to.mutable_contact_point_m(), from.contact_point_m);
  to.set_noise_m(from.noise_m);
  to.set_wd_sd_m(from.wd_sd_m);
  to.set_a_sd_m(from.a_sd_m);
  to.set_r_sd_m(from.R_sd_m);
  to.set_total_us(from.total_us);
}

void to_wire(const rt::InputSample& from, v1::Input& to) {
  to.set_number(from.number);
  to.set_tick(from.tick);
  to.set_release_ns(from.release_ns);
  to.set_start_ns(from.start_ns);
  to.set_period_s(from.period_s);
  to.set_missed_in_window(from.missed_in_window);
  to.set_observations(from.observations);
  to.set_flags(from.flags);
  to.set_answers(from.answers);
  set(*to.mutable_hand_m(), from.hand_m);
  to.clear_hand_wxyz();
  to.mutable_hand_wxyz()->Add(std::begin(from.hand_wxyz), std::end(from.hand_wxyz));
  to.set_hand_ns(from.hand_ns);
  to.set_buttons(from.buttons);
  set(*to.mutable_tip_m(), from.tip_m);
  set(*to.mutable_axis(), from.axis);
  set(*to.mutable_following_error_m(), from.following_error_m);
  to.set_stage_ns(from.stage_ns);
  to.set_estop_ns(from.estop_ns);
  to.set_enabling_ns(from.enabling_ns);
  to.set_injector_ns(from.injector_ns);
  to.set_vacuum_ns(from.vacuum_ns);
  to.set_force_sensor_ns(from.force_sensor_ns);
  to.set_vacuum_pa(from.vacuum_Pa);
  to.set_axial_n(from.axial_N);
}

void to_wire(const rt::CellSurface& from, v1::CellSurface& to) {
  to.Clear();
  to.set_frame(from.frame);
  to.set_exposure_ns(from.exposure_ns);
  if (from.has(rt::CellSurface::outer_ok)) {
    set(*to.mutable_outer(), from.outer);
  }
  if (from.has(rt::CellSurface::inner_ok)) {
    set(*to.mutable_inner(), from.inner);
  }
}

void to_wire(const rt::Event& from, v1::Event& to) {
  to.set_tick(from.tick);
  to.set_t_s(from.t_s);
  to.set_kind(enumerator<v1::Event::Kind>(from.kind));
  switch (from.kind) {
    case rt::Event::fault:
    case rt::Event::fault_cleared:
      to.set_fault(enumerator<v1::Fault>(from.what));
      break;
    case rt::Event::alarm_on:
    case rt::Event::alarm_off:
      to.set_alarm(enumerator<v1::Alarm>(from.what));
      break;
    case rt::Event::phase:
      to.set_phase(enumerator<v1::Phase>(from.what));
      break;
    case rt::Event::command:
    case rt::Event::command_refused:
      to.set_command(enumerator<v1::CommandKind>(from.what));
      break;
    case rt::Event::ended:
      to.set_end(enumerator<v1::RunEnd>(from.what));
      break;
    default:
      to.set_unknown(from.what);
  }
  to.set_value(from.value);
  to.set_target(from.target);
  to.set_writer(from.writer);
}

void to_wire(const rt::PictureHead& from, v1::Picture& to) {
  to.set_frame(from.frame);
  to.set_exposure_ns(from.exposure_ns);
  to.set_width(from.width);
  to.set_height(from.height);
  to.set_step_px(from.step_px);
  to.set_pixel_m(static_cast<double>(from.pixel_m));
  to.clear_outer();
  to.clear_inner();
  if (from.outer.count > 0) {
    set(*to.mutable_outer(), from.outer);
  }
  if (from.inner.count > 0) {
    set(*to.mutable_inner(), from.inner);
  }
}

void to_wire(const rt::CoreStatus& from, v1::Status& to) {
  to.set_pid(value(from.pid));
  to.set_started(value(from.started) != 0);
  to.set_start_ns(static_cast<std::int64_t>(value(from.start_ns)));
  to.set_period_ns(value(from.period_ns));
  to.set_ticks(value(from.ticks));
  to.set_missed(value(from.missed));
  to.set_missed_in_window(value(from.missed_in_window));
  to.set_worst_lateness_ns(value(from.worst_lateness_ns));
  to.set_degraded(value(from.degraded) != 0);
  to.set_fault(enumerator<v1::Fault>(value(from.fault)));
  to.set_faults_latched(value(from.faults_latched));
  to.set_phase(enumerator<v1::Phase>(value(from.phase)));
  to.set_task_finished(value(from.task_finished) != 0);
  to.set_run_end(enumerator<v1::RunEnd>(value(from.run_end)));
  to.set_commands_refused(value(from.commands_refused));
  to.set_minor_faults(value(from.minor_faults));
  to.set_major_faults(value(from.major_faults));
  set(*to.mutable_wake(), from.wake);
  set(*to.mutable_tick(), from.tick);
  to.clear_slot();
  const std::uint64_t slots =
      std::min<std::uint64_t>(from.slot_count.load(std::memory_order_acquire), rt::kMaxSlots);
  for (std::uint64_t i = 0; i < slots; ++i) {
    v1::Slot& slot = *to.add_slot();
    slot.set_name(plain(from.slots[i].name));
    slot.set_divisor(value(from.slots[i].divisor));
    slot.set_runs(value(from.slots[i].runs));
    slot.set_skipped(value(from.slots[i].skipped));
    set(*slot.mutable_wake(), from.slots[i].wake);
    set(*slot.mutable_execution(), from.slots[i].execution);
  }
  to.clear_right();
  const std::uint64_t rights =
      std::min<std::uint64_t>(from.rights_count.load(std::memory_order_acquire), rt::kMaxRights);
  for (std::uint64_t i = 0; i < rights; ++i) {
    v1::Right& right = *to.add_right();
    right.set_name(plain(from.rights[i].name));
    right.set_detail(plain(from.rights[i].detail));
    right.set_remedy(plain(from.rights[i].remedy));
    right.set_got(from.rights[i].got != 0);
    right.set_required(from.rights[i].required != 0);
  }
}

bool from_wire(const v1::Telemetry& from, rt::TelemetrySample& to) {
  const auto phase = phase_in(static_cast<std::uint64_t>(from.phase()));
  const auto fault = fault_in(static_cast<std::uint64_t>(from.fault()));
  if (!phase || !fault || !v1::StopStage_IsValid(from.stop())) {
    return false;
  }
  to = {};
  to.tick = from.tick();
  to.t_s = from.t_s();
  to.phase = *phase;
  to.fault = *fault;
  to.stop = static_cast<rt::StopStage>(from.stop());
  to.estop = static_cast<std::uint8_t>(from.estop());
  to.alarms = from.alarms();
  to.buttons = from.buttons();
  to.cell = from.cell();
  get(from.x_m(), to.x_m);
  get(from.v_m_s(), to.v_m_s);
  get(from.tip_m(), to.tip_m);
  get(from.cmd_m(), to.cmd_m);
  get(from.force_n(), to.force_N);
  const int effects = std::min(from.effect_n_size(), static_cast<int>(rt::kMaxEffects));
  std::copy_n(from.effect_n().begin(), effects, to.effect_N);
  to.guard_N = from.guard_n();
  to.wd_m = from.wd_m();
  to.a_m = from.a_m();
  to.R_m = from.r_m();
  to.tip_force_N = from.tip_force_n();
  to.sigma_d_Pa = from.sigma_d_pa();
  to.pressure_Pa = from.pressure_pa();
  get(from.entry_m(), to.entry_m);
  get(from.axis(), to.axis);
  for (int i = 0; i < std::min(from.contact_force_n_size(), static_cast<int>(std::size(to.contact_force_N)));
       ++i) {
    get(from.contact_force_n(i), to.contact_force_N[i]);
  }
  to.obs_age_s = from.obs_age_s();
  to.sensor_N = from.sensor_n();
  to.vacuum_Pa = from.vacuum_pa();
  to.stored_energy_J = from.stored_energy_j();
  to.injected_energy_J = from.injected_energy_j();
  to.obs_gap_m = from.obs_gap_m();
  to.observations = from.observations();
  to.stale_ticks = from.stale_ticks();
  to.injector_open = from.injector_open() ? 1 : 0;
  to.unusable = static_cast<std::uint8_t>(from.unusable());
  to.wd_sd_m = from.wd_sd_m();
  to.R_sd_m = from.r_sd_m();
  to.tip_force_sd_N = from.tip_force_sd_n();
  to.obs_a_m = from.obs_a_m();
  to.obs_a_sd_m = from.obs_a_sd_m();
  to.E_fit_Pa = from.e_fit_pa();
  to.E_fit_sd_Pa = from.e_fit_sd_pa();
  return usable(to);
}

void from_wire(const v1::Observation& from, rt::Observation& to) {
  to = {};
  to.frame = from.frame();
  to.exposure_ns = from.exposure_ns();
  to.flags =
      (from.holder_ok() ? rt::Observation::holder_ok : 0U) | (from.tip_ok() ? rt::Observation::tip_ok : 0U) |
      (from.outer_ok() ? rt::Observation::outer_ok : 0U) |
      (from.inner_ok() ? rt::Observation::inner_ok : 0U) | (from.contact() ? rt::Observation::contact : 0U) |
      (from.punctured() ? rt::Observation::punctured : 0U) |
      (from.inner_punctured() ? rt::Observation::inner_punctured : 0U);
  get(from.tip_m(), to.tip_m);
  get(from.axis(), to.axis);
  get(from.holder_m(), to.holder_m);
  to.holder_score = from.holder_score();
  get(from.centre_m(), to.centre_m);
  to.R_m = from.r_m();
  to.R_inner_m = from.r_inner_m();
  get(from.entry_m(), to.entry_m);
  to.gap_m = from.gap_m();
  to.wd_m = from.wd_m();
  to.a_m = from.a_m();
  to.membrane_velocity_m_s = from.membrane_velocity_m_s();
  for (int i = 0; i < std::min(from.contact_point_m_size(), static_cast<int>(std::size(to.contact_point_m)));
       ++i) {
    get(from.contact_point_m(i), to.contact_point_m[i]);
  }
  to.noise_m = from.noise_m();
  to.wd_sd_m = from.wd_sd_m();
  to.a_sd_m = from.a_sd_m();
  to.R_sd_m = from.r_sd_m();
  to.total_us = from.total_us();
}

void from_wire(const v1::Input& from, rt::InputSample& to) {
  to = {};
  to.number = from.number();
  to.tick = from.tick();
  to.release_ns = from.release_ns();
  to.start_ns = from.start_ns();
  to.period_s = from.period_s();
  to.missed_in_window = from.missed_in_window();
  to.observations = from.observations();
  to.flags = from.flags();
  to.answers = from.answers();
  get(from.hand_m(), to.hand_m);
  std::copy_n(from.hand_wxyz().begin(),
              std::min(from.hand_wxyz_size(), static_cast<int>(std::size(to.hand_wxyz))), to.hand_wxyz);
  to.hand_ns = from.hand_ns();
  to.buttons = from.buttons();
  get(from.tip_m(), to.tip_m);
  get(from.axis(), to.axis);
  get(from.following_error_m(), to.following_error_m);
  to.stage_ns = from.stage_ns();
  to.estop_ns = from.estop_ns();
  to.enabling_ns = from.enabling_ns();
  to.injector_ns = from.injector_ns();
  to.vacuum_ns = from.vacuum_ns();
  to.force_sensor_ns = from.force_sensor_ns();
  to.vacuum_Pa = from.vacuum_pa();
  to.axial_N = from.axial_n();
}

void from_wire(const v1::CellSurface& from, rt::CellSurface& to) {
  to = {};
  to.frame = from.frame();
  to.exposure_ns = from.exposure_ns();
  if (from.has_outer()) {
    to.flags |= rt::CellSurface::outer_ok;
    get(from.outer(), to.outer);
  }
  if (from.has_inner()) {
    to.flags |= rt::CellSurface::inner_ok;
    get(from.inner(), to.inner);
  }
}

bool from_wire(const v1::Picture& from, rt::PictureHead& to) {
  if (std::uint64_t{from.width()} * from.height() != from.grey().size()) {
    return false;
  }
  to = {.frame = from.frame(),
        .exposure_ns = from.exposure_ns(),
        .width = from.width(),
        .height = from.height(),
        .step_px = std::max(from.step_px(), 1U),
        .pixel_m = static_cast<float>(from.pixel_m())};
  if (from.has_outer()) {
    get(from.outer(), to.outer);
  }
  if (from.has_inner()) {
    get(from.inner(), to.inner);
  }
  return true;
}

void from_wire(const v1::Histogram& from, rt::TimeHistogram& to) {
  constexpr double kLongest_us = 1e15;
  const auto bins = static_cast<std::size_t>(from.bin_size());
  const double max_us = from.max_us() >= 0 && from.max_us() < kLongest_us ? from.max_us() : 0;
  to.show({from.bin().data(), bins}, from.overflow(), static_cast<std::uint64_t>(std::llround(max_us * 1e3)));
}

void from_wire(const v1::Event& from, rt::Event& to) {
  to = {};
  to.tick = from.tick();
  to.t_s = from.t_s();
  to.kind = static_cast<std::uint64_t>(from.kind());
  switch (from.what_case()) {
    case v1::Event::kFault:
      to.what = static_cast<std::uint64_t>(from.fault());
      break;
    case v1::Event::kAlarm:
      to.what = static_cast<std::uint64_t>(from.alarm());
      break;
    case v1::Event::kPhase:
      to.what = static_cast<std::uint64_t>(from.phase());
      break;
    case v1::Event::kCommand:
      to.what = static_cast<std::uint64_t>(from.command());
      break;
    case v1::Event::kEnd:
      to.what = static_cast<std::uint64_t>(from.end());
      break;
    case v1::Event::kUnknown:
      to.what = from.unknown();
      break;
    case v1::Event::WHAT_NOT_SET:
      break;
  }
  to.value = from.value();
  to.target = from.target();
  to.writer = from.writer();
}

}  // namespace punctum::tools
