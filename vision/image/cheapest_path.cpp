#include "vision/image/cheapest_path.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "vision/image/dispatched.hpp"

namespace punctum::vision {

namespace {

constexpr float kNoWay = std::numeric_limits<float>::max();
constexpr float kFarAway = 1e8F;  // of a sample that a path may not begin at
constexpr int kAnywhere = -1;

using EightCosts = float __attribute__((vector_size(32)));

// The cheapest way to each of the m samples of an angle from the one before, `reach` samples inwards to
// `reach` outwards. `before` has `reach` samples more on either side, which no path may use. bend: of each
// of these steps. Eight samples at once; the last eight may be done twice.
PUNCTUM_WIDE_LOOP void cheapest_steps(const float* before, const float* bend, std::size_t steps,
                                      const float* cost, std::size_t m, float* total) {
  constexpr std::size_t kEight = 8;
  for (std::size_t j = 0; j < m; j += kEight) {
    const std::size_t at = std::min(j, m - kEight);
    EightCosts best, from, here;
    std::memcpy(&best, before + at, sizeof best);
    best += bend[0];
    for (std::size_t k = 1; k < steps; ++k) {
      std::memcpy(&from, before + at + k, sizeof from);
      from += bend[k];
      best = from < best ? from : best;
    }
    std::memcpy(&here, cost + at, sizeof here);
    best += here;
    std::memcpy(total + at, &best, sizeof best);
  }
}

class CheapestPath {
 public:
  CheapestPath(std::span<const float> cost, int angles, int samples, std::span<const float> bend)
      : cost_(cost.data()), n_(angles), m_(samples), bend_(bend), path_(static_cast<std::size_t>(angles)) {}

  Vector<int> closed() {
    // An open path tells where the path crosses an angle; the closed one begins and ends there. It needs so
    // many times the angles in which a path crosses the band, or noise would choose; round the whole cell at
    // most.
    constexpr int kSettled = 12;
    const int reach = std::max(1, static_cast<int>(bend_.size()) - 1);
    const int middle = n_ / 2, count = std::min(n_, kSettled * m_ / reach);
    find(middle - count / 2, count, kAnywhere);
    find(middle, n_, path_[angle(middle)]);
    return std::move(path_);
  }

 private:
  [[nodiscard]] std::size_t angle(int i) const {
    return static_cast<std::size_t>(i < 0 ? i + n_ : i < n_ ? i : i - n_);
  }
  void find(int from, int count, int fixed);

  const float* cost_;
  int n_, m_;
  std::span<const float> bend_;
  Vector<int> path_;
  Vector<float> total_;  // of the cheapest path to each sample
};

// Over `count` angles. The path begins and ends at the sample `fixed`, or anywhere.
void CheapestPath::find(int from, int count, int fixed) {
  const std::size_t m = static_cast<std::size_t>(m_), reach = bend_.size() - 1, row = m + 2 * reach;
  total_.assign(static_cast<std::size_t>(count) * row, kNoWay);
  float* total = total_.data() + reach;
  for (std::size_t j = 0; j < m; ++j) {
    total[j] = fixed == kAnywhere || static_cast<int>(j) == fixed ? cost_[angle(from) * m + j] : kFarAway;
  }
  std::array<float, 2 * kMostReach + 1> steps{};
  for (std::size_t k = 0; k <= 2 * reach; ++k) {
    steps[k] = bend_[k > reach ? k - reach : reach - k];
  }
  for (int i = 1; i < count; ++i) {
    cheapest_steps(total - reach, steps.data(), 2 * reach + 1, cost_ + angle(from + i) * m, m, total + row);
    total += row;
  }
  // Backwards: the cheapest sample of the last angle, and of each angle before the one that led on.
  const auto cheapest = [&](int towards, bool free) {
    const int near = static_cast<int>(reach), first = free ? 0 : std::max(0, towards - near),
              last = free ? m_ - 1 : std::min(m_ - 1, towards + near);
    int at = first;
    float least = kNoWay;
    for (int j = first; j <= last; ++j) {
      const auto k = static_cast<std::size_t>(free ? 0 : std::abs(j - towards));
      if (total[j] + bend_[k] < least) {
        least = total[j] + bend_[k];
        at = j;
      }
    }
    return at;
  };
  int here = cheapest(fixed, fixed == kAnywhere);
  for (int i = count - 1; i >= 0; --i) {
    path_[angle(from + i)] = here;
    if (i > 0) {
      total -= row;
      here = cheapest(here, false);
    }
  }
}

}  // namespace

Vector<int> cheapest_closed_path(std::span<const float> cost, int angles, int samples,
                                 std::span<const float> bend) {
  return CheapestPath(cost, angles, samples, bend).closed();
}

}  // namespace punctum::vision
