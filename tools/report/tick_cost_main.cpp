// punctum-tick-cost TAPE SCENE VARIANT...: takes the servo of a scene through recorded ticks, once for each
// variant (overrides with ',' between them, "" for the scene as it is). For the topic `scenes`, which runs it
// under callgrind and reads what each variant executed.
#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "tools/report/tick_tape.hpp"

namespace punctum::report {

std::vector<std::string> overrides_of(std::string_view variant) {
  std::vector<std::string> overrides;
  while (!variant.empty()) {
    const std::size_t comma = variant.find(',');
    overrides.emplace_back(variant.substr(0, comma));
    variant = comma == std::string_view::npos ? std::string_view{} : variant.substr(comma + 1);
  }
  return overrides;
}

// callgrind writes its counts each time this returns.
[[gnu::noinline]] rt::Fault run_variant(const tools::Scene& scene, const std::vector<TickTold>& tape) {
  return replay_ticks(scene, tape);
}

int run(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr,
               "punctum-tick-cost TAPE SCENE VARIANT...; `punctum-report scenes` starts this program\n");
    return 2;
  }
  const auto tape = read_tape(argv[1]);
  if (!tape) {
    fmt::print(stderr, "{}\n", tape.error());
    return 2;
  }
  for (int i = 3; i < argc; ++i) {
    const auto scene = tools::load_scene(argv[2], overrides_of(argv[i]));
    if (!scene) {
      fmt::print(stderr, "{}\n", scene.error());
      return 2;
    }
    fmt::print("{} {}\n", tape->size(), rt::name(run_variant(*scene, *tape)));
  }
  return 0;
}

}  // namespace punctum::report

int main(int argc, char** argv) { return punctum::report::run(argc, argv); }
