// The backend gpiod against the kernel's GPIO code and the simulated chip behind it.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <thread>

#include "hal/gpiod/gpiod_devices.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tests/loopback/gpiod_wiring.hpp"

namespace punctum::loopback {
namespace {

using gpiod::GpiodDevices;
using gpiod::GpiodParams;
using hal::Status;

constexpr gpiod::GpiodParts kAll{true, true, true, true};

class GpiodLoopback : public testing::Test {
 protected:
  // Opened, with contacts that are closed.
  void open() {
    devices.reset();
    devices = std::make_unique<GpiodDevices>(params, kAll, clock);
    const auto opened = devices->open();
    ASSERT_TRUE(opened) << opened.error();
    ASSERT_TRUE(devices->start(0));
    for (const int contact : {kContactA, kContactB, kValve, kEnablingA, kEnablingB, kVacuumSwitch}) {
      close_contact(contact);
    }
    let_the_kernel_note_it();
    (void)read();
    (void)read_switch();
  }
  ~GpiodLoopback() override {
    if (devices) {
      devices->safe_state();
      devices->close();
    }
  }
  [[nodiscard]] bool closed_level() const { return params.contacts_closed == GpiodParams::Closed::high; }
  void close_contact(int line) const { board.drive(line, closed_level()); }
  void open_contact(int line) const { board.drive(line, !closed_level()); }
  // Both edges, one right after the other.
  void pulse(int line) const {
    open_contact(line);
    close_contact(line);
  }
  // The kernel's threads have noted the last edge. Edges that follow each other at once it may keep as one.
  void let_the_kernel_note_it() { clock.sleep_until_ns(clock.now_ns() + 5'000'000); }
  hal::EstopState read() {
    hal::EstopState state;
    EXPECT_EQ(devices->served().estop->read(state), Status::ok);
    return state;
  }
  Status estop_status() {
    hal::EstopState state;
    return devices->served().estop->read(state);
  }
  hal::EnablingState read_switch() {
    hal::EnablingState state;
    EXPECT_EQ(devices->served().enabling->read(state), Status::ok);
    return state;
  }
  double vacuum_Pa() {
    hal::VacuumState state;
    EXPECT_EQ(devices->served().vacuum->read(state), Status::ok);
    return state.pressure_Pa;
  }
  bool valve_open() {
    hal::InjectorState state;
    EXPECT_EQ(devices->served().injector->read(state), Status::ok);
    return state.open;
  }
  std::string refusal(const GpiodParams& of) {
    GpiodDevices refused(of, kAll, clock);
    const auto opened = refused.open();
    return opened ? "it opened" : opened.error();
  }

  rt::MonotonicClock clock;
  GpioSim board;
  GpiodParams params = wiring(board);
  std::unique_ptr<GpiodDevices> devices;
};

TEST_F(GpiodLoopback, reads_contacts_that_are_closed) {
  for (const auto closed : {GpiodParams::Closed::high, GpiodParams::Closed::low}) {
    params.contacts_closed = closed;
    open();
    const hal::EstopState state = read();
    EXPECT_TRUE(state.contact_a_closed);
    EXPECT_TRUE(state.contact_b_closed);
    EXPECT_FALSE(state.reset_pressed);
    EXPECT_FALSE(state.pulse_seen);
  }
}

TEST_F(GpiodLoopback, reads_each_contact_by_itself) {
  for (const auto closed : {GpiodParams::Closed::high, GpiodParams::Closed::low}) {
    params.contacts_closed = closed;
    open();
    for (unsigned i = 0; i < 16; ++i) {
      const unsigned pattern = i ^ (i >> 1U);  // one after the other
      const bool a = (pattern & 1U) != 0, b = (pattern & 2U) != 0, reset = (pattern & 4U) != 0;
      board.drive(kContactA, a == closed_level());
      board.drive(kContactB, b == closed_level());
      board.drive(kReset, reset == closed_level());
      const hal::EstopState state = read();
      EXPECT_EQ(state.contact_a_closed, a) << i;
      EXPECT_EQ(state.contact_b_closed, b) << i;
      EXPECT_EQ(state.reset_pressed, reset) << i;
    }
  }
}

// Nothing drives the lines: only the chip's own resistors, as with wires that are cut.
TEST_F(GpiodLoopback, reads_a_cut_wire_as_open_with_either_wiring) {
  for (const auto closed : {GpiodParams::Closed::high, GpiodParams::Closed::low}) {
    params.contacts_closed = closed;
    for (int line = 0; line < GpioSim::kLines; ++line) {
      board.drive(line, closed_level());  // what the wires were before
    }
    devices = std::make_unique<GpiodDevices>(params, kAll, clock);
    ASSERT_TRUE(devices->open());
    const hal::EstopState state = read();
    EXPECT_FALSE(state.contact_a_closed);
    EXPECT_FALSE(state.contact_b_closed);
    EXPECT_FALSE(state.reset_pressed);
    EXPECT_TRUE(valve_open());
    EXPECT_FALSE(read_switch().contact_a_closed);
    EXPECT_FALSE(read_switch().contact_b_closed);
    EXPECT_EQ(vacuum_Pa(), 0);
    devices->close();
  }
}

TEST_F(GpiodLoopback, leaves_the_level_to_the_resistors_of_the_board) {
  params.pull = GpiodParams::Pull::external;
  board.drive(kContactA, true);
  board.drive(kContactB, false);
  devices = std::make_unique<GpiodDevices>(params, kAll, clock);
  ASSERT_TRUE(devices->open());
  EXPECT_TRUE(read().contact_a_closed);
  EXPECT_FALSE(read().contact_b_closed);
}

TEST_F(GpiodLoopback, dates_a_reading_between_its_call_and_its_return) {
  open();
  for (int i = 0; i < 100; ++i) {
    const std::int64_t before_ns = clock.now_ns();
    const hal::EstopState state = read();
    hal::InjectorState injector;
    ASSERT_EQ(devices->served().injector->read(injector), Status::ok);
    EXPECT_GE(state.sample_ns, before_ns);
    EXPECT_GE(injector.sample_ns, state.sample_ns);
    EXPECT_LE(injector.sample_ns, clock.now_ns());
  }
}

TEST_F(GpiodLoopback, sees_a_pulse_shorter_than_the_time_between_readings_once) {
  for (const auto closed : {GpiodParams::Closed::high, GpiodParams::Closed::low}) {
    params.contacts_closed = closed;
    open();
    for (const int contact : {kContactA, kContactB}) {
      for (int i = 0; i < 20; ++i) {
        pulse(contact);
        let_the_kernel_note_it();
        const hal::EstopState state = read();
        EXPECT_TRUE(state.pulse_seen) << contact << ": " << i;
        EXPECT_TRUE(state.contact_a_closed);
        EXPECT_TRUE(state.contact_b_closed);
        EXPECT_FALSE(read().pulse_seen);
      }
    }
  }
}

TEST_F(GpiodLoopback, sees_a_pulse_of_both_contacts) {
  open();
  open_contact(kContactA);
  open_contact(kContactB);
  close_contact(kContactB);
  close_contact(kContactA);
  let_the_kernel_note_it();
  EXPECT_TRUE(read().pulse_seen);
  EXPECT_FALSE(read().pulse_seen);
}

TEST_F(GpiodLoopback, takes_no_pulse_from_the_reset_button) {
  open();
  board.drive(kReset, true);
  board.drive(kReset, false);
  let_the_kernel_note_it();
  EXPECT_FALSE(read().pulse_seen);
}

TEST_F(GpiodLoopback, takes_an_opening_and_a_later_closing_for_no_pulse) {
  open();
  for (int i = 0; i < 20; ++i) {
    open_contact(kContactA);
    let_the_kernel_note_it();
    hal::EstopState state = read();
    EXPECT_FALSE(state.contact_a_closed);
    EXPECT_FALSE(state.pulse_seen);
    close_contact(kContactA);
    let_the_kernel_note_it();
    state = read();
    EXPECT_TRUE(state.contact_a_closed);
    EXPECT_FALSE(state.pulse_seen);
  }
}

TEST_F(GpiodLoopback, ends_open_after_a_contact_that_bounces_while_it_opens) {
  open();
  for (int i = 0; i < 4; ++i) {
    pulse(kContactB);
  }
  open_contact(kContactB);
  EXPECT_FALSE(read().contact_b_closed);
  EXPECT_FALSE(read().contact_b_closed);
}

TEST_F(GpiodLoopback, tells_that_a_contact_bounced_while_it_closed) {
  open();
  open_contact(kContactB);
  let_the_kernel_note_it();
  EXPECT_FALSE(read().contact_b_closed);
  close_contact(kContactB);
  let_the_kernel_note_it();
  pulse(kContactB);
  let_the_kernel_note_it();
  const hal::EstopState state = read();
  EXPECT_TRUE(state.contact_b_closed);
  EXPECT_TRUE(state.pulse_seen);
  EXPECT_FALSE(read().pulse_seen);
}

TEST_F(GpiodLoopback, reads_a_stuck_contact_as_closed_beside_one_that_opens) {
  open();
  open_contact(kContactB);
  for (int i = 0; i < 10; ++i) {
    const hal::EstopState state = read();
    EXPECT_TRUE(state.contact_a_closed);
    EXPECT_FALSE(state.contact_b_closed);
  }
}

TEST_F(GpiodLoopback, believes_the_level_after_more_changes_than_the_kernel_keeps) {
  open();
  for (const bool ends_closed : {false, true, false}) {
    for (int i = 0; i < 100; ++i) {
      pulse(kContactA);
    }
    board.drive(kContactA, ends_closed == closed_level());
    let_the_kernel_note_it();
    EXPECT_EQ(read().contact_a_closed, ends_closed);
    EXPECT_EQ(read().contact_a_closed, ends_closed);
    EXPECT_FALSE(read().pulse_seen);
    close_contact(kContactA);
    let_the_kernel_note_it();
    (void)read();
    EXPECT_FALSE(read().pulse_seen);
  }
}

TEST_F(GpiodLoopback, sees_a_pulse_again_after_the_kernels_memory_overflowed) {
  open();
  for (int i = 0; i < 100; ++i) {
    pulse(kContactA);
  }
  let_the_kernel_note_it();
  EXPECT_TRUE(read().pulse_seen);
  EXPECT_FALSE(read().pulse_seen);
  pulse(kContactA);
  let_the_kernel_note_it();
  EXPECT_TRUE(read().pulse_seen);
}

TEST_F(GpiodLoopback, reads_the_reset_button_while_it_is_pressed) {
  open();
  EXPECT_FALSE(read().reset_pressed);
  board.drive(kReset, true);
  EXPECT_TRUE(read().reset_pressed);
  EXPECT_TRUE(read().reset_pressed);
  board.drive(kReset, false);
  EXPECT_FALSE(read().reset_pressed);
}

TEST_F(GpiodLoopback, shows_the_heartbeat_on_its_line) {
  open();
  EXPECT_FALSE(board.level(kHeartbeat));
  for (int i = 0; i < 50; ++i) {
    devices->served().estop->heartbeat(i % 2 == 0);
    EXPECT_EQ(board.level(kHeartbeat), i % 2 == 0);
    EXPECT_FALSE(board.level(kGate));
  }
}

TEST_F(GpiodLoopback, shows_the_gate_on_its_line_with_either_level) {
  for (const auto opens_at : {GpiodParams::Level::high, GpiodParams::Level::low}) {
    params.gate_opens_at = opens_at;
    open();
    const bool high = opens_at == GpiodParams::Level::high;
    EXPECT_EQ(board.level(kGate), !high);
    devices->served().injector->gate(true);
    EXPECT_EQ(board.level(kGate), high);
    EXPECT_FALSE(board.level(kHeartbeat));
    devices->served().injector->gate(false);
    EXPECT_EQ(board.level(kGate), !high);
  }
}

TEST_F(GpiodLoopback, reads_the_valve_by_its_contact) {
  open();
  EXPECT_FALSE(valve_open());
  devices->served().injector->gate(true);
  EXPECT_FALSE(valve_open());
  open_contact(kValve);
  EXPECT_TRUE(valve_open());
  devices->served().injector->gate(false);
  EXPECT_TRUE(valve_open());
  close_contact(kValve);
  EXPECT_FALSE(valve_open());
}

TEST_F(GpiodLoopback, reads_the_gate_back_where_the_valve_has_no_contact) {
  params.valve_contact = gpiod::kNotWired;
  for (const auto opens_at : {GpiodParams::Level::high, GpiodParams::Level::low}) {
    params.gate_opens_at = opens_at;
    open();
    EXPECT_FALSE(valve_open());
    devices->served().injector->gate(true);
    EXPECT_TRUE(valve_open());
    devices->served().injector->gate(false);
    EXPECT_FALSE(valve_open());
  }
}

TEST_F(GpiodLoopback, reads_each_contact_of_the_enabling_switch_by_itself) {
  for (const auto closed : {GpiodParams::Closed::high, GpiodParams::Closed::low}) {
    params.contacts_closed = closed;
    open();
    for (unsigned i = 0; i < 4; ++i) {
      const bool a = (i & 1U) != 0, b = (i & 2U) != 0;
      board.drive(kEnablingA, a == closed_level());
      board.drive(kEnablingB, b == closed_level());
      const hal::EnablingState state = read_switch();
      EXPECT_EQ(state.contact_a_closed, a) << i;
      EXPECT_EQ(state.contact_b_closed, b) << i;
    }
  }
}

TEST_F(GpiodLoopback, sees_the_enabling_switch_let_go_for_less_than_the_time_between_readings_once) {
  open();
  for (const int contact : {kEnablingA, kEnablingB}) {
    pulse(contact);
    let_the_kernel_note_it();
    const hal::EnablingState state = read_switch();
    EXPECT_TRUE(state.pulse_seen) << contact;
    EXPECT_TRUE(state.contact_a_closed && state.contact_b_closed);
    EXPECT_FALSE(read_switch().pulse_seen);
    EXPECT_FALSE(read().pulse_seen) << "of the emergency stop";
  }
}

TEST_F(GpiodLoopback, shows_the_enable_line_with_either_level_and_disables_in_the_safe_state) {
  for (const auto active_at : {GpiodParams::Level::high, GpiodParams::Level::low}) {
    params.enable_active_at = active_at;
    const bool high = active_at == GpiodParams::Level::high;
    board.drive(kEnable, high);
    open();
    EXPECT_EQ(board.level(kEnable), !high);
    devices->served().estop->drive_power(true);
    EXPECT_EQ(board.level(kEnable), high);
    EXPECT_FALSE(board.level(kHeartbeat));
    devices->served().estop->drive_power(false);
    EXPECT_EQ(board.level(kEnable), !high);
    devices->served().estop->drive_power(true);
    devices->safe_state();
    EXPECT_EQ(board.level(kEnable), !high);
  }
}

TEST_F(GpiodLoopback, reads_the_vacuum_by_its_switch) {
  open();
  EXPECT_EQ(vacuum_Pa(), 20'000);
  open_contact(kVacuumSwitch);
  EXPECT_EQ(vacuum_Pa(), 0);
  close_contact(kVacuumSwitch);
  EXPECT_EQ(vacuum_Pa(), 20'000);
}

TEST_F(GpiodLoopback, holds_the_vacuum_from_the_moment_it_opens_through_the_safe_state_and_past_the_end) {
  for (const auto holds_at : {GpiodParams::Level::high, GpiodParams::Level::low}) {
    params.vacuum_holds_at = holds_at;
    const bool held = holds_at == GpiodParams::Level::high;
    board.drive(kVacuumGate, !held);
    open();
    EXPECT_EQ(board.level(kVacuumGate), held) << "against the resistor";
    devices->safe_state();
    EXPECT_EQ(board.level(kVacuumGate), held);
    board.drive(kVacuumGate, held);
    devices->close();
    EXPECT_EQ(board.level(kVacuumGate), held);
  }
}

// This chip leaves a line that nobody claims any more to the resistor.
TEST_F(GpiodLoopback, holds_the_vacuum_when_its_program_is_killed_and_a_resistor_pulls_to_hold) {
  int opened[2];
  ASSERT_EQ(pipe(opened), 0);
  const pid_t program = fork();
  ASSERT_GE(program, 0);
  if (program == 0) {
    GpiodDevices killed(params, kAll, clock);
    const char ok = killed.open() ? 'y' : 'n';
    (void)!write(opened[1], &ok, 1);
    for (;;) {
      pause();
    }
  }
  char ok = 0;
  ASSERT_EQ(::read(opened[0], &ok, 1), 1);
  EXPECT_EQ(ok, 'y');
  EXPECT_TRUE(board.level(kVacuumGate)) << "against the resistor";
  board.drive(kVacuumGate, true);
  ASSERT_EQ(kill(program, SIGKILL), 0);
  ASSERT_EQ(waitpid(program, nullptr, 0), program);
  EXPECT_EQ(refusal(params), "it opened");
  EXPECT_TRUE(board.level(kVacuumGate));
  close(opened[0]);
  close(opened[1]);
}

TEST_F(GpiodLoopback, has_its_outputs_off_from_the_moment_it_opens) {
  board.drive(kHeartbeat, true);
  board.drive(kGate, true);
  ASSERT_TRUE(board.level(kGate));
  open();
  EXPECT_FALSE(board.level(kHeartbeat));
  EXPECT_FALSE(board.level(kGate));
}

TEST_F(GpiodLoopback, switches_its_outputs_off_in_the_safe_state) {
  open();
  devices->served().estop->heartbeat(true);
  devices->served().injector->gate(true);
  ASSERT_TRUE(board.level(kHeartbeat));
  ASSERT_TRUE(board.level(kGate));
  devices->safe_state();
  EXPECT_FALSE(board.level(kHeartbeat));
  EXPECT_FALSE(board.level(kGate));
  devices->safe_state();
  EXPECT_FALSE(board.level(kGate));
}

TEST_F(GpiodLoopback, gives_its_lines_back_when_it_closes) {
  open();
  EXPECT_NE(refusal(params), "it opened");
  devices->close();
  EXPECT_EQ(refusal(params), "it opened");
}

TEST_F(GpiodLoopback, says_which_chip_is_missing) {
  params.chip = "/dev/gpiochip77";
  EXPECT_EQ(
      refusal(params),
      "/dev/gpiochip77: No such file or directory, allowed for gpiod.chip: the path of a GPIO chip that "
      "this user may use (gpiodetect lists them)");
}

TEST_F(GpiodLoopback, refuses_a_device_that_is_no_chip) {
  params.chip = "/dev/null";
  EXPECT_EQ(refusal(params).find("/dev/null: "), 0U) << refusal(params);
}

TEST_F(GpiodLoopback, says_which_line_is_busy) {
  open();
  const std::string busy = refusal(params);
  EXPECT_EQ(busy, "gpiod.heartbeat = 3: Device or resource busy, allowed: a line of " + board.path() +
                      " that nothing else uses and that can do this (gpioinfo lists them)");
}

TEST_F(GpiodLoopback, says_which_line_is_beyond_the_chip) {
  params.reset = GpioSim::kLines;
  EXPECT_EQ(refusal(params), "gpiod.reset = 16: no line of " + board.path() + ", allowed: 0 to 15");
}

TEST_F(GpiodLoopback, holds_no_line_after_it_failed_to_open) {
  GpiodParams last_is_wrong = params;
  last_is_wrong.valve_contact = GpioSim::kLines;
  GpiodDevices refused(last_is_wrong, kAll, clock);
  ASSERT_FALSE(refused.open());
  EXPECT_EQ(refusal(params), "it opened");
}

TEST_F(GpiodLoopback, says_disconnected_when_the_chip_is_gone) {
  open();
  devices->served().estop->heartbeat(true);
  devices->served().injector->gate(true);
  board.unplug();
  hal::InjectorState injector;
  EXPECT_EQ(estop_status(), Status::disconnected);
  EXPECT_EQ(devices->served().injector->read(injector), Status::disconnected);
  devices->served().estop->heartbeat(false);
  devices->served().injector->gate(false);
  EXPECT_EQ(estop_status(), Status::disconnected);
  EXPECT_EQ(devices->served().injector->read(injector), Status::disconnected);
  devices->safe_state();
  devices->close();
}

}  // namespace
}  // namespace punctum::loopback
