#include "tools/emulators/drive/eds.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <vector>

namespace punctum::emulator {
namespace {

std::string hex(std::int64_t value, int digits = 1) {
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%0*llX", digits, static_cast<unsigned long long>(value));
  return text.data();
}

// CiA 301, static data types.
int data_type(const Entry& entry) {
  constexpr int kVisibleString = 0x09;
  const int width = entry.bytes == 4 ? 2 : entry.bytes - 1;  // of 8, 16 and 32 bits
  return entry.bytes == 0 ? kVisibleString : (entry.is_signed ? 0x02 : 0x05) + width;
}

const char* access_type(Access access) {
  switch (access) {
    case Access::constant:
      return "const";
    case Access::read_only:
      return "ro";
    case Access::write_only:
      return "wo";
    case Access::read_write:
      return "rw";
  }
  return "";
}

std::string default_value(const Entry& entry, int node) {
  if (entry.bytes == 0) {
    return entry.text;
  }
  if (entry.plus_node) {
    return "$NODEID+0x" + hex(entry.value - node);
  }
  return entry.is_signed ? std::to_string(entry.value) : "0x" + hex(entry.value);
}

std::string variable(const Entry& entry, int node) {
  return "ParameterName=" + entry.name + "\nObjectType=0x7\nDataType=0x" + hex(data_type(entry), 4) +
         "\nAccessType=" + access_type(entry.access) + "\nDefaultValue=" + default_value(entry, node) +
         "\nPDOMapping=" + (entry.mappable ? "1" : "0") + "\n";
}

std::string list(const char* title, const std::vector<std::uint16_t>& indices) {
  std::string text =
      std::string("[") + title + "]\nSupportedObjects=" + std::to_string(indices.size()) + "\n";
  for (std::size_t i = 0; i < indices.size(); ++i) {
    text += std::to_string(i + 1) + "=0x" + hex(indices[i], 4) + "\n";
  }
  return text + "\n";
}

}  // namespace

std::string eds(const ObjectDictionary& objects, const EdsDevice& device) {
  std::vector<std::uint16_t> mandatory, optional, manufacturer;
  for (const auto& [key, entry] : objects.entries()) {
    const std::uint16_t index = key.first;
    auto& those = index == 0x1000 || index == 0x1001 || index == 0x1018 ? mandatory
                  : index >= 0x2000 && index < 0x6000                   ? manufacturer
                                                                        : optional;
    if (those.empty() || those.back() != index) {
      those.push_back(index);
    }
  }
  const auto count = [&](std::uint16_t from) {
    return std::count_if(optional.begin(), optional.end(),
                         [from](std::uint16_t index) { return index >= from && index < from + 0x200; });
  };
  std::string text =
      "[FileInfo]\nFileName=punctum-drive.eds\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\n"
      "Description=An emulated CiA 402 drive\nCreationTime=12:00PM\nCreationDate=11-22-2026\n"
      "CreatedBy=punctum-drive\nModificationTime=12:00PM\nModificationDate=11-22-2026\n"
      "ModifiedBy=punctum-drive\n\n";
  text += "[DeviceInfo]\nVendorName=punctum\nVendorNumber=0x" + hex(device.vendor_id) +
          "\nProductName=" + device.product + "\nProductNumber=0x" + hex(device.product_code) +
          "\nRevisionNumber=0x1\nOrderCode=none\n";
  for (const int kbit_s : {10, 20, 50, 125, 250, 500, 800, 1000}) {
    text += "BaudRate_" + std::to_string(kbit_s) + "=1\n";
  }
  text +=
      "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=8\nDynamicChannelsSupported=0\n"
      "CompactPDO=0\nGroupMessaging=0\nNrOfRXPDO=" +
      std::to_string(count(0x1400)) + "\nNrOfTXPDO=" + std::to_string(count(0x1800)) +
      "\nLSS_Supported=0\n\n";
  text += "[DummyUsage]\n";
  for (int type = 1; type <= 7; ++type) {
    text += "Dummy" + hex(type, 4) + "=0\n";
  }
  text += "\n[Comments]\nLines=0\n\n";
  text += list("MandatoryObjects", mandatory) + list("OptionalObjects", optional) +
          list("ManufacturerObjects", manufacturer);
  for (const auto& [key, entry] : objects.entries()) {
    const std::string index = hex(key.first, 4);
    const ObjectDictionary::Composed* composed = objects.composed(key.first);
    if (composed == nullptr) {
      text += "[" + index + "]\n" + variable(entry, device.node) + "\n";
      continue;
    }
    if (key.second == 0) {
      const auto subs =
          std::count_if(objects.entries().begin(), objects.entries().end(),
                        [first = key.first](const auto& one) { return one.first.first == first; });
      const bool array = composed->kind == ObjectDictionary::Kind::array;
      text += "[" + index + "]\nParameterName=" + composed->name + "\nObjectType=0x" + (array ? "8" : "9") +
              "\nSubNumber=" + std::to_string(subs) + "\n\n";
    }
    text += "[" + index + "sub" + hex(key.second) + "]\n" + variable(entry, device.node) + "\n";
  }
  return text;
}

}  // namespace punctum::emulator
