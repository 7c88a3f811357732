// What of this machine is not ready for real time, and what mends it. Changes nothing.
#pragma once

#include <string>
#include <vector>

namespace punctum::jitter {

struct Finding {
  std::string name, found;
  std::string remedy;  // empty: ready
  bool required = false;
};

// For a loop on this CPU (-1: any). root stands before every path that is read beyond the rights: "" for this
// machine.
[[nodiscard]] std::vector<Finding> audit(int cpu, int priority, const std::string& root = "");

[[nodiscard]] std::string audit_text(const std::vector<Finding>& findings);

}  // namespace punctum::jitter
