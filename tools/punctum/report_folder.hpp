// The folder that a run writes its report into.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "tools/punctum/folder_lock.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

struct ReportFolder {
  std::string path;  // absolute
  FolderLock lock;
};

// Makes the folder, or clears it of what an earlier run left there; a folder that another run is writing to,
// or that holds anybody's own files of these names, is refused. Empty `wanted`: reports/SCENE-DATE here.
[[nodiscard]] tl::expected<ReportFolder, std::string> prepare_report_folder(const Scene& scene,
                                                                            const std::string& wanted);

}  // namespace punctum::tools
