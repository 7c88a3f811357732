// The first thing that every program does.
#pragma once

namespace punctum::tools {

// Before anything is opened: descriptors 0, 1 and 2 exist, so that no file and no segment gets one of these
// numbers and is then written to as "standard output". A file that may not grow any more (ulimit -f) is from
// here on an error of the write, not the end of the program.
void start_program() noexcept;

}  // namespace punctum::tools
