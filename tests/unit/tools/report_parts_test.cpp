// The parts that all topics of punctum-report share: tables, the Pareto front, timing, figures and the page.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "tools/report/output.hpp"
#include "tools/report/watched_programs.hpp"
#include "tools/shared/child.hpp"

namespace punctum::report {
namespace {

namespace fs = std::filesystem;

const Provenance kHere{.machine = "a machine", .compiler = "g++", .flags = "-O3", .commit = "abc"};

std::string read_all(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Work at(const std::string& method, double ns, double error, bool shipped = false) {
  Work w{.method = method, .knob = "h", .error = error};
  w.time.median_ns = ns;
  w.shipped = shipped;
  return w;
}

// ---- tables ----

TEST(ReportTable, quotes_cells_with_commas) {
  Table t{.name = "t", .columns = {"name", "value_N", "count"}};
  t.add({"plain", 0.1, 3});
  t.add({"with, comma", 1.0, std::size_t{4}});
  t.add({"with \"quotes\"", -2.5, true});
  t.add({"two\nlines", 0, false});
  EXPECT_EQ(csv(t, kHere),
            "name,value_N,count,machine,compiler,flags,commit\n"
            "plain,0.10000000000000001,3,a machine,g++,-O3,abc\n"
            "\"with, comma\",1,4,a machine,g++,-O3,abc\n"
            "\"with \"\"quotes\"\"\",-2.5,1,a machine,g++,-O3,abc\n"
            "\"two\nlines\",0,0,a machine,g++,-O3,abc\n");
}

TEST(ReportTable, writes_every_double_so_that_it_is_read_back_unchanged) {
  for (const double v : {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, -0.0, 2.2250738585072014e-308}) {
    const double back = std::strtod(Cell(v).text().c_str(), nullptr);
    EXPECT_EQ(back, v);
    EXPECT_EQ(std::signbit(back), std::signbit(v));
  }
  EXPECT_EQ(Cell(std::nan("")).text(), "");
  EXPECT_EQ(Cell(std::numeric_limits<std::int64_t>::min()).text(), "-9223372036854775808");
}

TEST(ReportTable, refuses_a_row_of_another_length) {
  Table t{.name = "t", .columns = {"a", "b"}};
  EXPECT_THROW(t.add({1}), std::logic_error);
  EXPECT_THROW(t.add({1, 2, 3}), std::logic_error);
  EXPECT_TRUE(t.rows.empty());
}

TEST(ReportTable, says_on_which_machine_it_was_measured) {
  const Provenance p = provenance();
  for (const std::string& s : {p.machine, p.compiler, p.flags, p.commit}) {
    EXPECT_FALSE(s.empty());
    EXPECT_FALSE(contains(s, ",")) << s;
  }
  EXPECT_TRUE(contains(p.machine, "Linux")) << p.machine;
  EXPECT_TRUE(std::regex_match(p.commit, std::regex("unknown|[0-9a-f]{12,40}(\\+changes)?"))) << p.commit;
}

// ---- error against run time ----

TEST(ReportFront, keeps_what_nothing_exceeds_in_speed_and_accuracy) {
  const std::vector<Work> works = {at("slow and bad", 40, 4),     at("exact", 30, 1),   at("fast", 10, 9),
                                   at("as fast, worse", 10, 10),  at("between", 20, 3), at("lost", 21, 3.5),
                                   at("nothing", 5, std::nan(""))};
  std::vector<std::string> names;
  for (const Work& w : pareto_front(works)) {
    names.push_back(w.method);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"fast", "between", "exact"}));
}

TEST(ReportFront, allows_the_shipped_method_to_be_slower_by_the_noise_of_timing) {
  std::vector<Work> works = {at("shipped", 100, 1e-3, true), at("other", 96, 1e-3)};
  EXPECT_TRUE(on_front(works, 0.1));
  EXPECT_FALSE(on_front(works, 0.01));
  ASSERT_NE(better_than(works[0], works, 0.01), nullptr);
  EXPECT_EQ(better_than(works[0], works, 0.01)->method, "other");
  works[1] = at("other", 50, 1.1e-3);  // faster, less exact
  EXPECT_TRUE(on_front(works));
  works[1] = at("other", 50, 0.5e-3);
  EXPECT_FALSE(on_front(works));
  EXPECT_TRUE(contains(front_sentence(works), "is not on the front: other (h)")) << front_sentence(works);
  works[0].shipped = false;
  EXPECT_FALSE(on_front(works));
}

TEST(ReportFront, panel_shows_a_line_per_method_the_shipped_point_and_the_limits) {
  const std::vector<Work> works = {at("a", 10, 1e-2), at("b", 100, 1e-5, true), at("a", 20, 1e-3),
                                   at("c", 50, 0)};
  const std::array<Limit, 1> limits{{{"noise", 1e-7}}};
  const Panel p = work_precision("t", "error", works, limits);
  EXPECT_TRUE(p.log_x && p.log_y);
  ASSERT_EQ(p.series.size(), 5U);
  EXPECT_EQ(p.series[0].style, Style::front);
  EXPECT_EQ(p.series[1].name, "a");
  EXPECT_EQ(p.series[1].x, (std::vector<double>{10, 20}));
  EXPECT_EQ(p.series[1].y, (std::vector<double>{1e-2, 1e-3}));
  EXPECT_EQ(p.series[4].style, Style::limit);
  EXPECT_EQ(p.series[4].y, (std::vector<double>{1e-7, 1e-7}));
  ASSERT_EQ(p.marks.size(), 1U);
  EXPECT_EQ(p.marks[0].x, 100);
  EXPECT_EQ(p.marks[0].y, 1e-5);
  EXPECT_GT(p.series[3].y[0], 0);  // exact: below all others, still on a logarithmic axis
  EXPECT_LT(p.series[3].y[0], 1e-7);
  EXPECT_TRUE(contains(p.y_label, "lower edge"));
}

// ---- timing ----

// A chain of `links` operations, each of which has to wait for the one before.
struct Chain {
  std::vector<double> input;
  int links;
  double operator()(std::size_t i) const {
    double v = input[i % input.size()];
    for (int k = 0; k < links; ++k) {
      v = v * 0.999 + 0.1;
    }
    return v;
  }
};

TEST(ReportTiming, measures_twice_the_time_for_twice_the_work_and_none_for_nothing) {
  std::vector<double> input(256);
  std::iota(input.begin(), input.end(), 1.0);
  const std::array<Timed, 3> calls{Timed(Chain{input, 300}), Timed(Chain{input, 600}),
                                   Timed([](std::size_t i) { return i; })};
  bool told = false;
  // Others may hold the processor during one measurement; whoever measures wrongly does so in each.
  for (int attempt = 0; attempt < 5 && !told; ++attempt) {
    const auto t = time_interleaved(calls, {.batches = 300, .batch_us = 20, .seconds = 5});
    ASSERT_EQ(t.size(), 3U);
    EXPECT_GT(t[2].overhead_ns, 0);
    for (const CallTime& c : t) {
      EXPECT_LE(c.median_ns, c.p99_9_ns);
      EXPECT_LE(c.p99_9_ns, c.max_ns);
      EXPECT_GE(c.batches, 11);
    }
    // Of an empty call g++ 14 leaves as much as the overhead itself, g++ 12 nothing.
    told = std::abs(t[1].median_ns / t[0].median_ns - 2) < 0.4 && t[2].median_ns < 2 * t[2].overhead_ns &&
           t[2].batch > t[1].batch;
  }
  EXPECT_TRUE(told);
}

TEST(ReportTiming, times_a_long_call_by_itself_and_keeps_to_its_budget) {
  std::int64_t calls = 0;
  const CallTime t = time_calls(
      [&calls] {
        ++calls;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      },
      {.batches = 100'000, .seconds = 0.05});
  EXPECT_EQ(t.batch, 1);
  EXPECT_EQ(t.batches, calls - 2);  // two to choose the batch
  EXPECT_GE(t.batches, 11);
  EXPECT_LE(t.batches, 50);
  EXPECT_GE(t.median_ns, 0.99e6);
}

TEST(ReportTiming, numbers_the_calls_so_that_inputs_may_vary) {
  std::vector<std::size_t> seen;
  (void)time_calls([&seen](std::size_t i) { seen.push_back(i); },
                   {.batches = 11, .batch_us = 1, .seconds = 0.01});
  const auto first = std::find(seen.rbegin(), seen.rend(), std::size_t{0});  // of the measured calls
  std::size_t wanted = 0;
  for (auto it = first.base() - 1; it != seen.end(); ++it) {
    ASSERT_EQ(*it, wanted++);
  }
  EXPECT_GE(wanted, 11U);
}

// What is opened while a process lives and read when it has ended fails with ESRCH; memory at address 0 fails
// alike.
TEST(WatchedPrograms, a_file_of_proc_that_can_be_opened_and_not_read_is_empty) {
  EXPECT_EQ(read_text("/proc/self/mem"), "");
  EXPECT_EQ(read_text("/proc/0/maps"), "");
  EXPECT_NE(read_text("/proc/self/maps"), "");
}

TEST(ReportProgress, counts_steps_of_several_threads) {
  Progress progress("test");
  progress.start("counting", 4000);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&progress] {
      for (int k = 0; k < 1000; ++k) {
        progress.step();
      }
    });
  }
  for (auto& t : threads) {
    t.join();
  }
}

// ---- figures and the page ----

class ReportOutput : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum report's-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    out_ = name;
  }
  void TearDown() override { fs::remove_all(out_); }

  // One of everything.
  static Figure figure() {
    const std::vector<Work> works = {at("it's_a", 10, 1e-2), at("b <c>", 100, 1e-5, true)};
    Map map{.categories = {"stable", "unstable"}};
    for (int i = 0; i < 30; ++i) {
      map.x.push_back(i % 6);
      map.y.push_back(std::pow(10, i / 6));
      map.value.push_back(i % 6 > i / 6 ? 1 : 0);
    }
    Panel stable{.title = "a & b", .x_label = "B [Ns/m]", .y_label = "K [N/m]", .log_y = true};
    stable.series.push_back({.name = "bound", .x = {0, 5}, .y = {1, 1e4}, .style = Style::limit});
    stable.map = map;
    Panel scale = stable;
    scale.map->categories.clear();
    Panel nothing{.title = "empty", .log_x = true, .log_y = true};
    nothing.series.push_back({.name = "below zero", .x = {-1, 0}, .y = {1, std::nan("")}});
    return {.name = "all",
            .panels = {work_precision("w", "error", works), stable, scale, nothing},
            .note = "n < m"};
  }
  static bool gnuplot_is_there() { return !tools::find_program("gnuplot").empty(); }

  fs::path out_;
};

TEST_F(ReportOutput, draws_a_figure_with_all_its_parts) {
  if (!gnuplot_is_there()) {
    GTEST_SKIP() << "gnuplot is not installed";
  }
  const auto drawn = draw(figure(), out_ / "all.svg");
  ASSERT_TRUE(drawn) << drawn.error();
  const std::string svg = read_all(out_ / "all.svg");
  EXPECT_TRUE(contains(svg, "</svg>"));
  for (const char* text : {"Pareto front", "it's_a", "b &lt;c", "shipped", "a &amp; b", "K [N/m]", "stable",
                           "unstable", "bound", "nothing could be drawn"}) {
    EXPECT_TRUE(contains(svg, text)) << text;
  }
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& f : fs::directory_iterator(out_)) {
    ++files;
  }
  EXPECT_EQ(files, 1U);  // no script or log left behind
}

TEST_F(ReportOutput, joins_neighbours_of_one_category_into_one_box) {
  Panel p;
  p.map = Map{.x = {0, 1, 2, 3, 0, 1, 2, 3},
              .y = {1, 1, 1, 1, 2, 2, 2, 2},
              .value = {0, 0, 1, 1, 0, 1, 0, 1},
              .categories = {"a", "b"}};
  const std::string script = tools::gnuplot_script({.name = "m", .panels = {p}}, out_ / "m.svg");
  const auto rows = [&script](const std::string& block) {
    const auto begin = script.find(block + " << EOD\n"), end = script.find("EOD\n", begin + block.size() + 8);
    return std::count(script.begin() + static_cast<std::ptrdiff_t>(begin),
                      script.begin() + static_cast<std::ptrdiff_t>(end), '\n') -
           1;
  };
  EXPECT_EQ(rows("$m0_0"), 1 + 2);
  EXPECT_EQ(rows("$m0_1"), 1 + 2);
  EXPECT_TRUE(contains(script, "-0.5 0.5 -0.5 1.5 0.5 1.5 0")) << script;  // half-way to the neighbours
}

TEST_F(ReportOutput, bands_are_drawn_behind_the_lines_and_end_the_axis) {
  Panel p;
  p.series.push_back({.name = "force", .x = {0, 1, 2}, .y = {0, 1, 0}});
  p.bands = {{0, 0.5, "free", 0}, {0.5, 0.52, "contact", 1}, {0.52, 3, "it\'s inside", 2}};
  const std::string script = tools::gnuplot_script({.name = "b", .panels = {p}}, out_ / "b.png");
  EXPECT_TRUE(contains(script, "set terminal pngcairo")) << script;
  EXPECT_TRUE(contains(script, "set xrange [0:3]")) << script;
  EXPECT_TRUE(contains(script, "set label 2 'contact' at first 0.509, graph 0.940 left")) << script;
  EXPECT_TRUE(contains(script, "set label 3 'it''s inside' at first 0.529, graph 0.870 left")) << script;
  if (gnuplot_is_there()) {
    const auto drawn = tools::draw({.name = "b", .panels = {p}}, out_ / "b.png");
    EXPECT_TRUE(drawn) << drawn.error();
  }
}

TEST_F(ReportOutput, a_figure_that_cannot_be_drawn_says_why_in_one_line) {
  const auto drawn = draw(figure(), out_ / "nowhere" / "all.svg");
  ASSERT_FALSE(drawn);
  EXPECT_FALSE(contains(drawn.error(), "\n"));
  EXPECT_FALSE(tools::draw({.name = "none"}, out_ / "none.svg"));
}

TEST_F(ReportOutput, page_escapes_its_text_and_needs_no_other_file) {
  Table t{.name = "tab<le>", .columns = {"<b>", "hidden"}};
  t.shown = {"<b>"};
  for (int i = 0; i < 100; ++i) {
    t.add({"<i>&\"'", i});
  }
  Finished good{.topic = "force", .about = "<about>"};
  good.result = {.tables = {t}, .figures = {figure()}, .reading = "a < b & c"};
  const Finished bad{.topic = "other", .about = "x", .error = "<no> way"};
  const std::vector<Finished> topics = {good, bad};
  if (gnuplot_is_there()) {
    ASSERT_TRUE(draw(figure(), out_ / "all.svg"));
  }
  const std::string html =
      page(topics, {.machine = "<m>", .compiler = "c", .flags = "f", .commit = "k"}, out_);
  for (const char* text :
       {"&lt;about&gt;", "a &lt; b &amp; c", "&lt;b&gt;", "&lt;i&gt;&amp;&quot;&#39;", "n &lt; m",
        "&lt;no&gt; way", "&lt;m&gt;", "tab&lt;le&gt;.csv, 8 of 100 rows, 1 of 2 columns", "id=\"force\"",
        "id=\"other\""}) {
    EXPECT_TRUE(contains(html, text)) << text;
  }
  for (const char* text : {"<i>", "<no>", "<about>", "hidden"}) {
    EXPECT_FALSE(contains(html, text)) << text;
  }
  EXPECT_EQ(contains(html, "<svg"), gnuplot_is_there());
  EXPECT_FALSE(contains(html, "<?xml"));
  EXPECT_FALSE(
      std::regex_search(html, std::regex(R"(<script|<link|<img|<iframe|@import|(src|href)\s*=\s*["'][^#])")));
}

}  // namespace
}  // namespace punctum::report
