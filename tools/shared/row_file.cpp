#include "tools/shared/row_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace punctum::tools {
namespace {

constexpr std::size_t kEnough = 32 * 1024;  // some 70 rows of samples.csv

}  // namespace

tl::expected<RowFile, std::string> RowFile::open(const std::string& path, Begin begin) {
  RowFile rows;
  // A pipe is not waited for until somebody reads it.
  rows.file_ = ::open(
      path.c_str(),
      O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK | (begin == Begin::empty ? O_TRUNC : 0), 0666);
  if (rows.file_ < 0) {
    return tl::unexpected(fmt::format("{}: cannot be written: {}", path,
                                      errno == ENXIO ? "nobody reads it" : std::strerror(errno)));
  }
  (void)::fcntl(rows.file_, F_SETFL, O_APPEND);
  return rows;
}

RowFile::~RowFile() {
  if (file_ >= 0) {
    flush();
    (void)::close(file_);
  }
}

void RowFile::append(std::string_view rows) {
  if (file_ < 0 || !failure_.empty()) {
    return;
  }
  waiting_ += rows;
  if (waiting_.size() >= kEnough) {
    flush();
  }
}

void RowFile::flush() {
  std::size_t written = 0;
  while (written < waiting_.size() && failure_.empty()) {
    const ssize_t n = ::write(file_, waiting_.data() + written, waiting_.size() - written);
    if (n >= 0) {
      written += static_cast<std::size_t>(n);
    } else if (const int why = errno; why != EINTR && !(why == ENOSPC && more_room_ && more_room_())) {
      failure_ = std::strerror(why);
      cut_off_after(std::string_view(waiting_).substr(0, written));
    }
  }
  waiting_.clear();
  // Written, but to a file that ends with this program.
  if (struct stat now{}; failure_.empty() && file_ >= 0 && ::fstat(file_, &now) == 0 && now.st_nlink == 0) {
    failure_ = "it was removed meanwhile";
  }
}

void RowFile::cut_off_after(std::string_view written) {
  const std::size_t end = written.rfind('\n');  // npos + 1 = 0: not one whole row
  const off_t size = ::lseek(file_, 0, SEEK_END);
  if (size >= 0) {
    const auto too_much = static_cast<off_t>(written.size() - (end + 1));
    (void)!::ftruncate(file_, size - too_much);
  }
}

}  // namespace punctum::tools
