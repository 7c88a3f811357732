// The one place where a tick method of this backend leaves what the compiler proves: a call of libgpiod that
// makes one ioctl or one read of a descriptor that never waits. Reviewed in libgpiod 1.6 and 2.2: the
// functions that pass through here neither allocate nor lock.
#pragma once

#include <cerrno>

#include "hal/realtime.hpp"

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#include <sanitizer/rtsan_interface.h>
#define PUNCTUM_WATCHED
#endif
#endif

namespace punctum::gpiod {

struct Answer {
  int value;
  int error;  // errno, where the value is negative
};

#ifdef __clang__
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wunknown-warning-option"
#pragma clang diagnostic ignored "-Wfunction-effects"
#endif
template <auto Function, class... Argument>
[[nodiscard]] Answer kernel_call(Argument... argument) NONBLOCKING {
#ifdef PUNCTUM_WATCHED
  __rtsan_disable();
#endif
  const auto value = static_cast<int>(Function(argument...));
  const Answer answer{value, value < 0 ? errno : 0};
#ifdef PUNCTUM_WATCHED
  __rtsan_enable();
#endif
  return answer;
}
#ifdef __clang__
#pragma clang diagnostic pop
#endif

}  // namespace punctum::gpiod
