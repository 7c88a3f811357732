// A serial line in memory, under a virtual clock: the positioner's end of it and emulated devices at the
// other.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/devices.hpp"
#include "hal/zaber/wire.hpp"
#include "tools/emulators/positioner/positioner.hpp"

namespace punctum::tests {

class VirtualZaber final : public hal::Clock {
 public:
  explicit VirtualZaber(const emulator::PositionerParams& params = {}) : devices(params) {
    (void)devices.step(now_ns_);
  }

  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ns_; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override {
    now_ns_ = std::max(now_ns_, t_ns);
    come += devices.step(now_ns_);
  }
  void pass(double seconds) { sleep_until_ns(now_ns_ + static_cast<std::int64_t>(seconds * 1e9)); }

  // The positioner's end; this must outlive it.
  [[nodiscard]] std::unique_ptr<zaber::Wire> wire() { return std::make_unique<End>(*this); }

  emulator::Positioner devices;
  std::string come;               // from the devices, not yet taken
  std::vector<std::string> sent;  // to them
  bool gone = false;
  std::function<void(std::string&)> spoil;  // of what is sent

 private:
  class End final : public zaber::Wire {
   public:
    explicit End(VirtualZaber& line) : line_(line) {}
    [[nodiscard]] tl::expected<void, std::string> open() override { return {}; }
    void close() noexcept override {}
    [[nodiscard]] hal::Status send(std::string_view text) override {
      if (line_.gone) {
        return hal::Status::disconnected;
      }
      std::string bytes(text);
      line_.sent.push_back(bytes);
      if (line_.spoil) {
        line_.spoil(bytes);
      }
      line_.devices.receive(bytes, line_.now_ns_);
      return hal::Status::ok;
    }
    [[nodiscard]] hal::Status receive(std::string& text, std::int64_t timeout_ns) override {
      const std::int64_t end_ns = line_.now_ns_ + timeout_ns;
      for (;;) {
        if (line_.gone) {
          return hal::Status::disconnected;
        }
        line_.come += line_.devices.step(line_.now_ns_);
        if (const std::size_t end = line_.come.find('\n'); end != std::string::npos) {
          text = line_.come.substr(0, end);
          line_.come.erase(0, end + 1);
          while (text.ends_with('\r')) {
            text.pop_back();
          }
          return hal::Status::ok;
        }
        if (line_.now_ns_ >= end_ns) {
          return hal::Status::no_data;
        }
        line_.now_ns_ += 1'000'000;
      }
    }

   private:
    VirtualZaber& line_;
  };

  std::int64_t now_ns_ = 1'000'000'000;
};

}  // namespace punctum::tests
