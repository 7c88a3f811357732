// What the compiler proves of a function that the tick reaches.
#pragma once

// After `noexcept` of a function that never blocks: no heap, no lock, no system call, no call of anything
// that is not NONBLOCKING itself or visible and found to be so. clang checks it (-Wfunction-effects) and its
// real-time sanitizer watches it (-fsanitize=realtime); other compilers ignore it.
#if defined(__clang__) && defined(__has_cpp_attribute)
#if __has_cpp_attribute(clang::nonblocking)
#define NONBLOCKING noexcept [[clang::nonblocking]]
#endif
#endif
#ifndef NONBLOCKING
#define NONBLOCKING noexcept
#endif
