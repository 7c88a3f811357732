// The pictures that vision looks at, and the contours that it sees in them, for whoever records or shows
// them; the core does not read them.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "hal/ipc/exchange.hpp"

namespace punctum::rt {

// Points of a closed contour one after the other, in pixels of the camera, and how sure they are.
struct SeenContour {
  static constexpr std::size_t kMost = 64;
  struct Point {
    float x_px = 0, y_px = 0;
    float sd_px = 0;  // standard deviation across the contour; 0: not known
  };
  std::uint32_t count = 0;  // 0: not found
  std::array<Point, kMost> point{};
};

struct PictureHead {
  std::uint64_t frame = 0;       // as in the observation of the same picture
  std::int64_t exposure_ns = 0;  // station clock
  std::uint32_t width = 0, height = 0;
  std::uint32_t step_px = 1;  // of the camera, that one pixel here is the mean of
  float pixel_m = 0;          // what one pixel of the camera shows
  std::uint64_t at = 0;       // its first byte, counted over all pictures that were ever written
  SeenContour outer{}, inner{};

  [[nodiscard]] std::uint64_t bytes() const {
    return std::uint64_t{width} * height;
  }  // 8-bit grey, row by row
};

// Pictures one after the other in a ring of bytes. One writer, any number of readers that need only a
// read-only mapping; who is late loses the oldest.
template <std::uint64_t Bytes, std::size_t Pictures>
class PictureRing {
 public:
  static constexpr std::uint64_t kBytes = Bytes;
  static constexpr std::uint64_t kLargest = kBytes / 2;
  using Heads = hal::SeqRing<PictureHead, Pictures>;

  // The writer only. False: too large, and nothing is written.
  bool push(PictureHead head, const std::uint8_t* pixels, std::size_t stride) {
    if (head.bytes() > kLargest || head.bytes() == 0) {
      return false;
    }
    head.at = begun_.load(std::memory_order_relaxed);
    begun_.store(head.at + (head.bytes() + 7) / 8 * 8, std::memory_order_relaxed);
    // Each word is stored with release order: a reader that has seen a new one sees that it was begun.
    std::uint64_t word = 0, filled = 0, place = head.at / 8;
    for (std::uint32_t y = 0; y < head.height; ++y) {  // with the next at most kLargest rounds
      const std::uint8_t* row = pixels + y * stride;
      for (std::uint32_t x = 0; x < head.width;) {  // at most kLargest rounds
        const std::uint64_t now = std::min<std::uint64_t>(8 - filled, head.width - x);
        std::memcpy(reinterpret_cast<std::byte*>(&word) + filled, row + x, now);
        x += static_cast<std::uint32_t>(now);
        filled += now;
        if (filled == 8) {
          words_[place++ % kWords].store(word, std::memory_order_release);
          filled = 0;
        }
      }
    }
    if (filled > 0) {
      words_[place % kWords].store(word, std::memory_order_release);
    }
    heads_.push(head);
    return true;
  }

  [[nodiscard]] const Heads& heads() const { return heads_; }

  // The pixels of a head: bytes() of them, in a buffer with room for 7 more. False: overwritten meanwhile, or
  // no head of this ring.
  [[nodiscard]] bool read(const PictureHead& head, std::uint8_t* out) const {
    if (head.bytes() > kLargest || head.at % 8 != 0) {
      return false;
    }
    for (std::uint64_t i = 0; i < (head.bytes() + 7) / 8; ++i) {  // at most kLargest rounds
      const std::uint64_t word = words_[(head.at / 8 + i) % kWords].load(std::memory_order_acquire);
      std::memcpy(out + 8 * i, &word, 8);
    }
    const std::uint64_t begun = begun_.load(std::memory_order_relaxed);
    return begun >= head.at && begun - head.at <= kBytes;
  }

 private:
  static constexpr std::uint64_t kWords = kBytes / 8;

  Heads heads_;
  hal::Word begun_{};  // bytes of all pictures that were written or are being written
  std::array<hal::Word, kWords> words_{};
};

// Written by vision alone, where a run records its pictures: all of them.
struct PictureSegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x6572757463697050ULL;  // "Ppicture"
  static constexpr std::uint64_t kVersion = 2;
  static const std::uint64_t kLayout;
  using Ring = PictureRing<(32U << 20U), 128>;

  hal::SegmentHeader header;
  Ring ring;
};
inline constexpr std::uint64_t PictureSegment::kLayout = hal::fingerprint(
    PictureSegment::kVersion, sizeof(PictureSegment), sizeof(PictureHead), offsetof(PictureSegment, ring));

// Written by vision alone, and only while somebody looks: some pictures a second, large ones reduced.
struct ViewSegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x0000007765697650ULL;  // "Pview"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;
  using Ring = PictureRing<(2U << 20U), 8>;
  static constexpr std::uint64_t kLargest = 400'000;  // bytes of a picture
  static constexpr std::int64_t kBetween_ns = 60'000'000;

  hal::SegmentHeader header;
  Ring ring;
};
inline constexpr std::uint64_t ViewSegment::kLayout = hal::fingerprint(
    ViewSegment::kVersion, sizeof(ViewSegment), sizeof(PictureHead), offsetof(ViewSegment, ring));

// Whether somebody looks; written by the console alone.
struct ViewerSegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x0072657765697650ULL;  // "Pviewer"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  hal::Word looks_until_ns{};  // of the monotonic clock
};
inline constexpr std::uint64_t ViewerSegment::kLayout =
    hal::fingerprint(ViewerSegment::kVersion, sizeof(ViewerSegment), offsetof(ViewerSegment, looks_until_ns));

}  // namespace punctum::rt
