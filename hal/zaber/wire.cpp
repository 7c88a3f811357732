#include "hal/zaber/wire.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

namespace punctum::zaber {
namespace {

using hal::Status;
using Steady = std::chrono::steady_clock;

constexpr std::size_t kLongestLine = 512;
constexpr int kSent_ms = 1000;  // a line of 30 letters takes 3

std::string refusal(const std::string& port, int error) {
  if (error == EACCES) {
    return port + ": this user may not use it: sudo usermod -aG dialout $USER, and log in again";
  }
  if (error == EBUSY) {
    return port + ": another program has it open, allowed: end that first";
  }
  return port + ": " + std::generic_category().message(error) + ", allowed for zaber.port: a serial line";
}

int milliseconds_until(Steady::time_point end) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Steady::now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left + 1, 0, 60'000));
}

}  // namespace

tl::expected<void, std::string> SerialLine::open() {
  const auto refuse = [this] {
    const std::string why = refusal(port_, errno);
    close();
    return tl::unexpected(why);
  };
  file_ = ::open(port_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios line{};
  if (file_ < 0 || tcgetattr(file_, &line) != 0) {
    return refuse();
  }
  cfmakeraw(&line);
  line.c_cflag = CS8 | CREAD | CLOCAL;
  line.c_iflag = line.c_oflag = line.c_lflag = 0;
  if (cfsetspeed(&line, B115200) != 0 || tcsetattr(file_, TCSANOW, &line) != 0 ||
      ioctl(file_, TIOCEXCL) != 0 || tcflush(file_, TCIOFLUSH) != 0) {
    return refuse();
  }
  come_.clear();
  return {};
}

void SerialLine::close() noexcept {
  if (file_ >= 0) {
    ioctl(file_, TIOCNXCL);
    ::close(file_);
  }
  file_ = -1;
}

Status SerialLine::send(std::string_view text) {
  const auto end = Steady::now() + std::chrono::milliseconds(kSent_ms);
  while (!text.empty()) {
    const ssize_t sent = ::write(file_, text.data(), text.size());
    if (sent > 0) {
      text.remove_prefix(static_cast<std::size_t>(sent));
      continue;
    }
    if (errno != EAGAIN && errno != EINTR) {
      return Status::disconnected;
    }
    pollfd ready{file_, POLLOUT, 0};
    const int left_ms = milliseconds_until(end);
    if (left_ms == 0 || (poll(&ready, 1, left_ms) > 0 && (ready.revents & (POLLERR | POLLHUP)) != 0)) {
      return Status::disconnected;
    }
  }
  return Status::ok;
}

bool SerialLine::take_line(std::string& line) {
  const std::size_t end = come_.find('\n');
  if (end == std::string::npos) {
    if (come_.size() > kLongestLine) {
      come_.clear();  // no device says so much
    }
    return false;
  }
  line = come_.substr(0, end);
  come_.erase(0, end + 1);
  while (line.ends_with('\r')) {
    line.pop_back();
  }
  return true;
}

Status SerialLine::receive(std::string& line, std::int64_t timeout_ns) {
  const auto end = Steady::now() + std::chrono::nanoseconds(timeout_ns);
  while (!take_line(line)) {
    pollfd ready{file_, POLLIN, 0};
    const int left_ms = milliseconds_until(end);
    if (Steady::now() >= end) {
      return Status::no_data;
    }
    if (const int count = poll(&ready, 1, left_ms); count <= 0) {
      continue;
    }
    char text[256];
    const ssize_t size = ::read(file_, text, sizeof(text));
    if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) {
      return Status::disconnected;
    }
    if (size > 0) {
      come_.append(text, static_cast<std::size_t>(size));
    }
  }
  return Status::ok;
}

}  // namespace punctum::zaber
