// The report that a lab keeps and the terminal's words: what they say, and that nothing in a scene or a file
// can make a page do more than show it.
#include "tools/punctum/lab_report.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "hal/devices.hpp"
#include "rt/forces/list.hpp"
#include "tools/punctum/event_log.hpp"
#include "tools/punctum/facts.hpp"
#include "tools/punctum/folder_lock.hpp"
#include "tools/punctum/provenance.hpp"
#include "tools/punctum/rebuilt_facts.hpp"
#include "tools/punctum/run_page.hpp"
#include "tools/punctum/run_report.hpp"
#include "tools/punctum/run_sentence.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/punctum/time_chart.hpp"
#include "tools/shared/event_words.hpp"
#include "tools/shared/fault_advice.hpp"
#include "tools/shared/html.hpp"
#include "tools/shared/suggestion.hpp"
#include "tools/shared/written_number.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "punctum-lab-report-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::string path() const { return path_.string(); }
  void put(const char* name, const std::string& text) const { std::ofstream(path_ / name) << text; }

 private:
  fs::path path_;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// ---- the page ----

TEST(Page, what_a_scene_calls_itself_stays_text) {
  const std::string attack = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)>";
  const Folder folder;
  folder.put("scene.toml", "# " + attack + "\n");
  const Json facts = {{"scene", attack},
                      {"title", attack},
                      {"outcome", attack},
                      {"outcome_detail", attack},
                      {"begun_at", attack},
                      {"command_line", attack},
                      {"program", attack},
                      {"machine", {{"name", attack}, {"processor", attack}, {"kernel", attack}}},
                      {"phases", {{{"name", attack}, {"start_s", 0}, {"end_s", 1}}}},
                      {"events", {{{"t_s", 1}, {"event", attack}, {"what", attack}, {"writer", attack}}}},
                      {"alarms_s", {{attack, 1}}},
                      {"not_kept", {{{"file", attack}, {"t_s", 1}, {"why", attack}}}},
                      {"needle_at_end", {{"where", "inside"}, {"in_words", attack}, {"known_from", attack}}}};
  TimeChart chart;
  chart.title = attack;
  chart.end_s = 1;
  chart.bands = {{0, 1, attack, 0}};
  chart.panels = {{attack, {Curve(attack, 0, 1)}}};
  chart.panels[0].curves[0].add(0.5, 1);
  chart.instants = {{0.5, attack, true}};
  chart.lanes = {{attack, {{0, 1}}}};
  const std::string page = run_page(folder.path(), facts, svg(chart));
  EXPECT_FALSE(contains(page, "<script"));
  EXPECT_FALSE(contains(page, "<img src=x"));
  EXPECT_TRUE(contains(page, "&lt;script&gt;"));
  const std::string compared = comparison_page({{attack, facts, chart}, {attack, facts, chart}});
  EXPECT_FALSE(contains(compared, "<script"));
  EXPECT_FALSE(contains(compared, "<img src=x"));
}

TEST(Page, needs_no_network_no_script_and_no_file_beside_it) {
  const Folder folder;
  fs::create_directory(fs::path(folder.path()) / "frames");
  folder.put("frames/000003.png", "a picture");
  folder.put("obs.csv", "frame,t_s,phase\n3,0.12,free\n");
  const std::string page = run_page(folder.path(), {{"scene", "free"}, {"seconds", 1}}, "");
  EXPECT_TRUE(contains(page, "src=\"data:image/png;base64,YSBwaWN0dXJl\""));
  EXPECT_TRUE(contains(page, "t = 0.120 s"));
  const std::regex loads("(src|href)=\"(?!data:)|<link|<script|@import|url\\(");
  EXPECT_FALSE(std::regex_search(page, loads));
}

TEST(Page, of_facts_that_are_missing_or_of_another_kind_is_a_page_still) {
  for (
      const char* text :
      {"{}", R"({"phases":3,"events":"x","machine":[],"cells":null,"seconds":"long"})",
       R"({"phases":[1,null],"events":[{}],"faults":[{"name":7}],"needle_at_end":[],"dose":1,"not_kept":{}})"}) {
    const Json facts = Json::parse(text);
    EXPECT_TRUE(contains(run_page("/nowhere", facts, ""), "</html>")) << text;
    EXPECT_TRUE(contains(comparison_page({{"a", facts, {}}, {"b", facts, {}}}), "</html>")) << text;
  }
}

TEST(Page, a_comparison_gives_mean_and_standard_deviation) {
  const auto run = [](double depth) { return ComparedRun{"r", {{"max_depth_um", depth}}, {}}; };
  // Mean 20, standard deviation of three values 10 apart: 10.
  EXPECT_TRUE(contains(comparison_page({run(10), run(20), run(30)}), "20 ± 10"));
}

TEST(Text, inside_html_loses_what_is_no_text) {
  EXPECT_EQ(escaped("a<b & \"c\" 'd'"), "a&lt;b &amp; &quot;c&quot; &#39;d&#39;");
  EXPECT_EQ(escaped("caf\xC3\xA9 \xE2\x82\xAC \xF0\x9F\x94\xAC"),
            "caf\xC3\xA9 \xE2\x82\xAC \xF0\x9F\x94\xAC");
  const std::string no_text = "\xEF\xBF\xBD";
  EXPECT_EQ(escaped("\033[31m"), no_text + "[31m");
  EXPECT_EQ(escaped("caf\xE9!"), "caf" + no_text + "!");            // Latin 1
  EXPECT_EQ(escaped("\xC0\xBC"), no_text + no_text);                // '<' in two bytes
  EXPECT_EQ(escaped("\xED\xA0\x80"), no_text + no_text + no_text);  // half of a surrogate pair
  EXPECT_EQ(escaped("cut \xE2\x82"), "cut " + no_text + no_text);
}

TEST(Text, in_base64_is_as_rfc_4648_gives_it) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xFB\xFF\xBF"), "+/+/");
}

// ---- numbers and sentences ----

TEST(Numbers, are_written_as_people_write_them) {
  EXPECT_EQ(Json(as_written(0.030000000000000002)).dump(), "0.03");
  EXPECT_EQ(Json(as_written(0.1 + 0.2)).dump(), "0.3");
  EXPECT_EQ(Json(as_written(1e-6 / 3)).dump(), "3.33333333333e-07");
  EXPECT_TRUE(std::isnan(as_written(std::nan(""))));
  const Json facts = whole_facts({{"program", "p"}}, {{"a", 0.1 + 0.2}, {"list", {{{"b", 3 * 0.1}}}}});
  EXPECT_EQ(facts.dump(), R"({"a":0.3,"list":[{"b":0.3}],"program":"p"})");
}

TEST(Sentence, a_time_is_never_negative) {
  EXPECT_EQ(after_or_before(20, "the needle touched"), "20 ms after the needle touched");
  EXPECT_EQ(after_or_before(-20, "the needle touched"), "20 ms before the needle touched");
  EXPECT_EQ(after_or_before(0.1, "the needle touched"), "just as the needle touched");
  EXPECT_EQ(after_or_before(std::nullopt, "x"), "-");
}

TEST(Sentence, every_end_has_its_own) {
  std::set<std::string> sentences;
  for (int i = 1; i < rt::kRunEnds; ++i) {
    const auto end = static_cast<rt::RunEnd>(i);
    if (end == rt::RunEnd::invalid_setup) {
      continue;  // leaves no report
    }
    const std::string s = run_sentence({{"outcome", rt::name(end)}, {"seconds", 12.34}});
    EXPECT_TRUE(contains(s, "12.3 s")) << s;
    EXPECT_FALSE(contains(s, "not known")) << rt::name(end);
    EXPECT_TRUE(sentences.insert(s).second) << s;
  }
  EXPECT_TRUE(contains(run_sentence({{"outcome", "unknown"}}), "not known"));
}

TEST(Sentence, counts_no_cells_where_nobody_counted_them) {
  const auto sentence = [](const Json& cells) {
    return run_sentence({{"outcome", "done"}, {"seconds", 5}, {"cells", cells}});
  };
  EXPECT_TRUE(contains(sentence({{"tried", 1}, {"done", 1}}), "1 of 1 cells"));
  EXPECT_FALSE(contains(sentence({{"tried", 1}, {"done", nullptr}}), "0 of 1"));
}

TEST(Sentence, says_where_the_needle_is_and_what_was_given) {
  const std::string s =
      run_sentence({{"outcome", "stopped"},
                    {"seconds", 9},
                    {"needle_at_end", {{"where", "inside"}, {"in_words", "INSIDE THE CELL, 23.1 um"}}},
                    {"dose", {{"asked_s", 1.5}, {"given_s", 0.39}}}});
  EXPECT_TRUE(contains(s, "INSIDE THE CELL, 23.1 um")) << s;
  EXPECT_TRUE(contains(s, "0.39 s of 1.50 s")) << s;
}

TEST(Advice, every_fault_has_a_cause_something_to_do_and_what_clears_it) {
  std::set<std::string> seen;
  for (int i = 1; i < rt::kFaults; ++i) {
    const FaultAdvice& a = kFaultAdvice[static_cast<std::size_t>(i)];
    EXPECT_GT(std::string(a.cause).size(), 10U) << rt::name(a.fault);
    EXPECT_GT(std::string(a.next).size(), 10U) << rt::name(a.fault);
    EXPECT_GT(std::string(clearing_condition(a.fault)).size(), 10U) << rt::name(a.fault);
    EXPECT_TRUE(seen.insert(a.cause).second) << rt::name(a.fault);
    EXPECT_EQ(fault_named(rt::name(a.fault)), a.fault);
  }
  EXPECT_FALSE(fault_named("nonsense"));
}

TEST(Advice, a_drive_without_an_error_code_has_lost_its_power_and_the_reset_button_gives_it_back) {
  const FaultAdvice& a = kFaultAdvice[static_cast<std::size_t>(rt::Fault::stage_fault)];
  for (const char* cause : {"lost its power", "relay", "heartbeat", "stalled"}) {
    EXPECT_TRUE(contains(a.cause, cause)) << a.cause;
  }
  EXPECT_TRUE(contains(a.next, "error code")) << a.next;
  EXPECT_TRUE(contains(a.next, "reset button")) << a.next;
}

TEST(Suggestion, takes_neighbours_that_changed_places_for_one_mistake) {
  EXPECT_EQ(suggestion("--sede", {"--seconds", "--set", "--seed"}), " (did you mean --seed?)");
  EXPECT_EQ(suggestion("zebrafihs", {"icsi", "zebrafish", "free"}), " (did you mean zebrafish?)");
  EXPECT_EQ(suggestion("nothing-like-it", {"icsi", "free"}), "");
}

// ---- the drawing ----

TEST(Drawing, a_peak_of_one_tick_is_seen_however_long_the_run_is) {
  Curve curve("c", 0, 1000);
  constexpr int kTicks = 1'000'000;
  for (int i = 0; i < kTicks; ++i) {
    curve.add(i * 1e-3, i == 345'678 ? 5.0 : 0.001 * (i % 2));
  }
  double highest = 0;
  std::size_t points = 0;
  for (const auto& stroke : curve.strokes()) {
    points += stroke.size();
    for (const Curve::Point& p : stroke) {
      highest = std::max(highest, p.value);
    }
  }
  EXPECT_EQ(highest, 5.0);
  EXPECT_LE(points, 2 * (Curve::kColumns + 1));
}

TEST(Drawing, a_gap_stays_a_gap) {
  Curve curve("c", 0, 10);
  for (const double t : {0.0, 1.0, 2.0, 3.0}) {
    curve.add(t, t == 1.0 ? std::nan("") : 1.0);
  }
  const auto strokes = curve.strokes();
  ASSERT_EQ(strokes.size(), 2U);
  EXPECT_EQ(strokes[0].size(), 1U);
  EXPECT_EQ(strokes[1].size(), 2U);
}

TEST(Drawing, a_histogram_counts_every_tick) {
  const std::string s = svg(TimesHistogram{.title = "t",
                                           .from_us = {0, 1, 2, 500},
                                           .count = {10, 20, 5, 1},
                                           .over = 4,
                                           .p50_us = 2,
                                           .max_us = 9000});
  EXPECT_TRUE(contains(s, "40 ticks, longest 9000 us"));
  EXPECT_TRUE(contains(s, "4 longer ones"));
}

// ---- what a crash left ----

TEST(Rebuilt, from_a_table_that_is_cut_off_in_the_middle_of_a_row) {
  const Folder folder;
  const std::string columns =
      "t_s,phase,x_m,fx_N,fy_N,fz_N,wd_m,fault,cell,alarms,tip_force_N,true_force_N,true_gap_m,true_contact,"
      "true_punctured,true_lost\n";
  folder.put("samples.csv", columns +
                                "0.000,free,0,0,0,0,0,none,0,0,0,0,2e-05,0,0,0\n"
                                "0.001,contact,0,0.3,0,0.4,1e-06,none,0,0,1e-06,2e-06,-3e-06,1,0,0\n"
                                "0.002,indentation,0,0,0,0.1,5e-06,none,0,0,1e-06,3e-06,-9e-06,1,0,0\n"
                                "0.003,indent");
  folder.put("events.csv",
             std::string(kEventColumns) + "0.001000,101,phase,contact,0,,,\n0.002000,102,alarm_on,sen");
  const Json facts = rebuilt_facts(folder.path());
  EXPECT_EQ(facts["rebuilt"], true);
  EXPECT_EQ(facts["outcome"], "unknown");
  EXPECT_EQ(facts["samples"]["rows"], 3);
  EXPECT_EQ(facts["samples"]["cut_off"], 1);
  ASSERT_EQ(facts["phases"].size(), 3U);
  EXPECT_EQ(facts["phases"][1]["name"], "contact");
  EXPECT_NEAR(facts["peak_hand_force_N"].get<double>(), 0.5, 1e-12);
  EXPECT_NEAR(facts["max_depth_um"].get<double>(), 9, 1e-9);
  EXPECT_EQ(facts["needle_at_end"]["where"], "touching");
  EXPECT_EQ(facts["needle_at_end"]["known_from"], "truth");
  EXPECT_EQ(facts["events"][0]["what"], "contact");
  EXPECT_TRUE(facts["missed"].is_null());  // nobody counted them: not zero
  EXPECT_EQ(report_folders({folder.path()}, ""), 0);
  EXPECT_TRUE(fs::exists(fs::path(folder.path()) / "report.html"));
  EXPECT_TRUE(fs::exists(fs::path(folder.path()) / "report.json"));
}

// One injection at 1 kHz: what happens on which tick. Of these rows every n-th is kept, and each change of
// phase, as a recorder does.
class RecordedInjection {
 public:
  static constexpr int kContact = 100, kContactTold = 110, kPuncture = 200, kPunctureTold = 220;
  static constexpr int kAsked = 240, kOpen = 250, kShut = 1050, kLetGo = 1240, kOut = 1300, kEnd = 1400;

  static std::string rows(int every) {
    std::string all =
        "t_s,phase,fx_N,fy_N,fz_N,fault,cell,alarms,buttons,injector_open,tip_force_N,true_force_N,"
        "true_gap_m,true_contact,true_punctured,true_lost\n";
    std::string last_phase;
    for (int tick = 0; tick < kEnd; ++tick) {
      const std::string phase = tick < kContactTold    ? "free"
                                : tick < kPunctureTold ? "contact"
                                : tick < kAsked        ? "puncture"
                                : tick < kLetGo        ? "injection"
                                : tick < kOut          ? "withdrawal"
                                                       : "clear";
      const bool pressed = tick >= kAsked && tick < kLetGo, open = tick >= kOpen && tick < kShut;
      if (tick % every == 0 || phase != last_phase) {
        all +=
            fmt::format("{:.6f},{},0,0,0.1,none,0,0,{},{:d},0,1e-06,{},{:d},{:d},0\n", tick * 1e-3, phase,
                        pressed ? static_cast<unsigned>(hal::kButtonInject) : 0U, open,
                        tick < kContact ? 1e-6 : -1e-6, tick >= kContact && tick < kOut, tick >= kPuncture);
      }
      last_phase = phase;
    }
    return all;
  }
};

TEST(Rebuilt, dose_and_delays_are_what_the_rows_tell) {
  using R = RecordedInjection;
  for (const bool inner : {false, true}) {
    const Folder folder;
    folder.put("scene.toml", to_toml(*load_scene(inner ? "icsi" : "outer-only")));
    folder.put("samples.csv", R::rows(1));
    const Json facts = rebuilt_facts(folder.path());
    ASSERT_EQ(facts["rate_hz"], 1000);
    EXPECT_NEAR(facts["dose"]["asked_s"].get<double>(), (R::kLetGo - R::kAsked) * 1e-3, 1e-9);
    EXPECT_NEAR(facts["dose"]["given_s"].get<double>(), (R::kShut - R::kOpen) * 1e-3, 1e-9);
    EXPECT_EQ(facts["dose"]["known_from"], "injector");
    EXPECT_NEAR(facts["contact_delay_ms"].get<double>(), R::kContactTold - R::kContact, 1e-6);
    EXPECT_NEAR(facts["puncture_inner_delay_ms"].get<double>(), R::kPunctureTold - R::kPuncture, 1e-6);
    EXPECT_EQ(facts["puncture_delay_ms"].is_null(), inner) << "the rows tell of the inner membrane only";
  }
}

std::string ended_as(rt::RunEnd end, std::string before = "") {
  rt::Event last;
  last.t_s = 1.39;
  last.kind = rt::Event::ended;
  last.what = static_cast<std::uint64_t>(end);
  return kEventColumns + before + event_line(last);
}

// As the run itself would have been judged: the core knows neither the truth nor what came out.
TEST(Rebuilt, the_outcome_is_not_the_cores_word_alone) {
  using R = RecordedInjection;
  const Folder folder;
  const auto outcome = [&](const char* scene, const std::string& rows, const std::string& events) {
    folder.put("scene.toml", to_toml(*load_scene(scene)));
    folder.put("samples.csv", rows);
    folder.put("events.csv", events);
    return rebuilt_facts(folder.path())["outcome"].get<std::string>();
  };
  const auto with = [](std::string rows, const std::string& old, const std::string& now) {
    for (std::size_t at = rows.find(old); at != std::string::npos; at = rows.find(old, at + now.size())) {
      rows.replace(at, old.size(), now);
    }
    return rows;
  };
  const std::string done = ended_as(rt::RunEnd::done), given = R::rows(1);
  // The dose that R has given is a part of what it was asked.
  EXPECT_EQ(outcome("icsi", given, done), "injected in part");
  const std::string open = fmt::format(",{},1,", hal::kButtonInject),
                    shut = fmt::format(",{},0,", hal::kButtonInject);
  EXPECT_EQ(outcome("icsi", with(given, open, shut), done), "not injected");
  const std::string all = with(given, shut, open);
  EXPECT_EQ(outcome("icsi", all, done), "done");
  rt::Event fault;
  fault.t_s = 0.5;
  fault.kind = rt::Event::fault;
  fault.what = static_cast<std::uint64_t>(rt::Fault::estop);
  EXPECT_EQ(outcome("icsi", all, ended_as(rt::RunEnd::done, event_line(fault))), "done after a fault");
  fault.what = static_cast<std::uint64_t>(rt::Fault::command_stop);
  EXPECT_EQ(outcome("icsi", all, ended_as(rt::RunEnd::stopped, event_line(fault))), "stopped");
  EXPECT_EQ(outcome("icsi", all, ended_as(rt::RunEnd::time_limit)), "time limit");
  EXPECT_EQ(outcome("icsi", with(all, ",1,0\n", ",1,1\n"), done), "cell lost");
  EXPECT_EQ(outcome("free", all, ended_as(rt::RunEnd::time_limit)), "done") << "it has no task";
}

// The rows tell when the inner membrane gave way; between that and the outer one the needle is in the cell.
TEST(Rebuilt, between_two_membranes_the_needle_is_where_the_core_has_it) {
  const Folder folder;
  const std::string rows =
      "t_s,phase,fz_N,fault,wd_m,obs_gap_m,obs_age_s,tip_force_N,true_force_N,true_gap_m,true_contact,"
      "true_punctured,true_lost\n"
      "0.000,indentation,0,none,5e-06,-5e-06,0.1,1e-6,1e-6,-9e-06,1,0,0\n"
      "0.001,puncture,0,none,0,-5e-06,0.1,0,1e-6,-5e-05,1,0,0\n";
  folder.put("samples.csv", rows);
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  Json facts = rebuilt_facts(folder.path());
  EXPECT_EQ(facts["needle_at_end"]["where"], "inside");
  EXPECT_EQ(facts["needle_at_end"]["known_from"], "core");
  EXPECT_TRUE(facts["force_error_rms_N"].is_null()) << "of the outer membrane the rows do not tell";
  folder.put("scene.toml", to_toml(*load_scene("outer-only")));
  facts = rebuilt_facts(folder.path());
  EXPECT_EQ(facts["needle_at_end"]["where"], "touching") << "in truth it has not given way";
  EXPECT_NEAR(facts["force_error_rms_N"].get<double>(), 0, 1e-12);
}

TEST(Rebuilt, rows_that_are_missing_between_others_are_told) {
  const Folder folder;
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  const std::string rows = RecordedInjection::rows(1);
  const std::size_t from = rows.find("\n0.300000,") + 1, to = rows.find("\n0.900000,") + 1;
  folder.put("samples.csv", rows.substr(0, from) + rows.substr(to));
  folder.put("events.csv", ended_as(rt::RunEnd::done));
  const Json facts = rebuilt_facts(folder.path());
  ASSERT_EQ(facts["not_kept"].size(), 1U);
  EXPECT_NEAR(facts["not_kept"][0]["t_s"].get<double>(), 0.299, 1e-9);
  EXPECT_EQ(facts["not_kept"][0]["why"], "its rows go on at 0.900 s: its only hole");
  EXPECT_TRUE(facts["alarms_s"].is_null() && facts["dose"]["asked_s"].is_null() && facts["phases"].empty());
  EXPECT_EQ(facts["outcome"], "done") << "what the cell got is not known";
  const std::size_t again = rows.find("\n1.000000,") + 1, end = rows.find("\n1.150000,") + 1;
  folder.put("samples.csv", rows.substr(0, from) + rows.substr(to, again - to) + rows.substr(end));
  const Json two = rebuilt_facts(folder.path());
  ASSERT_EQ(two["not_kept"].size(), 1U);
  EXPECT_EQ(
      two["not_kept"][0]["why"],
      "its rows go on at 0.900 s: the longest of its 2 holes, which are 0.752 s together");  // .601 + .151
  folder.put("samples.csv", RecordedInjection::rows(7));
  EXPECT_TRUE(rebuilt_facts(folder.path())["not_kept"].empty()) << "every seventh row, and changes of phase";
}

TEST(Rebuilt, rows_that_are_damaged_are_counted_and_what_depends_on_them_is_unknown) {
  const Folder folder;
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  folder.put("events.csv", ended_as(rt::RunEnd::done));
  const std::string rows = RecordedInjection::rows(1);
  const auto rebuilt = [&folder](const std::string& table, const char* why, double t_s) {
    folder.put("samples.csv", table);
    Json facts = rebuilt_facts(folder.path());
    const Json told = facts["not_kept"].empty() ? Json::object() : facts["not_kept"].back();
    EXPECT_EQ(text_in(told, "why"), why);
    EXPECT_NEAR(number_in(told, "t_s").value_or(-1), t_s, 1e-9) << why;
    EXPECT_TRUE(facts["dose"]["given_s"].is_null() && facts["dose"]["asked_s"].is_null()) << why;
    EXPECT_TRUE(facts["alarms_s"].is_null() && facts["phases"].empty()) << why;
    return facts;
  };
  std::string zeroed = rows;
  const std::size_t block = zeroed.find("\n0.400000,") + 20;
  std::fill_n(zeroed.begin() + static_cast<std::ptrdiff_t>(block), 4096, '\0');
  Json facts = rebuilt(zeroed, "1 row cannot be read", 0.399);
  EXPECT_NE(facts["needle_at_end"]["where"], "unknown");
  EXPECT_EQ(facts["samples"]["unreadable"], 1);
  std::string odd = rows;
  for (std::size_t at = 0; (at = odd.find(",1,0,1e-06,", at)) != std::string::npos;) {
    odd[at + 1] = '#';  // injector_open
  }
  (void)rebuilt(odd, "800 rows cannot be read", 0.249);
  facts =
      rebuilt(rows + rows.substr(rows.find('\n') + 1), "1400 rows left out: their times do not rise", 1.399);
  EXPECT_EQ(facts["samples"]["rows"], 1400);
  EXPECT_EQ(facts["samples"]["not_rising"], 1400);
  facts = rebuilt(rows + "1.400000,clear,0\n", "1 row cannot be read", 1.399);
  EXPECT_EQ(facts["needle_at_end"]["where"], "unknown") << "what came last cannot be read";
  EXPECT_EQ(report_folders({folder.path()}, ""), 1);
  EXPECT_EQ(report_folders({folder.path()}, ""), 1) << "from report.json, too";
}

TEST(Rebuilt, events_that_are_damaged_are_counted_and_the_others_are_told) {
  const Folder folder;
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  folder.put("samples.csv", RecordedInjection::rows(1));
  const std::string begin = std::string(kEventColumns) + "0.250000,250,phase,contact,0,,,\n";
  const std::string end = "1.390000,1390,ended,done,,,,\n";
  const auto rebuilt = [&](const std::string& between) {
    folder.put("events.csv", begin + between + end);
    Json facts = rebuilt_facts(folder.path());
    EXPECT_EQ(facts["events"].size(), 2U) << between;
    EXPECT_EQ(facts["outcome"], "injected in part") << "as the samples have it" << between;
    return facts;
  };
  EXPECT_TRUE(rebuilt("")["not_kept"].empty());
  const std::string zeroed = std::string("0.300000,300,ala") + '\0' + "m_on,vision_stale,,,,\n";
  for (const std::string& damaged :
       {std::string("0.3#0000,300,alarm_on,vision_stale,,,,\n"), std::string("0.300000,300,alarm_on\n"),
        std::string("0.300000,300,phase,indentation,#,,,\n"), zeroed}) {
    const Json facts = rebuilt(damaged);
    ASSERT_EQ(facts["not_kept"].size(), 1U) << damaged;
    EXPECT_EQ(facts["not_kept"][0]["file"], "events.csv");
    EXPECT_EQ(facts["not_kept"][0]["why"], "1 row cannot be read");
    EXPECT_NEAR(facts["not_kept"][0]["t_s"].get<double>(), 0.25, 1e-9);
    EXPECT_EQ(facts["event_rows"]["unreadable"], 1);
    EXPECT_FALSE(facts["phases"].empty()) << "the samples have them all";
  }
  EXPECT_EQ(rebuilt(zeroed + zeroed)["not_kept"][0]["why"], "2 rows cannot be read");
  folder.put("events.csv", begin + "1.39");
  const Json facts = rebuilt_facts(folder.path());
  EXPECT_TRUE(facts["not_kept"].empty()) << "a crash may cut off the last one";
  EXPECT_EQ(facts["event_rows"]["cut_off"], 1);
}

TEST(Rebuilt, what_a_run_began_as_is_said_to_be_unreadable) {
  const Folder folder;
  folder.put("samples.csv", "t_s,phase,fz_N,fault\n0.000,free,0,none\n");
  folder.put(kBegun, "{\"scene\": ");
  testing::internal::CaptureStderr();
  EXPECT_EQ(report_folders({folder.path()}, ""), 1);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(contains(said, "begun.json from about 0.000 s on: cannot be read")) << said;
}

TEST(Rebuilt, a_pipe_in_the_folder_is_refused_and_not_waited_for) {
  for (const char* name :
       {"begun.json", "events.csv", "obs.csv", "report.json", "report.html", "scene.toml"}) {
    const Folder folder;
    folder.put("samples.csv", "t_s,phase,fz_N,fault\n0.000,free,0,none\n");
    ASSERT_EQ(mkfifo((fs::path(folder.path()) / name).c_str(), 0600), 0);
    testing::internal::CaptureStderr();
    EXPECT_EQ(report_folders({folder.path()}, ""), 2) << name;
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_TRUE(contains(said, std::string(name) + ": not a file")) << said;
  }
}

TEST(Rebuilt, what_came_about_between_two_rows_came_at_a_time_that_is_not_known) {
  using R = RecordedInjection;
  const Folder folder;
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  folder.put("samples.csv", R::rows(7));
  const Json facts = rebuilt_facts(folder.path());
  EXPECT_TRUE(facts["contact_delay_ms"].is_null());
  EXPECT_TRUE(facts["puncture_inner_delay_ms"].is_null());
  EXPECT_NEAR(facts["dose"]["asked_s"].get<double>(), (R::kLetGo - R::kAsked) * 1e-3, 7.1e-3);
  EXPECT_NEAR(facts["dose"]["given_s"].get<double>(), (R::kShut - R::kOpen) * 1e-3, 7.1e-3);
  EXPECT_TRUE(contains(run_page(folder.path(), facts, ""), "<dt>contact told</dt><dd>unknown</dd>"));
}

TEST(Rebuilt, where_the_events_go_on_after_the_last_row_nobody_knows_how_it_ended) {
  const Folder folder;
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  const std::string rows = RecordedInjection::rows(1);
  folder.put("samples.csv", rows.substr(0, rows.find("\n0.300000,") + 1));  // the needle is in the cell
  rt::Event last;
  last.tick = 1350;
  last.t_s = 1.35;
  last.kind = rt::Event::ended;
  last.what = static_cast<std::uint64_t>(rt::RunEnd::done);
  folder.put("events.csv", kEventColumns + event_line(last));
  const Json facts = rebuilt_facts(folder.path());
  EXPECT_EQ(facts["outcome"], "done");
  EXPECT_EQ(facts["needle_at_end"]["where"], "unknown");
  EXPECT_TRUE(facts["dose"]["given_s"].is_null() && facts["dose"]["asked_s"].is_null()) << facts["dose"];
  EXPECT_TRUE(facts["max_depth_um"].is_null());
  EXPECT_EQ(facts["seconds"], 1.35);
  ASSERT_EQ(facts["not_kept"].size(), 1U);
  EXPECT_EQ(facts["not_kept"][0]["file"], "samples.csv");
  last.t_s = 0.7;  // either table may be behind the other
  folder.put("events.csv", kEventColumns + event_line(last));
  EXPECT_TRUE(rebuilt_facts(folder.path())["not_kept"].empty());
}

TEST(Rebuilt, a_dose_that_began_or_ended_between_rows_far_apart_is_unknown) {
  const Folder folder;
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  folder.put("samples.csv", RecordedInjection::rows(30));
  const Json facts = rebuilt_facts(folder.path());
  EXPECT_TRUE(facts["dose"]["given_s"].is_null()) << facts["dose"];
  EXPECT_TRUE(facts["dose"]["asked_s"].is_null());
}

TEST(Rebuilt, a_dose_that_no_row_tells_is_unknown_and_not_zero) {
  const Folder folder;
  folder.put("scene.toml", to_toml(*load_scene("icsi")));
  folder.put("samples.csv", "t_s,phase,fz_N,fault\n0.000,injection,0,none\n0.001,injection,0,none\n");
  const Json facts = rebuilt_facts(folder.path());
  EXPECT_TRUE(facts["dose"]["given_s"].is_null());
  EXPECT_TRUE(contains(run_sentence(facts), "How much the cell was given is not known"))
      << run_sentence(facts);
  EXPECT_TRUE(contains(run_page(folder.path(), facts, ""), "unknown given of unknown asked"));
}

TEST(Rebuilt, the_folder_of_a_run_that_goes_on_is_left_alone_and_the_run_is_named) {
  const Folder folder;
  folder.put("samples.csv", "t_s,phase,fz_N,fault\n0.000,free,0,none\n");
  {
    const auto run = FolderLock::take(folder.path());
    ASSERT_TRUE(run);
    testing::internal::CaptureStderr();
    EXPECT_EQ(report_folders({folder.path()}, ""), 2);
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_TRUE(contains(said, "(process " + std::to_string(getpid()) + ")")) << said;
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    EXPECT_FALSE(fs::exists(fs::path(folder.path()) / "report.json"));
    EXPECT_FALSE(fs::exists(fs::path(folder.path()) / "report.html"));
  }
  EXPECT_EQ(report_folders({folder.path()}, ""), 0);
}

TEST(Rebuilt, the_cores_last_word_is_the_outcome_and_a_fault_its_detail) {
  const Folder folder;
  folder.put("samples.csv",
             "t_s,phase,fz_N,fault\n0.000,free,0,none\n0.001,free,0,estop\n0.002,free,0,estop\n");
  rt::Event last;
  last.kind = rt::Event::ended;
  last.what = static_cast<std::uint64_t>(rt::RunEnd::fault);
  folder.put("events.csv", kEventColumns + event_line(last));
  const Json facts = rebuilt_facts(folder.path());
  EXPECT_EQ(facts["outcome"], "fault");
  EXPECT_EQ(facts["outcome_detail"], "estop");
}

TEST(Rebuilt, an_event_comes_back_from_its_table_as_it_was_written) {
  const Folder folder;
  rt::Event phase;
  phase.tick = 1234;
  phase.t_s = 1.234;
  phase.kind = rt::Event::phase;
  phase.what = static_cast<std::uint64_t>(rt::Phase::contact);
  phase.value = 2;
  rt::Event command;
  command.tick = 5678;
  command.t_s = 5.678;
  command.kind = rt::Event::command;
  command.what = rt::Command::effect_gain;
  command.value = 0.25;
  command.target = rt::effect_damping;
  command.writer = 1;
  folder.put("events.csv", kEventColumns + event_line(phase) + event_line(command));
  const auto events = read_events(folder.path() + "/events.csv").list;
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0], event_row(phase));
  EXPECT_EQ(events[1], event_row(command));
}

TEST(Rebuilt, a_table_of_something_else_is_refused_and_the_column_it_lacks_is_named) {
  const Folder folder;
  folder.put("samples.csv", "t_s,phase,fx_N,fault\n0.000,free,0,none\n");
  testing::internal::CaptureStderr();
  EXPECT_EQ(report_folders({folder.path()}, ""), 2);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(contains(said, "samples.csv: no table of a run: it has no column fz_N")) << said;
  EXPECT_FALSE(fs::exists(fs::path(folder.path()) / "report.json"));
  folder.put("samples.csv", "");
  EXPECT_EQ(report_folders({folder.path()}, ""), 0) << "a crash may leave no row at all";
}

TEST(Rebuilt, a_folder_that_holds_no_run_is_refused) {
  const Folder folder;
  EXPECT_EQ(report_folders({folder.path()}, ""), 2);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

// ---- the terminal ----

TEST(Lines, are_broken_between_words_and_go_on_under_their_text) {
  const std::string text =
      "outcome         done after 1.0 s\n"
      "phases          free 0.0 > contact 4.9 > indentation 5.3 > puncture 8.2\n"
      "  a line without a title that is too long for it\n"
      "\n"
      "/a/path/that/is/longer/than/the/whole/terminal/is/wide\n";
  EXPECT_EQ(wrapped(text, 40),
            "outcome         done after 1.0 s\n"
            "phases          free 0.0 > contact 4.9\n"
            "                > indentation 5.3 >\n"
            "                puncture 8.2\n"
            "  a line without a title that is too\n"
            "    long for it\n"
            "\n"
            "/a/path/that/is/longer/than/the/whole/terminal/is/wide\n");
  EXPECT_EQ(wrapped(text, 0), text);
  EXPECT_EQ(wrapped("\033[1;31mred and\033[0m \xC2\xB5m", 12), "\033[1;31mred and\033[0m \xC2\xB5m");
}

TEST(Lines, lose_no_word_at_any_width) {
  const std::string text = fault_text(rt::Fault::stage_fault, 1.5, true);
  const auto words_of = [](const std::string& lines) {
    std::istringstream in(lines);
    return std::vector<std::string>(std::istream_iterator<std::string>(in), {});
  };
  for (std::size_t columns = 1; columns < 200; ++columns) {
    EXPECT_EQ(words_of(wrapped(text, columns)), words_of(text)) << columns;
  }
}

class LiveLine : public testing::Test {
 protected:
  LiveLine() {
    sample.t_s = 12.34;
    sample.phase = rt::Phase::indentation;
    sample.force_N[2] = 1;
    sample.wd_m = 7.5e-6;
    sample.obs_age_s = 0.05;
    core->missed.store(3);
  }
  [[nodiscard]] std::string line(const LineStyle& style) const {
    Measures measures(scene);
    measures.last = sample;
    return progress_line(scene, measures, *core, style);
  }

  Scene scene = *load_scene("icsi");
  rt::TelemetrySample sample;
  std::unique_ptr<rt::CoreStatus> core = std::make_unique<rt::CoreStatus>();
};

TEST_F(LiveLine, says_phase_force_depth_vision_and_what_time_is_left) {
  const std::string s = line({});
  for (const char* part :
       {"12.3 s", "indentation", "###", "1.00 N", "depth   7.5 um", "vision ok", "s left"}) {
    EXPECT_TRUE(contains(s, part)) << part << " in " << s;
  }
  EXPECT_FALSE(contains(s, "\033")) << s;
}

TEST_F(LiveLine, names_the_devices_that_give_nothing) {
  EXPECT_FALSE(contains(line({}), "usable")) << line({});
  sample.alarms = rt::alarm_sensor;
  sample.unusable = rt::device_stage;
  EXPECT_TRUE(contains(line({}), "  stage without usable data")) << line({});
  EXPECT_TRUE(contains(line({.columns = 80}), "stage without usable data")) << line({.columns = 80});
  sample.unusable = rt::device_stage | rt::device_force_sensor;
  EXPECT_TRUE(contains(line({}), "  stage, force_sensor without usable data")) << line({});
}

TEST_F(LiveLine, tells_a_persons_own_hand_what_to_do_next) {
  EXPECT_FALSE(contains(line({}), ">")) << line({});
  scene = *load_scene("hands-on");
  const auto says = [this](rt::Phase phase, std::uint32_t alarms, const std::string& next) {
    sample.phase = phase;
    sample.alarms = alarms;
    EXPECT_TRUE(contains(line({}), "> " + next)) << line({});
    EXPECT_TRUE(contains(line({.columns = 80}), "> " + next)) << line({.columns = 80});
  };
  says(rt::Phase::free, rt::alarm_not_enabled, "hold enable");
  says(rt::Phase::free, 0, "to the cell");
  says(rt::Phase::indentation, 0, "push on");
  says(rt::Phase::puncture, 0, "press inject");
  says(rt::Phase::puncture, rt::alarm_injection_refused, "deeper");
  says(rt::Phase::injection, 0, "draw back");
  sample.injector_open = 1;
  says(rt::Phase::injection, 0, "hold inject");
  says(rt::Phase::withdrawal, 0, "draw back");
  sample.stop = rt::StopStage::stopped;
  EXPECT_FALSE(contains(line({}), ">")) << line({});
}

TEST_F(LiveLine, asks_for_a_new_press_where_a_dose_was_kept_back) {
  scene = *load_scene("hands-on");
  scene.sim->cell.reset();  // which nobody knows in truth
  Measures measures(scene);
  sample.phase = rt::Phase::injection;
  sample.buttons = hal::kButtonInject;
  const auto after_s = [&](double seconds, std::uint8_t injector_open, std::uint32_t buttons) {
    sample.injector_open = injector_open;
    sample.buttons = buttons;
    for (int i = 0; i < static_cast<int>(seconds * scene.servo.rate_Hz); ++i) {
      ++sample.tick;
      measures.tick(sample, nullptr);
    }
    return progress_line(scene, measures, *core, {});
  };
  EXPECT_TRUE(contains(after_s(0.5, 0, hal::kButtonInject), "> inject anew"));
  EXPECT_TRUE(contains(after_s(0.01, 1, hal::kButtonInject), "> hold inject"));
  EXPECT_TRUE(contains(after_s(0.1, 0, 0), "> inject anew"));  // too short to be a dose
  EXPECT_TRUE(contains(after_s(0.2, 1, hal::kButtonInject), "> hold inject"));
  EXPECT_TRUE(contains(after_s(0.5, 0, hal::kButtonInject), "> draw back"));
}

TEST_F(LiveLine, a_fault_and_stale_vision_stand_out_and_survive_a_narrow_terminal) {
  sample.fault = rt::Fault::tip_force;
  sample.alarms = rt::alarm_vision_stale;
  sample.obs_age_s = 1.25;
  EXPECT_TRUE(contains(line({.coloured = true}), "\033[1;31mFAULT tip_force\033[0m"));
  const std::string narrow = line({.columns = 64});
  EXPECT_TRUE(contains(narrow, "FAULT tip_force")) << narrow;
  EXPECT_TRUE(contains(narrow, "vision stale 1.2 s") || contains(narrow, "vision stale 1.3 s")) << narrow;
}

TEST_F(LiveLine, fits_every_terminal) {
  for (std::size_t columns = 24; columns < 200; ++columns) {
    EXPECT_LT(line({.columns = columns}).size(), columns);
  }
}

}  // namespace
}  // namespace punctum::tools
