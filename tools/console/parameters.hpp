// What may be changed while the station runs: the commands that the core takes from a console, each with its
// unit and its range in this scene.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/control/config.hpp"
#include "rt/station/command.hpp"
#include "rt/station/event.hpp"

namespace punctum::console {

struct Parameter {
  std::string name, unit;  // as it is told and asked for; "1": none
  double unit_SI = 1;      // all below are SI values
  double least = 0, most = 1;
  bool above_least = false;  // it must be more than `least`
  double value = 1;          // as the core last took it; at first the scene's
  double before = 1;         // what undo returns to
  std::string who = "scene";
  double changed_s = 0;  // in the run
  rt::Command::Kind kind = rt::Command::none;
  std::uint64_t target = 0;
};

class Parameters {
 public:
  Parameters() = default;
  explicit Parameters(const rt::ServoConfig& config);

  // `value` in the parameter's own unit. Refused with one line that says what is allowed.
  [[nodiscard]] tl::expected<rt::Command, std::string> command(std::string_view name, double value) const;
  // Back to what it was before its last change.
  [[nodiscard]] tl::expected<rt::Command, std::string> undo(std::string_view name) const;
  // What a command asks for, in the parameter's own unit.
  [[nodiscard]] std::string in_words(std::string_view name, const rt::Command& command) const;
  // True if this event of the core changes one. `who`: whoever asked for it.
  [[nodiscard]] bool took(const rt::Event& event, const std::string& who);

  [[nodiscard]] const std::vector<Parameter>& all() const { return all_; }
  [[nodiscard]] std::string json() const;

 private:
  [[nodiscard]] const Parameter* find(std::string_view name) const;
  std::vector<Parameter> all_;
};

}  // namespace punctum::console
