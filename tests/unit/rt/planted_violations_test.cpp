// What may not happen in the tick, planted into it one by one, and which layer of our checks finds it. Every
// cell of the table is measured: a layer that no longer finds a plant fails here, and so does one that has
// begun to.
//
// Preset rtsan measures what needs its compiler:
//   effects     -Wfunction-effects refuses the plant
//   sanitizer   -fsanitize=realtime ends the run
// every other preset the rest:
//   symbols     nm shows a symbol that the core may not have
//   heap trap   rt/platform/allocation_trap counts heap calls in the loop
//   counters    the kernel counts page faults or sleeps of the thread
//   budget      callgrind counts more instructions per tick than the budget
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <regex>
#include <sstream>
#include <string>

#include "tests/support/symbols.hpp"

namespace punctum::tests {
namespace {

enum Layer : unsigned { effects = 1, sanitizer = 2, symbols = 4, heap_trap = 8, counters = 16, budget = 32 };
struct Name {
  Layer layer;
  const char* name;
};
constexpr std::array kLayers{Name{effects, "effects"},   Name{sanitizer, "sanitizer"},
                             Name{symbols, "symbols"},   Name{heap_trap, "heap trap"},
                             Name{counters, "counters"}, Name{budget, "budget"}};

#ifdef PUNCTUM_PLANTED_EFFECTS
constexpr unsigned kMeasured = effects | sanitizer;
#else
constexpr unsigned kMeasured = symbols | heap_trap | counters | budget;
#endif

enum class Ends { with_the_loop, at_once };  // the program
struct Plant {
  const char* name;
  unsigned found_by;
  Ends ends = Ends::with_the_loop;
};

void PrintTo(const Plant& plant, std::ostream* out) { *out << plant.name; }

constexpr std::array kPlants{
    Plant{"malloc", effects | sanitizer | symbols | heap_trap},
    Plant{"operator_new", effects | sanitizer | symbols | heap_trap},
    Plant{"operator_delete", effects | sanitizer | symbols | heap_trap},
    Plant{"vector_growth", effects | sanitizer | symbols | heap_trap},
    Plant{"string", effects | sanitizer | symbols | heap_trap},
    Plant{"exception", effects | sanitizer | symbols | heap_trap | budget},
    Plant{"range_check", effects | symbols},
    Plant{"dynamic_cast", symbols},
    Plant{"mutex", effects | sanitizer | symbols},
    Plant{"condition_variable", effects | sanitizer | symbols | counters},
    Plant{"printf", effects | sanitizer | symbols | heap_trap},
    Plant{"iostream", effects | sanitizer | symbols | heap_trap},
    Plant{"log", effects | sanitizer | symbols | heap_trap},
    Plant{"file", effects | sanitizer | symbols},
    Plant{"system_call", effects | sanitizer | symbols},
    Plant{"sleep", effects | sanitizer | symbols | counters},
    Plant{"page_touch", counters},
    Plant{"unbounded_loop", budget},
    Plant{"virtual_call", effects | sanitizer | counters},
    Plant{"function_pointer", effects | sanitizer | heap_trap},
    Plant{"guarded_static", effects | symbols},
    Plant{"thread_local", effects | sanitizer | symbols | heap_trap},
    Plant{"exit", symbols, Ends::at_once},
    Plant{"assert", sanitizer | symbols, Ends::at_once},
    Plant{"thread", effects | sanitizer | symbols | heap_trap | counters},
    Plant{"nothing", 0},
};

struct Finished {
  std::string output;
  int code = -1;
};

Finished run(const std::string& command) {
  const auto close = [](std::FILE* f) { pclose(f); };
  std::unique_ptr<std::FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  Finished finished;
  std::array<char, 4096> buffer{};
  while (pipe != nullptr && std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) {
    finished.output += buffer.data();
  }
  if (pipe != nullptr) {
    const int status = pclose(pipe.release());
    finished.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  return finished;
}

// What the program says on its error output; its standard output belongs to the plant.
Finished run_program(const std::string& before, const std::string& plant) {
  return run(before + " '" PUNCTUM_PLANTED_DIR "/planted_tick_" + plant + "' 2>&1 >/dev/null");
}

#ifdef PUNCTUM_PLANTED_EFFECTS

unsigned measure(const std::string& plant, Ends ends) {
  unsigned found = 0;
  std::ifstream log(PUNCTUM_PLANTED_DIR "/" + plant + ".effects");
  EXPECT_TRUE(log.good()) << "the compiler was not asked";
  const std::string said{std::istreambuf_iterator<char>(log), {}};
  EXPECT_EQ(said.find(" error: "), std::string::npos) << said;
  if (said.find("[-Wfunction-effects]") != std::string::npos) {
    found |= effects;
  }
  const Finished watched = run_program("", plant);
  if (watched.output.find("RealtimeSanitizer: ") != std::string::npos) {
    found |= sanitizer;
  } else {
    EXPECT_EQ(watched.code == 0, ends == Ends::with_the_loop) << watched.output;
  }
  return found;
}

#else

// In 200 ticks; without a plant the loop shows a few first touches of code, and no sleep.
constexpr std::uint64_t kPageFaults = 100, kSleeps = 100;
constexpr double kInstructions = 4000;  // per tick

double instructions_per_tick(const std::string& plant) {
  const Finished counted = run_program(
      PUNCTUM_VALGRIND " --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect=planted_work",
      plant);
  std::smatch collected;
  if (!std::regex_search(counted.output, collected, std::regex("Collected : ([0-9]+)"))) {
    ADD_FAILURE() << counted.output;
    return 0;
  }
  return std::stod(collected[1]) / 200;
}

unsigned measure(const std::string& plant, Ends ends) {
  unsigned found = 0;
  const Symbols asked = symbols_of(PUNCTUM_NM_PROGRAM, PUNCTUM_PLANTED_DIR "/libplanted_" + plant + ".a");
  EXPECT_FALSE(asked.defined.empty()) << "the planted object is not there";
  if (!offences(asked).empty()) {
    found |= symbols;
  }
  const Finished ran = run_program("", plant);
  EXPECT_EQ(ran.code == 0, ends == Ends::with_the_loop) << ran.output;
  if (ends == Ends::at_once) {
    return found;
  }
  std::istringstream words(ran.output);
  std::uint64_t ticks = 0, heap_calls = 0, page_faults = 0, sleeps = 0;
  std::string word;
  words >> word >> ticks >> word >> heap_calls >> word >> page_faults >> word >> sleeps;
  EXPECT_EQ(ticks, 200U) << ran.output;
  if (heap_calls > 0) {
    found |= heap_trap;
  }
  if (page_faults > kPageFaults || sleeps > kSleeps) {
    found |= counters;
  }
  const double instructions = instructions_per_tick(plant);
  if (instructions > kInstructions) {
    found |= budget;
  }
  std::printf("%-20s heap calls %llu, page faults %llu, sleeps %llu, instructions per tick %.0f\n",
              plant.c_str(), static_cast<unsigned long long>(heap_calls),
              static_cast<unsigned long long>(page_faults), static_cast<unsigned long long>(sleeps),
              instructions);
  return found;
}

#endif

std::string names_of(unsigned layers) {
  std::string names;
  for (const auto& [layer, name] : kLayers) {
    if ((layers & layer) != 0) {
      names += std::string(names.empty() ? "" : ", ") + name;
    }
  }
  return names.empty() ? "none" : names;
}

class PlantedViolation : public testing::TestWithParam<Plant> {};

TEST_P(PlantedViolation, is_found_by_the_layers_of_the_table) {
  const auto& [name, found_by, ends] = GetParam();
  EXPECT_EQ(names_of(measure(name, ends)), names_of(found_by & kMeasured));
}

INSTANTIATE_TEST_SUITE_P(, PlantedViolation, testing::ValuesIn(kPlants),
                         [](const auto& plant) { return std::string(plant.param.name); });

TEST(PlantedViolations, every_one_is_found_and_at_least_18_by_two_layers) {
  std::printf("%-20s", "planted");
  for (const auto& [layer, name] : kLayers) {
    std::printf(" %-9s", name);
  }
  std::printf("\n");
  int plants = 0, found_twice = 0;
  for (const auto& [name, found_by, ends] : kPlants) {
    std::printf("%-20s", name);
    int layers = 0;
    for (const auto& [layer, layer_name] : kLayers) {
      const bool found = (found_by & layer) != 0;
      std::printf(" %-9s", found ? "yes" : "-");
      layers += found ? 1 : 0;
    }
    std::printf("\n");
    if (std::string(name) != "nothing") {
      ++plants;
      EXPECT_GE(layers, 1) << name;
      found_twice += layers >= 2 ? 1 : 0;
    }
  }
  EXPECT_GE(plants, 20);
  EXPECT_GE(found_twice, 18);
}

}  // namespace
}  // namespace punctum::tests
