// What the parent says while a run goes on: lines that stay, and on a terminal one line that is drawn again.
// Colour only where a terminal shows it and NO_COLOR is not set; what cannot be written (a closed pipe, a
// terminal that is gone) ends no run, and a terminal that is halted (Ctrl-S) or hangs keeps nobody waiting
// before the end.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "rt/station/core_status.hpp"
#include "tools/punctum/measures.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

enum class Colour : std::uint8_t { plain, good, warning, bad, faint };

// The text in that colour; as it is where there is none.
[[nodiscard]] std::string painted(Colour colour, const std::string& text, bool coloured);

// Lines that are too long for a terminal, broken between words; where one goes on it is indented, under its
// text where that has a title. 0 columns: as it is.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t columns);

struct LineStyle {
  bool coloured = false;
  bool blocks = false;      // the bar from Unicode's blocks, which not every terminal has
  std::size_t columns = 0;  // what does not fit is left out, the least important first; 0: all fits
};

class Terminal {
 public:
  Terminal();
  ~Terminal();  // when all is written

  template <class... Args>
  void say(fmt::format_string<Args...> text, Args&&... args) {
    print(fmt::format(text, std::forward<Args>(args)...) + "\n");
  }
  void complain(const std::string& text);  // on the standard error output
  void print(const std::string& text);     // as it is, but for lines that a terminal would break
  void progress(const std::string& line);  // not where earlier words are still to be written
  void clear_progress();
  // How often progress is worth telling.
  [[nodiscard]] double progress_every_s() const { return is_terminal_ ? 0.1 : 5; }
  [[nodiscard]] bool coloured() const { return coloured_; }  // of what is printed
  [[nodiscard]] LineStyle line_style() const;                // of the line that is drawn again

 private:
  class Writer;
  std::unique_ptr<Writer> writer_;
  bool is_terminal_, coloured_, errors_coloured_;
  bool progress_drawn_ = false;
};

// Time, what is left of it, phase, force, depth, vision, and what is not as it should be.
[[nodiscard]] std::string progress_line(const Scene& scene, const Measures& measures,
                                        const rt::CoreStatus& core, const LineStyle& style);

}  // namespace punctum::tools
