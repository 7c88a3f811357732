#include "tools/emulators/drive/sdo_server.hpp"

#include <algorithm>
#include <cstring>

#include "tools/emulators/drive/little_endian.hpp"

namespace punctum::emulator {
namespace {

constexpr std::size_t kSegment = 7;
constexpr std::size_t kLongestNumber = 4;

}  // namespace

std::optional<SdoServer::Message> SdoServer::answer(const Message& request) {
  enum Command : unsigned {
    command_download_segment = 0,
    command_download = 1,
    command_upload = 2,
    command_upload_segment = 3,
    command_abort = 4,
  };
  const unsigned command = request[0] >> 5U;
  if (command == command_abort) {
    reset();
    return std::nullopt;
  }
  const bool goes_on = (command == command_download_segment && transfer_ == Transfer::download) ||
                       (command == command_upload_segment && transfer_ == Transfer::upload);
  if (goes_on) {
    if (((request[0] & 0x10U) != 0) != toggle_) {
      return abort(abort_toggle);
    }
    return transfer_ == Transfer::download ? download_segment(request) : upload_segment(request);
  }
  // A segment of no transfer belongs to no object.
  const bool segment = command == command_download_segment || command == command_upload_segment;
  reset();
  index_ = segment ? std::uint16_t{0} : static_cast<std::uint16_t>(word(request.data() + 1, 2));
  sub_ = segment ? std::uint8_t{0} : request[3];
  if (command == command_download) {
    return start_download(request);
  }
  return command == command_upload ? start_upload() : abort(abort_command);
}

SdoServer::Message SdoServer::abort(std::uint32_t code) {
  Message message = {0x80};
  put(message.data() + 1, index_, 2);
  message[3] = sub_;
  put(message.data() + 4, code, 4);
  reset();
  return message;
}

Abort SdoServer::write(std::uint32_t raw, int bytes) {
  const Abort why = objects_.write(index_, sub_, raw, bytes);
  if (why == abort_none) {
    after_write_(index_, sub_);
  }
  return why;
}

SdoServer::Message SdoServer::start_download(const Message& request) {
  const std::uint32_t refused = objects_.refused(index_, sub_);
  if (refused != 0) {
    return abort(refused);
  }
  const bool expedited = (request[0] & 2U) != 0, sized = (request[0] & 1U) != 0;
  Message done = {0x60, request[1], request[2], request[3]};
  if (!expedited) {
    // What cannot be written is refused before its bytes come.
    const Entry* entry = objects_.find(index_, sub_);
    if (entry == nullptr) {
      return abort(objects_.missing(index_));
    }
    if (entry->access == Access::constant || entry->access == Access::read_only) {
      return abort(abort_read_only);
    }
    announced_ = sized ? word(request.data() + 4, 4) : 0;
    if (sized && announced_ != static_cast<std::uint32_t>(entry->bytes)) {
      return abort(abort_length);
    }
    transfer_ = Transfer::download;
    toggle_ = false;
    bytes_.clear();
    return done;
  }
  const int bytes = sized ? 4 - static_cast<int>(request[0] >> 2U & 3U) : 0;
  const Abort why = write(word(request.data() + 4, sized ? bytes : 4), bytes);
  return why == abort_none ? done : abort(why);
}

SdoServer::Message SdoServer::download_segment(const Message& request) {
  const std::size_t size = kSegment - (request[0] >> 1U & 7U);
  const bool last = (request[0] & 1U) != 0;
  bytes_.append(reinterpret_cast<const char*>(request.data()) + 1, size);
  if (bytes_.size() > kLongestNumber) {
    return abort(abort_length);
  }
  if (last) {
    const int bytes = static_cast<int>(bytes_.size());
    const Abort why = bytes == 0
                          ? abort_length
                          : write(word(reinterpret_cast<const std::uint8_t*>(bytes_.data()), bytes), bytes);
    if (why != abort_none) {
      return abort(why);
    }
    reset();
  }
  const Message done = {static_cast<std::uint8_t>(toggle_ ? 0x30 : 0x20)};
  toggle_ = !toggle_;
  return done;
}

SdoServer::Message SdoServer::start_upload() {
  const Entry* entry = objects_.find(index_, sub_);
  if (entry == nullptr) {
    return abort(objects_.missing(index_));
  }
  if (entry->access == Access::write_only) {
    return abort(abort_write_only);
  }
  before_read_(index_, sub_);
  Message message{};
  put(message.data() + 1, index_, 2);
  message[3] = sub_;
  if (entry->bytes != 0) {
    message[0] = static_cast<std::uint8_t>(0x43 | (4 - entry->bytes) << 2);
    put(message.data() + 4, static_cast<std::uint32_t>(entry->value), entry->bytes);
    return message;
  }
  message[0] = 0x41;
  put(message.data() + 4, static_cast<std::uint32_t>(entry->text.size()), 4);
  bytes_ = entry->text;
  sent_ = 0;
  toggle_ = false;
  transfer_ = Transfer::upload;
  return message;
}

SdoServer::Message SdoServer::upload_segment(const Message& /*request*/) {
  const std::size_t size = std::min(kSegment, bytes_.size() - sent_);
  const bool last = sent_ + size == bytes_.size();
  Message message{};
  message[0] = static_cast<std::uint8_t>((toggle_ ? 0x10 : 0) | static_cast<int>(kSegment - size) << 1 |
                                         (last ? 1 : 0));
  std::memcpy(message.data() + 1, bytes_.data() + sent_, size);
  sent_ += size;
  toggle_ = !toggle_;
  if (last) {
    reset();
  }
  return message;
}

}  // namespace punctum::emulator
