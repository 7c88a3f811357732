#include "tools/shared/child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

extern char** environ;

namespace punctum::tools {

namespace fs = std::filesystem;

std::string Ended::text() const {
  return exited ? fmt::format("ended with code {}", code)
                : fmt::format("was killed by signal {} ({})", signal, strsignal(signal));
}

std::string find_program(const std::string& program) {
  std::error_code ec;
  const fs::path beside = fs::read_symlink("/proc/self/exe", ec).parent_path() / program;
  if (!ec && access(beside.c_str(), X_OK) == 0) {
    return beside.string();
  }
  const char* path = std::getenv("PATH");
  std::string_view rest = path != nullptr ? path : "";
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    const fs::path here = fs::path(rest.substr(0, colon)) / program;
    if (access(here.c_str(), X_OK) == 0) {
      return here.string();
    }
    rest = colon == std::string_view::npos ? std::string_view{} : rest.substr(colon + 1);
  }
  return {};
}

std::string last_line(const std::string& path) {
  std::ifstream in(path);
  std::string line, last;
  while (std::getline(in, line)) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) {
      last = line;
    }
  }
  return last.empty() ? path + " is empty, as where the disk is full" : last.substr(0, 400);
}

tl::expected<Child, std::string> Child::start(const std::string& program,
                                              const std::vector<std::string>& args, const std::string& log,
                                              const std::vector<int>& descriptors) {
  const std::string path = find_program(program);
  if (path.empty()) {
    return tl::unexpected(
        fmt::format("{}: not found beside this program nor in PATH; was it built?", program));
  }
  std::vector<char*> argv;
  argv.push_back(const_cast<char*>(path.c_str()));
  for (const auto& a : args) {
    argv.push_back(const_cast<char*>(a.c_str()));
  }
  argv.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  for (const int descriptor : descriptors) {
    posix_spawn_file_actions_adddup2(&files, descriptor, descriptor);  // it is kept open over exec
  }
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  sigdelset(&all, SIGXFSZ);  // a limit of a file's size stays an error of the write (say.hpp)
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  Child child;
  const int error = posix_spawn(&child.pid_, path.c_str(), &files, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    child.pid_ = -1;
    return tl::unexpected(fmt::format("{}: cannot be started: {}", path, std::strerror(error)));
  }
  child.log_ = log;
  return child;
}

Child::~Child() {
  if (pid_ <= 0) {
    return;
  }
  kill(pid_, SIGKILL);
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
}

bool Child::ended(Ended& how) {
  if (pid_ <= 0) {
    return false;
  }
  int status = 0;
  const pid_t r = waitpid(pid_, &status, WNOHANG);
  if (r == 0 || (r < 0 && errno == EINTR)) {
    return false;
  }
  how = {};
  if (r < 0) {
    how.signal = SIGKILL;  // somebody else has waited for it
  } else if (WIFEXITED(status)) {
    how.exited = true;
    how.code = WEXITSTATUS(status);
  } else {
    how.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  }
  pid_ = -1;
  return true;
}

void Child::send(int signal) const noexcept {
  if (pid_ > 0) {
    kill(pid_, signal);
  }
}

}  // namespace punctum::tools
