// Recorded inputs through the servo again: the same bits from a whole run with commands, a pressed emergency
// stop and observations; and every change of what was recorded is found at its tick.
#include "tools/record/replay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/sim/truth.hpp"
#include "hal/sim/world.hpp"
#include "rt/control/servo.hpp"
#include "tests/support/full_disk.hpp"
#include "tools/core/input_tape.hpp"
#include "tools/record/mcap_writer.hpp"
#include "tools/record/recording_reader.hpp"
#include "tools/record/station_recorder.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/truth_observer.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kTicks = 2600;
constexpr std::uint64_t kCommand = 400, kRefused = 410;

// One run of the simulated station in this process, recorded as punctum-record does it.
void record_run(const std::string& path) {
  auto scene = load_scene("icsi", {"scene.clock=\"virtual\"", "sim.estop_press=[{at_s=1.5, for_s=0.2}]",
                                   "sim.operator.reaction_s=0.05", "sim.operator.approach_s=0.2",
                                   "vision.method=\"truth\"", "sim.operator.indentation_speed_um_s=400"});
  ASSERT_TRUE(scene) << scene.error();
  constexpr std::int64_t kPeriod_ns = 1'000'000, kFrame_ns = 40 * kPeriod_ns, kLatency_ns = 7 * kPeriod_ns;
  sim::World world(*scene->sim, nullptr, kPeriod_ns);
  const auto station = std::make_unique<rt::LocalStation>();
  const auto inputs = std::make_unique<rt::InputSegment>();
  station->core.status.start_ns.store(kPeriod_ns);
  const auto tape = std::make_unique<InputTape>(rt::Devices{.hand = world.hand(),
                                                            .stage = &world.stage(),
                                                            .estop = &world.estop(),
                                                            .injector = world.injector(),
                                                            .vacuum = world.vacuum(),
                                                            .force_sensor = world.force_sensor()},
                                                &station->observation.slot, false, inputs->ring);
  rt::Station seen = station->station;
  seen.observation = tape->observation();
  const auto servo = std::make_unique<rt::Servo>(scene->servo, tape->devices(), seen);
  auto recorder = StationRecorder::create(
      path, {"icsi-1", to_toml(*scene), station->core, &station->observation, nullptr, inputs.get()}, *scene);
  ASSERT_TRUE(recorder) << recorder.error();
  std::deque<std::pair<std::int64_t, rt::Observation>> on_its_way;
  std::optional<sim::Truth> before;
  for (std::uint64_t tick = 0; tick < kTicks; ++tick) {
    const std::int64_t now_ns = kPeriod_ns + static_cast<std::int64_t>(tick) * kPeriod_ns;
    world.step(now_ns);
    if (tick % (kFrame_ns / kPeriod_ns) == 0) {
      const sim::Truth truth = sim::truth_of(*scene->sim, world.snapshot());
      on_its_way.emplace_back(now_ns + kLatency_ns, observe_truth(truth, tick, now_ns, before));
      before = truth;
    }
    if (!on_its_way.empty() && on_its_way.front().first <= now_ns) {
      station->observation.slot.push(on_its_way.front().second);
      on_its_way.pop_front();
    }
    if (tick == kCommand) {
      ASSERT_TRUE(station->console.queue.try_push({.kind = rt::Command::force_scale, .value = 0.5}));
      ASSERT_TRUE(station->parent.queue.try_push({.kind = rt::Command::force_scale, .value = 0.75}));
    }
    if (tick == kRefused) {
      ASSERT_TRUE(station->parent.queue.try_push({.kind = rt::Command::depth_limit, .value = 1e-6}));
    }
    std::uint32_t asked = 0;
    if (tick >= kTicks - 200) {
      servo->request_end();
      asked = rt::InputSample::end;
    }
    const rt::TickInfo info{tick, now_ns, now_ns + 1000, 1e-3, 0};
    tape->begin(info, asked);
    servo->tick(info);
    tape->end();
    if (tick % 97 == 0) {  // more ticks at once than it takes between two looks at the observations
      (*recorder)->drain();
    }
  }
  (*recorder)->finish();
  ASSERT_TRUE((*recorder)->lost_nothing());
}

// Writes the messages of a recording again; those of one kind as `change` leaves them, or not at all.
template <class Message>
struct Copy {
  const std::function<bool(Message&)>& change;
  mcap::Writer& file;
  std::uint16_t channels[kStreams] = {};
  std::uint64_t log_ns = 0;

  void operator()(const v1::Scene& m) { pass(Stream::scene, m); }
  void operator()(const v1::Telemetry& m) { pass(Stream::telemetry, m); }
  void operator()(const v1::Observation& m) { pass(Stream::observation, m); }
  void operator()(const v1::Event& m) { pass(Stream::event, m); }
  void operator()(const v1::Input& m) { pass(Stream::input, m); }

 private:
  template <class Any>
  void pass(Stream s, Any m) {
    if constexpr (std::is_same_v<Any, Message>) {
      if (!change(m)) {
        return;
      }
    }
    file.message(channels[static_cast<std::size_t>(s)], log_ns, log_ns, m.SerializeAsString());
  }
};

class ReplayTest : public FullDisk {
 protected:
  static void SetUpTestSuite() {
    std::string name = (fs::temp_directory_path() / "punctum-replay-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    recorded_in_ = name;
    record_run(run());
  }
  static void TearDownTestSuite() { fs::remove_all(recorded_in_); }
  static std::string run() { return (recorded_in_ / "run.mcap").string(); }

  // The run's messages again, each as `change` leaves it; false leaves it out.
  template <class Message>
  std::string changed(const std::function<bool(Message&)>& change, const std::string& of = run()) {
    std::string path = (folder_ / (std::to_string(++copies_) + ".mcap")).string();
    auto file = mcap::Writer::create(path, "punctum test");
    EXPECT_TRUE(file) << file.error();
    Copy<Message> copy{.change = change, .file = *file};
    for (std::size_t i = 0; i < kStreams; ++i) {
      copy.channels[i] = file->add_channel(file->add_schema(kTopics[i].schema, "protobuf", wire_schema()),
                                           kTopics[i].name, "protobuf");
    }
    auto reader = RecordingReader::open(of);
    EXPECT_TRUE(reader) << reader.error();
    EXPECT_EQ(reader->read_all(copy), "");
    file->finish();
    return path;
  }
  // With one number of the input of a tick changed.
  Replayed with_input(std::uint64_t tick, const std::function<void(v1::Input&)>& change) {
    const auto replayed = replay_inputs(changed<v1::Input>([&](v1::Input& m) {
      if (m.tick() == tick) {
        change(m);
      }
      return true;
    }));
    EXPECT_TRUE(replayed) << replayed.error();
    return replayed.value_or(Replayed{});
  }
  static std::uint64_t tick_of(const Replayed& r) { return r.differs ? r.differs->tick : kTicks; }

  inline static fs::path recorded_in_;
  int copies_ = 0;
};

TEST_F(ReplayTest, a_run_with_commands_a_stop_and_observations_is_bit_identical) {
  const auto replayed = replay_inputs(run());
  ASSERT_TRUE(replayed) << replayed.error();
  EXPECT_FALSE(replayed->differs) << replayed->differs->tick << ' ' << replayed->differs->field;
  EXPECT_EQ(replayed->ends, "");
  EXPECT_EQ(replayed->ticks, kTicks);
  EXPECT_EQ(replayed->not_told, 0U);
  EXPECT_DOUBLE_EQ(replayed->end_s, 1e-3 * (kTicks - 1));
  // The run is one that shows something.
  struct {
    std::uint32_t faults = 0, refused = 0, commands = 0;
    std::uint64_t observations = 0;
    double deepest_m = 0, tallest_N = 0;
    void operator()(const v1::Event& e) {
      faults += e.kind() == v1::Event::KIND_FAULT ? 1 : 0;
      commands += e.kind() == v1::Event::KIND_COMMAND ? 1 : 0;
      refused += e.kind() == v1::Event::KIND_COMMAND_REFUSED ? 1 : 0;
    }
    void operator()(const v1::Telemetry& t) {
      observations = t.observations();
      deepest_m = std::max(deepest_m, t.wd_m());
      tallest_N = std::max(tallest_N, std::abs(t.force_n().x()));
    }
  } saw;
  ASSERT_EQ(RecordingReader::open(run())->read_all(saw), "");
  EXPECT_GE(saw.faults, 1U);
  EXPECT_EQ(saw.commands, 2U);
  EXPECT_EQ(saw.refused, 1U);
  EXPECT_GT(saw.observations, 60U);
  EXPECT_GT(saw.tallest_N, 0.01);
}

TEST_F(ReplayTest, a_last_bit_of_the_telemetry_is_found_at_its_tick_with_its_name_and_both_values) {
  double was = 0;
  const auto replayed = replay_inputs(changed<v1::Telemetry>([&](v1::Telemetry& m) {
    if (m.tick() == 700) {
      was = m.force_n().y();
      m.mutable_force_n()->set_y(std::nextafter(was, 1.0));
      m.set_wd_sd_m(std::nextafter(m.wd_sd_m(), 1.0));
    }
    return true;
  }));
  ASSERT_TRUE(replayed) << replayed.error();
  ASSERT_TRUE(replayed->differs);
  EXPECT_EQ(replayed->differs->tick, 700U);
  EXPECT_DOUBLE_EQ(replayed->differs->t_s, 0.7);
  EXPECT_EQ(replayed->differs->field, "force_N[1]");
  EXPECT_EQ(std::stod(replayed->differs->recorded), std::nextafter(was, 1.0));
  EXPECT_EQ(std::stod(replayed->differs->now), was);
  EXPECT_EQ(replayed->differs->more, 1U);
  EXPECT_EQ(replayed->ticks, 701U);
}

// An input that the servo acts on at once shows at its tick, whatever it is.
TEST_F(ReplayTest, every_kind_of_input_counts) {
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.mutable_hand_m()->set_z(m.hand_m().z() + 1e-9); })),
            300U);
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.mutable_tip_m()->set_x(m.tip_m().x() + 1e-12); })),
            300U);
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.set_buttons(m.buttons() ^ hal::kButtonClutch); })),
            300U);
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.set_release_ns(m.release_ns() + 1); })), 300U);
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.set_missed_in_window(1000); })), 300U);
  const auto answers = [this](rt::InputSample::Answer which, hal::Status status) {
    return tick_of(with_input(
        300, [&](v1::Input& m) { m.set_answers(static_cast<std::uint32_t>(status) << (2U * which)); }));
  };
  EXPECT_EQ(answers(rt::InputSample::hand_read, hal::Status::disconnected), 300U);
  EXPECT_EQ(answers(rt::InputSample::stage_read, hal::Status::fault), 300U);
  EXPECT_EQ(answers(rt::InputSample::estop_read, hal::Status::disconnected), 300U);
  EXPECT_EQ(answers(rt::InputSample::vacuum_read, hal::Status::no_data), 300U);
  EXPECT_EQ(answers(rt::InputSample::injector_read, hal::Status::disconnected), 300U);
  EXPECT_EQ(answers(rt::InputSample::hand_write, hal::Status::disconnected), 301U) << "a fault of the next";
  const auto flag = [this](rt::InputSample::Flag which) {
    return tick_of(with_input(300, [&](v1::Input& m) { m.set_flags(m.flags() ^ which); }));
  };
  EXPECT_EQ(flag(rt::InputSample::estop_a_closed), 300U);
  EXPECT_EQ(flag(rt::InputSample::estop_b_closed), 300U);
  EXPECT_EQ(flag(rt::InputSample::estop_pulse), 300U);
  EXPECT_EQ(flag(rt::InputSample::injector_open), 300U);
  EXPECT_EQ(flag(rt::InputSample::stop), 300U);
  EXPECT_LT(flag(rt::InputSample::end), 400U);
  EXPECT_EQ(flag(rt::InputSample::stage_enabled), 300U);
  EXPECT_EQ(tick_of(with_input(0, [](v1::Input& m) { m.set_flags(m.flags() | rt::InputSample::degraded); })),
            0U);
  EXPECT_LT(
      tick_of(with_input(0, [](v1::Input& m) { m.set_flags(m.flags() & ~rt::InputSample::has_vacuum); })),
      kTicks);
  // Device times: a sample that comes from the future is not taken.
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.set_hand_ns(m.hand_ns() + 1'000'000'000); })), 300U);
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.set_stage_ns(m.stage_ns() + 1'000'000'000); })),
            300U);
  EXPECT_EQ(tick_of(with_input(300, [](v1::Input& m) { m.set_estop_ns(m.estop_ns() + 1'000'000'000); })),
            300U);
}

TEST_F(ReplayTest, a_command_or_an_observation_that_was_another_is_found) {
  const auto command = replay_inputs(changed<v1::Event>([](v1::Event& e) {
    if (e.kind() == v1::Event::KIND_COMMAND) {
      e.set_value(e.value() * 0.5);
    }
    return true;
  }));
  ASSERT_TRUE(command && command->differs);
  EXPECT_GT(command->differs->tick, kCommand);
  std::uint64_t seen = 0;
  const auto observation = replay_inputs(changed<v1::Observation>([&](v1::Observation& o) {
    if (o.number() == 20) {
      seen = o.frame();
      o.set_gap_m(o.gap_m() + 1e-9);
    }
    return true;
  }));
  ASSERT_TRUE(observation && observation->differs);
  EXPECT_EQ(observation->differs->tick, seen + 7) << "when the core took it";
}

// A build before or after this one, which has the same effects in another order.
TEST_F(ReplayTest, effects_are_known_by_their_names_in_whatever_order_they_were_recorded) {
  const auto backwards = [](v1::Telemetry& t) {
    std::reverse(t.mutable_effect_n()->begin(), t.mutable_effect_n()->end());
    return true;
  };
  const std::string unnamed = changed<v1::Telemetry>(backwards);
  const auto wrong = replay_inputs(unnamed);
  ASSERT_TRUE(wrong && wrong->differs) << "the run has effects that differ";
  EXPECT_EQ(wrong->differs->field.rfind("effect_N", 0), 0U) << wrong->differs->field;
  const auto right = replay_inputs(changed<v1::Scene>(
      [](v1::Scene& s) {
        std::reverse(s.mutable_effect()->begin(), s.mutable_effect()->end());
        return true;
      },
      unnamed));
  ASSERT_TRUE(right) << right.error();
  EXPECT_FALSE(right->differs) << right->differs->tick << ' ' << right->differs->field;
  EXPECT_EQ(right->ticks, kTicks);
}

TEST_F(ReplayTest, a_commands_target_is_the_effect_of_that_name) {
  struct {
    std::vector<std::uint32_t> targets;
    void operator()(const v1::Event& e) {
      if (e.kind() == v1::Event::KIND_COMMAND) {
        targets.push_back(e.target());
      }
    }
  } saw;
  const std::string gains = changed<v1::Event>([](v1::Event& e) {
    if (e.kind() == v1::Event::KIND_COMMAND) {
      e.set_command(v1::COMMAND_KIND_EFFECT_GAIN);
      e.set_target(rt::effect_membrane);
    }
    return true;
  });
  const std::string path = changed<v1::Scene>(
      [](v1::Scene& s) {
        std::reverse(s.mutable_effect()->begin(), s.mutable_effect()->end());
        return true;
      },
      gains);
  ASSERT_EQ(RecordingReader::open(path)->read_all(saw), "");
  ASSERT_FALSE(saw.targets.empty());
  EXPECT_EQ(saw.targets[0], rt::effect_count - 1U) << "the first of the recording is the last of this build";
}

TEST_F(ReplayTest, an_effect_that_this_build_does_not_have_is_named_and_the_recording_refused) {
  const std::string path = changed<v1::Scene>([](v1::Scene& s) {
    s.set_effect(1, "magnet");
    return true;
  });
  const auto replayed = replay_inputs(path);
  ASSERT_FALSE(replayed);
  EXPECT_EQ(replayed.error().rfind(path + ": its force effect \"magnet\" is none that this build knows", 0),
            0U)
      << replayed.error();
}

TEST_F(ReplayTest, another_scene_is_another_servo) {
  const auto replayed = replay_inputs(changed<v1::Scene>([](v1::Scene& s) {
    auto scene = parse_scene(s.toml(), "the scene");
    scene->servo.limits.hand_force_N *= 0.01;
    s.set_toml(to_toml(*scene));
    return true;
  }));
  ASSERT_TRUE(replayed) << replayed.error();
  ASSERT_TRUE(replayed->differs);
  EXPECT_EQ(replayed->differs->field, "alarms") << "the force is limited";
  EXPECT_GT(replayed->differs->more, 0U) << "and smaller";
}

TEST_F(ReplayTest, what_is_missing_ends_it_there_and_is_told) {
  const auto inputs = replay_inputs(changed<v1::Input>([](v1::Input& m) { return m.tick() != 900; }));
  ASSERT_TRUE(inputs) << inputs.error();
  EXPECT_EQ(inputs->ends, "the inputs of the ticks before tick 901 are not in the recording");
  EXPECT_EQ(inputs->ticks, 900U);
  EXPECT_FALSE(inputs->differs);
  const auto observations =
      replay_inputs(changed<v1::Observation>([](v1::Observation& o) { return o.number() != 20; }));
  ASSERT_TRUE(observations) << observations.error();
  EXPECT_EQ(observations->ends, "observation 20, which tick 767 took, is not in the recording");
  EXPECT_FALSE(observations->differs);
  const auto telemetry =
      replay_inputs(changed<v1::Telemetry>([](v1::Telemetry& m) { return m.tick() % 2 == 0; }));
  ASSERT_TRUE(telemetry) << telemetry.error();
  EXPECT_FALSE(telemetry->differs);
  EXPECT_EQ(telemetry->not_told, kTicks / 2);
}

TEST_F(ReplayTest, ticks_that_cannot_be_compared_are_counted_to_the_end_of_the_recording) {
  const auto times = replay_inputs(changed<v1::Telemetry>([](v1::Telemetry& m) {
    m.set_t_s(m.tick() < 1000 ? m.t_s() : std::numeric_limits<double>::quiet_NaN());
    return true;
  }));
  ASSERT_TRUE(times) << times.error();
  EXPECT_EQ(times->ticks, 1000U);
  EXPECT_EQ(times->not_known, kTicks - 1000);
  EXPECT_EQ(times->not_told + times->not_given, 0U);
  const auto phases = replay_inputs(changed<v1::Telemetry>([](v1::Telemetry& m) {
    if (m.tick() >= 300 && m.tick() < 310) {
      m.set_phase(static_cast<v1::Phase>(99));
    }
    return true;
  }));
  ASSERT_TRUE(phases) << phases.error();
  EXPECT_EQ(phases->ticks, kTicks - 10);
  EXPECT_EQ(phases->not_known, 10U);
  const auto told = replay_inputs(changed<v1::Telemetry>([](v1::Telemetry& m) { return m.tick() < 1000; }));
  ASSERT_TRUE(told) << told.error();
  EXPECT_EQ(told->not_told, kTicks - 1000);
  const auto given = replay_inputs(changed<v1::Input>([](v1::Input& m) { return m.tick() < 1000; }));
  ASSERT_TRUE(given) << given.error();
  EXPECT_EQ(given->not_given, kTicks - 1000);
}

TEST_F(ReplayTest, a_recording_without_a_beginning_is_refused_in_one_line) {
  const std::string late = changed<v1::Input>([](v1::Input& m) { return m.tick() >= 900; });
  EXPECT_EQ(replay_inputs(late).error(),
            late + ": its inputs begin at tick 900, and what the servo was before is not known");
  const std::string none = changed<v1::Input>([](v1::Input&) { return false; });
  EXPECT_NE(replay_inputs(none).error().find(": holds no inputs of ticks; "), std::string::npos);
  const std::string scene = changed<v1::Scene>([](v1::Scene&) { return false; });
  EXPECT_EQ(replay_inputs(scene).error(), scene + ": holds no scene before its ticks");
  const std::string bad = changed<v1::Scene>([](v1::Scene& s) {
    s.set_toml("[scene]\nclok = 1\n");
    return true;
  });
  EXPECT_NE(replay_inputs(bad).error().find("clok"), std::string::npos) << replay_inputs(bad).error();
  EXPECT_FALSE(replay_inputs("/dev/null"));
}

// A program that is killed leaves the file at any byte.
TEST_F(ReplayTest, a_recording_that_is_cut_anywhere_is_identical_up_to_there) {
  const std::string cut = (folder_ / "cut.mcap").string();
  const std::uintmax_t size = fs::file_size(run());
  std::uint64_t last = 0;
  for (std::uintmax_t i = 1; i <= 60; ++i) {
    fs::copy_file(run(), cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, size * i / 61);
    const auto replayed = replay_inputs(cut);
    if (!replayed) {
      EXPECT_LT(i, 15U) << replayed.error() << ": before its first chunk";
      continue;
    }
    EXPECT_FALSE(replayed->differs) << i;
    EXPECT_NE(replayed->ends, "") << i;
    EXPECT_GE(replayed->ticks, last) << i;
    last = replayed->ticks;
    struct {
      std::uint64_t ticks = 0;
      void operator()(const v1::Telemetry&) { ++ticks; }
    } kept;
    EXPECT_NE(RecordingReader::open(cut)->read_all(kept), "");
    EXPECT_EQ(replayed->ticks, kept.ticks) << "no tick without its input";
  }
  EXPECT_GE(last, kTicks - 600);
}

}  // namespace
}  // namespace punctum::tools
