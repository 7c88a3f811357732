// For what a test does inside the tick for itself: keeping what it saw, playing the observer. While one of
// these lives, the real-time sanitizer does not watch the thread; nothing under any other build.
#pragma once

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#include <sanitizer/rtsan_interface.h>
#define PUNCTUM_REALTIME_SANITIZER
#endif
#endif

namespace punctum::tests {

class Unwatched {
 public:
#ifdef PUNCTUM_REALTIME_SANITIZER
  Unwatched() { __rtsan_disable(); }
  ~Unwatched() { __rtsan_enable(); }
#else
  Unwatched() {}
  ~Unwatched() {}
#endif
  Unwatched(const Unwatched&) = delete;
  Unwatched& operator=(const Unwatched&) = delete;
};

}  // namespace punctum::tests
