// A stated stress beside a measurement: ordinary processes that keep processors, caches, the disk, the
// scheduler and the timers busy.
#pragma once

#include <sys/types.h>

#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

namespace punctum::jitter {

class Load {
 public:
  // While the process has one thread. What it is made of stands in stated().
  [[nodiscard]] static tl::expected<Load, std::string> start();
  [[nodiscard]] static std::string stated();

  Load(Load&& other) noexcept : pids_(std::exchange(other.pids_, {})) {}
  Load& operator=(Load&& other) noexcept {
    std::swap(pids_, other.pids_);
    return *this;
  }
  ~Load();

 private:
  Load() = default;
  template <class Work>
  [[nodiscard]] bool add(Work work);

  std::vector<pid_t> pids_;
};

}  // namespace punctum::jitter
