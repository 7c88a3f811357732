// Counts the frames of a WebSocket (RFC 6455, section 5.2) in the bytes of one direction as they come. It
// follows lengths alone; what is no frame whoever reads them finds out.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace punctum::console {

class FrameCounter {
 public:
  // Frames that begin in these bytes.
  [[nodiscard]] int count(std::string_view bytes) {
    int begun = 0;
    while (!bytes.empty()) {
      if (payload_ > 0) {
        const auto part = std::min<std::uint64_t>(payload_, bytes.size());
        payload_ -= part;
        bytes.remove_prefix(static_cast<std::size_t>(part));
        continue;
      }
      begun += head_size_ == 0 ? 1 : 0;
      head_[head_size_++] = static_cast<unsigned char>(bytes.front());
      bytes.remove_prefix(1);
      if (head_size_ >= 2 && head_size_ == head_length()) {
        payload_ = payload_length();
        head_size_ = 0;
      }
    }
    return begun;
  }

 private:
  [[nodiscard]] std::size_t length_bytes() const {
    const unsigned length = head_[1] & 0x7FU;
    return length == 126 ? 2 : length == 127 ? 8 : 0;
  }
  [[nodiscard]] std::size_t head_length() const {
    return 2 + length_bytes() + ((head_[1] & 0x80U) != 0 ? 4 : 0);  // with its mask
  }
  [[nodiscard]] std::uint64_t payload_length() const {
    std::uint64_t length = length_bytes() == 0 ? head_[1] & 0x7FU : 0;
    for (std::size_t i = 0; i < length_bytes(); ++i) {
      length = length << 8U | head_[2 + i];
    }
    return length;
  }
  std::array<unsigned char, 14> head_{};
  std::size_t head_size_ = 0;
  std::uint64_t payload_ = 0;  // of this frame, that is still to come
};

}  // namespace punctum::console
