// The one place where a tick method of a backend leaves what the compiler proves: a function that makes one
// system call which never waits (a read, write or send of a descriptor that does not block, an ioctl that
// only asks), and neither allocates nor locks. Each backend's README says what passes through here, and why.
#pragma once

#include <cerrno>

#include "hal/realtime.hpp"

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#include <sanitizer/rtsan_interface.h>
#define PUNCTUM_WATCHED
#endif
#endif

namespace punctum::hal {

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

}  // namespace punctum::hal
