// How a run ended: every word of the report, and the exit code that goes with it.
#include "tools/punctum/judge.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tools/shared/exit_codes.hpp"

namespace punctum::tools {
namespace {

using rt::RunEnd;

class JudgeTest : public testing::Test {
 protected:
  JudgeTest() {
    const auto scene = load_scene("icsi");
    measures = std::make_unique<Measures>(*scene);
  }
  void core_says(rt::Phase phase, RunEnd end, rt::Fault fault = rt::Fault::none) const {
    core->phase.store(static_cast<std::uint64_t>(phase));
    core->run_end.store(static_cast<std::uint64_t>(end));
    core->fault.store(static_cast<std::uint64_t>(fault));
    core->task_finished.store(end == RunEnd::done ? 1 : 0);
  }
  [[nodiscard]] RunEnd judged() const { return judge(facts, *core, *measures); }

  RunFacts facts{.core_exited = true, .has_task = true};
  std::unique_ptr<rt::CoreStatus> core = std::make_unique<rt::CoreStatus>();
  std::unique_ptr<Measures> measures;
};

TEST_F(JudgeTest, a_task_that_the_core_finished_is_done) {
  core_says(rt::Phase::clear, RunEnd::done);
  EXPECT_EQ(judged(), RunEnd::done);
}

TEST_F(JudgeTest, a_cell_that_was_lost_is_not_done_whatever_the_core_says) {
  core_says(rt::Phase::clear, RunEnd::done);
  measures->cells_lost = 1;
  EXPECT_EQ(judged(), RunEnd::cell_lost);
}

TEST_F(JudgeTest, an_injection_that_delivered_nothing_is_not_done_whatever_the_core_says) {
  core_says(rt::Phase::clear, RunEnd::done);
  measures->cells_without_injection = 1;
  EXPECT_EQ(judged(), RunEnd::not_injected);
}

TEST_F(JudgeTest, a_cell_that_got_less_than_was_asked_is_not_done_whatever_the_core_says) {
  core_says(rt::Phase::clear, RunEnd::done);
  measures->cells_underdosed = 1;
  EXPECT_EQ(judged(), RunEnd::underdosed);
}

TEST_F(JudgeTest, what_a_cell_got_is_not_judged_by_samples_of_which_some_were_lost) {
  core_says(rt::Phase::clear, RunEnd::done);
  facts.samples_lost = true;
  measures->cells_without_injection = measures->cells_underdosed = 1;
  EXPECT_EQ(judged(), RunEnd::done);
  measures->cells_lost = 1;
  EXPECT_EQ(judged(), RunEnd::cell_lost);
}

TEST_F(JudgeTest, a_limit_before_the_injection_is_a_time_limit_although_the_cell_is_clear_and_got_nothing) {
  core_says(rt::Phase::clear, RunEnd::time_limit);
  measures->cells_without_injection = 1;
  EXPECT_EQ(judged(), RunEnd::time_limit);
}

TEST_F(JudgeTest, a_task_that_ended_well_after_a_fault_that_was_reset_says_so) {
  core_says(rt::Phase::clear, RunEnd::done);
  core->faults_latched.store(1U << static_cast<unsigned>(rt::Fault::estop));
  EXPECT_EQ(judged(), RunEnd::after_fault);
  facts.has_task = false;
  EXPECT_EQ(judged(), RunEnd::after_fault);
  core->faults_latched.store(1U << static_cast<unsigned>(rt::Fault::command_stop));
  EXPECT_EQ(judged(), RunEnd::done) << "a commanded stop is no fault";
}

TEST_F(JudgeTest, a_run_without_a_task_that_saw_nothing_most_of_its_time_was_without_vision) {
  core_says(rt::Phase::free, RunEnd::done);
  facts.has_task = false;
  facts.has_vision = true;
  measures->ticks = 6200;
  measures->blind_ticks = 5900;
  EXPECT_EQ(judged(), RunEnd::blind);
  facts.stop_was_asked = true;
  EXPECT_EQ(judged(), RunEnd::blind) << "also when somebody ended it";
  measures->blind_ticks = 300;
  EXPECT_EQ(judged(), RunEnd::done);
  facts.found_nothing = true;
  EXPECT_EQ(judged(), RunEnd::blind) << "pictures came, but nothing was in them";
  facts.has_vision = false;
  measures->blind_ticks = 6200;
  EXPECT_EQ(judged(), RunEnd::done) << "nobody was to look";
}

TEST_F(JudgeTest, a_core_that_was_killed_died_even_after_a_fault) {
  core_says(rt::Phase::indentation, RunEnd::running, rt::Fault::estop);
  facts.core_exited = false;
  EXPECT_EQ(judged(), RunEnd::core_died);
}

TEST_F(JudgeTest, words_that_stand_for_nothing_make_no_run_done) {
  core_says(rt::Phase::clear, RunEnd::done);
  core->fault.store(256);  // cut to a byte it would be none
  EXPECT_EQ(judged(), RunEnd::fault);
  core_says(rt::Phase::clear, RunEnd::done);
  core->run_end.store(256 + static_cast<std::uint64_t>(RunEnd::done));
  EXPECT_EQ(judged(), RunEnd::core_died);
  core_says(rt::Phase::clear, RunEnd::stopped);
  core->phase.store(256 + static_cast<std::uint64_t>(rt::Phase::clear));
  EXPECT_EQ(judged(), RunEnd::time_limit);
}

TEST_F(JudgeTest, a_core_that_ended_without_a_word_died_whatever_the_scene_asks) {
  core_says(rt::Phase::free, RunEnd::running);
  EXPECT_EQ(judged(), RunEnd::core_died);
  facts.has_task = false;
  EXPECT_EQ(judged(), RunEnd::core_died);
  facts.stop_was_asked = true;
  EXPECT_NE(judged(), RunEnd::core_died);
}

TEST_F(JudgeTest, a_latched_fault_is_a_fault_unless_it_is_a_commanded_stop) {
  core_says(rt::Phase::indentation, RunEnd::fault, rt::Fault::hand_lost);
  EXPECT_EQ(judged(), RunEnd::fault);
  core_says(rt::Phase::indentation, RunEnd::stopped, rt::Fault::command_stop);
  EXPECT_EQ(judged(), RunEnd::stopped);
}

TEST_F(JudgeTest, the_limit_before_the_end_of_the_task_is_a_time_limit) {
  core_says(rt::Phase::indentation, RunEnd::time_limit);
  EXPECT_EQ(judged(), RunEnd::time_limit);
  core_says(rt::Phase::clear, RunEnd::time_limit);
  EXPECT_EQ(judged(), RunEnd::time_limit);
}

TEST_F(JudgeTest, a_task_that_was_ended_clear_of_the_cell_without_injection_is_not_injected) {
  core_says(rt::Phase::clear, RunEnd::stopped);
  EXPECT_EQ(judged(), RunEnd::not_injected);
}

TEST_F(JudgeTest, without_a_task_a_stop_outside_a_cell_is_a_good_end_and_within_one_is_not) {
  facts.has_task = false;
  facts.stop_was_asked = true;
  core_says(rt::Phase::free, RunEnd::stopped, rt::Fault::command_stop);
  EXPECT_EQ(judged(), RunEnd::done);
  facts.vision_over = true;
  EXPECT_EQ(judged(), RunEnd::stopped);
  facts.vision_over = false;
  core_says(rt::Phase::indentation, RunEnd::stopped, rt::Fault::command_stop);
  EXPECT_EQ(judged(), RunEnd::stopped);
}

TEST(RunEndTest, every_end_has_the_word_of_the_report_and_its_exit_code) {
  const struct {
    RunEnd end;
    std::string word;
    int code;
  } table[] = {{RunEnd::done, "done", 0},
               {RunEnd::cell_lost, "cell lost", 1},
               {RunEnd::not_injected, "not injected", 1},
               {RunEnd::time_limit, "time limit", 1},
               {RunEnd::stopped, "stopped", 1},
               {RunEnd::fault, "fault", 3},
               {RunEnd::core_died, "core died", 3},
               {RunEnd::invalid_setup, "invalid set-up", 2},
               {RunEnd::underdosed, "injected in part", 1},
               {RunEnd::after_fault, "done after a fault", 3},
               {RunEnd::blind, "without vision", 1}};
  for (const auto& row : table) {
    EXPECT_EQ(rt::name(row.end), row.word);
    EXPECT_EQ(exit_code(row.end), row.code) << row.word;
  }
  EXPECT_NE(exit_code(RunEnd::running), 0);
}

}  // namespace
}  // namespace punctum::tools
