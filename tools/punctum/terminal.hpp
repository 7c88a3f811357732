// What the parent says while a run goes on: lines that stay, and on a terminal one line that is drawn again.
// What cannot be written (a closed pipe, a terminal that is gone) ends no run.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "rt/station/core_status.hpp"
#include "tools/punctum/measures.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

class Terminal {
 public:
  Terminal();

  template <class... Args>
  void say(fmt::format_string<Args...> text, Args&&... args) {
    print(fmt::format(text, std::forward<Args>(args)...) + "\n");
  }
  void complain(const std::string& text);  // on the standard error output
  void print(const std::string& text);     // as it is
  void progress(const std::string& line);
  void clear_progress();
  // How often progress is worth telling.
  [[nodiscard]] double progress_every_s() const { return is_terminal_ ? 0.1 : 5; }

 private:
  bool is_terminal_;
  bool progress_drawn_ = false;
};

// Time, phase, forces, and what is not as it should be.
[[nodiscard]] std::string progress_line(const Scene& scene, const rt::TelemetrySample& newest,
                                        const rt::CoreStatus& core);

}  // namespace punctum::tools
