// One program that the parent starts and watches. Never throws; its words go to a log file.
#pragma once

#include <sys/types.h>

#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::tools {

struct Ended {
  bool exited = false;  // by itself, with `code`
  int code = 0;
  int signal = 0;  // otherwise: killed by it
  [[nodiscard]] std::string text() const;
};

class Child {
 public:
  Child() = default;
  Child(Child&& other) noexcept { swap(other); }
  Child& operator=(Child&& other) noexcept {
    Child(std::move(other)).swap(*this);
    return *this;
  }
  ~Child();  // a child still alive is killed

  // `program` is looked for beside the running program first, then in PATH. Output is appended to `log`. The
  // child gets a process group of its own: a Ctrl-C in the terminal reaches the parent only. It inherits
  // `descriptors` under their numbers, and no others.
  static tl::expected<Child, std::string> start(const std::string& program,
                                                const std::vector<std::string>& args, const std::string& log,
                                                const std::vector<int>& descriptors = {});

  [[nodiscard]] bool running() const noexcept { return pid_ > 0; }
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  [[nodiscard]] const std::string& log() const noexcept { return log_; }
  bool ended(Ended& how);  // does not wait; true once
  void send(int signal) const noexcept;

 private:
  void swap(Child& other) noexcept {
    std::swap(pid_, other.pid_);
    std::swap(log_, other.log_);
  }
  pid_t pid_ = -1;
  std::string log_;
};

// Where `program` is, empty if nowhere.
[[nodiscard]] std::string find_program(const std::string& program);

// The last line of a log that says something, or that it is empty.
[[nodiscard]] std::string last_line(const std::string& path);

}  // namespace punctum::tools
