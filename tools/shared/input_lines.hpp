// Whole lines from a descriptor, as they come.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <string>
#include <vector>

namespace punctum::tools {

class InputLines {
 public:
  explicit InputLines(int descriptor) : descriptor_(descriptor) {}

  // Once there is something to read. False: there will be no more.
  [[nodiscard]] bool read_into(std::vector<std::string>& lines) {
    char text[512];
    const ssize_t size = ::read(descriptor_, text, sizeof(text));
    if (size <= 0) {
      return size < 0 && errno == EINTR;
    }
    rest_.append(text, static_cast<std::size_t>(size));
    for (std::size_t end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
      lines.push_back(rest_.substr(0, end));
      rest_.erase(0, end + 1);
    }
    return true;
  }

 private:
  int descriptor_;
  std::string rest_;
};

}  // namespace punctum::tools
