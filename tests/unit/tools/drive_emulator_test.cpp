// The emulated drive, byte by byte: what a CANopen slave must answer by CiA 301 and CiA 402. The master of
// hal/cia402 has no part in this.
#include <gtest/gtest.h>
#include <linux/can.h>

#include <algorithm>
#include <cstdio>
#include <initializer_list>
#include <string>
#include <vector>

#include "tools/emulators/drive/drive.hpp"

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
    const auto answers = send(0x605, request);
    return answers.size() == 1 && answers[0].can_id == 0x585 && answers[0].can_dlc == 8 ? text(answers[0])
                                                                                        : "";
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
  EXPECT_EQ(sdo({0x70, 0, 0, 0, 0, 0, 0, 0}), "80 00 00 00 00 00 03 05");  // the toggle bit did not alternate
}

TEST_F(DriveTest, aborts_with_the_code_of_the_standard) {
  EXPECT_EQ(sdo({0x40, 0x00, 0x20, 0, 0, 0, 0, 0}), "80 00 20 00 00 00 02 06");  // no object
  EXPECT_EQ(sdo({0x40, 0x18, 0x10, 9, 0, 0, 0, 0}), "80 18 10 09 11 00 09 06");  // no sub-index
  EXPECT_EQ(sdo({0x23, 0x00, 0x10, 0, 1, 0, 0, 0}), "80 00 10 00 02 00 01 06");  // read only
  EXPECT_EQ(sdo({0x23, 0x17, 0x10, 0, 1, 0, 0, 0}), "80 17 10 00 10 00 07 06");  // length
  EXPECT_EQ(sdo({0x2F, 0x60, 0x60, 0, 3, 0, 0, 0}), "80 60 60 00 30 00 09 06");  // mode that it has not
  EXPECT_EQ(sdo({0x21, 0x17, 0x10, 0, 9, 0, 0, 0}), "80 17 10 00 00 00 01 06");  // segmented download
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
  sdo({0x23, 0x01, 0x18, 1, 0x85, 0x02, 0, 0x80});
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
  const auto told = drive.step(now);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].can_id, 0x085U);
  EXPECT_EQ(text(told[0]), "05 73 01 00 00 00 00 00");
  pass(10 * kMs);
  EXPECT_EQ(drive.state(), DriveState::fault);
  control(0x0F);
  EXPECT_EQ(drive.state(), DriveState::fault);
  const auto gone = send(0x605, {0x2B, 0x40, 0x60, 0, 0x80, 0, 0, 0});
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  ASSERT_EQ(gone.size(), 2U);
  EXPECT_EQ(text(gone[0]), "00 00 00 00 00 00 00 00");  // the error is gone
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

}  // namespace
}  // namespace punctum::emulator
