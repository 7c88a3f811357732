// Where a datagram goes.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

namespace punctum::tools {

struct UdpAddress {
  sockaddr_storage address{};
  socklen_t size = 0;
};

// "192.168.1.7:9000" or "[fd00::7]:9000"; nothing where it is neither. No name is looked up.
[[nodiscard]] inline std::optional<UdpAddress> udp_address(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) {
    return std::nullopt;
  }
  const std::string_view digits = text.substr(colon + 1);
  std::uint16_t port = 0;
  const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (failed != std::errc() || end != digits.data() + digits.size() || port == 0) {
    return std::nullopt;
  }
  std::string_view host = text.substr(0, colon);
  UdpAddress out;
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    sockaddr_in6 to{};
    to.sin6_family = AF_INET6;
    to.sin6_port = htons(port);
    if (inet_pton(AF_INET6, std::string(host.substr(1, host.size() - 2)).c_str(), &to.sin6_addr) != 1) {
      return std::nullopt;
    }
    std::memcpy(&out.address, &to, out.size = sizeof to);
    return out;
  }
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  if (inet_pton(AF_INET, std::string(host).c_str(), &to.sin_addr) != 1) {
    return std::nullopt;
  }
  std::memcpy(&out.address, &to, out.size = sizeof to);
  return out;
}

}  // namespace punctum::tools
