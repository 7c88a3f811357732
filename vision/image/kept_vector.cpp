#include "vision/image/kept_vector.hpp"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <bit>
#include <new>

namespace punctum::vision::kept {

namespace {

// Powers of two from 64 bytes on; what is larger than the largest is not kept.
constexpr std::size_t kSizes = 16, kSmallest = 64, kLargest = kSmallest << (kSizes - 1);

struct Free {
  Free* next;
};

std::size_t size_of(std::size_t shelf) { return kSmallest << shelf; }
std::size_t shelf_of(std::size_t bytes) {
  return static_cast<std::size_t>(std::bit_width(std::max(bytes, kSmallest) - 1)) -
         static_cast<std::size_t>(std::bit_width(kSmallest - 1));
}

void* from_heap(std::size_t bytes) { return ::operator new(bytes, std::align_val_t{kAlignment}); }
void to_heap(void* memory) noexcept { ::operator delete(memory, std::align_val_t{kAlignment}); }

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define PUNCTUM_NOTHING_KEPT
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PUNCTUM_NOTHING_KEPT
#endif
#ifdef PUNCTUM_NOTHING_KEPT
constexpr bool kKept = false;
#else
constexpr bool kKept = true;
#endif

thread_local bool thread_ends = false;  // some vectors outlive the shelves

struct Shelves {
  std::array<Free*, kSizes> first{};

  ~Shelves() {
    thread_ends = true;
    for (Free* free : first) {
      while (free != nullptr) {
        Free* next = free->next;
        to_heap(free);
        free = next;
      }
    }
  }
};
thread_local Shelves shelves;

}  // namespace

void* take(std::size_t bytes) {
  if (!kKept || thread_ends || bytes > kLargest) {
    return from_heap(bytes);
  }
  const std::size_t shelf = shelf_of(bytes);
  Free*& first = shelves.first[shelf];
  if (first == nullptr) {
    return from_heap(size_of(shelf));
  }
  Free* out = first;
  first = out->next;
  return out;
}

void give_back(void* memory, std::size_t bytes) noexcept {
  if (!kKept || thread_ends || bytes > kLargest) {
    to_heap(memory);
    return;
  }
  Free*& first = shelves.first[shelf_of(bytes)];
  first = new (memory) Free{first};
}

void prepare() {
  constexpr std::size_t kAtOnce = 24, kMost = std::size_t{1} << 19;  // of a size; bytes of a size
  thread_local bool prepared = false;
  if (prepared) {
    return;
  }
  prepared = true;
  // What is given back stays with the process: from the kernel it comes page by page, which takes longer than
  // to search in it.
  ::mallopt(M_TRIM_THRESHOLD, -1);
  ::mallopt(M_MMAP_MAX, 0);
  for (std::size_t shelf = 0; kKept && shelf < kSizes; ++shelf) {
    for (std::size_t n = std::min(kAtOnce, kMost / size_of(shelf)); n > 0; --n) {
      give_back(from_heap(size_of(shelf)), size_of(shelf));
    }
  }
}

}  // namespace punctum::vision::kept
