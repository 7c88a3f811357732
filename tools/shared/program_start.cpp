#include "tools/shared/program_start.hpp"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>

namespace punctum::tools {

void start_program() noexcept {
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd) {
    // The lowest free number is given, and all below this one are taken.
    if (fcntl(fd, F_GETFD) < 0 && errno == EBADF && open("/dev/null", O_RDWR) != fd) {
      abort();  // there is nowhere to say it
    }
  }
  (void)signal(SIGXFSZ, SIG_IGN);
}

}  // namespace punctum::tools
