// A GPIO chip of the kernel's own simulator (gpio-sim): behind its device file all of the kernel's GPIO code
// is real; what is outside of the chip, its wires, is this object. Made in configfs, seen in sysfs; needs
// root.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

namespace punctum::loopback {

namespace fs = std::filesystem;

inline constexpr const char* kGpioSim = "/sys/kernel/config/gpio-sim";

inline std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  std::string word;
  in >> word;
  return word;
}

// The kernel takes or refuses it when the file is flushed.
inline bool put(const fs::path& file, const std::string& text) {
  std::FILE* f = std::fopen(file.c_str(), "w");
  if (f == nullptr) {
    return false;
  }
  const bool written = std::fputs(text.c_str(), f) >= 0;
  return std::fclose(f) == 0 && written;
}

// The level of a line, read again and again without the cost of opening its file; the last one when the chip
// is gone.
class Watched {
 public:
  explicit Watched(const fs::path& file) : file_(open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    EXPECT_GE(file_, 0) << file;
  }
  ~Watched() { close(file_); }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;
  [[nodiscard]] bool level() {
    char text = 0;
    if (pread(file_, &text, 1, 0) == 1) {
      level_ = text == '1';
    }
    return level_;
  }

 private:
  int file_;
  bool level_ = false;
};

class GpioSim {
 public:
  static constexpr int kLines = 16;

  explicit GpioSim(const std::string& name = "board") : config_(fs::path(kGpioSim) / name) {
    fs::create_directory(config_);
    fs::create_directory(config_ / "bank");
    put(config_ / "bank" / "num_lines", std::to_string(kLines));
    EXPECT_TRUE(put(config_ / "live", "1"));
    chip_ = text_of(config_ / "bank" / "chip_name");
    EXPECT_FALSE(chip_.empty());
    wires_ = fs::path("/sys/devices/platform") / text_of(config_ / "dev_name") / chip_;
  }
  ~GpioSim() {
    unplug();
    fs::remove(config_ / "bank");
    fs::remove(config_);
  }
  GpioSim(const GpioSim&) = delete;
  GpioSim& operator=(const GpioSim&) = delete;

  [[nodiscard]] std::string path() const { return "/dev/" + chip_; }
  // From outside: the wire of a line is high or low.
  void drive(int line, bool high) const {
    EXPECT_TRUE(put(wire(line) / "pull", high ? "pull-up" : "pull-down")) << line;
  }
  // The level of a line, whoever drives it.
  [[nodiscard]] bool level(int line) const { return text_of(value_file(line)) == "1"; }
  [[nodiscard]] fs::path value_file(int line) const { return wire(line) / "value"; }
  // The chip is gone, as when its driver is unloaded or its bus is pulled.
  void unplug() const { put(config_ / "live", "0"); }

 private:
  [[nodiscard]] fs::path wire(int line) const { return wires_ / ("sim_gpio" + std::to_string(line)); }

  fs::path config_, wires_;
  std::string chip_;
};

}  // namespace punctum::loopback
