// punctum-report: error against run time of everything that trades one for the other, and the limits of
// stability.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "tools/report/output.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/suggestion.hpp"
#include "tools/shared/version.hpp"
#include "tools/shared/whole_file.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum::report;
using punctum::tools::complain;
using punctum::tools::say;
using punctum::tools::write_whole;

constexpr int kTopicFailed = 1, kBadInput = 2;
#ifdef PUNCTUM_VISION
constexpr const char* kLeftOut = "";
#else
constexpr const char* kLeftOut = "vision and surface are left out: built without OpenCV\n";
#endif

int bad(const std::string& text) {
  complain(text);
  return kBadInput;
}

// The topic that was probably meant.
std::string meant(const std::string& wanted) {
  std::vector<std::string> names{"all"};
  for (const Topic& t : topics()) {
    names.emplace_back(t.name);
  }
  return punctum::tools::suggestion(wanted, names);
}

void write(const fs::path& path, const std::string& text) {
  if (const auto written = write_whole(path, text); !written) {
    throw std::runtime_error(written.error());
  }
}

// Makes the folder. Returns what is wrong with it; empty if nothing is.
std::string prepare(const fs::path& out) {
  std::error_code ec;
  fs::create_directories(out, ec);
  if (ec) {
    return fmt::format("--out: {}: {}", out.string(), ec.message());
  }
  if (!fs::is_directory(out, ec)) {
    return fmt::format("--out: {}: is not a folder", out.string());
  }
  if (access(out.c_str(), W_OK | X_OK) != 0) {
    return fmt::format("--out: {}: cannot be written to", out.string());
  }
  return {};
}

Finished finish(const Topic& topic, bool quick, const fs::path& out, const fs::path& frames,
                const Provenance& from) {
  Finished done{.topic = std::string(topic.name), .about = std::string(topic.about)};
  const auto begun = std::chrono::steady_clock::now();
  try {
    {
      Progress progress(done.topic);
      done.result = topic.run({.quick = quick, .out = out, .frames = frames, .progress = progress});
    }
    for (const Table& t : done.result.tables) {
      write(out / (t.name + ".csv"), csv(t, from));
    }
    for (const Figure& f : done.result.figures) {
      if (const auto drawn = punctum::tools::draw(f, out / (f.name + ".svg")); !drawn) {
        complain(fmt::format("{}.svg: {}", f.name, drawn.error()));
      }
    }
  } catch (const std::exception& e) {
    done.error = e.what();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  say(fmt::format("{:<12}{} ({:.1f} s)\n", done.topic,
                  done.error.empty() ? done.result.reading : "failed: " + done.error, seconds));
  return done;
}

int main_or_throw(int argc, char** argv) {
  std::string names = "all", about = "Error against run time.\nTopics:\n";
  for (const Topic& t : topics()) {
    names += ", " + std::string(t.name);
    about += fmt::format("  {:<12}{}\n", t.name, t.about);
  }
  about += kLeftOut;
  const auto evaluates =
      std::find_if(topics().begin(), topics().end(), [](const Topic& t) { return t.evaluate != nullptr; });
  CLI::App app{about, "punctum-report"};
  punctum::tools::set_help_style(app);
  app.set_version_flag("--version", punctum::tools::version_line("punctum-report"), "version and commit");
  app.footer(punctum::tools::help_footer(
      {{"punctum-report all --quick", "every topic within a minute, into reports/report-DATE"},
       {"punctum-report force --out mine", "one topic, into the folder `mine`"},
       {"punctum-report force --input pairs.csv --output out.csv",
        "the paper's membrane law on rows of your own"}},
      {{0, "all topics were measured"},
       {kTopicFailed, "a topic failed, the others are there"},
       {kBadInput, "bad input"}}));
  std::vector<std::string> wanted;
  std::string folder, frames, input, output;
  bool quick = false;
  app.add_option("TOPIC", wanted, "one or more of: " + names)->required();
  const auto* to_folder =
      app.add_option("--out", folder,
                     "folder of tables, figures and index.html (default: reports/report-DATE)")
          ->type_name("FOLDER");
  app.add_flag("--quick", quick, "fewer points and cells, all together within a minute");
  const auto* drawn = app.add_option("--frames", frames,
                                     "vision only: pictures that another renderer drew, in "
                                     "FOLDER/noise-N[,KEY=VALUE]/SEED/")
                          ->type_name("FOLDER");
  CLI::Option* in = nullptr;
  if (evaluates != topics().end()) {
    in = app.add_option("--input", input,
                        std::string(evaluates->name) + " only: a CSV file of rows to evaluate")
             ->type_name("FILE");
    auto* to =
        app.add_option("--output", output, "where they go with their result appended; nothing else is done")
            ->type_name("FILE");
    in->needs(to);
    to->needs(in);
  }
  if (const auto code = punctum::tools::parse_command_line(app, argc, argv)) {
    return *code;
  }

  const bool all = std::find(wanted.begin(), wanted.end(), "all") != wanted.end();
  for (const std::string& w : wanted) {
    if (w != "all" &&
        std::none_of(topics().begin(), topics().end(), [&w](const Topic& t) { return t.name == w; })) {
      return bad(
          fmt::format("{}TOPIC: {}: there is no such topic{}, allowed: {}", kLeftOut, w, meant(w), names));
    }
  }
  if (in != nullptr && in->count() > 0) {
    if (wanted != std::vector{std::string(evaluates->name)}) {
      return bad(fmt::format("--input: allowed with the one topic {}", evaluates->name));
    }
    return evaluates->evaluate(input, output);
  }
  if (drawn->count() > 0) {
    if (!all && std::find(wanted.begin(), wanted.end(), "vision") == wanted.end()) {
      return bad("--frames: allowed with the topic vision");
    }
    if (!fs::is_directory(frames)) {
      return bad(fmt::format("--frames: {}: is not a folder", frames));
    }
  }
  if (to_folder->count() > 0 && folder.empty()) {
    return bad("--out: names no folder");
  }
  const fs::path out = fs::absolute(
      folder.empty() ? fmt::format("reports/report-{:%Y%m%d-%H%M%S}", fmt::localtime(std::time(nullptr)))
                     : folder);
  if (const auto wrong = prepare(out); !wrong.empty()) {
    return bad(wrong);
  }

  if (all) {
    say(kLeftOut);
  }
  const Provenance from = provenance();
  std::vector<Finished> finished;
  for (const Topic& t : topics()) {
    if (all || std::find(wanted.begin(), wanted.end(), t.name) != wanted.end()) {
      finished.push_back(finish(t, quick, out, frames, from));
    }
  }
  write(out / "index.html", page(finished, from, out));
  say((out / "index.html").string() + "\n");
  const bool failed =
      std::any_of(finished.begin(), finished.end(), [](const Finished& f) { return !f.error.empty(); });
  return failed ? kTopicFailed : 0;
}

}  // namespace

int main(int argc, char** argv) {
  punctum::tools::start_program();
  try {
    return punctum::tools::code_after_words(main_or_throw(argc, argv));
  } catch (const std::exception& e) {
    complain(std::string("punctum-report: ") + e.what());
    return kBadInput;
  }
}
