// How a run came out, in a sentence or two, from the facts of report.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace punctum::tools {

[[nodiscard]] std::string run_sentence(const nlohmann::ordered_json& facts);

// A delay of something seen after it happened. Vision may foresee: "20 ms after it", "20 ms before it".
[[nodiscard]] std::string after_or_before(std::optional<double> delay_ms, const char* what);

}  // namespace punctum::tools
