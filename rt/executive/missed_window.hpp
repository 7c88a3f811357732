// How many releases of the last W ticks were missed: exact, one bit per tick.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

class MissedWindow {
 public:
  static constexpr std::uint32_t kMaxTicks = 16384;  // 2 s at 8 kHz

  explicit MissedWindow(std::uint32_t ticks) NONBLOCKING : ticks_(std::clamp(ticks, 1U, kMaxTicks)) {}

  // Tick `index` takes place; every index since the last call was missed. Returns the count in the window
  // (index - W, index]. Indices must rise.
  std::uint32_t advance(std::uint64_t index) NONBLOCKING {
    if (index - next_ >= ticks_) {  // longer than the window: whatever was before is gone
      next_ = index - (ticks_ - 1);
    }
    for (; next_ < index; ++next_) {  // at most kMaxTicks rounds
      mark(next_, true);
    }
    mark(next_++, false);
    return count_;
  }

  [[nodiscard]] std::uint32_t count() const NONBLOCKING { return count_; }
  [[nodiscard]] std::uint32_t ticks() const NONBLOCKING { return ticks_; }

 private:
  void mark(std::uint64_t index, bool missed) NONBLOCKING {
    const auto place = static_cast<std::uint32_t>(index % ticks_);  // holds index - W until now
    const std::uint64_t bit = std::uint64_t{1} << (place % 64);
    std::uint64_t& word = bits_[place / 64];
    const bool was = (word & bit) != 0;
    word = missed ? word | bit : word & ~bit;
    count_ = count_ + (missed ? 1U : 0U) - (was ? 1U : 0U);
  }

  std::array<std::uint64_t, kMaxTicks / 64> bits_{};
  std::uint32_t ticks_;
  std::uint32_t count_ = 0;
  std::uint64_t next_ = 0;
};

}  // namespace punctum::rt
