// Writes an MCAP file while things happen. Messages gather in a chunk; close_chunk() brings it to the file in
// one piece, with its CRC. Whatever happens to the program or the disk, every chunk that is closed can be
// read: what a full disk took only in part is cut off again, and nothing more is written then. finish() adds
// what lets a reader seek.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "hal/ipc/segment.hpp"
#include "tools/record/mcap.hpp"

namespace punctum::tools::mcap {

class Writer {
 public:
  using Texts = std::map<std::string, std::string>;

  // Makes the file; refused where there is one. The error is one line.
  [[nodiscard]] static tl::expected<Writer, std::string> create(const std::string& path,
                                                                std::string_view library);

  // Into the open chunk; numbers count from 1.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic, std::string_view encoding);
  void message(std::uint16_t channel, std::uint64_t log_ns, std::uint64_t publish_ns, std::string_view data);

  void metadata(std::string_view name, const Texts& texts);  // outside of chunks, at once
  void close_chunk();
  void finish();

  [[nodiscard]] std::size_t chunk_bytes() const noexcept { return chunk_.size(); }
  [[nodiscard]] std::uint64_t bytes() const noexcept { return end_; }          // of the file
  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }  // in closed chunks
  [[nodiscard]] int descriptor() const noexcept { return file_.number(); }
  // What went wrong first, in words; empty if nothing has.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }

 private:
  struct Channel {
    std::uint32_t sequence = 0;
    std::uint64_t messages = 0;  // in closed chunks
    std::string index;           // of the open chunk: time and offset of each message
  };
  struct Times {
    std::uint64_t first = ~std::uint64_t{0}, last = 0;
    void add(const Times& more) noexcept;
    [[nodiscard]] std::uint64_t begin() const noexcept { return first <= last ? first : 0; }
  };

  explicit Writer(hal::Descriptor file) : file_(std::move(file)) {}
  bool append(std::string_view bytes);

  hal::Descriptor file_;
  std::uint64_t end_ = 0;  // of what is whole
  Crc32 crc_;
  std::string failure_;
  std::string chunk_;
  std::uint64_t chunk_messages_ = 0;
  Times chunk_times_, times_;
  std::vector<Channel> channels_;
  std::uint16_t schemas_ = 0;
  std::uint64_t messages_ = 0;
  std::uint32_t chunks_ = 0, metadata_ = 0;
  // Records of the summary, each kind together.
  std::string schema_records_, channel_records_, chunk_index_, metadata_index_;
};

}  // namespace punctum::tools::mcap
