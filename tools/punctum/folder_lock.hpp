// The report folder belongs to one run at a time.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "hal/ipc/segment.hpp"

namespace punctum::tools {

// Held as long as this is there: the kernel drops it with the process, however that dies. Nothing of it lies
// in the folder, and it stays with the folder when that is renamed. On a file system without locks for
// folders it is not held, and says so.
class FolderLock {
 public:
  // The error is one line and names the process that has it.
  [[nodiscard]] static tl::expected<FolderLock, std::string> take(const std::string& folder);

  // Why nobody is kept out; empty where the lock is held.
  [[nodiscard]] const std::string& not_held() const noexcept { return not_held_; }

 private:
  hal::Descriptor folder_;
  std::string not_held_;
};

}  // namespace punctum::tools
