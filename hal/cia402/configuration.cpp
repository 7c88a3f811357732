#include "hal/cia402/configuration.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "hal/cia402/bus_load.hpp"
#include "hal/cia402/power_state.hpp"

namespace punctum::cia402 {
namespace {

using Object = SdoClient::Object;
using Unexpected = tl::unexpected<std::string>;

constexpr std::int64_t kSdoWithin_ns = 200'000'000;
constexpr std::int64_t kPoll_ns = 200'000;

constexpr std::uint32_t kPdoOff = 0x8000'0000;
constexpr std::uint32_t kNoRemoteRequest = 0x4000'0000;
constexpr std::uint32_t kOnEverySync = 1;

constexpr const char* kKeys = "look at the keys of its [[cia402.axis]]";
constexpr const char* kMapping = "the drive must map PDOs freely";

std::uint32_t milliseconds(double s) { return static_cast<std::uint32_t>(std::lround(s * 1e3)); }

// A PDO with new contents: off, empty, filled, counted, on.
void map_pdo(std::vector<Object>& list, std::uint16_t parameter, std::uint32_t id,
             std::initializer_list<std::uint32_t> entries, const char* name) {
  const auto mapping = static_cast<std::uint16_t>(parameter + 0x200);
  list.push_back({{parameter, 1}, 4, id | kPdoOff, name, kMapping});
  list.push_back({{mapping, 0}, 1, 0, name, kMapping});
  std::uint8_t sub = 1;
  for (const std::uint32_t entry : entries) {
    list.push_back({{mapping, sub++}, 4, entry, name, kMapping});
  }
  list.push_back({{mapping, 0}, 1, static_cast<std::uint32_t>(entries.size()), name, kMapping});
  list.push_back({{parameter, 2}, 1, kOnEverySync, name, "the drive must send and take PDOs with the SYNC"});
  list.push_back({{parameter, 1}, 4, id, name, kMapping});
}

// No list is longer. Room for all of it at once; g++ 14 takes a list that grows for one that overflows.
constexpr std::size_t kObjects = 32;

void add_heartbeat(std::vector<Object>& list, const CanStageParams& params) {
  list.push_back(
      {{0x1016, 1},
       4,
       static_cast<std::uint32_t>(params.master_node) << 16U | milliseconds(params.heartbeat_timeout_s),
       "heartbeat consumer",
       "look at master_node and heartbeat_timeout_ms of [cia402]"});
  list.push_back({{0x1017, 0},
                  2,
                  milliseconds(params.heartbeat_s),
                  "heartbeat producer",
                  "look at heartbeat_ms of [cia402]"});
}

}  // namespace

std::string hex(std::uint32_t value, int digits) {
  std::array<char, 12> text{};
  std::snprintf(text.data(), text.size(), "%0*X", digits, value);
  return text.data();
}

std::string text_of(int node, const Object& object) {
  return "node " + std::to_string(node) + ": " + hex(object.id.index, 4) + ":" + hex(object.id.sub, 2) +
         " (" + object.name + ")";
}

tl::expected<SdoAnswer, std::string> SdoClient::ask(int node, const Object& object, const CanFrame& request) {
  const auto lost = [&](const char* what) { return Unexpected(text_of(node, object) + ": " + what); };
  std::int64_t now = clock_.now_ns();
  const std::int64_t until = now + kSdoWithin_ns;
  bool sent = false;
  while (now < until) {
    if (!sent) {
      const Sent was = bus_.send(request);
      if (was == Sent::down) {
        return lost("the CAN interface went down: check `ip -details link show`");
      }
      sent = was == Sent::ok;
    }
    CanFrame frame;
    for (Received got = bus_.receive(frame); got != Received::nothing; got = bus_.receive(frame)) {
      if (got == Received::bus_off || got == Received::down) {
        return lost("the controller left the bus: check bitrate, cable and terminators");
      }
      if (got == Received::error) {
        continue;
      }
      const auto answer = frame.id == sdo_answer_id(node) ? sdo_answer(frame) : std::nullopt;
      if (answer && answer->object == object.id) {
        return *answer;
      }
      others_(frame);
    }
    now += kPoll_ns;
    clock_.sleep_until_ns(now);
    now = clock_.now_ns();
  }
  return lost("no answer within 200 ms: check its power, its node number and bitrate, cable and terminators");
}

tl::expected<void, std::string> SdoClient::download(int node, const Object& object) {
  const auto answer = ask(node, object, sdo_download(node, object.id, object.value, object.bytes));
  if (!answer) {
    return Unexpected(answer.error());
  }
  if (answer->is == SdoAnswer::Is::downloaded) {
    return {};
  }
  const std::string what = answer->is == SdoAnswer::Is::aborted
                               ? std::string(abort_text(answer->value)) + " (0x" + hex(answer->value, 8) + ")"
                               : "it answered something else";
  return Unexpected(text_of(node, object) + ": 0x" + hex(object.value, 2 * static_cast<int>(object.bytes)) +
                    " is refused: " + what + ": " + object.advice);
}

tl::expected<std::uint32_t, std::string> SdoClient::upload(int node, const Object& object) {
  const auto answer = ask(node, object, sdo_upload(node, object.id));
  if (!answer) {
    return Unexpected(answer.error());
  }
  if (answer->is == SdoAnswer::Is::uploaded && (answer->bytes == 0 || answer->bytes >= object.bytes)) {
    return answer->value;
  }
  const std::string what = answer->is == SdoAnswer::Is::aborted
                               ? std::string(abort_text(answer->value)) + " (0x" + hex(answer->value, 8) + ")"
                               : "the answer has another length";
  return Unexpected(text_of(node, object) + ": cannot be read: " + what + ": " + object.advice);
}

tl::expected<std::uint32_t, std::string> SdoClient::upload_if_there(int node, const Object& object,
                                                                    std::uint32_t otherwise) {
  const auto answer = ask(node, object, sdo_upload(node, object.id));
  if (!answer) {
    return Unexpected(answer.error());
  }
  return answer->is == SdoAnswer::Is::uploaded ? answer->value : otherwise;
}

void SdoClient::pass(std::int64_t for_ns) {
  const std::int64_t until = clock_.now_ns() + for_ns;
  for (std::int64_t now = clock_.now_ns(); now < until; now = clock_.now_ns()) {
    CanFrame frame;
    for (Received got = bus_.receive(frame); got == Received::frame || got == Received::error;
         got = bus_.receive(frame)) {
      if (got == Received::frame) {
        others_(frame);
      }
    }
    clock_.sleep_until_ns(now + kPoll_ns);
  }
}

std::vector<Object> configuration(const CanStageParams& params, const AxisParams& axis, double cycle_s) {
  const InterpolationPeriod period = interpolation_period(cycle_s);
  const auto byte_of = [](int value) { return static_cast<std::uint32_t>(value) & 0xFFU; };
  const auto word_of = [](int value) { return static_cast<std::uint32_t>(value); };
  std::vector<Object> list;
  list.reserve(kObjects);
  list.push_back({{0x1006, 0},
                  4,
                  static_cast<std::uint32_t>(std::lround(cycle_s * 1e6)),
                  "SYNC period",
                  "look at sync_divisor of [cia402]"});
  add_heartbeat(list, params);
  list.push_back(
      {{0x6007, 0}, 2, 3, "link loss is a quick stop", "the drive must stop when the link is lost"});
  list.push_back(
      {{0x605A, 0}, 2, 6, "quick stop on its ramp, then hold", "the drive must hold after a stop"});
  list.push_back({{0x6085, 0}, 4, word_of(axis.quick_stop_counts_s2), "quick stop deceleration", kKeys});
  list.push_back({{0x6065, 0}, 4, word_of(axis.following_counts), "following error window", kKeys});
  list.push_back({{0x6066, 0}, 2, word_of(axis.following_ms), "following error time-out", kKeys});
  list.push_back({{0x607D, 1}, 4, word_of(axis.min_counts), "least position", kKeys});
  list.push_back({{0x607D, 2}, 4, word_of(axis.max_counts), "largest position", kKeys});
  list.push_back({{0x60C2, 1}, 1, byte_of(period.mantissa), "interpolation period", "look at sync_divisor"});
  list.push_back({{0x60C2, 2}, 1, byte_of(period.exponent), "interpolation period", "look at sync_divisor"});
  const auto node = static_cast<std::uint32_t>(axis.node);
  map_pdo(list, 0x1400, rpdo1_id(axis.node), {0x60400010, 0x607A0020}, "RPDO 1");
  map_pdo(list, 0x1800, (0x180U + node) | kNoRemoteRequest, {0x60410010, 0x60640020}, "TPDO 1");
  if (params.homing) {
    list.push_back({{0x6098, 0}, 1, byte_of(axis.homing_method), "homing method", kKeys});
    list.push_back({{0x6099, 1}, 4, word_of(axis.homing_fast_counts_s), "homing speed to the switch", kKeys});
    list.push_back({{0x6099, 2}, 4, word_of(axis.homing_slow_counts_s), "homing speed to its edge", kKeys});
    list.push_back({{0x609A, 0}, 4, word_of(axis.homing_counts_s2), "homing acceleration", kKeys});
  }
  list.push_back({{0x6060, 0},
                  1,
                  params.homing ? 6U : 8U,
                  "mode of operation",
                  "the drive must have cyclic synchronous position, and homing where it is asked for"});
  return list;
}

std::vector<Object> force_sensor_configuration(const CanStageParams& params) {
  std::vector<Object> list;
  list.reserve(kObjects);
  add_heartbeat(list, params);
  map_pdo(list, 0x1800, (0x180U + static_cast<std::uint32_t>(params.force_node)) | kNoRemoteRequest,
          {0x91300120}, "TPDO 1");
  return list;
}

}  // namespace punctum::cia402
