// The system calls of the backend, so that a test can put a kernel of its own in their place.
#pragma once

#include <cstddef>
#include <cstdint>

namespace punctum::v4l2 {

struct Answer {
  int value;
  int error;  // errno, where the value is negative
};

class Kernel {
 public:
  virtual ~Kernel() = default;
  [[nodiscard]] virtual Answer open(const char* path) = 0;  // to read and write, without waiting
  virtual void close(int fd) = 0;
  [[nodiscard]] virtual Answer ioctl(int fd, unsigned long request, void* argument) = 0;
  [[nodiscard]] virtual Answer poll(int fd, int timeout_ms, short& events) = 0;  // until it can be read
  [[nodiscard]] virtual void* map(int fd, std::size_t bytes, std::int64_t offset) = 0;  // null: not possible
  virtual void unmap(void* memory, std::size_t bytes) = 0;
};

[[nodiscard]] Kernel& this_kernel();

}  // namespace punctum::v4l2
