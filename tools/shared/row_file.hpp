// A table that grows row by row while a program runs. It always ends with a whole row: what a full disk took
// only in part is cut off again, and nothing more is written then. That somebody removed it is a failure,
// too.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace punctum::tools {

class RowFile {
 public:
  enum class Begin : std::uint8_t {
    empty,  // whatever was there goes
    after,  // of what is there
  };
  // The error is one line.
  [[nodiscard]] static tl::expected<RowFile, std::string> open(const std::string& path, Begin begin);

  RowFile() = default;  // takes nothing and complains of nothing
  RowFile(RowFile&& other) noexcept { swap(other); }
  RowFile& operator=(RowFile&& other) noexcept {
    RowFile(std::move(other)).swap(*this);
    return *this;
  }
  ~RowFile();

  // Asked while the disk is full: whether there is a little room now, so that it is worth another try.
  void when_full(std::function<bool()> more_room) { more_room_ = std::move(more_room); }

  // One row or several, each with its line end. They are in the file after flush(), or when enough have come.
  void append(std::string_view rows);
  void flush();
  [[nodiscard]] bool is_open() const noexcept { return file_ >= 0; }
  // What went wrong first, in words; empty if nothing has.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }

 private:
  void swap(RowFile& other) noexcept {
    std::swap(file_, other.file_);
    std::swap(more_room_, other.more_room_);
    std::swap(waiting_, other.waiting_);
    std::swap(failure_, other.failure_);
  }
  void cut_off_after(std::string_view written);

  int file_ = -1;
  std::function<bool()> more_room_;
  std::string waiting_;
  std::string failure_;
};

}  // namespace punctum::tools
