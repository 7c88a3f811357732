// Vectors whose memory stays: what one gives back lies ready, by its size, for the next that asks for as much
// in the same thread. So a loop that does the same from frame to frame takes none from the heap. Under a
// sanitizer they are ordinary vectors.
#pragma once

#include <cstddef>
#include <vector>

namespace punctum::vision {

namespace kept {

// For the widest registers.
inline constexpr std::size_t kAlignment = 64;
[[nodiscard]] void* take(std::size_t bytes);
void give_back(void* memory, std::size_t bytes) noexcept;
// Takes what a frame may need at once, before the first one; in this thread.
void prepare();

}  // namespace kept

template <class T>
struct KeptAllocator {
  using value_type = T;
  KeptAllocator() = default;
  template <class U>
  KeptAllocator(const KeptAllocator<U>&) noexcept {
  }  // NOLINT(google-explicit-constructor): as the standard asks
  [[nodiscard]] T* allocate(std::size_t n) { return static_cast<T*>(kept::take(n * sizeof(T))); }
  void deallocate(T* p, std::size_t n) noexcept { kept::give_back(p, n * sizeof(T)); }
  friend bool operator==(const KeptAllocator&, const KeptAllocator&) noexcept { return true; }
};

template <class T>
using Vector = std::vector<T, KeptAllocator<T>>;

}  // namespace punctum::vision
