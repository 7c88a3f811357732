// SocketCAN: a raw socket on one interface, with one filter for each identifier and with error frames.
#pragma once

#include <string>

#include "hal/cia402/can_bus.hpp"

namespace punctum::cia402 {

class SocketCan final : public CanBus {
 public:
  explicit SocketCan(std::string interface) : interface_(std::move(interface)) {}
  ~SocketCan() override { SocketCan::close(); }
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  [[nodiscard]] tl::expected<void, std::string> open(std::span<const std::uint16_t> ids) override;
  void close() noexcept override;
  [[nodiscard]] Sent send(const CanFrame& frame) NONBLOCKING override;
  [[nodiscard]] Received receive(CanFrame& out) NONBLOCKING override;

 private:
  std::string interface_;
  int socket_ = -1;
};

}  // namespace punctum::cia402
