#include "tools/emulators/drive/object_dictionary.hpp"

namespace punctum::emulator {

Entry& ObjectDictionary::add(std::uint16_t index, std::uint8_t sub, Entry entry) {
  return entries_[{index, sub}] = std::move(entry);
}

const Entry* ObjectDictionary::find(std::uint16_t index, std::uint8_t sub) const {
  const auto it = entries_.find({index, sub});
  return it == entries_.end() ? nullptr : &it->second;
}

void ObjectDictionary::compose(std::uint16_t index, Kind kind, std::string name, std::uint8_t highest) {
  composed_[index] = {std::move(name), kind};
  add(index, 0,
      {.name = "Highest sub-index supported", .bytes = 1, .access = Access::constant, .value = highest});
}

const ObjectDictionary::Composed* ObjectDictionary::composed(std::uint16_t index) const {
  const auto it = composed_.find(index);
  return it == composed_.end() ? nullptr : &it->second;
}

Abort ObjectDictionary::missing(std::uint16_t index) const {
  const auto it = entries_.lower_bound({index, 0});
  return it != entries_.end() && it->first.first == index ? abort_no_sub_index : abort_no_object;
}

Abort ObjectDictionary::write(std::uint16_t index, std::uint8_t sub, std::uint32_t raw, int bytes) {
  const auto it = entries_.find({index, sub});
  if (it == entries_.end()) {
    return missing(index);
  }
  Entry& entry = it->second;
  if (entry.access == Access::constant || entry.access == Access::read_only) {
    return abort_read_only;
  }
  if (bytes != 0 && bytes != entry.bytes) {
    return abort_length;
  }
  const unsigned unused = 32U - 8U * static_cast<unsigned>(entry.bytes);
  const std::uint32_t kept = raw << unused >> unused;
  const std::int64_t value =
      entry.is_signed ? static_cast<std::int64_t>(static_cast<std::int32_t>(raw << unused) >> unused)
                      : static_cast<std::int64_t>(kept);
  if (value < entry.least || value > entry.most) {
    return abort_range;
  }
  if (entry.check) {
    if (const Abort why = entry.check(value); why != abort_none) {
      return why;
    }
  }
  entry.value = value;
  return abort_none;
}

std::int64_t ObjectDictionary::get(std::uint16_t index, std::uint8_t sub) const {
  const Entry* entry = find(index, sub);
  return entry != nullptr ? entry->value : 0;
}

void ObjectDictionary::set(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
  if (const auto it = entries_.find({index, sub}); it != entries_.end()) {
    it->second.value = value;
  }
}

void ObjectDictionary::refuse(std::uint16_t index, std::uint8_t sub, std::uint32_t code) {
  refused_[{index, sub}] = code;
}

std::uint32_t ObjectDictionary::refused(std::uint16_t index, std::uint8_t sub) const {
  const auto it = refused_.find({index, sub});
  return it == refused_.end() ? 0 : it->second;
}

}  // namespace punctum::emulator
