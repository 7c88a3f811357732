#include "tools/emulators/drive/pdos.hpp"

#include <algorithm>

#include "tools/emulators/drive/little_endian.hpp"

namespace punctum::emulator {
namespace {

constexpr std::uint32_t kOff = 0x8000'0000, kNoRequest = 0x4000'0000, kExtended = 0x2000'0000;
constexpr std::int64_t kLastSynchronous = 240;
constexpr std::int64_t kSynchronousRequest = 252, kEvent = 254;
constexpr std::uint8_t kMostEntries = 8;
constexpr std::int64_t kInhibitUnit_ns = 100'000, kTimerUnit_ns = 1'000'000;
constexpr std::uint16_t kControlword = 0x6040, kCounterOverflow = 0x1019;
// Sub-indices of a PDO's parameters.
constexpr std::uint8_t kId = 1, kType = 2, kInhibit = 3, kEventTimer = 5, kSyncStart = 6;

// CiA 301, restricted CAN-IDs.
bool is_restricted(std::uint32_t id) {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}

bool is_sent(std::uint16_t parameter) { return parameter >= 0x1800; }

std::uint16_t nth(std::uint16_t parameter, std::size_t i) {
  return static_cast<std::uint16_t>(parameter + i);
}

}  // namespace

// ---- objects ----

void Pdos::add_objects(const Defaults& received, const Defaults& sent) {
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto step = static_cast<std::uint32_t>(0x100 * i);
    add(nth(kReceived, i), 0x200 + step + node_, received[i]);
    add(nth(kSent, i), 0x180 + step + node_, sent[i]);
  }
  received_ = {};
  sent_ = {};
}

void Pdos::add(std::uint16_t parameter, std::uint32_t id, const Default& how) {
  const bool sends = is_sent(parameter);
  const auto mapping = static_cast<std::uint16_t>(parameter + kToMapping);
  const std::string name = (sends ? "TPDO " : "RPDO ") + std::to_string(parameter % 0x100 + 1);
  objects_.compose(parameter, ObjectDictionary::Kind::record, name + " communication parameter",
                   sends ? kSyncStart : kType);
  objects_.add(parameter, kId,
               {.name = "COB-ID used by " + name,
                .value = id | (how.on ? 0 : kOff),
                .plus_node = true,
                .check = [this, parameter](std::int64_t wanted) { return check_id(parameter, wanted); }});
  objects_.add(parameter, kType,
               {.name = "Transmission type",
                .bytes = 1,
                .most = 0xFF,
                .value = how.type,
                .check = [sends](std::int64_t type) {
                  const bool known =
                      type <= kLastSynchronous || type >= (sends ? kSynchronousRequest : kEvent);
                  return known ? abort_none : abort_range;
                }});
  if (sends) {
    const auto while_off = [this, parameter](std::int64_t) {
      return is_on(parameter) ? abort_state : abort_none;
    };
    objects_.add(parameter, kInhibit,
                 {.name = "Inhibit time", .bytes = 2, .most = 0xFFFF, .check = while_off});
    objects_.add(parameter, kEventTimer, {.name = "Event timer", .bytes = 2, .most = 0xFFFF});
    objects_.add(parameter, kSyncStart,
                 {.name = "SYNC start value", .bytes = 1, .most = kLastSynchronous, .check = while_off});
  }
  objects_.compose(mapping, ObjectDictionary::Kind::record, name + " mapping parameter", 0);
  objects_.add(
      mapping, 0,
      {.name = "Number of mapped objects",
       .bytes = 1,
       .most = 0xFF,
       .value = static_cast<std::int64_t>(how.entries.size()),
       .check = [this, parameter](std::int64_t count) { return check_mapping_count(parameter, count); }});
  for (std::uint8_t sub = 1; sub <= kMostEntries; ++sub) {
    objects_.add(
        mapping, sub,
        {.name = "Mapped object " + std::to_string(sub),
         .value = sub <= how.entries.size() ? static_cast<std::int64_t>(how.entries[sub - 1U]) : 0,
         .check = [this, parameter](std::int64_t entry) { return check_mapping(parameter, entry); }});
  }
}

bool Pdos::is_on(std::uint16_t parameter) const { return (objects_.get(parameter, kId) & kOff) == 0; }
std::uint32_t Pdos::id_of(std::uint16_t parameter) const {
  return static_cast<std::uint32_t>(objects_.get(parameter, kId)) & CAN_SFF_MASK;
}

Abort Pdos::check_id(std::uint16_t parameter, std::int64_t wanted) const {
  const auto now = static_cast<std::uint32_t>(objects_.get(parameter, kId));
  const auto id = static_cast<std::uint32_t>(wanted);
  if ((id & (kExtended | (CAN_EFF_MASK & ~CAN_SFF_MASK))) != 0) {
    return abort_range;
  }
  if ((id & kOff) != 0) {
    return abort_none;
  }
  if (is_restricted(id & CAN_SFF_MASK)) {
    return abort_range;
  }
  // The identifier changes only while the PDO is off, or by switching it.
  const bool stays_on = (now & kOff) == 0;
  return stays_on && ((now ^ id) & CAN_SFF_MASK) != 0 ? abort_state : abort_none;
}

Abort Pdos::check_mapping(std::uint16_t parameter, std::int64_t entry) const {
  if (is_on(parameter) || objects_.get(static_cast<std::uint16_t>(parameter + kToMapping), 0) != 0) {
    return abort_state;
  }
  const auto index = static_cast<std::uint16_t>(entry >> 16);
  const auto sub = static_cast<std::uint8_t>(entry >> 8);
  const Entry* object = objects_.find(index, sub);
  if (object == nullptr) {
    return objects_.missing(index);
  }
  const bool right_way = is_sent(parameter)
                             ? object->access != Access::write_only
                             : object->access == Access::read_write || object->access == Access::write_only;
  return object->mappable && right_way && (entry & 0xFF) == 8 * object->bytes ? abort_none
                                                                              : abort_not_mappable;
}

Abort Pdos::check_mapping_count(std::uint16_t parameter, std::int64_t count) const {
  constexpr std::int64_t kMostBits = 64;
  if (is_on(parameter)) {
    return abort_state;
  }
  if (count > kMostEntries) {
    return abort_range;
  }
  std::int64_t bits = 0;
  for (std::uint8_t sub = 1; sub <= static_cast<std::uint8_t>(count); ++sub) {
    const std::int64_t entry = objects_.get(static_cast<std::uint16_t>(parameter + kToMapping), sub);
    if (entry == 0) {
      return abort_not_mappable;
    }
    bits += entry & 0xFF;
  }
  return bits > kMostBits ? abort_pdo_length : abort_none;
}

void Pdos::configured(std::uint16_t index) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (index == nth(kReceived, i)) {
      received_[i] = {};
    } else if (index == nth(kSent, i)) {
      sent_[i] = {};
    }
  }
}

// ---- the exchange ----

void Pdos::start() {
  received_ = {};
  sent_ = {};
}

void Pdos::receive(const can_frame& frame) {
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::uint16_t parameter = nth(kReceived, i);
    if (!is_on(parameter) || frame.can_id != id_of(parameter)) {
      continue;
    }
    if (objects_.get(parameter, kType) <= kLastSynchronous) {
      received_[i] = {frame, true};
    } else {
      take(parameter, frame);
    }
  }
}

void Pdos::take(std::uint16_t parameter, const can_frame& frame) {
  const auto mapping = static_cast<std::uint16_t>(parameter + kToMapping);
  const auto entries = static_cast<std::uint8_t>(objects_.get(mapping, 0));
  int bytes = 0;
  for (std::uint8_t sub = 1; sub <= entries; ++sub) {
    bytes += static_cast<int>(objects_.get(mapping, sub) & 0xFF) / 8;
  }
  device_.received(frame.can_dlc >= bytes);
  if (frame.can_dlc < bytes) {
    return;
  }
  int at = 0;
  bool controls = false;
  for (std::uint8_t sub = 1; sub <= entries; ++sub) {
    const std::int64_t entry = objects_.get(mapping, sub);
    const auto index = static_cast<std::uint16_t>(entry >> 16);
    const auto sub_index = static_cast<std::uint8_t>(entry >> 8);
    const int size = static_cast<int>(entry & 0xFF) / 8;
    const bool taken = objects_.write(index, sub_index, word(frame.data + at, size), size) == abort_none;
    at += size;
    if (taken && index != kControlword) {
      device_.written(index, sub_index);
    }
    controls = controls || (taken && index == kControlword);
  }
  if (controls) {
    device_.written(kControlword, 0);  // with what came beside it
  }
}

Pdos::Bytes Pdos::contents(std::uint16_t parameter) const {
  const auto mapping = static_cast<std::uint16_t>(parameter + kToMapping);
  Bytes bytes;
  const auto entries = static_cast<std::uint8_t>(objects_.get(mapping, 0));
  for (std::uint8_t sub = 1; sub <= entries; ++sub) {
    const std::int64_t entry = objects_.get(mapping, sub);
    const int size = static_cast<int>(entry & 0xFF) / 8;
    put(bytes.data.data() + bytes.size,
        static_cast<std::uint32_t>(
            objects_.get(static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8))),
        size);
    bytes.size = static_cast<std::uint8_t>(bytes.size + size);
  }
  return bytes;
}

void Pdos::send(std::size_t i, const Bytes& bytes, std::int64_t now_ns) {
  sent_[i].last = bytes;
  sent_[i].ever = true;
  sent_[i].sent_ns = now_ns;
  device_.send(id_of(nth(kSent, i)), bytes.size, bytes.data.data());
}

void Pdos::request(std::uint32_t id, std::int64_t now_ns) {
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::uint16_t parameter = nth(kSent, i);
    if (!is_on(parameter) || id != id_of(parameter) || (objects_.get(parameter, kId) & kNoRequest) != 0) {
      continue;
    }
    device_.refresh();
    // With a synchronous type what the SYNC sampled.
    const bool synchronous = objects_.get(parameter, kType) <= kSynchronousRequest;
    send(i, synchronous && sent_[i].sampled ? sent_[i].sample : contents(parameter), now_ns);
  }
}

void Pdos::sync(std::uint8_t counter, std::int64_t now_ns) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (received_[i].waits) {
      received_[i].waits = false;
      take(nth(kReceived, i), received_[i].frame);
    }
  }
  device_.refresh();
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::uint16_t parameter = nth(kSent, i);
    if (!is_on(parameter)) {
      continue;
    }
    Sent& pdo = sent_[i];
    pdo.sample = contents(parameter);
    pdo.sampled = true;
    const std::int64_t type = objects_.get(parameter, kType);
    const std::int64_t from = objects_.get(kCounterOverflow) != 0 ? objects_.get(parameter, kSyncStart) : 0;
    pdo.counts = pdo.counts || from == 0 || counter == from;
    if (type == 0) {
      if (!pdo.ever || pdo.sample != pdo.last) {
        send(i, pdo.sample, now_ns);
      }
    } else if (type <= kLastSynchronous && pdo.counts && ++pdo.syncs % type == 0) {
      send(i, pdo.sample, now_ns);
    }
  }
}

void Pdos::step(std::int64_t now_ns) {
  device_.refresh();
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::uint16_t parameter = nth(kSent, i);
    if (!is_on(parameter) || objects_.get(parameter, kType) < kEvent) {
      continue;
    }
    const Sent& pdo = sent_[i];
    const std::int64_t since_ns = now_ns - pdo.sent_ns;
    const std::int64_t timer_ns = objects_.get(parameter, kEventTimer) * kTimerUnit_ns;
    const Bytes bytes = contents(parameter);
    const bool due = bytes != pdo.last || (timer_ns > 0 && since_ns >= timer_ns);
    if (!pdo.ever || (due && since_ns >= objects_.get(parameter, kInhibit) * kInhibitUnit_ns)) {
      send(i, bytes, now_ns);
    }
  }
}

}  // namespace punctum::emulator
