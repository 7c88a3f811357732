// What is tracked speaks of the thing only: no path of one machine, nothing left open, no large file.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

// The files git tracks; empty where this tree is not a clone.
std::vector<std::string> tracked_files() {
  const auto close = [](std::FILE* f) { pclose(f); };
  const std::unique_ptr<std::FILE, decltype(close)> pipe(
      popen("git -c safe.directory='*' -C '" PUNCTUM_SOURCE_DIR "' ls-files 2>/dev/null", "r"), close);
  std::vector<std::string> files;
  std::array<char, 4096> line{};
  while (pipe != nullptr && std::fgets(line.data(), line.size(), pipe.get()) != nullptr) {
    std::string file = line.data();
    file.resize(file.find_last_not_of('\n') + 1);
    if (fs::is_regular_file(fs::path(PUNCTUM_SOURCE_DIR) / file)) {  // not one just deleted
      files.push_back(file);
    }
  }
  return files;
}

struct Rule {
  const char* name;
  std::regex pattern;
};

const std::vector<Rule>& rules() {
  // Classes of one letter keep these lines from matching themselves.
  static const std::vector<Rule> table = {
      {"a path of one machine", std::regex("/([w]ork|[r]oot|[f]arm)/|/[h]ome/(?!newcomer)|[C]:\\\\\\\\")},
      {"left open", std::regex("\\b([T]ODO|[F]IXME|[X]XX|[H]ACK)\\b")},
      {"speaks of how it was written",
       std::regex("\\b(([t]his|[l]ast|[n]ext|[p]revious) session|[i]ssue #?[0-9]+|[h]elper agent|[C]laude|"
                  "[L]LM|[C]hatGPT|[C]opilot)\\b",
                  std::regex::icase)},
      {"a merge left open", std::regex("^(<{7}|>{7}) ")},
  };
  return table;
}

std::string breaches(const std::string& file, std::istream& in) {
  std::string found;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    for (const Rule& rule : rules()) {
      if (std::regex_search(line, rule.pattern)) {
        found += "\n  " + file + ":" + std::to_string(number) + ": " + rule.name + ": " + line.substr(0, 120);
      }
    }
  }
  return found;
}

TEST(Hygiene, tracked_files_speak_of_the_thing_only) {
  const std::vector<std::string> files = tracked_files();
  if (files.empty()) {
    GTEST_SKIP() << "not a git clone";
  }
  std::string found;
  for (const std::string& file : files) {
    if (file != "LICENSE" && !file.starts_with("tests/fuzz/")) {
      std::ifstream in(fs::path(PUNCTUM_SOURCE_DIR) / file);
      found += breaches(file, in);
    }
  }
  EXPECT_EQ(found, "");
}

TEST(Hygiene, no_tracked_file_is_larger_than_a_mebibyte) {
  for (const std::string& file : tracked_files()) {
    EXPECT_LE(fs::file_size(fs::path(PUNCTUM_SOURCE_DIR) / file), 1U << 20U) << file;
  }
}

TEST(Hygiene, top_level_is_the_one_of_the_design) {
  const std::regex expected(
      "CMakeLists\\.txt|CMakePresets\\.json|README\\.md|LICENSE|rt|vision|hal|tools|tests|toolchain|\\..*");
  for (const std::string& file : tracked_files()) {
    const std::string top = file.substr(0, file.find('/'));
    EXPECT_TRUE(std::regex_match(top, expected)) << top;
  }
}

// What a command prints, with its errors.
std::string said(const std::string& command) {
  const auto close = [](std::FILE* f) { pclose(f); };
  const std::unique_ptr<std::FILE, decltype(close)> pipe(popen((command + " 2>&1").c_str(), "r"), close);
  std::string text;
  std::array<char, 4096> part{};
  while (pipe != nullptr && std::fgets(part.data(), part.size(), pipe.get()) != nullptr) {
    text += part.data();
  }
  return text;
}

TEST(Scripts, find_their_folder_whatever_path_the_shell_searches_and_through_a_link) {
  const std::string source = PUNCTUM_SOURCE_DIR;
  EXPECT_EQ(said("cd '" + source +
                 "' && CDPATH=. bash -c 'export CDPATH; . toolchain/steps.sh; printf %s \"$root\"'"),
            fs::canonical(source).string());
  const fs::path link = fs::temp_directory_path() / ("punctum-link-" + std::to_string(getpid()));
  fs::create_symlink(source + "/tools/test", link);
  EXPECT_EQ(said(link.string() + " --none").substr(0, 17), "usage: tools/test");
  fs::remove(link);
}

TEST(Scripts, complete_a_recording_and_the_words_that_are_programs_of_their_own) {
  const fs::path folder = fs::temp_directory_path() / ("punctum-manual-" + std::to_string(getpid()));
  fs::create_directory(folder);
  const std::string program = folder / "tool";
  std::ofstream(program)
      << "#!/bin/sh\ncase $1 in go) echo 'Usage: tool go RECORDING'; exit;; esac\n"
         "printf 'Usage: tool COMMAND\\n\\nSubcommands:\\n  go  x\\n\\nExamples:\\n  tool other "
         "a.x\\n      does it; the program tool-other\\n'\n";
  fs::permissions(program, fs::perms::owner_all);
  const std::string text = said(PUNCTUM_SOURCE_DIR "/toolchain/manual/manual completion " + program);
  EXPECT_NE(text.find("    other) files='f' ;;\n"), std::string::npos) << text;
  EXPECT_NE(text.find("words='go other'"), std::string::npos) << text;
  std::ofstream(program)
      << "#!/bin/sh\nprintf 'Usage: tool RECORDING\\n\\nArguments:\\n  RECORDING  a file\\n'\n";
  const std::string alone = said(PUNCTUM_SOURCE_DIR "/toolchain/manual/manual completion " + program);
  EXPECT_NE(alone.find("options='' words='' files='f'"), std::string::npos) << alone;
  fs::remove_all(folder);
}

TEST(Hygiene, each_rule_finds_what_it_is_for) {
  const std::string planted[] = {"see /wo" + std::string("rk/x"), "// TO" + std::string("DO: later"),
                                 "as in the last ses" + std::string("sion"), std::string(7, '<') + " HEAD"};
  for (const std::string& line : planted) {
    std::istringstream in(line);
    EXPECT_NE(breaches("planted", in), "") << line;
  }
  std::istringstream clean("the phase of a session of work; hacking; a path rt/control/servo.cpp");
  EXPECT_EQ(breaches("clean", clean), "");
}

}  // namespace
