#include "hal/sim/failures.hpp"

namespace punctum::sim {

std::array<Failure, kDevices> failures_at(const SimConfig& config, const FailureSwitches* live,
                                          double t_s) noexcept {
  std::array<Failure, kDevices> now{};
  for (int i = 0; i < config.failure_count; ++i) {
    const ScheduledFailure& f = config.failures[static_cast<std::size_t>(i)];
    if (t_s >= f.at_s && (f.for_s <= 0 || t_s < f.at_s + f.for_s)) {
      now[static_cast<std::size_t>(f.device)] = f.kind;
    }
  }
  if (live != nullptr) {
    for (std::size_t d = 0; d < now.size(); ++d) {
      const std::uint64_t word = live->word[d].load(std::memory_order_relaxed);
      if (word != 0 && word <= 1 + static_cast<std::uint64_t>(Failure::noise)) {
        now[d] = static_cast<Failure>(word - 1);
      }
    }
  }
  return now;
}

}  // namespace punctum::sim
