// punctum-tick-cost TAPE SCENE VARIANT...: runs the servo of a scene through recorded ticks, once for each
// variant: overrides separated by ',', or "" for the scene itself. Topic scenes runs this program under
// callgrind and reads the instructions of each variant. punctum-tick-cost record TAPE SCENE VARIANT makes the
// tape, punctum-tick-cost time TAPE SCENE VARIANT times its ticks.
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/report/tick_tape.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/version.hpp"

namespace punctum::report {

std::vector<std::string> overrides_of(std::string_view variant) {
  const auto parts = tools::split_csv(variant);
  return variant.empty() ? std::vector<std::string>{} : std::vector<std::string>(parts.begin(), parts.end());
}

// callgrind writes its counts each time this function returns.
[[gnu::noinline]] rt::Fault run_variant(const tools::Scene& scene, const std::vector<TickTold>& tape) {
  return replay_ticks(scene, tape);
}

int bad(const std::string& text) {
  tools::complain(text);
  return 2;
}

int record(const char* file, const char* name, const char* variant) {
  const auto scene = tools::load_scene(name, overrides_of(variant));
  if (!scene) {
    return bad(scene.error());
  }
  if (!scene->sim || scene->seconds <= 0) {
    return bad(scene->name + ": no simulated run of it ends");
  }
  const auto tape = record_ticks(*scene, scene->seconds);
  if (const auto written = write_tape(file, tape); !written) {
    return bad(written.error());
  }
  tools::say(fmt::format("{}\n", tape.size()));
  return tools::code_after_words(0);
}

// Three times, of which the fastest for each tick: what the machine does besides is not the servo's.
int time(const char* file, const char* name, const char* variant) {
  const auto scene = tools::load_scene(name, overrides_of(variant));
  const auto tape = read_tape(file);
  if (!scene || !tape) {
    return bad(!scene ? scene.error() : tape.error());
  }
  if (tape->empty()) {
    return bad(fmt::format("{}: holds no tick", file));
  }
  std::vector<std::int64_t> ns = time_ticks(*scene, *tape);
  for (int again = 0; again < 2; ++again) {
    const std::vector<std::int64_t> now = time_ticks(*scene, *tape);
    std::transform(ns.begin(), ns.end(), now.begin(), ns.begin(),
                   [](std::int64_t a, std::int64_t b) { return std::min(a, b); });
  }
  std::sort(ns.begin(), ns.end());
  const auto at = [&](double part) {
    return 1e-3 *
           static_cast<double>(ns[static_cast<std::size_t>(part * static_cast<double>(ns.size() - 1))]);
  };
  tools::say(
      fmt::format("{} ticks, us with the clock: median {:.3f}, p99 {:.3f}, p99.9 {:.3f}, longest {:.3f}\n",
                  ns.size(), at(0.5), at(0.99), at(0.999), at(1)));
  return tools::code_after_words(0);
}

int run(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--version") {
    tools::say(tools::version_line("punctum-tick-cost") + "\n");
    return tools::code_after_words(0);
  }
  if (argc == 2 && (std::string_view(argv[1]) == "--help" || std::string_view(argv[1]) == "-h")) {
    fmt::print(
        "Runs the servo of a scene through recorded ticks, once per variant, for counting instructions.\n"
        "With record, the ticks of one variant are recorded instead; with time, they are timed, back to "
        "back, each as the fastest of three.\n"
        "Usage: punctum-tick-cost [record|time] TAPE SCENE VARIANT...\n\n"
        "Examples:\n  punctum-report scenes\n      records the tape and starts this program under "
        "callgrind\n\n"
        "Exit codes:\n  0  all variants were run\n  2  bad input\n");
    return 0;
  }
  if (argc < 4) {
    return bad("punctum-tick-cost TAPE SCENE VARIANT...; `punctum-report scenes` starts this program");
  }
  if (argc == 5 && std::string_view(argv[1]) == "record") {
    return record(argv[2], argv[3], argv[4]);
  }
  if (argc == 5 && std::string_view(argv[1]) == "time") {
    return time(argv[2], argv[3], argv[4]);
  }
  const auto tape = read_tape(argv[1]);
  if (!tape) {
    return bad(tape.error());
  }
  for (int i = 3; i < argc; ++i) {
    const auto scene = tools::load_scene(argv[2], overrides_of(argv[i]));
    if (!scene) {
      return bad(scene.error());
    }
    tools::say(fmt::format("{} {}\n", tape->size(), rt::name(run_variant(*scene, *tape))));
  }
  return tools::code_after_words(0);
}

}  // namespace punctum::report

int main(int argc, char** argv) {
  punctum::tools::start_program();
  return punctum::report::run(argc, argv);
}
