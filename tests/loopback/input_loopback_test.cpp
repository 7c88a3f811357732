// Mice, gamepads and knobs made with uinput, read through the kernel's input code: the device alone, and the
// whole core at 1 kHz with a hand of theirs on the simulated station. The guest's time follows the
// instructions it executes (toolchain/rt-guest/run --deterministic), so ticks may be counted.
#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "hal/evdev/evdev_hand.hpp"
#include "hal/frames.hpp"
#include "hal/sim/truth.hpp"
#include "rt/control/servo.hpp"
#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/station.hpp"
#include "tests/loopback/beside.hpp"
#include "tests/loopback/virtual_input.hpp"
#include "tools/core/assembly.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/truth_observer.hpp"

namespace punctum::loopback {
namespace {

using evdev::EvdevHand;
using evdev::EvdevParams;
using hal::Status;
using hal::Vec3;
using rt::Fault;
using rt::Phase;

constexpr std::int64_t kTick_ns = 1'000'000;

// ---- the device alone ----

class InputLoopback : public testing::Test {
 protected:
  ~InputLoopback() override {
    if (hand) {
      hand->close();
    }
  }
  void open(const VirtualInput& device) {
    params.path = device.path();
    hand = std::make_unique<EvdevHand>(params, clock);
    const auto opened = hand->open();
    ASSERT_TRUE(opened) << opened.error();
    ASSERT_TRUE(hand->start(0));
    (void)read();
  }
  std::string refusal() {
    EvdevHand other(params, clock);
    const auto opened = other.open();
    return opened ? "it opened" : opened.error();
  }
  Status read() { return hand->read(state); }
  // Ticks of 1 ms for so long; the largest step from one to the next.
  double pass(int ticks) {
    double fastest_m_s = 0;
    std::int64_t next_ns = clock.now_ns();
    for (int i = 0; i < ticks; ++i) {
      const hal::HandState before = state;
      clock.sleep_until_ns(next_ns += kTick_ns);
      EXPECT_EQ(read(), Status::ok);
      const double since_s = 1e-9 * static_cast<double>(state.sample_ns - before.sample_ns);
      fastest_m_s = std::max(fastest_m_s, (state.position_m - before.position_m).norm() / since_s);
    }
    return fastest_m_s;
  }

  rt::MonotonicClock clock;
  EvdevParams params;
  std::unique_ptr<EvdevHand> hand;
  hal::HandState state;
};

TEST_F(InputLoopback, the_counts_of_a_mouse_are_ways_of_the_hand) {
  const VirtualInput mouse(mouse_model());
  open(mouse);
  mouse.move(REL_X, 40);
  mouse.move(REL_Y, 20);  // towards the operator: down in the picture
  mouse.move(REL_WHEEL, 1);
  pass(400);
  EXPECT_NEAR(state.position_m.x(), 40 * 25e-6, 1e-12);
  EXPECT_NEAR(state.position_m.y(), -20 * 25e-6, 1e-12);
  EXPECT_NEAR(state.position_m.z(), 1e-3, 1e-12);
  EXPECT_EQ(hand->write_force(Vec3(1, 2, 3)), Status::ok);
}

TEST_F(InputLoopback, no_jerk_of_the_mouse_moves_the_hand_faster_than_its_speed) {
  const VirtualInput mouse(mouse_model());
  open(mouse);
  mouse.move(REL_X, 1'000'000);
  const double fastest_m_s = pass(300);
  EXPECT_GT(fastest_m_s, 0.5 * params.speed_m_s);
  EXPECT_LT(fastest_m_s, params.speed_m_s * 1.001);
  EXPECT_LT(state.position_m.x(), params.speed_m_s * 0.045);  // what was too fast is not caught up on
}

TEST_F(InputLoopback, buttons_are_what_they_are_now) {
  const VirtualInput mouse(mouse_model());
  open(mouse);
  for (const auto& [key, button] : {std::pair{BTN_LEFT, hal::kButtonEnable},
                                    {BTN_RIGHT, hal::kButtonInject},
                                    {BTN_MIDDLE, hal::kButtonClutch},
                                    {BTN_SIDE, hal::kButtonNextCell}}) {
    mouse.press(key, true);
    pass(2);
    EXPECT_EQ(state.buttons, button);
    mouse.press(key, false);
    pass(2);
    EXPECT_EQ(state.buttons, 0U);
  }
}

TEST_F(InputLoopback, a_device_that_rests_has_a_fresh_sample_in_every_tick) {
  const VirtualInput mouse(mouse_model());
  open(mouse);
  for (int i = 0; i < 500; ++i) {
    const std::int64_t before_ns = state.sample_ns;
    pass(1);
    EXPECT_GT(state.sample_ns, before_ns);
    EXPECT_LE(clock.now_ns() - state.sample_ns, kTick_ns);
  }
  EXPECT_EQ(state.position_m, Vec3(Vec3::Zero()));
}

TEST_F(InputLoopback, unplugged_it_is_disconnected_at_the_next_reading_and_for_good) {
  VirtualInput mouse(mouse_model());
  open(mouse);
  mouse.press(BTN_LEFT, true);
  pass(2);
  mouse.unplug();
  const hal::HandState last = state;
  EXPECT_EQ(read(), Status::disconnected);
  const VirtualInput another(mouse_model());
  EXPECT_EQ(read(), Status::disconnected);
  EXPECT_EQ(state.sample_ns, last.sample_ns);
  EXPECT_EQ(hand->write_force(Vec3::Zero()), Status::ok);
}

TEST_F(InputLoopback, after_lost_events_it_asks_what_is_held) {
  const VirtualInput mouse(mouse_model());
  open(mouse);
  mouse.press(BTN_LEFT, true);
  pass(2);
  ASSERT_EQ(state.buttons, hal::kButtonEnable);
  mouse.press(BTN_LEFT, false);  // this is lost
  mouse.press(BTN_RIGHT, true);
  for (int i = 0; i < 2000; ++i) {  // more than the kernel keeps
    mouse.move(REL_X, i % 2 == 0 ? 1 : -1);
  }
  pass(3);
  EXPECT_EQ(state.buttons, hal::kButtonInject);
  mouse.press(BTN_RIGHT, false);
  mouse.move(REL_X, 4);
  const double before_m = state.position_m.x();
  pass(300);
  EXPECT_EQ(state.buttons, 0U);
  EXPECT_NEAR(state.position_m.x() - before_m, 1e-4, 60e-6);
}

TEST_F(InputLoopback, after_lost_events_it_asks_where_each_stick_is) {
  const VirtualInput pad(gamepad_model());
  open(pad);
  for (const int axis : {ABS_X, ABS_Y, ABS_RY}) {
    for (const int place : {kStickMax, 0}) {
      for (int i = 0; i < 2000; ++i) {
        pad.deflect(ABS_RX, i);
        if (i == 1000) {
          pad.deflect(axis, place);  // this is lost
        }
      }
      pass(200);
      const double fastest_m_s = pass(100);
      if (place == 0) {
        EXPECT_LT(fastest_m_s, 2e-5) << axis;
      } else {
        EXPECT_GT(fastest_m_s, 5e-3) << axis;
      }
    }
  }
}

TEST_F(InputLoopback, a_movement_that_waited_too_long_is_not_made_late) {
  const VirtualInput mouse(mouse_model());
  open(mouse);
  mouse.move(REL_X, 40);
  mouse.press(BTN_LEFT, true);
  clock.sleep_until_ns(clock.now_ns() + 80 * kTick_ns);
  pass(200);
  EXPECT_EQ(state.position_m.x(), 0);
  EXPECT_EQ(state.buttons, hal::kButtonEnable);
  mouse.move(REL_X, 40);
  clock.sleep_until_ns(clock.now_ns() + 20 * kTick_ns);
  pass(400);
  EXPECT_NEAR(state.position_m.x(), 1e-3, 1e-12);
}

TEST_F(InputLoopback, the_deflection_of_a_stick_is_a_speed_outside_its_dead_zone) {
  const VirtualInput pad(gamepad_model());
  open(pad);
  pad.deflect(ABS_X, static_cast<int>(0.14 * kStickMax));
  pass(200);
  EXPECT_EQ(state.position_m.x(), 0);
  pad.deflect(ABS_X, kStickMax);
  pass(300);
  const double from_m = state.position_m.x();
  const std::int64_t from_ns = state.sample_ns;
  const double fastest_m_s = pass(500);
  const double mean_m_s =
      (state.position_m.x() - from_m) / (1e-9 * static_cast<double>(state.sample_ns - from_ns));
  EXPECT_NEAR(mean_m_s, params.speed_m_s, 1e-3 * params.speed_m_s);
  EXPECT_LT(fastest_m_s, params.speed_m_s * 1.001);
  pad.deflect(ABS_X, 0);
  pad.deflect(ABS_Y, -kStickMax);  // pushed away
  pad.deflect(ABS_RY, kStickMax);
  pass(300);
  EXPECT_GT(state.position_m.y(), 5e-3);
  EXPECT_LT(state.position_m.z(), -5e-3);
  pad.press(BTN_TR, true);
  pad.press(BTN_SOUTH, true);
  pass(1);
  EXPECT_EQ(state.buttons, hal::kButtonEnable | hal::kButtonInject);
}

TEST_F(InputLoopback, a_knob_that_tells_its_deflection_again_and_again_is_a_speed_too) {
  const VirtualInput knob(knob_model());
  open(knob);
  std::int64_t next_ns = clock.now_ns();
  for (int i = 0; i < 50; ++i) {  // 100 times a second
    knob.emit(EV_REL, REL_X, 350);
    knob.emit(EV_REL, REL_Z, -350);  // lifted
    knob.emit(EV_REL, REL_Y, 40);    // within the dead zone
    knob.report();
    clock.sleep_until_ns(next_ns += 10 * kTick_ns);
    EXPECT_EQ(read(), Status::ok);
  }
  pass(300);
  EXPECT_NEAR(state.position_m.x(), 0.5 * params.speed_m_s / std::sqrt(2), 5e-3);
  EXPECT_NEAR(state.position_m.y(), state.position_m.x(), 1e-9);
  EXPECT_EQ(state.position_m.z(), 0);
  knob.press(BTN_0, true);
  pass(1);
  EXPECT_EQ(state.buttons, hal::kButtonEnable);
}

TEST_F(InputLoopback, what_is_held_from_the_beginning_is_told_as_held) {
  const VirtualInput mouse(mouse_model());
  mouse.press(BTN_LEFT, true);
  open(mouse);
  EXPECT_EQ(state.buttons, hal::kButtonEnable);
}

TEST_F(InputLoopback, the_desktop_gets_nothing_of_it_until_it_is_closed) {
  const VirtualInput mouse(mouse_model());
  const int desktop = ::open(mouse.path().c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(desktop, 0);
  open(mouse);
  mouse.press(BTN_LEFT, true);
  mouse.press(BTN_LEFT, false);
  input_event event{};
  EXPECT_LT(::read(desktop, &event, sizeof(event)), 0);
  EXPECT_EQ(refusal(), mouse.path() + ": \"Test Mouse\" is taken by another program that keeps it to itself");
  hand->close();
  mouse.press(BTN_LEFT, true);
  EXPECT_EQ(::read(desktop, &event, sizeof(event)), static_cast<ssize_t>(sizeof(event)));
  EXPECT_EQ(refusal(), "it opened");
  ::close(desktop);
}

TEST_F(InputLoopback, without_a_path_it_is_the_only_one_there_is) {
  EXPECT_EQ(
      refusal(),
      "no mouse, gamepad or SpaceMouse in /dev/input, allowed: plug one in, or say which in evdev.path");
  const VirtualInput keyboard(keyboard_model());
  EXPECT_NE(refusal(), "it opened");
  const VirtualInput mouse(mouse_model());
  EXPECT_EQ(refusal(), "it opened");
  const VirtualInput pad(gamepad_model());
  EXPECT_EQ(refusal(), "several devices can be the hand: " + mouse.path() + " (Test Mouse), " + pad.path() +
                           " (Test Pad), allowed: one of them as evdev.path");
  params.name = "Pad";
  EXPECT_EQ(refusal(), "it opened");
  params.name = "Joystick";
  EXPECT_EQ(refusal(),
            "no mouse, gamepad or SpaceMouse called \"Joystick\" in /dev/input, allowed: plug one in, or say "
            "which in evdev.path");
}

TEST_F(InputLoopback, says_in_one_line_why_a_device_cannot_be_the_hand) {
  const VirtualInput keyboard(keyboard_model()), mouse(mouse_model());
  params.path = keyboard.path();
  EXPECT_EQ(refusal(),
            keyboard.path() + ": \"Test Keyboard\" is neither a mouse, a gamepad nor a SpaceMouse");
  params.path = "/dev/input/event77";
  EXPECT_EQ(refusal(),
            "/dev/input/event77: No such file or directory, allowed for evdev.path: an input device "
            "(/proc/bus/input/devices lists them)");
  params.path = "/dev/null";
  EXPECT_EQ(refusal().find("/dev/null: "), 0U) << refusal();
  params.path = mouse.path();
  ASSERT_EQ(seteuid(1000), 0);
  const std::string not_allowed = refusal();
  params.path.clear();
  const std::string none_allowed = refusal();
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(not_allowed,
            mouse.path() + ": this user may not read it: sudo usermod -aG input $USER, and log in again");
  EXPECT_EQ(none_allowed.substr(none_allowed.find(':')), not_allowed.substr(not_allowed.find(':')));
}

// ---- the whole core, on the simulated station ----

// What somebody at the mouse or the gamepad sees.
struct View {
  double t_s = 0;
  Phase phase = Phase::free;
  bool running = false;  // no stop is latched
  sim::Truth truth;
};

// Fingers on a device: a wanted velocity of the hand, and buttons.
class Fingers {
 public:
  virtual ~Fingers() = default;
  virtual void move(const Vec3& velocity_m_s, double for_s) = 0;
  virtual void enable(bool down) = 0;
  virtual void inject(bool down) = 0;
  virtual void unplug() = 0;
  [[nodiscard]] virtual const std::string& path() const = 0;
};

class AtTheMouse final : public Fingers {
 public:
  void move(const Vec3& velocity_m_s, double for_s) override {
    owed_m_ += for_s * velocity_m_s;
    const int x = static_cast<int>(owed_m_.x() / kCount_m), y = static_cast<int>(owed_m_.y() / kCount_m);
    owed_m_ -= kCount_m * Vec3(x, y, 0);
    if (x != 0 || y != 0) {
      mouse_.emit(EV_REL, REL_X, x);
      mouse_.emit(EV_REL, REL_Y, -y);
      mouse_.report();
    }
  }
  void enable(bool down) override { mouse_.press(BTN_LEFT, down); }
  void inject(bool down) override { mouse_.press(BTN_RIGHT, down); }
  void unplug() override { mouse_.unplug(); }
  [[nodiscard]] const std::string& path() const override { return mouse_.path(); }

 private:
  static constexpr double kCount_m = 25e-6;  // evdev.count_um of the scene
  VirtualInput mouse_{mouse_model()};
  Vec3 owed_m_ = Vec3::Zero();
};

class AtTheGamepad final : public Fingers {
 public:
  void move(const Vec3& velocity_m_s, double /*for_s*/) override {
    deflect(ABS_X, velocity_m_s.x());
    deflect(ABS_Y, -velocity_m_s.y());
  }
  void enable(bool down) override { pad_.press(BTN_TR, down); }
  void inject(bool down) override { pad_.press(BTN_SOUTH, down); }
  void unplug() override { pad_.unplug(); }
  [[nodiscard]] const std::string& path() const override { return pad_.path(); }

 private:
  // As far as the eye says: the needle's own speed follows from the square of what is beyond the dead zone.
  void deflect(int axis, double speed_m_s) {
    constexpr double kFull_m_s = 0.1, kDeadZone = 0.15;
    const double part = std::sqrt(std::min(std::abs(speed_m_s) / kFull_m_s, 1.0));
    const double deflection = part < 0.02 ? 0 : kDeadZone + part * (1 - kDeadZone);
    pad_.deflect(axis, static_cast<int>(std::copysign(deflection, speed_m_s) * kStickMax));
  }
  VirtualInput pad_{gamepad_model()};
};

// Somebody performs one injection, by what is seen: to the membrane, through it, inject, and out again.
class Somebody {
 public:
  explicit Somebody(Fingers& fingers) : fingers_(fingers) {}

  void act(const View& view, double for_s) {
    if (view.t_s > 0.1 && !holds_) {
      fingers_.enable(holds_ = true);
    }
    if (view.t_s < 0.3) {
      return;
    }
    const Vec3 across_m(0, view.truth.tip_m.y() - view.truth.centre_m.y(), 0);
    Vec3 wanted_m_s = -1.0 * across_m;  // of the needle, world frame
    const bool outside = view.phase == Phase::free || view.phase == Phase::withdrawal;
    if (injected_s_ > kDose_s) {
      wanted_m_s.x() = 60e-6;
    } else if (view.truth.punctured && through_s_ > 0.5) {
      wanted_m_s.setZero();
    } else {
      wanted_m_s.x() = outside && view.truth.gap_m > 8e-6 ? -100e-6 : -20e-6;
    }
    through_s_ += view.truth.punctured ? for_s : 0;
    const bool inject = through_s_ > 0.8 && injected_s_ <= kDose_s;
    if (inject != injects_) {
      fingers_.inject(injects_ = inject);
    }
    injected_s_ += inject ? for_s : 0;
    fingers_.move(
        view.phase == Phase::clear ? Vec3(Vec3::Zero()) : Vec3(kScale * hand_from_world(wanted_m_s)), for_s);
  }

 private:
  static constexpr double kScale = 500;  // mapping.position_scale of the scene
  static constexpr double kDose_s = 0.6;
  Fingers& fingers_;
  bool holds_ = false, injects_ = false;
  double through_s_ = 0, injected_s_ = 0;
};

class HandsOn : public testing::Test {
 protected:
  HandsOn() {
    const sched_param core{80};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &core);
  }
  ~HandsOn() override {
    assembly.reset();
    const sched_param ordinary{0};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  }

  // The scene, for at most so long; `act` is what somebody does, every 8 ms. Ends with the task.
  void run(const Fingers& fingers, double seconds, const std::function<void(const View&, double)>& act) {
    act_ = &act;
    auto loaded = tools::load_scene("hands-on", {"evdev.path=" + fingers.path(), "vision.method=truth"});
    ASSERT_TRUE(loaded) << loaded.error();
    scene = std::move(*loaded);
    auto opened = tools::Assembly::open({scene, clock, nullptr});
    ASSERT_TRUE(opened) << opened.error();
    assembly = std::move(*opened);
    last_tick = static_cast<std::uint64_t>(seconds * 1e3);
    const std::int64_t first_ns = clock.now_ns() + 20 * kTick_ns;
    ASSERT_TRUE(assembly->start(first_ns));
    servo = std::make_unique<rt::Servo>(scene.servo, assembly->devices(), station->station);
    const std::vector<rt::Slot> slots = {
        rt::slot<&HandsOn::step_plant>("plant", *this), rt::slot<&HandsOn::act>("person", *this, 8),
        rt::slot<&HandsOn::look>("vision", *this, 40), rt::slot<&HandsOn::tick_servo>("servo", *this)};
    rt::ExecutiveConfig config;
    config.start_ns = first_ns;
    rt::Executive executive(clock, clock, config, slots, station->core.status);
    const std::atomic<bool> never{false};
    EXPECT_EQ(executive.run(never), rt::Executive::Ended::by_slot);
  }

  [[nodiscard]] sim::Truth truth() const { return sim::truth_of(*scene.sim, assembly->world()->snapshot()); }
  rt::After step_plant(const rt::Tick& tick) noexcept {
    assembly->world()->step(tick.wake_ns);
    return rt::After::go_on;
  }
  rt::After act(const rt::Tick& tick) noexcept {
    const rt::TelemetrySample& s = servo->sample();
    (*act_)({1e-3 * static_cast<double>(tick.index), s.phase, s.stop == rt::StopStage::running, truth()},
            8e-3);
    return rt::After::go_on;
  }
  rt::After look(const rt::Tick& tick) noexcept {
    const sim::Truth now = truth();
    station->observation.slot.push(
        tools::observe_truth(now, tick.index / 40, assembly->world()->snapshot().t_ns, before_));
    before_ = now;
    return rt::After::go_on;
  }
  rt::After tick_servo(const rt::Tick& tick) noexcept {
    servo->tick(tick.info());
    missed = tick.missed;
    ++ticks;
    const rt::TelemetrySample& s = servo->sample();
    const Vec3 hand_m(s.x_m[0], s.x_m[1], s.x_m[2]);
    largest_step_m = ticks > 1 ? std::max(largest_step_m, (hand_m - hand_m_).norm()) : 0;
    hand_m_ = hand_m;
    phases.insert(s.phase);
    most_N = std::max(most_N, Vec3(s.force_N[0], s.force_N[1], s.force_N[2]).norm());
    alarms |= s.alarms;
    if (s.fault != Fault::none && fault == Fault::none) {
      fault = s.fault;
      fault_tick = tick.index;
    }
    return servo->outcome() != rt::RunEnd::running || tick.index >= last_tick ? rt::After::end
                                                                              : rt::After::go_on;
  }

  rt::MonotonicClock clock;
  tools::Scene scene;
  std::unique_ptr<tools::Assembly> assembly;
  std::unique_ptr<rt::LocalStation> station = std::make_unique<rt::LocalStation>();
  std::unique_ptr<rt::Servo> servo;
  std::uint64_t last_tick = 0, ticks = 0, missed = 0, fault_tick = 0;
  Fault fault = Fault::none;
  std::set<Phase> phases;
  double most_N = 0, largest_step_m = 0;
  std::uint32_t alarms = 0;

 private:
  const std::function<void(const View&, double)>* act_ = nullptr;
  std::optional<sim::Truth> before_;
  Vec3 hand_m_ = Vec3::Zero();
};

template <class Kind>
class Injection : public HandsOn {};
using Kinds = testing::Types<AtTheMouse, AtTheGamepad>;
TYPED_TEST_SUITE(Injection, Kinds);

TYPED_TEST(Injection, is_performed_from_the_approach_to_the_end_of_the_task) {
  TypeParam fingers;
  Somebody somebody(fingers);
  this->run(fingers, 20, [&](const View& view, double for_s) { somebody.act(view, for_s); });
  EXPECT_EQ(this->servo->outcome(), rt::RunEnd::done);
  EXPECT_EQ(this->fault, Fault::none) << rt::name(this->fault);
  EXPECT_EQ(this->phases.size(), 7U);
  EXPECT_EQ(this->missed, 0U);
  EXPECT_GT(this->most_N, 0.1);
  EXPECT_LT(this->largest_step_m, 0.11e-3);  // evdev.speed_mm_s = 100
  EXPECT_EQ(this->alarms & rt::alarm_sensor, 0U);
  EXPECT_FALSE(this->truth().lost);
  EXPECT_GT(this->assembly->world()->snapshot().injector.delivered_s, 0.4);
  std::printf("done after %.1f s, at most %.2f N shown\n", 1e-3 * static_cast<double>(this->ticks),
              this->most_N);
}

TEST_F(HandsOn, a_hand_that_rests_for_seconds_is_no_fault) {
  AtTheMouse fingers;
  bool pressed = false;
  run(fingers, 3, [&](const View& view, double) {
    if (view.t_s > 0.1 && !pressed) {
      fingers.enable(pressed = true);
    }
  });
  EXPECT_EQ(fault, Fault::none) << rt::name(fault);
  EXPECT_TRUE(assembly->world()->snapshot().stage.tip_m.vec().allFinite());
  EXPECT_EQ(alarms & rt::alarm_sensor, 0U);
}

TEST_F(HandsOn, nothing_moves_while_the_button_is_not_held_and_letting_it_go_stops) {
  AtTheMouse fingers;
  const Vec3 start_m = tools::load_scene("hands-on")->sim->stage.start_m;
  double moved_before_m = 0, moved_m = 0;
  int step = 0;
  run(fingers, 2, [&](const View& view, double for_s) {
    fingers.move(Vec3(-0.05, 0, 0), for_s);
    double& moved = step == 0 ? moved_before_m : moved_m;
    moved = std::max(moved, (view.truth.tip_m - start_m).norm());
    if (step < 2 && view.t_s > (step == 0 ? 0.5 : 1.0)) {
      fingers.enable(step++ == 0);
    }
  });
  EXPECT_LT(moved_before_m, 0.5e-6);
  EXPECT_GT(moved_m, 20e-6);
  EXPECT_EQ(fault, Fault::enabling_released);
  EXPECT_EQ(servo->stop_stage(), rt::StopStage::stopped);
}

TEST_F(HandsOn, unplugged_in_the_cell_it_stops_at_once_and_nothing_moves_afterwards) {
  AtTheMouse fingers;
  Somebody somebody(fingers);
  std::uint64_t unplugged_tick = 0;
  std::optional<Vec3> rests_m;
  double moved_m = 0;
  run(fingers, 12, [&](const View& view, double for_s) {
    if (unplugged_tick == 0 && view.truth.wd_m > 5e-6) {
      fingers.unplug();
      unplugged_tick = ticks;
    }
    if (unplugged_tick == 0) {
      somebody.act(view, for_s);
    } else if (ticks > unplugged_tick + 200) {
      rests_m = rests_m.value_or(view.truth.tip_m);
      moved_m = std::max(moved_m, (view.truth.tip_m - *rests_m).norm());
      last_tick = unplugged_tick + 1500;
    }
  });
  ASSERT_GT(unplugged_tick, 0U);
  EXPECT_EQ(fault, Fault::hand_lost);
  EXPECT_LE(fault_tick, unplugged_tick + 1);
  EXPECT_EQ(servo->stop_stage(), rt::StopStage::stopped);
  ASSERT_TRUE(rests_m);
  EXPECT_LT(moved_m, 0.2e-6);
  EXPECT_EQ(assembly->world()->snapshot().injector.gate, 0U);
}

}  // namespace
}  // namespace punctum::loopback
