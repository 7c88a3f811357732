#include "tools/emulators/drive/drive.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

#include "tools/emulators/drive/eds.hpp"
#include "tools/emulators/drive/little_endian.hpp"

namespace punctum::emulator {
namespace {

constexpr int kStopped = 0x04, kOperational = 0x05, kPreOperational = 0x7F;
constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr double kStep_s = 100e-6;  // of the motor
constexpr int kHoming = 6, kSynchronousPosition = 8;
constexpr std::int64_t kInt32Min = std::numeric_limits<std::int32_t>::min();
constexpr std::int64_t kInt32Max = std::numeric_limits<std::int32_t>::max();
// Cycles without SYNC after which the drive takes the link for lost.
constexpr int kSyncsMissed = 10;
constexpr std::uint16_t kHeartbeatLost = 0x8130, kPdoTooShort = 0x8210, kSyncLength = 0x8240,
                        kSyncLost = 0x8700;
constexpr std::uint8_t kCommunicationError = 0x11;  // of the error register: generic, and communication
// What is written to 1010 and 1011: "save" and "load".
constexpr std::int64_t kSave = 0x6576'6173, kLoad = 0x6461'6F6C;

// Of CiA 402. Positions change all the time: with the SYNC.
const Pdos::Defaults kReceived = {{{.entries = {0x6040'0010}},
                                   {.entries = {0x6040'0010, 0x6060'0008}},
                                   {.entries = {0x6040'0010, 0x607A'0020}},
                                   {.on = false}}};  // controlword and target velocity, which it has not
const Pdos::Defaults kSent = {{{.entries = {0x6041'0010}},
                               {.entries = {0x6041'0010, 0x6061'0008}},
                               {.type = 1, .entries = {0x6041'0010, 0x6064'0020}},
                               {.type = 1, .entries = {0x6041'0010, 0x606C'0020}}}};

// With 0x before it the number is hexadecimal. Nothing: the word is no such number, or it is above `most`.
std::optional<std::uint32_t> whole_number(std::string_view word, std::uint32_t most, int base = 10) {
  if (word.starts_with("0x")) {
    word.remove_prefix(2);
    base = 16;
  }
  std::uint32_t value = 0;
  const char* const begin = word.data();
  const char* const end = begin + word.size();
  const auto [at, error] = std::from_chars(begin, end, value, base);
  return error == std::errc{} && at == end && value <= most ? std::optional(value) : std::nullopt;
}

// As object 606C can show it.
std::optional<double> speed_counts_s(std::string_view word) {
  double value = 0;
  const char* const begin = word.data();
  const char* const end = begin + word.size();
  const auto [at, error] = std::from_chars(begin, end, value);
  const bool fits = value >= static_cast<double>(kInt32Min) && value <= static_cast<double>(kInt32Max);
  return error == std::errc{} && at == end && fits ? std::optional(value) : std::nullopt;
}

}  // namespace

const char* const Drive::kCommands =
    "fault CODE | ignore quick-stop|disable|enable | obey | mute heartbeat|pdo|sdo|emergency|all | speak | "
    "freeze | thaw | stick | unstick | creep COUNTS_PER_SECOND | switch-off | switch-on | reset | emergency "
    "CODE | "
    "refuse INDEX:SUB ABORT_CODE";

Drive::Drive(DriveParams params)
    : params_(std::move(params)),
      motor_(params_.motor, params_.start_counts),
      pdos_(objects_, params_.node,
            {.refresh = [this] { refresh(); },
             .written = [this](std::uint16_t index, std::uint8_t sub) { on_written(index, sub); },
             .send =
                 [this](std::uint32_t id, std::uint8_t size, const std::uint8_t* data) {
                   if (!mute_pdo_) {
                     send(id - static_cast<std::uint32_t>(params_.node), size, data);
                   }
                 },
             .received =
                 [this](bool long_enough) {
                   long_enough ? communication_back(kPdoTooShort) : communication_error(kPdoTooShort);
                 }}),
      sdo_(
          objects_, [this](std::uint16_t, std::uint8_t) { refresh(); },
          [this](std::uint16_t index, std::uint8_t sub) { on_written(index, sub); }),
      demand_(params_.start_counts) {
  add_communication_objects();
  add_drive_objects();
}

// ---- objects ----

void Drive::add_communication_objects() {
  using Kind = ObjectDictionary::Kind;
  constexpr auto kConstant = Access::constant;
  constexpr std::uint32_t kProducer = 0x4000'0000, kExtended = 0x2000'0000;
  const auto node = static_cast<std::uint32_t>(params_.node);
  const auto text = [this](std::uint16_t index, const char* name, const std::string& value) {
    objects_.add(index, 0, {.name = name, .bytes = 0, .access = kConstant, .text = value});
  };
  // Servo drive, profile 402.
  objects_.add(0x1000, 0, {.name = "Device type", .access = kConstant, .value = 0x0002'0192});
  objects_.add(0x1001, 0, {.name = "Error register", .bytes = 1, .access = Access::read_only});
  objects_.add(0x1005, 0, {.name = "COB-ID SYNC", .value = 0x80, .check = [](std::int64_t id) {
                             return (id & (kProducer | kExtended)) != 0 ? abort_range : abort_none;
                           }});
  objects_.add(0x1006, 0, {.name = "Communication cycle period"});
  text(0x1008, "Manufacturer device name", params_.name);
  text(0x1009, "Manufacturer hardware version", "none");
  text(0x100A, "Manufacturer software version", "1");
  // Reading 1: it stores, and restores, when it is told to.
  objects_.compose(0x1010, Kind::array, "Store parameters", 1);
  objects_.add(0x1010, 1, {.name = "Save all parameters", .value = 1, .check = [](std::int64_t signature) {
                             return signature == kSave ? abort_none : abort_transfer;
                           }});
  objects_.compose(0x1011, Kind::array, "Restore default parameters", 1);
  objects_.add(0x1011, 1,
               {.name = "Restore all default parameters", .value = 1, .check = [](std::int64_t signature) {
                  return signature == kLoad ? abort_none : abort_transfer;
                }});
  objects_.add(0x1014, 0,
               {.name = "COB-ID EMCY", .access = Access::read_only, .value = 0x80 + node, .plus_node = true});
  objects_.compose(0x1016, Kind::array, "Consumer heartbeat time", 1);
  objects_.add(0x1016, 1, {.name = "Consumer heartbeat time 1", .most = 0x7F'FFFF});
  objects_.add(0x1017, 0, {.name = "Producer heartbeat time", .bytes = 2, .most = 0xFFFF});
  objects_.compose(0x1018, Kind::record, "Identity object", 4);
  objects_.add(0x1018, 1, {.name = "Vendor-ID", .access = kConstant, .value = params_.vendor_id});
  objects_.add(0x1018, 2, {.name = "Product code", .access = kConstant, .value = params_.product_code});
  objects_.add(0x1018, 3, {.name = "Revision number", .access = kConstant, .value = 1});
  objects_.add(0x1018, 4, {.name = "Serial number", .access = kConstant, .value = node, .plus_node = true});
  objects_.add(0x1019, 0,
               {.name = "Synchronous counter overflow value",
                .bytes = 1,
                .most = 240,
                .check = [this](std::int64_t wanted) {
                  return wanted == 1 ? abort_range : objects_.get(0x1006, 0) != 0 ? abort_state : abort_none;
                }});
  objects_.compose(0x1029, Kind::array, "Error behaviour", 1);
  objects_.add(0x1029, 1, {.name = "Communication error", .bytes = 1, .most = 2});
  objects_.compose(0x1200, Kind::record, "SDO server parameter", 2);
  objects_.add(0x1200, 1,
               {.name = "COB-ID client to server",
                .access = Access::read_only,
                .value = 0x600 + node,
                .plus_node = true});
  objects_.add(0x1200, 2,
               {.name = "COB-ID server to client",
                .access = Access::read_only,
                .value = 0x580 + node,
                .plus_node = true});
  pdos_.add_objects(kReceived, kSent);
}

void Drive::add_drive_objects() {
  using Kind = ObjectDictionary::Kind;
  const auto number = [this](std::uint16_t index, std::uint8_t sub, const char* name, int bytes,
                             std::int64_t value) {
    objects_.add(index, sub,
                 {.name = name, .bytes = bytes, .most = (std::int64_t{1} << 8 * bytes) - 1, .value = value});
  };
  const auto limit = [this](std::uint8_t sub, const char* name, std::int64_t value, auto check) {
    objects_.add(0x607D, sub,
                 {.name = name,
                  .is_signed = true,
                  .least = kInt32Min,
                  .most = kInt32Max,
                  .value = value,
                  .check = check});
  };
  const auto shown = [this](std::uint16_t index, const char* name, int bytes, bool is_signed) {
    objects_.add(index, 0,
                 {.name = name,
                  .bytes = bytes,
                  .is_signed = is_signed,
                  .access = Access::read_only,
                  .mappable = true});
  };
  objects_.add(0x6007, 0,
               {.name = "Abort connection option code",
                .bytes = 2,
                .is_signed = true,
                .least = 0,
                .most = 3,
                .value = 1});
  shown(0x603F, "Error code", 2, false);
  objects_.add(0x6040, 0, {.name = "Controlword", .bytes = 2, .mappable = true, .most = 0xFFFF});
  shown(0x6041, "Statusword", 2, false);
  objects_.add(0x605A, 0,
               {.name = "Quick stop option code",
                .bytes = 2,
                .is_signed = true,
                .least = 0,
                .most = 8,
                .value = 2,
                .check = [](std::int64_t option) {
                  const bool known = option <= 2 || option == 5 || option == 6;
                  return known ? abort_none : abort_range;
                }});
  objects_.add(0x6060, 0,
               {.name = "Modes of operation",
                .bytes = 1,
                .is_signed = true,
                .mappable = true,
                .least = -128,
                .most = 127,
                .value = kSynchronousPosition,
                .check = [](std::int64_t wanted) {
                  const bool known = wanted == kHoming || wanted == kSynchronousPosition;
                  return known ? abort_none : abort_range;
                }});
  shown(0x6061, "Modes of operation display", 1, true);
  objects_.set(0x6061, 0, kSynchronousPosition);
  shown(0x6064, "Position actual value", 4, true);
  number(0x6065, 0, "Following error window", 4, 2000);
  number(0x6066, 0, "Following error time out", 2, 10);
  shown(0x606C, "Velocity actual value", 4, true);
  objects_.add(0x607A, 0,
               {.name = "Target position",
                .is_signed = true,
                .mappable = true,
                .least = kInt32Min,
                .most = kInt32Max});
  objects_.compose(0x607D, Kind::array, "Software position limit", 2);
  limit(1, "Min position limit", kInt32Min, [this](std::int64_t least) {
    return least > objects_.get(0x607D, 2) ? abort_most_below_least : abort_none;
  });
  limit(2, "Max position limit", kInt32Max, [this](std::int64_t most) {
    return most < objects_.get(0x607D, 1) ? abort_most_below_least : abort_none;
  });
  number(0x6084, 0, "Profile deceleration", 4, 5'000'000);
  number(0x6085, 0, "Quick stop deceleration", 4, 10'000'000);
  objects_.add(0x6098, 0,
               {.name = "Homing method",
                .bytes = 1,
                .is_signed = true,
                .least = -128,
                .most = 127,
                .value = 37,
                .check = [](std::int64_t method) {
                  const bool known = method == 17 || method == 18 || method == 35 || method == 37;
                  return known ? abort_none : abort_range;
                }});
  objects_.compose(0x6099, Kind::array, "Homing speeds", 2);
  number(0x6099, 1, "Speed during search for switch", 4, 10'000);
  number(0x6099, 2, "Speed during search for zero", 4, 1'000);
  number(0x609A, 0, "Homing acceleration", 4, 100'000);
  objects_.compose(0x60C2, Kind::record, "Interpolation time period", 2);
  objects_.add(0x60C2, 1,
               {.name = "Interpolation time period value", .bytes = 1, .least = 1, .most = 255, .value = 1});
  objects_.add(0x60C2, 2,
               {.name = "Interpolation time index",
                .bytes = 1,
                .is_signed = true,
                .least = -128,
                .most = 63,
                .value = -3});
  shown(0x60F4, "Following error actual value", 4, true);
  // By bits, from 0: homing is mode 6, cyclic synchronous position mode 8.
  objects_.add(0x6502, 0,
               {.name = "Supported drive modes",
                .access = Access::constant,
                .value = 1 << (kHoming - 1) | 1 << (kSynchronousPosition - 1)});
}

std::int64_t Drive::value(std::uint16_t index, std::uint8_t sub) const { return objects_.get(index, sub); }

std::string Drive::data_sheet(const DriveParams& params) {
  Drive drive(params);
  drive.refresh();
  return eds(drive.objects_, {.node = params.node,
                              .vendor_id = params.vendor_id,
                              .product_code = params.product_code,
                              .product = params.name});
}

void Drive::store() {
  for (const auto& [key, entry] : objects_.entries()) {
    const bool command =
        key.first == 0x1010 || key.first == 0x1011 || key.first == 0x6040 || key.first == 0x607A;
    if (entry.access == Access::read_write && !command) {
      stored_[key] = entry.value;
    }
  }
}

void Drive::start_from_stored(std::uint16_t from, std::uint16_t to) {
  for (const auto& [key, value] : stored_) {
    if (key.first >= from && key.first <= to) {
      objects_.set(key.first, key.second, value);
    }
  }
}

void Drive::refresh() { objects_.set(0x6041, 0, statusword()); }

void Drive::on_written(std::uint16_t index, std::uint8_t /*sub*/) {
  switch (index) {
    case 0x1010:
      objects_.set(0x1010, 1, 1);
      store();
      break;
    case 0x1011:  // from the next reset on
      objects_.set(0x1011, 1, 1);
      stored_.clear();
      break;
    case 0x1016:
      master_ns_ = -1;
      break;
    case 0x1017:
      heartbeat_ns_ = now_ns_;
      break;
    case 0x6040:
      control(static_cast<std::uint16_t>(objects_.get(0x6040)));
      break;
    case 0x6060:
      if (!homing_) {
        take_mode();
      }
      break;
    case 0x607A:
      if (state_ == DriveState::operation_enabled && mode_ == kSynchronousPosition) {
        largest_step_ =
            std::max(largest_step_, std::abs(static_cast<double>(objects_.get(0x607A)) - demand_));
      }
      break;
    default:
      pdos_.configured(index);
  }
}

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
  if (frozen_ || nmt_ == 0 || (frame.can_id & (CAN_EFF_FLAG | CAN_ERR_FLAG)) != 0) {
    return;
  }
  const auto node = static_cast<std::uint32_t>(params_.node);
  if ((frame.can_id & CAN_RTR_FLAG) != 0) {  // asks for a PDO; nodes are not guarded
    if (nmt_ == kOperational) {
      pdos_.request(frame.can_id & CAN_SFF_MASK, now_ns);
    }
  } else if (frame.can_id == 0) {
    on_nmt(frame);
  } else if (frame.can_id == (objects_.get(0x1005) & CAN_SFF_MASK)) {
    on_sync(frame, now_ns);
  } else if (frame.can_id == 0x600 + node) {
    on_sdo(frame);
  } else if (frame.can_id > 0x700 && frame.can_id <= 0x77F) {
    const auto master = static_cast<std::uint32_t>(objects_.get(0x1016, 1)) >> 16U;
    if (frame.can_id == 0x700 + master && frame.can_dlc == 1) {
      master_ns_ = now_ns;
      communication_back(kHeartbeatLost);
    }
  } else if (nmt_ == kOperational) {
    pdos_.receive(frame);
  }
}

void Drive::become(int nmt) {
  if (nmt == kOperational && nmt_ != kOperational) {
    pdos_.start();
  }
  nmt_ = nmt;
}

void Drive::on_nmt(const can_frame& frame) {
  if (frame.can_dlc != 2 || (frame.data[1] != 0 && frame.data[1] != params_.node)) {
    return;
  }
  constexpr std::uint16_t kCommunicationFirst = 0x1000, kCommunicationLast = 0x1FFF, kLast = 0xFFFF;
  switch (frame.data[0]) {
    case 0x01:
      become(kOperational);
      break;
    case 0x02:
      become(kStopped);
      break;
    case 0x80:
      become(kPreOperational);
      break;
    case 0x81:
    case 0x82: {
      const bool whole_node = frame.data[0] == 0x81;
      const std::int64_t error_register = objects_.get(0x1001);
      add_communication_objects();
      if (whole_node) {
        add_drive_objects();
        go(DriveState::switch_on_disabled);
        controlword_ = 0;
      } else if (state_ == DriveState::fault || state_ == DriveState::fault_reaction) {
        objects_.set(0x1001, 0, error_register);
      }
      start_from_stored(kCommunicationFirst, whole_node ? kLast : kCommunicationLast);
      if (whole_node) {
        mode_ = static_cast<int>(objects_.get(0x6060));
        objects_.set(0x6061, 0, mode_);
      }
      sdo_.reset();
      communication_error_ = 0;
      master_ns_ = sync_ns_ = -1;
      boot();
      break;
    }
    default:
      break;
  }
}

void Drive::on_sync(const can_frame& frame, std::int64_t now_ns) {
  const bool counted = objects_.get(0x1019) != 0;
  if (frame.can_dlc != (counted ? 1 : 0)) {
    if (communication_error_ != kSyncLength) {
      communication_error(kSyncLength);
    }
    return;
  }
  sync_ns_ = now_ns;
  communication_back(kSyncLost);
  communication_back(kSyncLength);
  if (nmt_ == kOperational) {
    pdos_.sync(frame.data[0], now_ns);
  }
}

void Drive::on_sdo(const can_frame& frame) {
  if (mute_sdo_ || nmt_ == kStopped || frame.can_dlc != 8) {
    return;
  }
  SdoServer::Message request;
  std::copy(std::begin(frame.data), std::end(frame.data), request.begin());
  if (const auto answer = sdo_.answer(request)) {
    send(0x580, 8, answer->data());
  }
}

// ---- power state machine ----

void Drive::go(DriveState state) {
  if (state == state_) {
    return;
  }
  state_ = state;
  end_homing();
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
    if (!start) {
      end_homing();
    }
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
    go(motor_.stands() || off_switch_ ? DriveState::fault : DriveState::fault_reaction);
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
  const std::int64_t option = objects_.get(0x6007);
  if (moves && option == 1) {
    raise_fault(code, kCommunicationError);
  } else {
    communication_error(code);
  }
  if (moves && option == 2) {
    go(DriveState::switch_on_disabled);
  } else if (moves && option == 3) {
    go(state_ == DriveState::operation_enabled ? DriveState::quick_stop_active
                                               : DriveState::switch_on_disabled);
  }
  // Last: a stopped node sends no emergency.
  const std::int64_t behaviour = objects_.get(0x1029, 1);
  if (behaviour == 2) {
    become(kStopped);
  } else if (behaviour == 0 && nmt_ == kOperational) {
    become(kPreOperational);
  }
}

// ---- time ----

std::vector<can_frame> Drive::step(std::int64_t now_ns) {
  advance(now_ns);
  if (nmt_ == kOperational && !frozen_) {
    pdos_.step(now_ns);
  }
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

// A mode that was written meanwhile is taken now.
void Drive::end_homing() {
  const bool was = std::exchange(homing_, false);
  if (was && mode_ != objects_.get(0x6060)) {
    take_mode();
  }
}

void Drive::take_mode() {
  mode_ = static_cast<int>(objects_.get(0x6060));
  demand_ = motor_.position();
  objects_.set(0x6061, 0, mode_);
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
      stop_on_ramp(dt_s);
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

void Drive::stop_on_ramp(double dt_s) {
  const std::int64_t option = objects_.get(0x605A);
  const bool slows_down = option == 1 || option == 5;
  if (option == 0) {
    go(DriveState::switch_on_disabled);
    return;
  }
  motor_.brake(static_cast<double>(objects_.get(slows_down ? 0x6084 : 0x6085)), dt_s);
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
    if (homed_ && motor_.stands()) {
      end_homing();
    }
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
  const auto wrong = [line](const std::string& how) { return "\"" + std::string(line) + "\": " + how; };
  const std::string unknown = wrong(std::string("unknown, allowed: ") + kCommands);
  std::istringstream in{std::string(line)};
  std::vector<std::string> words(std::istream_iterator<std::string>(in), {});
  const std::size_t count = words.size();
  words.resize(3);
  const std::string &what = words[0], &argument = words[1], &more = words[2];
  const bool takes_one =
      what == "fault" || what == "emergency" || what == "ignore" || what == "mute" || what == "creep";
  if (count != (what == "refuse" ? 3U : takes_one ? 2U : 1U)) {
    return unknown;
  }
  if (what == "fault" || what == "emergency") {
    const auto code = whole_number(argument, 0xFFFF);
    if (!code) {
      return wrong("\"" + argument + "\" is no code, allowed: 0 .. 0xFFFF");
    }
    if (what == "fault") {
      raise_fault(static_cast<std::uint16_t>(*code), 1);
    } else {
      emergency(static_cast<std::uint16_t>(*code));
    }
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
  } else if (what == "creep") {
    const auto speed = speed_counts_s(argument);
    if (!speed) {
      return wrong("\"" + argument + "\" is no speed, allowed: a number from -2147483648 to 2147483647");
    }
    creep_counts_s_ = *speed;
  } else if (what == "switch-off") {
    off_switch_ = true;
    const bool has_fault = state_ == DriveState::fault || state_ == DriveState::fault_reaction;
    go(has_fault ? DriveState::fault : DriveState::switch_on_disabled);
  } else if (what == "switch-on") {
    off_switch_ = false;
  } else if (what == "reset") {
    can_frame frame{};
    frame.can_dlc = 2;
    frame.data[0] = 0x81;
    on_nmt(frame);
  } else if (what == "refuse") {
    const std::size_t colon = std::min(argument.find(':'), argument.size());
    const auto index = whole_number(argument.substr(0, colon), 0xFFFF, 16);
    const auto sub = whole_number(argument.substr(std::min(colon + 1, argument.size())), 0xFF, 16);
    const auto code = whole_number(more, 0xFFFF'FFFF);
    if (!index || !sub || !code) {
      return wrong("allowed: refuse INDEX:SUB ABORT_CODE, 0:0 .. FFFF:FF (hexadecimal) and 0 .. 0xFFFFFFFF");
    }
    objects_.refuse(static_cast<std::uint16_t>(*index), static_cast<std::uint8_t>(*sub), *code);
  } else {
    return unknown;
  }
  return {};
}

}  // namespace punctum::emulator
