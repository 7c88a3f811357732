// Many recorded runs side by side: a table and a figure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::tools {

// What one recording says of its run.
struct RunFacts {
  // Of a cell whose membrane was punctured: the last tick before.
  struct Puncture {
    double t_s = 0;
    std::optional<double> pressed_s{};  // since the needle touched; nothing: that is not recorded
    double depth_m = 0, needle_force_N = 0;
  };
  std::string recording, scene;
  std::optional<std::uint64_t> seed;
  double seconds = 0;
  std::uint64_t cells = 0;                  // that were begun
  std::uint64_t injected = 0;               // in which the injector was opened
  std::optional<std::uint64_t> lost_cells;  // as the simulated world knows; nothing: it is not told
  std::vector<Puncture> punctures;
  double hand_force_N = 0;       // the largest
  std::string first_fault, end;  // empty: none; the run's end is not recorded
  std::uint64_t missed_ticks = 0, lost_messages = 0;
  std::optional<double> wake_p999_us, wake_max_us;  // nothing: not told
  std::string ends;                                 // why the recording is not the whole run; empty: it is
};

// The error is one line: no recording, or no tick in it.
[[nodiscard]] tl::expected<RunFacts, std::string> facts_of(const std::string& recording);

// A line for each, under a line of names.
[[nodiscard]] std::string overview_table(const std::vector<RunFacts>& runs);

// runs.csv and punctures.csv, in a folder that may be there and holds neither them nor runs.svg. The error is
// one line.
[[nodiscard]] tl::expected<void, std::string> write_overview(const std::vector<RunFacts>& runs,
                                                             const std::string& folder);
// runs.svg, beside them. The error is one line: gnuplot is not installed, for example.
[[nodiscard]] tl::expected<void, std::string> draw_overview(const std::vector<RunFacts>& runs,
                                                            const std::string& folder);

}  // namespace punctum::tools
