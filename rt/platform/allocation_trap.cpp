#include "rt/platform/allocation_trap.hpp"

#include <cstdlib>

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || \
    __has_feature(memory_sanitizer) || __has_feature(realtime_sanitizer)
#define PUNCTUM_SANITIZED
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PUNCTUM_SANITIZED
#endif

#if defined(__GLIBC__) && !defined(PUNCTUM_SANITIZED)

#include <malloc.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>

// glibc's allocator under its second name. NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" {
void* __libc_malloc(std::size_t size) noexcept;
void* __libc_calloc(std::size_t count, std::size_t size) noexcept;
void* __libc_realloc(void* block, std::size_t size) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t size) noexcept;
void __libc_free(void* block) noexcept;
}
// NOLINTEND(bugprone-reserved-identifier)

namespace punctum::rt::allocation_trap {
namespace {

struct Watch {
  bool armed = false;
  On on = On::allocation_count;
  std::uint64_t count = 0;
};
// Initial-exec: reading it never allocates.
[[gnu::tls_model("initial-exec")]] thread_local constinit Watch watch;

[[gnu::cold, gnu::noinline]] void caught(const char* call) noexcept {
  ++watch.count;
  if (watch.on == On::allocation_count) {
    return;
  }
  watch.armed = false;
  for (const char* part : {"heap call in the real-time loop: ", call, "\n"}) {
    (void)!::write(STDERR_FILENO, part, std::strlen(part));
  }
  std::abort();
}

void pass(const char* call) noexcept {
  if (__builtin_expect(static_cast<long>(watch.armed), 0L) != 0) {
    caught(call);
  }
}

bool power_of_two(std::size_t n) noexcept { return n != 0 && (n & (n - 1)) == 0; }

}  // namespace

bool available() noexcept { return true; }

void arm(On on) noexcept { watch = {.armed = true, .on = on, .count = 0}; }

bool armed() noexcept { return watch.armed; }

std::uint64_t disarm() noexcept {
  watch.armed = false;
  return watch.count;
}

}  // namespace punctum::rt::allocation_trap

using punctum::rt::allocation_trap::pass;
using punctum::rt::allocation_trap::power_of_two;

extern "C" {

void* malloc(std::size_t size) noexcept {
  pass("malloc");
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  pass("calloc");
  return __libc_calloc(count, size);
}

void* realloc(void* block, std::size_t size) noexcept {
  pass("realloc");
  return __libc_realloc(block, size);
}

void* reallocarray(void* block, std::size_t count, std::size_t size) noexcept {
  pass("reallocarray");
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_realloc(block, bytes);
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  pass("memalign");
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  pass("aligned_alloc");
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  pass("posix_memalign");
  if (alignment % sizeof(void*) != 0 || !power_of_two(alignment)) {
    return EINVAL;
  }
  void* made = __libc_memalign(alignment, size);
  if (made == nullptr) {
    return ENOMEM;
  }
  *block = made;
  return 0;
}

void* valloc(std::size_t size) noexcept {
  pass("valloc");
  return __libc_memalign(static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)), size);
}

void* pvalloc(std::size_t size) noexcept {
  pass("pvalloc");
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return __libc_memalign(page, (size + page - 1) / page * page);
}

void free(void* block) noexcept {
  if (block == nullptr) {
    return;
  }
  pass("free");
  __libc_free(block);
}

}  // extern "C"

#else

namespace punctum::rt::allocation_trap {

bool available() noexcept { return false; }
void arm(On /*on*/) noexcept {}
bool armed() noexcept { return false; }
std::uint64_t disarm() noexcept { return 0; }

}  // namespace punctum::rt::allocation_trap

#endif
