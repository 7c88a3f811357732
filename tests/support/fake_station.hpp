// A station without processes: its segments and its rendezvous, written by the test in place of core and
// vision.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "hal/browser/fingers.hpp"
#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/sealed_text.hpp"
#include "hal/ipc/segment.hpp"
#include "rt/station/picture.hpp"
#include "rt/station/station.hpp"
#include "tools/shared/station_segments.hpp"

namespace punctum {

class FakeStation {
 public:
  FakeStation() : FakeStation("fake-" + std::to_string(getpid())) {}
  // scene: its text, empty: it tells none.
  explicit FakeStation(std::string name, std::string_view scene = {})
      : name_(std::move(name)),
        rendezvous_(hal::Rendezvous::open(name_).value()),
        core_made_(hal::Shared<const rt::CoreSegment>::create("core").value()),
        core_(hal::Shared<rt::CoreSegment>::claim("core", core_made_.segment().descriptor()).value()),
        observation_made_(hal::Shared<const rt::ObservationSegment>::create("observation").value()),
        observation_(hal::Shared<rt::ObservationSegment>::claim("observation",
                                                                observation_made_.segment().descriptor())
                         .value()),
        commands_(hal::Shared<rt::CommandSegment>::create("commands").value()),
        view_made_(hal::Shared<const rt::ViewSegment>::create("view").value()),
        view_(hal::Shared<rt::ViewSegment>::claim("view", view_made_.segment().descriptor()).value()),
        viewer_(hal::Shared<const rt::ViewerSegment>::create("viewer").value()),
        fingers_(hal::Shared<const browser::FingersSegment>::create("fingers").value()) {
    rendezvous_.offer(tools::kCoreSegment, core_made_.segment().read_only_descriptor().value());
    rendezvous_.offer(tools::kObservationSegment, observation_made_.segment().read_only_descriptor().value());
    rendezvous_.offer(tools::command_segment(rt::kConsole),
                      hal::Descriptor(fcntl(commands_.segment().descriptor(), F_DUPFD_CLOEXEC, 0)));
    rendezvous_.offer(tools::kViewSegment, view_made_.segment().read_only_descriptor().value());
    rendezvous_.offer(tools::kViewerSegment,
                      hal::Descriptor(fcntl(viewer_.segment().descriptor(), F_DUPFD_CLOEXEC, 0)));
    rendezvous_.offer(tools::kFingersSegment,
                      hal::Descriptor(fcntl(fingers_.segment().descriptor(), F_DUPFD_CLOEXEC, 0)));
    if (!scene.empty()) {
      rendezvous_.offer(tools::kSceneText, hal::seal_text("scene", scene).value());
    }
    core_->status.pid = static_cast<std::uint64_t>(getpid());
    core_->status.period_ns = 1'000'000;
    serving_ = std::thread([this] {
      while (!done_) {
        rendezvous_.serve();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  ~FakeStation() {
    done_ = true;
    serving_.join();
  }
  FakeStation(const FakeStation&) = delete;
  FakeStation& operator=(const FakeStation&) = delete;

  // One tick of a core that runs well, but for what the test changes in `sample`.
  void tick(rt::TelemetrySample sample = {}) {
    sample.tick = ticks_;
    sample.t_s = static_cast<double>(ticks_) * 1e-3;
    core_->telemetry.push(sample);
    ++ticks_;
    core_->status.ticks = ticks_;
    core_->status.tick_index = ticks_;
    core_->status.started = 1;
    core_->status.fault = static_cast<std::uint64_t>(sample.fault);
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] rt::CoreSegment& core() { return *core_; }
  [[nodiscard]] rt::ObservationSegment& observation() { return *observation_; }
  [[nodiscard]] rt::CommandQueue& commands() { return commands_->queue; }
  [[nodiscard]] rt::ViewSegment::Ring& view() { return view_->ring; }
  [[nodiscard]] const browser::FingersSegment& fingers() const { return *fingers_; }
  [[nodiscard]] std::int64_t looked_at_until_ns() const {
    return static_cast<std::int64_t>(viewer_->looks_until_ns.load());
  }

 private:
  std::string name_;
  hal::Rendezvous rendezvous_;
  hal::Shared<const rt::CoreSegment> core_made_;
  hal::Shared<rt::CoreSegment> core_;
  hal::Shared<const rt::ObservationSegment> observation_made_;
  hal::Shared<rt::ObservationSegment> observation_;
  hal::Shared<rt::CommandSegment> commands_;
  hal::Shared<const rt::ViewSegment> view_made_;
  hal::Shared<rt::ViewSegment> view_;
  hal::Shared<const rt::ViewerSegment> viewer_;
  hal::Shared<const browser::FingersSegment> fingers_;
  std::uint64_t ticks_ = 0;
  std::atomic<bool> done_ = false;
  std::thread serving_;
};

}  // namespace punctum
