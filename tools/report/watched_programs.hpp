// Programs that are run, and inspected while they run, as /proc shows them.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "tools/report/topic.hpp"

namespace punctum::report {

// A new folder, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "punctum-scenes-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error(name + ": cannot be made");
    }
    folder_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ec;
    std::filesystem::remove_all(folder_, ec);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

 private:
  std::filesystem::path folder_;
};

struct Program {
  std::string name;
  std::vector<std::string> args;
  std::filesystem::path log;
  std::vector<int> good_codes{0};
};

// Runs all of them, at most `at_once` at a time. inspect(i, pid) is called every 20 ms while program i runs.
// Throws when one cannot be started, does not end in time or ends with another code than its good ones.
void run_all(const std::vector<Program>& programs, std::size_t at_once,
             const std::function<void(std::size_t, pid_t)>& inspect = {}, Progress* progress = nullptr);

[[nodiscard]] std::string read_text(const std::filesystem::path& file);

// The most that a process had of everything, over all inspections.
struct Process {
  std::string name{};
  std::size_t threads = 0;
  std::set<std::string> libraries{};
  double locked_kB = 0, resident_kB = 0;
};

using Processes = std::map<pid_t, Process>;

// Adds a process and its children.
void inspect_with_children(pid_t parent, Processes& processes);

}  // namespace punctum::report
