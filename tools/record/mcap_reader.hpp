// Reads an MCAP file from its beginning, message by message, in the memory of one chunk. What was cut off
// somewhere gives all messages of its whole chunks; a byte that is not as it was written is one error, which
// says where, as far as a checksum covers it: of a file that was finished, every byte.
#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "tools/record/mcap.hpp"

namespace punctum::tools::mcap {

struct Schema {
  std::string name, encoding, data;
  bool operator==(const Schema&) const = default;
};
struct Channel {
  std::uint16_t schema = 0;
  std::string topic, encoding;
  bool operator==(const Channel&) const = default;
};
struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0, publish_ns = 0;
  std::string_view data;  // until the next call
};

class Reader {
 public:
  static constexpr std::uint64_t kLargestRecord = 64U << 20U;
  static constexpr std::size_t kMostChannels = 1000;   // and as many schemas
  static constexpr std::size_t kMostText = 1U << 20U;  // of a schema, or of all metadata

  // `name`: for messages. The error is one line: it cannot be opened, or is no MCAP file.
  [[nodiscard]] static tl::expected<Reader, std::string> open(const std::string& path);
  [[nodiscard]] static tl::expected<Reader, std::string> read(std::FILE* file,
                                                              std::string name);  // takes the file

  // False: the end. After an error there is nothing more.
  [[nodiscard]] tl::expected<bool, std::string> next(Message& out);

  // After the end: whether the file was finished; otherwise it was cut off at the byte complete(), before
  // which all is read.
  [[nodiscard]] bool finished() const noexcept { return finished_; }
  [[nodiscard]] std::uint64_t complete() const noexcept { return at_; }

  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const noexcept { return channels_; }
  [[nodiscard]] const std::map<std::uint16_t, Schema>& schemas() const noexcept { return schemas_; }
  // As far as it was read; what stands first counts.
  [[nodiscard]] const std::map<std::string, std::string>& metadata() const noexcept { return metadata_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  enum class Got : std::uint8_t { record, cut };
  using Wrong = tl::unexpected<std::string>;

  Reader(std::FILE* file, std::string name) : file_(file), name_(std::move(name)) {}
  [[nodiscard]] Wrong wrong(std::string_view what) const;
  [[nodiscard]] bool fetch(std::string& into, std::uint64_t size);
  [[nodiscard]] tl::expected<Got, std::string> next_record();
  [[nodiscard]] tl::expected<bool, std::string> next_in_chunk(Message& out);
  [[nodiscard]] tl::expected<void, std::string> begin_chunk();
  [[nodiscard]] tl::expected<void, std::string> end_chunk();
  [[nodiscard]] tl::expected<void, std::string> take_definition(Op op, std::string_view content);
  [[nodiscard]] tl::expected<void, std::string> take_metadata();
  [[nodiscard]] tl::expected<void, std::string> take_message(std::string_view content, Message& out);
  [[nodiscard]] tl::expected<void, std::string> read_summary();

  std::unique_ptr<std::FILE, Close> file_;
  std::string name_;
  std::uint64_t at_ = 0;    // of the record that is looked at
  std::uint64_t next_ = 0;  // of the one after it
  Crc32 crc_;               // of all before next_
  Op op_ = Op::header;
  std::string head_, content_;
  std::string_view chunk_;  // what is left of it
  std::uint64_t chunk_first_ = 0, chunk_last_ = 0, seen_first_ = 0, seen_last_ = 0;
  bool in_chunk_ = false, chunk_has_messages_ = false;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::map<std::uint16_t, std::uint32_t> next_number_;  // of each channel's messages
  bool numbered_ = false;                               // they are, without gaps
  std::map<std::string, std::string> metadata_;
  std::size_t metadata_bytes_ = 0;
  bool over_ = false, finished_ = false;
};

}  // namespace punctum::tools::mcap
