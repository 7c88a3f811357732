// The object dictionary of a CANopen device (CiA 301): numbers and texts with type and access, and the abort
// code that answers a wrong access.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

namespace punctum::emulator {

// SDO abort codes of CiA 301; 0: done.
enum Abort : std::uint32_t {
  abort_none = 0,
  abort_toggle = 0x05030000,
  abort_command = 0x05040001,
  abort_access = 0x06010000,
  abort_write_only = 0x06010001,
  abort_read_only = 0x06010002,
  abort_no_object = 0x06020000,
  abort_not_mappable = 0x06040041,
  abort_pdo_length = 0x06040042,
  abort_length = 0x06070010,
  abort_no_sub_index = 0x06090011,
  abort_range = 0x06090030,
  abort_most_below_least = 0x06090036,
  abort_transfer = 0x08000020,
  abort_state = 0x08000022,
};

enum class Access : std::uint8_t { constant, read_only, write_only, read_write };

// A variable: what an index without sub-indices is, or one sub-index.
struct Entry {
  std::string name = {};
  int bytes = 4;  // 1, 2 or 4; 0: a text
  bool is_signed = false;
  Access access = Access::read_write;
  bool mappable = false;
  std::int64_t least = 0, most = 0xFFFFFFFF;
  std::int64_t value = 0;
  std::string text = {};
  bool plus_node = false;  // `value` contains the node number: another node has another one
  // Asked before a value is taken.
  std::function<Abort(std::int64_t)> check = {};
};

class ObjectDictionary {
 public:
  using Key = std::pair<std::uint16_t, std::uint8_t>;  // index and sub-index

  enum class Kind : std::uint8_t { array, record };
  struct Composed {
    std::string name;
    Kind kind;
  };

  Entry& add(std::uint16_t index, std::uint8_t sub, Entry entry);
  // An index with sub-indices, the highest of which is told by sub-index 0; the others are added.
  void compose(std::uint16_t index, Kind kind, std::string name, std::uint8_t highest);
  [[nodiscard]] const std::map<Key, Entry>& entries() const { return entries_; }
  // Null: it has no sub-indices.
  [[nodiscard]] const Composed* composed(std::uint16_t index) const;

  [[nodiscard]] const Entry* find(std::uint16_t index, std::uint8_t sub) const;
  // Why there is nothing: no object, or no such sub-index of it.
  [[nodiscard]] Abort missing(std::uint16_t index) const;

  // Over SDO or PDO: `bytes` little-endian bytes, 0 where the client did not say how many.
  [[nodiscard]] Abort write(std::uint16_t index, std::uint8_t sub, std::uint32_t raw, int bytes);

  // By the device itself.
  [[nodiscard]] std::int64_t get(std::uint16_t index, std::uint8_t sub = 0) const;
  void set(std::uint16_t index, std::uint8_t sub, std::int64_t value);

  // From here on an SDO write of this object is answered by this code; 0: as it should be.
  void refuse(std::uint16_t index, std::uint8_t sub, std::uint32_t code);
  [[nodiscard]] std::uint32_t refused(std::uint16_t index, std::uint8_t sub) const;

 private:
  std::map<Key, Entry> entries_;
  std::map<std::uint16_t, Composed> composed_;
  std::map<Key, std::uint32_t> refused_;
};

}  // namespace punctum::emulator
