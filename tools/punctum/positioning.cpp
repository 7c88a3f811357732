#include "tools/punctum/positioning.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <thread>

#include "hal/zaber/zaber_positioner.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/stop_signal.hpp"

namespace punctum::tools {
namespace {

constexpr auto kLook = std::chrono::milliseconds(50);
constexpr auto kPatience = std::chrono::seconds(3);  // with an axis that is busy and does not come nearer
constexpr double kThere_m = 1e-6;                    // or a step: what a device calls settled

std::string um(const hal::Vec3& v) {
  return fmt::format("[{:.2f}, {:.2f}, {:.2f}] um", v.x() * 1e6, v.y() * 1e6, v.z() * 1e6);
}

bool is_there(const hal::Vec3& at_m, const hal::Vec3& wanted_m, const zaber::ZaberParams& params) {
  for (std::size_t i = 0; i < params.axes.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (std::abs(at_m[k] - wanted_m[k]) > std::max(kThere_m, std::abs(params.axes[i].microstep_m))) {
      return false;
    }
  }
  return true;
}

// Until it rests, hangs, or somebody interrupts: the first signal brakes, the second is not waited for.
int wait_for_rest(zaber::ZaberPositioner& positioner, const zaber::ZaberParams& params,
                  const hal::Vec3& wanted_m, Terminal& terminal) {
  using Clock = std::chrono::steady_clock;
  bool stopped = false;
  double least_left_m = std::numeric_limits<double>::infinity();
  auto nearer = Clock::now();
  for (hal::PositionerState state;; std::this_thread::sleep_for(kLook)) {
    if (stop_signal::count() > 0 && !stopped) {
      positioner.stop();
      stopped = true;
      nearer = Clock::now();
    }
    if (positioner.read(state) != hal::Status::ok || state.fault) {
      terminal.complain(fmt::format("positioner: {}", positioner.why()));
      return exit_fault;
    }
    if (!state.moving) {
      if (!stopped && !is_there(state.position_m, wanted_m, params)) {
        terminal.complain(fmt::format(
            "positioner: it came to rest at {}, not at {}: something else stopped or moved it on the way",
            um(state.position_m), um(wanted_m)));
        return exit_fault;
      }
      terminal.say("{} at {}", stopped ? "stopped" : "there,", um(state.position_m));
      return stopped ? exit_not_done : exit_done;
    }
    if (const double left_m = (wanted_m - state.position_m).norm(); left_m < least_left_m - kThere_m) {
      least_left_m = left_m;
      nearer = Clock::now();
    }
    if (stop_signal::count() > 1 || Clock::now() > nearer + kPatience) {
      if (!stopped) {
        positioner.stop();
      }
      terminal.complain(
          fmt::format("positioner: it says that it moves, stands at {} and {}", um(state.position_m),
                      stopped ? "has not said that it stopped" : "comes no nearer: it was told to stop"));
      return exit_fault;
    }
    if (terminal.line_style().columns > 0) {
      terminal.progress(um(state.position_m));
    }
  }
}

}  // namespace

int move_positioner(const Scene& scene, const std::optional<hal::Vec3>& target_m) {
  Terminal terminal;
  const auto refuse = [&terminal](const std::string& why) {
    terminal.complain(why);
    return exit_bad_input;
  };
  if (scene.devices.positioner != kZaber) {
    return refuse(
        fmt::format("{}: there is no positioner to move, allowed: a scene with [positioner] device = \"{}\"",
                    scene.name, kZaber));
  }
  stop_signal::watch({SIGINT, SIGTERM, SIGHUP, SIGQUIT});
  const rt::MonotonicClock clock;
  zaber::ZaberPositioner positioner(*scene.zaber, clock,
                                    std::make_unique<zaber::SerialLine>(scene.zaber->port));
  if (const auto opened = positioner.open(); !opened) {
    return refuse(opened.error());
  }
  const hal::Vec3 wanted_m = target_m.value_or(scene.zaber->park_m);
  int code = exit_bad_input;
  if (positioner.move_to(wanted_m)) {
    code = wait_for_rest(positioner, *scene.zaber, wanted_m, terminal);
  } else if (!positioner.why().empty()) {
    terminal.complain(fmt::format("positioner: {}", positioner.why()));
    code = exit_fault;
  } else {
    terminal.complain(fmt::format("{} is outside, allowed: from {} to {}", um(wanted_m),
                                  um(positioner.least_m()), um(positioner.most_m())));
  }
  positioner.close();
  return code;
}

}  // namespace punctum::tools
