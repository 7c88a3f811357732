#include "tools/jitter/difference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <random>

namespace punctum::jitter {
namespace {

constexpr std::array kQuantileParts = {0.5, 0.99, 0.999};
constexpr std::size_t kLeastBlocks = 6;
constexpr int kDraws = 2000;
constexpr double kResolution_us = 0.1;                   // of a quantile between the edges of its bin of 1 us
constexpr double kAlpha = 0.05 / kQuantileParts.size();  // three questions, one answer
constexpr double kMissedAlpha = 0.05;                    // another one

using Chosen = std::vector<const Distribution*>;
using Quantiles = std::array<double, kQuantileParts.size()>;

Distribution together(const Chosen& parts) {
  Distribution sum;
  for (const Distribution* part : parts) {
    if (sum.count.size() < part->count.size()) {
      sum.count.resize(part->count.size(), 0);
    }
    for (std::size_t k = 0; k < part->count.size(); ++k) {
      sum.count[k] += part->count[k];
    }
    sum.longer += part->longer;
    sum.max_us = std::max(sum.max_us, part->max_us);
  }
  return sum;
}

Quantiles quantiles(const Chosen& parts) {
  const Distribution sum = together(parts);
  Quantiles out{};
  std::transform(kQuantileParts.begin(), kQuantileParts.end(), out.begin(),
                 [&](double p) { return sum.quantile_us(p); });
  return out;
}

Chosen all_of(const Result& r) {
  Chosen out;
  for (const Distribution& part : r.parts) {
    if (part.entries() > 0) {
      out.push_back(&part);
    }
  }
  return out;
}

// Share of the wake-ups of each part that are later than `limit_us`.
std::vector<double> later_than(double limit_us, const Chosen& parts) {
  std::vector<double> out;
  for (const Distribution* part : parts) {
    const auto first = std::min(part->count.size(), static_cast<std::size_t>(std::ceil(limit_us)));
    const auto later = std::accumulate(part->count.begin() + static_cast<std::ptrdiff_t>(first),
                                       part->count.end(), part->longer);
    out.push_back(static_cast<double>(later) / static_cast<double>(part->entries()));
  }
  return out;
}

// Over how many neighbours parts hang together: one and twice the sum of their autocorrelation, as long as it
// is worth mentioning.
double correlation_length(const std::vector<double>& x) {
  const double n = static_cast<double>(x.size()), mean = std::accumulate(x.begin(), x.end(), 0.0) / n;
  const auto covariance = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t i = lag; i < x.size(); ++i) {
      sum += (x[i] - mean) * (x[i - lag] - mean) / n;
    }
    return sum;
  };
  constexpr double kMentioned = 0.1;
  const double variance = covariance(0);
  double length = 1;
  for (std::size_t lag = 1; variance > 0 && lag < x.size() / 2; ++lag) {
    const double correlation = covariance(lag) / variance;
    if (correlation < kMentioned) {
      break;
    }
    length += 2 * correlation;
  }
  return length;
}

// Neighbours that hang together stay together.
using Blocks = std::vector<Chosen>;
Blocks in_blocks(const Chosen& parts, std::size_t length) {
  Blocks out;
  const std::size_t n = std::max<std::size_t>(parts.size() / length, 1);
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t k) {
      return parts.begin() + static_cast<std::ptrdiff_t>(k * parts.size() / n);
    };
    out.emplace_back(at(i), at(i + 1));
  }
  return out;
}

// Half the mean square of the difference between neighbouring stretches of `scale` parts (Allan variance):
// how much a mean over so many parts differs from the next one, whatever drifts more slowly.
struct Neighbours {
  double sum = 0;
  std::size_t count = 0;
};
Neighbours neighbours(const std::vector<double>& x, std::size_t scale) {
  Neighbours out;
  for (std::size_t i = 0; i + 2 * scale <= x.size(); ++i) {
    const auto at = [&](std::size_t k) { return x.begin() + static_cast<std::ptrdiff_t>(k); };
    const double first = std::accumulate(at(i), at(i + scale), 0.0),
                 second = std::accumulate(at(i + scale), at(i + 2 * scale), 0.0);
    const double step = (second - first) / static_cast<double>(scale);
    out.sum += step * step / 2;
    ++out.count;
  }
  return out;
}

// The variance of a mean over all parts, as the variances of shorter stretches foretell it: a straight line
// through their logarithms. Independent parts give 1/n; a machine that wanders gives more.
double foretold_variance(const std::vector<double>& a, const std::vector<double>& b) {
  const std::size_t n = std::min(a.size(), b.size());
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0, first = 0;
  for (std::size_t scale = 1; 3 * scale <= n; scale *= 2) {
    const Neighbours in_a = neighbours(a, scale), in_b = neighbours(b, scale);
    const double variance = (in_a.sum + in_b.sum) / static_cast<double>(in_a.count + in_b.count);
    if (!(variance > 0)) {
      return 0;
    }
    first = scale == 1 ? variance : first;
    // Stretches that do not overlap are what counts.
    const double weight = static_cast<double>(n) / static_cast<double>(scale) - 1,
                 x = std::log(static_cast<double>(scale)), y = std::log(variance);
    w += weight;
    wx += weight * x;
    wy += weight * y;
    wxx += weight * x * x;
    wxy += weight * x * y;
  }
  const double slope = std::clamp((w * wxy - wx * wy) / (w * wxx - wx * wx), -1.0, 1.0),
               whole = std::log(static_cast<double>(n));
  return std::max(std::exp(wy / w + slope * (whole - wx / w)), first / static_cast<double>(n));
}

// The variance of a mean over all parts where blocks of them are independent.
double variance_of_blocks(const std::vector<double>& x, std::size_t length) {
  const std::size_t n = std::max<std::size_t>(x.size() / length, 1);
  std::vector<double> mean;
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t k) { return x.begin() + static_cast<std::ptrdiff_t>(k * x.size() / n); };
    mean.push_back(std::accumulate(at(i), at(i + 1), 0.0) / static_cast<double>(at(i + 1) - at(i)));
  }
  const double all = std::accumulate(mean.begin(), mean.end(), 0.0) / static_cast<double>(n);
  double sum = 0;
  for (const double m : mean) {
    sum += (m - all) * (m - all);
  }
  return sum / static_cast<double>(n * n);
}

// Parts in a block, where neighbours hang together over so many.
std::size_t parts_in_block(double longest, std::size_t parts_a, std::size_t parts_b) {
  const std::size_t most = std::min(parts_a, parts_b) / kLeastBlocks;
  return std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(2 * longest - 1)), 1, most);
}

std::size_t block_length(const Chosen& a, const Chosen& b) {
  double longest = 1;
  for (const Chosen* parts : {&a, &b}) {
    const Quantiles own = quantiles(*parts);
    for (const double limit : {own[0], own[1]}) {
      longest = std::max(longest, correlation_length(later_than(limit, *parts)));
    }
  }
  return parts_in_block(longest, a.size(), b.size());
}

template <class Iterator>
Chosen parts_of(Iterator first, Iterator last) {
  Chosen out;
  for (; first != last; ++first) {
    out.insert(out.end(), first->begin(), first->end());
  }
  return out;
}

// The generator of the standard with a division of our own: the same draws everywhere.
std::size_t below(std::mt19937& random, std::size_t n) { return random() % n; }

Chosen drawn_from(const Blocks& blocks, std::mt19937& random) {
  Blocks out(blocks.size());
  std::generate(out.begin(), out.end(), [&] { return blocks[below(random, blocks.size())]; });
  return parts_of(out.begin(), out.end());
}

// Of one part: releases that were missed, and all.
struct Releases {
  double missed = 0, all = 0;
};

double share_of(const std::vector<Releases>& parts, std::size_t begin, std::size_t end) {
  double missed = 0, all = 0;
  for (std::size_t i = begin; i < end; ++i) {
    missed += parts[i].missed;
    all += parts[i].all;
  }
  return all > 0 ? missed / all : 0;
}

// Neighbouring parts that hang together become one.
std::vector<Releases> releases_of(const Result& r, std::size_t length) {
  std::vector<Releases> out;
  for (std::size_t i = 0; i < r.parts.size(); ++i) {
    Releases& block = i % length == 0 ? out.emplace_back() : out.back();
    const auto missed = static_cast<double>(r.missed_in_parts[i]);
    block.missed += missed;
    block.all += missed + static_cast<double>(r.parts[i].entries());
  }
  return out;
}

MissedDifference missed_difference(const Result& a, const Result& b, std::mt19937& random) {
  MissedDifference out{.a = a.missed, .b = b.missed};
  if (a.missed_in_parts.size() != a.parts.size() || b.missed_in_parts.size() != b.parts.size()) {
    return out;
  }
  double longest = 1;
  for (const Result* one : {&a, &b}) {
    const auto& missed = one->missed_in_parts;
    longest = std::max(longest, correlation_length({missed.begin(), missed.end()}));
    (one == &a ? out.parts_a : out.parts_b) =
        static_cast<std::size_t>(std::count_if(missed.begin(), missed.end(), [](auto n) { return n > 0; }));
  }
  const std::size_t length = parts_in_block(longest, a.parts.size(), b.parts.size());
  std::vector<Releases> all = releases_of(a, length);
  const std::size_t of_a = all.size();
  const std::vector<Releases> more = releases_of(b, length);
  all.insert(all.end(), more.begin(), more.end());
  const auto difference_now = [&] {
    return std::abs(share_of(all, of_a, all.size()) - share_of(all, 0, of_a));
  };
  const double found = difference_now() * (1 - 1e-9);  // the same sum in another order
  int as_large = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    for (std::size_t i = all.size(); i > 1; --i) {
      std::swap(all[i - 1], all[below(random, i)]);
    }
    as_large += difference_now() >= found ? 1 : 0;
  }
  out.chance = (as_large + 1.0) / (kDraws + 1.0);
  out.differs = out.chance < kMissedAlpha;
  return out;
}

}  // namespace

bool Difference::any() const {
  return missed.differs ||
         std::any_of(quantiles.begin(), quantiles.end(), [](const auto& q) { return q.differs; });
}

tl::expected<Difference, std::string> difference(const Result& a, const Result& b) {
  const Chosen parts_a = all_of(a), parts_b = all_of(b);
  if (parts_a.size() < kLeastParts || parts_b.size() < kLeastParts) {
    return tl::unexpected(fmt::format("{} and {} parts with wake-ups, at least {} each are needed",
                                      parts_a.size(), parts_b.size(), kLeastParts));
  }
  const Quantiles in_a = quantiles(parts_a), in_b = quantiles(parts_b);
  std::mt19937 random(1);
  std::array<std::vector<double>, kQuantileParts.size()> drawn;
  std::array<int, kQuantileParts.size()> as_large{};
  const std::size_t length = block_length(parts_a, parts_b);
  const Blocks blocks_a = in_blocks(parts_a, length), blocks_b = in_blocks(parts_b, length);
  Blocks mixed = blocks_a;
  mixed.insert(mixed.end(), blocks_b.begin(), blocks_b.end());
  // How much wider than blocks tell that all is, since the machine wanders.
  Quantiles wider{};
  for (std::size_t q = 0; q < kQuantileParts.size(); ++q) {
    const std::vector<double> a_later = later_than(in_a[q], parts_a), b_later = later_than(in_b[q], parts_b);
    const double told = (variance_of_blocks(a_later, length) + variance_of_blocks(b_later, length)) / 2;
    wider[q] = told > 0 ? std::max(1.0, std::sqrt(foretold_variance(a_later, b_later) / told)) : 1;
  }
  for (int draw = 0; draw < kDraws; ++draw) {
    // How far the difference is certain: blocks drawn again from either measurement.
    const Quantiles now_a = quantiles(drawn_from(blocks_a, random)),
                    now_b = quantiles(drawn_from(blocks_b, random));
    // What chance alone makes of it: the blocks dealt out anew.
    for (std::size_t i = mixed.size(); i > 1; --i) {
      std::swap(mixed[i - 1], mixed[below(random, i)]);
    }
    const auto middle = mixed.begin() + static_cast<std::ptrdiff_t>(blocks_a.size());
    const Quantiles dealt_a = quantiles(parts_of(mixed.begin(), middle)),
                    dealt_b = quantiles(parts_of(middle, mixed.end()));
    for (std::size_t q = 0; q < kQuantileParts.size(); ++q) {
      drawn[q].push_back(now_b[q] - now_a[q]);
      as_large[q] += wider[q] * std::abs(dealt_b[q] - dealt_a[q]) >= std::abs(in_b[q] - in_a[q]) ? 1 : 0;
    }
  }
  const Distribution whole_a = together(parts_a), whole_b = together(parts_b);
  Difference out;
  for (std::size_t q = 0; q < kQuantileParts.size(); ++q) {
    std::vector<double>& d = drawn[q];
    std::sort(d.begin(), d.end());
    const auto at = [&](double p) {
      return d[static_cast<std::size_t>(std::lround(p * static_cast<double>(d.size() - 1)))];
    };
    QuantileDifference one{.part = kQuantileParts[q], .a_us = in_a[q], .b_us = in_b[q]};
    const double found_us = in_b[q] - in_a[q];
    one.low_us = found_us + wider[q] * (at(kAlpha / 2) - found_us);
    one.high_us = found_us + wider[q] * (at(1 - kAlpha / 2) - found_us);
    const double chance = (as_large[q] + 1.0) / (kDraws + 1.0);
    one.told = whole_a.tells(one.part) && whole_b.tells(one.part);
    one.differs =
        one.told && chance < kAlpha && (one.low_us > kResolution_us || one.high_us < -kResolution_us);
    out.quantiles.push_back(one);
  }
  out.missed = missed_difference(a, b, random);
  return out;
}

std::string difference_text(const Difference& found, const Result& a, const Result& b) {
  std::string out;
  if (a.machine != b.machine) {
    out += "the machines differ:\n  A: " + a.machine + "\n  B: " + b.machine + "\n";
  }
  if (a.cpu != b.cpu || a.priority != b.priority) {
    const auto place = [](const Result& r) {
      return fmt::format("{}, {}", r.cpu < 0 ? "no CPU of its own" : fmt::format("CPU {}", r.cpu),
                         r.priority == 0 ? "ordinary priority" : fmt::format("FIFO {}", r.priority));
    };
    out += fmt::format("the places differ: A {}; B {}\n", place(a), place(b));
  }
  if (a.work.substr(0, a.work.find(',')) != b.work.substr(0, b.work.find(','))) {
    out += "the ticks do not do the same\n";
  }
  if (a.load != b.load) {
    out += "the loads beside them differ\n";
  }
  if (a.rate_Hz != b.rate_Hz) {
    out += fmt::format("the rates differ: A {} Hz, B {} Hz\n", a.rate_Hz, b.rate_Hz);
  }
  out += "wake-up, us      A        B    B - A (95 % of all together)\n";
  for (const QuantileDifference& q : found.quantiles) {
    if (!q.told) {
      out += fmt::format("p{:<8} {:>8} {:>8}    (too few wake-ups)\n", 100 * q.part, "-", "-");
      continue;
    }
    out += fmt::format("p{:<8} {:>8.1f} {:>8.1f} {:>8.1f}  {:.1f} .. {:.1f}{}\n", 100 * q.part, q.a_us,
                       q.b_us, q.b_us - q.a_us, q.low_us, q.high_us, q.differs ? "  differs" : "");
  }
  out += fmt::format("{:<9} {:>8.1f} {:>8.1f}    (the latest one says little of all)\n", "max", a.wake.max_us,
                     b.wake.max_us);
  const MissedDifference& missed = found.missed;
  out += fmt::format("{:<9} {:>8} {:>8}", "missed", missed.a, missed.b);
  if (missed.parts_a + missed.parts_b > 0) {
    out += fmt::format("    releases, in {} of {} and {} of {} parts; by chance in {:.1f} % of such pairs{}",
                       missed.parts_a, a.parts.size(), missed.parts_b, b.parts.size(), 100 * missed.chance,
                       missed.differs ? "  differs" : "");
  }
  return out + (found.any() ? "\nthey differ\n" : "\nno difference is shown\n");
}

}  // namespace punctum::jitter
