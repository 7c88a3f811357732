// Catches every heap call of one thread while it is armed. A program that links this object has malloc,
// calloc, realloc, free and the aligned kinds (and with them operator new) go through it: one thread-local
// flag is tested, then glibc's own allocator does the work. Under address, thread and real-time
// sanitizer, and without glibc, there is no trap: armed() then stays false, and nothing is counted.
#pragma once

#include <cstdint>

namespace punctum::rt::allocation_trap {

enum class On : std::uint8_t {
  allocation_count,  // counted, and carried out
  allocation_abort,  // one line on the standard error output, then abort: for tests
};

[[nodiscard]] bool available() noexcept;

// For the calling thread. The count starts from 0.
void arm(On on) noexcept;
[[nodiscard]] bool armed() noexcept;
// Heap calls since arm(); freeing nothing is not one.
std::uint64_t disarm() noexcept;

}  // namespace punctum::rt::allocation_trap
