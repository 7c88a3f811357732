// Searches for schedules of lies, motions, buttons, stalls and commands that break an invariant of the servo,
// and shrinks what it finds.
//
//   search_test                                     the tests: a bounded number of schedules
//   search_test --schedules N [--seed S] [--jobs J] [--first K] [--only M3] [--worst 1]   a campaign over all
//   invariants
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "tests/search/schedule.hpp"

namespace punctum::rt::test {
namespace {

// As cases are printed.
[[maybe_unused]] constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Found {
  Schedule schedule;
  Broken broken;
  std::uint64_t number = 0, times = 0;
  double worst = 0;  // of all schedules
  Schedule worst_schedule;
};
struct Outcome {
  std::map<Invariant, Found> found;
  Coverage coverage;
  std::array<double, kInvariants> largest{};
  std::uint64_t ticks = 0;
};

std::size_t cost(const Schedule& s) {
  return 1000 * s.events.size() + static_cast<std::size_t>(s.ticks) / 10;
}

// One for each set-up, prepared when it is needed.
class Machines {
 public:
  Search& of(const Schedule& s) {
    auto& machine = machines_.at(static_cast<std::size_t>(s.setup));
    if (!machine) {
      machine = std::make_unique<Search>(s.setup);
    }
    return *machine;
  }

 private:
  std::array<std::unique_ptr<Search>, 5> machines_;
};

Outcome search(std::uint64_t seed, std::uint64_t first, std::uint64_t count, int jobs) {
  std::vector<Outcome> parts(static_cast<std::size_t>(jobs));
  std::vector<std::thread> threads;
  for (int j = 0; j < jobs; ++j) {
    threads.emplace_back([&, j] {
      Outcome& out = parts[static_cast<std::size_t>(j)];
      Machines machines;
      for (std::uint64_t k = first + static_cast<std::uint64_t>(j); k < first + count;
           k += static_cast<std::uint64_t>(jobs)) {
        const Schedule s = random_schedule(seed, k);
        out.ticks += static_cast<std::uint64_t>(s.ticks);
        for (const Broken& b : machines.of(s).run(s, &out.coverage)) {
          Found& f = out.found[b.what];
          if (f.times == 0 || b.worst > f.worst) {
            f.worst = b.worst;
            f.worst_schedule = s;
          }
          if (f.times++ == 0 || cost(s) < cost(f.schedule)) {
            f.schedule = s;
            f.broken = b;
            f.number = k;
          }
        }
        for (std::size_t i = 0; i < kInvariants; ++i) {
          out.largest[i] =
              std::max(out.largest[i], machines.of(s).station().checker().largest(static_cast<Invariant>(i)));
        }
      }
    });
  }
  for (std::thread& t : threads) {
    t.join();
  }
  Outcome all;
  for (const Outcome& part : parts) {
    all.coverage.add(part.coverage);
    all.ticks += part.ticks;
    for (std::size_t i = 0; i < kInvariants; ++i) {
      all.largest[i] = std::max(all.largest[i], part.largest[i]);
    }
    for (const auto& [what, f] : part.found) {
      Found& best = all.found[what];
      const std::uint64_t times = best.times + f.times;
      const Found& worse = best.times == 0 || f.worst > best.worst ? f : best;
      const double worst = worse.worst;
      const Schedule worst_schedule = worse.worst_schedule;
      if (best.times == 0 || cost(f.schedule) < cost(best.schedule) ||
          (cost(f.schedule) == cost(best.schedule) && f.number < best.number)) {
        best = f;
      }
      best.times = times;
      best.worst = worst;
      best.worst_schedule = worst_schedule;
    }
  }
  return all;
}

std::string describe(Machines& machines, Invariant what, const Found& f) {
  Search& machine = machines.of(f.schedule);
  const Schedule s = machine.shrink(f.schedule, what);
  const std::vector<Broken> all = machine.run(s, nullptr, what);
  const Broken* b = machine.find(all, what);
  char text[200];
  std::snprintf(text, sizeof text,
                "%s %s: %.6g, at most %.6g allowed, on tick %d (in all schedules up to %.6g)\n",
                name(what).number, name(what).name, b->found, b->allowed, b->tick, f.worst);
  return text + ("    {Invariant::" + std::string(name(what).name)) + ", " + print(s) + "},\n";
}

void print(const Coverage& c) {
  std::printf("\nticks by phase and stop stage\n%-12s %12s %12s %12s\n", "", "running", "stopping",
              "stopped");
  std::size_t states = 0, transitions = 0;
  for (std::size_t p = 0; p < kPhases; ++p) {
    std::printf("%-12s", name(static_cast<Phase>(p)));
    for (std::size_t s = 0; s < 3; ++s) {
      std::uint64_t n = 0;
      for (std::size_t f = 0; f < kFaults; ++f) {
        n += c.ticks[(p * 3 + s) * kFaults + f];
      }
      std::printf(" %12llu", static_cast<unsigned long long>(n));
    }
    std::printf("\n");
  }
  std::printf("\nfaults latched: in how many phases, on how many ticks\n");
  for (std::size_t f = 0; f < kFaults; ++f) {
    std::uint64_t n = 0, phases = 0;
    for (std::size_t p = 0; p < kPhases; ++p) {
      std::uint64_t here = 0;
      for (std::size_t s = 0; s < 3; ++s) {
        here += c.ticks[(p * 3 + s) * kFaults + f];
      }
      n += here;
      phases += here > 0 ? 1 : 0;
    }
    std::printf("%-20s %3llu %12llu%s\n", name(static_cast<Fault>(f)),
                static_cast<unsigned long long>(phases), static_cast<unsigned long long>(n),
                n == 0 ? "   never" : "");
  }
  for (std::size_t i = 0; i < Coverage::kStates; ++i) {
    states += c.ticks[i] > 0 ? 1 : 0;
  }
  for (const bool t : c.transitions) {
    transitions += t ? 1 : 0;
  }
  std::printf("\n%zu states phase x stop x fault, %zu transitions between them\ntransitions of the phase:",
              states, transitions);
  for (std::size_t p = 0; p < kPhases; ++p) {
    for (std::size_t q = 0; q < kPhases; ++q) {
      bool seen = false;
      for (std::size_t i = 0; p != q && i < 3 * kFaults; ++i) {
        for (std::size_t k = 0; k < 3 * kFaults; ++k) {
          seen = seen || c.transitions[(p * 3 * kFaults + i) * Coverage::kStates + q * 3 * kFaults + k];
        }
      }
      if (seen) {
        std::printf(" %s>%s", name(static_cast<Phase>(p)), name(static_cast<Phase>(q)));
      }
    }
  }
  std::printf("\n");
  for (std::size_t i = 0; i < kLies; ++i) {
    if (c.lies[i] == 0) {
      std::printf("never told: %s\n", kLieNames[i]);
    }
  }
}

// ---- tests ----

struct Case {
  Invariant what;
  Schedule schedule;
};
const std::vector<Case>& found_cases() {
  static const std::vector<Case> cases{
#include "tests/search/found_cases.inc"
  };
  return cases;
}

TEST(Search, cases_that_once_broke_an_invariant_break_it_no_more) {
  Machines machines;
  for (const Case& c : found_cases()) {
    Search& machine = machines.of(c.schedule);
    const std::vector<Broken> all = machine.run(c.schedule);
    const Broken* b = machine.find(all, c.what);
    EXPECT_EQ(b, nullptr) << name(c.what).number << " " << name(c.what).name << ": " << b->found
                          << ", at most " << b->allowed << " allowed, on tick " << b->tick << "\n"
                          << print(c.schedule);
  }
}

TEST(Search, no_schedule_breaks_an_invariant) {
  const Outcome out = search(1, 0, PUNCTUM_SCHEDULES, 1);
  Machines machines;
  for (const auto& [what, f] : out.found) {
    ADD_FAILURE() << f.times << " of " << PUNCTUM_SCHEDULES << " schedules, for example number " << f.number
                  << ", shrunk:\n"
                  << describe(machines, what, f);
  }
  print(out.coverage);
}

TEST(Search, a_schedule_gives_the_same_run_again) {
  Machines a, b;
  for (std::uint64_t k = 0; k < 40; ++k) {
    const Schedule s = random_schedule(7, k);
    a.of(s).run(s);
    const TelemetrySample first = a.of(s).station().sample();
    const Schedule between = random_schedule(7, k + 1);
    a.of(between).run(between);
    a.of(s).run(s);
    const TelemetrySample again = a.of(s).station().sample();
    b.of(s).run(s);
    const TelemetrySample other = b.of(s).station().sample();
    EXPECT_EQ(std::memcmp(&first, &again, sizeof first), 0) << k;
    EXPECT_EQ(std::memcmp(&first, &other, sizeof first), 0) << k;
  }
}

TEST(Search, an_honest_run_breaks_nothing) {
  for (const int setup : {0, 4}) {
    Search machine(setup);
    for (std::size_t from = 0; from < kFroms; ++from) {
      for (const double way_m : {-20e-3, 20e-3}) {
        for (const Broken& b :
             machine.run({static_cast<From>(from), 1500, {{100, 1000, Lie::moves, way_m, 0}}, setup})) {
          ADD_FAILURE() << "set-up " << setup << ", " << kFromNames[from] << ", hand by " << way_m
                        << " m: " << name(b.what).number << " " << name(b.what).name << ": " << b.found
                        << ", at most " << b.allowed << ", tick " << b.tick;
        }
      }
    }
  }
}

int campaign(int argc, char** argv) {
  std::uint64_t schedules = 0, seed = 1, first = 0;
  int jobs = 1;
  std::string only;
  bool worst = false;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    if (key == "--schedules") {
      schedules = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (key == "--seed") {
      seed = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (key == "--first") {
      first = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (key == "--jobs") {
      jobs = std::max(1, std::atoi(argv[i + 1]));
    } else if (key == "--worst") {
      worst = std::atoi(argv[i + 1]) != 0;
    } else if (key == "--only") {
      only = argv[i + 1];
    }
  }
  const auto begun = std::chrono::steady_clock::now();
  const Outcome out = search(seed, first, schedules, jobs);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::printf("%llu schedules, %llu ticks, %.1f s, %.3f ms each\n",
              static_cast<unsigned long long>(schedules), static_cast<unsigned long long>(out.ticks), seconds,
              1e3 * seconds / static_cast<double>(std::max<std::uint64_t>(schedules, 1)));
  print(out.coverage);
  std::printf("\nlargest value that was allowed, by invariant\n");
  for (std::size_t i = 0; i < kInvariants; ++i) {
    if (out.largest[i] > 0) {
      std::printf("%-4s %-26s %.6g\n", kInvariantNames[i].number, kInvariantNames[i].name, out.largest[i]);
    }
  }
  std::printf("\n%zu invariants broken\n", out.found.size());
  Machines machines;
  bool bad = false;
  std::vector<std::pair<Invariant, const Found*>> order;
  for (const auto& [what, f] : out.found) {
    order.emplace_back(what, &f);
  }
  for (const auto& [what, f] : order) {
    if (!only.empty() && only != name(what).number) {
      continue;
    }
    bad = true;
    if (worst) {
      std::printf("\nworst, not shrunk: %s", print(f->worst_schedule).c_str());
    }
    std::printf("\n%llu times, first seen shortest in number %llu\n%s",
                static_cast<unsigned long long>(f->times), static_cast<unsigned long long>(f->number),
                describe(machines, what, *f).c_str());
    std::fflush(stdout);
  }
  return bad ? 1 : 0;
}

}  // namespace
}  // namespace punctum::rt::test

int main(int argc, char** argv) {
  if (argc > 1 && std::strcmp(argv[1], "--schedules") == 0) {
    return punctum::rt::test::campaign(argc, argv);
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
