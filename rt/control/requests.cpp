#include "rt/control/requests.hpp"

#include <algorithm>

namespace punctum::rt {
namespace {

// Of the whole range: half a second from one end to the other, so that a hand can follow the change.
constexpr double kRampRate_1_s = 2;

void approach(double& value, double target, double most) NONBLOCKING {
  value += std::clamp(target - value, -most, most);
}

}  // namespace

Requests::Requests(const ServoConfig& config, Station& station) NONBLOCKING
    : station_(station),
      most_hand_force_N_(config.limits.hand_force_N),
      most_depth_m_(config.limits.penetration_depth_m),
      least_position_scale_(config.mapping.least_position_scale()),
      most_position_scale_(config.mapping.most_position_scale()),
      hand_force_target_N_(config.limits.hand_force_N),
      depth_target_m_(config.limits.penetration_depth_m) {
  requested_.hand_force_N = config.limits.hand_force_N;
  requested_.depth_limit_m = config.limits.penetration_depth_m;
  requested_.position_scale = config.mapping.position_scale;
#define PUNCTUM_EFFECT(name, Class) effect_exists_[effect_##name] = config.name.has_value();
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
}

const Requested& Requests::take(double dt_s) NONBLOCKING {
  approach_targets(dt_s);
  requested_.taken_count = 0;
  std::uint32_t writer = 0;
  for (const CommandInput& from : station_.commands) {  // at most kCommandWriterCount rounds
    Command command;
    for (std::size_t i = 0; i < kCommandsPerTick && from.queue->try_pop(command); ++i) {
      const bool obeyed = obey(command, from.role);
      if (!obeyed) {
        ++requested_.refused;
      }
      if (requested_.taken_count < requested_.taken.size()) {
        requested_.taken[requested_.taken_count++] = {command, writer, obeyed};
      }
    }
    ++writer;
  }
  return requested_;
}

void Requests::approach_targets(double dt_s) NONBLOCKING {
  if (at_targets_) {
    return;
  }
  const double most = kRampRate_1_s * dt_s;
  approach(requested_.force_scale, force_scale_target_, most);
  for (std::size_t i = 0; i < effect_count; ++i) {
    approach(requested_.effect_gain[i], effect_gain_target_[i], most);
  }
  requested_.reduces_effects = requested_.effect_gain != kFullGains;
  approach(requested_.hand_force_N, hand_force_target_N_, most * most_hand_force_N_);
  approach(requested_.depth_limit_m, depth_target_m_, most * most_depth_m_);
  at_targets_ =
      requested_.force_scale == force_scale_target_ && requested_.effect_gain == effect_gain_target_ &&
      requested_.hand_force_N == hand_force_target_N_ && requested_.depth_limit_m == depth_target_m_;
}

bool Requests::obey(const Command& command, CommandKinds role) NONBLOCKING {
  if (!contains(role, command.kind)) {
    return false;
  }
  const bool fraction = command.value >= 0 && command.value <= 1;
  at_targets_ = false;
  switch (command.kind) {
    case Command::stop:
      requested_.stop = true;
      return true;
    case Command::end:
      requested_.end = true;
      return true;
    case Command::force_scale:
      if (!fraction) {
        return false;
      }
      force_scale_target_ = command.value;
      return true;
    case Command::effect_gain:
      if (!fraction || command.target >= effect_count || !effect_exists_[command.target]) {
        return false;
      }
      effect_gain_target_[command.target] = command.value;
      return true;
    case Command::hand_force_limit:
      if (!(command.value > 0 && command.value <= most_hand_force_N_)) {
        return false;
      }
      hand_force_target_N_ = command.value;
      return true;
    case Command::position_scale:
      if (!(command.value >= least_position_scale_ && command.value <= most_position_scale_)) {
        return false;
      }
      requested_.position_scale = command.value;
      return true;
    case Command::depth_limit:
      if (!(command.value > 0 && command.value <= most_depth_m_)) {
        return false;
      }
      depth_target_m_ = command.value;
      return true;
    default:
      return false;
  }
}

}  // namespace punctum::rt
