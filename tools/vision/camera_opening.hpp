// To open a camera may take seconds, and for ever where a driver hangs. It is done on a thread of its own, so
// that whoever waits can go on, and leave.
#pragma once

#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tl/expected.hpp>
#include <utility>

#include "hal/live_camera.hpp"

namespace punctum::tools {

// What open() says. Calls `round` while it waits; nothing: `stop` was asked for first. Then the thread still
// uses the camera and what that refers to: the process may only end, without taking anything apart.
template <class Round, class Stop>
[[nodiscard]] std::optional<tl::expected<void, std::string>> open_unless_stopped(
    const std::shared_ptr<hal::LiveCamera>& camera, std::chrono::nanoseconds every, Round&& round,
    Stop&& stop) {
  std::packaged_task<tl::expected<void, std::string>()> task([camera] { return camera->open(); });
  auto opening = task.get_future();
  std::thread(std::move(task)).detach();
  while (opening.wait_for(every) != std::future_status::ready) {
    if (stop()) {
      return std::nullopt;
    }
    round();
  }
  return opening.get();
}

}  // namespace punctum::tools
