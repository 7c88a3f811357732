// Plugs an emulated device into this machine: a port of the kernel's virtual USB host controller (vhci_hcd),
// and the dialogue with it. Needs root.
#pragma once

#include <poll.h>

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "tools/emulators/falcon/usbip.hpp"

namespace punctum::emulator {

class VhciPort {
 public:
  // A full-speed device on the first free port. The error is one line.
  [[nodiscard]] static tl::expected<VhciPort, std::string> plug_in();
  ~VhciPort();  // unplugs it
  VhciPort(VhciPort&& other) noexcept;
  VhciPort& operator=(VhciPort&&) = delete;

  // What to wait for, beside other things, before talk().
  [[nodiscard]] pollfd waits_for() const;
  // Waits until the kernel, or `wake` (a descriptor to read from; -1: none), has something, at most
  // longest_ns. False: it cannot.
  [[nodiscard]] bool wait(std::int64_t longest_ns, int wake = -1) const;
  // What the kernel has said, and what the device says to it; waits for nothing. False: the host has let go,
  // or what it says is no USB/IP.
  [[nodiscard]] bool talk(UsbIpDevice& device);

 private:
  explicit VhciPort(int socket) : socket_(socket) {}
  int socket_;
  bool more_to_say_ = false;  // than the socket took
};

[[nodiscard]] std::int64_t monotonic_ns();

}  // namespace punctum::emulator
