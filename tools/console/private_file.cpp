#include "tools/console/private_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

#include "hal/ipc/segment.hpp"

namespace punctum::console {
namespace {

constexpr std::size_t kMost_bytes = 64UL * 1024;

}  // namespace

tl::expected<std::string, std::string> read_file(const std::string& path, Readers readers) {
  const hal::Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) {
    return tl::unexpected(fmt::format("{}: {}", path, std::strerror(errno)));
  }
  struct stat facts{};
  if (fstat(file.number(), &facts) != 0 || !S_ISREG(facts.st_mode)) {
    return tl::unexpected(path + ": not a file");
  }
  if (readers == Readers::owner) {
    if ((facts.st_mode & 077U) != 0) {
      return tl::unexpected(fmt::format("{}: others may read or write it; allowed: mode 0600", path));
    }
    if (facts.st_uid != geteuid() && facts.st_uid != 0) {
      return tl::unexpected(
          fmt::format("{}: it belongs to another user; allowed: this one's, or root's", path));
    }
  }
  std::string text(kMost_bytes + 1, '\0');
  const ssize_t n = read(file.number(), text.data(), text.size());
  if (n < 0 || static_cast<std::size_t>(n) > kMost_bytes) {
    return tl::unexpected(path + ": cannot be read, or is longer than 64 kB");
  }
  text.resize(static_cast<std::size_t>(n));
  return text;
}

}  // namespace punctum::console
