// The operator's console as a child of the run: started once, its address told, asked to end with the run.
// The run does not depend on it: if it dies, that is said, and `punctum-console --station` brings it back.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "tools/punctum/terminal.hpp"
#include "tools/shared/child.hpp"

namespace punctum::tools {

inline constexpr const char* kConsoleProgram = "punctum-console";

class ConsoleProcess {
 public:
  ConsoleProcess(std::string station, std::string log, Terminal& terminal)
      : station_(std::move(station)), log_(std::move(log)), terminal_(terminal) {}

  [[nodiscard]] tl::expected<void, std::string> start();
  void watch();  // once per round of the parent
  void end();    // waits for a moment

 private:
  std::string station_, log_;
  Terminal& terminal_;
  Child child_;
  bool address_told_ = false;
};

}  // namespace punctum::tools
