// How a program that nobody started finds a running station: by its name. Set-up code.
//
// The maker of the station listens on a Unix socket in the abstract namespace, "punctum.UID.NAME", and gives
// every visitor of its own user the descriptors that it offers. The name is taken as long as the socket is
// open: it is unique, and nothing of it is left in any file system when its holder dies. It holds within one
// network namespace.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/ipc/segment.hpp"

namespace punctum::hal {

struct NamedDescriptor {
  std::string name;
  Descriptor descriptor;
};

class Rendezvous {
 public:
  // Takes the name. Refused while another station has it. Names: letters, digits, '.', '_', '-'.
  [[nodiscard]] static tl::expected<Rendezvous, std::string> open(std::string_view station);

  void offer(std::string_view name, Descriptor descriptor);
  // Gives the visitors that have come what is offered; waits for nobody.
  void serve() const;

 private:
  explicit Rendezvous(Descriptor socket) noexcept : socket_(std::move(socket)) {}
  Descriptor socket_;
  std::vector<NamedDescriptor> offered_;
};

// Whether a station of this name and of this user listens: not one of another user who has taken the name.
[[nodiscard]] bool runs(std::string_view station);

// What a station offers. Waits up to two seconds for its answer.
class Joined {
 public:
  [[nodiscard]] static tl::expected<Joined, std::string> join(std::string_view station);
  // -1: it offers nothing of this name.
  [[nodiscard]] int descriptor(std::string_view name) const noexcept;

 private:
  std::vector<NamedDescriptor> got_;
};

}  // namespace punctum::hal
