#include "tools/punctum/record_process.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <thread>
#include <utility>

#include "hal/ipc/sealed_text.hpp"
#include "tools/shared/exit_codes.hpp"

namespace punctum::tools {
namespace {

constexpr std::chrono::seconds kTimeToFinish{20};  // a disk that is slow

}  // namespace

tl::expected<void, std::string> RecordProcess::add(const char* name, const hal::Segment& segment) {
  auto descriptor = segment.read_only_descriptor();
  if (!descriptor) {
    return tl::unexpected(descriptor.error());
  }
  handed_.add(name, descriptor->number());
  descriptors_.push_back(std::move(*descriptor));
  return {};
}

tl::expected<void, std::string> RecordProcess::tell_progress(const std::string& station) {
  auto progress = hal::Shared<const RecordProgress>::create(station + "." + kProgressSegment);
  if (!progress) {
    return tl::unexpected(progress.error());
  }
  progress_ = std::move(*progress);
  handed_.add(kProgressSegment, progress_->segment().descriptor());
  return {};
}

std::uint64_t RecordProcess::taken() const noexcept {
  return progress_ ? (*progress_)->taken.load(std::memory_order_acquire) : 0;
}

std::uint64_t RecordProcess::whole_until() const noexcept {
  const std::uint64_t lost_from = progress_ ? (*progress_)->lost_from.load(std::memory_order_acquire) : 0;
  return lost_from > 0 ? lost_from - 1 : taken();
}

tl::expected<void, std::string> RecordProcess::start(const std::string& station, const hal::Descriptor& scene,
                                                     const std::string& folder) {
  handed_.add(kSceneText, scene.number());
  auto child = Child::start(
      "punctum-record", {"--station", station, "--segments", handed_.text(), "--out", folder + "/" + kFile},
      folder + "/record.log", handed_.descriptors());
  if (!child) {
    return tl::unexpected(child.error());
  }
  child_ = std::move(*child);
  return {};
}

std::string RecordProcess::why(const Ended& how) const {
  if (!how.exited) {
    return "punctum-record " + how.text();
  }
  if (how.code != exit_done) {
    return fmt::format("punctum-record {}: {}", how.text(), last_line(child_.log()));
  }
  // Somebody asked it to end, for example: what it took is in order, and not the run.
  return (*progress_)->ended.load(std::memory_order_acquire) == 0
             ? "punctum-record ended before the run had ended"
             : std::string();
}

std::string RecordProcess::watch() {
  Ended how;
  return child_.running() && child_.ended(how) ? why(how) : std::string();
}

std::string RecordProcess::end() {
  if (!child_.running()) {
    return {};
  }
  child_.send(SIGTERM);
  const auto asked = std::chrono::steady_clock::now();
  Ended how;
  while (!child_.ended(how)) {
    if (std::chrono::steady_clock::now() > asked + kTimeToFinish) {
      child_ = Child();
      return "punctum-record did not end and was killed";
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return why(how);
}

void RecordProcess::abandon() { child_ = Child(); }

}  // namespace punctum::tools
