// The parts of a topic of punctum-report: measured tables, figures, and one sentence that reads them.
// A topic is one function, Result run_NAME(const Job&), listed in topics.cpp. It throws std::exception when
// it fails. Nothing here runs in the control core.
#pragma once

#include <atomic>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "tools/shared/figure.hpp"

namespace punctum::report {

// ---- tables ----

// A number is written with 17 significant digits; NaN is an empty cell; bool is 0 or 1.
class Cell {
 public:
  template <std::integral T>
  Cell(T v) : value_(static_cast<std::int64_t>(v)) {}
  template <std::floating_point T>
  Cell(T v) : value_(static_cast<double>(v)) {}
  Cell(std::string v) : value_(std::move(v)) {}
  Cell(std::string_view v) : value_(std::string(v)) {}
  Cell(const char* v) : value_(std::string(v)) {}
  [[nodiscard]] const std::variant<std::string, double, std::int64_t>& value() const noexcept {
    return value_;
  }
  [[nodiscard]] std::string text(int digits = 17) const;

 private:
  std::variant<std::string, double, std::int64_t> value_;
};
using Row = std::vector<Cell>;

// Becomes NAME.csv. Its last columns say on which machine, and by which program, it was measured.
struct Table {
  std::string name{};
  std::vector<std::string> columns{};  // unit in the name: t_s, force_N
  std::vector<Row> rows{};
  // What index.html shows. Empty: all columns; all rows, or the first of many.
  std::vector<std::string> shown{};
  std::vector<std::size_t> shown_rows{};
  void add(Row row);  // throws std::logic_error for a row that does not fit the columns
};

// ---- figures ----

using tools::Bars;
using tools::Figure;
using tools::Map;
using tools::Mark;
using tools::Panel;
using tools::Series;
using tools::Style;

// ---- run time ----

// Per call, without the time of the empty harness. Calls are repeated in batches that are long enough for the
// clock, and a batch gives one value, its mean. So median, p99.9 and max are over the means of batches; where
// batch is 1, over single calls. With fewer than 1000 batches p99.9 is the largest value. The caches are
// warm, and successive calls may overlap in the processor.
struct CallTime {
  double median_ns = 0, p99_9_ns = 0, max_ns = 0;
  double overhead_ns = 0;  // per call, of the empty harness; already subtracted
  std::int64_t batch = 1;  // calls in one batch
  std::int64_t batches = 0;
};

// Makes the compiler compute `value`.
template <class T>
void keep(const T& value) noexcept {
  asm volatile("" : : "m"(value) : "memory");
}

// A call to be timed: f() or f(i), where i counts the calls from 0 on (to step through prepared inputs). Its
// result is kept. It should read its inputs from memory, for example from captured containers: the compiler
// computes what it knows only once.
class Timed {
 public:
  template <class F>
    requires(!std::same_as<std::remove_cvref_t<F>, Timed>)
  Timed(F f)
      : batch_([f = std::move(f)](std::size_t from, std::int64_t n) mutable {
          for (std::int64_t k = 0; k < n; ++k) {
            once(f, from + static_cast<std::size_t>(k));
          }
        }) {}
  void run(std::size_t from, std::int64_t n) const { batch_(from, n); }

 private:
  template <class F>
  static void once(F& f, std::size_t i) {
    if constexpr (std::invocable<F&, std::size_t>) {
      if constexpr (std::is_void_v<std::invoke_result_t<F&, std::size_t>>) {
        f(i);
        keep(i);
      } else {
        keep(f(i));
      }
    } else if constexpr (std::is_void_v<std::invoke_result_t<F&>>) {
      f();
      keep(i);
    } else {
      keep(f());
    }
  }
  std::function<void(std::size_t, std::int64_t)> batch_;
};

struct TimingPlan {
  std::int64_t batches = 1000;  // of each method
  double batch_us = 20;         // a batch lasts about this long
  double seconds = 3;           // for all methods; then it ends before `batches` are done, but not before 11
};

// The methods run in turns and in changing order, each followed by the empty harness with the same batch, so
// that a disturbance of the machine hits all alike.
[[nodiscard]] std::vector<CallTime> time_interleaved(std::span<const Timed> methods,
                                                     const TimingPlan& plan = {});
[[nodiscard]] CallTime time_calls(const Timed& f, const TimingPlan& plan = {});

// Columns median_ns,p99_9_ns,max_ns,overhead_ns,batch,batches, and their cells.
[[nodiscard]] std::vector<std::string> time_columns();
[[nodiscard]] Row time_cells(const CallTime& t);

// ---- error against run time ----

struct Work {
  std::string method{};  // one line in the figure
  std::string knob{};    // the value that changes along that line: "h = 1 ms", "order 3"
  double error = 0;      // >= 0
  CallTime time{};
  bool shipped = false;  // the default of the program; at most one
};

struct Limit {
  std::string name{};
  double error = 0;
};

// Log-log: error over median time per call, one line per method in the order given, the Pareto front under
// them, the shipped default marked, limits dashed. An error of 0 is drawn at the lower edge.
[[nodiscard]] Panel work_precision(const std::string& title, const std::string& error_label,
                                   std::span<const Work> works, std::span<const Limit> limits = {});

// Columns method,knob,ERROR_COLUMN,times...,on_front,shipped.
[[nodiscard]] Table work_table(const std::string& name, const std::string& error_column,
                               std::span<const Work> works);

// Those that no other exceeds in both speed and accuracy, from the fastest to the most exact.
[[nodiscard]] std::vector<Work> pareto_front(std::span<const Work> works);

// One that is as exact as `than` and faster by more than the noise of timing (a share of its time); of
// several the fastest. nullptr: there is none, so `than` is on the front.
inline constexpr double kTimingNoise = 0.15;
[[nodiscard]] const Work* better_than(const Work& than, std::span<const Work> works,
                                      double noise = kTimingNoise);
// Of the shipped default; false when none is marked.
[[nodiscard]] bool on_front(std::span<const Work> works, double noise = kTimingNoise);

// "membrane (order 3) errs by 2.1e-16 in 8.4 ns and is on the front" or "... ; X (knob) is as exact in 3 ns".
[[nodiscard]] std::string front_sentence(std::span<const Work> works);

// ---- a topic ----

// A bar on a terminal, otherwise a line every 15 s; both on stderr. step() may be called from several
// threads.
class Progress {
 public:
  explicit Progress(std::string topic);
  ~Progress();  // ends the bar
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void start(const std::string& what, std::int64_t steps);  // a new part of the work
  void step(std::int64_t n = 1);

 private:
  struct Shared;
  std::unique_ptr<Shared> shared_;
};

struct Job {
  bool quick = false;  // fewer cells and points, the same columns
  std::filesystem::path out;
  std::filesystem::path frames;  // drawn beforehand by another renderer; empty: none were
  Progress& progress;
};

// The first table is named after the topic, and so is the first figure.
struct Result {
  std::vector<Table> tables{};
  std::vector<Figure> figures{};
  std::string reading{};  // one sentence, computed from the numbers
};

struct Topic {
  std::string_view name;
  std::string_view about;  // what is compared; for --help and index.html
  Result (*run)(const Job&);
  // --input FILE --output FILE: evaluates the rows of a file. Exit code 0; or 2 with one line on stderr.
  int (*evaluate)(const std::string& input, const std::string& output) = nullptr;
};
[[nodiscard]] std::span<const Topic> topics();

}  // namespace punctum::report
