#include "tools/console/tls_front.hpp"

#include <fmt/format.h>
#include <openssl/ssl.h>

#include <array>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <utility>

#include "tools/console/private_file.hpp"

namespace punctum::console {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using Local = asio::local::stream_protocol::socket;

constexpr int kSend_s = 20;                      // a peer that takes nothing for so long is left
constexpr std::size_t kPiece_bytes = 16 * 1024;  // a TLS record
constexpr int kPlain_bytes = 8 * 1024;  // what waits between the gateway and here: no more than it knows of

}  // namespace

class TlsFront::Context {
 public:
  asio::ssl::context tls{asio::ssl::context::tls_server};
};

// Two pumps; when either side ends, the connection does.
class TlsFront::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, asio::ssl::context& context)
      : encrypted_(std::move(socket), context),
        plain_(encrypted_.get_executor()),
        other_(encrypted_.get_executor()),
        limit_(encrypted_.get_executor()) {}

  void begin(int limit_s, std::function<void(Plain)> begun) {
    expire_after(limit_s);
    encrypted_.async_handshake(asio::ssl::stream_base::server, [self = shared_from_this(),
                                                                begun = std::move(begun)](error_code failed) {
      if (!failed) {
        failed = asio::local::connect_pair(self->plain_, self->other_, failed);
      }
      if (failed) {
        return self->end();
      }
      self->limit_.cancel();
      failed = self->other_.set_option(asio::socket_base::send_buffer_size(kPlain_bytes), failed);
      begun(Plain(std::move(self->other_)));
      self->pump_in();
      self->pump_out();
    });
  }

 private:
  void pump_in() {
    encrypted_.async_read_some(asio::buffer(in_),
                               [self = shared_from_this()](error_code failed, std::size_t n) {
                                 if (failed) {
                                   return self->end();
                                 }
                                 asio::async_write(self->plain_, asio::buffer(self->in_, n),
                                                   [self](error_code not_written, std::size_t) {
                                                     if (not_written) {
                                                       return self->end();
                                                     }
                                                     self->pump_in();
                                                   });
                               });
  }
  void pump_out() {
    plain_.async_read_some(asio::buffer(out_), [self = shared_from_this()](error_code failed, std::size_t n) {
      if (failed) {
        return self->say_goodbye();
      }
      self->expire_after(kSend_s);
      asio::async_write(self->encrypted_, asio::buffer(self->out_, n),
                        [self](error_code not_written, std::size_t) {
                          self->limit_.cancel();
                          if (not_written) {
                            return self->end();
                          }
                          self->pump_out();
                        });
    });
  }
  void say_goodbye() {
    expire_after(1);
    encrypted_.async_shutdown([self = shared_from_this()](error_code) { self->end(); });
  }
  void end() {
    limit_.cancel();
    error_code ignored;
    ignored = encrypted_.lowest_layer().close(ignored);
    ignored = plain_.close(ignored);
  }
  void expire_after(int limit_s) {
    limit_.expires_after(std::chrono::seconds(limit_s));
    limit_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled) {
        self->end();
      }
    });
  }

  asio::ssl::stream<tcp::socket> encrypted_;
  Local plain_, other_;
  asio::steady_timer limit_;
  std::array<char, kPiece_bytes> in_{}, out_{};
};

TlsFront::TlsFront(std::unique_ptr<Context> context) : context_(std::move(context)) {}
TlsFront::TlsFront(TlsFront&&) noexcept = default;
TlsFront& TlsFront::operator=(TlsFront&&) noexcept = default;
TlsFront::~TlsFront() = default;

tl::expected<TlsFront, std::string> TlsFront::open(const std::string& certificate, const std::string& key) {
  const auto secret = read_file(key, Readers::owner);
  if (!secret) {
    return tl::unexpected(secret.error());
  }
  const auto shown = read_file(certificate, Readers::everybody);
  if (!shown) {
    return tl::unexpected(shown.error());
  }
  auto context = std::make_unique<Context>();
  asio::ssl::context& tls = context->tls;
  error_code failed;
  SSL_CTX_set_min_proto_version(tls.native_handle(), TLS1_2_VERSION);
  SSL_CTX_set_options(tls.native_handle(), SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  // Nobody sits here to type a passphrase.
  failed =
      tls.set_password_callback([](std::size_t, asio::ssl::context::password_purpose) { return ""; }, failed);
  if (failed = tls.use_certificate_chain(asio::buffer(*shown), failed); failed) {
    return tl::unexpected(fmt::format("{}: {}", certificate, failed.message()));
  }
  if (failed = tls.use_private_key(asio::buffer(*secret), asio::ssl::context::pem, failed); failed) {
    return tl::unexpected(fmt::format("{}: {}", key, failed.message()));
  }
  if (SSL_CTX_check_private_key(tls.native_handle()) != 1) {
    return tl::unexpected(fmt::format("{}: not the key of {}", key, certificate));
  }
  return TlsFront(std::move(context));
}

std::weak_ptr<void> TlsFront::take(tcp::socket encrypted, int limit_s, std::function<void(Plain)> begun) {
  const auto connection = std::make_shared<Connection>(std::move(encrypted), context_->tls);
  connection->begin(limit_s, std::move(begun));
  return connection;
}

}  // namespace punctum::console
