#include "tools/emulators/world/gpio_wires.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <system_error>

namespace punctum::emulator {
namespace fs = std::filesystem;

tl::expected<GpioWires, std::string> GpioWires::of(const std::string& chip) {
  const auto refused = [&](const char* what) { return tl::make_unexpected(chip + ": " + what); };
  std::error_code error;
  if (!fs::exists(chip, error)) {
    return refused("there is no such chip");
  }
  const fs::path folder = fs::canonical("/sys/bus/gpio/devices" / fs::path(chip).filename(), error);
  if (error || !fs::exists(folder / "sim_gpio0" / "pull", error)) {
    return refused("is no chip of gpio-sim: its wires cannot be reached");
  }
  return GpioWires(folder);
}

fs::path GpioWires::wire(int line) const { return folder_ / ("sim_gpio" + std::to_string(line)); }

bool GpioWires::drive(int line, bool high) const {
  const int file = open((wire(line) / "pull").c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) {
    return false;
  }
  const std::string_view text = high ? "pull-up" : "pull-down";
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(file);
  return written;
}

WatchedLevel::WatchedLevel(const fs::path& file)
    : file_(open(file.c_str(), O_RDONLY | O_CLOEXEC)), there_(file_ >= 0) {}

WatchedLevel::~WatchedLevel() {
  if (file_ >= 0) {
    close(file_);
  }
}

bool WatchedLevel::level() {
  char text = 0;
  there_ = pread(file_, &text, 1, 0) == 1;
  if (there_) {
    level_ = text == '1';
  }
  return level_;
}

}  // namespace punctum::emulator
