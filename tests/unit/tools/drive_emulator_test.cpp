// The emulated drive, byte by byte: what a CANopen slave must answer by CiA 301 and CiA 402. The master of
// hal/cia402 has no part in this.
#include <gtest/gtest.h>
#include <linux/can.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tools/emulators/drive/drive.hpp"
#include "tools/emulators/drive/drive_bus.hpp"

namespace punctum::emulator {
namespace {

constexpr std::int64_t kMs = 1'000'000;

class DriveTest : public testing::Test {
 protected:
  DriveTest() : drive({.node = 5, .start_counts = 300}) { out = drive.step(now); }

  std::vector<can_frame> send(std::uint32_t id, std::initializer_list<unsigned> bytes) {
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = static_cast<std::uint8_t>(bytes.size());
    std::transform(bytes.begin(), bytes.end(), frame.data,
                   [](unsigned b) { return static_cast<std::uint8_t>(b); });
    drive.on_frame(frame, now);
    return drive.step(now);
  }
  std::vector<can_frame> pass(std::int64_t for_ns) {
    std::vector<can_frame> all;
    for (std::int64_t t = 0; t < for_ns; t += kMs / 2) {
      now += kMs / 2;
      const auto some = drive.step(now);
      all.insert(all.end(), some.begin(), some.end());
    }
    return all;
  }
  // The answer's eight bytes as text, "" where there is not exactly one.
  std::string sdo(std::initializer_list<unsigned> request) {
    const auto answers = only(0x585, send(0x605, request));
    return answers.size() == 1 && answers[0].size() == 23 ? answers[0] : "";
  }
  // The bytes of those with this identifier.
  static std::vector<std::string> only(std::uint32_t id, const std::vector<can_frame>& frames) {
    std::vector<std::string> out;
    for (const can_frame& frame : frames) {
      if (frame.can_id == id) {
        out.push_back(text(frame));
      }
    }
    return out;
  }
  static std::string text(const can_frame& frame) {
    std::string out;
    for (int i = 0; i < frame.can_dlc; ++i) {
      char byte[4];
      std::snprintf(byte, sizeof(byte), i == 0 ? "%02X" : " %02X", frame.data[i]);
      out += byte;
    }
    return out;
  }
  // The first three bytes of each.
  static std::vector<std::string> emergencies(const std::vector<can_frame>& frames) {
    std::vector<std::string> out;
    for (const can_frame& frame : frames) {
      if (frame.can_id == 0x085) {
        out.push_back(text(frame).substr(0, 8));
      }
    }
    return out;
  }
  void control(unsigned word) {
    EXPECT_EQ(sdo({0x2B, 0x40, 0x60, 0, word & 0xFF, word >> 8, 0, 0}), "60 40 60 00 00 00 00 00");
  }
  void operate() {
    send(0x000, {0x01, 0x05});
    control(0x06);
    control(0x07);
    control(0x0F);
    ASSERT_EQ(drive.state(), DriveState::operation_enabled);
  }

  Drive drive;
  std::int64_t now = 1000 * kMs;
  std::vector<can_frame> out;
};

TEST_F(DriveTest, says_that_it_has_booted_and_is_pre_operational) {
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(out[0].can_id, 0x705U);
  EXPECT_EQ(text(out[0]), "00");
  EXPECT_EQ(drive.nmt_state(), 0x7F);
}

TEST_F(DriveTest, obeys_network_management_for_itself_and_for_all) {
  send(0x000, {0x01, 0x06});
  EXPECT_EQ(drive.nmt_state(), 0x7F);
  send(0x000, {0x01, 0x00});
  EXPECT_EQ(drive.nmt_state(), 0x05);
  send(0x000, {0x02, 0x05});
  EXPECT_EQ(drive.nmt_state(), 0x04);
  EXPECT_EQ(sdo({0x40, 0x00, 0x10, 0, 0, 0, 0, 0}), "");  // a stopped node has no SDO
  const auto booted = send(0x000, {0x82, 0x05});
  ASSERT_EQ(booted.size(), 1U);
  EXPECT_EQ(booted[0].can_id, 0x705U);
}

TEST_F(DriveTest, answers_expedited_uploads_with_their_length) {
  EXPECT_EQ(sdo({0x40, 0x00, 0x10, 0, 0, 0, 0, 0}), "43 00 10 00 92 01 02 00");  // servo drive, profile 402
  EXPECT_EQ(sdo({0x40, 0x41, 0x60, 0, 0, 0, 0, 0}), "4B 41 60 00 50 02 00 00");
  EXPECT_EQ(sdo({0x40, 0x61, 0x60, 0, 0, 0, 0, 0}), "4F 61 60 00 08 00 00 00");
  EXPECT_EQ(sdo({0x40, 0x18, 0x10, 4, 0, 0, 0, 0}), "43 18 10 04 05 00 00 00");
  EXPECT_EQ(sdo({0x40, 0x64, 0x60, 0, 0, 0, 0, 0}), "43 64 60 00 2C 01 00 00");
}

TEST_F(DriveTest, uploads_its_name_in_segments_with_an_alternating_bit) {
  EXPECT_EQ(sdo({0x40, 0x08, 0x10, 0, 0, 0, 0, 0}), "41 08 10 00 0D 00 00 00");  // 13 bytes: punctum-drive
  EXPECT_EQ(sdo({0x60, 0, 0, 0, 0, 0, 0, 0}), "00 70 75 6E 63 74 75 6D");
  EXPECT_EQ(sdo({0x70, 0, 0, 0, 0, 0, 0, 0}), "13 2D 64 72 69 76 65 00");  // last, one byte unused
  EXPECT_EQ(sdo({0x60, 0, 0, 0, 0, 0, 0, 0}).substr(0, 2), "80");
  EXPECT_EQ(sdo({0x40, 0x08, 0x10, 0, 0, 0, 0, 0}).substr(0, 2), "41");
  EXPECT_EQ(sdo({0x70, 0, 0, 0, 0, 0, 0, 0}), "80 08 10 00 00 00 03 05");  // the toggle bit did not alternate
}

TEST_F(DriveTest, aborts_with_the_code_of_the_standard) {
  EXPECT_EQ(sdo({0x40, 0x00, 0x20, 0, 0, 0, 0, 0}), "80 00 20 00 00 00 02 06");  // no object
  EXPECT_EQ(sdo({0x40, 0x18, 0x10, 9, 0, 0, 0, 0}), "80 18 10 09 11 00 09 06");  // no sub-index
  EXPECT_EQ(sdo({0x23, 0x00, 0x10, 0, 1, 0, 0, 0}), "80 00 10 00 02 00 01 06");  // read only
  EXPECT_EQ(sdo({0x23, 0x17, 0x10, 0, 1, 0, 0, 0}), "80 17 10 00 10 00 07 06");  // length
  EXPECT_EQ(sdo({0x2F, 0x60, 0x60, 0, 3, 0, 0, 0}), "80 60 60 00 30 00 09 06");  // mode that it has not
  EXPECT_EQ(sdo({0xE0, 0x17, 0x10, 0, 9, 0, 0, 0}), "80 17 10 00 01 00 04 05");  // unknown command
}

TEST_F(DriveTest, maps_a_pdo_only_while_it_is_off_and_empty) {
  EXPECT_EQ(sdo({0x2F, 0x00, 0x16, 0, 0, 0, 0, 0}), "80 00 16 00 22 00 00 08");  // it is on
  EXPECT_EQ(sdo({0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0x80}), "60 00 14 01 00 00 00 00");
  EXPECT_EQ(sdo({0x23, 0x00, 0x16, 1, 0x10, 0, 0x40, 0x60}), "80 00 16 01 22 00 00 08");  // it is not empty
  EXPECT_EQ(sdo({0x2F, 0x00, 0x16, 0, 0, 0, 0, 0}), "60 00 16 00 00 00 00 00");
  EXPECT_EQ(sdo({0x23, 0x00, 0x16, 1, 0x10, 0, 0x41, 0x60}), "80 00 16 01 41 00 04 06");  // status in an RPDO
  EXPECT_EQ(sdo({0x23, 0x00, 0x16, 1, 0x20, 0, 0x40, 0x60}), "80 00 16 01 41 00 04 06");  // 16 bits, not 32
  EXPECT_EQ(sdo({0x23, 0x00, 0x16, 1, 0x20, 0, 0x7A, 0x60}), "60 00 16 01 00 00 00 00");
  EXPECT_EQ(sdo({0x23, 0x00, 0x16, 2, 0x20, 0, 0x7A, 0x60}), "60 00 16 02 00 00 00 00");
  EXPECT_EQ(sdo({0x23, 0x00, 0x16, 3, 0x10, 0, 0x40, 0x60}), "60 00 16 03 00 00 00 00");
  EXPECT_EQ(sdo({0x2F, 0x00, 0x16, 0, 3, 0, 0, 0}), "80 00 16 00 42 00 04 06");  // 80 bits
  EXPECT_EQ(sdo({0x2F, 0x00, 0x16, 0, 2, 0, 0, 0}), "60 00 16 00 00 00 00 00");
  EXPECT_EQ(sdo({0x2F, 0x00, 0x14, 2, 250, 0, 0, 0}),
            "80 00 14 02 30 00 09 06");  // no such transmission type
  EXPECT_EQ(sdo({0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0}), "60 00 14 01 00 00 00 00");
  EXPECT_EQ(sdo({0x23, 0x00, 0x14, 1, 0x06, 0x02, 0, 0}), "80 00 14 01 22 00 00 08");  // another one while on
}

TEST_F(DriveTest, sends_and_takes_synchronous_pdos_with_the_sync_only) {
  for (const unsigned other : {1U, 2U, 3U}) {  // the other PDOs are off
    sdo({0x23, other, 0x18, 1, 0x85, 0x02, 0, 0x80});
  }
  sdo({0x2F, 0x00, 0x18, 2, 1, 0, 0, 0});
  sdo({0x2F, 0x00, 0x14, 2, 1, 0, 0, 0});
  EXPECT_TRUE(send(0x080, {}).empty());  // not operational
  send(0x000, {0x01, 0x05});
  const auto answer = send(0x080, {});
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_EQ(answer[0].can_id, 0x185U);
  EXPECT_EQ(text(answer[0]), "50 02");
  send(0x205, {0x06, 0x00});
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  send(0x080, {});
  EXPECT_EQ(drive.state(), DriveState::ready_to_switch_on);
}

// CiA 402, figure of the state machine: from state, by controlword, to state.
TEST_F(DriveTest, the_power_state_machine_takes_the_transitions_of_the_standard) {
  using S = DriveState;
  const struct {
    std::vector<unsigned> way;
    S from;
    unsigned word;
    S to;
  } table[] = {
      {{}, S::switch_on_disabled, 0x06, S::ready_to_switch_on},  // 2
      {{}, S::switch_on_disabled, 0x07, S::switch_on_disabled},
      {{}, S::switch_on_disabled, 0x0F, S::switch_on_disabled},
      {{}, S::switch_on_disabled, 0x02, S::switch_on_disabled},
      {{0x06}, S::ready_to_switch_on, 0x07, S::switched_on},                          // 3
      {{0x06}, S::ready_to_switch_on, 0x0F, S::operation_enabled},                    // 3 and 4
      {{0x06}, S::ready_to_switch_on, 0x00, S::switch_on_disabled},                   // 7
      {{0x06}, S::ready_to_switch_on, 0x02, S::switch_on_disabled},                   // 7
      {{0x06, 0x07}, S::switched_on, 0x0F, S::operation_enabled},                     // 4
      {{0x06, 0x07}, S::switched_on, 0x06, S::ready_to_switch_on},                    // 6
      {{0x06, 0x07}, S::switched_on, 0x00, S::switch_on_disabled},                    // 10
      {{0x06, 0x07}, S::switched_on, 0x02, S::switch_on_disabled},                    // 10
      {{0x06, 0x07, 0x0F}, S::operation_enabled, 0x07, S::switched_on},               // 5
      {{0x06, 0x07, 0x0F}, S::operation_enabled, 0x06, S::ready_to_switch_on},        // 8
      {{0x06, 0x07, 0x0F}, S::operation_enabled, 0x00, S::switch_on_disabled},        // 9
      {{0x06, 0x07, 0x0F}, S::operation_enabled, 0x02, S::quick_stop_active},         // 11
      {{0x06, 0x07, 0x0F, 0x02}, S::quick_stop_active, 0x00, S::switch_on_disabled},  // 12
      {{0x06, 0x07, 0x0F, 0x02}, S::quick_stop_active, 0x0F, S::operation_enabled},   // 16
      {{0x06, 0x07, 0x0F, 0x02}, S::quick_stop_active, 0x06, S::quick_stop_active},
  };
  for (const auto& row : table) {
    control(0x00);
    sdo({0x2B, 0x5A, 0x60, 0, 6, 0, 0, 0});  // stay in quick stop
    for (const unsigned word : row.way) {
      control(word);
    }
    ASSERT_EQ(drive.state(), row.from);
    control(row.word);
    EXPECT_EQ(drive.state(), row.to) << std::hex << row.word;
  }
}

TEST_F(DriveTest, leaves_a_fault_on_a_rising_edge_only) {
  operate();
  EXPECT_EQ(drive.command("fault 0x7305"), "");
  const auto told = only(0x085, drive.step(now));
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0], "05 73 01 00 00 00 00 00");
  pass(10 * kMs);
  EXPECT_EQ(drive.state(), DriveState::fault);
  control(0x0F);
  EXPECT_EQ(drive.state(), DriveState::fault);
  const auto gone = send(0x605, {0x2B, 0x40, 0x60, 0, 0x80, 0, 0, 0});
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  ASSERT_EQ(only(0x085, gone).size(), 1U);
  EXPECT_EQ(only(0x085, gone)[0], "00 00 00 00 00 00 00 00");  // the error is gone
  EXPECT_EQ(only(0x585, gone).size(), 1U);
  EXPECT_EQ(drive.command("fault 0x7305"), "");
  (void)drive.step(now);
  control(0x80);  // it was up before: no edge
  EXPECT_EQ(drive.state(), DriveState::fault);
}

TEST_F(DriveTest, follows_its_set_point_and_keeps_its_limits) {
  sdo({0x23, 0x7D, 0x60, 2, 0xF4, 0x01, 0, 0});  // at most 500
  operate();
  sdo({0x23, 0x7A, 0x60, 0, 0x90, 0x01, 0, 0});  // 400
  pass(50 * kMs);
  EXPECT_NEAR(drive.position(), 400, 0.5);
  sdo({0x23, 0x7A, 0x60, 0, 0x58, 0x02, 0, 0});  // 600
  pass(50 * kMs);
  EXPECT_NEAR(drive.position(), 500, 0.5);
  EXPECT_NE(drive.statusword() & 0x0800, 0);  // internal limit
}

TEST_F(DriveTest, has_a_following_error_when_its_encoder_hangs) {
  operate();
  EXPECT_EQ(drive.command("stick"), "");
  sdo({0x23, 0x7A, 0x60, 0, 0x10, 0x27, 0, 0});  // 10 000 away, the window is 2000
  const auto told = pass(30 * kMs);
  EXPECT_TRUE(std::any_of(told.begin(), told.end(), [](const can_frame& f) {
    return f.can_id == 0x085 && f.data[0] == 0x11 && f.data[1] == 0x86;
  }));
  pass(500 * kMs);
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_EQ(drive.value(0x603F), 0x8611);
}

TEST_F(DriveTest, quick_stops_on_the_ramp_of_6085) {
  sdo({0x2B, 0x5A, 0x60, 0, 6, 0, 0, 0});
  sdo({0x23, 0x85, 0x60, 0, 0x40, 0x42, 0x0F, 0});  // 1 000 000 counts/s^2
  sdo({0x23, 0x65, 0x60, 0, 0, 0, 0, 0x10});        // a wide window
  operate();
  sdo({0x23, 0x7A, 0x60, 0, 0x40, 0x42, 0x0F, 0});  // far away
  pass(20 * kMs);
  const double speed = drive.speed(), from = drive.position();
  EXPECT_GT(speed, 100'000);
  control(0x02);
  pass(1000 * kMs);
  EXPECT_EQ(drive.speed(), 0);
  EXPECT_NEAR(drive.position() - from, speed * speed / 2e6, 0.01 * speed * speed / 2e6);  // v^2 / 2a
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
}

// CiA 402, object 605A: 1 and 5 brake on the slow-down ramp (6084), 2 and 6 on the quick-stop ramp (6085); 5
// and 6 stay in quick stop.
TEST_F(DriveTest, quick_stops_on_the_ramp_of_its_option_code) {
  sdo({0x23, 0x84, 0x60, 0, 0x80, 0x1A, 0x06, 0});  // 400 000 counts/s^2
  sdo({0x23, 0x85, 0x60, 0, 0x40, 0x42, 0x0F, 0});  // 1 000 000 counts/s^2
  sdo({0x23, 0x65, 0x60, 0, 0, 0, 0, 0x10});        // a wide window
  sdo({0x23, 0x7A, 0x60, 0, 0x80, 0x96, 0x98, 0});  // far away
  const struct {
    unsigned option;
    double ramp_counts_s2;
    DriveState then;
  } table[] = {
      {1, 4e5, DriveState::switch_on_disabled},
      {2, 1e6, DriveState::switch_on_disabled},
      {5, 4e5, DriveState::quick_stop_active},
      {6, 1e6, DriveState::quick_stop_active},
  };
  for (const auto& row : table) {
    sdo({0x2B, 0x5A, 0x60, 0, row.option, 0, 0, 0});
    operate();
    pass(20 * kMs);
    const double speed = drive.speed(), from = drive.position();
    EXPECT_GT(speed, 100'000) << row.option;
    control(0x02);
    pass(2000 * kMs);
    EXPECT_EQ(drive.speed(), 0) << row.option;
    const double way = speed * speed / (2 * row.ramp_counts_s2);
    EXPECT_NEAR(drive.position() - from, way, 0.01 * way) << row.option;
    EXPECT_EQ(drive.state(), row.then) << row.option;
    control(0x00);
  }
}

TEST_F(DriveTest, safe_torque_off_leaves_a_fault_to_its_reset) {
  sdo({0x23, 0x65, 0x60, 0, 0, 0, 0, 0x10});        // a wide window
  sdo({0x23, 0x7A, 0x60, 0, 0x40, 0x42, 0x0F, 0});  // far away
  operate();
  pass(20 * kMs);
  EXPECT_EQ(drive.command("fault 0x7305"), "");
  ASSERT_EQ(drive.state(), DriveState::fault_reaction);
  EXPECT_EQ(drive.command("switch-off"), "");
  EXPECT_EQ(drive.state(), DriveState::fault) << "there is no torque to brake with";
  EXPECT_FALSE(drive.motor_has_power());
  EXPECT_EQ(drive.command("switch-on"), "");
  EXPECT_EQ(drive.command("switch-off"), "");
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_EQ(drive.value(0x603F), 0x7305);
  control(0x80);
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  ASSERT_NE(drive.speed(), 0) << "it still coasts";
  EXPECT_EQ(drive.command("fault 0x7306"), "");
  EXPECT_EQ(drive.state(), DriveState::fault);
}

TEST_F(DriveTest, keeps_its_least_position_limit_below_its_largest) {
  EXPECT_EQ(sdo({0x23, 0x7D, 0x60, 2, 100, 0, 0, 0}), "60 7D 60 02 00 00 00 00");
  EXPECT_EQ(sdo({0x23, 0x7D, 0x60, 1, 101, 0, 0, 0}), "80 7D 60 01 36 00 09 06");
  EXPECT_EQ(sdo({0x23, 0x7D, 0x60, 1, 100, 0, 0, 0}), "60 7D 60 01 00 00 00 00");
  EXPECT_EQ(sdo({0x23, 0x7D, 0x60, 2, 99, 0, 0, 0}), "80 7D 60 02 36 00 09 06");
  EXPECT_EQ(drive.value(0x607D, 1), 100);
  EXPECT_EQ(drive.value(0x607D, 2), 100);
}

TEST_F(DriveTest, takes_the_mode_that_it_was_given_while_homing_when_homing_ends) {
  const auto mode = [this](unsigned wanted) {
    EXPECT_EQ(sdo({0x2F, 0x60, 0x60, 0, wanted, 0, 0, 0}), "60 60 60 00 00 00 00 00");
  };
  sdo({0x23, 0x65, 0x60, 0, 0, 0, 0, 0x10});           // a wide window
  sdo({0x2F, 0x98, 0x60, 0, 17, 0, 0, 0});             // onto the switch at -50 000
  sdo({0x23, 0x99, 0x60, 1, 0x20, 0xA1, 0x07, 0});     // 500 000 counts/s
  sdo({0x23, 0x9A, 0x60, 0, 0x80, 0xF0, 0xFA, 0x02});  // 50 000 000 counts/s^2
  sdo({0x23, 0x7A, 0x60, 0, 0x50, 0xC3, 0, 0});        // 50 000, for later
  mode(6);
  operate();
  control(0x1F);
  pass(20 * kMs);
  mode(8);
  pass(20 * kMs);
  EXPECT_EQ(drive.value(0x6061), 6) << "it is still on its way";
  pass(300 * kMs);
  EXPECT_EQ(drive.value(0x6061), 8);
  EXPECT_NEAR(drive.position(), 50'000, 0.5);
  // The same when homing is given up.
  mode(6);
  control(0x0F);
  control(0x1F);
  pass(20 * kMs);
  mode(8);
  EXPECT_EQ(drive.value(0x6061), 6);
  control(0x0F);
  pass(kMs);
  EXPECT_EQ(drive.value(0x6061), 8);
}

TEST_F(DriveTest, homes_by_the_present_position_and_by_a_switch) {
  sdo({0x2F, 0x98, 0x60, 0, 37, 0, 0, 0});
  sdo({0x2F, 0x60, 0x60, 0, 6, 0, 0, 0});
  operate();
  EXPECT_EQ(drive.statusword() & 0x1000, 0);
  control(0x1F);
  pass(5 * kMs);
  EXPECT_EQ(drive.value(0x6064), 0);
  EXPECT_EQ(drive.statusword() & 0x3400, 0x1400);  // attained and reached
  EXPECT_EQ(sdo({0x2F, 0x98, 0x60, 0, 99, 0, 0, 0}), "80 98 60 00 30 00 09 06");
}

TEST_F(DriveTest, sends_its_heartbeat_and_watches_that_of_its_master) {
  sdo({0x2B, 0x17, 0x10, 0, 10, 0, 0, 0});
  const auto beats = pass(100 * kMs);
  EXPECT_EQ(std::count_if(beats.begin(), beats.end(), [](const can_frame& f) { return f.can_id == 0x705; }),
            10);
  sdo({0x23, 0x16, 0x10, 1, 50, 0, 0x7F, 0});  // node 127 within 50 ms
  sdo({0x2B, 0x07, 0x60, 0, 3, 0, 0, 0});
  sdo({0x2B, 0x5A, 0x60, 0, 6, 0, 0, 0});
  operate();
  pass(200 * kMs);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);  // it watches from the first one on
  send(0x77F, {0x05});
  pass(45 * kMs);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  const auto told = pass(20 * kMs);
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
  EXPECT_EQ(drive.nmt_state(), 0x7F);
  // CiA 301: the code, and the error register with its bits for any error and for communication.
  EXPECT_EQ(emergencies(told), (std::vector<std::string>{"30 81 11"}));
  // It is told that the error is over, and stays where it went.
  EXPECT_EQ(emergencies(send(0x77F, {0x05})), (std::vector<std::string>{"00 00 00"}));
  EXPECT_EQ(drive.value(0x1001), 0);
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
}

TEST_F(DriveTest, a_lost_heartbeat_that_is_a_fault_is_told_once) {
  sdo({0x23, 0x16, 0x10, 1, 50, 0, 0x7F, 0});
  sdo({0x2B, 0x07, 0x60, 0, 1, 0, 0, 0});
  operate();
  send(0x77F, {0x05});
  EXPECT_EQ(emergencies(pass(70 * kMs)), (std::vector<std::string>{"30 81 11"}));
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_EQ(emergencies(send(0x77F, {0x05})), std::vector<std::string>{}) << "a fault waits for its reset";
}

// CiA 301, object 1029: 2 is stopped, from any state. The emergency goes out first: a stopped node has none.
TEST_F(DriveTest, is_stopped_by_a_lost_heartbeat_when_1029_says_so) {
  sdo({0x23, 0x16, 0x10, 1, 50, 0, 0x7F, 0});
  EXPECT_EQ(sdo({0x2F, 0x29, 0x10, 1, 2, 0, 0, 0}), "60 29 10 01 00 00 00 00");
  send(0x77F, {0x05});
  EXPECT_EQ(emergencies(pass(70 * kMs)), (std::vector<std::string>{"30 81 11"}));
  EXPECT_EQ(drive.nmt_state(), 0x04);
  operate();
  EXPECT_EQ(emergencies(send(0x77F, {0x05})), (std::vector<std::string>{"00 00 00"}));
  EXPECT_EQ(emergencies(pass(70 * kMs)), (std::vector<std::string>{"30 81 11"}));
  EXPECT_EQ(drive.nmt_state(), 0x04);
  EXPECT_EQ(drive.state(), DriveState::fault);
}

TEST_F(DriveTest, refuses_a_line_with_a_number_that_it_cannot_take_and_does_nothing) {
  operate();
  for (const char* line : {"creep nan",
                           "creep inf",
                           "creep -inf",
                           "creep 5x",
                           "creep 1e300",
                           "creep 3e9",
                           "creep",
                           "fault abc",
                           "fault 0x73g5",
                           "fault 0x",
                           "fault 0x10000",
                           "fault 65536",
                           "fault -1",
                           "fault 0x7305 now",
                           "emergency abc",
                           "emergency 65536",
                           "refuse 6065 0x06090030",
                           "refuse 6065:zz 0x06090030",
                           "refuse 60650:00 0x06090030",
                           "refuse 6065:100 0x06090030",
                           "refuse :00 0x06090030",
                           "refuse 6065:00 much",
                           "refuse 6065:00 0x106090030",
                           "freeze now",
                           "switch-off 2"}) {
    const std::string problem = drive.command(line);
    EXPECT_TRUE(problem.starts_with("\"" + std::string(line) + "\": ")) << line << ": " << problem;
    EXPECT_NE(problem.find("allowed: "), std::string::npos) << problem;
    EXPECT_TRUE(drive.step(now).empty()) << line;
    EXPECT_EQ(drive.state(), DriveState::operation_enabled) << line;
    EXPECT_EQ(sdo({0x23, 0x65, 0x60, 0, 1, 0, 0, 0}), "60 65 60 00 00 00 00 00") << line;
  }
  EXPECT_EQ(drive.command("creep nan"),
            "\"creep nan\": \"nan\" is no speed, allowed: a number from -2147483648 to 2147483647");
  EXPECT_EQ(drive.command("fault abc"), "\"fault abc\": \"abc\" is no code, allowed: 0 .. 0xFFFF");
  control(0x00);
  const double from = drive.position();
  pass(10 * kMs);
  EXPECT_EQ(drive.position(), from) << "it does not creep";
  EXPECT_EQ(drive.command("creep -2500.5"), "");
  pass(100 * kMs);
  EXPECT_NEAR(drive.position() - from, -250.05, 0.5);
  EXPECT_EQ(drive.command("fault 29445"), "");
  EXPECT_EQ(drive.value(0x603F), 0x7305);
}

TEST(DriveBusTest, gives_a_line_to_the_node_whose_number_stands_before_it) {
  DriveBus drives;
  drives.add({.node = 1});
  drives.add({.node = 2});
  EXPECT_EQ(drives.command("2 fault 0x7305"), "");
  EXPECT_EQ(drives.drive(0).value(0x603F), 0);
  EXPECT_EQ(drives.drive(1).value(0x603F), 0x7305);
  EXPECT_NE(drives.command("3 fault 0x7306"), "");
  EXPECT_NE(drives.command("1fault 0x7306"), "");
  EXPECT_EQ(drives.drive(0).value(0x603F), 0);
}

TEST(DriveBusTest, refuses_a_node_number_that_is_given_twice) {
  EXPECT_EQ(check_nodes({1, 2, 3}), "");
  EXPECT_EQ(check_nodes({3, 1, 2, 1}), "node 1 is given twice, allowed: each number once");
}

TEST_F(DriveTest, misbehaves_when_it_is_told_to) {
  operate();
  EXPECT_EQ(drive.command("ignore quick-stop"), "");
  control(0x02);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_EQ(drive.command("ignore disable"), "");
  control(0x00);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_EQ(drive.command("freeze"), "");
  EXPECT_EQ(sdo({0x40, 0x00, 0x10, 0, 0, 0, 0, 0}), "");
  EXPECT_EQ(drive.command("thaw"), "");
  EXPECT_EQ(drive.command("refuse 6065:00 0x08000022"), "");
  EXPECT_EQ(sdo({0x23, 0x65, 0x60, 0, 1, 0, 0, 0}), "80 65 60 00 22 00 00 08");
  EXPECT_TRUE(drive.command("dance").starts_with("\"dance\": unknown, allowed: fault CODE | "));
  EXPECT_NE(drive.command("mute everything"), "");
}

TEST_F(DriveTest, ignores_remote_and_extended_frames_and_other_nodes) {
  EXPECT_TRUE(send(0x605U | CAN_RTR_FLAG, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}).empty());
  EXPECT_TRUE(send(0x605U | CAN_EFF_FLAG, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}).empty());
  EXPECT_TRUE(send(0x606U, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}).empty());
  EXPECT_TRUE(send(0x605U, {0x40, 0x00, 0x10}).empty());
}

// ---- PDOs, by CiA 301 ----

// CiA 402, its predefined PDOs: identifier, and what is mapped.
TEST_F(DriveTest, comes_with_the_mappings_of_its_profile) {
  const struct {
    unsigned parameter, mapping;
    const char *id, *type, *count;
    std::vector<const char*> entries;
  } table[] = {
      {0x1400, 0x1600, "05 02 00 00", "FF", "01", {"10 00 40 60"}},
      {0x1401, 0x1601, "05 03 00 00", "FF", "02", {"10 00 40 60", "08 00 60 60"}},
      {0x1402, 0x1602, "05 04 00 00", "FF", "02", {"10 00 40 60", "20 00 7A 60"}},
      {0x1403, 0x1603, "05 05 00 80", "FF", "00", {}},  // its velocity is no mode of this drive
      {0x1800, 0x1A00, "85 01 00 00", "FF", "01", {"10 00 41 60"}},
      {0x1801, 0x1A01, "85 02 00 00", "FF", "02", {"10 00 41 60", "08 00 61 60"}},
      {0x1802, 0x1A02, "85 03 00 00", "01", "02", {"10 00 41 60", "20 00 64 60"}},
      {0x1803, 0x1A03, "85 04 00 00", "01", "02", {"10 00 41 60", "20 00 6C 60"}},
  };
  for (const auto& row : table) {
    const auto value = [&](unsigned index, unsigned sub) {
      return sdo({0x40, index & 0xFF, index >> 8, sub, 0, 0, 0, 0}).substr(12);
    };
    EXPECT_EQ(value(row.parameter, 1), row.id) << std::hex << row.parameter;
    EXPECT_EQ(value(row.parameter, 2).substr(0, 2), row.type) << std::hex << row.parameter;
    EXPECT_EQ(value(row.mapping, 0).substr(0, 2), row.count) << std::hex << row.mapping;
    for (unsigned i = 0; i < row.entries.size(); ++i) {
      EXPECT_EQ(value(row.mapping, i + 1), row.entries[i]) << std::hex << row.mapping;
    }
  }
}

TEST_F(DriveTest, sends_event_driven_pdos_when_a_mapped_value_changes_and_only_then) {
  const auto first = send(0x000, {0x01, 0x05});
  EXPECT_EQ(only(0x185, first), std::vector<std::string>{"50 02"});
  EXPECT_EQ(only(0x285, first), std::vector<std::string>{"50 02 08"});
  EXPECT_TRUE(only(0x385, first).empty()) << "synchronous";
  EXPECT_TRUE(pass(100 * kMs).empty()) << "nothing changes";
  EXPECT_EQ(only(0x185, send(0x205, {0x06, 0x00})), std::vector<std::string>{"31 02"});
  // Another mode changes the second one only.
  const auto mode = send(0x305, {0x06, 0x00, 0x06});
  EXPECT_EQ(only(0x285, mode), std::vector<std::string>{"31 06 06"});
  EXPECT_EQ(drive.value(0x6061), 6);
}

TEST_F(DriveTest, keeps_the_inhibit_time_between_two_event_driven_pdos_and_loses_no_last_value) {
  EXPECT_EQ(sdo({0x2B, 0x00, 0x18, 3, 100, 0, 0, 0}), "80 00 18 03 22 00 00 08");  // it is on
  sdo({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x80});
  EXPECT_EQ(sdo({0x2B, 0x00, 0x18, 3, 100, 0, 0, 0}), "60 00 18 03 00 00 00 00");  // 10 ms
  sdo({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0});
  EXPECT_EQ(only(0x185, send(0x000, {0x01, 0x05})), std::vector<std::string>{"50 02"});
  EXPECT_TRUE(only(0x185, send(0x205, {0x06, 0x00})).empty());
  EXPECT_TRUE(only(0x185, send(0x205, {0x07, 0x00})).empty());
  EXPECT_TRUE(only(0x185, pass(9 * kMs)).empty());
  EXPECT_EQ(only(0x185, pass(2 * kMs)), std::vector<std::string>{"33 02"});
  EXPECT_TRUE(only(0x185, pass(50 * kMs)).empty());
}

TEST_F(DriveTest, repeats_an_event_driven_pdo_when_its_event_timer_runs_out) {
  EXPECT_EQ(sdo({0x2B, 0x00, 0x18, 5, 20, 0, 0, 0}), "60 00 18 05 00 00 00 00");
  send(0x000, {0x01, 0x05});
  EXPECT_EQ(only(0x185, pass(100 * kMs)), std::vector<std::string>(5, "50 02"));
  // A change begins the time anew.
  pass(10 * kMs);
  send(0x205, {0x06, 0x00});
  EXPECT_TRUE(only(0x185, pass(19 * kMs)).empty());
  EXPECT_EQ(only(0x185, pass(2 * kMs)), std::vector<std::string>{"31 02"});
}

TEST_F(DriveTest, sends_by_every_nth_sync_or_by_the_next_one_after_a_change) {
  sdo({0x2F, 0x00, 0x18, 2, 3, 0, 0, 0});
  sdo({0x2F, 0x01, 0x18, 2, 0, 0, 0, 0});
  send(0x000, {0x01, 0x05});
  std::vector<std::size_t> third, after_a_change;
  for (int i = 0; i < 6; ++i) {
    if (i == 3) {
      EXPECT_TRUE(only(0x285, send(0x205, {0x06, 0x00})).empty());
    }
    const auto sent = send(0x080, {});
    third.push_back(only(0x185, sent).size());
    after_a_change.push_back(only(0x285, sent).size());
  }
  EXPECT_EQ(third, (std::vector<std::size_t>{0, 0, 1, 0, 0, 1}));
  EXPECT_EQ(after_a_change, (std::vector<std::size_t>{1, 0, 0, 1, 0, 0}));
}

TEST_F(DriveTest, answers_remote_requests_for_its_pdos) {
  EXPECT_EQ(sdo({0x2F, 0x00, 0x18, 2, 253, 0, 0, 0}), "60 00 18 02 00 00 00 00");
  EXPECT_EQ(sdo({0x2F, 0x01, 0x18, 2, 252, 0, 0, 0}), "60 01 18 02 00 00 00 00");
  EXPECT_TRUE(send(0x185U | CAN_RTR_FLAG, {}).empty()) << "not operational";
  send(0x000, {0x01, 0x05});
  const auto synced = send(0x080, {});
  EXPECT_TRUE(only(0x185, synced).empty());
  EXPECT_TRUE(only(0x285, synced).empty()) << "it is sampled, and waits for the request";
  EXPECT_TRUE(only(0x185, send(0x205, {0x06, 0x00})).empty());
  EXPECT_EQ(only(0x185, send(0x185U | CAN_RTR_FLAG, {})), std::vector<std::string>{"31 02"})
      << "as it is now";
  EXPECT_EQ(only(0x285, send(0x285U | CAN_RTR_FLAG, {})), std::vector<std::string>{"50 02 08"})
      << "as it was at the SYNC";
  sdo({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x40});  // no remote request any more
  EXPECT_TRUE(send(0x185U | CAN_RTR_FLAG, {}).empty());
}

TEST_F(DriveTest, refuses_parameters_that_a_pdo_cannot_have) {
  EXPECT_EQ(sdo({0x40, 0x00, 0x18, 0, 0, 0, 0, 0}), "4F 00 18 00 06 00 00 00");
  EXPECT_EQ(sdo({0x40, 0x00, 0x18, 4, 0, 0, 0, 0}), "80 00 18 04 11 00 09 06");    // there is none
  EXPECT_EQ(sdo({0x2F, 0x00, 0x18, 2, 241, 0, 0, 0}), "80 00 18 02 30 00 09 06");  // reserved
  EXPECT_EQ(sdo({0x2F, 0x00, 0x18, 2, 251, 0, 0, 0}), "80 00 18 02 30 00 09 06");
  EXPECT_EQ(sdo({0x2F, 0x00, 0x14, 2, 253, 0, 0, 0}), "80 00 14 02 30 00 09 06");         // not of an RPDO
  EXPECT_EQ(sdo({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x20}), "80 00 18 01 30 00 09 06");  // 29 bits
  sdo({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x80});
  for (const unsigned id : {0x000U, 0x07FU, 0x101U, 0x580U + 5, 0x605U, 0x6E0U, 0x705U}) {  // restricted
    EXPECT_EQ(sdo({0x23, 0x00, 0x18, 1, id & 0xFF, id >> 8, 0, 0}), "80 00 18 01 30 00 09 06")
        << std::hex << id;
  }
  EXPECT_EQ(sdo({0x23, 0x00, 0x18, 1, 0x90, 0x01, 0, 0}), "60 00 18 01 00 00 00 00");
  EXPECT_EQ(only(0x190, send(0x000, {0x01, 0x05})), std::vector<std::string>{"50 02"});
}

TEST_F(DriveTest, takes_every_received_pdo_and_says_when_one_is_too_short) {
  send(0x000, {0x01, 0x05});
  for (const unsigned word : {0x06U, 0x07U, 0x0FU}) {
    send(0x205, {word, 0x00});
  }
  send(0x405, {0x0F, 0x00, 0x90, 0x01, 0, 0});  // 400
  pass(50 * kMs);
  EXPECT_NEAR(drive.position(), 400, 0.5);
  const auto told = send(0x405, {0x0F, 0x00, 0x00, 0x00});
  EXPECT_EQ(only(0x085, told), std::vector<std::string>{"10 82 11 00 00 00 00 00"});
  pass(50 * kMs);
  EXPECT_NEAR(drive.position(), 400, 0.5);
  send(0x505, {0x00, 0x00, 0, 0, 0, 0});  // the fourth is off
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
}

// ---- SDO ----

TEST_F(DriveTest, takes_downloads_in_segments) {
  // 1017 = 10 ms: announced with two bytes; one segment with five bytes unused, the last one.
  EXPECT_EQ(sdo({0x21, 0x17, 0x10, 0, 2, 0, 0, 0}), "60 17 10 00 00 00 00 00");
  EXPECT_EQ(sdo({0x0B, 10, 0, 0, 0, 0, 0, 0}), "20 00 00 00 00 00 00 00");
  EXPECT_EQ(drive.value(0x1017), 10);
  EXPECT_EQ(only(0x705, pass(100 * kMs)).size(), 10U);
  // 6065 = 0x01020304 without a length, byte by byte: the bit alternates.
  EXPECT_EQ(sdo({0x20, 0x65, 0x60, 0, 0, 0, 0, 0}), "60 65 60 00 00 00 00 00");
  EXPECT_EQ(sdo({0x0C, 4, 0, 0, 0, 0, 0, 0}), "20 00 00 00 00 00 00 00");
  EXPECT_EQ(sdo({0x1A, 3, 2, 0, 0, 0, 0, 0}), "30 00 00 00 00 00 00 00");
  EXPECT_EQ(drive.value(0x6065), 2000) << "it has not ended";
  EXPECT_EQ(sdo({0x0D, 1, 0, 0, 0, 0, 0, 0}), "20 00 00 00 00 00 00 00");
  EXPECT_EQ(drive.value(0x6065), 0x01020304);
  EXPECT_EQ(sdo({0x0D, 1, 0, 0, 0, 0, 0, 0}), "80 00 00 00 01 00 04 05");  // a segment of nothing
}

TEST_F(DriveTest, aborts_a_download_in_segments_with_the_code_of_the_standard) {
  EXPECT_EQ(sdo({0x21, 0x17, 0x10, 0, 4, 0, 0, 0}), "80 17 10 00 10 00 07 06");  // 1017 has two bytes
  EXPECT_EQ(sdo({0x21, 0x00, 0x10, 0, 4, 0, 0, 0}), "80 00 10 00 02 00 01 06");  // read only
  EXPECT_EQ(sdo({0x21, 0x0C, 0x10, 0, 2, 0, 0, 0}), "80 0C 10 00 00 00 02 06");  // no object
  sdo({0x21, 0x17, 0x10, 0, 2, 0, 0, 0});
  EXPECT_EQ(sdo({0x1B, 10, 0, 0, 0, 0, 0, 0}), "80 17 10 00 00 00 03 05");  // the bit begins with 0
  sdo({0x21, 0x17, 0x10, 0, 2, 0, 0, 0});
  EXPECT_EQ(sdo({0x0D, 10, 0, 0, 0, 0, 0, 0}), "80 17 10 00 10 00 07 06");  // one byte came
  sdo({0x21, 0x60, 0x60, 0, 1, 0, 0, 0});
  EXPECT_EQ(sdo({0x0D, 3, 0, 0, 0, 0, 0, 0}), "80 60 60 00 30 00 09 06");  // no such mode
  sdo({0x21, 0x17, 0x10, 0, 2, 0, 0, 0});
  EXPECT_EQ(sdo({0x80, 0x17, 0x10, 0, 0, 0, 0, 8}), "");  // the client gives up
  EXPECT_EQ(sdo({0x0B, 10, 0, 0, 0, 0, 0, 0}), "80 00 00 00 01 00 04 05");
  EXPECT_EQ(drive.value(0x1017), 0);
}

TEST_F(DriveTest, refuses_block_transfers_as_a_command_that_it_does_not_know) {
  EXPECT_EQ(sdo({0xC6, 0x17, 0x10, 0, 2, 0, 0, 0}), "80 17 10 00 01 00 04 05");     // download
  EXPECT_EQ(sdo({0xA4, 0x08, 0x10, 0, 0x7F, 0, 0, 0}), "80 08 10 00 01 00 04 05");  // upload
}

// ---- its other objects ----

TEST_F(DriveTest, tells_who_it_is_and_what_it_can) {
  EXPECT_EQ(sdo({0x40, 0x18, 0x10, 0, 0, 0, 0, 0}), "4F 18 10 00 04 00 00 00");
  EXPECT_EQ(sdo({0x40, 0x09, 0x10, 0, 0, 0, 0, 0}), "41 09 10 00 04 00 00 00");
  EXPECT_EQ(sdo({0x60, 0, 0, 0, 0, 0, 0, 0}), "07 6E 6F 6E 65 00 00 00");  // "none"
  EXPECT_EQ(sdo({0x40, 0x0A, 0x10, 0, 0, 0, 0, 0}), "41 0A 10 00 01 00 00 00");
  EXPECT_EQ(sdo({0x40, 0x00, 0x12, 1, 0, 0, 0, 0}), "43 00 12 01 05 06 00 00");
  EXPECT_EQ(sdo({0x40, 0x00, 0x12, 2, 0, 0, 0, 0}), "43 00 12 02 85 05 00 00");
  // Homing is bit 5, cyclic synchronous position bit 7; a mode that is not there is refused.
  EXPECT_EQ(sdo({0x40, 0x02, 0x65, 0, 0, 0, 0, 0}), "43 02 65 00 A0 00 00 00");
  for (unsigned mode = 0; mode <= 11; ++mode) {
    EXPECT_EQ(sdo({0x2F, 0x60, 0x60, 0, mode, 0, 0, 0}).substr(0, 2), mode == 6 || mode == 8 ? "60" : "80")
        << mode;
  }
}

TEST_F(DriveTest, knows_no_node_guarding) {
  EXPECT_EQ(sdo({0x40, 0x0C, 0x10, 0, 0, 0, 0, 0}), "80 0C 10 00 00 00 02 06");
  EXPECT_EQ(sdo({0x40, 0x0D, 0x10, 0, 0, 0, 0, 0}), "80 0D 10 00 00 00 02 06");
  EXPECT_TRUE(send(0x705U | CAN_RTR_FLAG, {}).empty());
}

TEST_F(DriveTest, stores_its_parameters_and_restores_the_defaults_when_it_is_signed) {
  EXPECT_EQ(sdo({0x40, 0x10, 0x10, 1, 0, 0, 0, 0}), "43 10 10 01 01 00 00 00");  // on command
  EXPECT_EQ(sdo({0x23, 0x10, 0x10, 1, 's', 'a', 'v', 'f'}), "80 10 10 01 20 00 00 08");
  sdo({0x2B, 0x17, 0x10, 0, 100, 0, 0, 0});
  sdo({0x23, 0x65, 0x60, 0, 77, 0, 0, 0});
  EXPECT_EQ(sdo({0x23, 0x10, 0x10, 1, 's', 'a', 'v', 'e'}), "60 10 10 01 00 00 00 00");
  sdo({0x2B, 0x17, 0x10, 0, 50, 0, 0, 0});
  sdo({0x23, 0x65, 0x60, 0, 88, 0, 0, 0});
  send(0x000, {0x82, 0x05});  // the communication only
  EXPECT_EQ(drive.value(0x1017), 100);
  EXPECT_EQ(drive.value(0x6065), 88);
  send(0x000, {0x81, 0x05});
  EXPECT_EQ(drive.value(0x6065), 77);
  EXPECT_EQ(sdo({0x23, 0x11, 0x10, 1, 's', 'a', 'v', 'e'}), "80 11 10 01 20 00 00 08");
  EXPECT_EQ(sdo({0x23, 0x11, 0x10, 1, 'l', 'o', 'a', 'd'}), "60 11 10 01 00 00 00 00");
  EXPECT_EQ(drive.value(0x6065), 77) << "from the next reset on";
  send(0x000, {0x81, 0x05});
  EXPECT_EQ(drive.value(0x6065), 2000);
  EXPECT_EQ(drive.value(0x1017), 0);
}

TEST_F(DriveTest, counts_syncs_when_it_is_told_to) {
  EXPECT_EQ(sdo({0x2F, 0x19, 0x10, 0, 1, 0, 0, 0}), "80 19 10 00 30 00 09 06");
  EXPECT_EQ(sdo({0x2F, 0x19, 0x10, 0, 241, 0, 0, 0}), "80 19 10 00 30 00 09 06");
  sdo({0x23, 0x06, 0x10, 0, 1, 0, 0, 0});
  EXPECT_EQ(sdo({0x2F, 0x19, 0x10, 0, 4, 0, 0, 0}), "80 19 10 00 22 00 00 08");  // not with a cycle period
  sdo({0x23, 0x06, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(sdo({0x2F, 0x19, 0x10, 0, 4, 0, 0, 0}), "60 19 10 00 00 00 00 00");
  sdo({0x23, 0x02, 0x18, 1, 0x85, 0x03, 0, 0x80});
  sdo({0x2F, 0x02, 0x18, 2, 2, 0, 0, 0});
  sdo({0x2F, 0x02, 0x18, 6, 3, 0, 0, 0});  // the SYNC with counter 3 is the first
  sdo({0x23, 0x02, 0x18, 1, 0x85, 0x03, 0, 0});
  send(0x000, {0x01, 0x05});
  std::vector<std::size_t> sent;
  for (const unsigned counter : {1U, 2U, 3U, 4U, 1U, 2U}) {
    sent.push_back(only(0x385, send(0x080, {counter})).size());
  }
  EXPECT_EQ(sent, (std::vector<std::size_t>{0, 0, 0, 1, 0, 1}));
  // CiA 301: unexpected SYNC data length.
  EXPECT_EQ(emergencies(send(0x080, {})), std::vector<std::string>{"40 82 11"});
  EXPECT_EQ(emergencies(send(0x080, {})), std::vector<std::string>{}) << "once";
  EXPECT_EQ(emergencies(send(0x080, {1})), std::vector<std::string>{"00 00 00"});
}

TEST_F(DriveTest, listens_for_the_sync_where_it_is_told_to_and_sends_none) {
  sdo({0x23, 0x05, 0x10, 0, 0x90, 0, 0, 0});
  send(0x000, {0x01, 0x05});
  EXPECT_TRUE(send(0x080, {}).empty());
  EXPECT_EQ(only(0x385, send(0x090, {})).size(), 1U);
  EXPECT_EQ(sdo({0x23, 0x05, 0x10, 0, 0x80, 0, 0, 0x40}), "80 05 10 00 30 00 09 06");
}

// ---- its data sheet ----

using Section = std::map<std::string, std::string>;

std::map<std::string, Section> parsed(const std::string& sheet) {
  std::map<std::string, Section> sections;
  std::istringstream lines(sheet);
  std::string name;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t equals = line.find('=');
    if (line.starts_with("[")) {
      name = line.substr(1, line.find(']') - 1);
      EXPECT_FALSE(sections.contains(name)) << name;
      sections[name];
    } else if (equals != std::string::npos) {
      EXPECT_FALSE(sections[name].contains(line.substr(0, equals))) << name << ": " << line;
      sections[name][line.substr(0, equals)] = line.substr(equals + 1);
    } else {
      EXPECT_EQ(line, "");
    }
  }
  return sections;
}

// CiA 306: numbers as in C, and the node number as a name.
std::int64_t number(const std::string& text, int node) {
  const std::string plus = "$NODEID+";
  return text.starts_with(plus) ? node + std::stoll(text.substr(plus.size()), nullptr, 0)
                                : std::stoll(text, nullptr, 0);
}

TEST_F(DriveTest, its_data_sheet_says_what_the_standards_say) {
  const auto sheet = parsed(Drive::data_sheet({.node = 5}));
  const struct {
    const char *section, *type, *access, *standard, *mapped;
  } table[] = {
      {"1000", "0x0007", "const", "0x20192", "0"},
      {"1001", "0x0005", "ro", "0x0", "0"},
      {"1005", "0x0007", "rw", "0x80", "0"},
      {"1008", "0x0009", "const", "punctum-drive", "0"},
      {"1014", "0x0007", "ro", "$NODEID+0x80", "0"},
      {"1017", "0x0006", "rw", "0x0", "0"},
      {"1018sub0", "0x0005", "const", "0x4", "0"},
      {"1200sub1", "0x0007", "ro", "$NODEID+0x600", "0"},
      {"1400sub1", "0x0007", "rw", "$NODEID+0x200", "0"},
      {"1403sub1", "0x0007", "rw", "$NODEID+0x80000500", "0"},
      {"1802sub2", "0x0005", "rw", "0x1", "0"},
      {"1A02sub2", "0x0007", "rw", "0x60640020", "0"},
      {"6040", "0x0006", "rw", "0x0", "1"},
      {"6041", "0x0006", "ro", "0x250", "1"},
      {"605A", "0x0003", "rw", "2", "0"},
      {"6060", "0x0002", "rw", "8", "1"},
      {"6061", "0x0002", "ro", "8", "1"},
      {"6064", "0x0004", "ro", "0", "1"},
      {"607A", "0x0004", "rw", "0", "1"},
      {"607Dsub1", "0x0004", "rw", "-2147483648", "0"},
      {"60C2sub2", "0x0002", "rw", "-3", "0"},
      {"6502", "0x0007", "const", "0xA0", "0"},
  };
  for (const auto& row : table) {
    ASSERT_TRUE(sheet.contains(row.section)) << row.section;
    const Section& section = sheet.at(row.section);
    EXPECT_EQ(section.at("ObjectType"), "0x7") << row.section;
    EXPECT_EQ(section.at("DataType"), row.type) << row.section;
    EXPECT_EQ(section.at("AccessType"), row.access) << row.section;
    EXPECT_EQ(section.at("DefaultValue"), row.standard) << row.section;
    EXPECT_EQ(section.at("PDOMapping"), row.mapped) << row.section;
  }
  EXPECT_EQ(sheet.at("1018").at("ObjectType"), "0x9");
  EXPECT_EQ(sheet.at("1018").at("SubNumber"), "5");
  EXPECT_EQ(sheet.at("607D").at("ObjectType"), "0x8");
  EXPECT_EQ(sheet.at("MandatoryObjects"),
            (Section{{"SupportedObjects", "3"}, {"1", "0x1000"}, {"2", "0x1001"}, {"3", "0x1018"}}));
  EXPECT_EQ(sheet.at("DeviceInfo").at("NrOfRXPDO"), "4");
  EXPECT_EQ(sheet.at("DeviceInfo").at("NrOfTXPDO"), "4");
  EXPECT_EQ(sheet.at("DeviceInfo").at("LSS_Supported"), "0");
}

// Over the wire: what is there, its length, its value, whether it can be written, whether it can be mapped.
TEST_F(DriveTest, its_data_sheet_is_what_the_drive_answers) {
  const auto sheet = parsed(Drive::data_sheet({.node = 5}));
  std::set<unsigned> listed;
  for (const char* objects : {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}) {
    for (const auto& [key, value] : sheet.at(objects)) {
      if (key != "SupportedObjects") {
        listed.insert(static_cast<unsigned>(number(value, 5)));
      }
    }
  }
  sdo({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x80});  // TPDO 1 is for trying what can be mapped
  sdo({0x2F, 0x00, 0x1A, 0, 0, 0, 0, 0});
  std::size_t variables = 0;
  for (unsigned index = 0x1000; index <= 0x9FFF; ++index) {
    const unsigned low = index & 0xFF, high = index >> 8;
    const bool is_there = !sdo({0x40, low, high, 0, 0, 0, 0, 0}).ends_with("00 00 02 06");
    ASSERT_EQ(is_there, listed.contains(index)) << std::hex << index;
    if (!is_there) {
      continue;
    }
    char hex[16];
    std::snprintf(hex, sizeof(hex), "%04X", index);
    const bool composed = sheet.at(hex).at("ObjectType") != "0x7";
    std::size_t subs = 0;
    for (unsigned sub = 0; sub < 256; ++sub) {
      const std::string answer = sdo({0x40, low, high, sub, 0, 0, 0, 0});
      char name[24];
      std::snprintf(name, sizeof(name), composed ? "%04Xsub%X" : "%04X", index, sub);
      if (answer.ends_with("11 00 09 06")) {
        ASSERT_FALSE(composed && sheet.contains(name)) << name;
        continue;
      }
      ++subs;
      ++variables;
      ASSERT_TRUE(sheet.contains(name)) << name;
      const Section& section = sheet.at(name);
      const std::string& access = section.at("AccessType");
      // Its length by CiA 301: 8, 16 and 32 bits, or a text.
      const std::int64_t type = number(section.at("DataType"), 5);
      const std::map<std::int64_t, std::string> begins = {{2, "4F"}, {3, "4B"}, {4, "43"}, {5, "4F"},
                                                          {6, "4B"}, {7, "43"}, {9, "41"}};
      ASSERT_TRUE(begins.contains(type)) << name;
      EXPECT_EQ(answer.substr(0, 2), begins.at(type)) << name;
      if (type == 9) {
        EXPECT_EQ(std::stoll(answer.substr(12, 2), nullptr, 16),
                  static_cast<std::int64_t>(section.at("DefaultValue").size()));
      } else if (index != 0x1800 && index != 0x1A00 && index != 0x6064) {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i) {
          value |= static_cast<std::uint32_t>(std::stoul(answer.substr(12 + 3 * i, 2), nullptr, 16)) << 8 * i;
        }
        const unsigned unused = type == 2 || type == 5 ? 24 : type == 3 || type == 6 ? 16 : 0;
        const auto told = static_cast<std::uint32_t>(number(section.at("DefaultValue"), 5));
        EXPECT_EQ(value, told << unused >> unused) << name;
      }
      // A length that no object has: read only is told first.
      const std::string written = sdo({0x27, low, high, sub, 0, 0, 0, 0});
      EXPECT_EQ(written.ends_with("02 00 01 06"), access == "ro" || access == "const")
          << name << ": " << written;
      if (type != 9) {
        const unsigned bits = type == 2 || type == 5 ? 8 : type == 3 || type == 6 ? 16 : 32;
        const std::string mapped = sdo({0x23, 0x00, 0x1A, 1, bits, sub, low, high});
        EXPECT_EQ(mapped == "60 00 1A 01 00 00 00 00", section.at("PDOMapping") == "1")
            << name << ": " << mapped;
      }
    }
    if (composed) {
      EXPECT_EQ(sheet.at(hex).at("SubNumber"), std::to_string(subs)) << hex;
    }
  }
  EXPECT_GT(variables, 100U);
}

}  // namespace
}  // namespace punctum::emulator
