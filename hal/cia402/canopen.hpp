// Messages of CANopen (CiA 301) as frames and back. Pure functions; numbers are little-endian on the wire.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "hal/cia402/can_bus.hpp"
#include "hal/realtime.hpp"

namespace punctum::cia402 {

// ---- identifiers: the predefined connection set ----

inline constexpr std::uint16_t kNmtId = 0x000;
inline constexpr std::uint16_t kSyncId = 0x080;
[[nodiscard]] constexpr std::uint16_t emergency_id(int node) NONBLOCKING {
  return static_cast<std::uint16_t>(0x080 + node);
}
[[nodiscard]] constexpr std::uint16_t tpdo1_id(int node) NONBLOCKING {
  return static_cast<std::uint16_t>(0x180 + node);
}
[[nodiscard]] constexpr std::uint16_t rpdo1_id(int node) NONBLOCKING {
  return static_cast<std::uint16_t>(0x200 + node);
}
[[nodiscard]] constexpr std::uint16_t sdo_answer_id(int node) NONBLOCKING {
  return static_cast<std::uint16_t>(0x580 + node);
}
[[nodiscard]] constexpr std::uint16_t sdo_request_id(int node) NONBLOCKING {
  return static_cast<std::uint16_t>(0x600 + node);
}
[[nodiscard]] constexpr std::uint16_t heartbeat_id(int node) NONBLOCKING {
  return static_cast<std::uint16_t>(0x700 + node);
}

// ---- numbers in a frame ----

constexpr void put(CanFrame& frame, std::size_t at, std::uint32_t value, std::size_t bytes) NONBLOCKING {
  for (std::size_t i = 0; i < bytes; ++i) {
    frame.data[at + i] = static_cast<std::uint8_t>(value >> 8U * i);
  }
}
[[nodiscard]] constexpr std::uint32_t get(const CanFrame& frame, std::size_t at, std::size_t bytes)
    NONBLOCKING {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) {
    value |= static_cast<std::uint32_t>(frame.data[at + i]) << 8U * i;
  }
  return value;
}

// ---- network management, SYNC, heartbeat ----

enum class Nmt : std::uint8_t { start = 0x01, stop = 0x02, pre_operational = 0x80, reset_node = 0x81 };
[[nodiscard]] constexpr CanFrame nmt(Nmt command, int node) NONBLOCKING {
  return {kNmtId, 2, {static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(node)}};
}
[[nodiscard]] constexpr CanFrame sync() NONBLOCKING { return {kSyncId, 0, {}}; }

// What a heartbeat says; boot_up comes once, after a reset.
enum class NodeState : std::uint8_t {
  boot_up = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7F
};
[[nodiscard]] constexpr CanFrame heartbeat(int node, NodeState state) NONBLOCKING {
  return {heartbeat_id(node), 1, {static_cast<std::uint8_t>(state)}};
}
[[nodiscard]] constexpr std::optional<NodeState> node_state(const CanFrame& frame) NONBLOCKING {
  if (frame.size != 1) {
    return std::nullopt;
  }
  return static_cast<NodeState>(frame.data[0] & 0x7FU);  // bit 7 belongs to node guarding
}

// ---- service data objects, expedited: up to four bytes ----

struct ObjectId {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  friend constexpr bool operator==(const ObjectId&, const ObjectId&) = default;
};

// bytes: 1 .. 4.
[[nodiscard]] constexpr CanFrame sdo_download(int node, ObjectId object, std::uint32_t value,
                                              std::size_t bytes) NONBLOCKING {
  CanFrame frame{sdo_request_id(node), 8, {}};
  frame.data[0] = static_cast<std::uint8_t>(0x23U | (4U - bytes) << 2U);
  put(frame, 1, object.index, 2);
  frame.data[3] = object.sub;
  put(frame, 4, value, bytes);
  return frame;
}
[[nodiscard]] constexpr CanFrame sdo_upload(int node, ObjectId object) NONBLOCKING {
  CanFrame frame{sdo_request_id(node), 8, {0x40}};
  put(frame, 1, object.index, 2);
  frame.data[3] = object.sub;
  return frame;
}

struct SdoAnswer {
  enum class Is : std::uint8_t { downloaded, uploaded, aborted } is = Is::aborted;
  ObjectId object;
  std::uint32_t value = 0;  // uploaded: the number; aborted: the abort code
  std::size_t bytes = 0;    // uploaded: 1 .. 4; 0 where the server did not say
};
// Nothing: no answer to an expedited request.
[[nodiscard]] constexpr std::optional<SdoAnswer> sdo_answer(const CanFrame& frame) NONBLOCKING {
  if (frame.size != 8) {
    return std::nullopt;
  }
  SdoAnswer answer;
  answer.object = {static_cast<std::uint16_t>(get(frame, 1, 2)), frame.data[3]};
  const unsigned command = frame.data[0];
  if (command == 0x60U) {
    answer.is = SdoAnswer::Is::downloaded;
    return answer;
  }
  if (command == 0x80U) {
    answer.value = get(frame, 4, 4);
    return answer;
  }
  if ((command & 0xE2U) == 0x42U) {  // upload response, expedited
    const bool sized = (command & 1U) != 0;
    answer.is = SdoAnswer::Is::uploaded;
    answer.bytes = sized ? 4U - (command >> 2U & 3U) : 0U;
    answer.value = get(frame, 4, sized ? answer.bytes : 4U);
    return answer;
  }
  return std::nullopt;
}

// CiA 301, table of SDO abort codes.
[[nodiscard]] constexpr const char* abort_text(std::uint32_t code) {
  switch (code) {
    case 0x05030000:
      return "the toggle bit did not alternate";
    case 0x05040000:
      return "the transfer timed out";
    case 0x05040001:
      return "the command is not known";
    case 0x05040005:
      return "out of memory";
    case 0x06010000:
      return "this access to the object is not supported";
    case 0x06010001:
      return "the object can only be written";
    case 0x06010002:
      return "the object can only be read";
    case 0x06020000:
      return "there is no such object";
    case 0x06040041:
      return "the object cannot be mapped to a PDO";
    case 0x06040042:
      return "the mapped objects are longer than a PDO";
    case 0x06040043:
      return "the parameter is incompatible";
    case 0x06040047:
      return "incompatible inside the device";
    case 0x06060000:
      return "a hardware error";
    case 0x06070010:
      return "the length of the value does not match";
    case 0x06070012:
      return "the value is too long";
    case 0x06070013:
      return "the value is too short";
    case 0x06090011:
      return "there is no such sub-index";
    case 0x06090030:
      return "the value is out of range";
    case 0x06090031:
      return "the value is too high";
    case 0x06090032:
      return "the value is too low";
    case 0x06090036:
      return "the maximum is below the minimum";
    case 0x08000000:
      return "a general error";
    case 0x08000020:
      return "the value cannot be stored";
    case 0x08000021:
      return "the value cannot be stored under local control";
    case 0x08000022:
      return "the value cannot be stored in the present state of the device";
    case 0x08000023:
      return "the device has no object dictionary";
    default:
      return "a reason that the standard does not know";
  }
}

// ---- emergency messages ----

struct Emergency {
  std::uint16_t code = 0;  // 0: the error is gone
  std::uint8_t error_register = 0;
};
[[nodiscard]] constexpr std::optional<Emergency> emergency(const CanFrame& frame) NONBLOCKING {
  if (frame.size != 8) {
    return std::nullopt;
  }
  return Emergency{static_cast<std::uint16_t>(get(frame, 0, 2)), frame.data[2]};
}
// CiA 301 and 402, from the particular to the class of the code.
[[nodiscard]] constexpr const char* emergency_text(std::uint16_t code) {
  switch (code) {
    case 0x7305:
      return "incremental encoder 1";
    case 0x8120:
      return "CAN controller error passive";
    case 0x8130:
      return "heartbeat of the master lost";
    case 0x8140:
      return "recovered from bus-off";
    case 0x8611:
      return "following error";
    case 0x8612:
      return "reference limit";
    default:
      break;
  }
  switch (code >> 8U) {
    case 0x00:
      return "no error";
    case 0x10:
      return "generic error";
    case 0x21:
    case 0x22:
    case 0x23:
      return "current";
    case 0x31:
    case 0x32:
    case 0x33:
      return "voltage";
    case 0x41:
    case 0x42:
    case 0x43:
      return "temperature";
    case 0x50:
      return "drive hardware";
    case 0x60:
    case 0x61:
    case 0x62:
    case 0x63:
      return "drive software";
    case 0x71:
      return "power stage or brake";
    case 0x73:
      return "encoder";
    case 0x81:
    case 0x82:
      return "communication";
    case 0x84:
      return "speed";
    case 0x85:
    case 0x86:
      return "position";
    case 0x87:
      return "SYNC";
    default:
      return "an error of the vendor";
  }
}

}  // namespace punctum::cia402
