#include "tools/punctum/folder_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

namespace punctum::tools {
namespace {

// "process N", from the kernel's table of locks: "1: FLOCK ADVISORY WRITE PID MAJOR:MINOR:INODE ..." with the
// device in hexadecimal. Of a process in another container no number is known.
std::string holder_of(const struct stat& file) {
  const std::string wanted =
      fmt::format("{:02x}:{:02x}:{}", major(file.st_dev), minor(file.st_dev), file.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, advisory, mode, where;
    long pid = 0;
    if (words >> number >> kind >> advisory >> mode >> pid >> where && kind == "FLOCK" && where == wanted &&
        pid > 0) {
      return fmt::format("process {}", pid);
    }
  }
  return "another process";
}

}  // namespace

tl::expected<FolderLock, std::string> FolderLock::take(const std::string& folder) {
  FolderLock lock;
  lock.folder_ = hal::Descriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  struct stat file = {};
  if (!lock.folder_ || fstat(lock.folder_.number(), &file) != 0) {
    return tl::unexpected(
        fmt::format("{}: cannot be used as report folder: {}", folder, std::strerror(errno)));
  }
  int failed = 0;
  do {
    failed = flock(lock.folder_.number(), LOCK_EX | LOCK_NB);
  } while (failed != 0 && errno == EINTR);
  if (failed != 0 && errno == EWOULDBLOCK) {
    return tl::unexpected(
        fmt::format("{}: another run writes its report there ({})", folder, holder_of(file)));
  }
  if (failed != 0) {
    lock.not_held_ = fmt::format("{}: its file system cannot lock a folder ({}); start no other run into it",
                                 folder, std::strerror(errno));
  }
  return lock;
}

}  // namespace punctum::tools
