// The kernel's trace of what its processors do, in rings of its own that disturb no other user of tracefs:
// while one is read, the other one is written.
#pragma once

#include <array>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace punctum::tools::late {

class KernelTrace {
 public:
  // Traces from here on, with the clock of the loop, whose thread is `tid`: all processors, or the only one
  // that this thread may use. The error says what is missing and what mends it.
  [[nodiscard]] static tl::expected<KernelTrace, std::string> start(int tid);

  KernelTrace(KernelTrace&& other) noexcept : folders_(std::exchange(other.folders_, {})) {}
  KernelTrace& operator=(KernelTrace&&) = delete;
  ~KernelTrace();  // its rings go

  // What was traced since the last call, as far as the ring reaches back.
  [[nodiscard]] std::string take();

 private:
  KernelTrace() = default;
  std::array<std::string, 2> folders_;  // the first one is written
};

}  // namespace punctum::tools::late
