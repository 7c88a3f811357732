// The task: phases, cells, and when it is over.
#include <gtest/gtest.h>

#include "rt/control/task.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

struct Injection {
  explicit Injection(const ServoConfig& config) : task(config) {
    cell.membrane.known = cell.vision_fresh = true;
  }
  const TaskFacts& at_depth(double depth_m) {
    cell.depth_m = cell.inward_m = cell.contact_depth_m = depth_m;
    return task.step(readings, cell, 1e-3);
  }
  // From outside the cell to `clear`.
  void whole(bool injected) {
    (void)at_depth(1e-6);
    (void)at_depth(5e-6);
    cell.puncture_seen = true;
    (void)at_depth(15e-6);
    readings.hand.buttons = hal::kButtonInject;
    (void)at_depth(15e-6);
    readings.injected = injected;
    (void)at_depth(15e-6);
    readings.injected = false;
    readings.hand.buttons = 0;
    cell.outward_m_s = 20e-6;
    (void)at_depth(5e-6);
    cell.outward_m_s = 0;
    cell.puncture_seen = false;
    (void)at_depth(-15e-6);
  }
  Readings readings;
  CellFacts cell;
  Task task;
};

ServoConfig with_injector(int cells) {
  ServoConfig config;
  config.cells = cells;
  config.injector.emplace();
  return config;
}

TEST(Task, takes_the_line_of_insertion_at_the_puncture_and_tells_that_it_begins) {
  Injection i(with_injector(1));
  i.cell.approach_axis = hal::Vec3(-1, 0.1, 0).normalized();
  EXPECT_TRUE(i.at_depth(1e-6).contact_or_puncture_begins);
  EXPECT_FALSE(i.at_depth(5e-6).contact_or_puncture_begins);
  i.cell.puncture_seen = true;
  i.readings.stage.tip_m = hal::Vec3(7e-6, 1e-6, 0);
  const TaskFacts& task = i.at_depth(15e-6);
  EXPECT_EQ(task.phase, Phase::puncture);
  EXPECT_TRUE(task.contact_or_puncture_begins && task.inside_cell && task.punctured);
  EXPECT_EQ(task.insertion.entry_m, i.readings.stage.tip_m);
  EXPECT_EQ(task.insertion.axis, i.cell.approach_axis);
}

TEST(Task, is_done_only_if_every_cell_was_injected) {
  for (const bool injected : {true, false}) {
    Injection i(with_injector(1));
    i.whole(injected);
    EXPECT_EQ(i.task.facts().phase, Phase::clear);
    EXPECT_TRUE(i.task.ending(Requested{}));
    EXPECT_EQ(i.task.facts().done, injected);
    EXPECT_EQ(i.task.cells_done(), 1U);
  }
}

// A press counts once it has lasted: this one is down before the puncture, and counts after it.
TEST(Task, does_not_begin_the_injection_on_a_press_that_began_before_the_puncture) {
  Injection i(with_injector(1));
  (void)i.at_depth(5e-6);
  i.readings.inject_down = true;
  (void)i.at_depth(5e-6);
  i.cell.puncture_seen = true;
  EXPECT_EQ(i.at_depth(15e-6).phase, Phase::puncture);
  i.readings.hand.buttons = hal::kButtonInject;
  EXPECT_EQ(i.at_depth(15e-6).phase, Phase::puncture);
  EXPECT_NE(i.task.facts().alarms & alarm_injection_refused, 0U);
  i.readings.hand.buttons = 0;
  i.readings.inject_down = false;
  EXPECT_EQ(i.at_depth(15e-6).phase, Phase::puncture);
  i.readings.inject_down = true;
  (void)i.at_depth(15e-6);
  i.readings.hand.buttons = hal::kButtonInject;
  EXPECT_EQ(i.at_depth(15e-6).phase, Phase::injection);
}

TEST(Task, is_done_by_entering_and_leaving_where_there_is_no_injector) {
  Injection i(ServoConfig{});
  i.whole(false);
  EXPECT_TRUE(i.task.facts().done);
}

TEST(Task, begins_a_new_cell_on_one_tick_and_counts_its_injection_by_itself) {
  Injection i(with_injector(2));
  i.whole(true);
  EXPECT_FALSE(i.task.ending(Requested{}));
  i.readings.hand.buttons = hal::kButtonNextCell;
  EXPECT_TRUE(i.at_depth(-15e-6).new_cell);
  EXPECT_EQ(i.task.facts().cell, 1U);
  i.readings.hand.buttons = 0;
  EXPECT_FALSE(i.at_depth(-15e-6).new_cell);
  i.whole(false);
  EXPECT_TRUE(i.task.ending(Requested{}));
  EXPECT_FALSE(i.task.facts().done);
}

TEST(Task, ends_on_request_only_outside_the_cell_unless_it_shall_end_here) {
  Injection i(with_injector(1));
  (void)i.at_depth(5e-6);
  Requested requested;
  requested.end = true;
  EXPECT_FALSE(i.task.ending(requested));
  requested.end_here = true;
  EXPECT_TRUE(i.task.ending(requested));
  requested.end_here = false;
  (void)i.at_depth(-5e-6);
  EXPECT_EQ(i.task.facts().phase, Phase::free);
  EXPECT_TRUE(i.task.ending(requested));
}

TEST(Task, without_phases_is_always_free_and_inside_as_vision_sees_it) {
  ServoConfig config;
  config.phases.reset();
  Injection i(config);
  i.cell.puncture_seen = true;
  const TaskFacts& task = i.at_depth(15e-6);
  EXPECT_EQ(task.phase, Phase::free);
  EXPECT_TRUE(task.inside_cell && task.punctured);
}

TEST(Task, raises_the_alarm_of_a_phase_that_takes_too_long) {
  ServoConfig config;
  config.phases->timeout_s[0] = 0.01;
  Injection i(config);
  for (int k = 0; k < 9; ++k) {
    EXPECT_EQ(i.at_depth(-20e-6).alarms, 0U);
  }
  (void)i.at_depth(-20e-6);
  EXPECT_EQ(i.at_depth(-20e-6).alarms, alarm_phase_timeout);
}

TEST(Task, lets_an_injection_wait_for_the_inner_membrane_where_there_is_one) {
  for (const bool inner : {false, true}) {
    ServoConfig config = with_injector(1);
    config.inner_membrane = inner;
    Injection i(config);
    (void)i.at_depth(1e-6);
    (void)i.at_depth(5e-6);
    i.cell.puncture_seen = true;
    ASSERT_EQ(i.at_depth(15e-6).phase, Phase::puncture);
    EXPECT_EQ(i.task.facts().may_inject, !inner);
    i.readings.hand.buttons = hal::kButtonInject;
    const TaskFacts& task = i.at_depth(15e-6);
    EXPECT_EQ(task.phase, inner ? Phase::puncture : Phase::injection);
    EXPECT_EQ(task.alarms, inner ? alarm_injection_refused : 0U);
    // It gives way while the button is held: a new press is needed.
    i.cell.inner_puncture_seen = true;
    EXPECT_EQ(i.at_depth(15e-6).phase, inner ? Phase::puncture : Phase::injection);
    i.readings.hand.buttons = 0;
    EXPECT_EQ(i.at_depth(15e-6).alarms, 0U);
    i.readings.hand.buttons = hal::kButtonInject;
    EXPECT_EQ(i.at_depth(15e-6).phase, Phase::injection);
  }
}

TEST(Task, lets_nothing_be_injected_without_sight_of_the_puncture_or_with_the_tip_outside) {
  for (const int lacks : {0, 1, 2}) {
    Injection i(with_injector(1));
    (void)i.at_depth(1e-6);
    (void)i.at_depth(5e-6);
    i.cell.puncture_seen = true;
    ASSERT_TRUE(i.at_depth(15e-6).may_inject);
    i.cell.vision_fresh = lacks != 0;
    i.cell.puncture_seen = lacks != 1;
    i.cell.contact_depth_m = lacks == 2 ? -1e-6 : 15e-6;
    EXPECT_FALSE(i.task.step(i.readings, i.cell, 1e-3).may_inject) << lacks;
  }
}

}  // namespace
}  // namespace punctum::rt
