// Four numbers side by side in a processor's wide registers: what they add up to is added in the same order,
// and so has the same bits, where there are none.
#pragma once

#include <cstddef>
#include <cstring>

namespace punctum::vision {

inline constexpr std::size_t kQuad = 4;
using Quad = double __attribute__((vector_size(kQuad * sizeof(double))));

// Takes the four that begin there.
[[gnu::always_inline]] inline void load(const double* from, Quad& to) { std::memcpy(&to, from, sizeof to); }

[[gnu::always_inline]] inline double sum_of(const Quad& v) { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace punctum::vision
