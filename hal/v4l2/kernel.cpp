#include "hal/v4l2/kernel.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

namespace punctum::v4l2 {
namespace {

Answer answer(int value) { return {value, value < 0 ? errno : 0}; }

class ThisKernel final : public Kernel {
 public:
  Answer open(const char* path) override { return answer(::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC)); }
  void close(int fd) override { ::close(fd); }
  Answer ioctl(int fd, unsigned long request, void* argument) override {
    Answer done{};
    do {
      done = answer(::ioctl(fd, request, argument));
    } while (done.value < 0 && done.error == EINTR);
    return done;
  }
  Answer poll(int fd, int timeout_ms, short& events) override {
    pollfd wanted{fd, POLLIN, 0};
    const Answer done = answer(::poll(&wanted, 1, timeout_ms));
    events = wanted.revents;
    return done;
  }
  void* map(int fd, std::size_t bytes, std::int64_t offset) override {
    void* const memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void unmap(void* memory, std::size_t bytes) override { ::munmap(memory, bytes); }
};

}  // namespace

Kernel& this_kernel() {
  static ThisKernel kernel;
  return kernel;
}

}  // namespace punctum::v4l2
