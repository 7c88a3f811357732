// What a run could not write: it goes on without, says so at once, and its report tells.
#pragma once

#include <string>

namespace punctum::tools {

// A file that was not written, or not to its end.
struct NotKept {
  std::string file;  // without its folder
  double t_s = 0;    // of the run, when it was noticed: rows of the moment before may be missing, too
  std::string why;
};

}  // namespace punctum::tools
