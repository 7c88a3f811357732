// How often this thread has taken memory, by any library: PUNCTUM_COUNTS_MEMORY says whether it is counted.
// In one source of a program, for it replaces malloc.
#pragma once

#include <cerrno>
#include <cstddef>

#if defined(__GLIBC__) && !defined(PUNCTUM_SANITIZED)
#define PUNCTUM_COUNTS_MEMORY
static thread_local long memory_taken = 0;
extern "C" {  // glibc has its own under these names
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* malloc(std::size_t size) noexcept {
  ++memory_taken;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  ++memory_taken;
  return __libc_calloc(count, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++memory_taken;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  ++memory_taken;
  *out = __libc_memalign(alignment, size);
  return *out == nullptr ? ENOMEM : 0;
}
}
#endif
