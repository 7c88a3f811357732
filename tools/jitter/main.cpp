// punctum-jitter: how punctually this machine wakes the loop of the core.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "rt/platform/kernel_facts.hpp"
#include "tools/jitter/answer.hpp"
#include "tools/jitter/audit.hpp"
#include "tools/jitter/comparison.hpp"
#include "tools/jitter/difference.hpp"
#include "tools/jitter/load.hpp"
#include "tools/jitter/measurement.hpp"
#include "tools/jitter/picture.hpp"
#include "tools/jitter/result.hpp"
#include "tools/jitter/servo_tick.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/figure.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/stop_signal.hpp"
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
  const auto text = tools::read_whole(path);
  if (!text) {
    return tl::unexpected(text.error());
  }
  auto result = jitter::result_of_json(*text);
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
  return found->any() ? kDiffers : kDone;
}

int audit(int cpu, int priority, const tools::Scene* scene, const std::string& plan_folder) {
  const auto findings = jitter::audit(cpu, priority, scene);
  say(jitter::audit_text(findings));
  if (!plan_folder.empty()) {
    const auto files = jitter::plan(findings);
    if (const auto written = jitter::write_plan(files, plan_folder); !written) {
      return bad(written.error());
    }
    say(fmt::format("what mends it: {}/README\n", plan_folder));
  }
  const bool ready = std::none_of(findings.begin(), findings.end(),
                                  [](const auto& f) { return f.required && !f.remedy.empty(); });
  return ready ? kDone : kNotReady;
}

int compare(const jitter::Wanted& wanted, const std::vector<std::string>& tick) {
  const auto both = jitter::compare_with_cyclictest(wanted, tick);
  if (!both) {
    complain(both.error());
    return tools::stop_signal::count() > 0 ? kNotReady : kBadInput;
  }
  const auto found = jitter::difference(both->cyclictest, both->loop);
  if (!found) {
    return bad("--compare: " + found.error());
  }
  say("A: cyclictest, B: the loop of the core, in turns\n" +
      jitter::difference_text(*found, both->cyclictest, both->loop));
  return kDone;
}

// Where the result goes besides the terminal; empty: nowhere.
struct Files {
  std::string histogram, json, trace, picture;

  [[nodiscard]] bool are_none() const {
    return histogram.empty() && json.empty() && trace.empty() && picture.empty();
  }
  // The first of them that could not be written: a measurement takes its time, and would be lost. Empty:
  // none.
  [[nodiscard]] std::string without_folder() const {
    for (const auto& [option, file] : {std::pair("--histogram", histogram),
                                       {"--json", json},
                                       {"--trace", trace},
                                       {"--picture", picture}}) {
      const auto folder = std::filesystem::path(file).parent_path();
      std::error_code error;
      if (!folder.empty() && !std::filesystem::is_directory(folder, error)) {
        return fmt::format("{}: {}: there is no folder {}", option, file, folder.string());
      }
      if (!file.empty() && ::access(folder.empty() ? "." : folder.c_str(), W_OK | X_OK) != 0) {
        return fmt::format("{}: {}: cannot be written: {}", option, file, std::strerror(errno));
      }
    }
    return {};
  }
};

int measure(const jitter::Wanted& wanted, const std::string& load, const Files& files,
            const std::string& station, const std::string& gpio, jitter::ServoTick* servo) {
  auto result = !station.empty() ? jitter::attach(station, wanted)
                : !gpio.empty()  ? jitter::measure_gpio_answers(wanted, gpio)
                                 : jitter::measure(wanted, servo != nullptr ? servo->work() : jitter::Work{});
  if (!result) {
    return bad(result.error());
  }
  if (servo != nullptr) {
    result->work = servo->did();
  }
  result->load = load;
  say(jitter::summary(*result, columns()));
  bool all_written = true;
  for (const auto& [path, text] :
       {std::pair(files.histogram, jitter::histogram_text(result->wake)),
        std::pair(files.json, jitter::json_of(*result)), std::pair(files.trace, result->trace)}) {
    if (path.empty() || text.empty()) {
      continue;
    }
    if (const auto written = tools::write_whole(path, text); !written) {
      complain(written.error());
      all_written = false;
    }
  }
  if (!files.picture.empty()) {
    if (const auto drawn = tools::draw(jitter::picture_of(*result), files.picture); !drawn) {
      complain("--picture: " + drawn.error());
      all_written = false;
    }
  }
  if (!all_written) {
    return kNotReady;
  }
  if (!files.trace.empty() && result->trace.empty()) {
    complain(fmt::format("--trace: {} is not written: {}", files.trace,
                         result->untraced.empty() ? "no tick was late" : result->untraced));
    if (!result->untraced.empty()) {
      return kNotReady;
    }
  }
  if (result->stopped_ticking) {
    complain(fmt::format("--attach: {}: its core has stopped ticking", station));
    return kNotReady;
  }
  if (!gpio.empty() && result->answer.entries() == 0) {
    complain("--gpio: no change was answered: is ASK wired to IN, and OUT to SEEN?");
    return kNotReady;
  }
  return kDone;
}

int main_or_throw(int argc, char** argv) {
  CLI::App app{
      "How punctually this machine wakes a real-time loop, and why not: the executive and the set-up of the "
      "core, with a tick that does nothing, or all that the core does.",
      "punctum-jitter"};
  tools::set_help_style(app);
  app.set_version_flag("--version", tools::version_line("punctum-jitter"), "version and commit");
  app.footer(tools::help_footer(
      {{"punctum-jitter --seconds 60 --cpu 3 --json a.json", "one minute on CPU 3"},
       {"punctum-jitter --tick servo icsi --explain 300",
        "the whole tick of the core, and what made it late"},
       {"punctum-jitter --compare --load --seconds 60",
        "the core's loop and cyclictest in turns, under load"},
       {"punctum-jitter diff a.json b.json", "whether two results differ, and where"},
       {"punctum-jitter --break 200 --cpu 3", "ends at the first wake-up later than 200 us, and says why"},
       {"punctum-jitter --audit icsi --cpu 3 --plan plan",
        "what of this machine is not ready, and what mends it"}},
      {{kDone, "it was measured; the machine is ready; no difference is shown"},
       {kNotReady,
        "the audit found something missing that is required; the results differ; no GPIO line answered; the "
        "core that was looked at has stopped ticking; --compare was stopped; a file or word that was asked "
        "for, "
        "a trace among them, could not be written"},
       {kBadInput, "bad input"}}));
  jitter::Wanted wanted;
  Files files;
  std::string station, gpio, audited, plan_folder;
  std::vector<std::string> tick;
  bool loaded = false, beside = false;
  // Where siblings are switched off, numbers are left out.
  const std::vector<int> online = rt::read_kernel_facts().online_cpus;
  const int last_cpu = online.empty() ? CPU_SETSIZE - 1 : online.back();
  const CLI::Option* rate =
      app.add_option("--rate", wanted.rate_Hz, "ticks per second (default: 1000, or the scene's)")
          ->type_name("HZ")
          ->check(tools::within(1.0, 20'000.0));
  const CLI::Option* seconds = app.add_option("--seconds", wanted.seconds, "how long (default: 10)")
                                   ->type_name("S")
                                   ->check(tools::within(0.1, 604'800.0));
  const CLI::Option* cpu =
      app.add_option("--cpu", wanted.cpu, "the CPU that the loop is bound to (default: none, or the scene's)")
          ->type_name("N")
          ->check(tools::within(0, last_cpu));
  const CLI::Option* priority = app.add_option("--priority", wanted.priority,
                                               "of SCHED_FIFO (default: 80, as the core, or the scene's)")
                                    ->type_name("P")
                                    ->check(tools::within(1, 98));
  app.add_option("--tick", tick,
                 "empty, or servo and a scene: everything that the core does in a tick, on simulated devices "
                 "(default: empty; of servo: icsi)")
      ->type_name("empty|servo [SCENE]")
      ->expected(1, 2);
  app.add_option("--explain", wanted.explain_us,
                 "name the cause of every tick that ends later than this, by the kernel's trace")
      ->type_name("US")
      ->check(tools::within(1.0, 1e6));
  app.add_option("--break", wanted.break_us, "end at the first wake-up later than this, and name its cause")
      ->type_name("US")
      ->check(tools::within(1.0, 1e6));
  app.add_option("--trace", files.trace,
                 "with --explain or --break: the kernel's trace of the last late tick")
      ->type_name("FILE");
  app.add_option("--histogram", files.histogram, "wake-ups as cyclictest writes them")->type_name("FILE");
  app.add_option("--json", files.json, "everything that was found")->type_name("FILE");
  app.add_option("--picture", files.picture, "the distributions as a picture, .svg or .png; needs gnuplot")
      ->type_name("FILE");
  const CLI::Option* edges = app.add_option("--gpio", gpio,
                                            "CHIP:IN,OUT,ASK,SEEN: from edge to edge; each tick writes to "
                                            "line OUT what it reads from IN, while line ASK, wired "
                                            "to IN, changes, and SEEN, wired to OUT, is watched")
                                 ->type_name("LINES");
  app.add_option("--attach", station, "look at the core of this running station instead of measuring")
      ->type_name("STATION");
  const CLI::Option* audit_option =
      app.add_option(
             "--audit", audited,
             "measure nothing; say what of this machine is not ready, with a scene also for its devices")
          ->type_name("[SCENE]")
          ->expected(0, 1);
  app.add_option(
         "--plan", plan_folder,
         "with --audit: write the boot line and the files that mend it here; the machine stays as it is")
      ->type_name("DIR");
  app.add_flag("--load", loaded, "keep processors, caches, disk, scheduler and timers busy meanwhile");
  app.add_flag("--compare", beside, "take turns with cyclictest, half of the time each");
  CLI::App* difference = app.add_subcommand("diff", "whether two results differ, and where");
  std::vector<std::string> results;
  difference->add_option("FILES", results, "two results of --json")->required()->expected(2);
  if (const auto code = tools::parse_command_line(app, argc, argv)) {
    return *code;
  }
  if (difference->parsed()) {
    return diff(results);
  }
  // What is not said on the command line.
  const auto use_scene = [&](const tools::Scene& scene) {
    wanted.cpu = cpu->count() > 0 ? wanted.cpu : scene.core_cpu;
    wanted.priority = priority->count() > 0 ? wanted.priority : scene.core_priority;
  };
  if (audit_option->count() == 0 && !plan_folder.empty()) {
    return bad("--plan: allowed with --audit");
  }
  if (audit_option->count() > 0 &&
      (loaded || beside || !station.empty() || !gpio.empty() || !tick.empty() || wanted.explain_us > 0 ||
       wanted.break_us > 0 || rate->count() + seconds->count() > 0 || !files.are_none())) {
    return bad("--audit: measures nothing, allowed with --cpu, --priority and --plan");
  }
  if (audit_option->count() > 0) {
    std::optional<tools::Scene> scene;
    if (!audited.empty()) {
      auto loaded_scene = tools::load_scene(audited);
      if (!loaded_scene) {
        return bad(loaded_scene.error());
      }
      scene = std::move(*loaded_scene);
      use_scene(*scene);
    }
    return audit(wanted.cpu, wanted.priority, scene ? &*scene : nullptr, plan_folder);
  }
  if (!files.picture.empty() && !files.picture.ends_with(".svg") && !files.picture.ends_with(".png")) {
    return bad("--picture: " + files.picture + ": allowed: a file .svg or .png");
  }
  if (const std::string lacks = files.without_folder(); !lacks.empty()) {
    return bad(lacks);
  }
  if (!station.empty() && (beside || wanted.break_us > 0)) {
    return bad("--attach: only looks on, allowed without --compare and --break");
  }
  if (!station.empty() && rate->count() + cpu->count() + priority->count() > 0) {
    return bad("--attach: a running core has its own, allowed without --rate, --cpu and --priority");
  }
  if (beside && !(files.histogram.empty() && files.json.empty() && files.picture.empty())) {
    return bad("--compare: writes no files, allowed without --histogram, --json and --picture");
  }
  if (beside && (wanted.explain_us > 0 || wanted.break_us > 0)) {
    return bad("--compare: tells no causes, allowed without --explain and --break");
  }
  if (!files.trace.empty() && !(wanted.explain_us > 0 || wanted.break_us > 0)) {
    return bad("--trace: allowed with --explain or --break");
  }
  if (edges->count() > 0 && (gpio.empty() || beside || !station.empty() || !tick.empty())) {
    return bad(
        "--gpio: is a tick of its own, allowed: CHIP:IN,OUT,ASK,SEEN, without --compare, --attach and "
        "--tick");
  }
  std::unique_ptr<jitter::ServoTick> servo;
  if (!tick.empty() && !(tick.front() == "servo" || (tick.front() == "empty" && tick.size() == 1))) {
    return bad(
        fmt::format("--tick: {}: unknown, allowed: empty, or servo and a scene", fmt::join(tick, " ")));
  }
  if (!tick.empty() && tick.front() == "servo") {
    if (!station.empty()) {
      return bad("--attach: a running core has its own tick, allowed without --tick servo");
    }
    auto made = jitter::ServoTick::of(tick.size() > 1 ? tick[1] : "icsi",
                                      rate->count() > 0 ? std::optional(wanted.rate_Hz) : std::nullopt);
    if (!made) {
      return bad(made.error());
    }
    servo = std::move(*made);
    use_scene(servo->scene());
    wanted.rate_Hz = servo->scene().servo.rate_Hz;
    tick.insert(tick.begin(), "--tick");
  }
  tl::expected<jitter::Load, std::string> load = tl::unexpected(std::string());
  if (loaded) {
    load = jitter::Load::start();
    if (!load) {
      return bad(load.error());
    }
  }
  return beside ? compare(wanted, servo ? tick : std::vector<std::string>{})
                : measure(wanted, loaded ? jitter::Load::stated() : "", files, station, gpio, servo.get());
}

}  // namespace

int main(int argc, char** argv) {
  punctum::tools::start_program();
  try {
    return punctum::tools::code_after_words(main_or_throw(argc, argv));
  } catch (const std::exception& e) {
    complain(std::string("punctum-jitter: ") + e.what());
    return kBadInput;
  }
}
