// What a client may send: the messages of `foxglove.websocket.v1` that this gateway offers. Whatever else
// comes, however broken, becomes one line that says what is wrong.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

#include "hal/browser/fingers.hpp"
#include "tools/shared/replay_segments.hpp"

namespace punctum::console {

struct Subscribe {
  struct One {
    std::uint32_t id;  // the client's own number
    std::uint32_t channel;
  };
  std::vector<One> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids;
};
struct ServiceCall {
  std::uint32_t service;
  std::uint32_t call;  // the client's own number
  std::string encoding;
  std::string request;
};
// Part of the protocol, but not of what this gateway says it can do.
struct NotOffered {
  std::string op;
};
using ClientMessage = std::variant<Subscribe, Unsubscribe, ServiceCall, NotOffered>;

inline constexpr std::size_t kMostSubscriptions = 64;  // in one message, and of one client

[[nodiscard]] tl::expected<ClientMessage, std::string> read_text(std::string_view text);
[[nodiscard]] tl::expected<ClientMessage, std::string> read_binary(std::string_view bytes);

// The requests of services, JSON; of more members than these nothing is read.
struct SetParameter {
  std::string name;
  std::optional<double> value;  // in the parameter's unit; none: undo its last change
};
[[nodiscard]] tl::expected<SetParameter, std::string> read_set(std::string_view request);
// {"hold": true}: take the control, or keep it; false: give it back.
[[nodiscard]] tl::expected<bool, std::string> read_control(std::string_view request);
// {"moved_m": [X, Y, Z], "hold": BOOL, "inject": BOOL, "clutch": BOOL, "next": BOOL}; a button that is not
// named is not pressed. Its session and time are not the client's to say.
[[nodiscard]] tl::expected<browser::Fingers, std::string> read_hand(std::string_view request);
// {"seek": SECONDS}, {"speed": FACTOR} or {"playing": BOOL}.
[[nodiscard]] tl::expected<tools::ReplayWish, std::string> read_replay_wish(std::string_view request);

}  // namespace punctum::console
