#include "tools/shared/say.hpp"

#include <cerrno>
#include <cstring>

#include "tools/shared/exit_codes.hpp"

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

int code_after_words(int code) noexcept {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) {
    return code;
  }
  const int why = errno;
  write_text(stderr, "the standard output cannot be written");
  if (why != 0) {
    write_text(stderr, ": ");
    write_text(stderr, std::strerror(why));
  }
  complain("");
  return code == exit_done ? exit_not_done : code;
}

}  // namespace punctum::tools
