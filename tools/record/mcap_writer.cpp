#include "tools/record/mcap_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace punctum::tools::mcap {
namespace {

std::string record(Op op, std::string_view content) {
  std::string r;
  r.reserve(kRecordHead + content.size());
  put(r, static_cast<std::uint8_t>(op));
  put(r, static_cast<std::uint64_t>(content.size()));
  r += content;
  return r;
}

}  // namespace

void Writer::Times::add(const Times& more) noexcept {
  first = std::min(first, more.first);
  last = std::max(last, more.last);
}

tl::expected<Writer, std::string> Writer::create(const std::string& path, std::string_view library) {
  hal::Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file) {
    return tl::unexpected(errno == EEXIST
                              ? path + ": is there already; a recording replaces none"
                              : fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  }
  Writer w(std::move(file));
  std::string content;
  put_text(content, "");  // no profile
  put_text(content, library);
  if (!w.append(std::string(kMagic) + record(Op::header, content))) {
    return tl::unexpected(path + ": cannot be written: " + w.failure_);
  }
  return w;
}

// All of it or nothing.
bool Writer::append(std::string_view bytes) {
  std::size_t written = 0;
  while (written < bytes.size() && failure_.empty()) {
    const ssize_t n = ::write(file_.number(), bytes.data() + written, bytes.size() - written);
    if (n >= 0) {
      written += static_cast<std::size_t>(n);
    } else if (errno != EINTR) {
      failure_ = std::strerror(errno);
      (void)!::ftruncate(file_.number(), static_cast<off_t>(end_));
    }
  }
  if (!failure_.empty()) {
    return false;
  }
  end_ += bytes.size();
  crc_.add(bytes);
  return true;
}

std::uint16_t Writer::add_schema(std::string_view name, std::string_view encoding, std::string_view data) {
  std::string content;
  put(content, ++schemas_);
  put_text(content, name);
  put_text(content, encoding);
  put_text(content, data);
  const std::string r = record(Op::schema, content);
  schema_records_ += r;
  chunk_ += r;
  return schemas_;
}

std::uint16_t Writer::add_channel(std::uint16_t schema, std::string_view topic, std::string_view encoding) {
  channels_.emplace_back();
  const auto id = static_cast<std::uint16_t>(channels_.size());
  std::string content;
  put(content, id);
  put(content, schema);
  put_text(content, topic);
  put_text(content, encoding);
  put(content, std::uint32_t{0});  // no metadata
  const std::string r = record(Op::channel, content);
  channel_records_ += r;
  chunk_ += r;
  return id;
}

void Writer::message(std::uint16_t channel, std::uint64_t log_ns, std::uint64_t publish_ns,
                     std::string_view data) {
  Channel& c = channels_[channel - 1U];
  put(c.index, log_ns);
  put(c.index, static_cast<std::uint64_t>(chunk_.size()));
  put(chunk_, static_cast<std::uint8_t>(Op::message));
  put(chunk_, static_cast<std::uint64_t>(22 + data.size()));
  put(chunk_, channel);
  put(chunk_, c.sequence++);
  put(chunk_, log_ns);
  put(chunk_, publish_ns);
  chunk_ += data;
  chunk_times_.add({log_ns, log_ns});
  ++chunk_messages_;
}

void Writer::metadata(std::string_view name, const Texts& texts) {
  std::string pairs;
  for (const auto& [key, text] : texts) {
    put_text(pairs, key);
    put_text(pairs, text);
  }
  std::string content;
  put_text(content, name);
  put_text(content, pairs);
  const std::string r = record(Op::metadata, content);
  const std::uint64_t at = end_;
  if (append(r)) {
    std::string index;
    put(index, at);
    put(index, static_cast<std::uint64_t>(r.size()));
    put_text(index, name);
    metadata_index_ += record(Op::metadata_index, index);
    ++metadata_;
  }
}

void Writer::close_chunk() {
  if (chunk_.empty()) {
    return;
  }
  std::string content;
  content.reserve(chunk_.size() + 64);
  put(content, chunk_times_.begin());
  put(content, chunk_times_.last);
  put(content, static_cast<std::uint64_t>(chunk_.size()));
  put(content, crc32(chunk_));
  put_text(content, "");  // no compression
  put(content, static_cast<std::uint64_t>(chunk_.size()));
  content += chunk_;
  std::string out = record(Op::chunk, content);
  const std::uint64_t at = end_, length = out.size();

  std::string offsets;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (!channels_[i].index.empty()) {
      const auto id = static_cast<std::uint16_t>(i + 1);
      put(offsets, id);
      put(offsets, at + out.size());
      std::string index;
      put(index, id);
      put_text(index, channels_[i].index);
      out += record(Op::message_index, index);
    }
  }
  const bool kept = append(out);
  for (Channel& c : channels_) {
    c.messages += kept ? c.index.size() / 16 : 0;
    c.index.clear();
  }
  if (kept) {
    std::string index;
    put(index, chunk_times_.begin());
    put(index, chunk_times_.last);
    put(index, at);
    put(index, length);
    put_text(index, offsets);
    put(index, out.size() - length);
    put_text(index, "");
    put(index, static_cast<std::uint64_t>(chunk_.size()));
    put(index, static_cast<std::uint64_t>(chunk_.size()));
    chunk_index_ += record(Op::chunk_index, index);
    ++chunks_;
    messages_ += chunk_messages_;
    times_.add(chunk_times_);
  }
  chunk_.clear();
  chunk_messages_ = 0;
  chunk_times_ = {};
}

void Writer::finish() {
  close_chunk();
  std::string content;
  put(content, crc_.value());
  std::string out = record(Op::data_end, content);
  const std::uint64_t summary = end_ + out.size();

  std::string statistics;
  put(statistics, messages_);
  put(statistics, schemas_);
  put(statistics, static_cast<std::uint32_t>(channels_.size()));
  put(statistics, std::uint32_t{0});  // no attachments
  put(statistics, metadata_);
  put(statistics, chunks_);
  put(statistics, times_.begin());
  put(statistics, times_.last);
  std::string counts;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    put(counts, static_cast<std::uint16_t>(i + 1));
    put(counts, channels_[i].messages);
  }
  put_text(statistics, counts);

  std::string groups, offsets;
  const auto add = [&](Op op, std::string_view records) {
    if (!records.empty()) {
      std::string offset;
      put(offset, static_cast<std::uint8_t>(op));
      put(offset, summary + groups.size());
      put(offset, static_cast<std::uint64_t>(records.size()));
      offsets += record(Op::summary_offset, offset);
      groups += records;
    }
  };
  add(Op::schema, schema_records_);
  add(Op::channel, channel_records_);
  add(Op::statistics, record(Op::statistics, statistics));
  add(Op::metadata_index, metadata_index_);
  add(Op::chunk_index, chunk_index_);

  // The footer's CRC is of all from the summary's first byte to itself.
  std::string tail = groups + offsets;
  put(tail, static_cast<std::uint8_t>(Op::footer));
  put(tail, std::uint64_t{20});
  put(tail, summary);
  put(tail, summary + groups.size());
  put(tail, crc32(tail));
  out += tail;
  out += kMagic;
  (void)append(out);
}

}  // namespace punctum::tools::mcap
