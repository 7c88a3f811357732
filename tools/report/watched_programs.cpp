#include "tools/report/watched_programs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tools/shared/child.hpp"

namespace punctum::report {

namespace {

namespace fs = std::filesystem;
using tools::Child;
using tools::Ended;

constexpr double kTimeLimit_s = 300;  // for one program
constexpr auto kPollInterval = std::chrono::milliseconds(20);

pid_t parent_of(pid_t pid) {
  const std::string stat = read_text(fmt::format("/proc/{}/stat", pid));
  const auto close = stat.rfind(')');  // the name before it may contain anything
  return close == std::string::npos || close + 4 >= stat.size()
             ? 0
             : static_cast<pid_t>(std::strtol(stat.c_str() + close + 4, nullptr, 10));
}

void inspect(pid_t pid, Processes& processes) {
  const fs::path proc = fmt::format("/proc/{}", pid);
  std::string name = read_text(proc / "comm");
  if (name.empty()) {
    return;
  }
  name.pop_back();
  Process& p = processes[pid];
  if (p.name != name) {
    p = {.name = name};  // it has become another program
  }
  std::error_code ec;
  std::size_t threads = 0;
  for (auto it = fs::directory_iterator(proc / "task", ec); !ec && it != fs::directory_iterator();
       it.increment(ec)) {
    ++threads;
  }
  p.threads = std::max(p.threads, threads);
  std::istringstream maps(read_text(proc / "maps"));
  for (std::string line; std::getline(maps, line);) {
    if (const auto path = line.find('/');
        path != std::string::npos && line.find(".so", path) != std::string::npos) {
      p.libraries.insert(line.substr(path));
    }
  }
  std::istringstream status(read_text(proc / "status"));
  const auto kB = [](const std::string& line) {
    return std::strtod(line.c_str() + line.find(':') + 1, nullptr);
  };
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmLck:")) {
      p.locked_kB = std::max(p.locked_kB, kB(line));
    }
    if (line.starts_with("VmHWM:")) {
      p.resident_kB = std::max(p.resident_kB, kB(line));
    }
  }
}

}  // namespace

std::string read_text(const fs::path& file) {
  // Of a process in /proc that ends meanwhile: what was read so far. A stream turns the failed read into a
  // bad state, where an iterator over its buffer would throw.
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void run_all(const std::vector<Program>& programs, std::size_t at_once,
             const std::function<void(std::size_t, pid_t)>& inspect, Progress* progress) {
  struct Running {
    std::size_t index;
    Child child;
    std::chrono::steady_clock::time_point until;
  };
  std::vector<Running> running;
  std::size_t next = 0;
  while (next < programs.size() || !running.empty()) {
    while (next < programs.size() && running.size() < at_once) {
      auto child = Child::start(programs[next].name, programs[next].args, programs[next].log.string());
      if (!child) {
        throw std::runtime_error(child.error());
      }
      running.push_back(
          {next++, std::move(*child),
           std::chrono::steady_clock::now() + std::chrono::seconds(static_cast<std::int64_t>(kTimeLimit_s))});
    }
    for (auto r = running.begin(); r != running.end();) {
      const Program& p = programs[r->index];
      if (inspect) {
        inspect(r->index, r->child.pid());
      }
      Ended end;
      if (!r->child.ended(end)) {
        if (std::chrono::steady_clock::now() > r->until) {
          throw std::runtime_error(fmt::format("{}: not ended after {} s", p.name, kTimeLimit_s));
        }
        ++r;
        continue;
      }
      const auto& good = p.good_codes;
      if (!end.exited || std::find(good.begin(), good.end(), end.code) == good.end()) {
        throw std::runtime_error(fmt::format("{} {}: {}, {}", p.name, p.args.size() > 1 ? p.args[1] : "",
                                             end.text(), tools::last_line(p.log.string())));
      }
      if (progress != nullptr) {
        progress->step();
      }
      r = running.erase(r);
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

void inspect_with_children(pid_t parent, Processes& processes) {
  inspect(parent, processes);
  std::error_code ec;
  for (auto it = fs::directory_iterator("/proc", ec); !ec && it != fs::directory_iterator();
       it.increment(ec)) {
    if (const auto pid = static_cast<pid_t>(std::strtol(it->path().filename().c_str(), nullptr, 10));
        pid > 0 && parent_of(pid) == parent) {
      inspect(pid, processes);
    }
  }
}

}  // namespace punctum::report
