// The recording of a run as the parent sees it: punctum-record, started before the core and ended after it. A
// run goes on without it; in virtual time, whoever lets time advance waits for it while it lives.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/ipc/segment.hpp"
#include "tools/shared/child.hpp"
#include "tools/shared/record_progress.hpp"
#include "tools/shared/station_segments.hpp"

namespace punctum::tools {

class RecordProcess {
 public:
  static constexpr const char* kFile = "recording.mcap";

  // What it maps, for reading only, and what it tells its progress in; before start().
  [[nodiscard]] tl::expected<void, std::string> add(const char* name, const hal::Segment& segment);
  [[nodiscard]] tl::expected<void, std::string> tell_progress(const std::string& station);
  [[nodiscard]] tl::expected<void, std::string> start(const std::string& station,
                                                      const hal::Descriptor& scene,
                                                      const std::string& folder);
  [[nodiscard]] bool is_running() const noexcept { return child_.running(); }
  // Ticks that it has taken; also of one that has ended.
  [[nodiscard]] std::uint64_t taken() const noexcept;
  [[nodiscard]] std::uint64_t whole_until()
      const noexcept;  // ticks before the first that was lost, or all taken
  // Both say why the recording is not whole, once; empty if it is, or if there is none.
  [[nodiscard]] std::string watch();  // once per round of the parent
  [[nodiscard]] std::string end();  // the core has ended: it takes the rest, ends its file, and is waited for
  // Nothing has begun.
  void abandon();

 private:
  [[nodiscard]] std::string why(const Ended& how) const;

  HandedSegments handed_;
  std::vector<hal::Descriptor> descriptors_;
  std::optional<hal::Shared<const RecordProgress>> progress_;
  Child child_;
};

}  // namespace punctum::tools
