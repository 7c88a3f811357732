#include "hal/ipc/segment.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>

namespace punctum::hal {
namespace {

constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

std::string reason() { return std::strerror(errno); }

std::string process(std::uint64_t pid) {
  return pid != 0 ? "process " + std::to_string(pid) : "another process";
}

// Opened anew: an open file of its own, with a lock of its own, that can never be mapped for writing.
Descriptor reopened_for_reading(int fd) {
  return Descriptor(::open(("/proc/self/fd/" + std::to_string(fd)).c_str(), O_RDONLY | O_CLOEXEC));
}

// What the kernel would give without pushing others out. Memory of this kind has no other bound: a request
// beyond it would take pages until something is killed.
std::size_t available_memory() {
  std::ifstream in("/proc/meminfo");
  for (std::string key; in >> key;) {
    std::size_t kB = 0;
    in >> kB;
    if (key == "MemAvailable:") {
      return kB << 10;
    }
    in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return std::numeric_limits<std::size_t>::max();
}

}  // namespace

std::uint64_t detail::own_pid() noexcept { return static_cast<std::uint64_t>(::getpid()); }

Descriptor::~Descriptor() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

Segment::~Segment() {
  if (data_ != nullptr) {
    ::munmap(data_, size_);
  }
}

void Segment::swap(Segment& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  std::swap(memory_, other.memory_);
  std::swap(lock_, other.lock_);
}

tl::expected<Segment, std::string> Segment::create(std::string_view name, std::size_t size) {
  const auto refuse = [name](const std::string& what) {
    return tl::unexpected("shared segment " + std::string(name) + ": " + what);
  };
  if (size > available_memory()) {
    return refuse("needs " + std::to_string(size >> 20) + " MiB of memory, which are not free");
  }
  Segment made;
  made.name_ = name;
  made.memory_ = Descriptor(
      ::memfd_create(("punctum." + made.name_).substr(0, 200).c_str(), MFD_CLOEXEC | MFD_ALLOW_SEALING));
  const int fd = made.memory_.number();
  if (fd < 0) {
    return refuse("cannot be created: " + reason());
  }
  // Reserved now: whoever touched a missing page later would be killed where memory is short.
  if (const int error = ::posix_fallocate(fd, 0, static_cast<off_t>(size)); error != 0) {
    return refuse("needs " + std::to_string(size >> 20) + " MiB: " + std::strerror(error));
  }
  // A descriptor for reading must not be opened anew for writing.
  if (::fchmod(fd, S_IRUSR) != 0 || ::fcntl(fd, F_ADD_SEALS, kSeals) != 0) {
    return refuse("cannot be sealed: " + reason());
  }
  void* data = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
  if (data == MAP_FAILED) {
    return refuse("cannot be mapped: " + reason());
  }
  made.data_ = data;
  made.size_ = size;
  return made;
}

tl::expected<Segment, std::string> Segment::attach(std::string_view name, int descriptor, Access access,
                                                   std::uint64_t magic, std::uint64_t layout,
                                                   std::size_t size) {
  const auto refuse = [name](const std::string& what) {
    return tl::unexpected("shared segment " + std::string(name) + ": " + what);
  };
  struct stat info = {};
  if (::fstat(descriptor, &info) != 0) {
    return refuse("was not handed over: " + reason());
  }
  if (info.st_uid != ::geteuid() && ::geteuid() != 0) {
    return refuse("belongs to another user");
  }
  const int seals = ::fcntl(descriptor, F_GET_SEALS);
  if (seals < 0 || (seals & kSeals) != kSeals) {
    return refuse("may be resized by others, so it is not trusted");
  }

  SegmentHeader header;
  if (::pread(descriptor, static_cast<void*>(&header), sizeof header, 0) !=
          static_cast<ssize_t>(sizeof header) ||
      header.magic.load(std::memory_order_relaxed) == 0) {
    return refuse("is not ready yet");
  }
  if (header.magic.load(std::memory_order_relaxed) != magic) {
    return refuse("holds something else");
  }
  if (header.layout != layout || header.size != size || static_cast<std::size_t>(info.st_size) != size) {
    return refuse("was made by another version of punctum (process " + std::to_string(header.owner_pid) +
                  "); run programs of one build");
  }
  Segment made;
  made.name_ = name;
  Descriptor for_reading;
  if (access != Access::read_write) {
    for_reading = reopened_for_reading(descriptor);
    if (!for_reading) {
      return refuse("cannot be opened: " + reason());
    }
  }
  if (access == Access::only_writer && ::flock(for_reading.number(), LOCK_EX | LOCK_NB) != 0) {
    return refuse("is already written by " + process(header.writer_pid.load(std::memory_order_relaxed)));
  }
  const bool write = access != Access::read_only;
  void* data = ::mmap(nullptr, size, write ? PROT_READ | PROT_WRITE : PROT_READ, MAP_SHARED | MAP_POPULATE,
                      write ? descriptor : for_reading.number(), 0);
  if (data == MAP_FAILED) {
    return refuse(write && errno == EACCES ? "may only be read by who has this descriptor"
                                           : "cannot be mapped: " + reason());
  }
  made.data_ = data;
  made.size_ = size;
  if (access == Access::only_writer) {
    made.lock_ = std::move(for_reading);
  }
  return made;
}

tl::expected<void, std::string> Segment::make_read_only() {
  auto for_reading = read_only_descriptor();
  if (!for_reading) {
    return tl::unexpected(std::move(for_reading.error()));
  }
  void* data = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED | MAP_POPULATE, for_reading->number(), 0);
  if (data == MAP_FAILED) {
    return tl::unexpected("shared segment " + name_ + ": cannot be mapped: " + reason());
  }
  ::munmap(std::exchange(data_, data), size_);
  return {};
}

tl::expected<Descriptor, std::string> Segment::read_only_descriptor() const {
  Descriptor made = reopened_for_reading(memory_.number());
  if (!made) {
    return tl::unexpected("shared segment " + name_ + ": cannot be opened: " + reason());
  }
  return made;
}

}  // namespace punctum::hal
