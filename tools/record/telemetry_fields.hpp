// Every field of a telemetry sample by its name, for whoever compares two.
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/station/telemetry.hpp"

namespace punctum::tools {

struct TelemetryField {
  enum Type : std::uint8_t { byte, word, count, number };
  const char* name;
  std::size_t offset;
  Type type;
  std::size_t values = 1;
};

[[nodiscard]] constexpr std::size_t size_of(TelemetryField::Type type) {
  return type == TelemetryField::byte ? 1 : type == TelemetryField::word ? 4 : 8;
}

#define PUNCTUM_FIELD(name, type, ...)                                                          \
  TelemetryField {                                                                              \
    #name, offsetof(rt::TelemetrySample, name), TelemetryField::type __VA_OPT__(, ) __VA_ARGS__ \
  }
inline constexpr TelemetryField kTelemetryFields[] = {
    PUNCTUM_FIELD(tick, count),
    PUNCTUM_FIELD(t_s, number),
    PUNCTUM_FIELD(phase, byte),
    PUNCTUM_FIELD(fault, byte),
    PUNCTUM_FIELD(stop, byte),
    PUNCTUM_FIELD(estop, byte),
    PUNCTUM_FIELD(alarms, word),
    PUNCTUM_FIELD(buttons, word),
    PUNCTUM_FIELD(cell, word),
    PUNCTUM_FIELD(x_m, number, 3),
    PUNCTUM_FIELD(v_m_s, number, 3),
    PUNCTUM_FIELD(tip_m, number, 3),
    PUNCTUM_FIELD(cmd_m, number, 3),
    PUNCTUM_FIELD(force_N, number, 3),
    PUNCTUM_FIELD(effect_N, number, rt::kMaxEffects),
    PUNCTUM_FIELD(guard_N, number),
    PUNCTUM_FIELD(wd_m, number),
    PUNCTUM_FIELD(a_m, number),
    PUNCTUM_FIELD(R_m, number),
    PUNCTUM_FIELD(tip_force_N, number),
    PUNCTUM_FIELD(sigma_d_Pa, number),
    PUNCTUM_FIELD(pressure_Pa, number),
    PUNCTUM_FIELD(entry_m, number, 3),
    PUNCTUM_FIELD(axis, number, 3),
    PUNCTUM_FIELD(contact_force_N, number, 12),
    PUNCTUM_FIELD(obs_age_s, number),
    PUNCTUM_FIELD(sensor_N, number),
    PUNCTUM_FIELD(vacuum_Pa, number),
    PUNCTUM_FIELD(stored_energy_J, number),
    PUNCTUM_FIELD(injected_energy_J, number),
    PUNCTUM_FIELD(obs_gap_m, number),
    PUNCTUM_FIELD(observations, count),
    PUNCTUM_FIELD(stale_ticks, count),
    PUNCTUM_FIELD(injector_open, byte),
    PUNCTUM_FIELD(unusable, byte),
    PUNCTUM_FIELD(pad, byte, 6),
    PUNCTUM_FIELD(wd_sd_m, number),
    PUNCTUM_FIELD(R_sd_m, number),
    PUNCTUM_FIELD(tip_force_sd_N, number),
    PUNCTUM_FIELD(obs_a_m, number),
    PUNCTUM_FIELD(obs_a_sd_m, number),
    PUNCTUM_FIELD(E_fit_Pa, number),
    PUNCTUM_FIELD(E_fit_sd_Pa, number),
};
#undef PUNCTUM_FIELD

// A field that the sample has and this list has not does not compile.
[[nodiscard]] consteval bool covers_the_sample() {
  std::size_t at = 0;
  for (const TelemetryField& f : kTelemetryFields) {
    if (f.offset != at) {
      return false;
    }
    at += f.values * size_of(f.type);
  }
  return at == sizeof(rt::TelemetrySample);
}
static_assert(covers_the_sample());

}  // namespace punctum::tools
