// punctum-jitter: how punctually this machine wakes the loop of the core.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <exception>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tools/jitter/audit.hpp"
#include "tools/jitter/comparison.hpp"
#include "tools/jitter/difference.hpp"
#include "tools/jitter/load.hpp"
#include "tools/jitter/measurement.hpp"
#include "tools/jitter/result.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/version.hpp"
#include "tools/shared/whole_file.hpp"

namespace {

using namespace punctum;
using tools::complain;
using tools::say;

enum Exit : int { kDone = 0, kNotReady = 1, kBadInput = 2, kDiffers = 1 };

int bad(const std::string& text) {
  complain(text);
  return kBadInput;
}

int columns() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col >= 60 ? std::min<int>(size.ws_col, 160)
                                                                           : 100;
}

tl::expected<jitter::Result, std::string> read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) {
    return tl::unexpected(fmt::format("{}: cannot be read", path));
  }
  auto result = jitter::result_of_json(text.str());
  return result ? result : tl::unexpected(fmt::format("{}: {}", path, result.error()));
}

int diff(const std::vector<std::string>& files) {
  const auto a = read(files[0]), b = read(files[1]);
  for (const auto* one : {&a, &b}) {
    if (!*one) {
      return bad(one->error());
    }
  }
  const auto found = jitter::difference(*a, *b);
  if (!found) {
    return bad(found.error());
  }
  say(jitter::difference_text(*found, *a, *b));
  return std::any_of(found->begin(), found->end(), [](const auto& q) { return q.differs; }) ? kDiffers
                                                                                            : kDone;
}

int audit(int cpu, int priority) {
  const auto findings = jitter::audit(cpu, priority);
  say(jitter::audit_text(findings));
  const bool ready = std::none_of(findings.begin(), findings.end(),
                                  [](const auto& f) { return f.required && !f.remedy.empty(); });
  return ready ? kDone : kNotReady;
}

int compare(const jitter::Wanted& wanted) {
  const auto both = jitter::compare_with_cyclictest(wanted);
  if (!both) {
    return bad(both.error());
  }
  const auto found = jitter::difference(both->cyclictest, both->loop);
  if (!found) {
    return bad("--compare: " + found.error() + "; take more --seconds");
  }
  say("A: cyclictest, B: the loop of the core, in turns\n" +
      jitter::difference_text(*found, both->cyclictest, both->loop));
  say(fmt::format("max{:>14.1f}{:>9.1f}\n", both->cyclictest.wake.max_us, both->loop.wake.max_us));
  return kDone;
}

int measure(const jitter::Wanted& wanted, const std::string& load, const std::string& histogram,
            const std::string& json) {
  auto result = jitter::measure(wanted);
  if (!result) {
    return bad(result.error());
  }
  result->load = load;
  say(jitter::summary(*result, columns()));
  for (const auto& [path, text] : {std::pair(histogram, jitter::histogram_text(result->wake)),
                                   std::pair(json, jitter::json_of(*result))}) {
    if (path.empty()) {
      continue;
    }
    if (const auto written = tools::write_whole(path, text); !written) {
      return bad(written.error());
    }
  }
  return tools::all_was_said() ? kDone : kNotReady;
}

int main_or_throw(int argc, char** argv) {
  CLI::App app{
      "How punctually this machine wakes a real-time loop: the executive and the set-up of the core, with a "
      "tick "
      "that does nothing.",
      "punctum-jitter"};
  tools::set_help_style(app);
  app.set_version_flag("--version", tools::version_line("punctum-jitter"), "version and commit");
  app.footer(tools::help_footer(
      {{"punctum-jitter --seconds 60 --cpu 3 --json a.json", "one minute on CPU 3"},
       {"punctum-jitter --compare --load --seconds 60",
        "the core's loop and cyclictest in turns, under load"},
       {"punctum-jitter diff a.json b.json", "whether two results differ, and where"},
       {"punctum-jitter --audit --cpu 3", "what of this machine is not ready, and what mends it"}},
      {{kDone, "it was measured; the machine is ready; no difference is shown"},
       {kNotReady, "the audit found something missing; the results differ"},
       {kBadInput, "bad input"}}));
  jitter::Wanted wanted;
  std::string histogram, json;
  bool audit_only = false, loaded = false, beside = false;
  const int last_cpu = static_cast<int>(std::max(1U, std::thread::hardware_concurrency())) - 1;
  app.add_option("--rate", wanted.rate_Hz, "ticks per second (default: 1000)")
      ->type_name("HZ")
      ->check(CLI::Range(1.0, 20'000.0));
  app.add_option("--seconds", wanted.seconds, "how long (default: 10)")
      ->type_name("S")
      ->check(CLI::Range(0.1, 604'800.0));
  app.add_option("--cpu", wanted.cpu, "the CPU that the loop is bound to (default: none)")
      ->type_name("N")
      ->check(CLI::Range(0, last_cpu));
  app.add_option("--priority", wanted.priority, "of SCHED_FIFO (default: 80, as the core)")
      ->type_name("P")
      ->check(CLI::Range(1, 98));
  app.add_option("--histogram", histogram, "wake-ups as cyclictest writes them")->type_name("FILE");
  app.add_option("--json", json, "everything that was found")->type_name("FILE");
  app.add_flag("--audit", audit_only, "measure nothing; say what of this machine is not ready");
  app.add_flag("--load", loaded, "keep processors, caches, disk, scheduler and timers busy meanwhile");
  app.add_flag("--compare", beside, "take turns with cyclictest, half of the time each");
  CLI::App* difference = app.add_subcommand("diff", "whether two results differ, and where");
  std::vector<std::string> files;
  difference->add_option("FILES", files, "two results of --json")->required()->expected(2);
  if (const auto code = tools::parse_command_line(app, argc, argv)) {
    return *code;
  }
  if (difference->parsed()) {
    return diff(files);
  }
  if (audit_only) {
    return audit(wanted.cpu, wanted.priority);
  }
  if (beside && !(histogram.empty() && json.empty())) {
    return bad("--compare: writes no files, allowed without --histogram and --json");
  }
  tl::expected<jitter::Load, std::string> load = tl::unexpected(std::string());
  if (loaded) {
    load = jitter::Load::start();
    if (!load) {
      return bad(load.error());
    }
  }
  return beside ? compare(wanted) : measure(wanted, loaded ? jitter::Load::stated() : "", histogram, json);
}

}  // namespace

int main(int argc, char** argv) {
  punctum::tools::start_program();
  try {
    return main_or_throw(argc, argv);
  } catch (const std::exception& e) {
    complain(std::string("punctum-jitter: ") + e.what());
    return kBadInput;
  }
}
