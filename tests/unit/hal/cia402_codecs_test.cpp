// CANopen messages byte by byte, the power state machine, bus load and calibration. The bytes are written by
// hand from CiA 301 and CiA 402, or are those of the examples that the comments name.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <map>
#include <vector>

#include "hal/cia402/bus_load.hpp"
#include "hal/cia402/calibration.hpp"
#include "hal/cia402/canopen.hpp"
#include "hal/cia402/configuration.hpp"
#include "hal/cia402/power_state.hpp"

namespace punctum::cia402 {
namespace {

using Bytes = std::array<std::uint8_t, 8>;

void expect_frame(const CanFrame& frame, int id, int size, const Bytes& data) {
  EXPECT_EQ(frame.id, id);
  EXPECT_EQ(frame.size, size);
  EXPECT_EQ(frame.data, data);
}

TEST(CanOpen, network_management_is_a_command_and_a_node_on_identifier_zero) {
  expect_frame(nmt(Nmt::start, 5), 0x000, 2, {0x01, 0x05});
  expect_frame(nmt(Nmt::stop, 5), 0x000, 2, {0x02, 0x05});
  expect_frame(nmt(Nmt::pre_operational, 127), 0x000, 2, {0x80, 0x7F});
  expect_frame(nmt(Nmt::reset_node, 1), 0x000, 2, {0x81, 0x01});
}

TEST(CanOpen, sync_is_an_empty_frame_and_a_heartbeat_is_the_state_of_its_node) {
  expect_frame(sync(), 0x080, 0, {});
  expect_frame(heartbeat(0x7F, NodeState::operational), 0x77F, 1, {0x05});
  EXPECT_EQ(node_state({0x703, 1, {0x00}}), NodeState::boot_up);
  EXPECT_EQ(node_state({0x703, 1, {0x7F}}), NodeState::pre_operational);
  EXPECT_EQ(node_state({0x703, 1, {0x85}}), NodeState::operational);  // toggle bit of node guarding
  EXPECT_FALSE(node_state({0x703, 2, {0x05}}).has_value());
}

TEST(CanOpen, identifiers_are_those_of_the_predefined_connection_set) {
  EXPECT_EQ(emergency_id(3), 0x083);
  EXPECT_EQ(tpdo1_id(3), 0x183);
  EXPECT_EQ(rpdo1_id(3), 0x203);
  EXPECT_EQ(sdo_answer_id(3), 0x583);
  EXPECT_EQ(sdo_request_id(3), 0x603);
  EXPECT_EQ(heartbeat_id(3), 0x703);
}

// The command specifiers 2F, 2B, 27 and 23 for one to four bytes; 1017 := 1000 ms as in CiA's own examples.
TEST(CanOpen, an_expedited_download_says_its_length_in_the_command) {
  expect_frame(sdo_download(2, {0x6060, 0}, 8, 1), 0x602, 8, {0x2F, 0x60, 0x60, 0x00, 0x08, 0, 0, 0});
  expect_frame(sdo_download(2, {0x1017, 0}, 1000, 2), 0x602, 8, {0x2B, 0x17, 0x10, 0x00, 0xE8, 0x03, 0, 0});
  expect_frame(sdo_download(2, {0x2000, 1}, 0x030201, 3), 0x602, 8, {0x27, 0x00, 0x20, 0x01, 1, 2, 3, 0});
  expect_frame(sdo_download(2, {0x1400, 1}, 0x80000202, 4), 0x602, 8,
               {0x23, 0x00, 0x14, 0x01, 0x02, 0x02, 0x00, 0x80});
  expect_frame(sdo_upload(2, {0x1018, 2}), 0x602, 8, {0x40, 0x18, 0x10, 0x02, 0, 0, 0, 0});
}

TEST(CanOpen, an_answer_is_a_confirmation_a_number_or_an_abort) {
  const auto done = sdo_answer({0x582, 8, {0x60, 0x17, 0x10, 0x00}});
  ASSERT_TRUE(done);
  EXPECT_EQ(done->is, SdoAnswer::Is::downloaded);
  EXPECT_EQ(done->object, (ObjectId{0x1017, 0}));

  const struct {
    std::uint8_t command;
    std::size_t bytes;
    std::uint32_t value;
  } uploads[] = {
      {0x4F, 1, 0x01}, {0x4B, 2, 0x0201}, {0x47, 3, 0x030201}, {0x43, 4, 0x04030201}, {0x42, 0, 0x04030201}};
  for (const auto& upload : uploads) {
    const auto answer = sdo_answer({0x582, 8, {upload.command, 0x41, 0x60, 0x00, 1, 2, 3, 4}});
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->is, SdoAnswer::Is::uploaded);
    EXPECT_EQ(answer->bytes, upload.bytes);
    EXPECT_EQ(answer->value, upload.value);
  }
  const auto aborted = sdo_answer({0x582, 8, {0x80, 0x00, 0x16, 0x09, 0x11, 0x00, 0x09, 0x06}});
  ASSERT_TRUE(aborted);
  EXPECT_EQ(aborted->is, SdoAnswer::Is::aborted);
  EXPECT_EQ(aborted->value, 0x06090011U);
  EXPECT_STREQ(abort_text(aborted->value), "there is no such sub-index");
}

TEST(CanOpen, what_is_no_answer_to_an_expedited_request_is_not_taken_for_one) {
  EXPECT_FALSE(sdo_answer({0x582, 7, {0x60, 0x17, 0x10, 0x00}}).has_value());        // too short
  EXPECT_FALSE(sdo_answer({0x582, 8, {0x41, 0x08, 0x10, 0x00, 0x0D}}).has_value());  // segmented upload
  EXPECT_FALSE(sdo_answer({0x582, 8, {0x20, 0x08, 0x10, 0x00, 0x0D}}).has_value());  // segment confirmed
  EXPECT_FALSE(sdo_answer({0x582, 8, {0xFF, 0xFF, 0xFF, 0xFF}}).has_value());
}

TEST(CanOpen, an_emergency_is_a_code_and_a_register) {
  const auto says = emergency({0x083, 8, {0x11, 0x86, 0x21, 1, 2, 3, 4, 5}});
  ASSERT_TRUE(says);
  EXPECT_EQ(says->code, 0x8611);
  EXPECT_EQ(says->error_register, 0x21);
  EXPECT_STREQ(emergency_text(0x8611), "following error");
  EXPECT_STREQ(emergency_text(0x2310), "current");
  EXPECT_STREQ(emergency_text(0xFF01), "an error of the vendor");
  EXPECT_FALSE(emergency({0x083, 4, {0x11, 0x86}}).has_value());
}

// CiA 402, table of the statusword: x stands for any bit. All 65536 words, by the patterns as printed there.
TEST(PowerState, every_statusword_is_what_the_standard_s_patterns_say) {
  const struct {
    const char* pattern;
    PowerState state;
  } table[] = {
      {"xxxxxxxxx0xx0000", PowerState::not_ready},
      {"xxxxxxxxx1xx0000", PowerState::switch_on_disabled},
      {"xxxxxxxxx01x0001", PowerState::ready_to_switch_on},
      {"xxxxxxxxx01x0011", PowerState::switched_on},
      {"xxxxxxxxx01x0111", PowerState::operation_enabled},
      {"xxxxxxxxx00x0111", PowerState::quick_stop_active},
      {"xxxxxxxxx0xx1111", PowerState::fault_reaction},
      {"xxxxxxxxx0xx1000", PowerState::fault},
  };
  for (unsigned word = 0; word <= 0xFFFFU; ++word) {
    PowerState expected = PowerState::unknown;
    for (const auto& row : table) {
      bool fits = true;
      for (unsigned bit = 0; bit < 16; ++bit) {
        const char wanted = row.pattern[15 - bit];
        fits = fits && (wanted == 'x' || (wanted == '1') == ((word >> bit & 1U) != 0));
      }
      expected = fits ? row.state : expected;
    }
    ASSERT_EQ(power_state(static_cast<std::uint16_t>(word)), expected) << std::hex << word;
  }
}

TEST(PowerState, the_way_to_operation_is_shutdown_switch_on_enable) {
  EXPECT_EQ(step_to_operation(PowerState::switch_on_disabled), 0x06);
  EXPECT_EQ(step_to_operation(PowerState::ready_to_switch_on), 0x07);
  EXPECT_EQ(step_to_operation(PowerState::switched_on), 0x0F);
  EXPECT_EQ(step_to_operation(PowerState::operation_enabled), 0x0F);
  for (const PowerState other : {PowerState::not_ready, PowerState::quick_stop_active,
                                 PowerState::fault_reaction, PowerState::fault, PowerState::unknown}) {
    EXPECT_EQ(step_to_operation(other), 0x00) << name_of(other);
  }
}

TEST(PowerState, a_drive_that_says_nothing_known_may_have_power) {
  EXPECT_TRUE(powered(PowerState::unknown));
  EXPECT_TRUE(powered(PowerState::quick_stop_active));
  EXPECT_TRUE(powered(PowerState::fault_reaction));
  EXPECT_TRUE(powered(PowerState::switched_on));
  EXPECT_FALSE(powered(PowerState::ready_to_switch_on));
  EXPECT_FALSE(powered(PowerState::fault));
}

// The longest frames of 11-bit identifiers: 55, 65, 115 and 135 bits for 0, 1, 6 and 8 bytes (Davis et al.
// 2007, "Controller Area Network schedulability analysis": 55 + 10 n).
TEST(BusLoad, frames_are_as_long_as_stuffing_makes_them) {
  for (int bytes = 0; bytes <= 8; ++bytes) {
    EXPECT_EQ(longest_frame_bits(bytes), 55 + 10 * bytes);
  }
}

TEST(BusLoad, three_axes_at_a_kilohertz_take_745_of_1000_microseconds) {
  const BusLoad load = bus_load(3, false, 1e-6, 1e-3, 0.02);
  EXPECT_NEAR(load.cyclic_s, 745e-6, 1e-12);
  EXPECT_NEAR(load.spare_s, 200e-6, 1e-12);
  EXPECT_NEAR(load.part, 0.745 + 4 * 65e-6 / 0.02, 1e-12);
  EXPECT_TRUE(load.fits(1e-3));
  EXPECT_FALSE(bus_load(4, false, 1e-6, 1e-3, 0.02).fits(1e-3));  // 975 + 200
  EXPECT_TRUE(bus_load(4, false, 1e-6, 2e-3, 0.02).fits(2e-3));
  EXPECT_FALSE(bus_load(3, true, 1e-6, 1e-3, 0.02).fits(1e-3));  // 745 + 95 + 200
  EXPECT_FALSE(bus_load(3, false, 2e-6, 1e-3, 0.02).fits(1e-3));
}

TEST(BusLoad, the_interpolation_period_is_a_byte_and_a_power_of_ten) {
  const auto is = [](double s, int mantissa, int exponent) {
    const InterpolationPeriod p = interpolation_period(s);
    return p.mantissa == mantissa && (mantissa == 0 || p.exponent == exponent);
  };
  EXPECT_TRUE(is(1e-3, 1, -3));
  EXPECT_TRUE(is(2e-3, 2, -3));
  EXPECT_TRUE(is(0.5e-3, 5, -4));
  EXPECT_TRUE(is(0.25e-3, 25, -5));
  EXPECT_TRUE(is(0.125e-3, 125, -6));
  EXPECT_TRUE(is(3 * 0.125e-3, 0, 0));  // 375 us: no byte holds 375, and 37.5 is no whole number
}

CanStageParams stage_of(const std::vector<hal::Vec3>& counts_m) {
  CanStageParams params;
  params.axis_count = static_cast<int>(counts_m.size());
  for (std::size_t i = 0; i < counts_m.size(); ++i) {
    params.axes[i].count_m = counts_m[i];
  }
  return params;
}

TEST(Calibration, of_oblique_axes_with_different_counts_is_the_inverse_matrix) {
  CanStageParams params = stage_of({{40e-9, 0, 0}, {10e-9, -50e-9, 0}, {-70e-9, 0, 100e-9}});
  params.tip_m = {1e-6, 2e-6, 3e-6};
  const Calibration calibration(params);
  Counts counts = Counts::Zero();
  counts.head<3>() << 1000, -200, 30;
  const hal::Vec3 tip_m = calibration.tip_m(counts);
  EXPECT_NEAR(tip_m.x(), 1e-6 + 40e-6 - 2e-6 - 2.1e-6, 1e-15);
  EXPECT_NEAR(tip_m.y(), 2e-6 + 10e-6, 1e-15);
  EXPECT_NEAR(tip_m.z(), 3e-6 + 3e-6, 1e-15);
  Eigen::Matrix3d c;
  c << 40e-9, 10e-9, -70e-9, 0, -50e-9, 0, 0, 0, 100e-9;
  const Eigen::Vector3d motion_m(3e-6, -5e-6, 7e-6);
  EXPECT_LT((calibration.counts(motion_m).head<3>() - c.inverse() * motion_m).norm(), 1e-9);
}

TEST(Calibration, of_a_fourth_axis_moves_the_tip_where_it_is_sent) {
  const Calibration calibration(stage_of({{40e-9, 0, 0}, {0, 40e-9, 0}, {0, 0, 40e-9}, {-30e-9, 0, 30e-9}}));
  const hal::Vec3 motion_m(3e-6, -5e-6, 7e-6);
  EXPECT_LT((calibration.motion_m(calibration.counts(motion_m)) - motion_m).norm(), 1e-15);
}

// What the axes can make of a motion, by hand: along (0.6, 0.8, 0) its part of length 0.6 x + 0.8 y; in the
// plane of (1, 0, 0) and (0.6, 0.8, 0) all but z, y / 0.8 along the second axis and the rest along the first.
TEST(Calibration, of_one_or_two_axes_makes_the_part_of_a_motion_that_they_can_make) {
  const hal::Vec3 motion_m(3e-6, -4e-6, 7e-6);
  const Calibration one(stage_of({{30e-9, 40e-9, 0}}));
  EXPECT_NEAR(one.counts(motion_m)[0], (0.6 * 3 - 0.8 * 4) * 1e-6 / 50e-9, 1e-9);
  EXPECT_LT((one.motion_m(one.counts(motion_m)) - -1.4e-6 * hal::Vec3(0.6, 0.8, 0)).norm(), 1e-18);
  const Calibration two(stage_of({{20e-9, 0, 0}, {60e-9, 80e-9, 0}}));
  EXPECT_NEAR(two.counts(motion_m)[1], -4e-6 / 80e-9, 1e-9);
  EXPECT_NEAR(two.counts(motion_m)[0], (3e-6 + 3e-6) / 20e-9, 1e-9);
  EXPECT_EQ(two.counts(motion_m).tail<4>(), (Eigen::Vector4d::Zero()));
}

// Every motion of the axes is made exactly; and with more than three of them, what they do in vain together
// is no part of it: the ways are the shortest (Lagrange: the ways are the axes' shares of one vector).
TEST(Calibration, of_one_to_six_axes_makes_a_motion_of_its_axes_exactly_and_on_the_shortest_ways) {
  const std::array<hal::Vec3, kMaxAxes> all = {{{40e-9, 5e-9, 0},
                                                {-10e-9, 90e-9, 8e-9},
                                                {3e-9, 0, -700e-9},
                                                {20e-9, -20e-9, 30e-9},
                                                {0, 1e-6, 2e-6},
                                                {-5e-9, 4e-9, 6e-9}}};
  for (std::size_t n = 1; n <= all.size(); ++n) {
    const Calibration calibration(stage_of({all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n)}));
    Counts counts = Counts::Zero();
    hal::Vec3 motion_m = hal::Vec3::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      counts[static_cast<Eigen::Index>(i)] = 100.0 - 37.0 * static_cast<double>(i);
      motion_m += counts[static_cast<Eigen::Index>(i)] * all[i];
    }
    const Counts back = calibration.counts(motion_m);
    EXPECT_LT((calibration.motion_m(back) - motion_m).norm(), 1e-12 * motion_m.norm()) << n;
    if (n <= 3) {
      EXPECT_LT((back - counts).norm(), 1e-9 * counts.norm()) << n;
      continue;
    }
    // way_i = direction_i . v of one vector v, which the first three axes tell.
    Eigen::Matrix3d directions;
    Eigen::Vector3d ways;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const hal::Vec3& axis = all[static_cast<std::size_t>(i)];
      directions.row(i) = axis.normalized();
      ways[i] = back[i] * axis.norm();
    }
    const Eigen::Vector3d v = directions.inverse() * ways;
    for (std::size_t i = 3; i < n; ++i) {
      EXPECT_NEAR(back[static_cast<Eigen::Index>(i)] * all[i].norm(), all[i].normalized().dot(v), 1e-17) << n;
    }
  }
}

TEST(Calibration, the_reach_of_one_or_two_axes_is_what_they_make_of_a_motion) {
  EXPECT_FALSE(reach_of_axes(stage_of({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}})));
  const auto along_x = reach_of_axes(stage_of({{-40e-9, 0, 0}}));
  EXPECT_EQ(*along_x, hal::Mat3(hal::Vec3(1, 0, 0).asDiagonal()));
  for (const auto& axes : {std::vector<hal::Vec3>{{30e-9, 40e-9, 5e-9}},
                           std::vector<hal::Vec3>{{20e-9, 0, 1e-9}, {60e-9, 80e-9, -300e-9}}}) {
    const Calibration calibration(stage_of(axes));
    const hal::Mat3 reach = reach_of_axes(stage_of(axes)).value();
    for (const hal::Vec3& motion_m : {hal::Vec3(1, 0, 0), hal::Vec3(0, 1, 0), hal::Vec3(-0.3, 0.2, 1)}) {
      EXPECT_LT((reach * motion_m - calibration.motion_m(calibration.counts(motion_m))).norm(), 1e-13);
    }
  }
}

// Two axes that enclose an angle t: condition sqrt((1 + cos t) / (1 - cos t)).
TEST(Calibration, condition_says_how_oblique_axes_are_and_not_how_small_their_counts) {
  EXPECT_NEAR(condition_of_axes(stage_of({{1e-9, 0, 0}, {0, 5e-6, 0}, {0, 0, -1e-7}})), 1, 1e-12);
  const double t = 0.1;
  const CanStageParams narrow =
      stage_of({{1e-9, 0, 0}, {1e-6 * std::cos(t), 1e-6 * std::sin(t), 0}, {0, 0, 1e-7}});
  EXPECT_NEAR(condition_of_axes(narrow), std::sqrt((1 + std::cos(t)) / (1 - std::cos(t))), 1e-6);
  EXPECT_GT(condition_of_axes(stage_of({{1, 0, 0}, {0, 1, 0}, {1, 1, 0}})), 1e9);
  EXPECT_NEAR(condition_of_axes(stage_of({{0, 1e-7, 1e-7}})), 1, 1e-12);
  const CanStageParams two = stage_of({{1e-9, 0, 0}, {1e-6 * std::cos(t), 1e-6 * std::sin(t), 0}});
  EXPECT_NEAR(condition_of_axes(two), std::sqrt((1 + std::cos(t)) / (1 - std::cos(t))), 1e-6);
  EXPECT_GT(condition_of_axes(stage_of({{1, 0, 0}, {-2, 0, 0}})), 1e9);
  EXPECT_GT(condition_of_axes(stage_of({})), 1e9);
  EXPECT_FALSE(condition_of_axes(stage_of({{1, 0, 0}, {0, 1, 0}, {0, 0, 0}})) < 1e9);
}

// CiA 301: a PDO is off (bit 31) and empty (sub-index 0 is 0) while its contents change.
TEST(Configuration, a_pdo_is_off_and_empty_while_it_is_mapped) {
  CanStageParams params;
  AxisParams axis;
  axis.node = 5;
  std::vector<std::array<std::uint32_t, 4>> seen;  // index, sub, bytes, value
  for (const auto& object : configuration(params, axis, 1e-3)) {
    const int index = object.id.index;
    if (index == 0x1400 || index == 0x1600 || index == 0x1800 || index == 0x1A00) {
      seen.push_back(
          {object.id.index, object.id.sub, static_cast<std::uint32_t>(object.bytes), object.value});
    }
  }
  const std::vector<std::array<std::uint32_t, 4>> expected = {
      {0x1400, 1, 4, 0x80000205}, {0x1600, 0, 1, 0},          {0x1600, 1, 4, 0x60400010},
      {0x1600, 2, 4, 0x607A0020}, {0x1600, 0, 1, 2},          {0x1400, 2, 1, 1},
      {0x1400, 1, 4, 0x00000205}, {0x1800, 1, 4, 0xC0000185}, {0x1A00, 0, 1, 0},
      {0x1A00, 1, 4, 0x60410010}, {0x1A00, 2, 4, 0x60640020}, {0x1A00, 0, 1, 2},
      {0x1800, 2, 1, 1},          {0x1800, 1, 4, 0x40000185}};
  EXPECT_EQ(seen, expected);
}

TEST(Configuration, says_what_the_scene_says_in_the_drive_s_objects) {
  CanStageParams params;
  params.master_node = 0x7E;
  params.heartbeat_s = 0.05;
  params.heartbeat_timeout_s = 0.2;
  AxisParams axis;
  axis.node = 5;
  axis.min_counts = -3;
  axis.max_counts = 70000;
  std::map<std::pair<int, int>, std::uint32_t> last;
  for (const auto& object : configuration(params, axis, 2e-3)) {
    last[{object.id.index, object.id.sub}] = object.value;
  }
  EXPECT_EQ((last[{0x1006, 0}]), 2000U);
  EXPECT_EQ((last[{0x1016, 1}]), 0x007E00C8U);
  EXPECT_EQ((last[{0x1017, 0}]), 50U);
  EXPECT_EQ((last[{0x6007, 0}]), 3U);
  EXPECT_EQ((last[{0x605A, 0}]), 6U);
  EXPECT_EQ((last[{0x607D, 1}]), 0xFFFFFFFDU);
  EXPECT_EQ((last[{0x607D, 2}]), 70000U);
  EXPECT_EQ((last[{0x60C2, 1}]), 2U);
  EXPECT_EQ((last[{0x60C2, 2}]), 0xFDU);  // -3
  EXPECT_EQ((last[{0x6060, 0}]), 8U);
  EXPECT_EQ(last.count({0x6098, 0}), 0U);  // nothing homes unasked
}

}  // namespace
}  // namespace punctum::cia402
