// The process data objects of a CANopen device (CiA 301): four each way, with their parameters and mappings
// in its object dictionary.
//
// Transmission types: 0 and 1 .. 240 with the SYNC, 252 and 253 on a remote request, 254 and 255 when a
// mapped value changes, at most as often as the inhibit time lets it, and when the event timer has run out.
#pragma once

#include <linux/can.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/emulators/drive/object_dictionary.hpp"

namespace punctum::emulator {

class Pdos {
 public:
  static constexpr std::size_t kCount = 4;

  // What a PDO is at first. Identifiers are those of CiA 301, and the node number.
  struct Default {
    bool on = true;
    std::uint8_t type = 255;
    std::vector<std::uint32_t> entries = {};
  };
  using Defaults = std::array<Default, kCount>;

  struct Device {
    std::function<void()> refresh;  // makes the values that are sent
    std::function<void(std::uint16_t index, std::uint8_t sub)> written;
    std::function<void(std::uint32_t id, std::uint8_t size, const std::uint8_t* data)> send;
    std::function<void(bool long_enough)> received;  // the bytes that are mapped, or too few of them
  };

  Pdos(ObjectDictionary& objects, int node, Device device)
      : objects_(objects), node_(static_cast<std::uint32_t>(node)), device_(std::move(device)) {}

  void add_objects(const Defaults& received, const Defaults& sent);
  // Over SDO, of any object: a PDO that was switched begins anew.
  void configured(std::uint16_t index);

  // While the device is operational, from start() on.
  void start();
  void receive(const can_frame& frame);
  void request(std::uint32_t id, std::int64_t now_ns);  // by a remote frame
  void sync(std::uint8_t counter, std::int64_t now_ns);
  void step(std::int64_t now_ns);

 private:
  static constexpr std::uint16_t kReceived = 0x1400, kSent = 0x1800, kToMapping = 0x0200;

  struct Bytes {
    std::uint8_t size = 0;
    std::array<std::uint8_t, 8> data{};
    bool operator==(const Bytes&) const = default;
  };
  struct Received {
    can_frame frame{};
    bool waits = false;  // for the SYNC
  };
  struct Sent {
    Bytes last, sample;  // sent, and taken with the SYNC
    bool ever = false, sampled = false, counts = false;
    int syncs = 0;
    std::int64_t sent_ns = 0;
  };

  void add(std::uint16_t parameter, std::uint32_t id, const Default& how);
  [[nodiscard]] Abort check_id(std::uint16_t parameter, std::int64_t wanted) const;
  [[nodiscard]] Abort check_mapping(std::uint16_t parameter, std::int64_t entry) const;
  [[nodiscard]] Abort check_mapping_count(std::uint16_t parameter, std::int64_t count) const;
  [[nodiscard]] bool is_on(std::uint16_t parameter) const;
  [[nodiscard]] std::uint32_t id_of(std::uint16_t parameter) const;
  void take(std::uint16_t parameter, const can_frame& frame);
  [[nodiscard]] Bytes contents(std::uint16_t parameter) const;
  void send(std::size_t i, const Bytes& bytes, std::int64_t now_ns);

  ObjectDictionary& objects_;
  std::uint32_t node_;
  Device device_;
  std::array<Received, kCount> received_;
  std::array<Sent, kCount> sent_;
};

}  // namespace punctum::emulator
