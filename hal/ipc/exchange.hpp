// Lock-free exchanges that live in shared memory, and the histogram that can be read while it is written.
//
// All words are 64-bit atomics that never hold a lock, so they mean the same in every process that maps them.
// All-zero bytes are the initial state of everything here. No call waits, allocates or makes a system call.
// The payload travels word by word with release stores and acquire loads in place of fences: on x86 these
// are plain moves, and the orderings can be checked by thread sanitizer and by tests/models.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

#include "hal/realtime.hpp"

namespace punctum::hal {

using Word = std::atomic<std::uint64_t>;
static_assert(Word::is_always_lock_free && sizeof(Word) == 8);

// The first 64 bytes of every shared segment (hal/ipc/segment.hpp).
struct alignas(64) SegmentHeader {
  Word magic{};              // which kind; stored last, so 0 = not ready
  std::uint64_t layout = 0;  // version of the layout; a mismatch is refused
  std::uint64_t size = 0;    // bytes
  std::uint64_t owner_pid = 0;
  Word writer_pid{};  // who claimed it last, of a segment with one writer
};
static_assert(sizeof(SegmentHeader) == 64);

// A number that changes with any of its parts (FNV-1a): version, sizes and offsets give a layout its kLayout.
template <class... Parts>
[[nodiscard]] constexpr std::uint64_t fingerprint(Parts... parts) NONBLOCKING {
  std::uint64_t h = 14695981039346656037ULL;
  const auto mix = [&h](std::uint64_t part) {
    for (int i = 0; i < 8; ++i) {
      h = (h ^ ((part >> (8 * i)) & 0xFFU)) * 1099511628211ULL;
    }
  };
  (mix(static_cast<std::uint64_t>(parts)), ...);
  return h;
}

template <class T>
concept Shareable =
    std::is_trivially_copyable_v<T> && std::is_default_constructible_v<T> && sizeof(T) % 8 == 0;

// A T as words that may be read and written at the same time. It does not keep a reader from seeing half of
// one value and half of the next: the exchanges below do.
template <class T, class W = Word>
  requires Shareable<T>
struct Words {
  static constexpr std::size_t kCount = sizeof(T) / 8;
  std::array<W, kCount> words{};

  void store(const T& value) NONBLOCKING {
    // Each word once, and no loop round it: a tick writes many.
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    const auto store_word = [&](std::size_t i) NONBLOCKING {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes + 8 * i, 8);
      words[i].store(word, std::memory_order_release);
    };
    [&]<std::size_t... i>(std::index_sequence<i...>)
        NONBLOCKING { (store_word(i), ...); }(std::make_index_sequence<kCount>{});
  }

  void load(T& out) const NONBLOCKING {
    std::array<std::uint64_t, kCount> raw;
    for (std::size_t i = 0; i < kCount; ++i) {
      raw[i] = words[i].load(std::memory_order_acquire);
    }
    std::memcpy(static_cast<void*>(&out), raw.data(), sizeof(T));
  }
};

enum class Read : std::uint8_t {
  ok,
  not_yet,  // not written yet
  overrun,  // the writer has been there again; what stood in it is lost
};

// One writer, any number of readers that need only a read-only mapping. Samples are numbered from 0 and
// sample i lies in slot i % N; the slot's sequence is 2i+1 while i is written and 2i+2 when it is whole.
// A writer that dies in push() leaves all other slots readable, and the next writer simply goes on.
template <class T, std::size_t N, class W = Word>
  requires Shareable<T>
class SeqRing {
 public:
  static_assert(N >= 2 && (N & (N - 1)) == 0, "a power of two");
  using Value = T;
  static constexpr std::size_t kSize = N;

  // The writer only. Returns the number of the sample.
  std::uint64_t push(const T& value) NONBLOCKING {
    std::uint64_t i = head_.load(std::memory_order_relaxed);
    // A previous writer died between finishing sample i and announcing it: readers may have it already.
    if (slots_[i % N].sequence.load(std::memory_order_relaxed) == 2 * i + 2) {
      ++i;
    }
    Slot& slot = slots_[i % N];
    slot.sequence.store(2 * i + 1, std::memory_order_relaxed);
    // Each word is stored with release order, so a reader that has seen a new word also sees the odd
    // sequence.
    slot.value.store(value);
    slot.sequence.store(2 * i + 2, std::memory_order_release);
    head_.store(i + 1, std::memory_order_release);
    return i;
  }

  // Number of samples announced so far; sample head() - 1 is the newest.
  [[nodiscard]] std::uint64_t head() const NONBLOCKING { return head_.load(std::memory_order_acquire); }

  // Oldest sample that a push under way does not destroy.
  [[nodiscard]] std::uint64_t tail() const NONBLOCKING {
    const std::uint64_t h = head();
    return h < N ? 0 : h - (N - 1);
  }

  // One attempt; out is unspecified unless ok.
  [[nodiscard]] Read read(std::uint64_t index, T& out) const NONBLOCKING {
    const Slot& slot = slots_[index % N];
    const std::uint64_t whole = 2 * index + 2;
    const std::uint64_t before = slot.sequence.load(std::memory_order_acquire);
    if (before < whole) {
      return Read::not_yet;
    }
    if (before > whole) {
      return Read::overrun;
    }
    slot.value.load(out);
    return slot.sequence.load(std::memory_order_relaxed) == whole ? Read::ok : Read::overrun;
  }

  // The newest sample and its number. not_yet: nothing was ever written. overrun: the writer went round the
  // whole ring during each of a few attempts; the caller keeps what it has.
  [[nodiscard]] Read newest(T& out, std::uint64_t& index) const NONBLOCKING {
    for (int attempt = 0; attempt < 4; ++attempt) {
      const std::uint64_t h = head();
      if (h == 0) {
        return Read::not_yet;
      }
      if (read(h - 1, out) == Read::ok) {
        index = h - 1;
        return Read::ok;
      }
    }
    return Read::overrun;
  }

 private:
  struct alignas(64) Slot {
    W sequence{};
    Words<T, W> value;
  };
  alignas(64) W head_{};
  std::array<Slot, N> slots_{};
};

// Takes the samples of a ring in order, and counts those that were overwritten before it came to them. The
// one reader of every ring that is read in order.
template <class Ring>
class Follower {
 public:
  explicit Follower(const Ring& ring, std::uint64_t from = 0) NONBLOCKING : ring_(&ring), next_(from) {}

  // ok or not_yet. After an overrun it goes on with the oldest sample that is still safe.
  [[nodiscard]] Read next(typename Ring::Value& out) NONBLOCKING {
    for (int attempt = 0; attempt < 4; ++attempt) {
      const Read r = ring_->read(next_, out);
      if (r == Read::ok) {
        ++next_;
      }
      if (r != Read::overrun) {
        return r;
      }
      // It goes on a quarter of the ring behind the oldest sample, so that the writer does not overtake it
      // again at once.
      const std::uint64_t h = ring_->head();
      const std::uint64_t room = Ring::kSize - Ring::kSize / 4;
      const std::uint64_t to = std::max(next_ + 1, h < room ? 0 : h - room);
      lost_ += to - next_;
      next_ = to;
    }
    return Read::not_yet;
  }

  [[nodiscard]] std::uint64_t position() const NONBLOCKING { return next_; }
  [[nodiscard]] std::uint64_t lost() const NONBLOCKING { return lost_; }

 private:
  const Ring* ring_;
  std::uint64_t next_;
  std::uint64_t lost_ = 0;
};

// One producer, one consumer, bounded. Either side may die at any point and be replaced.
template <class T, std::size_t N, class W = Word>
  requires Shareable<T>
class CommandQueue {
 public:
  static_assert(N >= 2 && (N & (N - 1)) == 0, "a power of two");

  // False when full.
  [[nodiscard]] bool try_push(const T& value) NONBLOCKING {
    const std::uint64_t taken = taken_.load(std::memory_order_acquire);
    const std::uint64_t put = put_.load(std::memory_order_relaxed);
    if (put - taken >= N) {
      return false;
    }
    slots_[put % N].store(value);
    put_.store(put + 1, std::memory_order_release);
    return true;
  }

  // False when empty. Counters that no producer of this program could have left behind empty the queue.
  [[nodiscard]] bool try_pop(T& out) NONBLOCKING {
    const std::uint64_t put = put_.load(std::memory_order_acquire);
    const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
    if (put == taken) {
      return false;
    }
    if (put - taken > N) {
      taken_.store(put, std::memory_order_release);
      return false;
    }
    slots_[taken % N].load(out);
    taken_.store(taken + 1, std::memory_order_release);
    return true;
  }

 private:
  alignas(64) W put_{};
  alignas(64) W taken_{};
  alignas(64) std::array<Words<T, W>, N> slots_{};
};

// Durations in bins of 1 us: bin k holds [k, k+1) us, what is longer than the last bin is counted apart.
// One writer; may be read live.
template <std::size_t Bins>
class Histogram {
 public:
  static constexpr std::size_t kBins = Bins;

  void add(std::int64_t ns) NONBLOCKING {
    const std::uint64_t t = ns > 0 ? static_cast<std::uint64_t>(ns) : 0;
    const std::uint64_t bin = t / 1000;
    bump(bin < Bins ? bins_[bin] : overflow_);
    bump(count_);
    if (t > max_ns_.load(std::memory_order_relaxed)) {
      max_ns_.store(t, std::memory_order_relaxed);
    }
  }

  // What another histogram told: `bins` from 0 on, the rest empty.
  void show(std::span<const std::uint64_t> bins, std::uint64_t overflow, std::uint64_t max_ns) NONBLOCKING {
    std::uint64_t all = overflow;
    for (std::size_t k = 0; k < Bins; ++k) {
      const std::uint64_t n = k < bins.size() ? bins[k] : 0;
      bins_[k].store(n, std::memory_order_relaxed);
      all += n;
    }
    overflow_.store(overflow, std::memory_order_relaxed);
    count_.store(all, std::memory_order_relaxed);
    max_ns_.store(max_ns, std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t count() const NONBLOCKING { return count_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t overflow() const NONBLOCKING {
    return overflow_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t bin(std::size_t k) const NONBLOCKING {
    return bins_[k].load(std::memory_order_relaxed);
  }
  [[nodiscard]] double max_us() const NONBLOCKING {
    return static_cast<double>(max_ns_.load(std::memory_order_relaxed)) * 1e-3;
  }

  // The value that the given part (0 .. 1) of all entries does not exceed, in us, never better than the
  // truth: the upper edge of the bin, or the maximum if that is less or the entry lies beyond the bins.
  [[nodiscard]] double percentile_us(double part) const NONBLOCKING {
    std::uint64_t total = overflow();
    for (const Word& b : bins_) {
      total += b.load(std::memory_order_relaxed);
    }
    if (total == 0) {
      return 0;
    }
    const double wanted = part * static_cast<double>(total);
    std::uint64_t seen = 0;
    for (std::size_t k = 0; k < Bins; ++k) {
      seen += bin(k);
      if (seen > 0 && static_cast<double>(seen) >= wanted) {
        return std::min(static_cast<double>(k + 1), max_us());
      }
    }
    return max_us();
  }

 private:
  static void bump(Word& w) NONBLOCKING {
    w.store(w.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  std::array<Word, Bins> bins_{};
  Word overflow_{};
  Word count_{};
  Word max_ns_{};
};

}  // namespace punctum::hal
