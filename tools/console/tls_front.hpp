// TLS before the gateway: what comes in encrypted goes on in plain over a pair of local sockets, and what the
// gateway answers goes back encrypted. So the gateway speaks one kind of connection.
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <functional>
#include <memory>
#include <string>
#include <tl/expected.hpp>

namespace punctum::console {

class TlsFront {
 public:
  using Plain = boost::asio::generic::stream_protocol::socket;

  // PEM files: the certificate with its chain, and its key, which nobody but its owner may read. The error is
  // one line.
  [[nodiscard]] static tl::expected<TlsFront, std::string> open(const std::string& certificate,
                                                                const std::string& key);
  TlsFront(TlsFront&&) noexcept;
  TlsFront& operator=(TlsFront&&) noexcept;
  ~TlsFront();

  // `begun` gets the plain side once the handshake is done, which may take limit_s; or is never called. The
  // result lives as long as something of the connection is under way.
  std::weak_ptr<void> take(boost::asio::ip::tcp::socket encrypted, int limit_s,
                           std::function<void(Plain)> begun);

 private:
  class Context;
  class Connection;
  explicit TlsFront(std::unique_ptr<Context> context);
  std::unique_ptr<Context> context_;
};

}  // namespace punctum::console
