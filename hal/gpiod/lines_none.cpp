// A build without libgpiod.
#include "hal/gpiod/lines.hpp"

namespace punctum::gpiod {

tl::expected<std::unique_ptr<Chip>, std::string> open_chip(const std::string& /*path*/) {
  return tl::unexpected(std::string("this build has no libgpiod: install libgpiod-dev and build again"));
}

}  // namespace punctum::gpiod
