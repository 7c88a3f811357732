#include "tools/console/gateway.hpp"

#include <fmt/format.h>
#include <netinet/tcp.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "rt/forces/list.hpp"
#include "tools/console/allow_list.hpp"
#include "tools/console/client_message.hpp"
#include "tools/console/control_lease.hpp"
#include "tools/console/frame_counter.hpp"
#include "tools/console/outbox.hpp"
#include "tools/console/page_files.hpp"
#include "tools/console/tls_front.hpp"
#include "tools/console/token_bucket.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/version.hpp"
#include "tools/wire/messages.hpp"

namespace punctum::console {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using beast::error_code;
using nlohmann::json;
using Seconds = std::chrono::seconds;
using Milliseconds = std::chrono::milliseconds;

constexpr const char* kProtocol = "foxglove.websocket.v1";
constexpr const char* kWireVersion = "1";
// What a client offers beside the protocol's name to say who it is; a page can set no other header.
constexpr std::string_view kTokenProtocol = "punctum.token.";
enum Service : std::uint32_t { stop_service = 1, control_service, set_service, replay_service, hand_service };
struct Offered {
  Service id;
  const char *name, *request;  // with its schema's name
};
constexpr std::array<Offered, 5> kServices = {
    {{stop_service, "/punctum/stop", "punctum.v1.StopRequest"},
     {control_service, "/punctum/control", "punctum.v1.ControlRequest"},
     {set_service, "/punctum/set", "punctum.v1.SetRequest"},
     {replay_service, "/punctum/replay", "punctum.v1.ReplayRequest"},
     {hand_service, "/punctum/hand", "punctum.v1.HandRequest"}}};
constexpr int kSendBuffer_bytes = 64 * 1024;  // what the kernel keeps for a client that does not read
// Of it, what has not left yet: what waits there cannot be left out any more, and is old when it arrives.
constexpr int kUnsent_bytes = 8 * 1024;

// A client that is so far behind is told no pictures: they would only push out what is newer.
constexpr std::size_t kBehind_bytes = kOutboxBytes / 4;
// And so far, nothing of which only the newest counts: what waits behind it would be old when it arrives. The
// page takes for fresh what is twice as old.
constexpr double kBehind_s = 0.25;
constexpr bool only_the_newest_counts(ChannelId channel) {
  return channel == telemetry || channel == observation || channel == surface;
}

constexpr std::size_t kMostReasonBytes = 120;  // of a close frame
constexpr double kStopTold_s = 1;  // one line in the log for all the stops that a client asks for within it
// Whoever asked for a stop waits for the word that it is latched.
constexpr double kQuickPoll_s = 0.002, kQuickFor_s = 0.5;

constexpr const char* kContentSecurity =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      three = three << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (unsigned k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

std::string bracketed(const asio::ip::address& address) {
  return address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
}

void append(std::string& to, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) {
    to += static_cast<char>((value >> (8 * i)) & 0xFFU);
  }
}

// Names come from files, where they may be anything.
std::string words(const json& message) {
  return message.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string server_info(const std::string& station) {
  std::string effects;
  for (std::size_t i = 0; i < rt::effect_count; ++i) {
    effects += std::string(i > 0 ? "," : "") + rt::effect_name(i);
  }
  return json{{"op", "serverInfo"},
              {"name", "punctum-console: " + station},
              {"capabilities", {"services"}},
              {"supportedEncodings", {"json"}},
              {"metadata",
               {{"station", station},
                {"wire", kWireVersion},
                {"effects", effects},
                {"time_ns", std::to_string(StationFeed::now_ns())},
                {"version", tools::version_line("punctum-console")}}},
              {"sessionId", station}}
      .dump();
}

// Of messages that are JSON, as JSON Schema.
std::string json_schema(std::string_view name) {
  const json all = json::parse(json_schemas());
  return all.at(std::string(name.substr(name.rfind('.') + 1))).dump();
}

std::string advertisement() {
  const std::string schema = base64(tools::wire_schema());
  json channels = json::array();
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    const Channel& c = kChannels[i];
    const bool is_json = std::string_view(c.encoding) == "json";
    channels.push_back({{"id", i},
                        {"topic", c.topic},
                        {"encoding", c.encoding},
                        {"schemaName", c.schema_name},
                        {"schemaEncoding", is_json ? "jsonschema" : "protobuf"},
                        {"schema", is_json ? json_schema(c.schema_name) : schema}});
  }
  return json{{"op", "advertise"}, {"channels", std::move(channels)}}.dump();
}

std::string services() {
  const auto described = [](const char* schema) {
    return json{{"encoding", "json"},
                {"schemaName", schema},
                {"schemaEncoding", "jsonschema"},
                {"schema", json_schema(schema)}};
  };
  json list = json::array();
  for (const auto& [id, name, request] : kServices) {
    list.push_back({{"id", static_cast<std::uint32_t>(id)},
                    {"name", name},
                    {"type", ""},
                    {"requestSchema", ""},
                    {"responseSchema", ""},
                    {"request", described(request)},
                    {"response", described("punctum.v1.Done")}});
  }
  return json{{"op", "advertiseServices"}, {"services", std::move(list)}}.dump();
}

// A connection that says how many frames of a WebSocket came. Beast keeps to itself those that are empty or
// carry no message.
class Stream : public beast::basic_stream<asio::generic::stream_protocol> {
 public:
  using Base = beast::basic_stream<asio::generic::stream_protocol>;
  using Base::Base;

  // Called with the number of frames that have just begun.
  void on_frames(std::function<void(int)> call) { call_ = std::move(call); }
  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    Base::async_read_some(buffers, [this, buffers, handler = std::forward<Handler>(handler)](
                                       error_code failed, std::size_t n) mutable {
      if (call_) {
        count(buffers, n);
      }
      handler(failed, n);
    });
  }

  template <class Handler>
  friend void async_teardown(beast::role_type role, Stream& stream, Handler&& handler) {
    async_teardown(role, static_cast<Base&>(stream), std::forward<Handler>(handler));
  }

 private:
  template <class Buffers>
  void count(const Buffers& buffers, std::size_t n) {
    int begun = 0;
    for (auto one = asio::buffer_sequence_begin(buffers); n > 0 && one != asio::buffer_sequence_end(buffers);
         ++one) {
      const asio::const_buffer piece = asio::buffer(asio::const_buffer(*one), n);
      begun += frames_.count({static_cast<const char*>(piece.data()), piece.size()});
      n -= piece.size();
    }
    call_(begun);
  }
  std::function<void(int)> call_;
  FrameCounter frames_;
};

// An HTTP response while it is sent.
template <class Body>
struct Answer {
  Answer(http::response<Body> all, bool only_head) : response(std::move(all)), head_only(only_head) {
    serializer.split(head_only);
  }
  [[nodiscard]] bool is_sent() { return head_only ? serializer.is_header_done() : serializer.is_done(); }

  http::response<Body> response;
  http::response_serializer<Body> serializer{response};
  bool head_only;
  std::chrono::steady_clock::time_point until = std::chrono::steady_clock::now() + Seconds(kAnswer_s);
};

}  // namespace

// What a server and its connections share.
class Gateway::Server {
 public:
  Server(StationFeed feed, AllowList allowed, const Tokens& tokens, std::optional<TlsFront> tls,
         tcp::acceptor acceptor, std::unique_ptr<asio::io_context> io)
      : io_(std::move(io)),
        feed_(std::move(feed)),
        allowed_(std::move(allowed)),
        tokens_(tokens),
        tls_(std::move(tls)),
        acceptor_(std::move(acceptor)),
        poll_(*io_),
        pause_(*io_) {}
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  static tl::expected<std::unique_ptr<Server>, std::string> open(StationFeed feed,
                                                                 const GatewaySettings& settings);
  [[nodiscard]] std::string url() const;
  bool run(const std::function<bool()>& stop_asked);

 private:
  class Client;

  void accept();
  void greet(TlsFront::Plain socket, const std::string& from);
  void poll();
  void poll_again();
  void watch_control();
  [[nodiscard]] tl::expected<void, std::string> stop(const std::string& who);
  void end(std::string_view why);

  std::unique_ptr<asio::io_context> io_;  // outlives all below
  StationFeed feed_;
  AllowList allowed_;
  Tokens tokens_;
  std::optional<TlsFront> tls_;
  ControlLease control_;
  std::string in_control_;          // who that is
  std::uint64_t hand_session_ = 0;  // another one each time that control is taken
  std::uint64_t clients_so_far_ = 0;
  tcp::acceptor acceptor_;
  asio::steady_timer poll_, pause_;
  std::function<bool()> stop_asked_;
  bool is_over_ = false, ending_ = false;
  double quick_until_s_ = 0;
  std::uint64_t polls_ = 0;
  std::vector<std::weak_ptr<void>> connections_;  // from their first byte on
  std::vector<std::weak_ptr<Client>> clients_;
  std::vector<Told> told_;
};

// One connection, from its first byte on. It lives as long as something of it is under way.
class Gateway::Server::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Server& server, TlsFront::Plain socket, std::string from, std::uint64_t number)
      : server_(server), http_(std::move(socket)), from_(std::move(from)), number_(number) {}

  void read_request();
  void tell(const Told& news);
  void end(std::string_view why);
  [[nodiscard]] ChannelSet wanted() const;
  [[nodiscard]] std::uint64_t number() const { return number_; }

 private:
  [[nodiscard]] std::string own_state(std::string common) const;
  // What goes wrong in a handler costs this connection and nothing else.
  template <class Handler>
  auto mine(const Handler& handler) {
    return [self = shared_from_this(), handler](auto&&... arguments) {
      try {
        handler(std::forward<decltype(arguments)>(arguments)...);
      } catch (const std::exception&) {
        self->abandon();
      }
    };
  }
  void abandon();
  void answer();
  void refuse(http::status status, const std::string& why);
  void send(http::response<http::string_body> response);
  void send(http::response<http::span_body<const char>> response);
  template <class Body>
  void write(http::response<Body> response);
  template <class Body>
  void write_more(const std::shared_ptr<Answer<Body>>& answer);
  void begin_websocket();
  void read_message();
  void read_more();
  void count(int frames);
  void obey(const ClientMessage& message);
  void subscribe(const Subscribe& wanted);
  void put(const Told& news, std::uint32_t subscription);
  void call(const ServiceCall& request);
  [[nodiscard]] tl::expected<void, std::string> serve(const ServiceCall& request);
  [[nodiscard]] tl::expected<void, std::string> stop();
  [[nodiscard]] tl::expected<void, std::string> control(std::string_view request);
  [[nodiscard]] tl::expected<void, std::string> set(std::string_view request);
  [[nodiscard]] tl::expected<void, std::string> replay_wish(std::string_view request);
  [[nodiscard]] tl::expected<void, std::string> move_hand(std::string_view request);
  void say_asked(std::string_view what, const tl::expected<void, std::string>& asked) const;
  [[nodiscard]] std::string who() const { return fmt::format("{} ({})", person_.name, from_); }
  void send_text(std::string text);
  void send_text(const json& message) { send_text(words(message)); }
  void send_next();
  void close(websocket::close_code code, std::string_view why);

  Server& server_;
  Stream http_;
  std::string from_;      // address of the other side
  std::uint64_t number_;  // of this connection, from 1
  Person person_;
  beast::flat_buffer buffer_{kMostRequestBytes + kMostMessageBytes};
  std::optional<http::request_parser<http::empty_body>> request_;
  std::optional<websocket::stream<Stream>> socket_;  // once it is one
  bool is_open_ = false;                             // its handshake is done
  bool is_closing_ = false;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  // its own number of it: the channel
  Outbox outbox_{kOutboxMessages, kOutboxBytes};
  TokenBucket bucket_{kMostMessages, kMessagesPer_s};
  double begun_s_ = now_s();
  double stop_told_s_ = -kStopTold_s;  // in the log
};

void Gateway::Server::Client::abandon() {
  error_code ignored;
  is_closing_ = true;
  ignored = (socket_ ? beast::get_lowest_layer(*socket_) : http_).socket().close(ignored);
}

void Gateway::Server::Client::read_request() {
  request_.emplace();
  request_->header_limit(kMostRequestBytes);
  request_->body_limit(0);
  http_.expires_after(Seconds(kHandshake_s));
  http::async_read(http_, buffer_, *request_, mine([this](error_code failed, std::size_t) {
                     if (failed == http::error::end_of_stream) {
                       failed = http_.socket().shutdown(tcp::socket::shutdown_send, failed);
                     } else if (failed == http::error::header_limit || failed == http::error::body_limit ||
                                failed == http::error::buffer_overflow) {
                       refuse(http::status::payload_too_large, "too large");
                     } else if (failed.category() == error_code(http::error::bad_method).category()) {
                       refuse(http::status::bad_request, "not a request");
                     } else if (!failed) {
                       answer();
                     }
                   }));
}

void Gateway::Server::Client::answer() {
  const auto& request = request_->get();
  const auto text = [&request](http::field field) {
    const auto value = request[field];
    return std::string_view(value.data(), value.size());
  };
  // Of two names another program on the way may have looked at the other one; a request has no body.
  if (request.count(http::field::host) > 1 || request.count(http::field::transfer_encoding) > 0) {
    return refuse(http::status::bad_request, "two Host headers, or a Transfer-Encoding");
  }
  if (!server_.allowed_.host(text(http::field::host))) {
    return refuse(http::status::misdirected_request, "this name is not one of this gateway");
  }
  if (!server_.allowed_.origin(text(http::field::origin))) {
    return refuse(http::status::forbidden, "this origin is not let in; punctum-console --origin does");
  }
  if (websocket::is_upgrade(request)) {
    return begin_websocket();
  }
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    return refuse(http::status::method_not_allowed, "only GET");
  }
  const std::string_view target(request.target().data(), request.target().size());
  const std::string_view path = target.substr(0, target.find('?'));
  for (const PageFile& file : page_files()) {
    if (file.path != path) {
      continue;
    }
    http::response<http::span_body<const char>> response{http::status::ok, request.version()};
    response.set(http::field::content_type, {file.type.data(), file.type.size()});
    response.set("Content-Security-Policy", kContentSecurity);
    response.body() = {file.bytes.data(), file.bytes.size()};
    return send(std::move(response));
  }
  refuse(http::status::not_found, "nothing is here");
}

void Gateway::Server::Client::refuse(http::status status, const std::string& why) {
  http::response<http::string_body> response{status, request_->get().version() == 10 ? 10U : 11U};
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.keep_alive(false);
  response.body() = why + "\n";
  write(std::move(response));
}

void Gateway::Server::Client::send(http::response<http::span_body<const char>> response) {
  response.keep_alive(request_->get().keep_alive());
  write(std::move(response));
}

template <class Body>
void Gateway::Server::Client::write(http::response<Body> response) {
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set(http::field::cache_control, "no-store");
  response.prepare_payload();
  const bool head_only = request_->get().method() == http::verb::head;
  write_more(std::make_shared<Answer<Body>>(std::move(response), head_only));
}

// Piece by piece: whoever takes some of it within kHandshake_s has as long again, but not for ever.
template <class Body>
void Gateway::Server::Client::write_more(const std::shared_ptr<Answer<Body>>& answer) {
  http_.expires_at(std::min(std::chrono::steady_clock::now() + Seconds(kHandshake_s), answer->until));
  http::async_write_some(http_, answer->serializer, mine([this, answer](error_code failed, std::size_t) {
                           if (!failed && !answer->is_sent()) {
                             write_more(answer);
                           } else if (!failed && answer->response.keep_alive()) {
                             read_request();
                           } else {
                             failed = http_.socket().shutdown(tcp::socket::shutdown_send, failed);
                           }
                         }));
}

void Gateway::Server::Client::begin_websocket() {
  const auto& request = request_->get();
  const auto offered = request[http::field::sec_websocket_protocol];
  http::token_list protocols(offered);
  if (!protocols.exists(kProtocol)) {
    return refuse(http::status::bad_request, fmt::format("the sub-protocol is {}", kProtocol));
  }
  std::string_view token;
  for (const auto& one : protocols) {
    if (const std::string_view text(one.data(), one.size()); text.starts_with(kTokenProtocol)) {
      token = text.substr(kTokenProtocol.size());
    }
  }
  auto known = server_.tokens_.person(token);
  if (!known) {
    return refuse(http::status::unauthorized, known.error());
  }
  person_ = std::move(*known);
  http_.expires_never();  // the WebSocket has time limits of its own
  socket_.emplace(std::move(http_));
  socket_->next_layer().on_frames([this](int frames) { count(frames); });
  websocket::stream_base::timeout limits{};
  limits.handshake_timeout = Seconds(kHandshake_s);
  limits.idle_timeout = Seconds(kIdle_s);
  limits.keep_alive_pings = true;
  socket_->set_option(limits);
  socket_->set_option(websocket::stream_base::decorator(
      [](websocket::response_type& r) { r.set(http::field::sec_websocket_protocol, kProtocol); }));
  socket_->read_message_max(0);  // read_more() has a limit of its own
  socket_->auto_fragment(false);
  socket_->async_accept(request, mine([this](error_code failed) {
                          request_.reset();
                          if (failed) {
                            return;
                          }
                          is_open_ = true;
                          send_text(server_info(server_.feed_.station()));
                          send_text(advertisement());
                          send_text(services());
                          read_message();
                        }));
}

void Gateway::Server::Client::read_message() {
  buffer_.clear();
  read_more();
}

// Piece by piece, so that one that is too large ends in a close handshake. Beast's own limit would close the
// socket with bytes unread, and the client would be reset before it has read why.
void Gateway::Server::Client::read_more() {
  socket_->async_read_some(
      buffer_, kMostMessageBytes + 1 - buffer_.size(), mine([this](error_code failed, std::size_t) {
        if (failed || is_closing_) {
          return;
        }
        if (buffer_.size() > kMostMessageBytes) {
          return close(websocket::close_code::too_big,
                       fmt::format("a message of more than {} bytes", kMostMessageBytes));
        }
        if (!socket_->is_message_done()) {
          return read_more();
        }
        const std::string_view bytes(static_cast<const char*>(buffer_.data().data()), buffer_.size());
        const auto message = socket_->got_text() ? read_text(bytes) : read_binary(bytes);
        if (!message) {
          return close(websocket::close_code::policy_error, message.error());
        }
        obey(*message);
        if (!is_closing_) {
          read_message();
        }
      }));
}

// In the middle of a reading, which goes on until the other side has seen why it is parted with.
void Gateway::Server::Client::count(int frames) {
  const double now = now_s() - begun_s_;
  while (frames > 0 && bucket_.take(now)) {
    --frames;
  }
  if (frames > 0 && is_open_ && !is_closing_) {
    is_closing_ = true;
    asio::post(socket_->get_executor(),
               mine([this] { close(websocket::close_code::policy_error, "too many messages"); }));
  }
}

void Gateway::Server::Client::obey(const ClientMessage& message) {
  if (const auto* wanted = std::get_if<Subscribe>(&message)) {
    subscribe(*wanted);
  } else if (const auto* no_more = std::get_if<Unsubscribe>(&message)) {
    for (const std::uint32_t id : no_more->ids) {
      subscriptions_.erase(id);
      outbox_.forget(id);
    }
  } else if (const auto* request = std::get_if<ServiceCall>(&message)) {
    call(*request);
  } else {
    send_text(json{{"op", "status"},
                   {"level", 1},
                   {"message", std::get<NotOffered>(message).op + ": this gateway does not offer it"}});
  }
}

void Gateway::Server::Client::subscribe(const Subscribe& wanted) {
  for (const Subscribe::One& one : wanted.subscriptions) {
    if (one.channel >= kChannels.size() || subscriptions_.size() >= kMostSubscriptions ||
        !subscriptions_.emplace(one.id, one.channel).second) {
      return close(websocket::close_code::policy_error,
                   "subscribe: no such channel, an id that is taken, or too many");
    }
    // It alone is told what the others have had.
    std::vector<Told> missed;
    server_.feed_.catch_up(static_cast<ChannelId>(one.channel), missed);
    for (const Told& news : missed) {
      put(news, one.id);
    }
  }
  send_next();
}

tl::expected<void, std::string> Gateway::Server::Client::control(std::string_view request) {
  const auto hold = read_control(request);
  if (!hold) {
    return tl::unexpected(hold.error());
  }
  const double now = now_s();
  if (!*hold) {
    if (server_.control_.holder() == number_) {
      server_.control_.give_back(number_);
      server_.feed_.let_go_of_hand();
      tools::say(fmt::format("{} has given control back\n", who()));
    }
    return {};
  }
  if (person_.role != Role::operate) {
    return tl::unexpected(std::string("only whoever has a token to operate may take control"));
  }
  server_.watch_control();  // what another's silence ends, ends first
  if (server_.control_.holder() != number_) {
    if (!server_.control_.hold(number_, now)) {
      return tl::unexpected(fmt::format("{} has control", server_.in_control_));
    }
    server_.in_control_ = who();
    server_.hand_session_ = static_cast<std::uint64_t>(now * 1e9);
    tools::say(fmt::format("{} has taken control\n", who()));
    return {};
  }
  (void)server_.control_.hold(number_, now);
  return {};
}

tl::expected<void, std::string> Gateway::Server::Client::set(std::string_view request) {
  const auto wanted = read_set(request);
  if (!wanted) {
    return tl::unexpected(wanted.error());
  }
  if (!server_.control_.is_held_by(number_, now_s())) {
    return tl::unexpected(std::string("take control first"));
  }
  const Parameters& parameters = server_.feed_.parameters_now();
  const auto command =
      wanted->value ? parameters.command(wanted->name, *wanted->value) : parameters.undo(wanted->name);
  if (!command) {
    return tl::unexpected(command.error());
  }
  auto asked = server_.feed_.ask(*command, person_.name);
  say_asked(parameters.in_words(wanted->name, *command), asked);
  return asked;
}

void Gateway::Server::Client::say_asked(std::string_view what,
                                        const tl::expected<void, std::string>& asked) const {
  tools::say(fmt::format("{} asked for {} at {:.3f} s: {}\n", who(), what, server_.feed_.run_s(),
                         asked ? "sent" : asked.error()));
}

tl::expected<void, std::string> Gateway::Server::Client::stop() {
  auto asked = server_.stop(who());
  if (const double now = now_s(); now - stop_told_s_ > kStopTold_s) {
    stop_told_s_ = now;
    say_asked("a stop", asked);
  }
  return asked;
}

tl::expected<void, std::string> Gateway::Server::Client::replay_wish(std::string_view request) {
  const auto wish = read_replay_wish(request);
  if (!wish) {
    return tl::unexpected(wish.error());
  }
  return server_.feed_.ask(*wish);  // of anybody: nothing moves but what is shown
}

tl::expected<void, std::string> Gateway::Server::Client::move_hand(std::string_view request) {
  auto fingers = read_hand(request);
  if (!fingers) {
    return tl::unexpected(fingers.error());
  }
  if (!server_.control_.is_held_by(number_, now_s())) {
    return tl::unexpected(std::string("take control first"));
  }
  fingers->session = server_.hand_session_;
  return server_.feed_.move_hand(*fingers);
}

tl::expected<void, std::string> Gateway::Server::Client::serve(const ServiceCall& request) {
  switch (request.service) {
    case stop_service:
      return stop();
    case control_service:
      return control(request.request);
    case set_service:
      return set(request.request);
    case replay_service:
      return replay_wish(request.request);
    case hand_service:
      return move_hand(request.request);
    default:
      return tl::unexpected(std::string("no such service"));
  }
}

void Gateway::Server::Client::call(const ServiceCall& request) {
  if (const auto served = serve(request); !served) {
    return send_text(json{{"op", "serviceCallFailure"},
                          {"serviceId", request.service},
                          {"callId", request.call},
                          {"message", served.error()}});
  }
  constexpr std::string_view kEncoding = "json";
  std::string response(1, '\x03');
  append(response, request.service, 4);
  append(response, request.call, 4);
  append(response, kEncoding.size(), 4);
  response += kEncoding;
  response += "{}";
  outbox_.push({.head = std::move(response), .since_s = now_s()});
  send_next();
}

void Gateway::Server::Client::tell(const Told& news) {
  if (news.channel == picture && outbox_.bytes() > kBehind_bytes) {
    return;
  }
  const bool is_behind = only_the_newest_counts(news.channel) && outbox_.behind_s(now_s()) > kBehind_s;
  for (const auto& [id, channel] : subscriptions_) {
    if (channel != news.channel) {
      continue;
    }
    if (is_behind) {
      outbox_.leave_out();
    } else {
      put(news, id);
    }
  }
  send_next();
}

void Gateway::Server::Client::put(const Told& news, std::uint32_t subscription) {
  Outgoing message{.head = "\x01", .since_s = now_s()};
  append(message.head, subscription, 4);
  append(message.head, news.time_ns, 8);
  if (news.channel == state) {  // the one message that is of this client's own
    message.head += own_state(*news.message);
  } else {
    message.body = news.message;
  }
  if (news.holds) {
    message.holds_for = subscription;
  }
  outbox_.push(std::move(message));
}

std::string Gateway::Server::Client::own_state(std::string common) const {
  const std::uint64_t holder = server_.control_.holder();
  const json own = {{"dropped", outbox_.dropped()},
                    {"role", name(person_.role)},
                    {"name", person_.name},
                    {"control", holder == 0         ? "free"
                                : holder == number_ ? "yours"
                                                    : "another's"},
                    {"in_control", holder == 0 ? "" : server_.in_control_}};
  common.back() = ',';
  return common + words(own).substr(1);
}

ChannelSet Gateway::Server::Client::wanted() const {
  ChannelSet all;
  for (const auto& [id, channel] : subscriptions_) {
    all.set(channel);
  }
  return all;
}

void Gateway::Server::Client::send_text(std::string text) {
  outbox_.push({.head = std::move(text), .text = true, .since_s = now_s()});
  send_next();
}

void Gateway::Server::Client::send_next() {
  const Outgoing* next = is_open_ && !is_closing_ ? outbox_.begin_sending() : nullptr;
  if (next == nullptr) {
    return;
  }
  socket_->text(next->text);
  const std::array<asio::const_buffer, 2> bytes = {
      asio::buffer(next->head), next->body ? asio::buffer(*next->body) : asio::const_buffer()};
  socket_->async_write(bytes, mine([this](error_code failed, std::size_t) {
                         outbox_.sent();
                         if (!failed) {
                           send_next();
                         }
                       }));
}

void Gateway::Server::Client::close(websocket::close_code code, std::string_view why) {
  is_closing_ = true;
  const std::string reason(why.substr(0, kMostReasonBytes));
  socket_->async_close(websocket::close_reason(code, reason), mine([](error_code) {}));
}

void Gateway::Server::Client::end(std::string_view why) {
  if (is_open_ && !is_closing_) {
    close(websocket::close_code::going_away, why);
  } else if (!is_closing_) {
    abandon();
  }
}

tl::expected<std::unique_ptr<Gateway::Server>, std::string> Gateway::Server::open(
    StationFeed feed, const GatewaySettings& settings) {
  error_code failed;
  const auto address = asio::ip::make_address(settings.address, failed);
  if (failed) {
    return tl::unexpected(fmt::format("{}: not an address", settings.address));
  }
  const bool encrypted = !settings.certificate.empty(), from_file = settings.tokens.made().empty();
  if (from_file && !encrypted) {  // they are good for later gateways, too, and whoever has this port next
                                  // would be shown them
    return tl::unexpected(std::string("--tokens: refused without TLS; give --certificate and --key, too"));
  }
  if (!address.is_loopback() && !from_file) {
    return tl::unexpected(fmt::format("{}: refused without TLS and a file of tokens", settings.address));
  }
  std::optional<TlsFront> tls;
  if (encrypted) {
    auto opened = TlsFront::open(settings.certificate, settings.key);
    if (!opened) {
      return tl::unexpected(opened.error());
    }
    tls = std::move(*opened);
  }
  auto io = std::make_unique<asio::io_context>(1);
  tcp::acceptor acceptor(*io, address.is_v6() ? tcp::v6() : tcp::v4());
  failed = acceptor.set_option(tcp::acceptor::reuse_address(true), failed);
  const auto bind = [&](std::uint16_t port) {
    failed = acceptor.bind({address, port}, failed);
    if (!failed) {
      failed = acceptor.listen(asio::socket_base::max_listen_connections, failed);
    }
  };
  bind(settings.port);
  if (failed && settings.or_another) {
    bind(0);
  }
  if (failed) {
    return tl::unexpected(fmt::format("{} port {}: {}", settings.address, settings.port, failed.message()));
  }
  std::vector<std::string> hosts = settings.hosts;
  hosts.push_back(bracketed(address));
  AllowList allowed(encrypted ? "https" : "http", acceptor.local_endpoint().port(), hosts, settings.origins);
  return std::make_unique<Server>(std::move(feed), std::move(allowed), settings.tokens, std::move(tls),
                                  std::move(acceptor), std::move(io));
}

std::string Gateway::Server::url() const {
  const tcp::endpoint at = acceptor_.local_endpoint();
  const std::string& token = tokens_.made();
  return fmt::format("{}://{}:{}/{}", tls_ ? "https" : "http", bracketed(at.address()), at.port(),
                     token.empty() ? "" : "#token=" + token);
}

void Gateway::Server::accept() {
  acceptor_.async_accept([this](error_code failed, tcp::socket socket) {
    if (ending_) {
      return;
    }
    if (failed) {  // no descriptor is left, for example: not again at once
      pause_.expires_after(Milliseconds(100));
      pause_.async_wait([this](error_code) { accept(); });
      return;
    }
    std::erase_if(connections_, [](const auto& one) { return one.expired(); });
    std::erase_if(clients_, [](const auto& one) { return one.expired(); });
    if (connections_.size() < kMostClients) {
      error_code ignored;
      ignored = socket.set_option(tcp::no_delay(true), ignored);
      ignored = socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer_bytes), ignored);
      ignored = socket.set_option(
          asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>(kUnsent_bytes), ignored);
      const tcp::endpoint at = socket.remote_endpoint(ignored);
      const std::string from = fmt::format("{}:{}", bracketed(at.address()), at.port());
      if (tls_) {
        connections_.push_back(
            tls_->take(std::move(socket), kHandshake_s, [this, from](TlsFront::Plain plain) {
              if (!ending_) {
                greet(std::move(plain), from);
              }
            }));
      } else {
        greet(TlsFront::Plain(std::move(socket)), from);
        connections_.emplace_back(clients_.back());
      }
    }
    accept();
  });
}

void Gateway::Server::greet(TlsFront::Plain socket, const std::string& from) {
  const auto client = std::make_shared<Client>(*this, std::move(socket), from, ++clients_so_far_);
  clients_.push_back(client);
  client->read_request();
}

// Whoever is silent or gone controls nothing.
void Gateway::Server::watch_control() {
  const std::uint64_t holder = control_.holder();
  const bool is_there = std::any_of(clients_.begin(), clients_.end(), [holder](const auto& one) {
    const auto alive = one.lock();
    return alive && alive->number() == holder;
  });
  const bool gone = holder != 0 && !is_there;
  if (gone) {
    control_.give_back(holder);
  }
  if (gone || control_.lapses(now_s())) {
    feed_.let_go_of_hand();
    tools::say(fmt::format("{} has lost control: {}\n", in_control_, gone ? "gone" : "silent for too long"));
  }
}

void Gateway::Server::poll() {
  ChannelSet wanted;
  for (const auto& client : clients_) {
    if (const auto alive = client.lock()) {
      wanted |= alive->wanted();
    }
  }
  watch_control();
  told_.clear();
  feed_.poll(now_s(), wanted, told_);
  for (const auto& client : clients_) {
    if (const auto alive = client.lock()) {
      for (const Told& news : told_) {
        alive->tell(news);
      }
    }
  }
  is_over_ = feed_.is_over();
  if (is_over_ || stop_asked_()) {
    return end(is_over_ ? "the station has ended" : "punctum-console has ended");
  }
  poll_again();
}

void Gateway::Server::poll_again() {
  const double pause_s = now_s() < quick_until_s_ ? kQuickPoll_s : StationFeed::kPoll_s;
  poll_.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(pause_s)));
  poll_.async_wait([this, mine = ++polls_](error_code failed) {
    if (!failed && mine == polls_) {  // not one that was due when another was asked for
      poll();
    }
  });
}

tl::expected<void, std::string> Gateway::Server::stop(const std::string& who) {
  auto asked = feed_.stop(who);
  if (!ending_) {
    quick_until_s_ = now_s() + kQuickFor_s;
    // Sooner, never later: whoever asks again and again keeps nobody from being told.
    if (poll_.expiry() - std::chrono::steady_clock::now() > std::chrono::duration<double>(kQuickPoll_s)) {
      poll_again();
    }
  }
  return asked;
}

// The connections are told; what does not answer within a moment is left.
void Gateway::Server::end(std::string_view why) {
  ending_ = true;
  error_code ignored;
  ignored = acceptor_.close(ignored);
  pause_.cancel();
  for (const auto& client : clients_) {
    if (const auto alive = client.lock()) {
      alive->end(why);
    }
  }
  poll_.expires_after(Milliseconds(300));
  poll_.async_wait([this](error_code) { io_->stop(); });
}

bool Gateway::Server::run(const std::function<bool()>& stop_asked) {
  stop_asked_ = stop_asked;
  accept();
  poll();
  io_->run();
  return is_over_;
}

Gateway::Gateway(std::unique_ptr<Server> server) : server_(std::move(server)) {}
Gateway::Gateway(Gateway&&) noexcept = default;
Gateway& Gateway::operator=(Gateway&&) noexcept = default;
Gateway::~Gateway() = default;

tl::expected<Gateway, std::string> Gateway::open(StationFeed feed, const GatewaySettings& settings) {
  auto server = Server::open(std::move(feed), settings);
  if (!server) {
    return tl::unexpected(server.error());
  }
  return Gateway(std::move(*server));
}

std::string Gateway::url() const { return server_->url(); }

bool Gateway::run(const std::function<bool()>& stop_asked) { return server_->run(stop_asked); }

}  // namespace punctum::console
