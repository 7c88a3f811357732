// The facts of report.json from what a crash left: samples.csv, events.csv and scene.toml.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace punctum::tools {

// What only the running programs knew (times on the machine, page faults, rights) is null, and `rebuilt` is
// true.
[[nodiscard]] nlohmann::ordered_json rebuilt_facts(const std::string& folder);

}  // namespace punctum::tools
