#include "hal/recorded/modules.hpp"

#include <dlfcn.h>

namespace punctum::recorded {
namespace {

// A function of a module, which stays loaded.
template <class Function>
tl::expected<Function, std::string> load(const char* module, const char* function) {
  void* const loaded = dlopen(module, RTLD_NOW | RTLD_LOCAL);
  void* const found = loaded == nullptr ? nullptr : dlsym(loaded, function);
  if (found == nullptr) {
    const char* const why = dlerror();
    return tl::unexpected(std::string("a part of this installation cannot be loaded: ") +
                          (why == nullptr ? module : why));
  }
  return reinterpret_cast<Function>(found);
}

}  // namespace

tl::expected<Pictures, std::string> load_pictures() {
  static const auto module = load<void (*)(Pictures&)>("punctum_pictures.so", "punctum_pictures");
  if (!module) {
    return tl::unexpected(module.error());
  }
  Pictures pictures{};
  (*module)(pictures);
  return pictures;
}

tl::expected<std::unique_ptr<Video>, std::string> load_video() {
  static const auto module = load<Video* (*)()>("punctum_videos.so", "punctum_video");
  if (!module) {
    return tl::unexpected(module.error());
  }
  return std::unique_ptr<Video>((*module)());
}

}  // namespace punctum::recorded
