#include "tools/console/client_message.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "hal/devices.hpp"

namespace punctum::console {
namespace {

using nlohmann::json;

tl::unexpected<std::string> wrong(const char* what) { return tl::unexpected(std::string(what)); }

// The member of an object; null if it is none or has none of this name.
const json* member(const json& object, const char* name) {
  if (!object.is_object()) {
    return nullptr;
  }
  const auto it = object.find(name);
  return it == object.end() ? nullptr : &*it;
}

std::optional<std::uint32_t> number(const json* value) {
  if (value == nullptr || !value->is_number_unsigned()) {
    return std::nullopt;
  }
  const auto n = value->get<std::uint64_t>();
  return n <= std::numeric_limits<std::uint32_t>::max() ? std::optional(static_cast<std::uint32_t>(n))
                                                        : std::nullopt;
}

tl::expected<ClientMessage, std::string> subscribe(const json& message) {
  const json* list = member(message, "subscriptions");
  if (list == nullptr || !list->is_array() || list->size() > kMostSubscriptions) {
    return wrong("subscribe: subscriptions is not a list of at most 64");
  }
  Subscribe result;
  for (const json& one : *list) {
    const auto id = number(member(one, "id")), channel = number(member(one, "channelId"));
    if (!id || !channel) {
      return wrong("subscribe: a subscription needs id and channelId, both whole numbers");
    }
    result.subscriptions.push_back({*id, *channel});
  }
  return result;
}

tl::expected<ClientMessage, std::string> unsubscribe(const json& message) {
  const json* list = member(message, "subscriptionIds");
  if (list == nullptr || !list->is_array() || list->size() > kMostSubscriptions) {
    return wrong("unsubscribe: subscriptionIds is not a list of at most 64");
  }
  Unsubscribe result;
  for (const json& one : *list) {
    const auto id = number(&one);
    if (!id) {
      return wrong("unsubscribe: a subscription's id is a whole number");
    }
    result.ids.push_back(*id);
  }
  return result;
}

// Little-endian; false when the bytes do not suffice.
bool take(std::string_view& bytes, std::uint32_t& out) {
  if (bytes.size() < 4) {
    return false;
  }
  out = 0;
  for (unsigned i = 0; i < 4; ++i) {
    out |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
  }
  bytes.remove_prefix(4);
  return true;
}

}  // namespace

tl::expected<ClientMessage, std::string> read_text(std::string_view text) {
  const json message = json::parse(text.begin(), text.end(), nullptr, false);
  const json* op = member(message, "op");
  if (op == nullptr || !op->is_string()) {
    return wrong("not a JSON object with a text `op`");
  }
  const auto& name = op->get_ref<const std::string&>();
  if (name == "subscribe") {
    return subscribe(message);
  }
  if (name == "unsubscribe") {
    return unsubscribe(message);
  }
  constexpr std::array kOthers = {"advertise",
                                  "unadvertise",
                                  "getParameters",
                                  "setParameters",
                                  "subscribeParameterUpdates",
                                  "unsubscribeParameterUpdates",
                                  "subscribeConnectionGraph",
                                  "unsubscribeConnectionGraph",
                                  "fetchAsset"};
  if (std::find(kOthers.begin(), kOthers.end(), name) != kOthers.end()) {
    return NotOffered{name};
  }
  return wrong("op: not one of this protocol");
}

tl::expected<ClientMessage, std::string> read_binary(std::string_view bytes) {
  constexpr char kPublish = 1, kServiceCall = 2;
  if (bytes.empty()) {
    return wrong("an empty binary message");
  }
  if (bytes[0] == kPublish) {
    return NotOffered{"publish"};
  }
  if (bytes[0] != kServiceCall) {
    return wrong("a binary message of an unknown kind");
  }
  bytes.remove_prefix(1);
  ServiceCall call{};
  std::uint32_t length = 0;
  if (!take(bytes, call.service) || !take(bytes, call.call) || !take(bytes, length) ||
      length > bytes.size()) {
    return wrong("a service call that ends too early");
  }
  call.encoding = bytes.substr(0, length);
  call.request = bytes.substr(length);
  return call;
}

tl::expected<SetParameter, std::string> read_set(std::string_view request) {
  const json message = json::parse(request.begin(), request.end(), nullptr, false);
  const json *name = member(message, "name"), *value = member(message, "value"),
             *undo = member(message, "undo");
  const bool undoes = undo != nullptr && undo->is_boolean() && undo->get<bool>();
  if (name == nullptr || !name->is_string() || undoes == (value != nullptr) ||
      (value != nullptr && !value->is_number())) {
    return tl::unexpected(
        std::string(R"(allowed: {"name": TEXT, "value": NUMBER} or {"name": TEXT, "undo": true})"));
  }
  return SetParameter{name->get<std::string>(), undoes ? std::nullopt : std::optional(value->get<double>())};
}

tl::expected<bool, std::string> read_control(std::string_view request) {
  const json message = json::parse(request.begin(), request.end(), nullptr, false);
  const json* hold = member(message, "hold");
  if (hold == nullptr || !hold->is_boolean()) {
    return tl::unexpected(std::string(R"(allowed: {"hold": true} or {"hold": false})"));
  }
  return hold->get<bool>();
}

tl::expected<browser::Fingers, std::string> read_hand(std::string_view request) {
  constexpr std::array kNames = {
      std::pair{"hold", hal::kButtonEnable}, std::pair{"inject", hal::kButtonInject},
      std::pair{"clutch", hal::kButtonClutch}, std::pair{"next", hal::kButtonNextCell}};
  const auto refused = [] {
    return tl::unexpected(std::string(
        R"(allowed: {"moved_m": [X, Y, Z] within 1000 m, "hold", "inject", "clutch", "next": true or false})"));
  };
  constexpr double kFarthest_m = 1000;  // a day of moving; the core decides what is too far at once
  const json message = json::parse(request.begin(), request.end(), nullptr, false);
  const json* moved = member(message, "moved_m");
  browser::Fingers fingers;
  if (moved == nullptr || !moved->is_array() || moved->size() != 3) {
    return refused();
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(*moved)[i].is_number() || !(std::abs((*moved)[i].get<double>()) <= kFarthest_m)) {
      return refused();
    }
    fingers.moved_m[i] = (*moved)[i].get<double>();
  }
  for (const auto& [name, button] : kNames) {
    const json* pressed = member(message, name);
    if (pressed != nullptr && !pressed->is_boolean()) {
      return refused();
    }
    fingers.buttons |= pressed != nullptr && pressed->get<bool>() ? button : 0U;
  }
  return fingers;
}

tl::expected<tools::ReplayWish, std::string> read_replay_wish(std::string_view request) {
  using tools::ReplayWish;
  const json message = json::parse(request.begin(), request.end(), nullptr, false);
  const json *seek = member(message, "seek"), *speed = member(message, "speed"),
             *playing = member(message, "playing");
  if (seek != nullptr && seek->is_number()) {
    return ReplayWish{ReplayWish::seek, seek->get<double>()};
  }
  if (speed != nullptr && speed->is_number() && speed->get<double>() >= tools::kSlowestReplay &&
      speed->get<double>() <= tools::kFastestReplay) {
    return ReplayWish{ReplayWish::speed, speed->get<double>()};
  }
  if (playing != nullptr && playing->is_boolean()) {
    return ReplayWish{playing->get<bool>() ? ReplayWish::play : ReplayWish::pause, 0};
  }
  return tl::unexpected(
      std::string(R"(allowed: {"seek": SECONDS}, {"speed": 0.01 to 100} or {"playing": true or false})"));
}

}  // namespace punctum::console
