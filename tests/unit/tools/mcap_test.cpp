// Recordings that end early, lie or were damaged: what whole chunks hold is read, and every byte that differs
// is one clear error.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/full_disk.hpp"
#include "tools/record/mcap_reader.hpp"
#include "tools/record/mcap_writer.hpp"

namespace punctum::tools::mcap {
namespace {

namespace fs = std::filesystem;

struct Told {
  std::string topic;
  std::uint32_t sequence;
  std::uint64_t log_ns, publish_ns;
  std::string data;
  bool operator==(const Told&) const = default;
};

struct ReadBack {
  std::vector<Told> messages;
  std::string error;
  bool finished = false;
  std::uint64_t complete = 0;
};

ReadBack read_back(tl::expected<Reader, std::string> reader) {
  ReadBack r;
  if (!reader) {
    r.error = reader.error();
    return r;
  }
  Message m;
  for (;;) {
    const auto more = reader->next(m);
    if (!more) {
      r.error = more.error();
    }
    if (!more || !*more) {
      break;
    }
    r.messages.push_back(
        {reader->channels().at(m.channel).topic, m.sequence, m.log_ns, m.publish_ns, std::string(m.data)});
  }
  r.finished = reader->finished();
  r.complete = reader->complete();
  return r;
}

ReadBack read_bytes(const std::string& bytes) {
  // fmemopen() takes no empty memory.
  std::FILE* file = bytes.empty() ? std::fopen("/dev/null", "rb")
                                  : fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "rb");
  return read_back(Reader::read(file, "tape"));
}

class McapTest : public FullDisk {
 protected:
  [[nodiscard]] std::string path() const { return (folder_ / "tape.mcap").string(); }
  [[nodiscard]] std::string bytes() const {
    std::ifstream in(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  // Chunks of three messages each; `whole_` holds what was written, and `ends_` where the file has each
  // chunk's end.
  void write(int chunks, bool finish) {
    auto w = Writer::create(path(), "punctum test");
    ASSERT_TRUE(w) << w.error();
    w->metadata("about", {{"who", "a test"}});
    const std::uint16_t a = w->add_channel(w->add_schema("A", "protobuf", "schema of a"), "/a", "protobuf");
    const std::uint16_t b = w->add_channel(w->add_schema("B", "protobuf", "schema of b"), "/b", "protobuf");
    std::uint32_t n = 0;
    for (int c = 0; c < chunks; ++c) {
      for (int i = 0; i < 3; ++i, ++n) {
        const std::string data = "message " + std::to_string(n) + std::string(n % 5, 'x');
        w->message(i == 1 ? b : a, 1000 + 10 * n, 500 + n, data);
        const auto in_channel = static_cast<std::uint32_t>(std::count_if(
            whole_.begin(), whole_.end(), [i](const Told& t) { return (t.topic == "/b") == (i == 1); }));
        whole_.push_back({i == 1 ? "/b" : "/a", in_channel, 1000 + 10 * n, 500 + n, data});
      }
      w->close_chunk();
      ends_.push_back(w->bytes());
    }
    if (finish) {
      w->finish();
    }
    EXPECT_EQ(w->failure(), "");
  }
  // What can be read of the first `size` bytes: the messages of the chunks in them. The messages' index may
  // be cut.
  [[nodiscard]] std::vector<Told> within(const std::string& file, std::size_t size) const {
    std::size_t chunks = 0;
    while (chunks < ends_.size() && chunk_end(file, chunks) <= size) {
      ++chunks;
    }
    return {whole_.begin(), whole_.begin() + static_cast<std::ptrdiff_t>(3 * chunks)};
  }
  // Of the chunk itself, before its index: the first record of kind 6 after the chunk before.
  [[nodiscard]] std::size_t chunk_end(const std::string& file, std::size_t chunk) const {
    std::size_t at = chunk == 0 ? kMagic.size() : ends_[chunk - 1];
    for (;;) {
      Fields head(std::string_view(file).substr(at));
      const auto op = head.number<std::uint8_t>();
      at += kRecordHead + head.number<std::uint64_t>();
      if (op == 6) {
        return at;
      }
    }
  }

  std::vector<Told> whole_;
  std::vector<std::size_t> ends_;
};

TEST_F(McapTest, what_was_written_is_read_back) {
  write(4, true);
  const ReadBack r = read_back(Reader::open(path()));
  EXPECT_EQ(r.error, "");
  EXPECT_TRUE(r.finished);
  EXPECT_EQ(r.messages, whole_);
  EXPECT_EQ(r.complete, bytes().size());

  auto reader = Reader::open(path());
  Message m;
  while (*reader->next(m)) {
  }
  EXPECT_EQ(reader->metadata().at("who"), "a test");
  EXPECT_EQ(reader->schemas().at(2).data, "schema of b");
  EXPECT_EQ(reader->channels().at(2).schema, 2);
}

// By the specification, from the end of the file, with nothing of the reader.
TEST_F(McapTest, the_index_leads_to_every_message) {
  write(4, true);
  const std::string file = bytes();
  const auto record = [&file](std::uint64_t at, Op op) {
    Fields head(std::string_view(file).substr(at));
    EXPECT_EQ(head.number<std::uint8_t>(), static_cast<std::uint8_t>(op)) << at;
    return head.take(head.number<std::uint64_t>());
  };
  Fields footer(record(file.size() - kMagic.size() - kRecordHead - 20, Op::footer));
  std::uint64_t at = footer.number<std::uint64_t>();
  const auto end = footer.number<std::uint64_t>();
  std::map<std::uint8_t, std::pair<std::uint64_t, std::uint64_t>> groups;  // kind: begin, end
  std::vector<Told> found;
  std::uint64_t messages = 0, chunks = 0;
  std::string counts;
  while (at < end) {
    const auto op = static_cast<std::uint8_t>(file[at]);
    const std::string_view content = record(at, static_cast<Op>(op));
    groups.try_emplace(op, at, at).first->second.second = at + kRecordHead + content.size();
    at += kRecordHead + content.size();
    Fields f(content);
    if (op == static_cast<std::uint8_t>(Op::statistics)) {
      messages = f.number<std::uint64_t>();
      EXPECT_EQ(f.number<std::uint16_t>(), 2) << "schemas";
      EXPECT_EQ(f.number<std::uint32_t>(), 2U) << "channels";
      EXPECT_EQ(f.number<std::uint32_t>(), 0U) << "attachments";
      EXPECT_EQ(f.number<std::uint32_t>(), 1U) << "metadata";
      chunks = f.number<std::uint32_t>();
      EXPECT_EQ(f.number<std::uint64_t>(), 1000U) << "first message";
      EXPECT_EQ(f.number<std::uint64_t>(), 1110U) << "last message";
      counts = f.text();
    } else if (op == static_cast<std::uint8_t>(Op::metadata_index)) {
      (void)record(f.number<std::uint64_t>(), Op::metadata);
    } else if (op == static_cast<std::uint8_t>(Op::chunk_index)) {
      const auto first = f.number<std::uint64_t>(), last = f.number<std::uint64_t>(),
                 chunk_at = f.number<std::uint64_t>();
      Fields chunk(record(chunk_at, Op::chunk));
      EXPECT_EQ(f.number<std::uint64_t>(), kRecordHead + chunk.rest().size());
      EXPECT_EQ(chunk.number<std::uint64_t>(), first);
      EXPECT_EQ(chunk.number<std::uint64_t>(), last);
      (void)chunk.number<std::uint64_t>();
      (void)chunk.number<std::uint32_t>();
      (void)chunk.text();
      (void)chunk.number<std::uint64_t>();
      const std::string_view records = chunk.rest();
      Fields offsets(f.text());
      while (!offsets.rest().empty()) {
        const auto channel = offsets.number<std::uint16_t>();
        Fields index(record(offsets.number<std::uint64_t>(), Op::message_index));
        EXPECT_EQ(index.number<std::uint16_t>(), channel);
        Fields entries(index.text());
        while (!entries.rest().empty()) {
          const auto log_ns = entries.number<std::uint64_t>();
          Fields m(records.substr(entries.number<std::uint64_t>()));
          ASSERT_EQ(m.number<std::uint8_t>(), static_cast<std::uint8_t>(Op::message));
          Fields told(m.take(m.number<std::uint64_t>()));
          EXPECT_EQ(told.number<std::uint16_t>(), channel);
          const auto sequence = told.number<std::uint32_t>();
          EXPECT_EQ(told.number<std::uint64_t>(), log_ns);
          EXPECT_TRUE(first <= log_ns && log_ns <= last);
          const auto published = told.number<std::uint64_t>();
          found.push_back(
              {channel == 1 ? "/a" : "/b", sequence, log_ns, published, std::string(told.rest())});
        }
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const Told& a, const Told& b) { return a.log_ns < b.log_ns; });
  EXPECT_EQ(found, whole_);
  EXPECT_EQ(messages, whole_.size());
  EXPECT_EQ(chunks, 4U);
  std::string wanted;  // channel 1: 8 messages, channel 2: 4
  put(wanted, std::uint16_t{1});
  put(wanted, std::uint64_t{8});
  put(wanted, std::uint16_t{2});
  put(wanted, std::uint64_t{4});
  EXPECT_EQ(counts, wanted);
  // Each kind of the summary stands together, where the offsets say.
  EXPECT_EQ(groups.size(), 5U);
  for (at = end; static_cast<std::uint8_t>(file[at]) == static_cast<std::uint8_t>(Op::summary_offset);
       at += kRecordHead + 17) {
    Fields f(record(at, Op::summary_offset));
    const auto [begin, over] = groups.at(f.number<std::uint8_t>());
    EXPECT_EQ(f.number<std::uint64_t>(), begin);
    EXPECT_EQ(f.number<std::uint64_t>(), over - begin);
  }
}

TEST_F(McapTest, the_checksum_is_the_one_of_zlib) { EXPECT_EQ(crc32("123456789"), 0xCBF43926U); }

TEST_F(McapTest, a_recording_replaces_none) {
  write(1, true);
  const std::string before = bytes();
  const auto second = Writer::create(path(), "another");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error(), path() + ": is there already; a recording replaces none");
  EXPECT_EQ(bytes(), before);
  EXPECT_EQ(Writer::create("/nowhere/tape.mcap", "another").error(),
            "/nowhere/tape.mcap: cannot be written: No such file or directory");
}

TEST_F(McapTest, cut_at_any_byte_it_gives_every_chunk_that_is_whole) {
  write(12, true);
  const std::string file = bytes();
  ASSERT_GT(file.size(), 1000U);
  for (std::size_t size = 0; size < file.size(); ++size) {
    const ReadBack r = read_bytes(file.substr(0, size));
    if (size < kMagic.size()) {
      EXPECT_EQ(r.error,
                "tape: byte 0: not an MCAP file of version 0, which begins with 89 4d 43 41 50 30 0d 0a");
    } else if (r.error.empty()) {
      EXPECT_LE(r.complete, size);
    } else {
      EXPECT_EQ(r.error, "tape: byte 8: an MCAP file begins with a header, which is not there") << size;
    }
    ASSERT_EQ(r.messages, within(file, size)) << size;
    EXPECT_FALSE(r.finished) << size;
  }
}

TEST_F(McapTest, killed_before_its_end_it_gives_every_chunk_that_was_closed) {
  write(5, false);
  const ReadBack r = read_back(Reader::open(path()));
  EXPECT_EQ(r.error, "");
  EXPECT_FALSE(r.finished);
  EXPECT_EQ(r.complete, bytes().size());
  EXPECT_EQ(r.messages, whole_);
}

TEST_F(McapTest, a_byte_that_differs_anywhere_is_one_error_that_says_where) {
  write(3, true);
  const std::string file = bytes();
  for (std::size_t at = 0; at < file.size(); ++at) {
    for (const char flip : {'\x01', '\x80', '\xff'}) {
      std::string bad = file;
      bad[at] = static_cast<char>(bad[at] ^ flip);
      const ReadBack r = read_bytes(bad);
      EXPECT_FALSE(r.finished) << at;
      if (r.error.empty()) {  // a length that grew beyond the end looks like a cut; one of these was it
        EXPECT_LE(r.complete, at) << at;
      } else {
        EXPECT_EQ(r.error.find("tape: byte "), 0U) << r.error;
        EXPECT_EQ(r.error.find('\n'), std::string::npos);
      }
      ASSERT_LE(r.messages.size(), whole_.size());
      EXPECT_TRUE(std::equal(r.messages.begin(), r.messages.end(), whole_.begin()))
          << at << ": what is given is what was written";
    }
  }
}

TEST_F(McapTest, a_full_disk_leaves_the_chunks_before_it_and_is_told) {
  for (rlim_t limit = 200; limit < 1500; limit += 130) {
    fs::remove(path());
    whole_.clear();
    ends_.clear();
    auto w = Writer::create(path(), "a test");
    ASSERT_TRUE(w);
    const std::uint16_t a = w->add_channel(w->add_schema("A", "protobuf", "schema"), "/a", "protobuf");
    full_beyond(limit);
    std::uint64_t kept = 0;
    for (std::uint32_t n = 0; n < 20; ++n) {
      w->message(a, n, n, std::string(50, 'm'));
      w->close_chunk();
      kept = w->failure().empty() ? n + 1 : kept;
    }
    w->finish();
    has_room_again();
    EXPECT_EQ(w->failure(), "File too large");
    EXPECT_EQ(w->messages(), kept);
    EXPECT_EQ(bytes().size(), w->bytes()) << "nothing of what found no room only in part is left";
    const ReadBack r = read_back(Reader::open(path()));
    EXPECT_EQ(r.error, "");
    EXPECT_EQ(r.messages.size(), kept);
  }
}

TEST_F(McapTest, lengths_that_lie_take_no_memory_and_are_said) {
  const std::string begin = std::string(kMagic) + std::string("\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 17);
  const auto error = [&](const std::string& more) { return read_bytes(begin + more).error; };
  EXPECT_EQ(error(""), "");
  EXPECT_EQ(error(std::string("\x05\xff\xff\xff\xff\xff\xff\xff\xff", 9)),
            "tape: byte 25: a record of 18446744073709551615 bytes, at most 67108864 are read");
  EXPECT_EQ(error(std::string("\x05\0\0\0\x03\0\0\0\0", 9)), "") << "cut off";
  EXPECT_EQ(error(std::string("\0\0\0\0\0\0\0\0\0", 9)),
            "tape: byte 25: a record of kind 0, which does not exist")
      << "what a power cut leaves behind on some file systems";
  EXPECT_EQ(error(std::string("\x05\x02\0\0\0\0\0\0\0\1\0", 11)),
            "tape: byte 25: a message that is too short");
  EXPECT_EQ(error(std::string("\x06\x02\0\0\0\0\0\0\0\1\0", 11)),
            "tape: byte 25: a chunk whose parts are longer than itself");
  EXPECT_EQ(error(std::string("\x90\x01\0\0\0\0\0\0\0\1", 10)), "") << "other people's kinds are passed over";
  EXPECT_EQ(error(std::string("\x04\x10\0\0\0\0\0\0\0\1\0\7", 12) + std::string(13, '\0')),
            "tape: byte 25: a channel of schema 7, which is not there");
}

TEST_F(McapTest, a_message_behind_the_data_is_none) {
  write(2, true);
  std::string file = bytes();
  std::size_t at = ends_.back();
  for (;;) {  // to the end of the data
    Fields head(std::string_view(file).substr(at));
    const auto op = head.number<std::uint8_t>();
    at += kRecordHead + head.number<std::uint64_t>();
    if (op == 15) {
      break;
    }
  }
  const std::string message = std::string("\x05\x1a\0\0\0\0\0\0\0\1\0", 11) + std::string(24, 'm');
  for (const bool cut : {false, true}) {
    const ReadBack back = read_bytes(file.substr(0, at) + message + (cut ? "" : file.substr(at)));
    EXPECT_EQ(back.messages, whole_);
    EXPECT_EQ(back.error, "tape: byte " + std::to_string(at) + ": a message in the summary");
  }
}

// Records of other writers that ours does not make, and such that no writer should make.
TEST_F(McapTest, what_a_chunk_may_not_hold_is_said) {
  const auto chunk = [](const std::string& records, const std::string& compression, std::uint32_t crc,
                        std::uint64_t size) {
    std::string content(16, '\0');
    put(content, size);
    put(content, crc);
    put_text(content, compression);
    put(content, static_cast<std::uint64_t>(records.size()));
    content += records;
    std::string all(kMagic);
    all += std::string("\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 17);
    put(all, std::uint8_t{6});
    put(all, static_cast<std::uint64_t>(content.size()));
    return all + content;
  };
  EXPECT_EQ(read_bytes(chunk("", "", 0, 0)).error, "");
  EXPECT_EQ(read_bytes(chunk("", "zstd", 0, 0)).error,
            "tape: byte 25: a compressed chunk; only chunks without compression are read");
  EXPECT_EQ(read_bytes(chunk("", "", 0, 3)).error, "tape: byte 25: a chunk of two different sizes");
  EXPECT_EQ(read_bytes(chunk("abc", "", 5, 3)).error,
            "tape: byte 25: a chunk that is not what was written: its checksum differs");
  EXPECT_EQ(read_bytes(chunk("abc", "", 0, 3)).error,
            "tape: byte 25: a record that is longer than the chunk it lies in");
  EXPECT_EQ(read_bytes(chunk(std::string("\x06\0\0\0\0\0\0\0\0", 9), "", 0, 9)).error,
            "tape: byte 25: a record of kind 6 within a chunk");
}

}  // namespace
}  // namespace punctum::tools::mcap
