// What of this machine is not ready for real time, and what mends it. Changes nothing.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/platform/real_time_rights.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::jitter {

// What mends a finding for good, after a restart too; each may be empty.
struct Mend {
  std::string boot;          // words of the kernel's boot line
  std::string command;       // of a shell, at every boot
  std::string udev, limits;  // a line of the rules; of limits.d
};

struct Finding {
  std::string name, found;
  std::string remedy = {};  // empty: ready
  bool required = false;
  Mend mend = {};
};

// How long a network interface keeps what has come before it interrupts.
struct Coalescing {
  unsigned rx_us = 0;
  bool adaptive = false;
};

// What is looked at; as it is, this machine.
struct Machine {
  std::string root = {};  // stands before every path but those of the rights, which are always this machine's
  // Of an interface; none: it cannot be asked, or its driver keeps nothing.
  std::function<std::optional<Coalescing>(const std::string& interface)> coalescing = {};
};

// For a loop of this priority on this CPU (-1: any), and for the devices of `scene`, if there is one.
[[nodiscard]] std::vector<Finding> audit(int cpu, int priority, const tools::Scene* scene = nullptr,
                                         const Machine& machine = {});
// One of them, of a right; others: the CPUs that are not the loop's, as the kernel lists them.
[[nodiscard]] Finding finding_of(const rt::RightFound& right, int cpu, const std::string& others,
                                 const std::string& root = {});

[[nodiscard]] std::string audit_text(const std::vector<Finding>& findings);

// The files that mend what was found, by their paths below the root of the machine, and a README beside them.
// They keep what an earlier plan has put there.
[[nodiscard]] std::map<std::string, std::string> plan(const std::vector<Finding>& findings,
                                                      const std::string& root = {});
// Writes them below `folder`, which must be new or empty.
[[nodiscard]] tl::expected<void, std::string> write_plan(const std::map<std::string, std::string>& files,
                                                         const std::string& folder);

}  // namespace punctum::jitter
