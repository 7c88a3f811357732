// What was run, when, by which version, and on which machine: written at the start of a run, so that a crash
// leaves it.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "tools/scene/scene.hpp"

namespace punctum::tools {

inline constexpr const char* kBegun = "begun.json";  // in the report folder

[[nodiscard]] nlohmann::ordered_json provenance(const Scene& scene);

}  // namespace punctum::tools
