// Frames and firmware of the Falcon, byte by byte.
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "hal/falcon/boot_stream.hpp"
#include "hal/falcon/frame.hpp"

namespace punctum::falcon {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes packet_of(const std::string& payload) {
  Bytes packet = {0x01, 0x60};
  packet.insert(packet.end(), payload.begin(), payload.end());
  return packet;
}

// By hand: each number as four nibbles, the least significant first, each nibble as 'A' and on.
TEST(FalconFrame, a_command_is_sixteen_letters) {
  const auto text = [](const Counts& motors, Light light) {
    const auto frame = command_frame(motors, light);
    return std::string(frame.begin(), frame.end());
  };
  EXPECT_EQ(text({0, 0, 0}, Light::none), "<AAAAAAAAAAAABA>");
  EXPECT_EQ(text({0x1234, 1, -1}, Light::green), "<EDCBBAAAPPPPDA>");
  EXPECT_EQ(text({-4096, 4096, 0}, Light::red), "<AAAPAAABAAAAJA>");
  EXPECT_EQ(text({0, 0, 0}, Light::blue), "<AAAAAAAAAAAAFA>");
}

TEST(FalconFrame, a_reply_is_read_back) {
  FrameReader reader;
  const auto reply =
      reader.take(packet_of("<EDCBBAAAPPPP\xB6"
                            "A>"));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->encoders, (Counts{0x1234, 1, -1}));
  EXPECT_EQ(reply->buttons, 0b0101);
  EXPECT_TRUE(reply->homed);
  const auto partly =
      reader.take(packet_of("<AAAIAAAAAAAA\x72"
                            "A>"));
  ASSERT_TRUE(partly);
  EXPECT_EQ(partly->encoders[0], -32768);
  EXPECT_EQ(partly->buttons, 1);
  EXPECT_FALSE(partly->homed) << "two of three";
}

TEST(FalconFrame, status_bytes_alone_and_less_are_nothing) {
  FrameReader reader;
  EXPECT_FALSE(reader.take(Bytes{}));
  EXPECT_FALSE(reader.take(Bytes{0x01}));
  EXPECT_FALSE(reader.take(Bytes{0x01, 0x60}));
  EXPECT_EQ(reader.counts().malformed, 0U);
}

TEST(FalconFrame, a_frame_may_come_in_pieces_with_status_bytes_between) {
  FrameReader reader;
  EXPECT_FALSE(reader.take(packet_of("<EDCBB")));
  EXPECT_FALSE(reader.take(packet_of("")));
  EXPECT_FALSE(reader.take(packet_of("AAAPPPPA")));
  const auto reply = reader.take(packet_of("A>"));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->encoders, (Counts{0x1234, 1, -1}));
  EXPECT_EQ(reader.counts().malformed, 0U);
}

TEST(FalconFrame, of_two_in_a_packet_the_later_counts) {
  FrameReader reader;
  const auto reply = reader.take(packet_of("<AAAAAAAAAAAAAA><BAAACAAADAAAAA>"));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->encoders, (Counts{1, 2, 3}));
  EXPECT_EQ(reader.counts().frames, 2U);
}

TEST(FalconFrame, what_is_none_is_counted_and_the_next_one_is_whole) {
  for (const char* wrong : {"<AAAAAAAAAAAAAAA", "<AAAA>", "<AAAQAAAAAAAAAA>", "<AAA@AAAAAAAAAA>",
                            "<AAAA\xE7"
                            "AAAAAAAAA>",
                            "<<",
                            "<AAAAAAAAAAAA\xC1"
                            "A>",
                            "<AAAA<"}) {
    FrameReader reader;
    EXPECT_FALSE(reader.take(packet_of(wrong))) << wrong;
    const auto reply = reader.take(packet_of("<BAAACAAADAAAAA>"));
    ASSERT_TRUE(reply) << wrong;
    EXPECT_EQ(reply->encoders, (Counts{1, 2, 3})) << wrong;
    EXPECT_GE(reader.counts().malformed, 1U) << wrong;
  }
}

TEST(FalconFrame, bytes_before_a_frame_are_passed_over) {
  FrameReader reader;
  ASSERT_TRUE(reader.take(packet_of("AAPP>x<BAAACAAADAAAAA>")));
  EXPECT_EQ(reader.counts().malformed, 0U);
}

TEST(FalconFrame, a_packet_that_the_chip_calls_damaged_is_dropped_with_what_it_continues) {
  for (const unsigned error : {0x02U, 0x04U, 0x08U}) {
    FrameReader reader;
    EXPECT_FALSE(reader.take(packet_of("<BAAACAAA")));
    auto damaged = packet_of("DAAAAA>");
    damaged[1] = static_cast<std::uint8_t>(0x60U | error);
    EXPECT_FALSE(reader.take(damaged));
    EXPECT_EQ(reader.counts().line_errors, 1U);
    EXPECT_FALSE(reader.take(packet_of("DAAAAA>")));
    EXPECT_TRUE(reader.take(packet_of("<BAAACAAADAAAAA>")));
  }
}

// ---- the boot stream, as TI's boot ROM guides print it ----

// Example of SPRU963 section 2.10, 8 bits wide: two blocks, entry 0x3F8000.
const Bytes kExample = {0xAA, 0x08, 0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0,
                        0,    0,    0,    0,    0,    0x3F, 0x00, 0x00, 0x80, 0x05, 0x00, 0x3F, 0x00,
                        0x10, 0x90, 0x01, 0x00, 0x02, 0x00, 0x03, 0x00, 0x04, 0x00, 0x05, 0x00, 0x02,
                        0x00, 0x3F, 0x00, 0x00, 0x80, 0x00, 0x77, 0x25, 0x76, 0x00, 0x00};

std::string error_of(const Bytes& image) {
  const auto checked = check_boot_stream(image);
  return checked ? "" : checked.error();
}

TEST(FalconBootStream, the_example_of_the_manual_is_one) {
  const auto checked = check_boot_stream(kExample);
  ASSERT_TRUE(checked) << checked.error();
  EXPECT_EQ(checked->entry, 0x3F8000U);
  EXPECT_EQ(checked->blocks, 2);
  EXPECT_EQ(checked->words, 7U);
}

TEST(FalconBootStream, every_beginning_of_it_is_none) {
  for (std::size_t size = 0; size < kExample.size(); ++size) {
    const std::string error =
        error_of({kExample.begin(), kExample.begin() + static_cast<std::ptrdiff_t>(size)});
    EXPECT_NE(error.find("ends in"), std::string::npos) << size << ": " << error;
  }
}

TEST(FalconBootStream, what_is_wrong_is_said_with_its_place) {
  Bytes wide = kExample;
  wide[1] = 0x10;
  EXPECT_EQ(error_of(wide),
            "byte 0: begins with 0x10AA, allowed: a C2000 boot stream, which begins with 0x08AA");
  Bytes more = kExample;
  more.push_back(0);
  EXPECT_EQ(error_of(more), "byte 50: 1 bytes behind its end, allowed: none");
  Bytes high = kExample;
  high[24] = 0x40;
  EXPECT_EQ(error_of(high), "byte 28: address 0x409010, allowed: up to 0x3FFFFF");
  Bytes entry = kExample;
  entry[19] = 1;
  EXPECT_NE(error_of(entry).find("address 0x13F8000"), std::string::npos) << error_of(entry);
  Bytes empty(kExample.begin(), kExample.begin() + 22);
  empty.push_back(0);
  empty.push_back(0);
  EXPECT_EQ(error_of(empty), "byte 24: holds no block, allowed: at least one");
  Bytes over = kExample;  // five words from the last address on
  over[24] = 0x3F;
  over[26] = 0xFE;
  over[27] = 0xFF;
  EXPECT_NE(error_of(over).find("address 0x3FFFFE"), std::string::npos) << error_of(over);
  EXPECT_NE(error_of(Bytes((1U << 20U) + 1)).find("at most 1048576"), std::string::npos);
}

TEST(FalconBootStream, a_file_is_named_in_what_is_wrong_with_it) {
  const std::string path = testing::TempDir() + "falcon_boot_stream";
  const auto missing = read_boot_stream(path + "_missing");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error(),
            "falcon.firmware = \"" + path + "_missing\": cannot be read, allowed: a file with a boot stream");
  std::ofstream(path, std::ios::binary) << "hello, this is no firmware";
  const auto text = read_boot_stream(path);
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().find("begins with 0x6568"), std::string::npos) << text.error();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(kExample.data()), static_cast<std::streamsize>(kExample.size()));
  const auto read = read_boot_stream(path);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(*read, kExample);
  EXPECT_FALSE(read_boot_stream(testing::TempDir())) << "a folder";
}

}  // namespace
}  // namespace punctum::falcon
