#include "tools/jitter/measurement.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/segment.hpp"
#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/platform/allocation_trap.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "rt/station/station.hpp"
#include "tools/jitter/ordinary_thread.hpp"
#include "tools/shared/cause.hpp"
#include "tools/shared/machine.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/witness.hpp"

namespace punctum::jitter {
namespace {

constexpr std::size_t kMostSpikes = 64;
constexpr std::chrono::milliseconds kLookAgain(10);
constexpr int kParts = 60;
constexpr std::chrono::milliseconds kPerhapsStopped(100), kStopped(1000);  // a running core without a tick
constexpr std::int64_t kSetUp_ns = 200'000'000;  // from the start of the tick's work to the first release

std::atomic<bool> end_loop{false};

void on_stop_signal(int /*count*/) NONBLOCKING { end_loop.store(true); }

// The last slot of the tick: what there is to do in a tick that does nothing.
class EmptyTick {
 public:
  void set_up(rt::MonotonicClock& clock, std::uint64_t ticks, double break_us) {
    break_ns_ = break_us > 0 ? std::llround(break_us * 1e3) : INT64_MAX;
    clock_ = &clock;
    ticks_ = ticks;
  }
  rt::After run(const rt::Tick& tick) NONBLOCKING {
    const std::int64_t now_ns = clock_->now_ns(), slept_for_ns = tick.wake_ns - tick.late_ns;
    if (first_) {
      first_release_ns_ = slept_for_ns;
    } else {
      interval_.add(now_ns - last_ns_);
    }
    if ((first_ || tick.late_ns > latest_ns_) && spikes_ < spike_.size()) {
      spike_[spikes_++] = {1e-9 * static_cast<double>(slept_for_ns - first_release_ns_),
                           1e-3 * static_cast<double>(tick.late_ns)};
    }
    latest_ns_ = first_ ? tick.late_ns : std::max(latest_ns_, tick.late_ns);
    if (tick.late_ns > latest_since_asked_ns_.load()) {
      latest_since_asked_ns_.store(tick.late_ns);
    }
    last_ns_ = now_ns;
    first_ = false;
    broke_ = broke_ || tick.late_ns > break_ns_;
    return broke_ || tick.index + 1 >= ticks_ ? rt::After::end : rt::After::go_on;
  }
  [[nodiscard]] const rt::TimeHistogram& interval() const { return interval_; }
  [[nodiscard]] bool broke() const { return broke_; }
  // For another thread, live: the latest wake-up since it asked last.
  [[nodiscard]] double latest_since_asked_us() {
    return 1e-3 * static_cast<double>(latest_since_asked_ns_.exchange(0));
  }
  [[nodiscard]] std::vector<Spike> spikes() const {
    return {spike_.begin(), spike_.begin() + static_cast<std::ptrdiff_t>(spikes_)};
  }

 private:
  rt::MonotonicClock* clock_ = nullptr;
  std::uint64_t ticks_ = 0;
  rt::TimeHistogram interval_;
  std::array<Spike, kMostSpikes> spike_{};
  std::size_t spikes_ = 0;
  std::int64_t first_release_ns_ = 0, last_ns_ = 0, latest_ns_ = 0;
  std::int64_t break_ns_ = 0;
  std::atomic<std::int64_t> latest_since_asked_ns_{0};
  bool first_ = true, broke_ = false;
};

// What the loop writes; touched before it begins.
struct Written {
  rt::CoreStatus status;
  EmptyTick empty_tick;
};

Distribution bins_of(const rt::TimeHistogram& histogram) {
  Distribution out;
  out.count.resize(rt::TimeHistogram::kBins);
  for (std::size_t k = 0; k < out.count.size(); ++k) {
    out.count[k] = histogram.bin(k);
  }
  out.longer = histogram.overflow();
  out.max_us = histogram.max_us();
  return out;
}

Distribution distribution_of(const rt::TimeHistogram& histogram) { return since({}, bins_of(histogram)); }

// Copies the histogram of wake-ups at equal intervals, from an ordinary thread: it may be read live. tick:
// tells how late the latest of a part was, beyond the bins, too; none: it is not known.
class Parts {
 public:
  Parts(const rt::CoreStatus& status, double seconds, EmptyTick* tick)
      : status_(status),
        tick_(tick),
        every_(seconds / kParts),
        before_(bins_of(status.wake)),
        missed_before_(status.missed.load()) {
    thread_ = ordinary_thread([this] { watch(); });
  }
  // The parts; of the last one nothing is told unless it was whole.
  void end(Result& out) {
    over_.store(true);
    thread_.join();
    out.parts = std::move(parts_);
    out.missed_in_parts = std::move(missed_);
  }

 private:
  void watch() {
    using Clock = std::chrono::steady_clock;
    auto due = Clock::time_point{};
    while (!over_.load()) {
      std::this_thread::sleep_for(kLookAgain);
      const auto now = Clock::now();
      if (status_.started.load() == 0) {
        continue;
      }
      if (due == Clock::time_point{}) {
        due = now + std::chrono::duration_cast<Clock::duration>(every_);
      } else if (now >= due) {
        due += std::chrono::duration_cast<Clock::duration>(every_);
        Distribution all = bins_of(status_.wake);
        Distribution& part = parts_.emplace_back(since(before_, all));
        const double latest_us = tick_ != nullptr ? tick_->latest_since_asked_us() : 0;
        if (part.longer > 0) {
          part.max_us = std::max(part.max_us, latest_us);
        }
        before_ = std::move(all);
        const std::uint64_t missed = status_.missed.load();
        missed_.push_back(missed - missed_before_);
        missed_before_ = missed;
      }
    }
  }

  const rt::CoreStatus& status_;
  EmptyTick* tick_;
  std::chrono::duration<double> every_;
  Distribution before_;
  std::uint64_t missed_before_;
  std::atomic<bool> over_{false};
  std::vector<Distribution> parts_;
  std::vector<std::uint64_t> missed_;
  std::jthread thread_;
};

// The wake-ups of a running loop that are later than all since this began, from its histogram, to the last
// look.
class LatestSeen {
 public:
  explicit LatestSeen(const rt::CoreStatus& status) : status_(status), before_(bins_of(status.wake)) {}
  void look() {
    Distribution all = bins_of(status_.wake);
    const double latest_us = since(before_, all).max_us;
    if (latest_us > (spikes_.empty() ? 0 : spikes_.back().wake_us)) {
      const auto now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
      spikes_.push_back(
          {1e-9 * static_cast<double>(now_ns - static_cast<std::int64_t>(status_.start_ns.load())),
           latest_us});
    }
    before_ = std::move(all);
  }
  [[nodiscard]] const std::vector<Spike>& spikes() const { return spikes_; }

 private:
  const rt::CoreStatus& status_;
  Distribution before_;
  std::vector<Spike> spikes_;
};

std::string first_line(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

// What stands behind "NAME   :" in a file of lines like that; empty: nothing does.
std::optional<std::uint64_t> number_in(const std::string& file, std::string_view name) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (const std::size_t colon = line.find(':'); colon != std::string::npos && line.starts_with(name)) {
      std::istringstream number(line.substr(colon + 1));
      std::uint64_t value = 0;
      return number >> value ? std::optional(value) : std::nullopt;
    }
  }
  return std::nullopt;
}

// Moves between processors so far, of the calling thread.
std::optional<std::uint64_t> migrations(const std::string& thread = "/proc/thread-self") {
  return number_in(thread + "/sched", "se.nr_migrations");
}

// What the kernel counts of the first thread of another process.
struct ThreadCounts {
  std::optional<std::uint64_t> minor_faults, major_faults, voluntary_switches, involuntary_switches;
  std::optional<std::uint64_t> migrations, smis;
};
ThreadCounts thread_counts(int pid) {
  const std::string thread = fmt::format("/proc/{}/task/{}", pid, pid);
  const tools::late::Counters counters = tools::late::read_counters(pid, pid);
  ThreadCounts out;
  if (counters.cpu >= 0) {  // it could be read
    out.minor_faults = counters.minor_faults;
    out.major_faults = counters.major_faults;
  }
  out.voluntary_switches = number_in(thread + "/status", "voluntary_ctxt_switches");
  out.involuntary_switches = number_in(thread + "/status", "nonvoluntary_ctxt_switches");
  out.migrations = jitter::migrations(thread);
  out.smis = counters.smis;
  return out;
}

// Where the scheduler may put it and how urgent it is, of a thread: -1 where there are several; 0.
void tell_place(int tid, Result& out) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(tid, sizeof allowed, &allowed) == 0 && CPU_COUNT(&allowed) == 1) {
    for (out.cpu = 0; !CPU_ISSET(out.cpu, &allowed);) {
      ++out.cpu;
    }
  }
  sched_param urgent{};
  if (sched_getscheduler(tid) != SCHED_OTHER && sched_getparam(tid, &urgent) == 0) {
    out.priority = urgent.sched_priority;
  }
}

// What does not tell itself is left out.
std::string machine(int cpu) {
  const tools::MachineDescription m = tools::this_machine();
  const std::string of_cpu = fmt::format("/sys/devices/system/cpu/cpu{}/", std::max(cpu, 0));
  std::string out = fmt::format("{}; {} x {}", m.kernel, m.cores, m.processor);
  for (const auto& [name, value] :
       {std::pair("microcode", first_line(of_cpu + "microcode/version")),
        std::pair("governor", first_line(of_cpu + "cpufreq/scaling_governor")),
        std::pair("SMT", first_line("/sys/devices/system/cpu/smt/control")),
        std::pair("clock", first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource")),
        std::pair("boot line:", first_line("/proc/cmdline"))}) {
    out += value.empty() ? "" : fmt::format("; {} {}", name, value);
  }
  return out;
}

}  // namespace

tl::expected<Result, std::string> measure(const Wanted& wanted, const Work& work) {
  Result result;
  result.rate_Hz = wanted.rate_Hz;
  result.machine = machine(wanted.cpu);
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / wanted.rate_Hz));
  rt::MonotonicClock monotonic;
  const auto written = std::make_unique<Written>();
  auto& [status, empty_tick] = *written;
  empty_tick.set_up(monotonic, static_cast<std::uint64_t>(std::llround(wanted.seconds * wanted.rate_Hz)),
                    wanted.break_us);
  tools::stop_signal::watch({SIGINT, SIGTERM}, on_stop_signal);

  rt::RightsWanted rights_wanted;
  rights_wanted.priority = wanted.priority;
  rights_wanted.cpu = wanted.cpu;
  const auto rights = rt::RealTimeRights::acquire(rights_wanted);
  result.degraded = rights.degraded();
  tell_place(0, result);
  if (wanted.cpu >= 0 && result.cpu != wanted.cpu) {  // another one's punctuality is not what was asked for
    rt::leave_real_time();
    return tl::unexpected(
        fmt::format("--cpu: {}: the kernel does not let this process run there", wanted.cpu));
  }
  for (const rt::RightFound& right : rights.table()) {
    if (right.required && !right.got) {
      result.missing.push_back(fmt::format("{}: {}", right.name, right.remedy));
    }
  }
  rt::prefault_writable(written.get(), sizeof(Written));
  std::vector<rt::Slot> slots = work.slots;
  slots.push_back(rt::slot<&EmptyTick::run>("empty", empty_tick));
  rt::ExecutiveConfig config;
  config.period_ns = period_ns;
  if (work.start) {
    config.start_ns = monotonic.now_ns() + kSetUp_ns;
    if (const auto started = work.start(*config.start_ns, result.degraded); !started) {
      rt::leave_real_time();
      return tl::unexpected(started.error());
    }
  }
  const double limit_us = wanted.break_us > 0 ? wanted.break_us : wanted.explain_us;
  if (limit_us > 0) {
    config.late_after_ns = std::llround(limit_us * 1e3);
  }
  rt::Executive executive(monotonic, monotonic, config, slots, status);

  Parts parts(status, wanted.seconds, &empty_tick);
  tools::late::Witness witness(status, getpid(), gettid(), limit_us > 0);
  std::jthread watching = ordinary_thread([&witness](const std::stop_token& over) {
    while (!over.stop_requested()) {
      std::this_thread::sleep_for(kLookAgain);
      witness.look();
    }
  });
  const std::optional<std::uint64_t> moved_before = migrations(), smis_before = tools::late::smi_count();
  const rt::ThreadCounters before = rt::read_thread_counters();
  rt::allocation_trap::arm(rt::allocation_trap::On::allocation_count);
  result.allocations_watched = rt::allocation_trap::armed();
  const auto ended = executive.run(end_loop);
  result.allocations = rt::allocation_trap::disarm();
  const rt::ThreadCounters after = rt::read_thread_counters();
  rt::leave_real_time();
  watching.request_stop();
  watching.join();
  tools::late::Explanations explained = witness.end();
  result.explained = std::move(explained.ticks);
  result.unexplained = explained.more;
  result.trace = std::move(explained.trace);
  result.untraced = witness.untraced();
  result.broke = empty_tick.broke();
  result.migrations = tools::late::rise(moved_before, migrations());
  result.smis = tools::late::rise(smis_before, tools::late::smi_count());
  parts.end(result);
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
  const std::size_t named = std::min<std::size_t>(status.slot_count.load(), rt::kMaxSlots);
  for (std::size_t i = 0; i < named && !work.slots.empty(); ++i) {
    result.slots.emplace_back(status.slots[i].name.text, distribution_of(status.slots[i].execution));
  }
  result.first_release_ns = static_cast<std::int64_t>(status.start_ns.load());
  result.minor_faults = after.minor_faults - before.minor_faults;
  result.major_faults = after.major_faults - before.major_faults;
  result.voluntary_switches = after.voluntary_switches - before.voluntary_switches;
  result.involuntary_switches = after.involuntary_switches - before.involuntary_switches;
  return result;
}

tl::expected<Result, std::string> attach(const std::string& station, const Wanted& wanted) {
  const auto joined = hal::Joined::join(station);
  if (!joined) {
    return tl::unexpected("--attach: " + joined.error());
  }
  const auto segment = hal::Shared<const rt::CoreSegment>::attach(tools::kCoreSegment,
                                                                  joined->descriptor(tools::kCoreSegment));
  if (!segment) {
    return tl::unexpected("--attach: " + segment.error());
  }
  const rt::CoreStatus& status = (*segment)->status;
  const auto pid = static_cast<int>(status.pid.load());
  const auto period_ns = static_cast<double>(status.period_ns.load());
  if (status.started.load() == 0 || pid == 0 || !(period_ns > 0)) {
    return tl::unexpected(fmt::format("--attach: {}: its core does not tick yet", station));
  }
  tools::stop_signal::watch({SIGINT, SIGTERM}, on_stop_signal);
  Result result;
  result.rate_Hz = 1e9 / period_ns;
  tell_place(pid, result);
  result.machine = machine(result.cpu);
  result.degraded = status.degraded.load() != 0;
  result.first_release_ns = static_cast<std::int64_t>(status.start_ns.load());
  const std::uint64_t ticks = status.ticks.load(), missed = status.missed.load();
  const Distribution wake = bins_of(status.wake), tick = bins_of(status.tick);
  std::vector<Distribution> slots;
  const std::size_t count = std::min<std::size_t>(status.slot_count.load(), rt::kMaxSlots);
  for (std::size_t i = 0; i < count; ++i) {
    slots.push_back(bins_of(status.slots[i].execution));
  }
  Parts parts(status, wanted.seconds, nullptr);
  const ThreadCounts before = thread_counts(pid);
  LatestSeen latest(status);
  tools::late::Witness witness(status, pid, pid, wanted.explain_us > 0);
  const auto begun = std::chrono::steady_clock::now();
  const std::chrono::duration<double> whole(wanted.seconds);
  std::uint64_t last = ticks;
  auto moved = begun;
  // A core that has stopped shortly before the end is looked at until that is certain.
  auto now = begun;
  while (!result.stopped_ticking && !end_loop.load() &&
         (now - begun < whole || now - moved > kPerhapsStopped)) {
    std::this_thread::sleep_for(kLookAgain);
    latest.look();
    witness.look();
    now = std::chrono::steady_clock::now();
    if (status.ticks.load() != last) {
      last = status.ticks.load();
      moved = now;
    }
    result.stopped_ticking = now - moved > kStopped;
  }
  result.seconds = std::chrono::duration<double>((result.stopped_ticking ? moved : now) - begun).count();
  tools::late::Explanations explained = witness.end();
  parts.end(result);
  result.spikes = latest.spikes();
  result.explained = std::move(explained.ticks);
  result.unexplained = explained.more;
  result.trace = std::move(explained.trace);
  result.untraced = witness.untraced();
  result.ticks = status.ticks.load() - ticks;
  result.missed = status.missed.load() - missed;
  result.wake = since(wake, bins_of(status.wake));
  result.tick = since(tick, bins_of(status.tick));
  const ThreadCounts after = thread_counts(pid);
  result.minor_faults = tools::late::rise(before.minor_faults, after.minor_faults);
  result.major_faults = tools::late::rise(before.major_faults, after.major_faults);
  result.voluntary_switches = tools::late::rise(before.voluntary_switches, after.voluntary_switches);
  result.involuntary_switches = tools::late::rise(before.involuntary_switches, after.involuntary_switches);
  result.migrations = tools::late::rise(before.migrations, after.migrations);
  result.smis = tools::late::rise(before.smis, after.smis);
  for (std::size_t i = 0; i < count; ++i) {
    result.slots.emplace_back(status.slots[i].name.text, since(slots[i], bins_of(status.slots[i].execution)));
  }
  return result;
}

}  // namespace punctum::jitter
