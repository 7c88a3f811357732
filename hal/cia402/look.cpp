#include "hal/cia402/look.hpp"

#include <linux/can/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace punctum::cia402 {
namespace {

using Bytes = std::span<const std::byte>;

template <class T>
bool take(Bytes from, T& out) {
  if (from.size() < sizeof(T)) {
    return false;
  }
  std::memcpy(&out, from.data(), sizeof(T));
  return true;
}

std::string text(Bytes from) {
  const auto* begin = reinterpret_cast<const char*>(from.data());
  return {begin, strnlen(begin, from.size())};
}

// Each attribute of a list: its kind and what it holds.
template <class See>
void each_attribute(Bytes list, const See& see) {
  rtattr head{};
  while (take(list, head) && head.rta_len >= sizeof(head) && head.rta_len <= list.size()) {
    see(head.rta_type & NLA_TYPE_MASK, list.subspan(sizeof(head), head.rta_len - sizeof(head)));
    list = list.subspan(std::min<std::size_t>(RTA_ALIGN(head.rta_len), list.size()));
  }
}

void read_controller(Bytes list, CanLink& link) {
  each_attribute(list, [&link](int kind, Bytes value) {
    if (can_bittiming timing{}; kind == IFLA_CAN_BITTIMING && take(value, timing)) {
      link.bitrate = timing.bitrate;
    }
    if (std::uint32_t state = 0; kind == IFLA_CAN_STATE && take(value, state)) {
      link.bus_off = state == CAN_STATE_BUS_OFF;
    }
    if (kind == IFLA_CAN_RESTART_MS) {
      (void)take(value, link.restart_ms);
    }
  });
}

}  // namespace

std::optional<CanLink> can_link_of(Bytes message) {
  nlmsghdr head{};
  ifinfomsg info{};
  if (!take(message, head) || head.nlmsg_type != RTM_NEWLINK || head.nlmsg_len > message.size() ||
      head.nlmsg_len < NLMSG_LENGTH(sizeof(info)) || !take(message.subspan(NLMSG_HDRLEN), info)) {
    return std::nullopt;
  }
  CanLink link;
  link.can = info.ifi_type == ARPHRD_CAN;
  link.up = (info.ifi_flags & IFF_UP) != 0;
  Bytes controller;
  each_attribute(message.first(head.nlmsg_len).subspan(NLMSG_SPACE(sizeof(info))),
                 [&](int kind, Bytes value) {
                   if (kind == IFLA_IFNAME) {
                     link.name = text(value);
                   } else if (kind == IFLA_TXQLEN) {
                     (void)take(value, link.queue);
                   } else if (kind == IFLA_LINKINFO) {
                     each_attribute(value, [&](int part, Bytes inner) {
                       if (part == IFLA_INFO_KIND) {
                         link.kind = text(inner);
                       } else if (part == IFLA_INFO_DATA) {
                         controller = inner;
                       }
                     });
                   }
                 });
  // The data of another kind of interface has other attributes.
  if (link.can && link.kind == "can") {
    read_controller(controller, link);
  }
  return link;
}

std::optional<CanLink> can_link(const std::string& interface) {
  const unsigned index = interface.size() < IF_NAMESIZE ? if_nametoindex(interface.c_str()) : 0;
  const int socket = index == 0 ? -1 : ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (socket < 0) {
    return std::nullopt;
  }
  struct {
    nlmsghdr head;
    ifinfomsg info;
  } request{};
  request.head.nlmsg_len = NLMSG_LENGTH(sizeof(request.info));
  request.head.nlmsg_type = RTM_GETLINK;
  request.head.nlmsg_flags = NLM_F_REQUEST;
  request.info.ifi_index = static_cast<int>(index);
  alignas(nlmsghdr) std::array<std::byte, 16384> answer{};
  ssize_t size = -1;
  if (::send(socket, &request, request.head.nlmsg_len, 0) >= 0) {
    size = ::recv(socket, answer.data(), answer.size(), 0);
  }
  ::close(socket);
  return size < 0 ? std::nullopt : can_link_of(Bytes(answer).first(static_cast<std::size_t>(size)));
}

std::string bring_up(const std::string& interface, double bitrate_kbit) {
  return "ip link set " + interface + " txqueuelen 128 up type can bitrate " +
         std::to_string(std::lround(bitrate_kbit * 1000)) + " restart-ms 0";
}

hal::Findings look(const CanStageParams& params, const std::optional<CanLink>& link) {
  using Is = hal::Finding::Is;
  const std::string& name = params.interface;
  const auto missing = [&name](const std::string& what) {
    return hal::Finding{Is::missing, name + ": " + what};
  };
  if (!link) {
    return {
        missing("there is no such CAN interface, allowed for cia402.interface: one that `ip link` shows")};
  }
  if (!link->can) {
    return {missing("is no CAN interface, allowed for cia402.interface: one that `punctum devices` shows")};
  }
  if (!link->up) {
    return {missing("the interface is down: " + bring_up(name, params.bitrate_kbit))};
  }
  hal::Findings findings{{Is::found, ""}};
  const auto wanted = static_cast<std::uint32_t>(std::lround(params.bitrate_kbit * 1000));
  if (link->bitrate != 0 && link->bitrate != wanted) {
    findings.push_back(missing("runs at " + std::to_string(link->bitrate) +
                               " bit/s, and cia402.bitrate_kbit is " + std::to_string(wanted / 1000) +
                               ": ip link set " + name + " down, then " +
                               bring_up(name, params.bitrate_kbit)));
  }
  if (link->queue != 0 && link->queue < kShortestQueue) {
    findings.push_back(missing("its queue of " + std::to_string(link->queue) +
                               " frames is too short: ip link set " + name + " txqueuelen 128"));
  }
  if (link->bus_off) {
    findings.push_back(
        missing("is off the bus after errors on the wire: look at cable and termination, then ip "
                "link set " +
                name + " down, and " + bring_up(name, params.bitrate_kbit)));
  }
  if (link->restart_ms != 0) {
    findings.push_back({Is::note, name + ": comes back by itself after bus-off (restart-ms " +
                                      std::to_string(link->restart_ms) + "), before a person has looked"});
  }
  std::string& found = findings.front().line;
  found.append(name).append(link->kind == "can" ? " (up" : " (" + link->kind + ", up");
  if (link->bitrate != 0) {
    found.append(", ").append(std::to_string(link->bitrate)).append(" bit/s");
  }
  found.append(", queue of ")
      .append(std::to_string(link->queue))
      .append(" frames); asked when it is opened: nodes");
  for (int i = 0; i < params.axis_count; ++i) {
    found.append(" ").append(std::to_string(params.axes[static_cast<std::size_t>(i)].node));
  }
  if (params.force_node != 0) {
    found.append(" ").append(std::to_string(params.force_node));
  }
  return findings;
}

}  // namespace punctum::cia402
