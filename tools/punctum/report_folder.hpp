// The folder that a run writes its report into.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "tools/punctum/folder_lock.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

// Where a run writes, and where its report is to be found afterwards.
struct ReportFolder {
  std::string folder;    // absolute
  std::string replaces;  // an earlier report whose place it takes once it is whole; empty: none
  std::string note;      // one line on why it is not the folder that was wanted; empty where it is
  bool is_new = false;   // made for this run
  FolderLock lock;       // held until the report is whole
};

// Makes a new folder, reports/SCENE-DATE here where none is wanted. A folder that holds the report of an
// earlier run is left alone: the run writes beside it, into FOLDER-2, and takes its place only in
// take_place(). A folder that another run is writing to, or that holds anybody's own files of a report's
// names, is refused. Nothing is cleared.
[[nodiscard]] tl::expected<ReportFolder, std::string> prepare_report_folder(const Scene& scene,
                                                                            const std::string& wanted,
                                                                            bool overwrite);

// Moves a whole report to the place of the one it replaces, whose files go; other files there stay. Returns
// where the report is then.
[[nodiscard]] tl::expected<std::string, std::string> take_place(const ReportFolder& report);

// A run that has not begun leaves no report: removes what it wrote into its folder, and the folder if it was
// made for it.
void discard(const ReportFolder& report);

}  // namespace punctum::tools
