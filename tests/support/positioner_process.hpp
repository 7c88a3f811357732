// The program punctum-positioner with the path of its pseudo-terminal.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

namespace punctum::tests {

// punctum-positioner, and what it is told on its standard input.
class PositionerProcess {
 public:
  PositionerProcess() {
    int in[2] = {-1, -1}, out[2] = {-1, -1};
    EXPECT_EQ(pipe(in), 0);
    EXPECT_EQ(pipe(out), 0);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(in[0], 0);
      dup2(out[1], 1);
      for (const int file : {in[0], in[1], out[0], out[1]}) {
        close(file);
      }
      execl(PUNCTUM_BIN_DIR "/punctum-positioner", "punctum-positioner", nullptr);
      _exit(127);
    }
    close(in[0]);
    close(out[1]);
    input_ = in[1];
    for (char c = 0; ::read(out[0], &c, 1) == 1 && c != '\n';) {
      path_ += c;
    }
    close(out[0]);
  }
  ~PositionerProcess() {
    close(input_);
    end();
  }
  PositionerProcess(const PositionerProcess&) = delete;
  PositionerProcess& operator=(const PositionerProcess&) = delete;
  void tell(const std::string& words) const {
    const std::string text = words + "\n";
    EXPECT_EQ(write(input_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void end() {
    if (pid_ > 0) {
      kill(pid_, SIGTERM);
      waitpid(pid_, nullptr, 0);
    }
    pid_ = -1;
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  pid_t pid_ = -1;
  int input_ = -1;
  std::string path_;
};

}  // namespace punctum::tests
