// Where many delays lie, a line for every bin.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace punctum::loopback {

inline void print_histogram(const char* title, std::vector<std::int64_t> delays_ns, std::int64_t bin_ns) {
  std::sort(delays_ns.begin(), delays_ns.end());
  const auto us = [](std::int64_t ns) { return static_cast<long>(ns / 1000); };
  std::printf("%s: %zu times, p50 %ld us, largest %ld us\n", title, delays_ns.size(),
              us(delays_ns[delays_ns.size() / 2]), us(delays_ns.back()));
  for (std::int64_t from_ns = delays_ns.front() / bin_ns * bin_ns; from_ns <= delays_ns.back();
       from_ns += bin_ns) {
    const auto in_bin = std::count_if(delays_ns.begin(), delays_ns.end(),
                                      [&](std::int64_t d) { return d >= from_ns && d < from_ns + bin_ns; });
    if (in_bin > 0) {
      std::printf("  from %6ld us %3ld %s\n", us(from_ns), static_cast<long>(in_bin),
                  std::string(static_cast<std::size_t>(std::min<std::ptrdiff_t>(in_bin, 60)), '#').c_str());
    }
  }
}

}  // namespace punctum::loopback
