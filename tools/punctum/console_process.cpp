#include "tools/punctum/console_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <thread>
#include <utility>

#include "hal/ipc/segment.hpp"

namespace punctum::tools {

tl::expected<void, std::string> ConsoleProcess::start() {
  // It tells the address with a token that lets its reader operate: nobody else's.
  const hal::Descriptor log(open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  auto child = Child::start(kConsoleProgram, {"--station", station_}, log_);
  if (!child) {
    return tl::unexpected(child.error());
  }
  child_ = std::move(*child);
  return {};
}

void ConsoleProcess::watch() {
  if (!child_.running()) {
    return;
  }
  if (!address_told_) {
    if (const std::string line = last_line(log_); line.find("console of ") == 0) {
      terminal_.say("{}", line);
      address_told_ = true;
    }
  }
  if (Ended how; child_.ended(how)) {
    terminal_.complain(
        fmt::format("the console {}{}; the run goes on, and `punctum-console --station {}` brings it back",
                    how.text(), how.exited ? ": " + last_line(log_) : "", station_));
  }
}

void ConsoleProcess::end() {
  constexpr int kRounds = 100;  // of 10 ms
  child_.send(SIGTERM);
  Ended how;
  for (int i = 0; i < kRounds && child_.running() && !child_.ended(how); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  child_ = Child();
}

}  // namespace punctum::tools
