// An HTTP and WebSocket client (RFC 6455) on plain sockets, written for tests: it can also send what no
// well-behaved client sends, and leave unread what it is sent.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace punctum {

class WebClient {
 public:
  explicit WebClient(std::uint16_t port, int receive_buffer = 0) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) {
      setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~WebClient() {
    SSL_free(tls_);
    SSL_CTX_free(context_);
    close(socket_);
  }
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  // Speaks TLS from here on; false if the other side does not, or its certificate is not this one (PEM).
  bool encrypt(const std::string& certificate, int most_version = 0) {
    context_ = SSL_CTX_new(TLS_client_method());
    SSL_CTX_load_verify_file(context_, certificate.c_str());
    SSL_CTX_set_verify(context_, SSL_VERIFY_PEER, nullptr);
    SSL_CTX_set_security_level(context_, 0);
    SSL_CTX_set_max_proto_version(context_, most_version);
    tls_ = SSL_new(context_);
    SSL_set_fd(tls_, socket_);
    return SSL_connect(tls_) == 1;
  }

  [[nodiscard]] bool connected() const { return connected_; }
  [[nodiscard]] int descriptor() const { return socket_; }
  bool send(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t n = tls_ != nullptr ? SSL_write(tls_, bytes.data(), static_cast<int>(bytes.size()))
                                        : ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n <= 0) {
        return false;
      }
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }

  // Head and body of one response with a Content-Length; empty if none comes.
  std::string request(const std::string& head) {
    send(head);
    while (bytes_.find("\r\n\r\n") == std::string::npos) {
      if (!more()) {
        return std::exchange(bytes_, {});
      }
    }
    const std::size_t body = bytes_.find("\r\n\r\n") + 4;
    std::size_t length = 0;
    if (const std::size_t at = bytes_.find("Content-Length: "); at < body && !head.starts_with("HEAD")) {
      length = std::stoul(bytes_.substr(at + 16));
    }
    while (bytes_.size() < body + length && more()) {
    }
    std::string response = bytes_.substr(0, body + length);
    bytes_.erase(0, body + length);
    return response;
  }
  std::string get(const std::string& target, const std::string& host, const std::string& more = "") {
    return request("GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n" + more + "\r\n");
  }
  // The head of the answer; 101 is a WebSocket.
  std::string upgrade(const std::string& host, const std::string& more = "",
                      const std::string& protocol = "foxglove.websocket.v1") {
    return get("/", host,
               "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: " +
                   protocol + "\r\n" + more);
  }

  static constexpr int kText = 1, kBinary = 2, kClose = 8, kPing = 9;
  // One masked frame.
  bool frame(int opcode, std::string_view payload, bool masked = true) const {
    std::string f(1, static_cast<char>(0x80 | opcode));
    const std::size_t n = payload.size();
    const char mask_bit = masked ? '\x80' : '\0';
    if (n < 126) {
      f += static_cast<char>(n | static_cast<unsigned char>(mask_bit));
    } else if (n < 65536) {
      f += static_cast<char>(126 | static_cast<unsigned char>(mask_bit));
      f += static_cast<char>(n >> 8U);
      f += static_cast<char>(n & 0xFFU);
    } else {
      f += static_cast<char>(127 | static_cast<unsigned char>(mask_bit));
      for (int shift = 56; shift >= 0; shift -= 8) {
        f += static_cast<char>((n >> static_cast<unsigned>(shift)) & 0xFFU);
      }
    }
    if (masked) {
      f += std::string(4, '\0');  // by which nothing changes
    }
    return send(f + std::string(payload));
  }
  bool text(std::string_view payload) const { return frame(kText, payload); }
  bool binary(std::string_view payload) const { return frame(kBinary, payload); }

  struct Frame {
    int opcode = -1;  // none came: the connection is closed, or it took too long
    std::string payload;
    // Of a close frame; 0: none.
    [[nodiscard]] int close_code() const {
      return opcode == kClose && payload.size() >= 2
                 ? static_cast<unsigned char>(payload[0]) << 8 | static_cast<unsigned char>(payload[1])
                 : 0;
    }
  };
  Frame read() {
    if (!have(2)) {
      return {};
    }
    std::size_t head = 2, length = static_cast<unsigned char>(bytes_[1]) & 0x7FU;
    const std::size_t further = length == 126 ? 2 : length == 127 ? 8 : 0;
    if (!have(head + further)) {
      return {};
    }
    if (further > 0) {
      length = 0;
      for (std::size_t i = 0; i < further; ++i) {
        length = length << 8U | static_cast<unsigned char>(bytes_[head + i]);
      }
      head += further;
    }
    if (!have(head + length)) {
      return {};
    }
    Frame got{static_cast<unsigned char>(bytes_[0]) & 0x0F, bytes_.substr(head, length)};
    bytes_.erase(0, head + length);
    return got;
  }
  // The next frame for which this holds; one of opcode -1 if none comes.
  template <class Holds>
  Frame until(Holds holds) {
    for (Frame got = read();; got = read()) {
      if (got.opcode < 0 || holds(got)) {
        return got;
      }
    }
  }
  // The code of the close frame that comes, 0 if the connection ends without one, -1 if nothing comes.
  int closed_with() {
    const Frame got = until([](const Frame& f) { return f.opcode == kClose; });
    return got.opcode == kClose ? got.close_code() : over_ ? 0 : -1;
  }

 private:
  bool have(std::size_t n) {
    while (bytes_.size() < n) {
      if (!more()) {
        return false;
      }
    }
    return true;
  }
  bool more() {
    constexpr int kPatience_ms = 20'000;
    pollfd look{socket_, POLLIN, 0};
    if ((tls_ == nullptr || SSL_pending(tls_) == 0) && poll(&look, 1, kPatience_ms) <= 0) {
      return false;
    }
    std::array<char, 65536> part{};
    const ssize_t n = tls_ != nullptr ? SSL_read(tls_, part.data(), static_cast<int>(part.size()))
                                      : recv(socket_, part.data(), part.size(), 0);
    over_ = n <= 0;
    if (!over_) {
      bytes_.append(part.data(), static_cast<std::size_t>(n));
    }
    return !over_;
  }
  int socket_;
  SSL_CTX* context_ = nullptr;
  SSL* tls_ = nullptr;
  bool connected_ = false, over_ = false;
  std::string bytes_;
};

}  // namespace punctum
