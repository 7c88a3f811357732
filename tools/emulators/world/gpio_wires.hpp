// The wires of a GPIO chip of the kernel's own simulator (gpio-sim), from outside of the chip. Made in
// configfs by whoever has the chip made (README.md), seen in sysfs; needs root.
#pragma once

#include <filesystem>
#include <string>
#include <tl/expected.hpp>

namespace punctum::emulator {

class GpioWires {
 public:
  // The chip by its device file. The error is one line.
  [[nodiscard]] static tl::expected<GpioWires, std::string> of(const std::string& chip);
  // A chip that is there, by the folder of its device in sysfs.
  explicit GpioWires(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // The wire of a line is pulled high or low. False: there is no such line, or the chip is gone.
  [[nodiscard]] bool drive(int line, bool high) const;
  // Where the level of a line is read, whoever drives it.
  [[nodiscard]] std::filesystem::path value_file(int line) const { return wire(line) / "value"; }

 private:
  [[nodiscard]] std::filesystem::path wire(int line) const;
  std::filesystem::path folder_;
};

// The level of a line, read again and again without the cost of opening its file.
class WatchedLevel {
 public:
  explicit WatchedLevel(const std::filesystem::path& file);
  ~WatchedLevel();
  WatchedLevel(const WatchedLevel&) = delete;
  WatchedLevel& operator=(const WatchedLevel&) = delete;

  // The last one when the chip is gone.
  [[nodiscard]] bool level();
  [[nodiscard]] bool is_there() const { return there_; }

 private:
  int file_;
  bool level_ = false, there_;
};

}  // namespace punctum::emulator
