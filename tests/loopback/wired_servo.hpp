// The servo at 1 kHz on three real backends at once: a Falcon over libusb, three CiA 402 drives on CAN,
// e-stop chain and injector on GPIO lines. Behind each is the kernel's own driver, and behind that an
// emulator, which knows the truth. Between servo and backends stand watchers, which pass everything on and
// note it for the invariants (tests/support/invariants.hpp).
//
// The hand goes by a plan, whatever it feels; a sphere is the cell, and the test tells what a microscope
// would see of it: of pictures of its own, or of those that a real camera gives (vivid), each when it was
// exposed. After 280 ms the needle is inside, the gate open, and the hand trembles, so that a needle
// that still follows it shows.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/v4l2/v4l2_camera.hpp"
#include "rt/control/servo.hpp"
#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/station.hpp"
#include "tests/loopback/beside.hpp"
#include "tests/loopback/can_wires.hpp"
#include "tests/loopback/falcon_on_usb.hpp"
#include "tests/loopback/gpiod_wiring.hpp"
#include "tests/loopback/vivid_loop.hpp"
#include "tests/support/invariants.hpp"
#include "tests/support/watched_devices.hpp"
#include "tools/core/assembly.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::loopback {

using hal::Vec3;

// The camera's part of a vision program: it takes every picture, and opens a camera that is lost again once
// it may be back.
class WatchedCamera {
 public:
  explicit WatchedCamera(const hal::Clock& clock) : camera_(params(), settings(), clock) {
    const auto opened = camera_.open();
    EXPECT_TRUE(opened) << opened.error();
    thread_ = std::thread([this] { run(); });
  }
  ~WatchedCamera() {
    over_ = true;
    thread_.join();
    camera_.close();
    if (!unplugged_) {
      vivid.set("Percentage of Dropped Buffers", 0);
    }
  }
  WatchedCamera(const WatchedCamera&) = delete;
  WatchedCamera& operator=(const WatchedCamera&) = delete;

  void unplug() {
    unplugged_ = true;
    vivid.set("Disconnect", 1);
  }
  // The kernel has it back once nobody has it open any more.
  void plug_in() {
    vivid.close();
    may_be_back = true;
  }

  // Exposures since the last call; none while one is being noted.
  [[nodiscard]] std::vector<std::int64_t> taken() {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    return lock ? std::exchange(exposures_ns_, {}) : std::vector<std::int64_t>();
  }
  [[nodiscard]] std::string complaint() {
    const std::lock_guard lock(mutex_);
    return complaint_;
  }
  [[nodiscard]] std::uint64_t lost() {
    const std::lock_guard lock(mutex_);
    return lost_;
  }

  VividNode vivid{V4L2_CAP_VIDEO_CAPTURE};
  std::atomic<bool> may_be_back{false};

 private:
  [[nodiscard]] v4l2::V4l2Params params() const {
    v4l2::V4l2Params params;
    params.path = vivid.path();
    return params;
  }
  [[nodiscard]] static hal::CameraSettings settings() {
    hal::CameraSettings settings;
    settings.width = 320;
    settings.height = 180;
    settings.fps = 60;
    return settings;
  }
  void run() {
    while (!over_) {
      hal::Frame frame;
      const hal::Status status = camera_.next(frame, 10'000'000);
      const std::lock_guard lock(mutex_);
      lost_ = camera_.counts().lost;
      if (status == hal::Status::ok) {
        exposures_ns_.push_back(frame.exposure_ns);
      } else if (status != hal::Status::no_data && complaint_.empty()) {
        complaint_ = camera_.last_error();
      }
      camera_.release(frame);
      if (status == hal::Status::disconnected) {
        if (may_be_back) {
          (void)camera_.open();
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
  }

  v4l2::V4l2Camera camera_;
  std::mutex mutex_;  // of what follows
  std::vector<std::int64_t> exposures_ns_;
  std::string complaint_;  // the first
  std::uint64_t lost_ = 0;
  std::atomic<bool> over_{false};
  bool unplugged_ = false;
  std::thread thread_;
};

// What one tick left: of the servo, and of the world.
struct WiredTick {
  std::uint64_t index;
  rt::Fault fault;
  rt::StopStage stage;
  rt::Phase phase;
  std::uint32_t alarms;
  bool level;                     // of the heartbeat's wire
  bool gate;                      // of the gate's wire
  bool moves;                     // a drive
  bool pushes;                    // the handle
  std::array<bool, 3> follows;    // a drive its set-points
  std::array<bool, 3> has_power;  // a drive's motor
  Vec3 tip_m;                     // in truth
  bool punctured;                 // likewise
};

class WiredServo {
 public:
  static constexpr std::int64_t kPeriod_ns = 1'000'000;
  static constexpr double kApproach_ms = 45, kInside_ms = 225, kPress_ms = 245, kTrembles_ms = 275;
  static constexpr double kPowerOffAfter_s = 0.1;
  static constexpr double kFalconAhead_m = 0.12;  // of the middle of its base: the origin of the hand

  static constexpr double kStaleAfter_s = 0.1;  // of pictures of the camera

  explicit WiredServo(bool with_camera = false) {
    if (with_camera) {
      camera.emplace(clock);
    }
    wait_for_falcon(true);
    auto loaded = tools::load_scene(
        "free",
        {"haptic.device=falcon", "falcon=on", "estop.device=gpiod", "injector=on", "injector.device=gpiod",
         "gpiod=on", "gpiod.chip=\"" + board->path() + "\"", "gpiod.contact_a=" + std::to_string(kContactA),
         "gpiod.contact_b=" + std::to_string(kContactB), "gpiod.reset=" + std::to_string(kReset),
         "gpiod.heartbeat=" + std::to_string(kHeartbeat), "gpiod.gate=" + std::to_string(kGate),
         "gpiod.valve_contact=" + std::to_string(kValve), "haptic.encoder_step_mm=0.06",
         "haptic.delay_ticks=1"});
    EXPECT_TRUE(loaded) << loaded.error();
    tools::Scene scene = std::move(loaded).value();
    scene.devices.stage = tools::kCia402;
    scene.cia402 = three_drives();
    scene.cia402->tip_m = kStart_m;
    rt::ServoConfig& c = scene.servo;
    EXPECT_TRUE(c.real_actuators);
    c.cells = 0;
    c.vision = true;
    c.membrane.emplace();
    c.cone.emplace();
    c.axis.emplace();
    c.guard.emplace();
    c.phases.emplace();
    c.local_model.emplace().stale_after_s = with_camera ? kStaleAfter_s : c.local_model->stale_after_s;
    c.injector->max_open_s = 60;
    c.estop.power_off_after_s = kPowerOffAfter_s;
    c.mapping.tremor_cutoff_Hz = 10;
    c.mapping.max_tilt_rad = 0;
    config = c;
    auto opened = tools::Assembly::open({scene, clock, nullptr});
    EXPECT_TRUE(opened) << opened.error();
    assembly_ = std::move(opened).value();
    for (const int contact : {kContactA, kContactB, kValve}) {
      board->drive(contact, true);
    }
    watched_.emplace(assembly_->devices());
    checker.emplace(config);
    servo_ = std::make_unique<rt::Servo>(config, watched_->devices(), station_->station);
  }
  ~WiredServo() {
    assembly_.reset();
    falcon->unplug();
    wait_for_falcon(false);
  }
  WiredServo(const WiredServo&) = delete;
  WiredServo& operator=(const WiredServo&) = delete;

  // So many ticks; meanwhile `outside` acts on the world, on a thread of its own that is above the core.
  void run(std::uint64_t count, const std::function<void()>& outside) {
    last_tick_ = count - 1;
    ticks.reserve(count);
    first_ns_ = clock.now_ns() + 10 * kPeriod_ns;
    const auto started = assembly_->start(first_ns_);
    ASSERT_TRUE(started) << started.error();
    first_ns_ = clock.now_ns() + 5 * kPeriod_ns;
    const std::vector<rt::Slot> slots = {rt::slot<&WiredServo::tick>("servo", *this)};
    rt::ExecutiveConfig executive_config;
    executive_config.start_ns = first_ns_;
    rt::Executive executive(clock, clock, executive_config, slots, station_->core.status);
    run_beside(executive, outside);
  }

  // ---- for those outside ----
  void at(double t_ms) { clock.sleep_until_ns(first_ns_ + std::llround(t_ms * 1e6)); }
  [[nodiscard]] double now_ms() const { return 1e-6 * static_cast<double>(clock.now_ns() - first_ns_); }
  // Nothing below runs meanwhile.
  void occupy(double until_ms) {
    while (now_ms() < until_ms) {
    }
  }
  void contacts(bool a, bool b) {
    board->drive(kContactA, a);
    board->drive(kContactB, b);
  }
  void drive(std::size_t i, const char* line) {
    EXPECT_EQ(drives->with(i, [line](emulator::Drive& d) { return d.command(line); }), "");
  }
  void handle(const char* line) {
    EXPECT_EQ(falcon->with([line](emulator::FalconEmulator& f, WatchedHand&) { return f.command(line); }),
              "");
  }
  // What the kernel does on its own time, below the core.
  template <class Function>
  void let_kernel(Function&& function) {
    become(1);
    function();
    become(kOutsidePriority);
  }
  void pull_chip() {
    chip_gone_ = true;
    let_kernel([this] { board->unplug(); });
  }

  // The plan of the hand, and what of the world is no longer as it should be.
  std::atomic<double> draws_back_ms{1e9};  // from then on it goes out at 50 mm/s
  std::atomic<double> rests_ms{1e9};       // from then on it trembles no more
  std::atomic<double> releases_ms{1e9};    // the button
  std::atomic<double> stall_ms{0};         // of the core's thread, at the end of its next tick
  std::atomic<bool> stage_lies{false}, hand_hidden{false}, valve_cut{false};

  rt::MonotonicClock clock;
  std::unique_ptr<GpioSim> board = std::make_unique<GpioSim>();
  std::optional<CanInterface> can0{std::in_place, "can0"}, can1{std::in_place, "can1"};
  std::optional<DrivesOnBus> drives{std::in_place, "can1", 3};
  std::optional<WatchedCamera> camera;
  std::unique_ptr<FalconOnUsb> falcon =
      std::make_unique<FalconOnUsb>(emulator::FalconParams{.booted = true, .homed = true});
  rt::ServoConfig config;
  std::optional<rt::test::Invariants> checker;
  std::vector<WiredTick> ticks;
  std::uint64_t missed = 0;
  int regular = 0;  // ticks that came as exactly as the checker asks for acceleration and jerk

 private:
  static constexpr std::size_t kForcesOnTheirWay = 4;
  static constexpr double kForceSteps_N = 0.05;  // of motors, where the hand is
  static constexpr std::int64_t kRelay_ns = 50'000'000;
  static constexpr std::uint64_t kFrameEvery = 10, kFrameLate = 20;  // ticks
  static constexpr std::uint64_t kPictureLate = 10;                  // the same of a camera of 60 Hz
  static constexpr double kR_m = 60e-6, kPuncture_m = 4e-6, kIn_m = 12e-6, kTremble_m = 0.25e-3;
  inline static const Vec3 kStart_m{24e-6, 2e-6, 0}, kCentre_m{-40e-6, 0, 0};

  // The kernel asks a device what it is before a program may open it, and knows one that has gone for a
  // while.
  void wait_for_falcon(bool there) {
    const auto seen = [] {
      std::error_code none;
      for (const auto& device : fs::directory_iterator("/sys/bus/usb/devices", none)) {
        if (text_of(device.path() / "idProduct") == "cb48" &&
            text_of(device.path() / "bConfigurationValue") == "1") {
          return true;
        }
      }
      return false;
    };
    for (int i = 0; i < 200 && seen() != there; ++i) {
      clock.sleep_until_ns(clock.now_ns() + 10 * kPeriod_ns);
    }
    EXPECT_EQ(seen(), there) << "the Falcon";
  }

  [[nodiscard]] Vec3 hand_m(double t_ms) const {
    const double part = std::clamp((t_ms - kApproach_ms) / (kInside_ms - kApproach_ms), 0.0, 1.0);
    const double scale = config.mapping.position_scale;
    Vec3 x(-scale * kIn_m * part * part * (3 - 2 * part), 0, 0);
    const double trembles = std::clamp((std::min(t_ms - kTrembles_ms, rests_ms - t_ms)) / 20, 0.0, 1.0);
    const double turn = 2 * std::numbers::pi * 10e-3 * (t_ms - kTrembles_ms);
    x += trembles * kTremble_m * std::sin(turn) * Vec3(1, 1, 0);
    x.x() += 50e-6 * std::max(0.0, t_ms - draws_back_ms);
    return x;
  }

  [[nodiscard]] static double gap_m(const Vec3& tip_m) {
    const double beside2 = tip_m.y() * tip_m.y() + tip_m.z() * tip_m.z();
    return tip_m.x() - (kCentre_m.x() + std::sqrt(std::max(0.0, kR_m * kR_m - beside2)));
  }
  // The needle as it was then.
  [[nodiscard]] rt::Observation seen(const WiredTick& then, std::int64_t exposure_ns) {
    const double gap = gap_m(then.tip_m);
    rt::Observation o;
    o.frame = ++frames_;
    o.exposure_ns = exposure_ns;
    o.flags = rt::Observation::tip_ok | rt::Observation::outer_ok |
              (then.punctured ? rt::Observation::punctured : 0U) | (gap < 0 ? rt::Observation::contact : 0U);
    for (int i = 0; i < 2; ++i) {
      o.tip_m[i] = then.tip_m[i];
      o.centre_m[i] = kCentre_m[i];
    }
    o.R_m = kR_m;
    o.gap_m = gap;
    if (gap < 0) {
      o.wd_m = then.punctured ? 0 : -gap;
      o.a_m = 3.8e-6 + 0.45 * std::sqrt(2 * kR_m * -gap);
    }
    return o;
  }
  void look(WiredTick& now, std::int64_t now_ns) {
    const std::uint64_t index = now.index;
    const double gap = gap_m(now.tip_m);
    punctured_ = now.punctured = gap <= 10e-6 && (punctured_ || -gap > kPuncture_m);
    if (camera) {
      for (const std::int64_t exposure_ns : camera->taken()) {
        const auto then = std::find_if(ticks.rbegin(), ticks.rend(), [&](const WiredTick& tick) {
          return static_cast<std::int64_t>(tick.index) * kPeriod_ns <= exposure_ns - first_ns_;
        });
        on_their_way_.emplace_back(index + kPictureLate,
                                   seen(then != ticks.rend() ? *then : now, exposure_ns));
      }
    } else if (index >= next_frame_) {
      next_frame_ = index + kFrameEvery;
      on_their_way_.emplace_back(index + kFrameLate, seen(now, now_ns));
    }
    while (!on_their_way_.empty() && on_their_way_.front().first <= index) {
      const rt::Observation& o = on_their_way_.front().second;
      station_->observation.slot.push(o);
      seen_ns_ = o.exposure_ns;
      punctured_frames_ += o.has(rt::Observation::punctured) ? 1 : 0;
      on_their_way_.pop_front();
    }
  }

  rt::After tick(const rt::Tick& tick) noexcept {
    WiredTick row{};
    row.index = tick.index;
    const double t_ms = 1e-6 * static_cast<double>(tick.wake_ns - first_ns_);
    const Vec3 x = hand_m(t_ms);
    Vec3 acts_N = Vec3::Zero();
    falcon->with([&](emulator::FalconEmulator& f, WatchedHand& hand) {
      hand.at.position_m = {x.x(), x.y(), x.z() + kFalconAhead_m};
      hand.at.buttons = t_ms >= kPress_ms && t_ms < releases_ms ? hal::kButtonInject : 0;
      if (f.motors() != std::array<int, 3>{}) {
        acts_N = Vec3(f.force_N()[0], f.force_N()[1], f.force_N()[2]);
      }
    });
    // Without a heartbeat the relay takes the supply of the handle.
    if (tick.wake_ns - beat_ns_ > kRelay_ns && beat_ns_ != 0) {
      acts_N.setZero();
    }
    row.tip_m = kStart_m;
    double speed_m_s = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      drives->with(i, [&](emulator::Drive& d) {
        row.tip_m[static_cast<Eigen::Index>(i)] += kCount_m * d.position();
        speed_m_s = std::hypot(speed_m_s, kCount_m * d.speed());
        row.follows[i] = d.state() == emulator::DriveState::operation_enabled;
        row.has_power[i] = d.motor_has_power();
      });
    }
    row.moves = speed_m_s > 0;
    row.pushes = acts_N.norm() > 0;
    look(row, tick.wake_ns);

    rt::test::Seen& seen = watched_->seen;
    seen = {};
    seen.hand_status = seen.stage_status = seen.estop_status = hal::Status::no_data;
    seen.elapsed_s = 1e-9 * static_cast<double>(ticks.empty() ? kPeriod_ns : tick.wake_ns - last_wake_ns_);
    regular += std::abs(seen.elapsed_s - 1e-3) < 1e-5 ? 1 : 0;
    last_wake_ns_ = tick.wake_ns;
    seen.now_ns = tick.wake_ns;
    seen.hand_true_m = x;
    seen.hand_hidden = hand_hidden;
    seen.hand_work_J = acts_N.dot(x - last_hand_m_);
    last_hand_m_ = x;
    seen.tip_true_m = row.tip_m;
    seen.stage_true = !stage_lies;
    seen.stage_moves = speed_m_s > 15e-6;
    seen.seen_ns = seen_ns_;
    seen.punctured_frames = std::exchange(punctured_frames_, 0);

    servo_->tick(tick.info());
    missed = tick.missed;

    // The force that acts is one of those that were written last, to the steps of the motors.
    const bool obeys = std::any_of(asked_N_.begin(), asked_N_.end(), [&](const Vec3& asked_N) {
      return (asked_N - acts_N).norm() < kForceSteps_N;
    });
    asked_N_[tick.index % kForcesOnTheirWay] = watched_->asked_N;
    seen.asked_N = watched_->asked_N;
    seen.force_N = obeys ? seen.asked_N : acts_N;
    seen.power = watched_->power;
    seen.enable_line = watched_->enable_line;
    // Of a chip that is gone nobody can ask the wires.
    seen.gate = row.gate = chip_gone_ ? watched_->gate : gate_wire_.level();
    seen.level = row.level = beat_wire_.level();
    beat_ns_ = ticks.empty() || row.level != ticks.back().level ? tick.wake_ns : beat_ns_;
    seen.finished = servo_->finished();
    seen.sample = &servo_->sample();
    checker->step(seen);
    if (!chip_gone_ && valve_open_ != (row.gate || valve_cut)) {
      valve_open_ = !valve_open_;
      board->drive(kValve, !valve_open_);
    }

    row.fault = servo_->fault();
    row.stage = servo_->stop_stage();
    row.phase = servo_->phase();
    row.alarms = servo_->sample().alarms;
    ticks.push_back(row);
    if (const double stall = stall_ms.exchange(0); stall > 0) {
      clock.sleep_until_ns(clock.now_ns() + std::llround(stall * 1e6));
    }
    return tick.index >= last_tick_ ? rt::After::end : rt::After::go_on;
  }

  std::unique_ptr<rt::LocalStation> station_ = std::make_unique<rt::LocalStation>();
  std::unique_ptr<tools::Assembly> assembly_;
  std::optional<tests::WatchedDevices> watched_;
  std::unique_ptr<rt::Servo> servo_;
  emulator::WatchedLevel beat_wire_{board->value_file(kHeartbeat)}, gate_wire_{board->value_file(kGate)};
  std::int64_t first_ns_ = 0, last_wake_ns_ = 0, beat_ns_ = 0, seen_ns_ = 0;
  std::uint64_t last_tick_ = 0, next_frame_ = 0, frames_ = 0;
  std::atomic<bool> chip_gone_{false};
  bool punctured_ = false, valve_open_ = false;
  int punctured_frames_ = 0;
  std::deque<std::pair<std::uint64_t, rt::Observation>> on_their_way_;
  Vec3 last_hand_m_ = Vec3::Zero();
  std::array<Vec3, kForcesOnTheirWay> asked_N_{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
};

}  // namespace punctum::loopback
