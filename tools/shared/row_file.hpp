// A table that grows row by row while a program runs. It always ends with a whole row: what a full disk took
// only in part is cut off again, and nothing more is written then. That somebody removed it is a failure,
// too.
#pragma once

#include <cstdint>
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

  // Room on the disk for a table of so many bytes, which nobody else can fill; the file is no longer for it.
  // Where the file system cannot do so, there is none.
  void hold_room(std::int64_t bytes) const noexcept;
  // What of it no row has taken. Closing the file does it, too.
  void give_back_room() const noexcept;

  // One row or several, each with its line end. They are in the file after flush(), or when enough have come.
  void append(std::string_view rows);
  void flush();
  [[nodiscard]] bool is_open() const noexcept { return file_ >= 0; }
  // What went wrong first, in words; empty if nothing has.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }

 private:
  void swap(RowFile& other) noexcept {
    std::swap(file_, other.file_);
    std::swap(waiting_, other.waiting_);
    std::swap(failure_, other.failure_);
  }
  void cut_off_after(std::string_view written);

  int file_ = -1;
  std::string waiting_;
  std::string failure_;
};

}  // namespace punctum::tools
