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
#include <fstream>
#include <string>
#include <vector>

#include "tools/report/output.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/version.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum::report;

constexpr int kTopicFailed = 1, kBadInput = 2;
#ifdef PUNCTUM_VISION
constexpr const char* kLeftOut = "";
#else
constexpr const char* kLeftOut = "vision and surface are left out: built without OpenCV\n";
#endif

int bad(const std::string& text) {
  fmt::print(stderr, "{}\n", text);
  return kBadInput;
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) {
    throw std::runtime_error(path.string() + ": cannot be written");
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

Finished finish(const Topic& topic, bool quick, const fs::path& out, const Provenance& from) {
  Finished done{.topic = std::string(topic.name), .about = std::string(topic.about)};
  const auto begun = std::chrono::steady_clock::now();
  try {
    {
      Progress progress(done.topic);
      done.result = topic.run({.quick = quick, .out = out, .progress = progress});
    }
    for (const Table& t : done.result.tables) {
      write(out / (t.name + ".csv"), csv(t, from));
    }
    for (const Figure& f : done.result.figures) {
      if (const auto drawn = punctum::tools::draw(f, out / (f.name + ".svg")); !drawn) {
        fmt::print(stderr, "{}.svg: {}\n", f.name, drawn.error());
      }
    }
  } catch (const std::exception& e) {
    done.error = e.what();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  fmt::print("{:<12}{} ({:.1f} s)\n", done.topic,
             done.error.empty() ? done.result.reading : "failed: " + done.error, seconds);
  (void)std::fflush(stdout);
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
  CLI::App app{about};
  app.failure_message([](const CLI::App*, const CLI::Error& e) { return std::string(e.what()) + "\n"; });
  app.set_version_flag("--version", punctum::tools::version_line("punctum-report"));
  std::vector<std::string> wanted;
  std::string folder, input, output;
  bool quick = false;
  app.add_option("TOPIC", wanted, "one or more of: " + names)->required();
  const auto* to_folder = app.add_option(
      "--out", folder, "folder of tables, figures and index.html (default: reports/report-DATE)");
  app.add_flag("--quick", quick, "fewer points and cells, all together within a minute");
  CLI::Option* in = nullptr;
  if (evaluates != topics().end()) {
    in = app.add_option("--input", input,
                        std::string(evaluates->name) + " only: a CSV file of rows to evaluate");
    auto* to =
        app.add_option("--output", output, "where they go with their result appended; nothing else is done");
    in->needs(to);
    to->needs(in);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kBadInput;
  }

  const bool all = std::find(wanted.begin(), wanted.end(), "all") != wanted.end();
  for (const std::string& w : wanted) {
    if (w != "all" &&
        std::none_of(topics().begin(), topics().end(), [&w](const Topic& t) { return t.name == w; })) {
      return bad(fmt::format("{}TOPIC: {}: there is no such topic, allowed: {}", kLeftOut, w, names));
    }
  }
  if (in != nullptr && in->count() > 0) {
    if (wanted != std::vector{std::string(evaluates->name)}) {
      return bad(fmt::format("--input: allowed with the one topic {}", evaluates->name));
    }
    return evaluates->evaluate(input, output);
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
    fmt::print("{}", kLeftOut);
  }
  const Provenance from = provenance();
  std::vector<Finished> finished;
  for (const Topic& t : topics()) {
    if (all || std::find(wanted.begin(), wanted.end(), t.name) != wanted.end()) {
      finished.push_back(finish(t, quick, out, from));
    }
  }
  write(out / "index.html", page(finished, from, out));
  fmt::print("{}\n", (out / "index.html").string());
  const bool failed =
      std::any_of(finished.begin(), finished.end(), [](const Finished& f) { return !f.error.empty(); });
  return failed ? kTopicFailed : 0;
}

}  // namespace

int main(int argc, char** argv) {
  punctum::tools::start_program();
  try {
    return main_or_throw(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "punctum-report: {}\n", e.what());
    return kBadInput;
  }
}
