// The messages of a station: read back by protoc, a reader that shares nothing with the writer but the schema
// that is embedded.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "rt/forces/list.hpp"
#include "rt/station/station.hpp"
#include "tools/wire/messages.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// A message as protoc prints it: "path.of.field" and its text, repeated ones in their order.
using Fields = std::multimap<std::string, std::string>;

class WireTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum-wire-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    write("schema", wire_schema());
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, std::string_view bytes) const {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  template <class Message>
  [[nodiscard]] Fields read_by_protoc(const char* type, const Message& message) const {
    write("message", message.SerializeAsString());
    const std::string command = std::string("protoc --descriptor_set_in=") + (folder_ / "schema").string() +
                                " --decode=punctum.v1." + type + " < " + (folder_ / "message").string() +
                                " 2>&1";
    const auto close = [](std::FILE* f) { pclose(f); };
    const std::unique_ptr<std::FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
    Fields fields;
    std::string path;
    char line[4096];
    while (pipe != nullptr && std::fgets(line, sizeof line, pipe.get()) != nullptr) {
      std::string text = line;
      text.erase(0, text.find_first_not_of(' '));
      text.erase(text.find_last_not_of('\n') + 1);
      if (text.ends_with(" {")) {
        path += text.substr(0, text.size() - 2) + ".";
      } else if (text == "}") {
        path.resize(path.rfind('.', path.size() - 2) + 1);
      } else {
        fields.emplace(path + text.substr(0, text.find(": ")), text.substr(text.find(": ") + 2));
      }
    }
    return fields;
  }

  fs::path folder_;
};

std::string one(const Fields& fields, const std::string& name) {
  return fields.count(name) == 1 ? fields.find(name)->second
                                 : std::to_string(fields.count(name)) + " of " + name;
}
double number(const Fields& fields, const std::string& name) {
  return std::strtod(one(fields, name).c_str(), nullptr);
}

// Every double of a struct with a value of its own, from `first` on; all its other bytes as they are.
template <class Struct>
void number_doubles(Struct& s, std::size_t from, std::size_t to, double first) {
  for (std::size_t at = from; at < to; at += sizeof first, first += 1) {
    std::memcpy(reinterpret_cast<char*>(&s) + at, &first, sizeof first);
  }
}

// Every field of the struct with a value of its own, through the message and back.
TEST_F(WireTest, an_input_arrives_with_every_field_and_comes_back) {
  rt::InputSample s, back;
  auto* bytes = reinterpret_cast<unsigned char*>(&s);
  for (std::size_t i = 0; i < sizeof s; ++i) {
    bytes[i] = static_cast<unsigned char>(1 + i % 200);
  }
  s.pad = 0;
  v1::Input message;
  to_wire({}, message);
  to_wire(s, message);
  from_wire(message, back);
  EXPECT_EQ(std::memcmp(&s, &back, sizeof s), 0);
  s.hand_m[1] = 0.125;
  s.flags = rt::InputSample::injector_open;
  to_wire(s, message);
  const Fields f = read_by_protoc("Input", message);
  EXPECT_EQ(number(f, "hand_m.y"), 0.125);
  EXPECT_EQ(one(f, "flags"), "1048576");
  EXPECT_EQ(f.count("hand_wxyz"), 4U);
}

TEST_F(WireTest, an_observation_comes_back_as_it_was) {
  rt::Observation o, back;
  number_doubles(o, offsetof(rt::Observation, tip_m), offsetof(rt::Observation, total_us), 100);
  o.frame = 7;
  o.exposure_ns = -8;
  o.total_us = 9;
  for (std::uint32_t flags = 0; flags < 128; ++flags) {
    o.flags = flags;
    v1::Observation message;
    to_wire(o, message);
    from_wire(message, back);
    ASSERT_EQ(std::memcmp(&o, &back, sizeof o), 0) << flags;
  }
}

TEST_F(WireTest, a_telemetry_sample_arrives_with_every_field) {
  rt::TelemetrySample s;
  number_doubles(s, offsetof(rt::TelemetrySample, x_m), offsetof(rt::TelemetrySample, observations), 100);
  number_doubles(s, offsetof(rt::TelemetrySample, wd_sd_m), sizeof s, 200);
  s.tick = 1ULL << 60U;
  s.t_s = 1.0 / 3;
  s.phase = rt::Phase::withdrawal;
  s.fault = rt::Fault::enabling_fault;
  s.stop = rt::StopStage::stopped;
  s.estop = 5;
  s.alarms = 0x8001;
  s.buttons = 9;
  s.cell = 3;
  s.observations = 44;
  s.stale_ticks = 55;
  s.injector_open = 1;
  s.unusable = 72;
  v1::Telemetry message;
  to_wire(s, message);
  const Fields f = read_by_protoc("Telemetry", message);

  EXPECT_EQ(one(f, "tick"), "1152921504606846976");
  EXPECT_EQ(number(f, "t_s"), 1.0 / 3);
  EXPECT_EQ(one(f, "phase"), "PHASE_WITHDRAWAL");
  EXPECT_EQ(one(f, "fault"), "FAULT_ENABLING_FAULT");
  EXPECT_EQ(one(f, "stop"), "STOP_STAGE_STOPPED");
  EXPECT_EQ(one(f, "estop"), "5");
  EXPECT_EQ(one(f, "alarms"), "32769");
  EXPECT_EQ(one(f, "buttons"), "9");
  EXPECT_EQ(one(f, "cell"), "3");
  EXPECT_EQ(one(f, "observations"), "44");
  EXPECT_EQ(one(f, "stale_ticks"), "55");
  EXPECT_EQ(one(f, "injector_open"), "true");
  EXPECT_EQ(one(f, "unusable"), "72");
  const auto is = [&f](const std::string& name, const double& field) {
    EXPECT_EQ(number(f, name), field) << name;
  };
  const auto are = [&is](const std::string& name, const double (&field)[3]) {
    is(name + ".x", field[0]);
    is(name + ".y", field[1]);
    is(name + ".z", field[2]);
  };
  are("x_m", s.x_m);
  are("v_m_s", s.v_m_s);
  are("tip_m", s.tip_m);
  are("cmd_m", s.cmd_m);
  are("force_N", s.force_N);
  are("entry_m", s.entry_m);
  are("axis", s.axis);
  is("guard_N", s.guard_N);
  is("wd_m", s.wd_m);
  is("a_m", s.a_m);
  is("R_m", s.R_m);
  is("tip_force_N", s.tip_force_N);
  is("sigma_d_Pa", s.sigma_d_Pa);
  is("pressure_Pa", s.pressure_Pa);
  is("obs_age_s", s.obs_age_s);
  is("sensor_N", s.sensor_N);
  is("vacuum_Pa", s.vacuum_Pa);
  is("stored_energy_J", s.stored_energy_J);
  is("injected_energy_J", s.injected_energy_J);
  is("obs_gap_m", s.obs_gap_m);
  is("wd_sd_m", s.wd_sd_m);
  is("R_sd_m", s.R_sd_m);
  is("tip_force_sd_N", s.tip_force_sd_N);
  is("obs_a_m", s.obs_a_m);
  is("obs_a_sd_m", s.obs_a_sd_m);
  is("E_fit_Pa", s.E_fit_Pa);
  is("E_fit_sd_Pa", s.E_fit_sd_Pa);
  ASSERT_EQ(f.count("effect_N"), std::size_t{rt::effect_count});
  std::size_t i = 0;
  for (auto [at, end] = f.equal_range("effect_N"); at != end; ++at) {
    EXPECT_EQ(std::stod(at->second), s.effect_N[i++]);
  }
  ASSERT_EQ(f.count("contact_force_N.z"), 4U);
  i = 0;
  for (auto [at, end] = f.equal_range("contact_force_N.z"); at != end; ++at) {
    EXPECT_EQ(std::stod(at->second), s.contact_force_N[i++][2]);
  }
  EXPECT_EQ(f.size(), 13U + 7 * 3 + 20 + rt::effect_count + 4 * 3)
      << "every field of the message was looked at";
}

TEST_F(WireTest, a_message_that_is_used_again_holds_the_new_sample_only) {
  rt::TelemetrySample s;
  s.fault = rt::Fault::estop;
  s.x_m[1] = 2;
  v1::Telemetry again, fresh;
  to_wire(s, again);
  to_wire(rt::TelemetrySample{}, again);
  to_wire(rt::TelemetrySample{}, fresh);
  EXPECT_EQ(again.SerializeAsString(), fresh.SerializeAsString());

  rt::Event fault{.kind = rt::Event::fault, .what = 3};
  rt::Event ended{.kind = rt::Event::ended, .what = 1};
  v1::Event event, alone;
  to_wire(fault, event);
  to_wire(ended, event);
  to_wire(ended, alone);
  EXPECT_EQ(event.SerializeAsString(), alone.SerializeAsString());
}

TEST_F(WireTest, an_observation_arrives_with_every_field) {
  rt::Observation o;
  number_doubles(o, offsetof(rt::Observation, tip_m), offsetof(rt::Observation, total_us), 10);
  o.frame = 7;
  o.exposure_ns = -3;
  o.total_us = 9;
  const char* flags[] = {"holder_ok", "tip_ok",    "outer_ok",       "inner_ok",
                         "contact",   "punctured", "inner_punctured"};
  for (std::size_t bit = 0; bit < std::size(flags); ++bit) {
    o.flags = 1U << bit;
    v1::Observation message;
    to_wire(o, message);
    const Fields f = read_by_protoc("Observation", message);
    for (std::size_t other = 0; other < std::size(flags); ++other) {
      EXPECT_EQ(f.count(flags[other]), other == bit ? 1U : 0U) << flags[other];
    }
  }
  v1::Observation message;
  to_wire(o, message);
  const Fields f = read_by_protoc("Observation", message);
  const auto is = [&f](const std::string& name, const double& field) {
    EXPECT_EQ(number(f, name), field) << name;
  };
  const auto are = [&is](const std::string& name, const double (&field)[3]) {
    is(name + ".x", field[0]);
    is(name + ".y", field[1]);
    is(name + ".z", field[2]);
  };
  EXPECT_EQ(one(f, "frame"), "7");
  EXPECT_EQ(one(f, "exposure_ns"), "-3");
  EXPECT_EQ(one(f, "total_us"), "9");
  are("tip_m", o.tip_m);
  are("axis", o.axis);
  are("holder_m", o.holder_m);
  are("centre_m", o.centre_m);
  are("entry_m", o.entry_m);
  is("holder_score", o.holder_score);
  is("R_m", o.R_m);
  is("R_inner_m", o.R_inner_m);
  is("gap_m", o.gap_m);
  is("wd_m", o.wd_m);
  is("a_m", o.a_m);
  is("membrane_velocity_m_s", o.membrane_velocity_m_s);
  is("noise_m", o.noise_m);
  is("wd_sd_m", o.wd_sd_m);
  is("a_sd_m", o.a_sd_m);
  is("R_sd_m", o.R_sd_m);
  ASSERT_EQ(f.count("contact_point_m.x"), 2U);
  EXPECT_EQ(std::stod(f.lower_bound("contact_point_m.x")->second), o.contact_point_m[0][0]);
  EXPECT_EQ(f.size(), 4U + 5 * 3 + 11 + 2 * 3);
}

TEST_F(WireTest, a_surface_arrives_with_its_net_and_not_where_it_was_not_reconstructed) {
  rt::CellSurface c;
  c.frame = 12;
  c.exposure_ns = 34;
  number_doubles(c, offsetof(rt::CellSurface, outer), sizeof c, 1);
  c.flags = rt::CellSurface::inner_ok;
  v1::CellSurface message;
  to_wire(c, message);
  const Fields f = read_by_protoc("CellSurface", message);
  EXPECT_EQ(one(f, "frame"), "12");
  EXPECT_EQ(one(f, "exposure_ns"), "34");
  ASSERT_EQ(f.count("inner.row.depth_m"), 32U);
  EXPECT_EQ(f.count("outer.row.depth_m"), 0U);
  std::size_t i = 0;
  for (auto [at, end] = f.equal_range("inner.row.depth_m"); at != end; ++at) {
    EXPECT_EQ(std::stod(at->second), c.inner.control_m[i++][4]);
  }
  i = 0;
  for (auto [at, end] = f.equal_range("inner.row.middle_x_m"); at != end; ++at) {
    EXPECT_EQ(std::stod(at->second), c.inner.control_m[i++][0]);
  }
  EXPECT_EQ(f.size(), 2U + 32 * 5);
}

TEST_F(WireTest, an_event_says_in_words_what_it_is_about) {
  const auto told = [this](rt::Event::Kind kind, std::uint64_t what) {
    v1::Event message;
    to_wire(
        rt::Event{.tick = 5, .t_s = 0.5, .kind = kind, .what = what, .value = 2.5, .writer = 1, .target = 4},
        message);
    return read_by_protoc("Event", message);
  };
  EXPECT_EQ(one(told(rt::Event::fault, 1), "fault"), "FAULT_ESTOP");
  EXPECT_EQ(one(told(rt::Event::fault_cleared, 9), "fault"), "FAULT_TIP_FORCE");
  EXPECT_EQ(one(told(rt::Event::alarm_on, 0), "alarm"), "ALARM_VISION_STALE") << "the first bit is told, too";
  EXPECT_EQ(one(told(rt::Event::alarm_off, 15), "alarm"), "ALARM_FORBIDDEN_REGION");
  EXPECT_EQ(one(told(rt::Event::phase, 2), "phase"), "PHASE_INDENTATION");
  EXPECT_EQ(one(told(rt::Event::command, 7), "command"), "COMMAND_KIND_DEPTH_LIMIT");
  EXPECT_EQ(one(told(rt::Event::command_refused, 1), "command"), "COMMAND_KIND_STOP");
  EXPECT_EQ(one(told(rt::Event::ended, 1), "end"), "RUN_END_DONE");
  EXPECT_EQ(one(told(rt::Event::none, 77), "unknown"), "77");
  const Fields f = told(rt::Event::command, 3);
  EXPECT_EQ(one(f, "tick"), "5");
  EXPECT_EQ(one(f, "t_s"), "0.5");
  EXPECT_EQ(one(f, "kind"), "KIND_COMMAND");
  EXPECT_EQ(one(f, "value"), "2.5");
  EXPECT_EQ(one(f, "target"), "4");
  EXPECT_EQ(one(f, "writer"), "1");
}

TEST_F(WireTest, what_the_core_says_of_itself_arrives) {
  const auto status = std::make_unique<rt::CoreStatus>();
  std::uint64_t next = 1001;
  for (rt::Word* w : {&status->pid, &status->start_ns, &status->period_ns, &status->ticks, &status->missed,
                      &status->missed_in_window, &status->worst_lateness_ns, &status->faults_latched,
                      &status->commands_refused, &status->minor_faults, &status->major_faults}) {
    w->store(next++);
  }
  status->started.store(1);
  status->phase.store(3);
  status->fault.store(2);
  status->run_end.store(4);
  status->wake.add(2500);
  status->wake.add(3'000'000);
  status->tick.add(700);
  status->slots[0].name.set("servo");
  status->slots[0].divisor.store(4);
  status->slots[0].runs.store(5);
  status->slots[0].execution.add(1500);
  status->slot_count.store(99);  // more than there can be
  status->rights[0].name.set("memory \xff lock");
  status->rights[0].remedy.set("ulimit");
  status->rights[0].required = 1;
  status->rights_count.store(99);  // likewise
  v1::Status message;
  to_wire(*status, message);
  EXPECT_EQ(message.slot_size(), static_cast<int>(rt::kMaxSlots));
  EXPECT_EQ(message.right_size(), static_cast<int>(rt::kMaxRights));
  const Fields f = read_by_protoc("Status", message);
  next = 1001;
  for (const char* name :
       {"pid", "start_ns", "period_ns", "ticks", "missed", "missed_in_window", "worst_lateness_ns",
        "faults_latched", "commands_refused", "minor_faults", "major_faults"}) {
    EXPECT_EQ(one(f, name), std::to_string(next++)) << name;
  }
  EXPECT_EQ(one(f, "started"), "true");
  EXPECT_EQ(one(f, "phase"), "PHASE_PUNCTURE");
  EXPECT_EQ(one(f, "fault"), "FAULT_ESTOP_DISCREPANCY");
  EXPECT_EQ(one(f, "run_end"), "RUN_END_TIME_LIMIT");
  EXPECT_EQ(f.count("wake.bin"), 3U) << "up to the last that is not empty";
  EXPECT_EQ(one(f, "wake.overflow"), "1");
  EXPECT_EQ(one(f, "wake.max_us"), "3000");
  EXPECT_EQ(one(f, "tick.bin"), "1");
  EXPECT_EQ(one(f, "slot.name"), "\"servo\"");
  EXPECT_EQ(one(f, "slot.divisor"), "4");
  EXPECT_EQ(one(f, "slot.runs"), "5");
  EXPECT_EQ(f.count("slot.execution.bin"), 2U);
  EXPECT_EQ(f.find("right.name")->second, "\"memory ? lock\"") << "a string of a message is UTF-8";
  EXPECT_EQ(one(f, "right.remedy"), "\"ulimit\"");
  EXPECT_EQ(one(f, "right.required"), "true");
}

TEST_F(WireTest, what_was_told_comes_back_bit_for_bit) {
  rt::TelemetrySample s;
  number_doubles(s, offsetof(rt::TelemetrySample, x_m), offsetof(rt::TelemetrySample, observations), 1.0 / 3);
  number_doubles(s, offsetof(rt::TelemetrySample, wd_sd_m), sizeof s, 200);
  std::fill(s.effect_N + rt::effect_count, s.effect_N + rt::kMaxEffects, 0.0);  // none of the scene's
  s.tick = 12;
  s.t_s = 0.1;
  s.phase = rt::Phase::clear;
  s.fault = rt::Fault::estop;
  s.stop = rt::StopStage::stopping;
  s.estop = 7;
  s.alarms = 3;
  s.buttons = 5;
  s.cell = 6;
  s.observations = 8;
  s.stale_ticks = 9;
  s.injector_open = 1;
  s.unusable = 200;
  v1::Telemetry message;
  to_wire(s, message);
  rt::TelemetrySample back;
  ASSERT_TRUE(from_wire(message, back));
  EXPECT_EQ(std::memcmp(&back, &s, sizeof s), 0);

  rt::CellSurface c, c_back;
  c.frame = 3;
  c.exposure_ns = 4;
  c.flags = rt::CellSurface::outer_ok | rt::CellSurface::inner_ok;
  number_doubles(c, offsetof(rt::CellSurface, outer), sizeof c, 1);
  v1::CellSurface surface;
  to_wire(c, surface);
  from_wire(surface, c_back);
  EXPECT_EQ(std::memcmp(&c_back, &c, sizeof c), 0);

  for (std::uint64_t kind = 0; kind < rt::kEventKinds; ++kind) {
    const rt::Event e{.tick = 1, .t_s = 2, .kind = kind, .what = 3, .value = 4, .writer = 5, .target = 6};
    v1::Event event;
    to_wire(e, event);
    rt::Event e_back;
    from_wire(event, e_back);
    EXPECT_EQ(std::memcmp(&e_back, &e, sizeof e), 0) << kind;
  }
}

TEST_F(WireTest, a_sample_that_names_what_this_program_does_not_know_does_not_come_back) {
  rt::TelemetrySample back;
  for (const int number : {7, 256, -1}) {
    v1::Telemetry message;
    message.set_phase(static_cast<v1::Phase>(number));
    EXPECT_FALSE(from_wire(message, back)) << number;
    message.set_phase(v1::PHASE_FREE);
    message.set_stop(static_cast<v1::StopStage>(number));
    EXPECT_FALSE(from_wire(message, back)) << number;
  }
  v1::Telemetry later;
  for (int i = 0; i < 100; ++i) {
    later.add_effect_n(i);
    later.add_contact_force_n()->set_x(i);
  }
  EXPECT_TRUE(from_wire(later, back)) << "more effects than there were";
}

TEST_F(WireTest, what_stands_in_a_segment_by_mistake_goes_through_as_a_number) {
  rt::TelemetrySample s;
  s.phase = static_cast<rt::Phase>(200);
  s.wd_m = std::numeric_limits<double>::quiet_NaN();
  v1::Telemetry message;
  to_wire(s, message);
  const Fields f = read_by_protoc("Telemetry", message);
  EXPECT_EQ(one(f, "phase"), "200");
  EXPECT_EQ(one(f, "wd_m"), "nan");
}

// The words of rt/station in capitals, as station.proto writes them.
template <class Name>
void same_words(int count, int in_schema, const std::string& prefix, const Name& ours,
                const std::string& (*theirs)(int)) {
  EXPECT_EQ(count, in_schema) << prefix;
  for (int i = 0; i < count; ++i) {
    std::string word = prefix + ours(i);
    for (char& c : word) {
      c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    EXPECT_EQ(theirs(i), word);
  }
}

TEST_F(WireTest, enumerators_have_the_numbers_and_words_of_the_station) {
  same_words(
      rt::kPhases, v1::Phase_ARRAYSIZE, "phase_", [](int i) { return rt::name(static_cast<rt::Phase>(i)); },
      [](int i) -> const std::string& { return v1::Phase_Name(i); });
  same_words(
      rt::kFaults, v1::Fault_ARRAYSIZE, "fault_", [](int i) { return rt::name(static_cast<rt::Fault>(i)); },
      [](int i) -> const std::string& { return v1::Fault_Name(i); });
  same_words(
      static_cast<int>(std::size(rt::kAlarmNames)), v1::Alarm_ARRAYSIZE, "alarm_",
      [](int i) { return rt::kAlarmNames[i]; },
      [](int i) -> const std::string& { return v1::Alarm_Name(i); });
  same_words(
      rt::kCommandKinds, v1::CommandKind_ARRAYSIZE, "command_kind_",
      [](int i) { return rt::name(static_cast<rt::Command::Kind>(i)); },
      [](int i) -> const std::string& { return v1::CommandKind_Name(i); });
  same_words(
      rt::kEventKinds, v1::Event::Kind_ARRAYSIZE, "kind_",
      [](int i) { return rt::name(static_cast<rt::Event::Kind>(i)); },
      [](int i) -> const std::string& { return v1::Event::Kind_Name(i); });
  // The words of a run's end are sentences in rt/station.
  EXPECT_EQ(rt::kRunEnds, v1::RunEnd_ARRAYSIZE);
  EXPECT_EQ(static_cast<int>(rt::RunEnd::cell_lost), v1::RUN_END_CELL_LOST);
  EXPECT_EQ(static_cast<int>(rt::RunEnd::fault), v1::RUN_END_FAULT);
  EXPECT_EQ(static_cast<int>(rt::RunEnd::core_died), v1::RUN_END_CORE_DIED);
  EXPECT_EQ(static_cast<int>(rt::RunEnd::underdosed), v1::RUN_END_UNDERDOSED);
  EXPECT_EQ(static_cast<int>(rt::RunEnd::blind), v1::RUN_END_BLIND);
  EXPECT_EQ(static_cast<int>(rt::StopStage::stopped), v1::STOP_STAGE_STOPPED);
}

}  // namespace
}  // namespace punctum::tools
