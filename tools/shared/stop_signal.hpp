// Signals that ask a program to stop. They are counted: the first asks, later ones insist.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "hal/realtime.hpp"

namespace punctum::tools::stop_signal {

// Called within the signal handler, with the number of signals so far: it may touch lock-free atomics only.
using Wake = void (*)(int count) noexcept;

void watch(std::initializer_list<int> signals, Wake wake = nullptr);

// The death of the parent is a request from here on, however often the kernel tells of it: it does so for
// each of the parent's threads that had the child in its turn. False: the station's maker, whose process id
// stands in the header of its segments, has died already: it is not among this process's ancestors (a
// debugger may stand between them).
[[nodiscard]] bool watch_parent(std::uint64_t maker);
[[nodiscard]] bool parent_has_died() noexcept;

[[nodiscard]] int count() NONBLOCKING;
void request() noexcept;  // as if one signal had come, unless one has

}  // namespace punctum::tools::stop_signal
