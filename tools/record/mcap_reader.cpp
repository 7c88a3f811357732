#include "tools/record/mcap_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace punctum::tools::mcap {

Reader::Wrong Reader::wrong(std::string_view what) const {
  return Wrong(fmt::format("{}: byte {}: {}", name_, at_, what));
}

tl::expected<Reader, std::string> Reader::open(const std::string& path) {
  std::error_code ec;
  const auto there = std::filesystem::status(path, ec);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) {
    return tl::unexpected(path + ": not a file, allowed: a recording (MCAP)");
  }
  std::FILE* file = std::fopen(path.c_str(), "rbe");
  if (file == nullptr) {
    return tl::unexpected(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }
  return read(file, path);
}

tl::expected<Reader, std::string> Reader::read(std::FILE* file, std::string name) {
  Reader r(file, std::move(name));
  std::string magic;
  if (!r.fetch(magic, kMagic.size()) || magic != kMagic) {
    return r.wrong("not an MCAP file of version 0, which begins with 89 4d 43 41 50 30 0d 0a");
  }
  r.crc_.add(magic);
  r.next_ = kMagic.size();
  const auto got = r.next_record();
  if (!got) {
    return tl::unexpected(got.error());
  }
  if (*got == Got::cut || r.op_ != Op::header) {
    return r.wrong("an MCAP file begins with a header, which is not there");
  }
  r.crc_.add(r.head_);
  r.crc_.add(r.content_);
  Fields header(r.content_);
  (void)header.text();  // its profile
  r.numbered_ = header.text().starts_with(kOwnLibrary);
  return r;
}

// In pieces: a length that is a lie takes no more memory than the file has bytes.
bool Reader::fetch(std::string& into, std::uint64_t size) {
  constexpr std::uint64_t kPiece = 1U << 20U;
  into.clear();
  while (into.size() < size) {
    const std::size_t before = into.size();
    const auto piece = static_cast<std::size_t>(std::min(kPiece, size - before));
    into.resize(before + piece);
    if (std::fread(into.data() + before, 1, piece, file_.get()) != piece) {
      return false;
    }
  }
  return true;
}

// The next one outside of chunks.
tl::expected<Reader::Got, std::string> Reader::next_record() {
  at_ = next_;
  if (!fetch(head_, kRecordHead)) {
    if (std::ferror(file_.get()) != 0) {
      return wrong(std::strerror(errno));
    }
    return Got::cut;
  }
  Fields head(head_);
  const auto op = head.number<std::uint8_t>();
  const auto size = head.number<std::uint64_t>();
  const bool of_others = op >= static_cast<std::uint8_t>(Op::others);
  if (op == 0 || (op > static_cast<std::uint8_t>(Op::data_end) && !of_others)) {
    return wrong(fmt::format("a record of kind {}, which does not exist", op));
  }
  if (size > kLargestRecord) {
    return wrong(fmt::format("a record of {} bytes, at most {} are read", size, kLargestRecord));
  }
  if (!fetch(content_, size)) {
    if (std::ferror(file_.get()) != 0) {
      return wrong(std::strerror(errno));
    }
    return Got::cut;
  }
  op_ = of_others ? Op::others : static_cast<Op>(op);
  next_ = at_ + kRecordHead + size;
  return Got::record;
}

tl::expected<bool, std::string> Reader::next(Message& out) {
  while (!over_) {
    if (in_chunk_) {
      auto got = next_in_chunk(out);
      if (!got) {
        over_ = true;
        return got;
      }
      if (*got) {
        return true;
      }
      continue;
    }
    const std::uint32_t before = crc_.value();
    auto got = next_record();
    if (!got) {
      over_ = true;
      return tl::unexpected(got.error());
    }
    if (*got == Got::cut) {
      over_ = true;
      return false;
    }
    tl::expected<void, std::string> taken;
    const Op op = op_;  // what follows the data is read below
    switch (op) {
      case Op::schema:
      case Op::channel:
        taken = take_definition(op, content_);
        break;
      case Op::message:
        taken = take_message(content_, out);
        break;
      case Op::chunk:
        taken = begin_chunk();
        break;
      case Op::metadata:
        taken = take_metadata();
        break;
      case Op::data_end: {
        Fields f(content_);
        const auto crc = f.number<std::uint32_t>();
        if (f.failed()) {
          taken = wrong("the end of the data is too short");
        } else if (crc != 0 && crc != before) {
          taken = wrong("what stands before it is not what was written: the checksum of the data differs");
        } else {
          taken = read_summary();
        }
        over_ = true;
        break;
      }
      case Op::message_index:
      case Op::attachment:
        break;
      case Op::footer:  // the specification's older files have no end of the data
        taken = wrong("a footer before the end of the data");
        break;
      default:
        if (op != Op::others) {
          taken = wrong(fmt::format("a record of kind {} among the data", static_cast<int>(op)));
        }
    }
    if (!taken) {
      over_ = true;
      return tl::unexpected(taken.error());
    }
    crc_.add(head_);
    crc_.add(content_);
    if (op == Op::message) {
      return true;
    }
  }
  return false;
}

tl::expected<void, std::string> Reader::begin_chunk() {
  Fields f(content_);
  chunk_first_ = f.number<std::uint64_t>();
  chunk_last_ = f.number<std::uint64_t>();
  const auto size = f.number<std::uint64_t>();
  const auto crc = f.number<std::uint32_t>();
  const std::string_view compression = f.text();
  const auto stored = f.number<std::uint64_t>();
  chunk_ = f.take(stored);
  if (f.failed()) {
    return wrong("a chunk whose parts are longer than itself");
  }
  if (!compression.empty()) {
    return wrong("a compressed chunk; only chunks without compression are read");
  }
  if (stored != size) {
    return wrong("a chunk of two different sizes");
  }
  if (crc != 0 && crc != crc32(chunk_)) {
    return wrong("a chunk that is not what was written: its checksum differs");
  }
  in_chunk_ = true;
  chunk_has_messages_ = false;
  return {};
}

// False: it is over.
tl::expected<bool, std::string> Reader::next_in_chunk(Message& out) {
  while (!chunk_.empty()) {
    Fields f(chunk_);
    const auto op = f.number<std::uint8_t>();
    const auto size = f.number<std::uint64_t>();
    const std::string_view content = f.take(size);
    if (f.failed()) {
      return wrong("a record that is longer than the chunk it lies in");
    }
    chunk_ = f.rest();
    if (op == static_cast<std::uint8_t>(Op::message)) {
      if (auto taken = take_message(content, out); !taken) {
        return tl::unexpected(taken.error());
      }
      seen_first_ = chunk_has_messages_ ? std::min(seen_first_, out.log_ns) : out.log_ns;
      seen_last_ = chunk_has_messages_ ? std::max(seen_last_, out.log_ns) : out.log_ns;
      chunk_has_messages_ = true;
      return true;
    }
    if (op == static_cast<std::uint8_t>(Op::schema) || op == static_cast<std::uint8_t>(Op::channel)) {
      if (auto taken = take_definition(static_cast<Op>(op), content); !taken) {
        return tl::unexpected(taken.error());
      }
    } else if (op < 0x80) {
      return wrong(fmt::format("a record of kind {} within a chunk", op));
    }
  }
  in_chunk_ = false;
  if (auto ended = end_chunk(); !ended) {
    return tl::unexpected(ended.error());
  }
  return false;
}

tl::expected<void, std::string> Reader::end_chunk() {
  if (!chunk_has_messages_) {
    seen_first_ = seen_last_ = 0;
  }
  if (chunk_first_ != seen_first_ || chunk_last_ != seen_last_) {
    return wrong("a chunk whose messages are not of the time that it says");
  }
  return {};
}

tl::expected<void, std::string> Reader::take_definition(Op op, std::string_view content) {
  Fields f(content);
  const auto id = f.number<std::uint16_t>();
  const auto keep = [&](auto& table, auto made, const char* what) -> tl::expected<void, std::string> {
    if (f.failed()) {
      return wrong(fmt::format("a {} that is too short", what));
    }
    if (const auto known = table.find(id); known != table.end()) {
      return known->second == made ? tl::expected<void, std::string>{}
                                   : wrong(fmt::format("two different ones of {} {}", what, id));
    }
    if (table.size() >= kMostChannels) {
      return wrong(fmt::format("more than {} of {}", kMostChannels, what));
    }
    table.emplace(id, std::move(made));
    return {};
  };
  if (op == Op::schema) {
    const std::string_view name = f.text(), encoding = f.text(), data = f.text();
    if (id == 0) {
      return wrong("a schema without a number");
    }
    if (content.size() > kMostText) {
      return wrong(fmt::format("a schema of {} bytes, at most {} are read", content.size(), kMostText));
    }
    return keep(schemas_, Schema{std::string(name), std::string(encoding), std::string(data)}, "schema");
  }
  const auto schema = f.number<std::uint16_t>();
  const std::string_view topic = f.text(), encoding = f.text();
  (void)f.text();  // its metadata
  if (content.size() > kMostText) {
    return wrong(fmt::format("a channel of {} bytes, at most {} are read", content.size(), kMostText));
  }
  if (!f.failed() && schema != 0 && !schemas_.contains(schema)) {
    return wrong(fmt::format("a channel of schema {}, which is not there", schema));
  }
  return keep(channels_, Channel{schema, std::string(topic), std::string(encoding)}, "channel");
}

tl::expected<void, std::string> Reader::take_message(std::string_view content, Message& out) {
  Fields f(content);
  out.channel = f.number<std::uint16_t>();
  out.sequence = f.number<std::uint32_t>();
  out.log_ns = f.number<std::uint64_t>();
  out.publish_ns = f.number<std::uint64_t>();
  out.data = f.rest();
  if (f.failed()) {
    return wrong("a message that is too short");
  }
  if (!channels_.contains(out.channel)) {
    return wrong(fmt::format("a message of channel {}, which is not there", out.channel));
  }
  if (std::uint32_t& next = next_number_[out.channel]; numbered_ && out.sequence != next++) {
    return wrong(
        fmt::format("message {} of channel {} where number {} belongs", out.sequence, out.channel, next - 1));
  }
  return {};
}

tl::expected<void, std::string> Reader::take_metadata() {
  Fields f(content_);
  (void)f.text();  // its name
  Fields pairs(f.text());
  metadata_bytes_ += content_.size();
  if (metadata_bytes_ > kMostText) {
    return wrong(fmt::format("metadata of more than {} bytes", kMostText));
  }
  while (!f.failed() && !pairs.failed() && !pairs.rest().empty()) {
    const std::string_view key = pairs.text(), text = pairs.text();
    if (!pairs.failed()) {
      metadata_.emplace(key, text);
    }
  }
  if (f.failed() || pairs.failed()) {
    return wrong("metadata that are longer than their record");
  }
  return {};
}

// What stands in it is not needed here; its checksum and its place are looked at.
tl::expected<void, std::string> Reader::read_summary() {
  const std::uint64_t begin = next_;
  std::uint64_t offsets = 0;
  Crc32 crc;
  for (;;) {
    const auto got = next_record();
    if (!got) {
      return tl::unexpected(got.error());
    }
    if (*got == Got::cut) {
      at_ = begin;  // the data are whole
      return {};
    }
    if (op_ == Op::footer) {
      break;
    }
    if (op_ == Op::message) {
      return wrong("a message in the summary");
    }
    if (op_ == Op::summary_offset && offsets == 0) {
      offsets = at_;
    }
    crc.add(head_);
    crc.add(content_);
  }
  Fields f(content_);
  const auto summary = f.number<std::uint64_t>(), summary_offsets = f.number<std::uint64_t>();
  const auto stored = f.number<std::uint32_t>();
  if (f.failed() || !f.rest().empty()) {
    return wrong("a footer of another length than 20");
  }
  crc.add(head_);
  crc.add(std::string_view(content_).substr(0, 16));
  if (stored != 0 && stored != crc.value()) {
    return wrong("the summary is not what was written: its checksum differs");
  }
  if (summary != (at_ == begin ? 0 : begin) || summary_offsets != offsets) {
    return wrong("a footer that points beside the summary");
  }
  at_ = next_;
  std::string magic, more;
  if (!fetch(magic, kMagic.size())) {
    at_ = begin;
    return {};
  }
  if (magic != kMagic) {
    return wrong("not the end of an MCAP file, which is 89 4d 43 41 50 30 0d 0a");
  }
  at_ += kMagic.size();
  if (fetch(more, 1)) {
    return wrong("something follows the end of the file");
  }
  finished_ = true;
  return {};
}

}  // namespace punctum::tools::mcap
