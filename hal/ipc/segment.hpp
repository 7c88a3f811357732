// A piece of memory shared by several processes. Set-up code: may block, allocate and fail.
//
// Memory without a place in any file system (memfd), sealed against resizing: nobody can cut it off under
// another's feet. Who made it hands out descriptors: a child inherits them, others get them by
// rendezvous.hpp. The memory goes with the last process that holds or maps it, however it dies; nothing is
// ever left behind. Where a layout has one writer (T::kOneWriter), the writer claims the segment by a lock
// that goes with the process, and everybody else, its maker too, maps it through a read-only descriptor,
// which cannot be made writable again. A header says what lies in the segment; attach() and claim() check it.
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

#include "hal/ipc/exchange.hpp"

namespace punctum::hal {

// An open file descriptor; closed with it.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor();

  [[nodiscard]] int number() const noexcept { return fd_; }  // -1: none
  explicit operator bool() const noexcept { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

enum class Access : std::uint8_t {
  read_only,
  read_write,   // beside others
  only_writer,  // refused while another writes
};

// The mapping itself; Shared<T> below is what others use.
class Segment {
 public:
  Segment() = default;
  Segment(Segment&& other) noexcept { swap(other); }
  Segment& operator=(Segment&& other) noexcept {
    Segment(std::move(other)).swap(*this);
    return *this;
  }
  ~Segment();

  // Zeroed memory, every page present and mapped for writing. `name`: for messages and /proc/PID/maps.
  [[nodiscard]] static tl::expected<Segment, std::string> create(std::string_view name, std::size_t size);
  // The first sizeof(SegmentHeader) bytes are checked against the three numbers. The descriptor stays the
  // caller's.
  [[nodiscard]] static tl::expected<Segment, std::string> attach(std::string_view name, int descriptor,
                                                                 Access access, std::uint64_t magic,
                                                                 std::uint64_t layout, std::size_t size);
  // From here on a write through this mapping is a segmentation fault, for good.
  [[nodiscard]] tl::expected<void, std::string> make_read_only();

  [[nodiscard]] void* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Its maker's: for whoever writes it. -1 where it was only attached.
  [[nodiscard]] int descriptor() const noexcept { return memory_.number(); }
  // Its maker's: a new one, for whoever reads it.
  [[nodiscard]] tl::expected<Descriptor, std::string> read_only_descriptor() const;

 private:
  void swap(Segment& other) noexcept;

  std::string name_;
  void* data_ = nullptr;
  std::size_t size_ = 0;
  Descriptor memory_;
  Descriptor lock_;  // of the one writer
};

// A layout that one process writes and all others only read.
template <class T>
concept OneWriter = requires { requires std::remove_const_t<T>::kOneWriter; };

// T lives in the segment: T::header is its first member, T::kMagic and T::kLayout say what it is. A const T
// is mapped read-only.
template <class T>
class Shared {
 public:
  using Plain = std::remove_const_t<T>;

  // Makes the segment. The maker of a segment with one writer is a reader of it.
  [[nodiscard]] static tl::expected<Shared, std::string> create(std::string_view name)
    requires(OneWriter<T> == std::is_const_v<T>)
  {
    static_assert(std::is_standard_layout_v<Plain> && std::is_trivially_destructible_v<Plain>);
    static_assert(alignof(Plain) <= 4096);
    auto segment = Segment::create(name, sizeof(Plain));
    if (!segment) {
      return tl::unexpected(std::move(segment.error()));
    }
    Plain* made = new (segment->data()) Plain();
    made->header.layout = Plain::kLayout;
    made->header.size = sizeof(Plain);
    made->header.owner_pid = own_pid();
    made->header.magic.store(Plain::kMagic, std::memory_order_release);
    if constexpr (std::is_const_v<T>) {
      if (auto protect = segment->make_read_only(); !protect) {
        return tl::unexpected(std::move(protect.error()));
      }
    }
    return Shared(std::move(*segment));
  }

  // Maps what the descriptor stands for. Refused when the layout is another. `name`: for messages.
  [[nodiscard]] static tl::expected<Shared, std::string> attach(std::string_view name, int descriptor)
    requires(std::is_const_v<T> || !OneWriter<T>)
  {
    return map(name, descriptor, std::is_const_v<T> ? Access::read_only : Access::read_write);
  }

  // Becomes its one writer. Refused, besides, while another is. Of a layout without one writer: the one of
  // those who claim it, beside others who attach.
  [[nodiscard]] static tl::expected<Shared, std::string> claim(std::string_view name, int descriptor)
    requires(!std::is_const_v<T>)
  {
    auto claimed = map(name, descriptor, Access::only_writer);
    if (claimed) {
      (*claimed)->header.writer_pid.store(own_pid(), std::memory_order_relaxed);
    }
    return claimed;
  }

  [[nodiscard]] T* get() const noexcept { return std::launder(reinterpret_cast<T*>(segment_.data())); }
  [[nodiscard]] T* operator->() const noexcept { return get(); }
  [[nodiscard]] T& operator*() const noexcept { return *get(); }
  [[nodiscard]] const Segment& segment() const noexcept { return segment_; }

 private:
  explicit Shared(Segment segment) noexcept : segment_(std::move(segment)) {}
  static tl::expected<Shared, std::string> map(std::string_view name, int descriptor, Access access) {
    auto segment = Segment::attach(name, descriptor, access, Plain::kMagic, Plain::kLayout, sizeof(Plain));
    if (!segment) {
      return tl::unexpected(std::move(segment.error()));
    }
    return Shared(std::move(*segment));
  }
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
