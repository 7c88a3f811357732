// The emulated devices, line by line, as the manual of the Zaber ASCII protocol says that they answer. The
// driver of hal/zaber has no part in this.
#include <gtest/gtest.h>

#include <string>

#include "tools/emulators/positioner/positioner.hpp"

namespace punctum::emulator {
namespace {

class PositionerEmulator : public testing::Test {
 protected:
  std::string ask(const std::string& line) {
    devices.receive(line + "\n", now_ns);
    return devices.step(now_ns);
  }
  void pass(double seconds) {
    now_ns += static_cast<std::int64_t>(seconds * 1e9);
    (void)devices.step(now_ns);
  }
  Positioner devices{{.devices = 2, .axes = 1, .max_microsteps = 100'000, .speed = 10'000, .start = 5000}};
  std::int64_t now_ns = 1'000'000'000;
};

TEST_F(PositionerEmulator, answers_in_the_form_of_the_protocol) {
  EXPECT_EQ(ask("/1 1 get pos"), "@01 1 OK IDLE -- 5000\r\n");
  EXPECT_EQ(ask("/2 0 get pos"), "@02 0 OK IDLE -- 5000\r\n");
  EXPECT_EQ(ask("/1 1 7 get limit.max"), "@01 1 07 OK IDLE -- 100000\r\n");
  EXPECT_EQ(ask("/"), "@01 0 OK IDLE -- 0\r\n@02 0 OK IDLE -- 0\r\n");
  EXPECT_EQ(ask("/3 1 get pos"), "");
  EXPECT_EQ(ask("hello"), "");
  EXPECT_EQ(ask("/1 tools echo 1 2"), "@01 0 OK IDLE -- 1 2\r\n");
}

TEST_F(PositionerEmulator, rejects_with_the_reason) {
  EXPECT_EQ(ask("/1 1 move abs 100001"), "@01 1 RJ IDLE -- BADDATA\r\n");
  EXPECT_EQ(ask("/1 1 move abs"), "@01 1 RJ IDLE -- BADDATA\r\n");
  EXPECT_EQ(ask("/1 1 fly"), "@01 1 RJ IDLE -- BADCOMMAND\r\n");
  EXPECT_EQ(ask("/1 2 get pos"), "@01 2 RJ IDLE -- BADAXIS\r\n");
  EXPECT_EQ(ask("/1 1 get nonsense"), "@01 1 RJ IDLE -- BADCOMMAND\r\n");
}

TEST_F(PositionerEmulator, moves_in_time_and_is_busy_meanwhile) {
  EXPECT_EQ(ask("/1 1 move abs 15000"), "@01 1 OK BUSY -- 0\r\n");
  pass(0.5);  // 10 000 microsteps/s, reached in 10 ms
  EXPECT_NEAR(devices.position(1), 10'000, 100);
  EXPECT_EQ(devices.position(2), 5000);
  EXPECT_EQ(ask("/1 1").substr(0, 14), "@01 1 OK BUSY ");
  pass(1);
  EXPECT_EQ(ask("/1 1 get pos"), "@01 1 OK IDLE -- 15000\r\n");
  ask("/1 1 move rel -1000");
  pass(1);
  EXPECT_EQ(devices.position(1), 14'000);
  ask("/1 1 home");
  pass(5);
  EXPECT_EQ(devices.position(1), 0);
}

TEST_F(PositionerEmulator, a_stop_brakes_and_a_new_move_replaces_the_old_one) {
  ask("/1 1 move abs 90000");
  pass(1);
  const double at = devices.position(1);
  EXPECT_EQ(ask("/1 1 stop").substr(0, 9), "@01 1 OK ");
  pass(1);
  EXPECT_NEAR(devices.position(1), at, 100);  // v^2 / 2a = 50
  EXPECT_EQ(devices.speed(1), 0);
  ask("/1 1 move abs 90000");
  pass(0.5);
  ask("/1 1 move abs 0");
  pass(20);
  EXPECT_EQ(devices.position(1), 0);
}

// By python3: "%02X" % (-sum(map(ord, "1 1 get pos")) & 255), and of the answer likewise.
TEST_F(PositionerEmulator, checks_and_gives_checksums) {
  EXPECT_EQ(ask("/1 1 get pos:00"), "");
  EXPECT_EQ(ask("/1 1 get pos:0x"), "");
  EXPECT_EQ(ask("/1 1 get pos:AC"), "@01 1 OK IDLE -- 5000:F7\r\n");
}

TEST_F(PositionerEmulator, misbehaves_on_demand) {
  EXPECT_EQ(devices.command("stall 1"), "");
  EXPECT_EQ(ask("/1 1 get pos"), "@01 1 OK IDLE FS 5000\r\n");
  EXPECT_EQ(ask("/1 1 warnings"), "@01 1 OK IDLE FS 01 FS\r\n");
  ask("/1 1 warnings clear");
  EXPECT_EQ(ask("/1 1 get pos"), "@01 1 OK IDLE -- 5000\r\n");
  EXPECT_EQ(devices.command("unhome 2"), "");
  EXPECT_EQ(ask("/2 1 move abs 6000"), "@02 1 RJ IDLE WR BADDATA\r\n");
  EXPECT_EQ(devices.command("mute 1"), "");
  EXPECT_EQ(ask("/1 1"), "");
  EXPECT_EQ(ask("/1 1"), "@01 1 OK IDLE -- 0\r\n");
  EXPECT_EQ(devices.command("late 20"), "");
  EXPECT_EQ(ask("/1 1"), "");
  now_ns += 20'000'000;
  EXPECT_EQ(devices.step(now_ns), "@01 1 OK IDLE -- 0\r\n");
  for (const char* wrong :
       {"stall", "stall 3", "stall x", "flag", "flag W 1", "nonsense", "late -1", "mute x", "reject"}) {
    EXPECT_NE(devices.command(wrong), "") << wrong;
  }
}

}  // namespace
}  // namespace punctum::emulator
