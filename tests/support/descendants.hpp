// Programs that a test starts, and whatever they leave behind: a test that becomes the reaper of its
// descendants inherits every process that outlives its parent.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace punctum::e2e {

inline void reap_descendants() { prctl(PR_SET_CHILD_SUBREAPER, 1); }

inline std::vector<pid_t> children_of(pid_t pid) {
  const std::string path = "/proc/" + std::to_string(pid);
  std::ifstream in(path + "/task/" + std::to_string(pid) + "/children");
  std::vector<pid_t> list;
  for (pid_t child = 0; in >> child;) {
    list.push_back(child);
  }
  return list;
}

// The child of `parent` that runs this program; 0: none.
inline pid_t child_named(pid_t parent, const std::string& program) {
  for (const pid_t child : children_of(parent)) {
    std::ifstream in("/proc/" + std::to_string(child) + "/comm");
    std::string name;
    if (std::getline(in, name) && name == program.substr(0, 15)) {
      return child;
    }
  }
  return 0;
}

// Every process that this one is the parent of has ended. What has not within the time is killed: false.
inline bool nobody_is_left(std::chrono::seconds within = std::chrono::seconds(30)) {
  const auto until = std::chrono::steady_clock::now() + within;
  bool in_time = true;
  for (;;) {
    const pid_t one = waitpid(-1, nullptr, WNOHANG);
    if (one < 0) {
      return in_time;
    }
    if (one > 0) {
      continue;
    }
    if (std::chrono::steady_clock::now() > until) {
      in_time = false;
      for (const pid_t child : children_of(getpid())) {
        kill(child, SIGKILL);
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

// A program as it is started from a shell; `before` runs in the child, after its output goes to the file.
class Program {
 public:
  static constexpr int kHangs = -1000;

  Program(const std::string& path, const std::vector<std::string>& args, std::filesystem::path output,
          const std::function<void()>& before = {})
      : output_(std::move(output)) {
    std::vector<char*> argv{const_cast<char*>(path.c_str())};
    for (const auto& a : args) {
      argv.push_back(const_cast<char*>(a.c_str()));
    }
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      const int out = open(output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      const int null = open("/dev/null", O_RDONLY);
      dup2(null, 0);
      dup2(out, 1);
      dup2(out, 2);
      close(out);
      close(null);
      if (before) {
        before();
      }
      execv(path.c_str(), argv.data());
      _exit(127);
    }
  }
  ~Program() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  void send(int signal) const { kill(pid_, signal); }
  // The exit code, or -signal, or kHangs: it did not end, and was killed.
  int wait(std::chrono::seconds at_most = std::chrono::seconds(120)) {
    const auto until = std::chrono::steady_clock::now() + at_most;
    int status = 0;
    while (waitpid(pid_, &status, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() > until) {
        kill(pid_, SIGKILL);
        waitpid(pid_, &status, 0);
        pid_ = -1;
        return kHangs;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  std::filesystem::path output_;
  pid_t pid_ = -1;
};

}  // namespace punctum::e2e
