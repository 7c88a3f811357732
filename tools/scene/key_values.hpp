// One value of a TOML file goes into the parameter that its key sets.
#pragma once

#include <filesystem>
#include <string>

#include "tools/scene/scene_keys.hpp"
#include "tools/scene/toml_document.hpp"

namespace punctum::tools {

// Returns what is wrong with the value; empty if it was stored. A path is taken relative to `folder`, if
// there is one: a scene can be moved together with its frames.
[[nodiscard]] std::string store(const Key& key, const toml::node& node, const std::filesystem::path& folder);

}  // namespace punctum::tools
