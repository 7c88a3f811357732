// The loop of the core beside cyclictest, in turns, so that whatever the machine does meets both.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "tools/jitter/measurement.hpp"
#include "tools/jitter/result.hpp"

namespace punctum::jitter {

struct Comparison {
  Result cyclictest, loop;
};

// Both get half of wanted.seconds, in as many slices each; every slice is a part of its result. `tick`: the
// options that say what the loop does in each tick.
[[nodiscard]] tl::expected<Comparison, std::string> compare_with_cyclictest(
    const Wanted& wanted, const std::vector<std::string>& tick);

// What cyclictest --histfile wrote.
[[nodiscard]] tl::expected<Distribution, std::string> read_histogram(std::string_view text);

}  // namespace punctum::jitter
