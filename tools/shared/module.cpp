#include "tools/shared/module.hpp"

#include <dlfcn.h>

namespace punctum::tools {

tl::expected<void*, std::string> function_of_module(const char* module, const char* function) {
  void* const loaded = dlopen(module, RTLD_NOW | RTLD_LOCAL);
  void* const found = loaded == nullptr ? nullptr : dlsym(loaded, function);
  if (found == nullptr) {
    const char* const why = dlerror();
    return tl::unexpected(std::string(why == nullptr ? module : why));
  }
  return found;
}

}  // namespace punctum::tools
