// The servo: everything one tick of the control core does.
//
// Built once at start from a scene's ServoConfig and the devices that exist; statically allocated (about
// 0.5 MB, mostly the pose history). tick() is real-time safe: no heap, lock, system call, exception.
// One thread calls it.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/control/following.hpp"
#include "rt/control/hand_watch.hpp"
#include "rt/control/limits.hpp"
#include "rt/control/local_membrane_model.hpp"
#include "rt/control/master_to_stage.hpp"
#include "rt/control/passivity.hpp"
#include "rt/control/phases.hpp"
#include "rt/control/safety_latch.hpp"
#include "rt/forces/cone_guide.hpp"
#include "rt/forces/damping.hpp"
#include "rt/forces/friction.hpp"
#include "rt/forces/membrane.hpp"
#include "rt/forces/repulsive_region.hpp"
#include "rt/forces/velocity.hpp"
#include "rt/forces/vibration.hpp"
#include "rt/forces/withdrawal_axis.hpp"
#include "rt/station/observation.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt {

struct Station;

struct TickInfo {
  std::uint64_t tick = 0;              // of the absolute grid, from 0; gaps are missed releases
  std::int64_t release_ns = 0;         // of this tick on the grid
  std::int64_t start_ns = 0;           // when it really began; devices are read at this time
  double period_s = 0;                 // really elapsed since the previous tick
  std::uint64_t missed_in_window = 0;  // missed releases in the last ServoConfig::overrun_window_s
};

// What exists. The hand is always there; a null pointer is a thing the scene does not have.
struct Devices {
  hal::HapticDevice& hand;
  hal::Stage* stage = nullptr;
  hal::EstopChain* estop = nullptr;
  hal::Injector* injector = nullptr;
  hal::HoldingVacuum* vacuum = nullptr;
  hal::ForceSensor* force_sensor = nullptr;
};

enum class Outcome : std::uint8_t {
  running,
  done,   // all cells injected and clear, hand force at zero, stage at rest
  ended,  // command `end`: the same rest, the task not finished
  fault,  // latched and stopped, and nothing can clear it: a stop was commanded, or there is no reset button
};

class Servo {
 public:
  // t = 0 of telemetry is the first tick's release. `degraded` raises the alarm "without real-time rights".
  Servo(const ServoConfig& config, const Devices& devices, Station& station, bool degraded = false) noexcept;
  Servo(const Servo&) = delete;
  Servo& operator=(const Servo&) = delete;

  void tick(const TickInfo& now) noexcept;

  // A stop (latched fault command_stop) or an orderly end, as by the command queue; for signals of the
  // process and its time limit. An end that finds the needle in the cell waits until it is drawn back, the
  // only way that is open then; request_end_here waits no longer: the force fades, the needle stays.
  void request_stop() noexcept { stop_requested_ = true; }
  void request_end() noexcept { end_requested_ = true; }
  void request_end_here() noexcept { end_here_requested_ = true; }

  // The run is over and everything is at rest: leave the loop. A latched fault that a reset could still
  // clear does not finish the run.
  [[nodiscard]] bool finished() const noexcept { return outcome() != Outcome::running; }
  [[nodiscard]] Outcome outcome() const noexcept;
  [[nodiscard]] Fault fault() const noexcept { return latch_.cause(); }
  [[nodiscard]] StopStage stop_stage() const noexcept { return latch_.stage(); }
  [[nodiscard]] Phase phase() const noexcept { return phases_ ? phases_->phase() : Phase::free; }
  [[nodiscard]] std::uint32_t cells_done() const noexcept { return cells_done_; }
  [[nodiscard]] bool force_is_zero() const noexcept { return hand_force_N_.isZero(0); }
  [[nodiscard]] const TelemetrySample& sample() const noexcept { return sample_; }  // of the last tick

 private:
  // The steps of the tick, in its order.
  void begin(const TickInfo& now) noexcept;
  [[nodiscard]] Fault read_devices(const TickInfo& now) noexcept;
  void take_newest_observation() noexcept;
  void estimate_velocity() noexcept;
  void advance_phase() noexcept;
  [[nodiscard]] hal::Vec3 sum_force_effects() noexcept;
  [[nodiscard]] hal::Vec3 keep_passive(const hal::Vec3& wanted_N) noexcept;
  [[nodiscard]] Fault limit_force(const hal::Vec3& wanted_N) noexcept;
  void latch(Fault cause) noexcept;
  void choose_stage_set_point() noexcept;
  void write_devices() noexcept;
  void publish(const TickInfo& now) noexcept;

  // Parts of read_devices. Each returns what is wrong, Fault::none if nothing is.
  [[nodiscard]] Fault read_estop() noexcept;
  [[nodiscard]] Fault read_hand() noexcept;
  [[nodiscard]] Fault read_stage() noexcept;
  [[nodiscard]] Fault read_vacuum() noexcept;
  [[nodiscard]] Fault check_overruns(const TickInfo& now) noexcept;
  [[nodiscard]] Fault take_commands() noexcept;
  [[nodiscard]] Fault read_injector() noexcept;
  void read_force_sensor() noexcept;
  void follow_hand() noexcept;

  [[nodiscard]] StageConstraint constraint() const noexcept;
  [[nodiscard]] bool inside() const noexcept;   // latched puncture
  [[nodiscard]] bool sighted() const noexcept;  // vision is not needed, or not stale
  [[nodiscard]] bool ending() const noexcept;   // the task is over, or an end was asked for and may be
  // Every cell was entered and left, and got its substance where there is an injector.
  [[nodiscard]] bool task_done() const noexcept { return task_over_ && cells_injected_ == cells_done_; }
  [[nodiscard]] bool button(std::uint32_t b) const noexcept { return (hand_.buttons & b) != 0; }
  void anchor(const hal::Vec3& tip_m, const hal::Vec3& axis) noexcept;
  void render_membrane(double gain) noexcept;

  const ServoConfig config_;
  const Devices devices_;
  Station& station_;
  const bool degraded_;

  // What the scene has.
  std::optional<Membrane> membrane_;
  std::optional<ConeGuide> cone_;
  std::optional<WithdrawalAxis> axis_;
  std::optional<Damping> damping_;
  std::optional<PassivityGuard> guard_;
  std::optional<RepulsiveRegion> repulsive_;
  std::optional<Friction> friction_;
  std::optional<Vibration> vibration_;
  std::optional<Phases> phases_;
  std::optional<LocalMembraneModel> model_;

  std::optional<Kalman> kalman_;
  std::optional<Foaw> foaw_;
  MasterToStage mapping_;
  StageLimits stage_limits_;
  SafetyLatch latch_;
  LatchOutput stop_;

  // This tick.
  std::uint64_t ticks_ = 0;
  double dt_s_ = 0;       // bounded: what ramps and filters advance by
  double elapsed_s_ = 0;  // really
  std::int64_t now_ns_ = 0;
  std::int64_t first_release_ns_ = 0;
  std::uint32_t alarms_ = 0;

  // What the devices said.
  hal::HandState hand_;
  bool hand_seen_ = false;
  bool hand_fresh_ = false;
  bool hand_was_stuck_ = false;
  double since_hand_s_ = 0;    // since its last good sample
  double between_hand_s_ = 0;  // the last two good samples
  HandWatch hand_watch_;
  hal::StageState stage_;
  bool stage_seen_ = false;
  bool stage_fresh_ = false;
  bool stage_was_enabled_ = false;
  FollowingCheck following_;
  double since_stage_s_ = 0;
  hal::EstopState estop_;
  bool estop_readable_ = true;
  bool discrepancy_ = false;    // until both have been seen open together
  bool sensor_seen_ = false;    // the force sensor
  bool injector_open_ = false;  // as it says itself
  double since_estop_s_ = 0;
  double differing_s_ = 0;  // the two contacts
  double vacuum_Pa_ = 0;
  double vacuum_low_s_ = 0;
  double vacuum_still_s_ = 0;
  double sensor_N_ = 0;
  double sensor_filtered_N_ = 0;
  double since_sensor_s_ = 0;
  double open_unasked_s_ = 0;  // the injector, against its gate
  std::uint64_t observation_head_ = 0;
  std::uint64_t observations_ = 0;
  std::uint64_t stale_ticks_ = 0;

  // State of the loop.
  bool stop_requested_ = false;
  bool end_requested_ = false;
  bool end_here_requested_ = false;
  bool task_over_ = false;
  Fault write_fault_ = Fault::none;  // found while writing, latched on the next tick
  std::uint32_t cells_done_ = 0;
  std::uint32_t cells_injected_ = 0;
  std::uint64_t commands_refused_ = 0;
  std::uint64_t faults_latched_ = 0;
  double force_scale_wanted_ = 1;  // command force_scale, 0 .. 1
  double force_scale_ = 1;
  Ramp presence_;  // of every force: from the start, after a reset, to the end
  double presence_before_ = 0;
  Ramp coupling_;  // of the forces that belong to the needle: off while the clutch is pressed
  double fixture_gain_ = 0;
  hal::Vec3 estimated_m_s_ = hal::Vec3::Zero();      // velocity of the hand, device frame
  hal::Vec3 hand_velocity_m_s_ = hal::Vec3::Zero();  // and behind its low-pass
  double depth_m_ = 0;
  double outward_m_s_ = 0;  // of the tip, low-passed
  hal::Vec3 tip_before_m_ = hal::Vec3::Zero();
  hal::Vec3 approach_ = -hal::Vec3::UnitX();  // axis of the needle, frozen from contact on
  FixtureFrame insertion_;                    // the line of insertion, latched at the puncture
  double tip_force_N_ = 0;                    // the law's, or the measured one if that is more
  double injected_s_ = 0;                     // gate told to be open, this cell
  bool injected_ = false;                     // the injector said it was
  std::uint32_t injected_cell_ = 0;           // the cell it counts for
  bool gate_open_ = false;
  bool inject_released_ = false;  // the button was up since the start, the last stop, the last loss of sight
  bool tip_force_soft_ = false;
  bool was_sighted_ = false;
  int until_command_ = 0;  // ticks until the next stage set-point
  bool heartbeat_level_ = false;
  double stored_J_ = 0;
  double injected_J_ = 0;
  double model_moved_m_ = 0;  // depth added by vision's correction on this tick

  // Parts of the force, at the hand, world axes.
  hal::Vec3 membrane_N_ = hal::Vec3::Zero();
  hal::Vec3 cone_N_ = hal::Vec3::Zero();
  hal::Vec3 axis_N_ = hal::Vec3::Zero();
  hal::Vec3 damping_N_ = hal::Vec3::Zero();
  double guard_N_ = 0;
  hal::Vec3 repulsive_N_ = hal::Vec3::Zero();
  hal::Vec3 friction_N_ = hal::Vec3::Zero();
  hal::Vec3 vibration_N_ = hal::Vec3::Zero();
  RimForces rim_{};
  hal::Vec3 hand_force_N_ = hal::Vec3::Zero();  // device frame, what goes out
  hal::Vec3 live_force_N_ = hal::Vec3::Zero();  // limited, before the latch
  hal::Vec3 force_before_stop_N_ = hal::Vec3::Zero();

  TelemetrySample sample_;
};

}  // namespace punctum::rt
