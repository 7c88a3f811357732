#include "hal/segment.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

namespace punctum::hal {
namespace {

constexpr std::string_view kPrefix = "punctum.";
constexpr const char* kDirectory = "/dev/shm";

std::string shm_name(std::string_view name) {
  std::string path = "/";
  path.append(kPrefix).append(name);
  return path;
}

std::string reason() { return std::strerror(errno); }

bool usable_name(std::string_view name) {
  if (name.empty() || name.size() > 100) return false;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!plain && c != '.' && c != '_' && c != '-') return false;
  }
  return true;
}

// Locks belong to the open file description: they go with the last process that holds it, however it dies.
struct flock whole_file() {
  struct flock lock = {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

bool take_lock(int fd) {
  struct flock lock = whole_file();
  return ::fcntl(fd, F_OFD_SETLK, &lock) == 0;
}

bool has_living_owner(int fd) {
  struct flock lock = whole_file();
  lock.l_type = F_RDLCK;  // would a reader be in the way of a writer's lock?
  return ::fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

bool name_means(const std::string& path, int fd) {
  struct stat by_name = {};
  struct stat by_fd = {};
  const int other = ::shm_open(path.c_str(), O_RDONLY, 0);
  if (other < 0) return false;
  const bool same = ::fstat(other, &by_name) == 0 && ::fstat(fd, &by_fd) == 0 &&
                    by_name.st_ino == by_fd.st_ino && by_name.st_dev == by_fd.st_dev;
  ::close(other);
  return same;
}

// Removes the segment if nobody owns it. True when the name is free afterwards.
bool reclaim(const std::string& path) {
  const int fd = ::shm_open(path.c_str(), O_RDWR, 0);
  if (fd < 0) return errno == ENOENT;
  // Whoever holds the lock may remove the name; it must still mean the file that was locked.
  const bool free = take_lock(fd) && (!name_means(path, fd) || ::shm_unlink(path.c_str()) == 0);
  ::close(fd);
  return free;
}

std::string owner_of(const std::string& path) {
  const int fd = ::shm_open(path.c_str(), O_RDONLY, 0);
  if (fd < 0) return "another user";
  SegmentHeader header;
  const bool read = ::pread(fd, static_cast<void*>(&header), sizeof header, 0) == sizeof header;
  ::close(fd);
  return read && header.owner_pid != 0 ? "process " + std::to_string(header.owner_pid) : "another process";
}

}  // namespace

std::uint64_t detail::own_pid() noexcept { return static_cast<std::uint64_t>(::getpid()); }

Segment::~Segment() {
  if (data_ != nullptr) ::munmap(data_, size_);
  if (lock_fd_ < 0) return;
  const std::string path = shm_name(name_);
  if (name_means(path, lock_fd_)) ::shm_unlink(path.c_str());
  ::close(lock_fd_);
}

void Segment::swap(Segment& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  std::swap(lock_fd_, other.lock_fd_);
}

tl::expected<Segment, std::string> Segment::create(std::string_view name, std::size_t size) {
  const std::string path = shm_name(name);
  const auto refuse = [&path](const std::string& what) {
    return tl::unexpected("shared segment " + path + ": " + what);
  };
  if (!usable_name(name)) return refuse("its name may hold only letters, digits, '.', '_' and '-'");
  remove_stale_segments();

  Segment made;
  // Another process may remove the new file as stale between its creation and its lock: then once more.
  for (int attempt = 0; attempt < 100 && made.lock_fd_ < 0; ++attempt) {
    const int fd = ::shm_open(path.c_str(), O_RDWR | O_CREAT | O_EXCL, S_IRUSR | S_IWUSR);
    if (fd >= 0) {
      ::fchmod(fd, S_IRUSR | S_IWUSR);  // whatever the umask
      if (take_lock(fd) && name_means(path, fd)) {
        made.lock_fd_ = fd;
      } else {
        ::close(fd);
      }
    } else if (errno != EEXIST) {
      return refuse("cannot be created: " + reason());
    } else if (!reclaim(path)) {
      return refuse("already in use by " + owner_of(path) +
                    "; end it first, or choose another --station name");
    }
  }
  if (made.lock_fd_ < 0) return refuse("cannot be created: other processes keep removing it");
  made.name_ = name;

  // Reserved now, because a full /dev/shm would otherwise kill whoever touches the missing page.
  if (const int error = ::posix_fallocate(made.lock_fd_, 0, static_cast<off_t>(size)); error != 0) {
    return refuse("needs " + std::to_string(size >> 20) + " MiB in " + kDirectory + ": " +
                  std::strerror(error));
  }
  void* data = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, made.lock_fd_, 0);
  if (data == MAP_FAILED) return refuse("cannot be mapped: " + reason());
  made.data_ = data;
  made.size_ = size;
  return made;
}

tl::expected<Segment, std::string> Segment::attach(std::string_view name, Access access, std::uint64_t magic,
                                                   std::uint64_t layout, std::size_t size) {
  const std::string path = shm_name(name);
  const auto refuse = [&path](const std::string& what) {
    return tl::unexpected("shared segment " + path + ": " + what);
  };
  if (!usable_name(name)) return refuse("its name may hold only letters, digits, '.', '_' and '-'");
  const bool write = access == Access::read_write;
  const int fd = ::shm_open(path.c_str(), write ? O_RDWR : O_RDONLY, 0);
  if (fd < 0) {
    if (errno == ENOENT) return refuse("does not exist; is the station running?");
    return refuse("cannot be opened: " + reason());
  }
  struct Closer {
    int fd;
    ~Closer() { ::close(fd); }
  } const closer{fd};

  struct stat info = {};
  if (::fstat(fd, &info) != 0) return refuse("cannot be examined: " + reason());
  if (info.st_uid != ::geteuid() && ::geteuid() != 0) return refuse("belongs to another user");
  if ((info.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return refuse("is open to other users, so it is not trusted");
  if (!has_living_owner(fd)) return refuse("its owner is gone; start the station again");

  SegmentHeader header;
  if (::pread(fd, static_cast<void*>(&header), sizeof header, 0) != static_cast<ssize_t>(sizeof header) ||
      header.magic.load(std::memory_order_relaxed) == 0) {
    return refuse("is not ready yet");
  }
  if (header.magic.load(std::memory_order_relaxed) != magic) return refuse("holds something else");
  if (header.layout != layout || header.size != size || static_cast<std::size_t>(info.st_size) != size) {
    return refuse("was made by another version of punctum (process " + std::to_string(header.owner_pid) +
                  "); run programs of one build");
  }
  void* data =
      ::mmap(nullptr, size, write ? PROT_READ | PROT_WRITE : PROT_READ, MAP_SHARED | MAP_POPULATE, fd, 0);
  if (data == MAP_FAILED) return refuse("cannot be mapped: " + reason());
  Segment made;
  made.name_ = name;
  made.data_ = data;
  made.size_ = size;
  return made;
}

std::size_t remove_stale_segments() {
  std::vector<std::string> paths;
  if (DIR* directory = ::opendir(kDirectory); directory != nullptr) {
    while (const dirent* entry = ::readdir(directory)) {
      const std::string_view file = entry->d_name;
      if (file.starts_with(kPrefix)) paths.push_back(shm_name(file.substr(kPrefix.size())));
    }
    ::closedir(directory);
  }
  std::size_t removed = 0;
  for (const std::string& path : paths) {
    const int fd = ::shm_open(path.c_str(), O_RDWR, 0);
    if (fd < 0) continue;
    struct stat info = {};
    if (::fstat(fd, &info) == 0 && info.st_uid == ::geteuid() && take_lock(fd) && name_means(path, fd) &&
        ::shm_unlink(path.c_str()) == 0) {
      ++removed;
    }
    ::close(fd);
  }
  return removed;
}

}  // namespace punctum::hal
