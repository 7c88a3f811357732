#include <algorithm>
#include <chrono>

#include "tools/report/topic.hpp"

namespace punctum::report {
namespace {

using Steady = std::chrono::steady_clock;
constexpr std::int64_t kLargestBatch = 1'000'000;
constexpr std::int64_t kFewestBatches = 11;

double time_batch_ns(const Timed& f, std::size_t from, std::int64_t n) {
  const auto begin = Steady::now();
  f.run(from, n);
  return std::chrono::duration<double, std::nano>(Steady::now() - begin).count();
}

// The smallest batch, doubled from 1, that lasts long enough. It also warms the caches.
std::int64_t fitting_batch(const Timed& f, double wanted_ns) {
  for (std::int64_t n = 1; n < kLargestBatch; n *= 2) {
    if (std::min(time_batch_ns(f, 0, n), time_batch_ns(f, 0, n)) >= wanted_ns) {
      return n;
    }
  }
  return kLargestBatch;
}

double quantile(const std::vector<double>& sorted, double q) {
  const auto n = static_cast<double>(sorted.size());
  const auto i = static_cast<std::size_t>(std::ceil(q * n));
  return sorted[std::min(sorted.size() - 1, i == 0 ? 0 : i - 1)];
}

}  // namespace

std::vector<CallTime> time_interleaved(std::span<const Timed> methods, const TimingPlan& plan) {
  const std::size_t count = methods.size();
  const Timed empty([](std::size_t i) { return i; });
  std::vector<std::int64_t> batch(count);
  for (std::size_t m = 0; m < count; ++m) {
    batch[m] = fitting_batch(methods[m], plan.batch_us * 1e3);
  }

  std::vector<std::vector<double>> spent(count), harness(count);  // per call
  std::vector<std::size_t> calls(count, 0);
  const auto end = Steady::now() + std::chrono::duration<double>(plan.seconds);
  const std::int64_t rounds = std::max(plan.batches, kFewestBatches);
  for (std::int64_t round = 0; round < rounds; ++round) {
    if (round >= kFewestBatches && Steady::now() > end) {
      break;
    }
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t m = (k + static_cast<std::size_t>(round)) % count;
      const auto n = static_cast<double>(batch[m]);
      spent[m].push_back(time_batch_ns(methods[m], calls[m], batch[m]) / n);
      harness[m].push_back(time_batch_ns(empty, calls[m], batch[m]) / n);
      calls[m] += static_cast<std::size_t>(batch[m]);
    }
  }

  std::vector<CallTime> times(count);
  for (std::size_t m = 0; m < count; ++m) {
    std::sort(spent[m].begin(), spent[m].end());
    std::sort(harness[m].begin(), harness[m].end());
    const double overhead = quantile(harness[m], 0.5);
    const auto net = [&](double q) { return std::max(0.0, quantile(spent[m], q) - overhead); };
    times[m] = {.median_ns = net(0.5),
                .p99_9_ns = net(0.999),
                .max_ns = net(1),
                .overhead_ns = overhead,
                .batch = batch[m],
                .batches = static_cast<std::int64_t>(spent[m].size())};
  }
  return times;
}

CallTime time_calls(const Timed& f, const TimingPlan& plan) {
  return time_interleaved(std::span(&f, 1), plan).front();
}

std::vector<std::string> time_columns() {
  return {"median_ns", "p99_9_ns", "max_ns", "overhead_ns", "batch", "batches"};
}

Row time_cells(const CallTime& t) {
  return {t.median_ns, t.p99_9_ns, t.max_ns, t.overhead_ns, t.batch, t.batches};
}

}  // namespace punctum::report
