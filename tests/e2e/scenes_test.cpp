// What a scene does not need costs nothing: processes and libraries as the kernel showed them, instructions
// as valgrind counted them, and what vision called.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/e2e/quick_report.hpp"
#include "tests/support/counted_calls.hpp"
#include "tests/support/programs.hpp"
#include "tools/report/simulated_frames.hpp"
#include "tools/scene/scene_keys.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

bool valgrind_is_there() { return std::system("valgrind --version >/dev/null 2>&1") == 0; }

class Scenes : public Programs {
 protected:
  void SetUp() override {
    Programs::SetUp();
    ASSERT_EQ(quick_report().code, 0) << quick_report().said;
  }

  [[nodiscard]] static Table table(const std::string& name) {
    return Table(quick_report().folder() / (name + ".csv"));
  }
  // Its rows that belong to one scene.
  [[nodiscard]] static std::vector<std::size_t> rows_of(const Table& t, const std::string& scene) {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < t.rows.size(); ++i) {
      if (t.text(i, "scene") == scene) {
        rows.push_back(i);
      }
    }
    return rows;
  }
};

TEST_F(Scenes, every_built_in_scene_is_measured) {
  const Table t = table("scenes");
  std::set<std::string> names;
  for (std::size_t i = 0; i < t.rows.size(); ++i) {
    names.insert(t.text(i, "scene"));
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"free", "icsi", "no-holder", "outer-only", "recorded", "zebrafish"}));
}

TEST_F(Scenes, open_cv_is_in_the_vision_process_only_and_free_starts_none) {
  const Table t = table("scenes_processes");
  for (const char* scene : {"free", "icsi", "no-holder", "outer-only", "recorded", "zebrafish"}) {
    std::multiset<std::string> processes;
    for (const std::size_t i : rows_of(t, scene)) {
      const std::string& process = t.text(i, "process");
      processes.insert(process);
      EXPECT_EQ(t.number(i, "opencv_libraries") > 0, process == "punctum-vision") << scene << " " << process;
      EXPECT_GT(t.number(i, "libraries"), 1) << scene << " " << process;  // libc, libstdc++
    }
    std::multiset<std::string> wanted{"punctum", "punctum-core"};
    if (scene != std::string("free")) {
      wanted.insert("punctum-vision");
    }
    EXPECT_EQ(processes, wanted) << scene;
  }
}

TEST_F(Scenes, explain_says_in_words_what_was_measured) {
  const Table costs = table("scenes"), processes = table("scenes_processes");
  for (std::size_t i = 0; i < costs.rows.size(); ++i) {
    const std::string& scene = costs.text(i, "scene");
    SCOPED_TRACE(scene);
    ASSERT_EQ(punctum({"explain", scene}), 0);
    std::smatch said;
    ASSERT_TRUE(std::regex_search(said_, said, std::regex("(\\d+) processes of one thread each"))) << said_;
    EXPECT_EQ(std::stod(said[1]), costs.number(i, "processes"));
    for (const std::size_t p : rows_of(processes, scene)) {
      EXPECT_EQ(processes.number(p, "threads"), processes.text(p, "process") == "punctum" ? 2 : 1);
    }
    ASSERT_TRUE(std::regex_search(said_, said, std::regex("force effects +(\\d+): "))) << said_;
    EXPECT_EQ(std::stod(said[1]), costs.number(i, "effects"));
    if (std::regex_search(said_, said, std::regex("(\\d+) stages far from the cell.* (\\d+) at it"))) {
      // Finding everything once is one stage more in one frame.
      EXPECT_EQ(std::stod(said[1]), std::floor(costs.number(i, "stages_far_per_frame")));
      EXPECT_EQ(std::stod(said[2]), costs.number(i, "stages_near_per_frame"));
    } else {
      EXPECT_EQ(costs.number(i, "stages_far_per_frame"), 0);
      EXPECT_EQ(scene, "free");
    }
  }
}

TEST_F(Scenes, explain_names_every_table_that_is_left_out) {
  for (const auto name : tools::builtin_names()) {
    const auto scene = tools::load_scene(name);
    ASSERT_TRUE(scene) << scene.error();
    ASSERT_EQ(punctum({"explain", std::string(name)}), 0);
    const auto left_out = said_.find("\nleft out");
    for (const auto& t : tools::scene_tables()) {
      if (t.kind != tools::Kind::thing || t.there(*scene)) {
        continue;
      }
      ASSERT_NE(left_out, std::string::npos) << said_;
      EXPECT_NE(said_.find("\n  " + t.name + " ", left_out), std::string::npos) << name << ": " << t.name;
    }
  }
}

TEST_F(Scenes, vision_runs_only_the_stages_that_the_scene_needs) {
  const Table t = table("scenes_stages");
  for (std::size_t i = 0; i < t.rows.size(); ++i) {
    const std::string &scene = t.text(i, "scene"), &stage = t.text(i, "stage");
    SCOPED_TRACE(scene + " " + stage);
    ASSERT_GE(t.number(i, "frames_far"), 3);
    ASSERT_GE(t.number(i, "frames_near"), 10);
    const bool left_out =
        (scene == "outer-only" && stage == "inner") || (scene == "no-holder" && stage == "holder");
    if (left_out) {
      EXPECT_EQ(t.number(i, "ran"), 0);
    } else if (stage == "start") {
      EXPECT_GE(t.number(i, "ran"), 1);
    } else if (stage == "contact") {
      EXPECT_EQ(t.number(i, "ran_far"), 0);
      EXPECT_EQ(t.number(i, "ran_near"), t.number(i, "frames_near"));
    } else {
      EXPECT_EQ(t.number(i, "ran"), t.number(i, "frames"));
    }
  }
}

TEST_F(Scenes, instructions_fall_with_every_table_removed) {
  if (!valgrind_is_there()) {
    GTEST_SKIP() << "valgrind is not installed";
  }
  // The tick does not depend on these tables: they belong to plant, camera and vision.
  const std::set<std::string> outside{"sim.cell", "sim.cell.inner", "sim.holder",   "sim.dish",
                                      "camera",   "vision",         "vision.holder"};
  const auto scene = tools::load_scene("icsi");
  ASSERT_TRUE(scene);
  std::multiset<std::string> left;
  for (const auto& t : tools::scene_tables()) {
    if (t.kind == tools::Kind::thing && t.there(*scene)) {
      left.insert(t.name);
    }
  }
  const Table t = table("scenes_tables");
  for (const std::size_t i : rows_of(t, "icsi")) {
    const std::string& removed = t.text(i, "removed");
    SCOPED_TRACE(removed);
    bool in_tick = false;
    const std::regex plus(" \\+ ");
    for (std::sregex_token_iterator it(removed.begin(), removed.end(), plus, -1), end; it != end; ++it) {
      EXPECT_EQ(left.erase(*it), 1U);
      in_tick = in_tick || !outside.contains(*it);
    }
    EXPECT_EQ(t.text(i, "fault"), "none");  // a servo that has stopped is cheap
    if (in_tick) {
      EXPECT_LT(t.number(i, "instructions_after"), t.number(i, "instructions_before"));
    } else {
      EXPECT_NEAR(t.number(i, "instructions_after"), t.number(i, "instructions_before"), 1);
    }
  }
  EXPECT_TRUE(left.empty()) << *left.begin() << " was not taken out";
}

TEST_F(Scenes, most_instructions_of_a_tick_lie_in_steps_that_have_a_name) {
  if (!valgrind_is_there()) {
    GTEST_SKIP() << "valgrind is not installed";
  }
  const Table steps = table("scenes_steps"), scenes = table("scenes");
  for (const std::size_t scene : rows_of(scenes, "icsi")) {
    const double whole = scenes.number(scene, "instructions_per_tick");
    double named = 0;
    for (const std::size_t i : rows_of(steps, "icsi")) {
      named += steps.number(i, "instructions_per_tick");
    }
    EXPECT_GT(named, whole / 2);
    EXPECT_LT(named, whole);
  }
}

TEST_F(Scenes, every_scene_costs_the_same_without_its_tables) {
  if (!valgrind_is_there()) {
    GTEST_SKIP() << "valgrind is not installed";
  }
  const Table t = table("scenes");
  for (std::size_t i = 0; i < t.rows.size(); ++i) {
    EXPECT_EQ(t.text(i, "fault"), "none");
    // The rest depends a little on the motion of the hand.
    EXPECT_NEAR(t.number(i, "instructions_bare"), t.number(0, "instructions_bare"),
                0.02 * t.number(0, "instructions_bare"))
        << t.text(i, "scene");
    EXPECT_GT(t.number(i, "instructions_per_tick"), t.number(i, "instructions_bare"));
  }
}

// The functions that the processor called, whatever vision reports about itself.
TEST_F(Scenes, vision_calls_nothing_for_what_is_left_out) {
  report::InjectionPlan plan;
  plan.gap_m = 16e-6;
  plan.approach_m_s = plan.indentation_m_s = 200e-6;
  const report::SimulatedInjection injection = report::simulate_injection(plan);
  const fs::path frames = folder_ / "frames";
  fs::create_directories(frames);
  constexpr std::size_t kFrames = 3;  // 16, 8 and 0 um before the cell
  ASSERT_GT(injection.pixels.size(), kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    std::ofstream out(frames / (std::to_string(i) + ".pgm"), std::ios::binary);
    out << "P5 " << injection.lens.width << " " << injection.lens.height << " 255\n";
    out.write(reinterpret_cast<const char*>(injection.pixels[i].data()),
              static_cast<std::streamsize>(injection.pixels[i].size()));
  }
  // A reduced scene: without an inner membrane, and without the search for the holding pipette.
  std::string less(*tools::builtin_text("outer-only"));
  const std::string holder = "[vision.holder]";
  ASSERT_NE(less.find(holder), std::string::npos);
  less.erase(less.find(holder), holder.size());
  std::ofstream(folder_ / "less.toml") << less;

  const std::vector<std::string> names{"punctum::vision::follow", "punctum::vision::correlation_map",
                                       "punctum::vision::membrane_on_needle"};
  const auto calls = [&](const std::string& scene, const std::string& name) {
    auto n = tests::counted_calls(PUNCTUM_BIN_DIR "/punctum-vision",
                                  {"track", "--frames", frames.string(), "--scene", scene, "--out",
                                   (folder_ / (name + ".csv")).string()},
                                  words(name).string(), names);
    EXPECT_FALSE(HasFailure()) << read_all(words(name));
    return n;
  };
  auto icsi = calls("icsi", "icsi");
  auto without = calls((folder_ / "less.toml").string(), "less");
  const int all = static_cast<int>(kFrames);
  EXPECT_EQ(icsi["punctum::vision::follow"], 2 * all);  // both membranes
  EXPECT_EQ(without["punctum::vision::follow"], all);
  EXPECT_GT(icsi["punctum::vision::correlation_map"], 0);
  EXPECT_EQ(without["punctum::vision::correlation_map"], 0);
  for (auto* seen : {&icsi, &without}) {  // far from the cell not, at it yes
    EXPECT_GE((*seen)["punctum::vision::membrane_on_needle"], 1);
    EXPECT_LT((*seen)["punctum::vision::membrane_on_needle"], all);
  }
}

// The observer that reads the truth needs no picture, so none is drawn.
TEST_F(Scenes, truth_draws_no_picture) {
  ASSERT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--seconds", "1", "--set", "vision.method=truth"}),
            1)
      << said_;
  EXPECT_GT(json()["observations"], 20);
  EXPECT_TRUE(Table(fs::path(report()) / "obs.csv").rows.empty());
  ASSERT_EQ(punctum({"explain", "icsi", "--set", "vision.method=truth"}), 0);
  EXPECT_NE(said_.find("no picture is drawn"), std::string::npos);
}

}  // namespace
}  // namespace punctum::e2e
