// A named piece of memory shared by several processes. Set-up code: may block, allocate and fail.
//
// POSIX shared memory /punctum.NAME, mode 0600. Its owner holds a lock on it for as long as it lives: a
// segment without a locked owner is what a crash left behind and is removed by the next create() or by
// remove_stale_segments(). A header says what lies in it; who attaches checks it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <type_traits>
#include <utility>

#include "hal/exchange.hpp"

namespace punctum::hal {

enum class Access : std::uint8_t { read_only, read_write };

// The mapping itself; Shared<T> below is what others use.
class Segment {
 public:
  Segment() = default;
  Segment(Segment&& other) noexcept { swap(other); }
  Segment& operator=(Segment&& other) noexcept {
    Segment(std::move(other)).swap(*this);
    return *this;
  }
  ~Segment();  // the owner also removes the name

  // Zeroed memory, every page present and mapped.
  [[nodiscard]] static tl::expected<Segment, std::string> create(std::string_view name, std::size_t size);
  // The first sizeof(SegmentHeader) bytes are checked against the three numbers.
  [[nodiscard]] static tl::expected<Segment, std::string> attach(std::string_view name, Access access,
                                                                 std::uint64_t magic, std::uint64_t layout,
                                                                 std::size_t size);
  [[nodiscard]] void* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  void swap(Segment& other) noexcept;

  std::string name_;  // as given, without "/punctum."
  void* data_ = nullptr;
  std::size_t size_ = 0;
  int lock_fd_ = -1;  // >= 0: this is the owner
};

// Removes every segment of this user whose owner is gone; returns how many.
std::size_t remove_stale_segments();

// T lives in the segment: T::header is its first member, T::kMagic and T::kLayout say what it is.
// Shared<const T>::attach maps it read-only.
template <class T>
class Shared {
 public:
  using Plain = std::remove_const_t<T>;

  // name: letters, digits, '.', '_', '-'. Refused when a living process owns it.
  [[nodiscard]] static tl::expected<Shared, std::string> create(std::string_view name) requires(
      !std::is_const_v<T>) {
    static_assert(std::is_standard_layout_v<Plain> && std::is_trivially_destructible_v<Plain>);
    static_assert(alignof(Plain) <= 4096);
    auto segment = Segment::create(name, sizeof(Plain));
    if (!segment) return tl::unexpected(std::move(segment.error()));
    Plain* made = new (segment->data()) Plain();
    made->header.layout = Plain::kLayout;
    made->header.size = sizeof(Plain);
    made->header.owner_pid = own_pid();
    made->header.magic.store(Plain::kMagic, std::memory_order_release);
    return Shared(std::move(*segment));
  }

  // Refused when its owner is dead or the layout is another.
  [[nodiscard]] static tl::expected<Shared, std::string> attach(std::string_view name) {
    auto segment = Segment::attach(name, std::is_const_v<T> ? Access::read_only : Access::read_write,
                                   Plain::kMagic, Plain::kLayout, sizeof(Plain));
    if (!segment) return tl::unexpected(std::move(segment.error()));
    return Shared(std::move(*segment));
  }

  [[nodiscard]] T* get() const noexcept { return std::launder(reinterpret_cast<T*>(segment_.data())); }
  [[nodiscard]] T* operator->() const noexcept { return get(); }
  [[nodiscard]] T& operator*() const noexcept { return *get(); }
  [[nodiscard]] const Segment& segment() const noexcept { return segment_; }

 private:
  explicit Shared(Segment segment) noexcept : segment_(std::move(segment)) {}
  static std::uint64_t own_pid() noexcept;
  Segment segment_;
};

namespace detail {
[[nodiscard]] std::uint64_t own_pid() noexcept;
}
template <class T>
std::uint64_t Shared<T>::own_pid() noexcept {
  return detail::own_pid();
}

}  // namespace punctum::hal
