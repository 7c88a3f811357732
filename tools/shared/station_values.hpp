// What is read from a station's segments is checked where it is read: who writes it may be defective.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "rt/station/core_status.hpp"
#include "rt/station/fault.hpp"
#include "rt/station/phase.hpp"
#include "rt/station/run_end.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::tools {

// The enumerator that a word of the core's status stands for; nothing where there is none.
[[nodiscard]] inline std::optional<rt::Phase> phase_in(std::uint64_t word) noexcept {
  return word < rt::kPhases ? std::optional(static_cast<rt::Phase>(word)) : std::nullopt;
}
[[nodiscard]] inline std::optional<rt::Fault> fault_in(std::uint64_t word) noexcept {
  return word < rt::kFaults ? std::optional(static_cast<rt::Fault>(word)) : std::nullopt;
}
[[nodiscard]] inline std::optional<rt::RunEnd> run_end_in(std::uint64_t word) noexcept {
  return word < rt::kRunEnds ? std::optional(static_cast<rt::RunEnd>(word)) : std::nullopt;
}

// Whether a sample names a phase, a fault and a stop that exist, at a time that can be.
[[nodiscard]] inline bool usable(const rt::TelemetrySample& s) noexcept {
  constexpr double kLongestRun_s = 1e9;
  return phase_in(static_cast<std::uint64_t>(s.phase)) && fault_in(static_cast<std::uint64_t>(s.fault)) &&
         s.stop <= rt::StopStage::stopped && s.t_s >= 0 && s.t_s < kLongestRun_s;
}

// The text, which need not have an end of its own.
template <std::size_t N>
[[nodiscard]] std::string_view bounded(const rt::Text<N>& text) noexcept {
  return {text.text, static_cast<std::size_t>(std::find(text.text, text.text + N, '\0') - text.text)};
}

}  // namespace punctum::tools
