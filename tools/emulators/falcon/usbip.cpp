#include "tools/emulators/falcon/usbip.hpp"

#include <algorithm>
#include <cerrno>
#include <optional>

namespace punctum::emulator {
namespace {

constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kRetSubmit = 3, kRetUnlink = 4;
constexpr std::uint32_t kOut = 0, kIn = 1;
constexpr std::uint32_t kNoPackets = 0xFFFFFFFF;
constexpr std::size_t kLongest = 16384;  // of one transfer
constexpr std::size_t kMostWaiting = 64;
constexpr std::uint32_t kEndpointIn = 1, kEndpointOut = 2;

// A full-speed device with one interface of the vendor's own and two bulk endpoints.
constexpr std::uint8_t kDevice[] = {
    18,   1,    0x00, 0x02, 0,    0,    0, 8,  // USB 2.0, packets of 8 on endpoint 0
    0x03, 0x04, 0x48, 0xCB, 0x00, 0x04, 1, 2, 0, 1};
constexpr std::uint8_t kConfiguration[] = {9, 2, 32,   0, 1,  1,    0,    0xC0, 0,  // self-powered
                                           9, 4, 0,    0, 2,  0xFF, 0xFF, 0xFF, 2,  // interface 0
                                           7, 5, 0x81, 2, 64, 0,    0,              // bulk in
                                           7, 5, 0x02, 2, 64, 0,    0};             // bulk out
constexpr std::uint8_t kLanguages[] = {4, 3, 0x09, 0x04};

std::vector<std::uint8_t> string_descriptor(const char* text) {
  std::vector<std::uint8_t> d = {0, 3};
  for (; *text != '\0'; ++text) {
    d.push_back(static_cast<std::uint8_t>(*text));
    d.push_back(0);
  }
  d[0] = static_cast<std::uint8_t>(d.size());
  return d;
}

std::optional<std::vector<std::uint8_t>> descriptor(unsigned type, unsigned index) {
  const auto copy = [](std::span<const std::uint8_t> d) {
    return std::vector<std::uint8_t>(d.begin(), d.end());
  };
  switch (type) {
    case 1:
      return copy(kDevice);
    case 2:
      return index == 0 ? std::optional(copy(kConfiguration)) : std::nullopt;
    case 3:
      switch (index) {
        case 0:
          return copy(kLanguages);
        case 1:
          return string_descriptor("punctum");
        case 2:
          return string_descriptor("FALCON HAPTIC (emulated)");
        default:
          return std::nullopt;
      }
    default:
      return std::nullopt;
  }
}

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(bytes[0]) << 24U | static_cast<std::uint32_t>(bytes[1]) << 16U |
         static_cast<std::uint32_t>(bytes[2]) << 8U | bytes[3];
}

}  // namespace

UsbIpDevice::Header UsbIpDevice::header_of(std::span<const std::uint8_t> bytes) {
  const auto word = [&](std::size_t i) { return big_endian(bytes.subspan(4 * i, 4)); };
  Header h{word(0), word(1), word(3), word(4), word(5), word(6), word(7), word(8), {}};
  std::copy_n(bytes.begin() + 40, h.setup.size(), h.setup.begin());
  return h;
}

bool UsbIpDevice::acceptable(const Header& h) {
  if (h.command != kSubmit && h.command != kUnlink) {
    problem_ = "a command that is neither SUBMIT nor UNLINK";
  } else if (h.command == kSubmit && h.length > kLongest) {
    problem_ = "a transfer of " + std::to_string(h.length) + " bytes";
  } else if (h.direction > kIn) {
    problem_ = "a direction that is neither in nor out";
  } else if (h.command == kSubmit && in_.size() + out_.size() >= kMostWaiting) {
    problem_ = "more transfers at a time than any host asks for";
  }
  return problem_.empty();
}

bool UsbIpDevice::take(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  input_.insert(input_.end(), bytes.begin(), bytes.end());
  std::size_t at = 0;
  while (problem_.empty() && input_.size() - at >= kHeader) {
    const auto rest = std::span<const std::uint8_t>(input_).subspan(at);
    const Header h = header_of(rest);
    if (!acceptable(h)) {
      break;
    }
    const std::size_t data = h.command == kSubmit && h.direction == kOut ? h.length : 0;
    if (rest.size() < kHeader + data) {
      break;
    }
    if (h.command == kSubmit) {
      submit(h, rest.subspan(kHeader, data), now_ns);
    } else {
      unlink(h);
    }
    at += kHeader + data;
  }
  input_.erase(input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(at));
  return problem_.empty();
}

void UsbIpDevice::submit(const Header& h, std::span<const std::uint8_t> data, std::int64_t now_ns) {
  if (h.endpoint == 0) {
    control(h, now_ns);
  } else if (h.endpoint == kEndpointIn && h.direction == kIn) {
    in_.push_back({h.sequence, h.length, {}});
  } else if (h.endpoint == kEndpointOut && h.direction == kOut) {
    out_.push_back({h.sequence, {data.begin(), data.end()}});
  } else {
    answer(h.sequence, -EPIPE, 0, {});
  }
}

void UsbIpDevice::control(const Header& h, std::int64_t now_ns) {
  const unsigned type = h.setup[0], request = h.setup[1];
  const unsigned value = h.setup[2] | h.setup[3] << 8U;
  const std::size_t most = std::min<std::size_t>(h.length, h.setup[6] | h.setup[7] << 8U);
  std::optional<std::vector<std::uint8_t>> data;
  bool done = false;
  switch (type) {
    case 0x00:
    case 0x01:
    case 0x02:  // standard, to the device or a part of it
      done = request == 9 || request == 11 || request == 1 || request == 3;
      if (request == 9) {
        configuration_ = static_cast<std::uint8_t>(value);
      }
      break;
    case 0x80:
      if (request == 6) {
        data = descriptor(value >> 8U, value & 0xFFU);
      } else if (request == 8) {
        data = std::vector<std::uint8_t>{configuration_};
      } else if (request == 0) {
        data = std::vector<std::uint8_t>{1, 0};
      }
      break;
    case 0x81:
    case 0x82:
      if (request == 0) {
        data = std::vector<std::uint8_t>{0, 0};
      } else if (request == 10) {
        data = std::vector<std::uint8_t>{0};
      }
      break;
    case 0x40:
      done = falcon_.request(static_cast<std::uint8_t>(request), static_cast<std::uint16_t>(value), now_ns);
      break;
    case 0xC0:
      data = falcon_.answer(static_cast<std::uint8_t>(request), static_cast<std::uint16_t>(value), most);
      break;
    default:
      break;
  }
  if (data && h.direction == kIn) {
    data->resize(std::min(data->size(), most));
    answer(h.sequence, 0, data->size(), *data);
  } else {
    answer(h.sequence, done ? 0 : -EPIPE, 0, {});
  }
}

// Its own number is in the header, the one that it ends in place of the flags.
void UsbIpDevice::unlink(const Header& h) {
  const auto is_it = [&h](const auto& one) { return one.sequence == h.flags; };
  const auto waiting = in_.size() + out_.size();
  std::erase_if(in_, is_it);
  std::erase_if(out_, is_it);
  const bool found = in_.size() + out_.size() < waiting;
  for (const std::uint32_t word :
       {kRetUnlink, h.sequence, 0U, 0U, 0U, static_cast<std::uint32_t>(found ? -ECONNRESET : 0), 0U, 0U, 0U,
        0U, 0U, 0U}) {
    put(word);
  }
}

void UsbIpDevice::step(std::int64_t now_ns) {
  while (!out_.empty()) {
    const Out& out = out_.front();
    std::span<const std::uint8_t> data = out.data;
    if (data.size() > FalconEmulator::kPacketSize) {  // packet by packet; none of its hosts does it
      answer(out.sequence, -EPIPE, 0, {});
    } else if (falcon_.out(data, now_ns)) {
      answer(out.sequence, 0, data.size(), {});
    } else {
      break;
    }
    out_.pop_front();
  }
  while (!in_.empty()) {
    In& in = in_.front();
    const auto packet = falcon_.in(now_ns);
    if (!packet) {
      return;
    }
    const std::size_t room = in.length - in.data.size();
    in.data.insert(in.data.end(), packet->begin(),
                   packet->begin() + static_cast<std::ptrdiff_t>(std::min(packet->size(), room)));
    const bool overflows = packet->size() > room || packet->size() > FalconEmulator::kPacketSize;
    if (overflows || packet->size() < FalconEmulator::kPacketSize || in.data.size() == in.length) {
      answer(in.sequence, overflows ? -EOVERFLOW : 0, in.data.size(), in.data);
      in_.pop_front();
    }
  }
}

std::int64_t UsbIpDevice::next_ns(std::int64_t now_ns) const {
  constexpr std::int64_t kSecond_ns = 1'000'000'000, kRetry_ns = 100'000;
  if (!out_.empty()) {
    return now_ns + kRetry_ns;
  }
  return in_.empty() ? now_ns + kSecond_ns : std::min(falcon_.next_in_ns(now_ns), now_ns + kSecond_ns);
}

void UsbIpDevice::answer(std::uint32_t sequence, int status, std::size_t length,
                         std::span<const std::uint8_t> data) {
  for (const std::uint32_t word : {kRetSubmit, sequence, 0U, 0U, 0U, static_cast<std::uint32_t>(status),
                                   static_cast<std::uint32_t>(length), 0U, kNoPackets, 0U, 0U, 0U}) {
    put(word);
  }
  output_.insert(output_.end(), data.begin(), data.end());
}

void UsbIpDevice::put(std::uint32_t value) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    output_.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

}  // namespace punctum::emulator
