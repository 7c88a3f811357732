// A drawing of a run over its time: panels of curves on one time axis, the phases as bands behind them,
// alarms as bars in lanes below, and single events as marks. One <svg> element that needs nothing beside
// itself; also the histogram that stands beside it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace punctum::tools {

// A curve thinned to what can be seen: of each column of the drawing the least and the greatest value, so
// that no peak is lost however long the run is. Values that are not finite leave a gap.
class Curve {
 public:
  static constexpr std::size_t kColumns = 1100;

  Curve() = default;
  Curve(std::string name, double begin_s, double end_s);
  void add(double t_s, double value);

  std::string name;
  struct Point {
    double t_s = 0, value = 0;
  };
  [[nodiscard]] std::vector<std::vector<Point>> strokes() const;  // one per piece without a gap
  [[nodiscard]] bool empty() const { return columns_.empty(); }

 private:
  struct Column {
    std::size_t index = 0;
    Point low, high;
    bool gap_before = false;
  };
  double begin_s_ = 0, per_s_ = 0;
  bool gap_ = false;
  std::vector<Column> columns_;
};

struct ChartPanel {
  std::string y_label;
  std::vector<Curve> curves;
};

struct PhaseBand {
  double from_s = 0, to_s = 0;
  std::string label;
  int colour = 0;
};

struct Lane {
  std::string name;
  struct Span {
    double from_s = 0, to_s = 0;
  };
  std::vector<Span> spans;
};

struct Instant {
  double t_s = 0;
  std::string label;
  bool bad = false;  // a fault
};

struct TimeChart {
  std::string title;  // read aloud; not drawn
  double begin_s = 0, end_s = 0;
  std::string time_label = "time [s]";
  std::vector<PhaseBand> bands;
  std::vector<ChartPanel> panels;
  std::vector<Instant> instants;
  std::vector<Lane> lanes;
};

[[nodiscard]] std::string svg(const TimeChart& chart);

struct TimesHistogram {
  std::string title;
  std::vector<double> from_us;  // lower edges of bins of 1 us that are not empty
  std::vector<double> count;
  double over = 0;  // beyond the last bin
  double p50_us = 0, p99_9_us = 0, max_us = 0;
};

[[nodiscard]] std::string svg(const TimesHistogram& histogram);

}  // namespace punctum::tools
