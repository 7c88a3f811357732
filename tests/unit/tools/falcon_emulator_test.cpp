// The emulated Falcon byte by byte, as libnifalcon, FTDI's application notes and the kernel's USB/IP document
// say: not as the driver in hal/falcon wants it.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tools/emulators/falcon/falcon.hpp"
#include "tools/emulators/falcon/usbip.hpp"

namespace punctum::emulator {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::int64_t kMs_ns = 1'000'000;

class StillHand final : public Hand {
 public:
  Grip grip(std::int64_t) override { return at; }
  void push(const Triple& force_N, std::int64_t) override { force = force_N; }
  Grip at;
  Triple force{};
};

class FalconEmulatorTest : public testing::Test {
 protected:
  void make(const FalconParams& params) {
    falcon = std::make_unique<FalconEmulator>(params, hand);
    now_ns = 10 * kMs_ns;
  }
  void frames_mode() {
    for (const auto& [request, value] : {std::pair{9, 1}, {3, 2}, {0, 1}, {0, 2}}) {
      ASSERT_TRUE(
          falcon->request(static_cast<std::uint8_t>(request), static_cast<std::uint16_t>(value), now_ns));
    }
  }
  Bytes next_in(std::int64_t within_ns = 300 * kMs_ns) {
    const std::int64_t until_ns = now_ns + within_ns;
    while (now_ns <= until_ns) {
      if (auto packet = falcon->in(now_ns)) {
        return *packet;
      }
      now_ns = std::max(now_ns + 1000, falcon->next_in_ns(now_ns));
    }
    return {};
  }
  // The next one that holds more than the status.
  std::string next_text() {
    for (int i = 0; i < 400; ++i) {
      const Bytes packet = next_in();
      if (packet.size() > 2) {
        return {packet.begin() + 2, packet.end()};
      }
    }
    return {};
  }
  // So many bytes of it, in however many packets: at 9600 baud the latency timer may come in between.
  std::string next_text(std::size_t size) {
    std::string text;
    for (std::string more = next_text(); !more.empty(); more = text.size() < size ? next_text() : "") {
      text += more;
    }
    return text;
  }
  void out(const std::string& text) { ASSERT_TRUE(falcon->out(Bytes(text.begin(), text.end()), now_ns)); }
  StillHand hand;
  std::unique_ptr<FalconEmulator> falcon;
  std::int64_t now_ns = 0;
};

TEST_F(FalconEmulatorTest, status_bytes_alone_come_with_the_latency_timer) {
  make({.booted = true, .homed = true});
  frames_mode();
  EXPECT_EQ(next_in(), (Bytes{0x01, 0x60}));
  const std::int64_t first_ns = now_ns;
  EXPECT_FALSE(falcon->in(first_ns + kMs_ns / 2));
  EXPECT_EQ(next_in().size(), 2U);
  EXPECT_EQ(now_ns - first_ns, kMs_ns);
  ASSERT_TRUE(falcon->request(9, 16, now_ns));
  const std::int64_t then_ns = now_ns;
  EXPECT_EQ(next_in().size(), 2U);
  EXPECT_EQ(now_ns - then_ns, 16 * kMs_ns);
}

// At z = 0.12 the arms stand at 23.92 degrees: (23.92 - 35) / 0.0364347 = -304 = 0xFED0: A N O P.
TEST_F(FalconEmulatorTest, one_frame_out_is_answered_by_one_frame_in) {
  make({.booted = true, .homed = true});
  frames_mode();
  hand.at.buttons = 0b0110;
  (void)next_in();
  out("<AAAAAAAAAAAAAA>");
  EXPECT_EQ(next_text(), std::string("<ANOPANOPANOP") + static_cast<char>(0x41 + 0x76) + "A>");
  EXPECT_EQ(next_in().size(), 2U);
  EXPECT_EQ(falcon->frames(), 1U);
}

TEST_F(FalconEmulatorTest, an_event_character_sends_a_packet_before_the_latency_timer) {
  for (const bool event : {false, true}) {
    make({.booted = true, .homed = true});
    frames_mode();
    ASSERT_TRUE(falcon->request(9, 16, now_ns));
    ASSERT_TRUE(falcon->request(6, event ? 0x013E : 0x003E, now_ns));
    (void)next_in();
    const std::int64_t begun_ns = now_ns;
    out("<AAAAAAAAAAAAAA>");
    EXPECT_EQ(next_text().size(), 16U);
    // Twice 16 bytes of 10 bits at 1.5 Mbaud are 0.213 ms.
    EXPECT_NEAR(1e-6 * static_cast<double>(now_ns - begun_ns), event ? 0.213 : 16.0, 0.01);
  }
}

TEST_F(FalconEmulatorTest, the_hand_is_told_that_the_force_is_gone_when_the_motors_are_off_and_at_a_reset) {
  make({.booted = true, .homed = true});
  frames_mode();
  const auto pushes = [this] { return hand.force != Triple{}; };
  out("<AAABAAABAAABAA>");  // 0x1000, three times
  EXPECT_EQ(next_text().size(), 16U);
  ASSERT_TRUE(pushes());
  falcon->motors_off(now_ns);
  EXPECT_FALSE(pushes());
  EXPECT_EQ(falcon->motors(), (std::array<int, 3>{}));
  out("<AAABAAABAAABAA>");
  EXPECT_EQ(next_text().size(), 16U);
  ASSERT_TRUE(pushes());
  ASSERT_TRUE(falcon->request(1, 0x0101, now_ns));
  EXPECT_FALSE(pushes());
}

TEST_F(FalconEmulatorTest, it_boots_as_libnifalcon_boots_it) {
  make({});
  const auto request = [this](int number, int value) {
    EXPECT_TRUE(
        falcon->request(static_cast<std::uint8_t>(number), static_cast<std::uint16_t>(value), now_ns));
  };
  for (const auto& [number, value] : {std::pair{0, 1},
                                      {0, 2},
                                      {9, 16},
                                      {3, 0x4138},
                                      {4, 8},
                                      {2, 0},
                                      {1, 0x0200},
                                      {1, 0x0100},
                                      {1, 0x0101}}) {
    request(number, value);
  }
  out("\x0a\x43\x0d");
  EXPECT_EQ(next_text(4), "\x0a\x44\x2c\x0d");
  request(1, 0x0100);
  request(3, 0x15);
  out("A");
  EXPECT_EQ(next_text(), "A");
  std::string image("\xAA\x08", 2);
  image += std::string(16, '\0') + std::string("\x3F\0\0\x80", 4);                      // reserved, entry
  image += std::string("\x02\0\x3F\0\x10\x90\x01\0\x02\0", 10) + std::string(2, '\0');  // a block, the end
  for (std::size_t at = 0; at < image.size(); at += 62) {
    out(image.substr(at, 62));
    EXPECT_EQ(next_text(image.substr(at, 62).size()), image.substr(at, 62));
  }
  EXPECT_EQ(falcon->processor(), FalconEmulator::Processor::running);
  EXPECT_EQ(falcon->loaded_words(), 2U);
  frames_mode();
  out("<AAAAAAAAAAAABA>");
  EXPECT_EQ(next_text().size(), 16U);
}

TEST_F(FalconEmulatorTest, a_stream_with_a_wrong_key_leaves_it_dead_until_it_is_reset) {
  make({});
  const auto greet = [this] {
    for (const auto& [number, value] : {std::pair{1, 0x0100}, {1, 0x0101}, {3, 0x4138}}) {
      EXPECT_TRUE(
          falcon->request(static_cast<std::uint8_t>(number), static_cast<std::uint16_t>(value), now_ns));
    }
    out("\x0a\x43\x0d");
    EXPECT_EQ(next_text(4), "\x0a\x44\x2c\x0d");
    EXPECT_TRUE(falcon->request(3, 0x15, now_ns));
    out("A");
    EXPECT_EQ(next_text(), "A");
  };
  greet();
  out("no");
  EXPECT_EQ(next_text(2), "no");
  EXPECT_EQ(falcon->processor(), FalconEmulator::Processor::dead);
  out("more");
  EXPECT_EQ(next_text(), "");
  greet();
}

TEST_F(FalconEmulatorTest, frames_at_another_baud_rate_or_damaged_ones_are_not_answered) {
  make({.booted = true, .homed = true});
  out("<AAAAAAAAAAAAAA>");  // 9600 baud from power-up
  EXPECT_EQ(next_text(), "");
  frames_mode();
  out("<AAAAAAAAAAAZAA>");
  out("xyz");
  EXPECT_EQ(next_text(), "");
  EXPECT_EQ(falcon->frames(), 0U);
  out("<AAAAAAAAAAAAAA>");
  EXPECT_EQ(next_text().size(), 16U);
}

// 0x0FC0 = 4032 on all three motors, at z = 0.12 on the axis. By hand: each arm's torque is -0.4032 N m;
// along the axis all rods share, and the work of a small motion dz is 3 * 0.4032 * dtheta: dtheta / dz
// is 13.28 rad/m (from the arms at z = 0.1195 and 0.1205), so 16.06 N towards the base.
TEST_F(FalconEmulatorTest, motors_push_the_grip_by_the_work_that_they_do) {
  make({.booted = true, .homed = true});
  frames_mode();
  out("<AMPAAMPAAMPAAA>");
  (void)next_text();
  EXPECT_EQ(falcon->motors(), (std::array<int, 3>{4032, 4032, 4032}));
  const double turned_rad = (*falcon_arms({0, 0, 0.1205}))[0] - (*falcon_arms({0, 0, 0.1195}))[0];
  EXPECT_NEAR(hand.force[2], -3 * 0.4032 * turned_rad / 0.001, 0.01);
  EXPECT_NEAR(hand.force[2], -16.06, 0.05);
  EXPECT_NEAR(hand.force[0], 0, 1e-9);
}

TEST_F(FalconEmulatorTest, an_arm_is_homed_where_it_passes_its_mark_while_that_is_asked_for) {
  make({.booted = true, .homes_after_ns = -1});
  frames_mode();
  const auto homed_bits = [this](const char* frame) {
    out(frame);
    const std::string text = next_text();
    return text.size() == 16 ? (static_cast<unsigned char>(text[13]) - 0x41) >> 4 : -1;
  };
  hand.at.position_m = {0, 0, 0.14};
  EXPECT_EQ(homed_bits("<AAAAAAAAAAAAAA>"), 0);
  hand.at.position_m = {0, 0, 0.12};
  EXPECT_EQ(homed_bits("<AAAAAAAAAAAAAA>"), 0) << "nobody asked";
  EXPECT_EQ(homed_bits("<AAAAAAAAAAAABA>"), 0);
  const int before = falcon->encoders()[0];
  hand.at.position_m = {0, 0, 0.14};
  EXPECT_EQ(homed_bits("<AAAAAAAAAAAABA>"), 7);
  EXPECT_EQ(falcon->encoders()[0], 115) << "(39.17 - 35) / 0.0364347";
  EXPECT_EQ(before, -304 + 311) << "from where it was switched on";
}

TEST_F(FalconEmulatorTest, one_that_hangs_answers_nothing_and_keeps_its_torque_until_its_supply_ends) {
  make({.booted = true, .homed = true});
  frames_mode();
  out("<AMPAAMPAAMPAAA>");
  (void)next_text();
  EXPECT_EQ(falcon->command("hang"), "");
  out("<AAAAAAAAAAAAAA>");
  EXPECT_EQ(next_text(), "");
  EXPECT_EQ(falcon->motors(), (std::array<int, 3>{4032, 4032, 4032}));
  EXPECT_EQ(falcon->frames(), 1U);
  falcon->power_on();
  EXPECT_EQ(falcon->motors(), (std::array<int, 3>{}));
  frames_mode();
  out("<AAAAAAAAAAAAAA>");
  EXPECT_EQ(next_text().size(), 16U);
}

TEST_F(FalconEmulatorTest, commands_that_are_none_are_told) {
  make({});
  EXPECT_EQ(falcon->command("short 3"), "");
  EXPECT_NE(falcon->command("short"), "");
  EXPECT_NE(falcon->command("short x"), "");
  EXPECT_NE(falcon->command("mute now").find("none of"), std::string::npos);
}

// ---- USB/IP ----

Bytes header(std::uint32_t command, std::uint32_t sequence, std::uint32_t direction, std::uint32_t endpoint,
             std::uint32_t flags, std::uint32_t length, const Bytes& setup = Bytes(8)) {
  Bytes bytes;
  for (const std::uint32_t word :
       {command, sequence, 0x10001U, direction, endpoint, flags, length, 0U, 0xFFFFFFFFU, 0U}) {
    for (const unsigned shift : {24U, 16U, 8U, 0U}) {
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
    }
  }
  bytes.insert(bytes.end(), setup.begin(), setup.end());
  return bytes;
}
int word(const Bytes& bytes, std::size_t number) {
  const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(4 * number);
  return static_cast<int>(static_cast<unsigned>(at[0]) << 24U | static_cast<unsigned>(at[1]) << 16U |
                          static_cast<unsigned>(at[2]) << 8U | at[3]);
}

class UsbIpTest : public testing::Test {
 protected:
  Bytes reply_to(const Bytes& bytes) {
    EXPECT_TRUE(device.take(bytes, now_ns));
    return said();
  }
  Bytes said() {
    device.step(now_ns);
    Bytes said = device.output();
    device.output().clear();
    return said;
  }
  StillHand hand;
  FalconEmulator falcon{{.booted = true, .homed = true}, hand};
  UsbIpDevice device{falcon};
  std::int64_t now_ns = kMs_ns;
};

TEST_F(UsbIpTest, it_is_a_falcon_by_its_descriptors) {
  const Bytes device_reply = reply_to(header(1, 5, 1, 0, 0, 64, {0x80, 6, 0, 1, 0, 0, 64, 0}));
  ASSERT_EQ(device_reply.size(), 48U + 18U);
  EXPECT_EQ(word(device_reply, 0), 3);
  EXPECT_EQ(word(device_reply, 1), 5);
  EXPECT_EQ(word(device_reply, 5), 0);
  EXPECT_EQ(word(device_reply, 6), 18);
  EXPECT_EQ(word(device_reply, 8), -1) << "packets of an isochronous transfer: none";
  const Bytes ids(device_reply.begin() + 56, device_reply.begin() + 60);
  EXPECT_EQ(ids, (Bytes{0x03, 0x04, 0x48, 0xCB}));
  EXPECT_EQ(reply_to(header(1, 6, 1, 0, 0, 9, {0x80, 6, 0, 2, 0, 0, 9, 0})).size(), 48U + 9U);
  const Bytes stalled = reply_to(header(1, 7, 1, 0, 0, 9, {0x80, 6, 0, 6, 0, 0, 10, 0}));
  EXPECT_EQ(word(stalled, 5), -32);
  EXPECT_EQ(word(reply_to(header(1, 8, 0, 0, 0, 0, {0x00, 9, 1, 0, 0, 0, 0, 0})), 5), 0);
  EXPECT_EQ(word(reply_to(header(1, 9, 0, 0, 0, 0, {0x40, 99, 1, 0, 0, 0, 0, 0})), 5), -32);
}

TEST_F(UsbIpTest, a_transfer_in_waits_for_its_packet_and_may_come_in_pieces) {
  (void)falcon.in(now_ns);
  const Bytes asks = header(1, 21, 1, 1, 0, 64);
  EXPECT_TRUE(reply_to({asks.begin(), asks.begin() + 20}).empty());
  EXPECT_TRUE(reply_to({asks.begin() + 20, asks.end()}).empty());
  now_ns += 16 * kMs_ns;
  const Bytes reply = said();
  ASSERT_EQ(reply.size(), 50U);
  EXPECT_EQ(word(reply, 1), 21);
  EXPECT_EQ(word(reply, 6), 2);
}

TEST_F(UsbIpTest, a_packet_that_does_not_fit_is_an_overflow) {
  EXPECT_EQ(falcon.command("oversized 1"), "");
  for (const int value : {1, 2}) {
    (void)reply_to(header(1, 1, 0, 0, 0, 0,
                          {0x40, static_cast<std::uint8_t>(value == 1 ? 9 : 3),
                           static_cast<std::uint8_t>(value), 0, 0, 0, 0, 0}));
  }
  Bytes frame = header(1, 2, 0, 2, 0, 16);
  for (const char letter : std::string("<AAAAAAAAAAAAAA>")) {
    frame.push_back(static_cast<std::uint8_t>(letter));
  }
  EXPECT_EQ(word(reply_to(frame), 6), 16) << "taken";
  (void)falcon.in(now_ns);
  EXPECT_TRUE(reply_to(header(1, 3, 1, 1, 0, 64)).empty());
  now_ns += kMs_ns;
  const Bytes reply = said();
  EXPECT_EQ(word(reply, 5), -75);
  EXPECT_EQ(reply.size(), 48U + 64U) << "as much as was asked for";
}

TEST_F(UsbIpTest, an_unlinked_transfer_is_answered_once) {
  (void)falcon.in(now_ns);
  EXPECT_TRUE(reply_to(header(1, 31, 1, 1, 0, 64)).empty());
  const Bytes gone = reply_to(header(2, 32, 0, 0, 31, 0));
  ASSERT_EQ(gone.size(), 48U);
  EXPECT_EQ(word(gone, 0), 4);
  EXPECT_EQ(word(gone, 1), 32);
  EXPECT_EQ(word(gone, 5), -104);
  const Bytes unknown = reply_to(header(2, 33, 0, 0, 31, 0));
  EXPECT_EQ(word(unknown, 5), 0);
  now_ns += 100 * kMs_ns;
  EXPECT_TRUE(said().empty());
}

TEST_F(UsbIpTest, what_is_no_usbip_ends_it_with_a_reason) {
  EXPECT_FALSE(device.take(header(9, 1, 0, 0, 0, 0), now_ns));
  EXPECT_NE(device.problem(), "");
  UsbIpDevice other(falcon);
  EXPECT_FALSE(other.take(header(1, 1, 0, 2, 0, 1U << 30U), now_ns));
}

}  // namespace
}  // namespace punctum::emulator
