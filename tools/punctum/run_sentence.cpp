#include "tools/punctum/run_sentence.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "rt/station/run_end.hpp"
#include "tools/punctum/facts.hpp"
#include "tools/shared/fault_advice.hpp"

namespace punctum::tools {
namespace {

using Json = nlohmann::ordered_json;
using rt::RunEnd;

constexpr double kSameTime_ms = 0.5;

std::string ending(const Json& facts) {
  const std::string word = text_in(facts, "outcome"), detail = text_in(facts, "outcome_detail");
  const Json& cells = fact(facts, "cells");
  const double tried = number_in(cells, "tried").value_or(0);
  const auto done = number_in(cells, "done");
  const std::string after = fmt::format("after {:.1f} s", number_in(facts, "seconds").value_or(0));
  const auto is = [&word](RunEnd end) { return word == rt::name(end); };
  if (is(RunEnd::done)) {
    return tried > 0 && done
               ? fmt::format("The task ended well {}: {:.0f} of {:.0f} cells injected.", after, *done, tried)
               : fmt::format("The run ended well {}.", after);
  }
  if (is(RunEnd::fault)) {
    const auto fault = fault_named(detail);
    return fmt::format(
        "The station stopped {} with a latched fault, {}{}.", after, detail,
        fault ? fmt::format(": {}", kFaultAdvice[static_cast<std::size_t>(*fault)].cause) : "");
  }
  if (is(RunEnd::core_died)) {
    return fmt::format("The control core {} {}; the needle was left to the drive and the relay.",
                       detail.empty() ? "died" : detail, after);
  }
  if (is(RunEnd::cell_lost)) {
    return fmt::format("A cell was lost: torn, pierced through or off its pipette; the run ended {}.", after);
  }
  if (is(RunEnd::not_injected)) {
    return fmt::format("The run came to its end {}, but a cell got nothing.", after);
  }
  if (is(RunEnd::time_limit)) {
    return fmt::format("The time limit came {}, before the task was done.", after);
  }
  if (is(RunEnd::stopped)) {
    return fmt::format("The run was stopped {}, before the task was done.", after);
  }
  if (is(RunEnd::underdosed)) {
    return fmt::format("The run came to its end {}, but a cell got clearly less than was asked.", after);
  }
  if (is(RunEnd::after_fault)) {
    return fmt::format("The task ended well {}, but a fault was latched and reset on the way.", after);
  }
  if (is(RunEnd::blind)) {
    return fmt::format("The run ended {}, but vision saw nothing for most of it.", after);
  }
  return fmt::format("How the run ended is not known{}; what was recorded ends {}.",
                     detail.empty() ? "" : " (" + detail + ")", after);
}

}  // namespace

std::string run_sentence(const Json& facts) {
  std::string s = ending(facts);
  if (const auto lost = number_in(fact(facts, "samples"), "lost"); lost && *lost > 0) {
    s += fmt::format(" {:.0f} samples of it are missing, and what can lie in them is not known.", *lost);
  }
  if (const auto restarts = list_in(facts, "vision_restarts").size(); restarts > 0) {
    s += fmt::format(" Vision died or hung {} on the way.",
                     restarts == 1 ? "once" : fmt::format("{} times", restarts));
  }
  const Json& needle = fact(facts, "needle_at_end");
  const std::string where = text_in(needle, "where");
  if (where == "unknown") {
    s += " Where the needle was at the end is not known.";
  } else if (!where.empty() && where != "no cell") {
    s += fmt::format(" At the end the needle was {}.", text_in(needle, "in_words"));
  }
  const Json& dose = fact(facts, "dose");
  const auto asked = number_in(dose, "asked_s"), given = number_in(dose, "given_s");
  if (asked && given && *asked > 0) {
    s += fmt::format(" The injector was open in the cell for {:.2f} s of {:.2f} s asked.", *given, *asked);
  }
  if (dose.is_object() && !given) {
    s += " How much the cell was given is not known.";
  }
  return s;
}

std::string after_or_before(std::optional<double> delay_ms, const char* what) {
  if (!delay_ms) {
    return "-";
  }
  if (std::abs(*delay_ms) < kSameTime_ms) {
    return fmt::format("just as {}", what);
  }
  return fmt::format("{:.3g} ms {} {}", std::abs(*delay_ms), *delay_ms > 0 ? "after" : "before", what);
}

}  // namespace punctum::tools
