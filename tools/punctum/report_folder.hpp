// The folder that a run writes its report into.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "tools/scene/scene.hpp"

namespace punctum::tools {

// Makes the folder, or clears it of what an earlier run left there; a folder that holds anybody's own files
// of these names is refused. Empty `wanted`: reports/SCENE-DATE here. Returns its absolute path.
[[nodiscard]] tl::expected<std::string, std::string> prepare_report_folder(const Scene& scene,
                                                                           const std::string& wanted);

}  // namespace punctum::tools
