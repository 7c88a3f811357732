// From a scene to devices, with backends that only this test has.
#include "tools/core/assembly.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::tools {
namespace {

using hal::Status;
using testing::Test;

using Log = std::vector<std::string>;

// A device that serves every interface and writes its life into a log.
class Fake final : public hal::Device,
                   public hal::HapticDevice,
                   public hal::Stage,
                   public hal::EstopChain,
                   public hal::Injector,
                   public hal::HoldingVacuum,
                   public hal::ForceSensor,
                   public hal::QueuedPositioner,
                   public hal::EnablingSwitch {
 public:
  Fake(Log& log, std::string name) : log_(log), name_(std::move(name)) {}
  ~Fake() { log_.push_back("destroy " + name_); }

  tl::expected<void, std::string> open() override {
    log_.push_back("open " + name_);
    return answer(open_error);
  }
  hal::Served served() noexcept override {
    return serves ? hal::Served{this, this, this, this, this, this, this, this} : hal::Served{};
  }
  tl::expected<void, std::string> start(std::int64_t first_tick_ns) override {
    log_.push_back("start " + name_ + " at " + std::to_string(first_tick_ns));
    return answer(start_error);
  }
  void safe_state() noexcept override { log_.push_back("safe " + name_); }
  void close() noexcept override { log_.push_back("close " + name_); }

  Status read(hal::HandState& out) noexcept override {
    out = hand;
    return Status::ok;
  }
  Status write_force(const hal::Vec3& force_N) noexcept override {
    written_N = force_N;
    return Status::ok;
  }
  Status read(hal::StageState& out) noexcept override {
    out = stage;
    return Status::ok;
  }
  Status command(const hal::StageCommand& set_point) noexcept override {
    commanded_m = set_point.tip_m;
    return Status::ok;
  }
  void quick_stop() noexcept override { ++quick_stops; }
  void enable(bool on) noexcept override { enabled = on; }
  Status read(hal::EstopState&) noexcept override { return Status::ok; }
  void heartbeat(bool) noexcept override {}
  Status read(hal::EnablingState&) noexcept override { return Status::ok; }
  void gate(bool) noexcept override {}
  Status read(hal::InjectorState&) noexcept override { return Status::ok; }
  Status read(hal::VacuumState&) noexcept override { return Status::ok; }
  Status read(hal::ForceState&) noexcept override { return Status::ok; }
  Status read(hal::PositionerState&) override { return Status::ok; }
  bool move_to(const hal::Vec3&) override { return false; }
  void stop() override {}

  std::string open_error, start_error;
  bool serves = true;
  hal::HandState hand;
  hal::StageState stage;
  hal::Vec3 written_N = hal::Vec3::Zero(), commanded_m = hal::Vec3::Zero();
  int quick_stops = 0;
  bool enabled = false;

 private:
  static tl::expected<void, std::string> answer(const std::string& error) {
    if (error.empty()) {
      return {};
    }
    return tl::unexpected(error);
  }
  Log& log_;
  std::string name_;
};

class StandingClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return t_ns; }
  void sleep_until_ns(std::int64_t until_ns) noexcept override { t_ns = until_ns; }
  std::int64_t t_ns = 0;
};

constexpr Roles kEveryRole = {Role::estop,    Role::enabling, Role::vacuum, Role::force_sensor,
                              Role::injector, Role::stage,    Role::haptic, Role::positioner};

class AssemblyTest : public Test {
 protected:
  AssemblyTest() : scene(*load_scene("icsi")), table(backends().begin(), backends().end()) {
    scene.sim->failure_count = 0;
    add("fake");
  }

  // One line each, as in the table that ships.
  void add(const std::string& name, Roles offers = kEveryRole, std::string open_error = {},
           std::string start_error = {}) {
    static std::vector<std::string> names;  // the table keeps views
    names.reserve(100);
    names.push_back(name);
    table.push_back(
        {names.back(), offers, [this, name, open_error, start_error](const Surroundings&, const Roles&) {
           auto made = std::make_unique<Fake>(log, name);
           made->open_error = open_error;
           made->start_error = start_error;
           made->serves = name != "hollow";
           fakes.push_back(made.get());
           return made;
         }});
  }
  tl::expected<std::unique_ptr<Assembly>, std::string> open() {
    return Assembly::open({scene, clock, nullptr}, table);
  }
  void all_from(const std::string& name) {
    scene.devices = {name, name, name, name, name, name, "", name, name};
  }

  Scene scene;
  StandingClock clock;
  Log log;
  std::vector<Fake*> fakes;
  std::vector<Backend> table;
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines{""};
  for (const char c : text) {
    if (c == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  return lines;
}

TEST_F(AssemblyTest, gives_a_simulated_scene_all_its_devices_from_one_plant) {
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  ASSERT_TRUE((*assembly)->start(7'000));
  sim::World* world = (*assembly)->world();
  ASSERT_NE(world, nullptr);
  const rt::Devices devices = (*assembly)->devices();
  EXPECT_EQ(&devices.hand, &world->hand());
  EXPECT_EQ(devices.stage, &world->stage());
  EXPECT_EQ(devices.estop, &world->estop());
  EXPECT_EQ(devices.injector, world->injector());
  EXPECT_EQ(devices.vacuum, world->vacuum());
  EXPECT_EQ(devices.force_sensor, world->force_sensor());
  EXPECT_NE(devices.injector, nullptr);
  EXPECT_NE(devices.vacuum, nullptr);
  hal::HandState hand;
  ASSERT_EQ(devices.hand.read(hand), Status::ok);
  EXPECT_EQ(hand.sample_ns, 7'000);
}

TEST_F(AssemblyTest, puts_a_real_handle_into_a_simulated_world) {
  scene.devices.haptic = "fake";
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  ASSERT_TRUE((*assembly)->start(0));
  ASSERT_EQ(fakes.size(), 1U);
  fakes[0]->hand.position_m = {0.01, 0.02, 0.03};
  rt::Devices devices = (*assembly)->devices();
  hal::HandState hand;
  ASSERT_EQ(devices.hand.read(hand), Status::ok);
  EXPECT_EQ(hand.position_m, fakes[0]->hand.position_m);
  ASSERT_EQ(devices.hand.write_force({1, 2, 3}), Status::ok);
  EXPECT_EQ(fakes[0]->written_N, hal::Vec3(1, 2, 3));
  sim::World* world = (*assembly)->world();
  ASSERT_NE(world, nullptr);
  world->step(1'000'000);
  EXPECT_EQ(hal::Vec3(world->snapshot().hand.position_m), hand.position_m);
  EXPECT_EQ(devices.stage, &world->stage());
}

TEST_F(AssemblyTest, puts_a_real_stage_into_a_simulated_world) {
  scene.devices.stage = "fake";
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  ASSERT_TRUE((*assembly)->start(0));
  fakes[0]->stage.tip_m = {80e-6, 1e-6, 0};
  rt::Devices devices = (*assembly)->devices();
  hal::StageState stage;
  ASSERT_EQ(devices.stage->read(stage), Status::ok);
  ASSERT_EQ(devices.stage->command({{1e-6, 0, 0}, -hal::Vec3::UnitX()}), Status::ok);
  devices.stage->quick_stop();
  devices.stage->enable(true);
  EXPECT_EQ(fakes[0]->commanded_m, hal::Vec3(1e-6, 0, 0));
  EXPECT_EQ(fakes[0]->quick_stops, 1);
  EXPECT_TRUE(fakes[0]->enabled);
  sim::World* world = (*assembly)->world();
  world->step(1'000'000);
  const hal::Vec3 tip_m = world->snapshot().stage.tip_m;
  EXPECT_LT((tip_m - (stage.tip_m - scene.sim->stage.registration_m)).norm(), 1e-15);
}

TEST_F(AssemblyTest, makes_no_world_where_nothing_is_simulated) {
  all_from("fake");
  scene.sim.reset();
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  EXPECT_EQ((*assembly)->world(), nullptr);
  ASSERT_EQ(fakes.size(), 1U);  // one device for all its roles
  const rt::Devices devices = (*assembly)->devices();
  EXPECT_EQ(&devices.hand, fakes[0]);
  EXPECT_EQ(devices.stage, fakes[0]);
  EXPECT_EQ(devices.force_sensor, fakes[0]);
  EXPECT_EQ(devices.enabling, fakes[0]);
  EXPECT_EQ((*assembly)->positioner(), fakes[0]);
}

TEST_F(AssemblyTest, does_not_count_a_camera_as_a_real_device_of_the_core) {
  EXPECT_FALSE(any_real(scene.devices));
  scene.devices.camera = "recorded";
  EXPECT_FALSE(any_real(scene.devices));
  scene.devices.positioner = "fake";
  EXPECT_TRUE(any_real(scene.devices));
}

TEST_F(AssemblyTest, makes_a_world_for_the_simulated_camera_alone) {
  all_from("fake");
  scene.devices.camera = "simulated";
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  EXPECT_NE((*assembly)->world(), nullptr);
}

TEST_F(AssemblyTest, exposes_no_pictures_when_the_camera_is_not_simulated) {
  for (const bool simulated : {true, false}) {
    scene.devices.camera = simulated ? "simulated" : "v4l2";  // a name that only the vision program knows
    const auto bench = std::make_unique<sim::Bench>();
    const auto assembly = Assembly::open({scene, clock, bench.get()}, table);
    ASSERT_TRUE(assembly) << assembly.error();
    ASSERT_TRUE((*assembly)->start(0));
    (*assembly)->world()->step(1'000'000);
    EXPECT_EQ(bench->exposed.load(), simulated ? 1U : 0U);
    EXPECT_EQ(bench->snapshots.head(), 1U);
  }
}

TEST_F(AssemblyTest, hands_out_only_what_the_scene_has) {
  scene.devices.injector.clear();
  scene.devices.vacuum.clear();
  scene.devices.force_sensor.clear();
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  const rt::Devices devices = (*assembly)->devices();
  EXPECT_EQ(devices.injector, nullptr);
  EXPECT_EQ(devices.vacuum, nullptr);
  EXPECT_EQ(devices.force_sensor, nullptr);
  EXPECT_EQ((*assembly)->positioner(), nullptr);
}

TEST_F(AssemblyTest, serves_a_simulated_positioner_beside_any_other_device) {
  all_from("fake");
  scene.devices.positioner = "simulated";
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  EXPECT_EQ((*assembly)->world(), nullptr);
  hal::QueuedPositioner* positioner = (*assembly)->positioner();
  ASSERT_NE(positioner, nullptr);
  ASSERT_TRUE(positioner->move_to({1e-3, 0, 0}));
  clock.t_ns = 60'000'000'000;
  hal::PositionerState state;
  ASSERT_EQ(positioner->read(state), Status::ok);
  EXPECT_EQ(state.sample_ns, clock.t_ns);
  EXPECT_NEAR(state.position_m.x(), 1e-3, 1e-12);
}

TEST_F(AssemblyTest, tries_every_device_and_names_each_that_fails) {
  add("dead", kEveryRole, "no answer on the bus");
  add("deaf", kEveryRole, "permission denied");
  scene.devices = {"fake", "dead", "deaf", "nonsense", "fake", "fake", "", "", ""};
  const auto assembly = open();
  ASSERT_FALSE(assembly);
  const auto lines = lines_of(assembly.error());
  ASSERT_EQ(lines.size(), 3U) << assembly.error();
  EXPECT_EQ(lines[0], "estop: deaf: permission denied");
  EXPECT_EQ(lines[1],
            "injector: device = \"nonsense\": unknown, allowed: simulated, gpiod, fake, dead, deaf");
  EXPECT_EQ(lines[2], "stage: dead: no answer on the bus");
  // What did open was not started, and is brought to its safe state and closed; what did not is only
  // destroyed.
  const Log expected = {"open deaf",    "destroy deaf", "open fake",  "open dead",
                        "destroy dead", "safe fake",    "close fake", "destroy fake"};
  EXPECT_EQ(log, expected);
}

TEST_F(AssemblyTest, starts_in_order_and_closes_in_reverse) {
  add("chain", {Role::estop});
  add("drive", {Role::stage, Role::force_sensor});
  add("handle", {Role::haptic});
  scene.devices = {"handle", "drive", "chain", "", "", "drive", "", "", ""};
  {
    const auto assembly = open();
    ASSERT_TRUE(assembly) << assembly.error();
    ASSERT_TRUE((*assembly)->start(42));
  }
  const Log expected = {"open chain",        "open drive",         "open handle", "start chain at 42",
                        "start drive at 42", "start handle at 42", "safe handle", "safe drive",
                        "safe chain",        "close handle",       "close drive", "close chain"};
  ASSERT_GE(log.size(), expected.size());
  EXPECT_EQ(Log(log.begin(), log.begin() + static_cast<std::ptrdiff_t>(expected.size())), expected);
}

TEST_F(AssemblyTest, stops_starting_at_the_first_failure_and_still_closes_all) {
  add("chain", {Role::estop});
  add("drive", {Role::stage}, "", "the drive does not leave its fault state");
  add("handle", {Role::haptic});
  scene.devices = {"handle", "drive", "chain", "", "", "", "", "", ""};
  {
    const auto assembly = open();
    ASSERT_TRUE(assembly) << assembly.error();
    const auto started = (*assembly)->start(0);
    ASSERT_FALSE(started);
    EXPECT_EQ(started.error(), "stage: drive: the drive does not leave its fault state");
  }
  EXPECT_EQ(std::count(log.begin(), log.end(), "start handle at 0"), 0);
  for (const char* const name : {"handle", "drive", "chain"}) {
    EXPECT_EQ(std::count(log.begin(), log.end(), std::string("safe ") + name), 1) << name;
    EXPECT_EQ(std::count(log.begin(), log.end(), std::string("close ") + name), 1) << name;
  }
}

TEST_F(AssemblyTest, uses_two_lines_of_one_name_as_two_devices) {
  add("twin", {Role::estop});
  add("twin", {Role::injector});
  scene.devices.estop = "twin";
  scene.devices.injector = "twin";
  const auto assembly = open();
  ASSERT_TRUE(assembly) << assembly.error();
  EXPECT_EQ(fakes.size(), 2U);
  EXPECT_NE((*assembly)->world(), nullptr);
  EXPECT_EQ((*assembly)->devices().estop, fakes[0]);
  EXPECT_EQ((*assembly)->devices().injector, fakes[1]);
}

TEST_F(AssemblyTest, refuses_a_scene_without_a_handle) {
  scene.devices.haptic.clear();
  const auto assembly = open();
  ASSERT_FALSE(assembly);
  EXPECT_EQ(assembly.error(), "haptic: the scene has none, and the core needs one");
}

TEST_F(AssemblyTest, names_what_a_device_was_asked_for_and_does_not_serve) {
  add("hollow");
  scene.devices.stage = "hollow";
  scene.devices.injector = "hollow";
  const auto assembly = open();
  ASSERT_FALSE(assembly);
  EXPECT_EQ(assembly.error(), "injector, stage: hollow: does not serve: injector, stage");
}

TEST_F(AssemblyTest, names_a_simulated_device_that_the_scene_does_not_describe) {
  scene.sim->injector.reset();
  const auto assembly = open();
  ASSERT_FALSE(assembly);
  EXPECT_NE(assembly.error().find("simulated: does not serve: injector"), std::string::npos)
      << assembly.error();
}

TEST_F(AssemblyTest, turns_an_exception_of_a_backend_into_its_line) {
  table.push_back(
      {"thrower", kEveryRole, [](const Surroundings&, const Roles&) -> std::unique_ptr<hal::Device> {
         throw std::runtime_error("the library gave up");
       }});
  scene.devices.stage = "thrower";
  const auto assembly = open();
  ASSERT_FALSE(assembly);
  EXPECT_EQ(assembly.error(), "stage: thrower: the library gave up");
}

}  // namespace
}  // namespace punctum::tools
