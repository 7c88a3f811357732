// Positions and forces for a program on another machine, as plain UDP datagrams. README.md has their layout.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "hal/ipc/segment.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::console {

inline constexpr std::size_t kDatagramBytes = 256;
using Datagram = std::array<std::uint8_t, kDatagramBytes>;

// number: counts the datagrams from 0.
[[nodiscard]] Datagram datagram(const rt::TelemetrySample& sample, std::uint32_t number);

class PositionStream {
 public:
  // to: ADDRESS:PORT. The error is one line.
  [[nodiscard]] static tl::expected<PositionStream, std::string> open(std::string_view to);
  // Waits for nobody; a datagram that cannot go is lost.
  void send(const rt::TelemetrySample& sample);

 private:
  explicit PositionStream(hal::Descriptor socket) noexcept : socket_(std::move(socket)) {}
  hal::Descriptor socket_;
  std::uint32_t number_ = 0;
};

}  // namespace punctum::console
