// A GPIO chip of the kernel's own simulator (gpio-sim), made in configfs: behind its device file all of the
// kernel's GPIO code is real; its wires are outside of the chip
// (tools/emulators/world/gpio_wires.hpp). Needs root.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "tools/emulators/world/gpio_wires.hpp"

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
    auto wires = emulator::GpioWires::of(path());
    EXPECT_TRUE(wires) << wires.error();
    wires_.emplace(std::move(*wires));
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
  void drive(int line, bool high) const { EXPECT_TRUE(wires_->drive(line, high)) << line; }
  // The level of a line, whoever drives it.
  [[nodiscard]] bool level(int line) const { return text_of(value_file(line)) == "1"; }
  [[nodiscard]] fs::path value_file(int line) const { return wires_->value_file(line); }
  // The chip is gone, as when its driver is unloaded or its bus is pulled.
  void unplug() const { put(config_ / "live", "0"); }

 private:
  fs::path config_;
  std::optional<emulator::GpioWires> wires_;
  std::string chip_;
};

}  // namespace punctum::loopback
