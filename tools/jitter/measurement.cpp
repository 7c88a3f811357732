#include "tools/jitter/measurement.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/platform/allocation_trap.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "tools/shared/machine.hpp"
#include "tools/shared/stop_signal.hpp"

namespace punctum::jitter {
namespace {

constexpr std::size_t kMostSpikes = 64;
constexpr int kParts = 60;

std::atomic<bool> end_loop{false};

void on_stop_signal(int /*count*/) NONBLOCKING { end_loop.store(true); }

// The last slot of the tick: what there is to do in a tick that does nothing.
class EmptyTick {
 public:
  void set_up(rt::MonotonicClock& clock, std::int64_t period_ns, std::uint64_t ticks) {
    clock_ = &clock;
    period_ns_ = period_ns;
    ticks_ = ticks;
  }
  rt::After run(const rt::Tick& tick) NONBLOCKING {
    const std::int64_t now_ns = clock_->now_ns();
    // Of the release that it slept for; there may be later ones that have passed, too.
    const std::uint64_t slept_for = first_ ? tick.index : last_index_ + 1;
    const std::int64_t late_ns =
        tick.wake_ns - tick.release_ns + static_cast<std::int64_t>(tick.index - slept_for) * period_ns_;
    if (first_) {
      first_release_ns_ = tick.release_ns;
    } else {
      interval_.add(now_ns - last_ns_);
    }
    if ((first_ || late_ns > latest_ns_) && spikes_ < spike_.size()) {
      spike_[spikes_++] = {1e-9 * static_cast<double>(tick.release_ns - first_release_ns_),
                           1e-3 * static_cast<double>(late_ns)};
    }
    latest_ns_ = first_ ? late_ns : std::max(latest_ns_, late_ns);
    last_ns_ = now_ns;
    last_index_ = tick.index;
    first_ = false;
    return tick.index + 1 >= ticks_ ? rt::After::end : rt::After::go_on;
  }
  [[nodiscard]] const rt::TimeHistogram& interval() const { return interval_; }
  [[nodiscard]] std::vector<Spike> spikes() const {
    return {spike_.begin(), spike_.begin() + static_cast<std::ptrdiff_t>(spikes_)};
  }

 private:
  rt::MonotonicClock* clock_ = nullptr;
  std::int64_t period_ns_ = 0;
  std::uint64_t ticks_ = 0, last_index_ = 0;
  rt::TimeHistogram interval_;
  std::array<Spike, kMostSpikes> spike_{};
  std::size_t spikes_ = 0;
  std::int64_t first_release_ns_ = 0, last_ns_ = 0, latest_ns_ = 0;
  bool first_ = true;
};

// What the loop writes; touched before it begins.
struct Written {
  rt::CoreStatus status;
  EmptyTick empty_tick;
};

Distribution distribution_of(const rt::TimeHistogram& histogram) {
  Distribution out;
  out.count.resize(rt::TimeHistogram::kBins);
  for (std::size_t k = 0; k < out.count.size(); ++k) {
    out.count[k] = histogram.bin(k);
  }
  out.longer = histogram.overflow();
  out.max_us = histogram.max_us();
  while (!out.count.empty() && out.count.back() == 0) {
    out.count.pop_back();
  }
  return out;
}

// What `after` holds more than `before`.
Distribution since(const Distribution& before, const Distribution& after) {
  Distribution out = after;
  for (std::size_t k = 0; k < before.count.size(); ++k) {
    out.count[k] -= before.count[k];
  }
  out.longer -= before.longer;
  return out;
}

// Copies the histogram of wake-ups at equal intervals, from an ordinary thread: it may be read live.
class Parts {
 public:
  Parts(const rt::CoreStatus& status, double seconds) : status_(status), every_(seconds / kParts) {
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    thread_ = std::thread([this] { watch(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }
  // The parts; of the last one nothing is told unless it was whole.
  std::vector<Distribution> end() {
    over_.store(true);
    thread_.join();
    return std::move(parts_);
  }

 private:
  void watch() {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::milliseconds kLook(10);
    auto due = Clock::time_point{};
    Distribution before;
    while (!over_.load()) {
      std::this_thread::sleep_for(kLook);
      const auto now = Clock::now();
      if (status_.started.load() == 0) {
        continue;
      }
      if (due == Clock::time_point{}) {
        due = now + std::chrono::duration_cast<Clock::duration>(every_);
      } else if (now >= due) {
        due += std::chrono::duration_cast<Clock::duration>(every_);
        Distribution all = distribution_of(status_.wake);
        parts_.push_back(since(before, all));
        before = std::move(all);
      }
    }
  }

  const rt::CoreStatus& status_;
  std::chrono::duration<double> every_;
  std::atomic<bool> over_{false};
  std::vector<Distribution> parts_;
  std::thread thread_;
};

std::string first_line(const char* path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

// Moves between processors so far, of the calling thread.
std::uint64_t migrations() {
  std::ifstream in("/proc/thread-self/sched");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("se.nr_migrations")) {
      return std::stoull(line.substr(line.find(':') + 1));
    }
  }
  return 0;
}

std::string machine() {
  const tools::MachineDescription m = tools::this_machine();
  return fmt::format("{}; {} x {}; clock {}; boot line: {}", m.kernel, m.cores, m.processor,
                     first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource"),
                     first_line("/proc/cmdline"));
}

}  // namespace

tl::expected<Result, std::string> measure(const Wanted& wanted) {
  Result result;
  result.rate_Hz = wanted.rate_Hz;
  result.cpu = wanted.cpu;
  result.machine = machine();
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / wanted.rate_Hz));
  rt::MonotonicClock monotonic;
  const auto written = std::make_unique<Written>();
  auto& [status, empty_tick] = *written;
  empty_tick.set_up(monotonic, period_ns,
                    static_cast<std::uint64_t>(std::llround(wanted.seconds * wanted.rate_Hz)));
  tools::stop_signal::watch({SIGINT, SIGTERM}, on_stop_signal);
  Parts parts(status, wanted.seconds);

  rt::RightsWanted rights_wanted;
  rights_wanted.priority = wanted.priority;
  rights_wanted.cpu = wanted.cpu;
  const auto rights = rt::RealTimeRights::acquire(rights_wanted);
  result.degraded = rights.degraded();
  for (const rt::RightFound& right : rights.table()) {
    if (right.required && !right.got) {
      result.missing.push_back(fmt::format("{}: {}", right.name, right.remedy));
    }
  }
  rt::prefault_writable(written.get(), sizeof(Written));
  const std::array slots{rt::slot<&EmptyTick::run>("empty", empty_tick)};
  rt::ExecutiveConfig config;
  config.period_ns = period_ns;
  rt::Executive executive(monotonic, monotonic, config, slots, status);

  const std::uint64_t moved_before = migrations();
  const rt::ThreadCounters before = rt::read_thread_counters();
  rt::allocation_trap::arm(rt::allocation_trap::On::allocation_count);
  result.allocations_watched = rt::allocation_trap::armed();
  const auto ended = executive.run(end_loop);
  result.allocations = rt::allocation_trap::disarm();
  const rt::ThreadCounters after = rt::read_thread_counters();
  rt::leave_real_time();
  result.migrations = migrations() - moved_before;
  result.parts = parts.end();
  if (ended == rt::Executive::Ended::invalid) {
    return tl::unexpected(fmt::format("--rate: {} Hz: no period of a whole nanosecond", wanted.rate_Hz));
  }

  result.ticks = status.ticks.load();
  result.missed = status.missed.load();
  result.seconds = static_cast<double>(status.tick_index.load() + 1) / wanted.rate_Hz;
  result.wake = distribution_of(status.wake);
  result.tick = distribution_of(status.tick);
  result.interval = distribution_of(empty_tick.interval());
  result.spikes = empty_tick.spikes();
  result.minor_faults = after.minor_faults - before.minor_faults;
  result.major_faults = after.major_faults - before.major_faults;
  result.voluntary_switches = after.voluntary_switches - before.voluntary_switches;
  result.involuntary_switches = after.involuntary_switches - before.involuntary_switches;
  return result;
}

}  // namespace punctum::jitter
