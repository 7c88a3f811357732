#include "tools/shared/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

tl::unexpected<std::string> not_written(const fs::path& path, int error) {
  return tl::unexpected(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(error)));
}

// The first error, 0 if there is none. The descriptor is closed.
int write_all(int file, std::string_view content) {
  int error = 0;
  while (!content.empty() && error == 0) {
    const ssize_t n = write(file, content.data(), content.size());
    if (n >= 0) {
      content.remove_prefix(static_cast<std::size_t>(n));
    } else if (errno != EINTR) {
      error = errno;
    }
  }
  if (close(file) != 0 && error == 0) {
    error = errno;
  }
  return error;
}

// NAME.part.EXT, NAME.part-2.EXT, ...
fs::path part_name(const fs::path& path, int n) {
  fs::path name = path.stem();
  name += n < 2 ? std::string(".part") : fmt::format(".part-{}", n);
  name += path.extension();
  return path.parent_path() / name;
}

struct OpenPart {
  fs::path name;
  int file = -1;
  int error = 0;
};
OpenPart open_part(const fs::path& path) {
  constexpr int kMostNames = 1000;
  OpenPart part;
  for (int n = 1; n <= kMostNames; ++n) {
    part.name = part_name(path, n);
    part.file = open(part.name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    part.error = part.file < 0 ? errno : 0;
    if (part.error != EEXIST) {
      break;
    }
  }
  return part;
}

// 0, or the error. EINVAL: what lies there keeps nothing that could be brought to a disk.
int bring_to_disk(const fs::path& path, int flags) {
  const int file = open(path.c_str(), flags | O_CLOEXEC);
  if (file < 0) {
    return errno;
  }
  const int error = fsync(file) == 0 ? 0 : errno;
  (void)close(file);
  return error == EINVAL ? 0 : error;
}

}  // namespace

fs::path unfinished(const fs::path& path) { return part_name(path, 1); }

tl::expected<fs::path, std::string> begin_unfinished(const fs::path& path) {
  const OpenPart part = open_part(path);
  if (part.file < 0) {
    return not_written(path, part.error);
  }
  (void)close(part.file);
  return part.name;
}

bool is_there(const fs::path& path) {
  std::error_code ec;
  return fs::exists(fs::symlink_status(path, ec));
}

tl::expected<void, std::string> put_in_place(const fs::path& part, const fs::path& path, Sync sync) {
  int error = sync == Sync::to_disk ? bring_to_disk(part, O_RDONLY) : 0;
  if (error == 0 && std::rename(part.c_str(), path.c_str()) != 0) {
    error = errno;
  }
  if (error != 0) {
    (void)unlink(part.c_str());
    return not_written(path, error);
  }
  if (sync == Sync::later) {
    return {};
  }
  // The new name is in its folder after a crash, too. Where that cannot be had, the file is whole still.
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  (void)bring_to_disk(folder, O_RDONLY | O_DIRECTORY);
  return {};
}

tl::expected<std::string, std::string> read_whole(const fs::path& path) {
  const auto wrong = [&path](const std::string& why) {
    return tl::unexpected(fmt::format("{}: {}", path.string(), why));
  };
  std::error_code ec;
  const fs::file_status there = fs::status(path, ec);
  if (fs::exists(there) && !fs::is_regular_file(there)) {
    return wrong("not a file");
  }
  std::ifstream in(path, std::ios::binary);
  std::string text(fs::exists(there) ? std::min(fs::file_size(path, ec), kReadMost + 1) : 0, '\0');
  if (!in || !in.read(text.data(), static_cast<std::streamsize>(text.size()))) {
    return wrong("cannot be read");
  }
  if (text.size() > kReadMost) {
    return wrong(fmt::format("too large, allowed: at most {} MB", kReadMost >> 20U));
  }
  return text;
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ec;
  const fs::file_status there = fs::status(a, ec);
  return fs::exists(there) ? fs::is_regular_file(there) && fs::equivalent(a, b, ec)
                           : fs::weakly_canonical(a, ec) == fs::weakly_canonical(b, ec);
}

tl::expected<void, std::string> write_whole(const fs::path& path, std::string_view content, Sync sync) {
  std::error_code ec;
  const fs::file_status there = fs::status(path, ec);
  if (fs::exists(there) && !fs::is_regular_file(there)) {
    const int file = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    const int error = file < 0 ? errno : write_all(file, content);
    return error == 0 ? tl::expected<void, std::string>{} : not_written(path, error);
  }
  const OpenPart part = open_part(path);
  if (part.file < 0) {
    return not_written(path, part.error);
  }
  if (const int error = write_all(part.file, content); error != 0) {
    (void)unlink(part.name.c_str());
    return not_written(path, error);
  }
  return put_in_place(part.name, path, sync);
}

}  // namespace punctum::tools
