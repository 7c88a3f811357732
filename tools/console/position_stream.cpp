#include "tools/console/position_stream.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <bit>
#include <cerrno>
#include <system_error>
#include <utility>

#include "tools/shared/udp_address.hpp"

namespace punctum::console {
namespace {

constexpr std::uint32_t kStreamMagic = 0x31434E50;  // "PNC1"

// Little-endian, one after the other.
class Writer {
 public:
  explicit Writer(Datagram& to) : to_(to) {}
  template <class Whole>
  void put(Whole value) {
    for (std::size_t i = 0; i < sizeof value; ++i) {
      to_[at_++] = static_cast<std::uint8_t>(value >> (8 * i) & 0xFFU);
    }
  }
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }
  void put(const double (&vector)[3]) {
    for (const double v : vector) {
      put(v);
    }
  }

 private:
  Datagram& to_;
  std::size_t at_ = 0;
};

}  // namespace

Datagram datagram(const rt::TelemetrySample& sample, std::uint32_t number) {
  Datagram bytes{};
  Writer to(bytes);
  to.put(kStreamMagic);
  to.put(number);
  to.put(sample.tick);
  to.put(sample.t_s);
  to.put(static_cast<std::uint32_t>(sample.phase));
  to.put(static_cast<std::uint32_t>(sample.fault));
  to.put(static_cast<std::uint32_t>(sample.stop));
  to.put(std::uint32_t{sample.cell});
  to.put(sample.x_m);
  to.put(sample.tip_m);
  to.put(sample.force_N);
  to.put(sample.axis);
  to.put(sample.entry_m);
  to.put(sample.wd_m);
  to.put(sample.a_m);
  to.put(sample.R_m);
  to.put(sample.tip_force_N);
  return bytes;
}

tl::expected<PositionStream, std::string> PositionStream::open(std::string_view to) {
  const auto address = tools::udp_address(to);
  if (!address) {
    return tl::unexpected(fmt::format("stream.to: {}: no address with a port", to));
  }
  hal::Descriptor socket(::socket(address->address.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket ||
      ::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address->address), address->size) != 0) {
    return tl::unexpected(fmt::format("stream.to: {}: {}", to, std::generic_category().message(errno)));
  }
  return PositionStream(std::move(socket));
}

void PositionStream::send(const rt::TelemetrySample& sample) {
  const Datagram bytes = datagram(sample, number_++);
  (void)::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

}  // namespace punctum::console
