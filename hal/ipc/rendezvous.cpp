#include "hal/ipc/rendezvous.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>

namespace punctum::hal {
namespace {

constexpr std::size_t kMostDescriptors = 16;
constexpr std::size_t kMostText = 1024;
constexpr int kMostVisitors = 8;  // in one round
constexpr int kAnswer_ms = 2000;

bool usable_name(std::string_view name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 80 && std::all_of(name.begin(), name.end(), plain);
}

struct Address {
  sockaddr_un of{};
  socklen_t size = 0;
};

// In the abstract namespace: the path begins with a zero byte.
Address address_of(std::string_view station) {
  const std::string text = "punctum." + std::to_string(::geteuid()) + "." + std::string(station);
  Address a;
  a.of.sun_family = AF_UNIX;
  std::memcpy(a.of.sun_path + 1, text.data(), text.size());
  a.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + text.size());
  return a;
}

bool peer_is_this_user(int fd) {
  ucred peer = {};
  socklen_t size = sizeof peer;
  return ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == ::geteuid();
}

// Control data for the most descriptors, aligned as the kernel wants it.
struct alignas(cmsghdr) Control {
  std::array<char, CMSG_SPACE(kMostDescriptors * sizeof(int))> bytes{};
};

tl::unexpected<std::string> refuse(std::string_view station, const std::string& what) {
  return tl::unexpected("station " + std::string(station) + ": " + what);
}

}  // namespace

tl::expected<Rendezvous, std::string> Rendezvous::open(std::string_view station) {
  if (!usable_name(station)) {
    return refuse(station, "its name may hold only letters, digits, '.', '_' and '-'");
  }
  Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const Address address = address_of(station);
  if (!socket || ::bind(socket.number(), reinterpret_cast<const sockaddr*>(&address.of), address.size) != 0) {
    return refuse(station, errno == EADDRINUSE ? "is already running; end it first"
                                               : std::string("cannot be opened: ") + std::strerror(errno));
  }
  if (::listen(socket.number(), kMostVisitors) != 0) {
    return refuse(station, std::string("cannot be opened: ") + std::strerror(errno));
  }
  return Rendezvous(std::move(socket));
}

void Rendezvous::offer(std::string_view name, Descriptor descriptor) {
  offered_.push_back({std::string(name), std::move(descriptor)});
}

void Rendezvous::serve() const {
  for (int i = 0; i < kMostVisitors; ++i) {
    const Descriptor visitor(::accept4(socket_.number(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!visitor) {
      return;
    }
    if (!peer_is_this_user(visitor.number())) {
      continue;
    }
    std::string names;
    std::array<int, kMostDescriptors> numbers{};
    const std::size_t count = std::min(offered_.size(), kMostDescriptors);
    for (std::size_t k = 0; k < count; ++k) {
      names += offered_[k].name + '\n';
      numbers[k] = offered_[k].descriptor.number();
    }
    Control control;
    iovec text{names.data(), names.size()};
    msghdr message = {};
    message.msg_iov = &text;
    message.msg_iovlen = 1;
    if (count > 0) {
      message.msg_control = control.bytes.data();
      message.msg_controllen = CMSG_SPACE(count * sizeof(int));
      cmsghdr* rights = CMSG_FIRSTHDR(&message);
      rights->cmsg_level = SOL_SOCKET;
      rights->cmsg_type = SCM_RIGHTS;
      rights->cmsg_len = CMSG_LEN(count * sizeof(int));
      std::memcpy(CMSG_DATA(rights), numbers.data(), count * sizeof(int));
    }
    (void)::sendmsg(visitor.number(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
  }
}

namespace {

tl::expected<Descriptor, std::string> connected(std::string_view station) {
  if (!usable_name(station)) {
    return refuse(station, "its name may hold only letters, digits, '.', '_' and '-'");
  }
  Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const Address address = address_of(station);
  if (!socket ||
      ::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address.of), address.size) != 0) {
    return refuse(station, "does not answer; is it running, by this user?");
  }
  if (!peer_is_this_user(socket.number())) {
    return refuse(station, "belongs to another user");
  }
  return socket;
}

}  // namespace

bool runs(std::string_view station) { return connected(station).has_value(); }

tl::expected<Joined, std::string> Joined::join(std::string_view station) {
  const auto socket = connected(station);
  if (!socket) {
    return tl::unexpected(socket.error());
  }
  pollfd answer{socket->number(), POLLIN, 0};
  if (::poll(&answer, 1, kAnswer_ms) <= 0) {
    return refuse(station, "does not answer in time");
  }
  std::array<char, kMostText> text{};
  Control control;
  iovec into{text.data(), text.size()};
  msghdr message = {};
  message.msg_iov = &into;
  message.msg_iovlen = 1;
  message.msg_control = control.bytes.data();
  message.msg_controllen = control.bytes.size();
  const ssize_t size = ::recvmsg(socket->number(), &message, MSG_CMSG_CLOEXEC);
  Joined joined;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) {
      continue;
    }
    const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t k = 0; k < count; ++k) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(part) + k * sizeof(int), sizeof number);
      joined.got_.push_back({"", Descriptor(number)});
    }
  }
  std::string_view rest(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  for (NamedDescriptor& one : joined.got_) {
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) {
      break;
    }
    one.name = rest.substr(0, end);
    rest.remove_prefix(end + 1);
  }
  if (joined.got_.empty()) {
    return refuse(station, "offers nothing");
  }
  return joined;
}

int Joined::descriptor(std::string_view name) const noexcept {
  for (const NamedDescriptor& one : got_) {
    if (one.name == name) {
      return one.descriptor.number();
    }
  }
  return -1;
}

}  // namespace punctum::hal
