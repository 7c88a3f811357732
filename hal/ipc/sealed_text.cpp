#include "hal/ipc/sealed_text.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace punctum::hal {

tl::expected<Descriptor, std::string> seal_text(std::string_view name, std::string_view text) {
  const auto refuse = [name](const char* what) {
    return tl::unexpected(std::string(name) + ": cannot be " + what + ": " + std::strerror(errno));
  };
  Descriptor made(::memfd_create(("punctum." + std::string(name)).c_str(), MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!made) {
    return refuse("handed over");
  }
  while (!text.empty()) {
    const ssize_t written = ::write(made.number(), text.data(), text.size());
    if (written < 0 && errno != EINTR) {
      return refuse("handed over");
    }
    text.remove_prefix(written > 0 ? static_cast<std::size_t>(written) : 0);
  }
  if (::fcntl(made.number(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
    return refuse("sealed");
  }
  return made;
}

std::string inherited_path(const Descriptor& descriptor) {
  return "/proc/self/fd/" + std::to_string(descriptor.number());
}

}  // namespace punctum::hal
