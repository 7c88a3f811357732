// The logic of the backend gpiod on lines of this test's own. The real ones: tests/loopback.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hal/gpiod/gpiod_devices.hpp"

namespace punctum::gpiod {
namespace {

using hal::Status;

struct Wire {
  bool level = false;  // as the chip sees it: high
  bool claimed = false;
  LineRequest request;
  int changes = 0;
  Status status = Status::ok;
  std::vector<bool> written;
};

struct Board {
  std::map<unsigned, Wire> wires;
  std::map<unsigned, LineFacts> facts;
  unsigned lines = 32;
  bool open = false;
  std::string refuses;             // to be opened
  int refused_offset = kNotWired;  // to be claimed
};

class BoardLine final : public Line {
 public:
  BoardLine(Wire& wire, const LineRequest& request) : wire_(wire) {
    wire_.claimed = true;
    wire_.request = request;
    if (is_output(request.use)) {
      wire_.level = (request.use == Use::held_output) != request.active_low;
    }
  }
  ~BoardLine() override { wire_.claimed = false; }
  Status read(bool& active) noexcept override {
    if (wire_.status == Status::ok) {
      active = wire_.level != wire_.request.active_low;
    }
    return wire_.status;
  }
  Status write(bool active) noexcept override {
    if (wire_.status == Status::ok) {
      wire_.level = active != wire_.request.active_low;
      wire_.written.push_back(active);
    }
    return wire_.status;
  }
  Status take_changes(int& changes) noexcept override {
    changes = wire_.changes;
    wire_.changes = 0;
    return wire_.status;
  }

 private:
  Wire& wire_;
};

class BoardChip final : public Chip {
 public:
  explicit BoardChip(Board& board) : board_(board) { board_.open = true; }
  ~BoardChip() override { board_.open = false; }
  unsigned line_count() const override { return board_.lines; }
  std::string label() const override { return "a board"; }
  LineFacts facts(unsigned offset) const override {
    const auto line = board_.facts.find(offset);
    return line == board_.facts.end() ? LineFacts{} : line->second;
  }
  tl::expected<std::unique_ptr<Line>, std::string> claim(const LineRequest& request) override {
    if (static_cast<int>(request.offset) == board_.refused_offset) {
      return tl::unexpected(std::string("Device or resource busy"));
    }
    return std::make_unique<BoardLine>(board_.wires[request.offset], request);
  }

 private:
  Board& board_;
};

struct StandingTime final : hal::Clock {
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return t_ns; }
  void sleep_until_ns(std::int64_t until_ns) noexcept override { t_ns = until_ns; }
  std::int64_t t_ns = 77;
};

constexpr unsigned kA = 1, kB = 2, kReset = 3, kHeartbeat = 4, kGate = 5, kValve = 6, kEnablingA = 7,
                   kEnablingB = 8, kEnable = 9, kVacuumGate = 10, kVacuumSwitch = 11;

class GpiodTest : public testing::Test {
 protected:
  GpiodTest() {
    params.contact_a = kA;
    params.contact_b = kB;
    params.reset = kReset;
    params.heartbeat = kHeartbeat;
    params.gate = kGate;
    params.valve_contact = kValve;
    params.enabling_a = kEnablingA;
    params.enabling_b = kEnablingB;
    params.enable = kEnable;
    params.vacuum_gate = kVacuumGate;
    params.vacuum_switch = kVacuumSwitch;
    params.vacuum_switch_Pa = 20'000;
  }
  // With contacts that are closed, for either wiring.
  tl::expected<void, std::string> open(GpiodParts parts = {true, true, true, true}) {
    const bool high = params.contacts_closed == GpiodParams::Closed::high;
    for (const unsigned line : {kA, kB, kValve, kEnablingA, kEnablingB, kVacuumSwitch}) {
      board.wires[line].level = high;
    }
    board.wires[kReset].level = !high;
    devices = std::make_unique<GpiodDevices>(
        params, parts, clock,
        [this](const std::string& path) -> tl::expected<std::unique_ptr<Chip>, std::string> {
          opened = path;
          if (!board.refuses.empty()) {
            return tl::unexpected(board.refuses);
          }
          return std::make_unique<BoardChip>(board);
        });
    return devices->open();
  }
  hal::EstopState read() {
    hal::EstopState state;
    EXPECT_EQ(devices->served().estop->read(state), Status::ok);
    return state;
  }
  hal::EnablingState read_switch() {
    hal::EnablingState state;
    EXPECT_EQ(devices->served().enabling->read(state), Status::ok);
    return state;
  }
  Status estop_status() {
    hal::EstopState state;
    return devices->served().estop->read(state);
  }
  bool valve_open() {
    hal::InjectorState state;
    EXPECT_EQ(devices->served().injector->read(state), Status::ok);
    return state.open;
  }
  bool nothing_is_held() {
    for (const auto& [offset, wire] : board.wires) {
      if (wire.claimed) {
        return false;
      }
    }
    return !board.open;
  }

  GpiodParams params;
  Board board;
  StandingTime clock;
  std::string opened;
  std::unique_ptr<GpiodDevices> devices;
};

TEST_F(GpiodTest, reads_closed_contacts_with_the_time_of_the_reading) {
  params.chip = "/dev/gpiochip3";
  ASSERT_TRUE(open());
  EXPECT_EQ(opened, "/dev/gpiochip3");
  ASSERT_TRUE(devices->start(0));
  const hal::EstopState state = read();
  EXPECT_TRUE(state.contact_a_closed);
  EXPECT_TRUE(state.contact_b_closed);
  EXPECT_FALSE(state.reset_pressed);
  EXPECT_FALSE(state.pulse_seen);
  EXPECT_EQ(state.sample_ns, 77);
}

TEST_F(GpiodTest, tells_the_contacts_and_the_button_apart) {
  ASSERT_TRUE(open());
  board.wires[kA].level = false;
  EXPECT_FALSE(read().contact_a_closed);
  EXPECT_TRUE(read().contact_b_closed);
  board.wires[kA].level = true;
  board.wires[kB].level = false;
  EXPECT_TRUE(read().contact_a_closed);
  EXPECT_FALSE(read().contact_b_closed);
  board.wires[kReset].level = true;
  EXPECT_TRUE(read().reset_pressed);
}

TEST_F(GpiodTest, pulls_a_cut_wire_to_open_with_either_wiring) {
  ASSERT_TRUE(open());
  for (const unsigned input : {kA, kB, kReset, kValve, kEnablingA, kEnablingB, kVacuumSwitch}) {
    EXPECT_EQ(board.wires[input].request.bias, Bias::pull_down);
    EXPECT_FALSE(board.wires[input].request.active_low);
  }
  params.contacts_closed = GpiodParams::Closed::low;
  ASSERT_TRUE(open());
  for (const unsigned input : {kA, kB, kReset, kValve, kEnablingA, kEnablingB, kVacuumSwitch}) {
    EXPECT_EQ(board.wires[input].request.bias, Bias::pull_up);
    EXPECT_TRUE(board.wires[input].request.active_low);
  }
  EXPECT_TRUE(read().contact_a_closed);
  board.wires[kA].level = true;
  EXPECT_FALSE(read().contact_a_closed);
}

TEST_F(GpiodTest, leaves_the_bias_to_the_resistors_of_the_board_where_there_are_some) {
  params.pull = GpiodParams::Pull::external;
  ASSERT_TRUE(open());
  for (const unsigned input : {kA, kB, kReset, kValve, kEnablingA, kEnablingB, kVacuumSwitch}) {
    EXPECT_EQ(board.wires[input].request.bias, Bias::as_it_is);
  }
}

TEST_F(GpiodTest, has_the_kernel_keep_the_changes_of_both_contacts) {
  ASSERT_TRUE(open());
  EXPECT_EQ(board.wires[kA].request.use, Use::watched_input);
  EXPECT_EQ(board.wires[kB].request.use, Use::watched_input);
}

TEST_F(GpiodTest, sees_a_pulse_between_two_readings_once) {
  ASSERT_TRUE(open());
  read();
  for (const unsigned contact : {kA, kB}) {
    for (const int changes : {1, 2, 16}) {
      board.wires[contact].changes = changes;
      EXPECT_TRUE(read().pulse_seen) << contact << ": " << changes;
      EXPECT_FALSE(read().pulse_seen);
    }
  }
}

TEST_F(GpiodTest, takes_a_plain_closing_for_no_pulse_and_a_bounce_for_one) {
  ASSERT_TRUE(open());
  read();
  for (const int changes : {1, 3}) {
    board.wires[kB].level = false;
    board.wires[kB].changes = 1;
    EXPECT_FALSE(read().pulse_seen);
    board.wires[kB].level = true;
    board.wires[kB].changes = changes;
    EXPECT_EQ(read().pulse_seen, changes > 1);
  }
}

TEST_F(GpiodTest, believes_the_level_where_the_kernel_kept_no_change) {
  ASSERT_TRUE(open());
  read();
  board.wires[kA].level = false;
  EXPECT_FALSE(read().contact_a_closed);
}

TEST_F(GpiodTest, gives_no_reading_when_a_line_of_the_chain_fails) {
  ASSERT_TRUE(open());
  for (const unsigned line : {kA, kB, kReset, kHeartbeat}) {
    for (const Status status : {Status::disconnected, Status::fault}) {
      board.wires[line].status = status;
      devices->served().estop->heartbeat(true);
      hal::EstopState state;
      state.contact_a_closed = state.contact_b_closed = false;
      EXPECT_EQ(devices->served().estop->read(state), status) << line;
      EXPECT_FALSE(state.contact_a_closed);
      board.wires[line].status = Status::ok;
      devices->served().estop->heartbeat(false);
      EXPECT_EQ(estop_status(), Status::ok);
    }
  }
}

TEST_F(GpiodTest, reads_the_two_contacts_of_the_enabling_switch_with_the_time_of_the_reading) {
  ASSERT_TRUE(open());
  hal::EnablingState state = read_switch();
  EXPECT_TRUE(state.contact_a_closed);
  EXPECT_TRUE(state.contact_b_closed);
  EXPECT_FALSE(state.pulse_seen);
  EXPECT_EQ(state.sample_ns, 77);
  board.wires[kEnablingA].level = false;
  state = read_switch();
  EXPECT_FALSE(state.contact_a_closed);
  EXPECT_TRUE(state.contact_b_closed);
  board.wires[kEnablingA].level = true;
  board.wires[kEnablingB].level = false;
  state = read_switch();
  EXPECT_TRUE(state.contact_a_closed);
  EXPECT_FALSE(state.contact_b_closed);
}

TEST_F(GpiodTest, sees_a_pulse_of_the_enabling_switch_between_two_readings_once) {
  ASSERT_TRUE(open());
  (void)read_switch();
  for (const unsigned contact : {kEnablingA, kEnablingB}) {
    EXPECT_EQ(board.wires[contact].request.use, Use::watched_input);
    board.wires[contact].changes = 1;
    EXPECT_TRUE(read_switch().pulse_seen) << contact;
    EXPECT_FALSE(read_switch().pulse_seen);
  }
}

TEST_F(GpiodTest, gives_no_reading_of_the_enabling_switch_when_one_of_its_lines_fails) {
  ASSERT_TRUE(open());
  for (const unsigned line : {kEnablingA, kEnablingB}) {
    for (const Status status : {Status::disconnected, Status::fault}) {
      board.wires[line].status = status;
      hal::EnablingState state;
      EXPECT_EQ(devices->served().enabling->read(state), status) << line;
      EXPECT_FALSE(state.contact_a_closed || state.contact_b_closed);
      board.wires[line].status = Status::ok;
    }
  }
}

TEST_F(GpiodTest, starts_with_every_output_off) {
  for (const auto gate : {GpiodParams::Level::high, GpiodParams::Level::low}) {
    params.gate_opens_at = gate;
    ASSERT_TRUE(open());
    EXPECT_EQ(board.wires[kHeartbeat].request.use, Use::output);
    EXPECT_EQ(board.wires[kGate].request.use, Use::output);
    EXPECT_FALSE(board.wires[kHeartbeat].level);
    EXPECT_EQ(board.wires[kGate].level, gate == GpiodParams::Level::low);
  }
}

TEST_F(GpiodTest, enables_the_drives_with_either_level_and_disables_them_in_the_safe_state) {
  for (const auto active_at : {GpiodParams::Level::high, GpiodParams::Level::low}) {
    params.enable_active_at = active_at;
    const bool on = active_at == GpiodParams::Level::high;
    board.wires[kEnable].level = on;  // as it was before
    ASSERT_TRUE(open());
    EXPECT_EQ(board.wires[kEnable].request.use, Use::output);
    EXPECT_EQ(board.wires[kEnable].level, !on);
    devices->served().estop->heartbeat(true);
    EXPECT_EQ(board.wires[kEnable].level, !on);
    devices->served().estop->drive_power(true);
    EXPECT_EQ(board.wires[kEnable].level, on);
    devices->served().estop->heartbeat(false);
    EXPECT_EQ(board.wires[kEnable].level, on);
    devices->served().estop->drive_power(false);
    EXPECT_EQ(board.wires[kEnable].level, !on);
    devices->served().estop->drive_power(true);
    devices->safe_state();
    EXPECT_EQ(board.wires[kEnable].level, !on);
    devices->served().estop->drive_power(true);
    devices->close();  // without safe_state() too
    EXPECT_EQ(board.wires[kEnable].level, !on);
    EXPECT_TRUE(nothing_is_held());
  }
}

TEST_F(GpiodTest, has_no_enable_line_where_none_is_wired_or_another_chain_stands_in_the_scene) {
  params.enable = kNotWired;
  ASSERT_TRUE(open());
  devices->served().estop->drive_power(true);
  EXPECT_EQ(estop_status(), Status::ok);
  params.enable = kEnable;
  ASSERT_TRUE(open({.injector = true}));
  EXPECT_FALSE(board.wires[kEnable].claimed);
}

TEST_F(GpiodTest, gives_no_reading_of_the_chain_when_the_enable_line_could_not_be_written) {
  ASSERT_TRUE(open());
  board.wires[kEnable].status = Status::disconnected;
  devices->served().estop->drive_power(false);
  EXPECT_EQ(estop_status(), Status::disconnected);
  devices->served().estop->heartbeat(true);
  EXPECT_EQ(estop_status(), Status::disconnected);
  board.wires[kEnable].status = Status::ok;
  devices->served().estop->drive_power(false);
  EXPECT_EQ(estop_status(), Status::ok);
}

TEST_F(GpiodTest, drives_heartbeat_and_gate) {
  ASSERT_TRUE(open());
  devices->served().estop->heartbeat(true);
  EXPECT_TRUE(board.wires[kHeartbeat].level);
  devices->served().estop->heartbeat(false);
  EXPECT_FALSE(board.wires[kHeartbeat].level);
  devices->served().injector->gate(true);
  EXPECT_TRUE(board.wires[kGate].level);
  devices->served().injector->gate(false);
  EXPECT_FALSE(board.wires[kGate].level);
}

TEST_F(GpiodTest, reads_the_valve_by_its_own_contact_whatever_the_gate_is) {
  ASSERT_TRUE(open());
  EXPECT_FALSE(valve_open());
  devices->served().injector->gate(true);
  EXPECT_FALSE(valve_open());
  board.wires[kValve].level = false;  // also a cut wire
  EXPECT_TRUE(valve_open());
  devices->served().injector->gate(false);
  EXPECT_TRUE(valve_open());
  hal::InjectorState state;
  ASSERT_EQ(devices->served().injector->read(state), Status::ok);
  EXPECT_EQ(state.sample_ns, 77);
}

TEST_F(GpiodTest, reads_the_gate_back_where_the_valve_has_no_contact) {
  params.valve_contact = kNotWired;
  params.gate_opens_at = GpiodParams::Level::low;
  ASSERT_TRUE(open());
  EXPECT_FALSE(valve_open());
  devices->served().injector->gate(true);
  EXPECT_TRUE(valve_open());
  board.wires[kGate].level = true;  // something else pulls it
  EXPECT_FALSE(valve_open());
}

TEST_F(GpiodTest, gives_no_reading_of_the_injector_when_one_of_its_lines_fails) {
  ASSERT_TRUE(open());
  for (const unsigned line : {kGate, kValve}) {
    board.wires[line].status = Status::disconnected;
    devices->served().injector->gate(false);
    hal::InjectorState state;
    EXPECT_EQ(devices->served().injector->read(state), Status::disconnected) << line;
    board.wires[line].status = Status::ok;
    devices->served().injector->gate(false);
  }
  EXPECT_FALSE(valve_open());
}

TEST_F(GpiodTest, returns_to_the_safe_state_and_gives_the_lines_back) {
  params.gate_opens_at = GpiodParams::Level::low;
  ASSERT_TRUE(open());
  devices->served().estop->heartbeat(true);
  devices->served().injector->gate(true);
  devices->safe_state();
  EXPECT_FALSE(board.wires[kHeartbeat].level);
  EXPECT_TRUE(board.wires[kGate].level);
  devices->served().estop->heartbeat(true);
  devices->served().injector->gate(true);
  devices->close();  // without safe_state() too
  EXPECT_FALSE(board.wires[kHeartbeat].level);
  EXPECT_TRUE(board.wires[kGate].level);
  EXPECT_TRUE(nothing_is_held());
}

TEST_F(GpiodTest, holds_the_vacuum_from_the_moment_it_opens_and_never_writes_its_gate_again) {
  for (const auto holds_at : {GpiodParams::Level::high, GpiodParams::Level::low}) {
    params.vacuum_holds_at = holds_at;
    const bool held = holds_at == GpiodParams::Level::high;
    board.wires[kVacuumGate].level = !held;
    board.wires[kVacuumGate].written.clear();
    ASSERT_TRUE(open());
    EXPECT_TRUE(board.wires[kVacuumGate].claimed);
    EXPECT_EQ(board.wires[kVacuumGate].level, held);
    devices->served().estop->drive_power(false);
    devices->safe_state();
    EXPECT_EQ(board.wires[kVacuumGate].level, held);
    devices->close();
    EXPECT_EQ(board.wires[kVacuumGate].level, held);
    EXPECT_TRUE(board.wires[kVacuumGate].written.empty());
    EXPECT_TRUE(nothing_is_held());
  }
}

TEST_F(GpiodTest, reads_the_vacuum_as_the_pressure_of_its_switch_or_none) {
  ASSERT_TRUE(open());
  hal::VacuumState state;
  ASSERT_EQ(devices->served().vacuum->read(state), Status::ok);
  EXPECT_EQ(state.pressure_Pa, 20'000);
  EXPECT_EQ(state.sample_ns, 77);
  board.wires[kVacuumSwitch].level = false;  // also a cut wire
  ASSERT_EQ(devices->served().vacuum->read(state), Status::ok);
  EXPECT_EQ(state.pressure_Pa, 0);
  board.wires[kVacuumSwitch].level = true;
  board.wires[kVacuumSwitch].status = Status::disconnected;
  EXPECT_EQ(devices->served().vacuum->read(state), Status::disconnected);
  EXPECT_EQ(state.pressure_Pa, 0);
}

TEST_F(GpiodTest, reads_a_vacuum_switch_without_a_gate) {
  params.vacuum_gate = kNotWired;
  ASSERT_TRUE(open({.vacuum = true}));
  hal::VacuumState state;
  EXPECT_EQ(devices->served().vacuum->read(state), Status::ok);
  EXPECT_EQ(state.pressure_Pa, 20'000);
  EXPECT_EQ(devices->served().estop, nullptr);
  EXPECT_FALSE(board.wires[kVacuumGate].claimed || board.wires[kA].claimed);
}

TEST_F(GpiodTest, claims_only_what_it_serves) {
  ASSERT_TRUE(open({.estop = true}));
  EXPECT_NE(devices->served().estop, nullptr);
  EXPECT_EQ(devices->served().injector, nullptr);
  EXPECT_FALSE(board.wires[kGate].claimed);
  EXPECT_FALSE(board.wires[kValve].claimed);
  devices->close();
  ASSERT_TRUE(open({.injector = true}));
  EXPECT_EQ(devices->served().estop, nullptr);
  EXPECT_NE(devices->served().injector, nullptr);
  for (const unsigned line :
       {kA, kB, kReset, kHeartbeat, kEnablingA, kEnablingB, kVacuumGate, kVacuumSwitch}) {
    EXPECT_FALSE(board.wires[line].claimed);
  }
  devices->close();
  ASSERT_TRUE(open({.enabling = true}));
  EXPECT_EQ(devices->served().estop, nullptr);
  EXPECT_NE(devices->served().enabling, nullptr);
  for (const unsigned line : {kA, kB, kReset, kHeartbeat, kGate, kValve}) {
    EXPECT_FALSE(board.wires[line].claimed);
  }
}

TEST_F(GpiodTest, says_in_one_line_why_it_does_not_open_and_holds_nothing) {
  board.refuses = "No such file or directory";
  auto result = open();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(),
            "/dev/gpiochip0: No such file or directory, allowed for gpiod.chip: the path of a GPIO chip that "
            "this user may use (gpiodetect lists them)");
  board.refuses.clear();
  board.refused_offset = kReset;
  result = open();
  ASSERT_FALSE(result);
  EXPECT_EQ(
      result.error(),
      "gpiod.reset = 3: Device or resource busy, allowed: a line of /dev/gpiochip0 that nothing else uses "
      "and that can do this (gpioinfo lists them)");
  EXPECT_TRUE(nothing_is_held());
  board.refused_offset = kNotWired;
  params.enable = kNotWired;
  board.lines = kValve;
  result = open({true, true});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(), "gpiod.valve_contact = 6: no line of /dev/gpiochip0, allowed: 0 to 5");
  EXPECT_TRUE(nothing_is_held());
}

}  // namespace
}  // namespace punctum::gpiod
