// Linked in front of Servo::tick (ld --wrap) in a second build of the core program: one allocation in each
// tick. The sanitizer ends its run only if the tick of the real program is watched.
#include <cstdlib>

#define SERVO_TICK "_ZN7punctum2rt5Servo4tickERKNS0_8TickInfoE"

namespace {
void* volatile kept = nullptr;
}

extern "C" {
void tick(void* servo, const void* info) __asm__("__real_" SERVO_TICK);
void tick_and_allocate(void* servo, const void* info) __asm__("__wrap_" SERVO_TICK);
}

void tick_and_allocate(void* servo, const void* info) {
  kept = std::malloc(16);
  tick(servo, info);
}
