#include "tools/emulators/drive/drive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>

namespace punctum::emulator {
namespace {

constexpr int kStopped = 0x04, kOperational = 0x05, kPreOperational = 0x7F;
constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr double kStep_s = 100e-6;  // of the motor
constexpr int kHoming = 6, kSynchronousPosition = 8;
constexpr std::uint32_t kOff = 0x8000'0000;
constexpr std::int64_t kInt32Min = std::numeric_limits<std::int32_t>::min();
constexpr std::int64_t kInt32Max = std::numeric_limits<std::int32_t>::max();
// Cycles without SYNC after which the drive takes the link for lost.
constexpr int kSyncsMissed = 10;
constexpr std::uint16_t kHeartbeatLost = 0x8130, kPdoTooShort = 0x8210, kSyncLost = 0x8700;
constexpr std::uint8_t kCommunicationError = 0x11;  // of the error register: generic, and communication

std::uint32_t word(const std::uint8_t* data, int bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) {
    value |= static_cast<std::uint32_t>(data[i]) << 8 * i;
  }
  return value;
}
void put(std::uint8_t* data, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) {
    data[i] = static_cast<std::uint8_t>(value >> 8 * i);
  }
}

}  // namespace

const char* const Drive::kCommands =
    "fault CODE | ignore quick-stop|disable|enable | obey | mute heartbeat|pdo|sdo|emergency|all | speak | "
    "freeze | thaw | stick | unstick | creep COUNTS_PER_SECOND | switch-off | switch-on | reset | emergency "
    "CODE | "
    "refuse INDEX:SUB ABORT_CODE";

Drive::Drive(DriveParams params)
    : params_(std::move(params)), motor_(params_.motor, params_.start_counts), demand_(params_.start_counts) {
  add_communication_objects();
  add_drive_objects();
}

// ---- objects ----

void Drive::add_communication_objects() {
  const auto node = static_cast<std::uint32_t>(params_.node);
  objects_.add(0x1000, 0, {.access = Access::constant, .value = 0x0002'0192});  // servo drive, profile 402
  objects_.add(0x1001, 0, {.bytes = 1, .access = Access::read_only});
  objects_.add(0x1005, 0, {.value = 0x80});
  objects_.add(0x1006, 0, {});
  objects_.add(0x1008, 0, {.bytes = 0, .access = Access::constant, .text = params_.name});
  objects_.add(0x1014, 0, {.access = Access::read_only, .value = 0x80 + node});
  objects_.add(0x1016, 0, {.bytes = 1, .access = Access::constant, .value = 1});
  objects_.add(0x1016, 1, {.most = 0x7F'FFFF});
  objects_.add(0x1017, 0, {.bytes = 2, .most = 0xFFFF});
  objects_.add(0x1018, 0, {.bytes = 1, .access = Access::constant, .value = 4});
  objects_.add(0x1018, 1, {.access = Access::constant, .value = params_.vendor_id});
  objects_.add(0x1018, 2, {.access = Access::constant, .value = params_.product_code});
  objects_.add(0x1018, 3, {.access = Access::constant, .value = 1});
  objects_.add(0x1018, 4, {.access = Access::constant, .value = node});
  objects_.add(0x1029, 0, {.bytes = 1, .access = Access::constant, .value = 1});
  objects_.add(0x1029, 1, {.bytes = 1, .most = 2});
  add_pdo(kRpdo, 0x200 + node, {0x6040'0010});
  add_pdo(kTpdo, 0x180 + node, {0x6041'0010});
  // What many drives come with: a second one, sent on every SYNC unless it is switched off.
  objects_.add(0x1801, 0, {.bytes = 1, .access = Access::constant, .value = 2});
  objects_.add(0x1801, 1, {.value = 0x280 + node});
  objects_.add(0x1801, 2, {.bytes = 1, .most = 0xFF, .value = 1});
}

void Drive::add_pdo(const Pdo& pdo, std::uint32_t id, const std::vector<std::uint32_t>& entries) {
  constexpr std::uint8_t kMostEntries = 8;
  objects_.add(pdo.parameter, 0, {.bytes = 1, .access = Access::constant, .value = 2});
  objects_.add(pdo.parameter, 1, {.value = id, .check = [this, pdo](std::int64_t wanted) {
                                    // The identifier changes only while the PDO is off, or by switching it.
                                    const std::int64_t now = objects_.get(pdo.parameter, 1);
                                    const bool stays_on = (now & kOff) == 0 && (wanted & kOff) == 0;
                                    const bool other = ((now ^ wanted) & 0x1FFF'FFFF) != 0;
                                    return stays_on && other ? abort_state : abort_none;
                                  }});
  objects_.add(pdo.parameter, 2, {.bytes = 1, .most = 0xFF, .value = 0xFF, .check = [](std::int64_t type) {
                                    return type > 240 && type < 254 ? abort_range : abort_none;
                                  }});
  objects_.add(pdo.mapping, 0,
               {.bytes = 1,
                .value = static_cast<std::int64_t>(entries.size()),
                .check = [this, pdo](std::int64_t count) { return check_mapping_count(pdo, count); }});
  for (std::uint8_t sub = 1; sub <= kMostEntries; ++sub) {
    objects_.add(pdo.mapping, sub,
                 {.value = sub <= entries.size() ? static_cast<std::int64_t>(entries[sub - 1U]) : 0,
                  .check = [this, pdo](std::int64_t entry) { return check_mapping(pdo, entry); }});
  }
}

Abort Drive::check_mapping(const Pdo& pdo, std::int64_t entry) const {
  if (pdo_is_on(pdo) || objects_.get(pdo.mapping, 0) != 0) {
    return abort_state;
  }
  const auto index = static_cast<std::uint16_t>(entry >> 16);
  const auto sub = static_cast<std::uint8_t>(entry >> 8);
  const Entry* object = objects_.find(index, sub);
  if (object == nullptr) {
    return objects_.missing(index);
  }
  const bool right_way = pdo.mapping == kRpdo.mapping
                             ? object->access == Access::read_write || object->access == Access::write_only
                             : object->access != Access::write_only;
  return object->mappable && right_way && (entry & 0xFF) == 8 * object->bytes ? abort_none
                                                                              : abort_not_mappable;
}

Abort Drive::check_mapping_count(const Pdo& pdo, std::int64_t count) const {
  constexpr std::int64_t kMostEntries = 8, kMostBits = 64;
  if (pdo_is_on(pdo)) {
    return abort_state;
  }
  if (count > kMostEntries) {
    return abort_range;
  }
  std::int64_t bits = 0;
  const auto entries = static_cast<std::uint8_t>(count);
  for (std::uint8_t sub = 1; sub <= entries; ++sub) {
    const std::int64_t entry = objects_.get(pdo.mapping, sub);
    if (entry == 0) {
      return abort_not_mappable;
    }
    bits += entry & 0xFF;
  }
  return bits > kMostBits ? abort_pdo_length : abort_none;
}

void Drive::add_drive_objects() {
  const auto number = [this](std::uint16_t index, std::uint8_t sub, int bytes, std::int64_t value) {
    objects_.add(index, sub, {.bytes = bytes, .most = (std::int64_t{1} << 8 * bytes) - 1, .value = value});
  };
  const auto whole = [this](std::uint16_t index, std::uint8_t sub, std::int64_t value) {
    objects_.add(index, sub, {.is_signed = true, .least = kInt32Min, .most = kInt32Max, .value = value});
  };
  objects_.add(0x6007, 0, {.bytes = 2, .is_signed = true, .least = 0, .most = 3, .value = 1});
  objects_.add(0x603F, 0, {.bytes = 2, .access = Access::read_only, .mappable = true});
  objects_.add(0x6040, 0, {.bytes = 2, .mappable = true, .most = 0xFFFF});
  objects_.add(0x6041, 0, {.bytes = 2, .access = Access::read_only, .mappable = true});
  objects_.add(
      0x605A, 0,
      {.bytes = 2, .is_signed = true, .least = 0, .most = 8, .value = 2, .check = [](std::int64_t option) {
         const bool known = option <= 2 || option == 5 || option == 6;
         return known ? abort_none : abort_range;
       }});
  objects_.add(0x6060, 0,
               {.bytes = 1,
                .is_signed = true,
                .mappable = true,
                .least = -128,
                .most = 127,
                .value = kSynchronousPosition,
                .check = [](std::int64_t wanted) {
                  const bool known = wanted == kHoming || wanted == kSynchronousPosition;
                  return known ? abort_none : abort_range;
                }});
  objects_.add(0x6061, 0,
               {.bytes = 1,
                .is_signed = true,
                .access = Access::read_only,
                .mappable = true,
                .value = kSynchronousPosition});
  objects_.add(0x6064, 0, {.is_signed = true, .access = Access::read_only, .mappable = true});
  number(0x6065, 0, 4, 2000);
  number(0x6066, 0, 2, 10);
  objects_.add(0x606C, 0, {.is_signed = true, .access = Access::read_only, .mappable = true});
  objects_.add(0x607A, 0, {.is_signed = true, .mappable = true, .least = kInt32Min, .most = kInt32Max});
  objects_.add(0x607D, 0, {.bytes = 1, .access = Access::constant, .value = 2});
  whole(0x607D, 1, kInt32Min);
  whole(0x607D, 2, kInt32Max);
  number(0x6084, 0, 4, 5'000'000);
  number(0x6085, 0, 4, 10'000'000);
  objects_.add(0x6098, 0,
               {.bytes = 1,
                .is_signed = true,
                .least = -128,
                .most = 127,
                .value = 37,
                .check = [](std::int64_t method) {
                  const bool known = method == 17 || method == 18 || method == 35 || method == 37;
                  return known ? abort_none : abort_range;
                }});
  objects_.add(0x6099, 0, {.bytes = 1, .access = Access::constant, .value = 2});
  number(0x6099, 1, 4, 10'000);
  number(0x6099, 2, 4, 1'000);
  number(0x609A, 0, 4, 100'000);
  objects_.add(0x60C2, 0, {.bytes = 1, .access = Access::constant, .value = 2});
  objects_.add(0x60C2, 1, {.bytes = 1, .least = 1, .most = 255, .value = 1});
  objects_.add(0x60C2, 2, {.bytes = 1, .is_signed = true, .least = -128, .most = 63, .value = -3});
  objects_.add(0x60F4, 0, {.is_signed = true, .access = Access::read_only, .mappable = true});
  objects_.add(0x6502, 0, {.access = Access::constant, .value = 1 << 5 | 1 << 7});  // homing, position
}

std::int64_t Drive::value(std::uint16_t index, std::uint8_t sub) const { return objects_.get(index, sub); }

// ---- network ----

void Drive::boot() {
  nmt_ = kPreOperational;
  const std::uint8_t boot_up = 0;
  send(0x700, 1, &boot_up);
  heartbeat_ns_ = now_ns_;
}

void Drive::send(std::uint32_t id, std::uint8_t size, const std::uint8_t* data) {
  can_frame frame{};
  frame.can_id = id + static_cast<std::uint32_t>(params_.node);
  frame.can_dlc = size;
  std::memcpy(frame.data, data, size);
  out_.push_back(frame);
}

void Drive::on_frame(const can_frame& frame, std::int64_t now_ns) {
  advance(now_ns);
  if (frozen_ || nmt_ == 0 || (frame.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0) {
    return;
  }
  const auto node = static_cast<std::uint32_t>(params_.node);
  if (frame.can_id == 0) {
    on_nmt(frame);
  } else if (frame.can_id == 0x80) {
    on_sync(now_ns);
  } else if (frame.can_id == 0x600 + node) {
    on_sdo(frame);
  } else if (frame.can_id > 0x700 && frame.can_id <= 0x77F) {
    const auto master = static_cast<std::uint32_t>(objects_.get(0x1016, 1)) >> 16U;
    if (frame.can_id == 0x700 + master && frame.can_dlc == 1) {
      master_ns_ = now_ns;
      communication_back(kHeartbeatLost);
    }
  } else if (pdo_is_on(kRpdo) && frame.can_id == (objects_.get(kRpdo.parameter, 1) & 0x7FF)) {
    on_rpdo(frame);
  }
}

void Drive::on_nmt(const can_frame& frame) {
  if (frame.can_dlc != 2 || (frame.data[1] != 0 && frame.data[1] != params_.node)) {
    return;
  }
  switch (frame.data[0]) {
    case 0x01:
      nmt_ = kOperational;
      break;
    case 0x02:
      nmt_ = kStopped;
      break;
    case 0x80:
      nmt_ = kPreOperational;
      break;
    case 0x81:
    case 0x82:
      add_communication_objects();
      if (frame.data[0] == 0x81) {
        add_drive_objects();
        go(DriveState::switch_on_disabled);
        mode_ = kSynchronousPosition;
      }
      rpdo_pending_ = segments_open_ = false;
      master_ns_ = sync_ns_ = -1;
      boot();
      break;
    default:
      break;
  }
}

bool Drive::pdo_is_on(const Pdo& pdo) const { return (objects_.get(pdo.parameter, 1) & kOff) == 0; }

void Drive::on_rpdo(const can_frame& frame) {
  if (nmt_ != kOperational) {
    return;
  }
  constexpr std::int64_t kLastSynchronous = 240;
  if (objects_.get(kRpdo.parameter, 2) <= kLastSynchronous) {
    pending_rpdo_ = frame;
    rpdo_pending_ = true;
  } else {
    take_rpdo(frame);
  }
}

void Drive::on_sync(std::int64_t now_ns) {
  sync_ns_ = now_ns;
  communication_back(kSyncLost);
  if (nmt_ != kOperational) {
    return;
  }
  if (rpdo_pending_) {
    rpdo_pending_ = false;
    take_rpdo(pending_rpdo_);
  }
  ++syncs_;
  const std::int64_t type = objects_.get(kTpdo.parameter, 2);
  constexpr std::int64_t kLastSynchronous = 240;
  if (pdo_is_on(kTpdo) && type >= 1 && type <= kLastSynchronous && syncs_ % type == 0) {
    send_tpdo();
  }
  if ((objects_.get(0x1801, 1) & kOff) == 0) {
    const std::uint8_t nothing = 0;
    send(static_cast<std::uint32_t>(objects_.get(0x1801, 1) & 0x7FF) -
             static_cast<std::uint32_t>(params_.node),
         1, &nothing);
  }
}

void Drive::take_rpdo(const can_frame& frame) {
  const auto entries = static_cast<std::uint8_t>(objects_.get(kRpdo.mapping, 0));
  int bytes = 0;
  for (std::uint8_t sub = 1; sub <= entries; ++sub) {
    bytes += static_cast<int>(objects_.get(kRpdo.mapping, sub) & 0xFF) / 8;
  }
  if (frame.can_dlc < bytes) {
    communication_error(kPdoTooShort);
    return;
  }
  communication_back(kPdoTooShort);
  int at = 0;
  std::uint16_t controlword = controlword_;
  for (std::uint8_t sub = 1; sub <= entries; ++sub) {
    const std::int64_t entry = objects_.get(kRpdo.mapping, sub);
    const auto index = static_cast<std::uint16_t>(entry >> 16);
    const int size = static_cast<int>(entry & 0xFF) / 8;
    const std::uint32_t raw = word(frame.data + at, size);
    at += size;
    if (index == 0x607A && state_ == DriveState::operation_enabled && mode_ == kSynchronousPosition) {
      const double step = static_cast<std::int32_t>(raw) - demand_;
      largest_step_ = std::max(largest_step_, std::abs(step));
    }
    if (objects_.write(index, static_cast<std::uint8_t>(entry >> 8), raw, size) == abort_none &&
        index == 0x6040) {
      controlword = static_cast<std::uint16_t>(raw);
    }
  }
  control(controlword);  // with its set-point
}

void Drive::send_tpdo() {
  objects_.set(0x6041, 0, statusword());
  std::uint8_t data[8] = {};
  int at = 0;
  const auto entries = static_cast<std::uint8_t>(objects_.get(kTpdo.mapping, 0));
  for (std::uint8_t sub = 1; sub <= entries; ++sub) {
    const std::int64_t entry = objects_.get(kTpdo.mapping, sub);
    const int size = static_cast<int>(entry & 0xFF) / 8;
    put(data + at,
        static_cast<std::uint32_t>(
            objects_.get(static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8))),
        size);
    at += size;
  }
  if (!mute_pdo_) {
    const auto id = static_cast<std::uint32_t>(objects_.get(kTpdo.parameter, 1) & 0x7FF);
    send(id - static_cast<std::uint32_t>(params_.node), static_cast<std::uint8_t>(at), data);
  }
}

// ---- SDO server ----

void Drive::abort_sdo(std::uint16_t index, std::uint8_t sub, std::uint32_t code) {
  std::uint8_t data[8] = {0x80};
  put(data + 1, index, 2);
  data[3] = sub;
  put(data + 4, code, 4);
  send(0x580, 8, data);
  segments_open_ = false;
}

void Drive::on_sdo(const can_frame& frame) {
  if (mute_sdo_ || nmt_ == kStopped || frame.can_dlc != 8) {
    return;
  }
  const std::uint8_t command = frame.data[0];
  const auto index = static_cast<std::uint16_t>(word(frame.data + 1, 2));
  const std::uint8_t sub = frame.data[3];
  switch (command >> 5U) {
    case 1: {  // initiate download
      const std::uint32_t refused = objects_.refused(index, sub);
      const std::uint32_t why = refused != 0 ? refused : download(frame);
      if (why != abort_none) {
        abort_sdo(index, sub, why);
        return;
      }
      std::uint8_t data[8] = {0x60};
      std::memcpy(data + 1, frame.data + 1, 3);
      send(0x580, 8, data);
      return;
    }
    case 2:  // initiate upload
      start_upload(index, sub);
      return;
    case 3:  // upload segment
      upload_segment(command);
      return;
    case 4:  // the client gives up
      segments_open_ = false;
      return;
    default:
      abort_sdo(index, sub, abort_command);
  }
}

Abort Drive::download(const can_frame& frame) {
  const std::uint8_t command = frame.data[0];
  const auto index = static_cast<std::uint16_t>(word(frame.data + 1, 2));
  const std::uint8_t sub = frame.data[3];
  const bool expedited = (command & 2U) != 0, sized = (command & 1U) != 0;
  if (!expedited) {
    return abort_access;  // nothing here is longer than four bytes and can be written
  }
  const int bytes = sized ? 4 - static_cast<int>(command >> 2U & 3U) : 0;
  const Entry* entry = objects_.find(index, sub);
  const Abort why = objects_.write(index, sub, word(frame.data + 4, sized ? bytes : 4), bytes);
  if (why != abort_none || entry == nullptr) {
    return why;
  }
  if (index == 0x6040) {
    control(static_cast<std::uint16_t>(entry->value));
  }
  if (index == 0x6060 && (mode_ != kHoming || !homing_)) {
    mode_ = static_cast<int>(entry->value);
    demand_ = motor_.position();
    objects_.set(0x6061, 0, mode_);
  }
  if (index == 0x1017) {
    heartbeat_ns_ = now_ns_;
  }
  if (index == 0x1016) {
    master_ns_ = -1;
  }
  return abort_none;
}

void Drive::start_upload(std::uint16_t index, std::uint8_t sub) {
  const Entry* entry = objects_.find(index, sub);
  if (entry == nullptr) {
    abort_sdo(index, sub, objects_.missing(index));
    return;
  }
  if (entry->access == Access::write_only) {
    abort_sdo(index, sub, abort_write_only);
    return;
  }
  if (index == 0x6041) {
    objects_.set(0x6041, 0, statusword());
  }
  std::uint8_t data[8] = {};
  put(data + 1, index, 2);
  data[3] = sub;
  if (entry->bytes != 0) {
    data[0] = static_cast<std::uint8_t>(0x43 | (4 - entry->bytes) << 2);
    put(data + 4, static_cast<std::uint32_t>(entry->value), entry->bytes);
  } else {
    data[0] = 0x41;
    put(data + 4, static_cast<std::uint32_t>(entry->text.size()), 4);
    segments_ = entry->text;
    segments_sent_ = 0;
    segments_open_ = true;
    toggle_ = false;
  }
  send(0x580, 8, data);
}

void Drive::upload_segment(std::uint8_t command) {
  if (!segments_open_) {
    abort_sdo(0, 0, abort_command);
    return;
  }
  if (((command & 0x10U) != 0) != toggle_) {
    abort_sdo(0, 0, abort_toggle);
    return;
  }
  constexpr std::size_t kSegment = 7;
  const std::size_t size = std::min(kSegment, segments_.size() - segments_sent_);
  const bool last = segments_sent_ + size == segments_.size();
  std::uint8_t data[8] = {};
  data[0] = static_cast<std::uint8_t>((toggle_ ? 0x10 : 0) | static_cast<int>(kSegment - size) << 1 |
                                      (last ? 1 : 0));
  std::memcpy(data + 1, segments_.data() + segments_sent_, size);
  send(0x580, 8, data);
  segments_sent_ += size;
  toggle_ = !toggle_;
  segments_open_ = !last;
}

// ---- power state machine ----

void Drive::go(DriveState state) {
  if (state == state_) {
    return;
  }
  state_ = state;
  homing_ = false;
  following_since_ns_ = -1;
  if (state == DriveState::operation_enabled) {
    demand_ = motor_.position();
    largest_step_ = 0;
  }
}

bool Drive::motor_has_power() const {
  return state_ == DriveState::switched_on || state_ == DriveState::operation_enabled ||
         state_ == DriveState::quick_stop_active || state_ == DriveState::fault_reaction;
}

void Drive::control(std::uint16_t word) {
  const std::uint16_t before = controlword_;
  controlword_ = word;
  using S = DriveState;
  if (state_ == S::fault_reaction) {
    return;
  }
  if (state_ == S::fault) {
    if ((word & 0x80U) != 0 && (before & 0x80U) == 0) {  // transition 15
      objects_.set(0x603F, 0, 0);
      objects_.set(0x1001, 0, 0);
      emergency(0);
      go(S::switch_on_disabled);
    }
    return;
  }
  const bool voltage = (word & 2U) != 0, no_quick_stop = (word & 4U) != 0;
  const bool switch_on = (word & 1U) != 0, enable = (word & 8U) != 0;
  if (!voltage) {  // 7, 9, 10, 12
    if (!ignore_disable_) {
      go(S::switch_on_disabled);
    }
    return;
  }
  if (!no_quick_stop) {
    if (state_ == S::operation_enabled) {  // 11
      if (!ignore_quick_stop_) {
        go(S::quick_stop_active);
      }
    } else if (state_ != S::quick_stop_active) {  // 7, 10
      go(S::switch_on_disabled);
    }
    return;
  }
  if (off_switch_) {
    return;  // safe torque off: no way up
  }
  if (!switch_on) {  // 2, 6, 8
    if (state_ != S::quick_stop_active) {
      go(S::ready_to_switch_on);
    }
    return;
  }
  if (!enable) {
    if (state_ == S::ready_to_switch_on || state_ == S::operation_enabled) {  // 3, 5
      go(S::switched_on);
    }
    return;
  }
  if (state_ == S::ready_to_switch_on) {  // 3, and 4 by itself
    go(S::switched_on);
  }
  if (state_ == S::switched_on && !ignore_enable_) {  // 4
    go(S::operation_enabled);
  } else if (state_ == S::quick_stop_active && objects_.get(0x605A) >= 5) {  // 16
    go(S::operation_enabled);
  }
  if (state_ == S::operation_enabled && mode_ == kHoming) {
    const bool start = (word & 0x10U) != 0;
    if (start && (before & 0x10U) == 0) {
      homing_ = true;
      homed_ = homing_error_ = false;
    }
    homing_ = homing_ && start;
  }
}

std::uint16_t Drive::statusword() const {
  unsigned word = static_cast<unsigned>(state_);
  const bool holds = state_ == DriveState::operation_enabled || state_ == DriveState::switched_on ||
                     state_ == DriveState::ready_to_switch_on ||
                     (state_ == DriveState::switch_on_disabled && (controlword_ & 4U) != 0);
  word |= holds ? 0x20U : 0U;        // no quick stop
  word |= off_switch_ ? 0U : 0x10U;  // voltage
  word |= 0x200U;                    // remote
  word |= limited_ ? 0x800U : 0U;    // internal limit
  if (mode_ == kHoming) {
    word |= !homing_ ? 0x400U : 0U;  // target reached
    word |= homed_ ? 0x1000U : 0U;   // homing attained
    word |= homing_error_ ? 0x2000U : 0U;
  } else if (state_ == DriveState::operation_enabled) {
    word |= 0x1000U;  // follows the set-point
    word |= following_since_ns_ >= 0 ? 0x2000U : 0U;
  }
  return static_cast<std::uint16_t>(word);
}

void Drive::emergency(std::uint16_t code) {
  if (mute_emergency_ || nmt_ == kStopped) {
    return;
  }
  std::uint8_t data[8] = {};
  put(data, code, 2);
  data[2] = static_cast<std::uint8_t>(objects_.get(0x1001));
  send(0x80, 8, data);
}

void Drive::raise_fault(std::uint16_t code, std::uint8_t error_register) {
  objects_.set(0x603F, 0, code);
  objects_.set(0x1001, 0, error_register);
  emergency(code);
  if (state_ != DriveState::fault) {
    go(motor_.stands() ? DriveState::fault : DriveState::fault_reaction);
  }
}

// CiA 301: the error register goes with its emergency, and back to no error when what it told is over.
void Drive::communication_error(std::uint16_t code) {
  communication_error_ = code;
  objects_.set(0x1001, 0, kCommunicationError);
  emergency(code);
}

void Drive::communication_back(std::uint16_t code) {
  if (communication_error_ != code) {
    return;
  }
  communication_error_ = 0;
  if (objects_.get(0x1001) == kCommunicationError && state_ != DriveState::fault &&
      state_ != DriveState::fault_reaction) {
    objects_.set(0x1001, 0, 0);
    emergency(0);
  }
}

void Drive::link_lost(std::uint16_t code) {
  const bool moves = state_ == DriveState::operation_enabled || state_ == DriveState::switched_on;
  const bool becomes_fault = moves && objects_.get(0x6007) == 1;
  if (!becomes_fault) {
    communication_error(code);
  }
  if (nmt_ == kOperational && objects_.get(0x1029, 1) == 0) {
    nmt_ = kPreOperational;
  }
  if (!moves) {
    return;
  }
  switch (objects_.get(0x6007)) {
    case 1:
      raise_fault(code, kCommunicationError);
      break;
    case 2:
      go(DriveState::switch_on_disabled);
      break;
    case 3:
      go(state_ == DriveState::operation_enabled ? DriveState::quick_stop_active
                                                 : DriveState::switch_on_disabled);
      break;
    default:
      break;
  }
}

// ---- time ----

std::vector<can_frame> Drive::step(std::int64_t now_ns) {
  advance(now_ns);
  std::vector<can_frame> out;
  std::swap(out, out_);
  return out;
}

void Drive::advance(std::int64_t now_ns) {
  if (now_ns_ < 0) {
    now_ns_ = now_ns;
    boot();
  }
  const auto step_ns = std::llround(kStep_s * 1e9);
  while (now_ns - now_ns_ >= step_ns) {
    now_ns_ += step_ns;
    if (!frozen_) {
      follow_set_point(kStep_s, now_ns_);
      watch_time_outs(now_ns_);
    } else {
      motor_.coast(kStep_s);
    }
  }
  const double shown = stuck_encoder_ ? stuck_at_ : motor_.position();
  objects_.set(0x6064, 0, std::llround(shown));
  objects_.set(0x606C, 0, std::llround(motor_.speed()));
  objects_.set(0x60F4, 0, std::llround(demand_ - shown));
}

void Drive::follow_set_point(double dt_s, std::int64_t now_ns) {
  const auto quick = static_cast<double>(objects_.get(0x6085));
  limited_ = false;
  switch (state_) {
    case DriveState::operation_enabled:
      if (mode_ == kHoming) {
        home(dt_s);
        demand_ = motor_.position();
        return;
      }
      break;
    case DriveState::quick_stop_active:
      stop_on_ramp(objects_.get(0x605A) == 5 ? static_cast<double>(objects_.get(0x6084)) : quick, dt_s);
      return;
    case DriveState::fault_reaction:
      motor_.brake(quick, dt_s);
      if (motor_.stands()) {
        go(DriveState::fault);
      }
      return;
    case DriveState::switched_on:
      motor_.brake(quick, dt_s);
      return;
    default:
      if (creep_counts_s_ != 0) {
        motor_.creep(creep_counts_s_, dt_s);
      } else {
        motor_.coast(dt_s);
      }
      return;
  }
  const auto wanted = static_cast<double>(objects_.get(0x607A));
  demand_ = std::clamp(wanted, static_cast<double>(objects_.get(0x607D, 1)),
                       static_cast<double>(objects_.get(0x607D, 2)));
  limited_ = demand_ != wanted;
  motor_.follow(demand_, dt_s);
  const double shown = stuck_encoder_ ? stuck_at_ : motor_.position();
  if (std::abs(demand_ - shown) <= static_cast<double>(objects_.get(0x6065))) {
    following_since_ns_ = -1;
    return;
  }
  following_since_ns_ = following_since_ns_ < 0 ? now_ns : following_since_ns_;
  if (now_ns - following_since_ns_ >= objects_.get(0x6066) * kMillisecond_ns) {
    constexpr std::uint16_t kFollowingError = 0x8611;
    constexpr std::uint8_t kDeviceProfile = 0x21;
    raise_fault(kFollowingError, kDeviceProfile);
  }
}

void Drive::stop_on_ramp(double deceleration_counts_s2, double dt_s) {
  const std::int64_t option = objects_.get(0x605A);
  if (option == 0) {
    go(DriveState::switch_on_disabled);
    return;
  }
  motor_.brake(deceleration_counts_s2, dt_s);
  demand_ = motor_.position();
  if (motor_.stands() && option < 5) {
    go(DriveState::switch_on_disabled);
  }
}

void Drive::home(double dt_s) {
  const auto ramp = static_cast<double>(objects_.get(0x609A));
  const std::int64_t method = objects_.get(0x6098);
  if (!homing_ || homed_) {
    motor_.brake(ramp, dt_s);
    homing_ = homing_ && !(homed_ && motor_.stands());
    return;
  }
  if (method == 17 || method == 18) {
    const double direction = method == 17 ? -1 : 1;
    const bool at_switch = direction * (motor_.position() - params_.switch_counts) >= 0;
    if (!at_switch) {
      motor_.run(direction * static_cast<double>(objects_.get(0x6099, 1)), ramp, dt_s);
      return;
    }
    params_.switch_counts -= params_.switch_counts;
    motor_.shift_origin(motor_.position());
  } else {
    motor_.shift_origin(motor_.position());
  }
  homed_ = true;
}

void Drive::watch_time_outs(std::int64_t now_ns) {
  const std::int64_t producer_ns = objects_.get(0x1017) * kMillisecond_ns;
  if (producer_ns > 0 && now_ns - heartbeat_ns_ >= producer_ns) {
    heartbeat_ns_ = now_ns;
    const auto says = static_cast<std::uint8_t>(nmt_);
    if (!mute_heartbeat_) {
      send(0x700, 1, &says);
    }
  }
  const std::int64_t consumer_ns = (objects_.get(0x1016, 1) & 0xFFFF) * kMillisecond_ns;
  if (consumer_ns > 0 && master_ns_ >= 0 && now_ns - master_ns_ > consumer_ns) {
    master_ns_ = -1;
    link_lost(kHeartbeatLost);
  }
  const std::int64_t cycle_ns = objects_.get(0x1006) * 1000;
  if (cycle_ns > 0 && sync_ns_ >= 0 && now_ns - sync_ns_ > kSyncsMissed * cycle_ns) {
    sync_ns_ = -1;
    if (state_ == DriveState::operation_enabled) {
      link_lost(kSyncLost);
    }
  }
}

// ---- bad habits ----

std::string Drive::command(std::string_view line) {
  std::istringstream words{std::string(line)};
  std::string what, argument, more;
  words >> what >> argument >> more;
  const auto number = [](const std::string& text) { return std::strtoll(text.c_str(), nullptr, 0); };
  if (what == "fault" && !argument.empty()) {
    raise_fault(static_cast<std::uint16_t>(number(argument)), 1);
  } else if (what == "emergency" && !argument.empty()) {
    emergency(static_cast<std::uint16_t>(number(argument)));
  } else if (what == "ignore" && argument == "quick-stop") {
    ignore_quick_stop_ = true;
  } else if (what == "ignore" && argument == "disable") {
    ignore_disable_ = true;
  } else if (what == "ignore" && argument == "enable") {
    ignore_enable_ = true;
  } else if (what == "obey") {
    ignore_quick_stop_ = ignore_disable_ = ignore_enable_ = false;
  } else if (what == "mute" && (argument == "heartbeat" || argument == "pdo" || argument == "sdo" ||
                                argument == "emergency" || argument == "all")) {
    const bool all = argument == "all";
    mute_heartbeat_ = mute_heartbeat_ || all || argument == "heartbeat";
    mute_pdo_ = mute_pdo_ || all || argument == "pdo";
    mute_sdo_ = mute_sdo_ || all || argument == "sdo";
    mute_emergency_ = mute_emergency_ || all || argument == "emergency";
  } else if (what == "speak") {
    mute_heartbeat_ = mute_pdo_ = mute_sdo_ = mute_emergency_ = false;
  } else if (what == "freeze" || what == "thaw") {
    frozen_ = what == "freeze";
  } else if (what == "stick" || what == "unstick") {
    stuck_encoder_ = what == "stick";
    stuck_at_ = motor_.position();
  } else if (what == "creep" && !argument.empty()) {
    creep_counts_s_ = std::strtod(argument.c_str(), nullptr);
  } else if (what == "switch-off") {
    off_switch_ = true;
    go(DriveState::switch_on_disabled);
  } else if (what == "switch-on") {
    off_switch_ = false;
  } else if (what == "reset") {
    can_frame frame{};
    frame.can_dlc = 2;
    frame.data[0] = 0x81;
    on_nmt(frame);
  } else if (what == "refuse" && argument.find(':') != std::string::npos && !more.empty()) {
    const std::string index = argument.substr(0, argument.find(':'));
    const std::string sub = argument.substr(argument.find(':') + 1);
    objects_.refuse(static_cast<std::uint16_t>(std::strtoul(index.c_str(), nullptr, 16)),
                    static_cast<std::uint8_t>(std::strtoul(sub.c_str(), nullptr, 16)),
                    static_cast<std::uint32_t>(std::strtoul(more.c_str(), nullptr, 0)));
  } else {
    return "\"" + std::string(line) + "\": unknown, allowed: " + kCommands;
  }
  return {};
}

}  // namespace punctum::emulator
