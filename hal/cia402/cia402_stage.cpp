#include "hal/cia402/cia402_stage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "hal/cia402/bus_load.hpp"

namespace punctum::cia402 {
namespace {

using hal::Status;
using hal::Vec3;
using Done = tl::expected<void, std::string>;
using Unexpected = tl::unexpected<std::string>;
using Object = SdoClient::Object;

// In one tick: more than every node sends in the longest cycle, with an emergency each, several times over.
constexpr int kMostFrames = 64;

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::int64_t kStateWithin_ns = 500 * kMillisecond_ns;  // a drive answers a controlword by then
constexpr std::int64_t kStopsWithin_ns = 500 * kMillisecond_ns;  // as [estop] power_off_after_ms by default
constexpr std::int64_t kPowerOffWithin_ns = 100 * kMillisecond_ns;
constexpr std::uint32_t kMany = 1'000'000'000;  // counters stop there

constexpr Object kDeviceType{{0x1000, 0}, 4, 0, "device type", "is it a CANopen drive?"};
constexpr Object kVendor{{0x1018, 1}, 4, 0, "vendor", "look at vendor_id of its [[cia402.axis]]"};
constexpr Object kProduct{{0x1018, 2}, 4, 0, "product", "look at product_code of its [[cia402.axis]]"};
constexpr Object kModes{{0x6502, 0}, 4, 0, "supported modes", "the drive does not say what it can do"};
constexpr Object kStatus{{0x6041, 0}, 2, 0, "statusword", "is it a CiA 402 drive?"};
constexpr Object kOnLinkLoss{
    {0x1029, 1}, 1, 0, "pre-operational when the link is lost", "the drive must then take no PDO"};
constexpr Object kErrorCode{{0x603F, 0}, 2, 0, "error code", ""};
constexpr Object kModeShown{{0x6061, 0}, 1, 0, "mode shown", "the drive must show its mode"};

constexpr Object control(std::uint16_t controlword) {
  return {{0x6040, 0}, 2, controlword, "controlword", "is another master on the bus?"};
}

[[nodiscard]] std::int32_t rounded(double counts) NONBLOCKING {
  return static_cast<std::int32_t>(counts + (counts < 0 ? -0.5 : 0.5));
}

void count(std::uint32_t& counter) NONBLOCKING { counter = std::min(counter + 1, kMany); }

std::string node_text(int node) { return "node " + std::to_string(node); }

// The state of the drive once it is one that `good` accepts, or the last one seen in time.
template <typename Good>
tl::expected<PowerState, std::string> wait_for(SdoClient& sdo, int node, Good good) {
  PowerState state = PowerState::unknown;
  for (std::int64_t waited = 0; waited < kStateWithin_ns; waited += kMillisecond_ns) {
    const auto word = sdo.upload(node, kStatus);
    if (!word) {
      return Unexpected(word.error());
    }
    state = power_state(static_cast<std::uint16_t>(*word));
    if (good(state)) {
      break;
    }
    sdo.pass(kMillisecond_ns);
  }
  return state;
}

}  // namespace

Cia402Stage::Cia402Stage(const CanStageParams& params, double tick_s, hal::Clock& clock,
                         std::unique_ptr<CanBus> bus)
    : params_(params),
      tick_s_(tick_s),
      cycle_s_(tick_s * params.sync_divisor),
      clock_(clock),
      bus_(std::move(bus)),
      calibration_(params),
      heartbeat_period_ns_(std::llround(params.heartbeat_s * 1e9)),
      count_(static_cast<std::size_t>(std::clamp(params.axis_count, 0, kMaxAxes))) {
  if (const auto reach = reach_of_axes(params)) {
    params_.needle = (*reach * params.needle).normalized();  // depth is told along the way that it goes
  }
}

// ---- life ----

std::vector<std::uint16_t> Cia402Stage::identifiers() const {
  std::vector<std::uint16_t> ids;
  for (std::size_t i = 0; i < count_; ++i) {
    const int node = params_.axes[i].node;
    ids.insert(ids.end(), {emergency_id(node), tpdo1_id(node), sdo_answer_id(node), heartbeat_id(node)});
  }
  if (params_.force_node != 0) {
    const int node = params_.force_node;
    ids.insert(ids.end(), {tpdo1_id(node), sdo_answer_id(node), heartbeat_id(node)});
  }
  return ids;
}

Done Cia402Stage::open() {
  if (const auto opened = bus_->open(identifiers()); !opened) {
    return opened;
  }
  health_ = {};
  disconnected_ = bus_gone_ = started_ = begun_ = holding_ = force_fresh_ = false;
  wanted_ = Wanted::off;
  unsent_ = {};
  unheard_ = 0;
  silent_ = excused_ = stop_due_ = false;
  ticks_to_sync_ = 0;
  sync_ns_ = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    axes_[i].set_up(params_.axes[i], params_.homing, params_.heartbeat_timeout_s);
  }
  if (auto configured = configure(); !configured) {
    bus_->close();
    return configured;
  }
  open_ = true;
  return {};
}

Done Cia402Stage::configure() {
  SdoClient sdo(*bus_, clock_, [this](const CanFrame& frame) {
    for (Axis& axis : axes_) {
      if (frame.id == emergency_id(axis.node())) {
        axis.take_emergency(frame);
      }
    }
  });
  for (std::size_t i = 0; i < count_; ++i) {
    (void)bus_->send(nmt(Nmt::pre_operational, params_.axes[i].node));
    if (auto done = configure(sdo, params_.axes[i]); !done) {
      return done;
    }
  }
  if (params_.force_node != 0) {
    (void)bus_->send(nmt(Nmt::pre_operational, params_.force_node));
    for (const Object& object : force_sensor_configuration(params_)) {
      if (auto done = sdo.download(params_.force_node, object); !done) {
        return done;
      }
    }
  }
  return {};
}

Done Cia402Stage::check_identity(SdoClient& sdo, const AxisParams& axis) const {
  const auto type = sdo.upload(axis.node, kDeviceType);
  if (!type) {
    return Unexpected(type.error());
  }
  constexpr std::uint32_t kDriveProfile = 402;
  if ((*type & 0xFFFFU) != kDriveProfile) {
    return Unexpected(text_of(axis.node, kDeviceType) + ": 0x" + hex(*type, 8) +
                      " is no CiA 402 drive: look at the node numbers on the bus");
  }
  struct Wished {
    const Object& object;
    std::uint64_t value;
  };
  for (const Wished& wished : {Wished{kVendor, axis.vendor_id}, Wished{kProduct, axis.product_code}}) {
    if (wished.value == 0) {
      continue;
    }
    const auto is = sdo.upload(axis.node, wished.object);
    if (!is) {
      return Unexpected(is.error());
    }
    if (*is != wished.value) {
      return Unexpected(text_of(axis.node, wished.object) + ": 0x" + hex(*is, 8) + ", and the scene says 0x" +
                        hex(static_cast<std::uint32_t>(wished.value), 8) + ": " + wished.object.advice);
    }
  }
  const auto modes = sdo.upload(axis.node, kModes);
  if (!modes) {
    return Unexpected(modes.error());
  }
  constexpr std::uint32_t kHoming = 1U << 5U, kSynchronousPosition = 1U << 7U;
  if ((*modes & kSynchronousPosition) == 0) {
    return Unexpected(text_of(axis.node, kModes) + ": no cyclic synchronous position: it cannot serve here");
  }
  if (params_.homing && (*modes & kHoming) == 0) {
    return Unexpected(text_of(axis.node, kModes) + ": no homing: leave homing out of [cia402]");
  }
  return {};
}

// Whatever state the drive was left in: it stops, loses its power, and an old fault is reset.
Done Cia402Stage::take_power(SdoClient& sdo, int node) {
  const auto told = [&](std::uint16_t controlword) { return sdo.download(node, control(controlword)); };
  auto state = wait_for(sdo, node, [](PowerState s) { return s != PowerState::not_ready; });
  if (state && *state == PowerState::operation_enabled) {
    if (auto done = told(kQuickStop); !done) {
      return done;
    }
    sdo.pass(kStopsWithin_ns);
  }
  if (auto done = told(kDisableVoltage); !done) {
    return done;
  }
  state = wait_for(sdo, node, [](PowerState s) { return !powered(s); });
  if (state && *state == PowerState::fault) {
    if (auto done = told(kFaultReset); !done) {
      return done;
    }
    state = wait_for(sdo, node, [](PowerState s) { return s == PowerState::switch_on_disabled; });
    if (auto done = told(kDisableVoltage); !done) {
      return done;
    }
  }
  if (!state) {
    return Unexpected(state.error());
  }
  if (*state == PowerState::fault) {
    const auto code = sdo.upload_if_there(node, kErrorCode, 0);
    const auto error = static_cast<std::uint16_t>(code.value_or(0));
    return Unexpected(node_text(node) + ": the drive stays in its fault 0x" + hex(error, 4) + " (" +
                      emergency_text(error) + "): remove its cause, then start again");
  }
  if (powered(*state)) {
    return Unexpected(node_text(node) + ": the drive does not give up its power, state " + name_of(*state) +
                      ": is another master on the bus?");
  }
  return {};
}

Done Cia402Stage::configure(SdoClient& sdo, const AxisParams& axis) const {
  if (auto done = check_identity(sdo, axis); !done) {
    return done;
  }
  if (auto done = take_power(sdo, axis.node); !done) {
    return done;
  }
  // PDOs of the vendor's default would load the bus.
  constexpr std::array<std::uint16_t, 6> kOtherPdos = {0x1401, 0x1402, 0x1403, 0x1801, 0x1802, 0x1803};
  constexpr std::uint32_t kOff = 0x8000'0000;
  for (const std::uint16_t parameter : kOtherPdos) {
    Object pdo{{parameter, 1}, 4, 0, "another PDO", "the drive must let it be switched off"};
    const auto id = sdo.upload_if_there(axis.node, pdo, kOff);
    if (!id) {
      return Unexpected(id.error());
    }
    if ((*id & kOff) == 0) {
      pdo.value = *id | kOff;
      if (auto done = sdo.download(axis.node, pdo); !done) {
        return done;
      }
    }
  }
  for (const Object& object : configuration(params_, axis, cycle_s_)) {
    if (auto done = sdo.download(axis.node, object); !done) {
      return done;
    }
  }
  // What is still in a queue when the link comes back must find a drive that takes no PDO. A drive without
  // the object becomes pre-operational as well (CiA 301). Stopped (2) would be too much: it tells no
  // emergency.
  const auto behaviour = sdo.upload_if_there(axis.node, kOnLinkLoss, kOnLinkLoss.value);
  if (!behaviour) {
    return Unexpected(behaviour.error());
  }
  if ((*behaviour & 0xFFU) != kOnLinkLoss.value) {
    if (auto done = sdo.download(axis.node, kOnLinkLoss); !done) {
      return done;
    }
  }
  const std::uint32_t mode = params_.homing ? 6 : 8;
  std::uint32_t shown = 0;
  for (std::int64_t waited = 0; waited < kStateWithin_ns && shown != mode; waited += kMillisecond_ns) {
    const auto is = sdo.upload(axis.node, kModeShown);
    if (!is) {
      return Unexpected(is.error());
    }
    shown = *is & 0xFFU;
    if (shown != mode) {
      sdo.pass(kMillisecond_ns);
    }
  }
  if (shown != mode) {
    return Unexpected(text_of(axis.node, kModeShown) + ": " + std::to_string(shown) + " although " +
                      std::to_string(mode) + " was set: the drive does not change its mode of operation");
  }
  return {};
}

hal::Served Cia402Stage::served() noexcept {
  hal::Served served;
  served.stage = this;
  served.force_sensor = params_.force_node != 0 ? this : nullptr;
  return served;
}

std::int64_t Cia402Stage::longest_start_ns() const noexcept {
  return std::llround(1e9 * (params_.heartbeat_timeout_s + 2 * params_.heartbeat_s));
}

Done Cia402Stage::start(std::int64_t) {
  std::array<bool, kMaxAxes> operational{};
  SdoClient listener(*bus_, clock_, [&](const CanFrame& frame) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (frame.id == heartbeat_id(axes_[i].node())) {
        operational[i] = node_state(frame) == NodeState::operational;
      }
    }
  });
  for (std::size_t i = 0; i < count_; ++i) {
    (void)bus_->send(nmt(Nmt::start, axes_[i].node()));
  }
  if (params_.force_node != 0) {
    (void)bus_->send(nmt(Nmt::start, params_.force_node));
  }
  const std::int64_t longest_ns = longest_start_ns();
  const auto all = [&] {
    return std::all_of(operational.begin(), operational.begin() + static_cast<std::ptrdiff_t>(count_),
                       [](bool one) { return one; });
  };
  for (std::int64_t waited = 0; waited < longest_ns && !all(); waited += kMillisecond_ns) {
    listener.pass(kMillisecond_ns);
  }
  for (std::size_t i = 0; i < count_; ++i) {
    if (!operational[i]) {
      return Unexpected(node_text(axes_[i].node()) +
                        ": no heartbeat that says operational: check its power and its network state");
    }
  }
  started_ = true;
  return {};
}

// Ticks of our own until the drives stand, or have no power.
void Cia402Stage::wait_off(std::int64_t longest_ns, bool for_standstill) noexcept {
  const auto period_ns = std::max<std::int64_t>(std::llround(tick_s_ * 1e9), 1);
  std::int64_t now = clock_.now_ns();
  const std::int64_t until = now + longest_ns;
  while (now < until && !bus_gone_) {
    hal::StageState seen;
    if (read(seen) == Status::ok && (for_standstill ? seen.at_standstill : !seen.powered)) {
      return;
    }
    if (for_standstill) {
      quick_stop();
    } else {
      enable(false);
    }
    now += period_ns;
    clock_.sleep_until_ns(now);
    now = clock_.now_ns();
  }
}

void Cia402Stage::safe_state() noexcept {
  if (!open_ || !started_) {
    return;  // the drives have no power since open()
  }
  if (wanted_ != Wanted::off) {
    quick_stop();
    wait_off(kStopsWithin_ns, true);
  }
  enable(false);
  wait_off(kPowerOffWithin_ns, false);
}

void Cia402Stage::close() noexcept {
  if (!open_) {
    return;
  }
  // Nobody watches the heartbeat of a master that has gone, and no PDO loads the bus. One drive after the
  // other: what a small receive buffer drops is not told again.
  for (std::size_t i = 0; i < count_; ++i) {
    clock_.sleep_until_ns(clock_.now_ns() + kMillisecond_ns);
    (void)bus_->send(sdo_download(axes_[i].node(), {0x1016, 1}, 0, 4));
    (void)bus_->send(nmt(Nmt::pre_operational, axes_[i].node()));
  }
  if (params_.force_node != 0) {
    (void)bus_->send(nmt(Nmt::pre_operational, params_.force_node));
  }
  std::fputs(report().c_str(), stderr);
  bus_->close();
  open_ = started_ = false;
}

std::string Cia402Stage::report() const {
  std::string text;
  const auto line = [&](const std::string& what) { text += "cia402: " + what + "\n"; };
  for (const Axis& axis : axes()) {
    if (axis.emergencies() > 0) {
      const Emergency last = axis.last_emergency();
      line(node_text(axis.node()) + ": " + std::to_string(axis.emergencies()) + " emergencies, the last 0x" +
           hex(last.code, 4) + " (" + emergency_text(last.code) + ")");
    }
    if (axis.lost()) {
      line(node_text(axis.node()) + ": was lost: it restarted, left operation or sent no heartbeat");
    }
  }
  const Health h = health();
  if (h.bus_off) {
    line("the controller went bus-off: check cable, terminators and bitrate");
  }
  if (h.silences > 0) {
    line("no node was heard for " + std::to_string(params_.silence_cycles) + " SYNCs, " +
         std::to_string(h.silences) + " times, and the drives were stopped: check the connectors");
  }
  if (h.not_sent > 0) {
    line(std::to_string(h.not_sent) + " frames found the queue full: ip link set " + params_.interface +
         " txqueuelen 128");
  }
  if (h.bus_errors + h.floods + h.malformed > 0) {
    line(std::to_string(h.bus_errors) + " error frames, " + std::to_string(h.floods) +
         " ticks with more frames than are read, " + std::to_string(h.malformed) +
         " frames of a wrong length");
  }
  return text;
}

// ---- the tick ----

Status Cia402Stage::read(hal::StageState& out) NONBLOCKING {
  const std::int64_t now = clock_.now_ns();
  if (!begun_) {
    begun_ = true;
    heartbeat_ns_ = now - heartbeat_period_ns_;
    for (Axis& axis : axes_) {
      axis.begin(now);
    }
  }
  drain(now);
  const Status status = judge(now);
  if (status == Status::ok) {
    out = state();
  }
  if (status == Status::disconnected && wanted_ == Wanted::operation) {
    tell(Wanted::quick_stop);  // those drives that still hear it
  }
  if (ticks_to_sync_ <= 0) {
    cycle(now);
    ticks_to_sync_ = params_.sync_divisor;
  }
  --ticks_to_sync_;
  return status;
}

void Cia402Stage::drain(std::int64_t now_ns) NONBLOCKING {
  flooded_ = false;
  if (bus_gone_) {
    return;
  }
  for (int i = 0; i < kMostFrames; ++i) {
    CanFrame frame;
    switch (bus_->receive(frame)) {
      case Received::frame:
        unheard_ = 0;
        take(frame, now_ns);
        break;
      case Received::error:
        count(health_.bus_errors);
        break;
      case Received::bus_off:
        health_.bus_off = true;
        bus_gone_ = true;
        return;
      case Received::down:
        bus_gone_ = true;
        return;
      case Received::nothing:
        return;
    }
  }
  flooded_ = true;
  count(health_.floods);
}

void Cia402Stage::take(const CanFrame& frame, std::int64_t now_ns) NONBLOCKING {
  for (std::size_t i = 0; i < count_; ++i) {
    Axis& axis = axes_[i];
    const int node = axis.node();
    if (frame.id == tpdo1_id(node)) {
      if (sync_ns_ != 0) {
        axis.take_position(frame, sync_ns_);
      }
    } else if (frame.id == heartbeat_id(node)) {
      axis.take_heartbeat(frame, now_ns);
    } else if (frame.id == emergency_id(node)) {
      axis.take_emergency(frame);
    } else if (frame.id == sdo_answer_id(node)) {
      axis.take_sdo_answer(frame);
    } else {
      continue;
    }
    return;
  }
  if (params_.force_node != 0 && frame.id == tpdo1_id(params_.force_node)) {
    take_force(frame);
  }
}

void Cia402Stage::take_force(const CanFrame& frame) NONBLOCKING {
  constexpr std::uint8_t kSize = 4;
  if (frame.size != kSize || sync_ns_ == 0) {
    count(health_.malformed);
    return;
  }
  force_.axial_force_N = params_.force_count_N * static_cast<std::int32_t>(get(frame, 0, 4));
  force_.sample_ns = sync_ns_;
  force_fresh_ = true;
}

Status Cia402Stage::judge(std::int64_t now_ns) NONBLOCKING {
  bool fault = false, fresh = !flooded_;
  disconnected_ = disconnected_ || bus_gone_;
  for (std::size_t i = 0; i < count_; ++i) {
    const Axis& axis = axes_[i];
    disconnected_ = disconnected_ || axis.lost();
    fault = fault || axis.has_fault(wanted_, now_ns);
    fresh = fresh && axis.fresh();
  }
  if (disconnected_) {
    return Status::disconnected;
  }
  // Drives that were stopped because nothing was heard have done nothing wrong that could be known yet: there
  // is no data, until all answer again.
  const bool excused = excused_;
  excused_ = excused_ && !fresh;
  if (fault && !excused) {
    return Status::fault;
  }
  return fresh ? Status::ok : Status::no_data;
}

hal::StageState Cia402Stage::state() const NONBLOCKING {
  hal::StageState out;
  Counts at = Counts::Zero(), behind = Counts::Zero();
  out.at_standstill = true;
  for (std::size_t i = 0; i < count_; ++i) {
    const Axis& axis = axes_[i];
    at[static_cast<Eigen::Index>(i)] = axis.position();
    behind[static_cast<Eigen::Index>(i)] = axis.following_error();
    out.powered = out.powered || powered(axis.state());
    out.at_standstill = out.at_standstill && axis.at_standstill();
  }
  out.enabled = wanted_ == Wanted::operation && all_enabled();
  out.tip_m = calibration_.tip_m(at);
  out.axis = params_.needle;
  out.following_error_m = calibration_.motion_m(behind);
  out.sample_ns = sync_ns_;
  return out;
}

bool Cia402Stage::all_enabled() const NONBLOCKING {
  for (std::size_t i = 0; i < count_; ++i) {
    if (!axes_[i].enabled()) {
      return false;
    }
  }
  return count_ > 0;
}

// What is still to be sent for this SYNC, the SYNC, and what follows from the answers to the last one. The
// set-points of a drive that follows are sent at the end of their tick: a controller that sends by priority
// would let the SYNC overtake them. What the steps below decide goes out right before the next SYNC, and may
// act one later.
//
// A controller that nobody acknowledges repeats its first frame for ever, and the kernel keeps what is sent
// behind it, in order and with no way to take it back. So as long as no node is heard, nothing is added but a
// stop. How much waits, the kernel does not tell (a CAN socket has no SIOCOUTQ); but what a node sends goes
// over the same contact, an answer follows the SYNC that asked for it, and a heartbeat gives way to every
// command and SYNC that the controller holds. With at most silence_cycles cycles sent after the last frame
// that was heard, and none but stops from then on until the core has told the drives off, what can be played
// later is bounded.
void Cia402Stage::cycle(std::int64_t now_ns) NONBLOCKING {
  const bool was_silent = silent_;
  silent_ = unheard_ >= params_.silence_cycles;
  if (silent_ && !was_silent) {
    fall_silent();
  }
  if (!silent_) {
    send_commands();
    send_sync(now_ns);
  } else if (stop_due_) {
    send_stop(now_ns);
  }
  if (!silent_ && now_ns - heartbeat_ns_ >= heartbeat_period_ns_ &&
      send(heartbeat(params_.master_node, NodeState::operational))) {
    heartbeat_ns_ = now_ns;
  }
  for (std::size_t i = 0; i < count_; ++i) {
    axes_[i].step(wanted_, now_ns);
    unsent_[i] = unsent_[i] || !silent_;
    if (!silent_ && axes_[i].request_due() && send(axes_[i].request())) {
      axes_[i].requested();
    }
  }
}

// The old set-points that wait already cannot be helped: at most those of silence_cycles cycles, for one that
// was sent behind the last SYNC is overwritten in the drive by the stop. It goes out with a SYNC of its own
// that lets it act as soon as anything passes; and once only.
void Cia402Stage::fall_silent() NONBLOCKING {
  if (wanted_ == Wanted::operation) {
    excused_ = true;
    count(health_.silences);
    for (std::size_t i = 0; i < count_; ++i) {
      axes_[i].drop();
    }
  }
  told_ = std::min(wanted_, Wanted::quick_stop);
  unsent_.fill(true);
  stop_due_ = true;
}

// What a full queue refuses is due until it is taken.
void Cia402Stage::send_stop(std::int64_t now_ns) NONBLOCKING {
  send_commands();
  if (std::none_of(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(count_),
                   [](bool one) { return one; })) {
    send_sync(now_ns);
  }
}

void Cia402Stage::send_sync(std::int64_t now_ns) NONBLOCKING {
  if (!send(sync())) {
    return;
  }
  stop_due_ = false;
  unheard_ = std::min(unheard_ + 1, params_.silence_cycles);
  sync_ns_ = now_ns;
  for (std::size_t i = 0; i < count_; ++i) {
    axes_[i].synced();
  }
}

void Cia402Stage::send_commands() NONBLOCKING {
  for (std::size_t i = 0; i < count_; ++i) {
    unsent_[i] = unsent_[i] && !send(axes_[i].command());
  }
}

bool Cia402Stage::send(const CanFrame& frame) NONBLOCKING {
  if (bus_gone_) {
    return false;  // a controller that restarts by itself would send what is old
  }
  switch (bus_->send(frame)) {
    case Sent::ok:
      return true;
    case Sent::full:
      count(health_.not_sent);
      return false;
    case Sent::down:
      bus_gone_ = true;
      return false;
  }
  return false;
}

void Cia402Stage::tell(Wanted wanted) NONBLOCKING {
  wanted_ = wanted;
  holding_ = false;
  for (std::size_t i = 0; i < count_; ++i) {
    axes_[i].urge(wanted);
    unsent_[i] = true;
  }
  if (!silent_) {
    send_commands();
  } else if (wanted < told_) {  // power off after a quick stop; neither twice in one silence
    told_ = wanted;
    stop_due_ = true;
    send_stop(clock_.now_ns());
  }
}

Status Cia402Stage::command(const hal::StageCommand& set_point) NONBLOCKING {
  if (disconnected_) {
    return Status::disconnected;
  }
  if (!set_point.tip_m.allFinite()) {
    return Status::fault;
  }
  if (wanted_ != Wanted::operation || !all_enabled()) {
    return Status::ok;  // the drives hold
  }
  if (!holding_) {
    holding_ = true;
    for (std::size_t i = 0; i < count_; ++i) {
      anchor_[static_cast<Eigen::Index>(i)] = axes_[i].target();
    }
    anchor_m_ = calibration_.tip_m(anchor_);
  }
  // From where the drives took over: axes that do not change the tip stay where they are.
  const Counts counts = anchor_ + calibration_.counts(set_point.tip_m - anchor_m_);
  for (std::size_t i = 0; i < count_; ++i) {
    Axis& axis = axes_[i];
    const double allowed = std::clamp(counts[static_cast<Eigen::Index>(i)], 1.0 * axis.params().min_counts,
                                      1.0 * axis.params().max_counts);
    axis.set_target(rounded(allowed));
    unsent_[i] = true;
  }
  if (ticks_to_sync_ == 0) {
    send_commands();
  }
  return bus_gone_ ? Status::disconnected : Status::ok;
}

void Cia402Stage::quick_stop() NONBLOCKING {
  if (wanted_ == Wanted::operation) {
    tell(Wanted::quick_stop);
  }
}

void Cia402Stage::enable(bool on) NONBLOCKING {
  if (on) {
    if (wanted_ == Wanted::off) {
      wanted_ = Wanted::operation;  // from the next cycle on, a step in each
    }
  } else if (wanted_ != Wanted::off) {
    tell(Wanted::off);
  }
}

Status Cia402Stage::read(hal::ForceState& out) NONBLOCKING {
  if (disconnected_) {
    return Status::disconnected;
  }
  if (!force_fresh_) {
    return Status::no_data;
  }
  out = force_;
  force_fresh_ = false;
  return Status::ok;
}

Health Cia402Stage::health() const NONBLOCKING {
  Health all = health_;
  for (std::size_t i = 0; i < count_; ++i) {
    all.malformed += axes_[i].malformed();
  }
  return all;
}

}  // namespace punctum::cia402
