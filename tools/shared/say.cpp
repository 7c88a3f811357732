#include "tools/shared/say.hpp"

#include <cerrno>
#include <cstring>

namespace punctum::tools {
namespace {

void write_text(std::FILE* to, std::string_view text) noexcept {
  (void)std::fwrite(text.data(), 1, text.size(), to);
}

}  // namespace

void say(std::string_view text) noexcept {
  write_text(stdout, text);
  (void)std::fflush(stdout);
}

void say_aside(std::string_view text) noexcept {
  write_text(stderr, text);
  (void)std::fflush(stderr);
}

void complain(std::string_view text) noexcept {
  write_text(stderr, text);
  write_text(stderr, "\n");
  (void)std::fflush(stderr);
}

bool all_was_said() noexcept {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) {
    return true;
  }
  const int why = errno;
  write_text(stderr, "the standard output cannot be written");
  if (why != 0) {
    write_text(stderr, ": ");
    write_text(stderr, std::strerror(why));
  }
  complain("");
  return false;
}

}  // namespace punctum::tools
