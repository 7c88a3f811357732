// The gateway between a running station and browsers: HTTP for the page, WebSocket (`foxglove.websocket.v1`)
// for everything that moves. One thread; each client has an outbox of its own, and what one sends or does not
// read costs that one. An address that other machines reach needs TLS and a file of tokens.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "tools/console/station_feed.hpp"
#include "tools/console/tokens.hpp"

namespace punctum::console {

// What one client may cost.
inline constexpr std::size_t kMostClients = 32;              // connections at a time
inline constexpr std::size_t kMostRequestBytes = 8 * 1024;   // of an HTTP head; it may have no body
inline constexpr std::size_t kMostMessageBytes = 16 * 1024;  // from a client
inline constexpr double kMostMessages = 64, kMessagesPer_s = 80;
inline constexpr std::size_t kOutboxMessages = 512, kOutboxBytes = 1024 * 1024;
inline constexpr int kHandshake_s = 5, kIdle_s = 20;  // a ping goes out after half of that
inline constexpr int kAnswer_s =
    120;  // for a file of the page, as long as some of it is taken every kHandshake_s

struct GatewaySettings {
  std::string address = "127.0.0.1";  // IPv4 or IPv6
  std::uint16_t port = 0;             // 0: the system chooses
  bool or_another = false;            // where that port is taken, the system chooses one
  std::vector<std::string> hosts;     // names of this machine besides its loopback's
  std::vector<std::string> origins;   // besides the page's own
  std::string certificate, key;       // of TLS; empty: none, which the loopback address alone may have
  Tokens tokens;
};

class Gateway {
 public:
  // The error is one line.
  [[nodiscard]] static tl::expected<Gateway, std::string> open(StationFeed feed,
                                                               const GatewaySettings& settings);
  Gateway(Gateway&&) noexcept;
  Gateway& operator=(Gateway&&) noexcept;
  ~Gateway();

  [[nodiscard]] std::string url() const;
  // Serves until the station is over (true) or `stop_asked` says so, which is asked at every poll.
  bool run(const std::function<bool()>& stop_asked);

 private:
  class Server;
  explicit Gateway(std::unique_ptr<Server> server);
  std::unique_ptr<Server> server_;
};

}  // namespace punctum::console
