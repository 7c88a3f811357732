#include "tools/console/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "rt/forces/list.hpp"

namespace punctum::console {

Parameters::Parameters(const rt::ServoConfig& config) {
  const auto add = [this](Parameter p) {
    p.before = p.value;
    all_.push_back(std::move(p));
  };
  add({.name = "force_scale", .unit = "1", .kind = rt::Command::force_scale});
  const double force_N = config.limits.hand_force_N, depth_m = config.limits.penetration_depth_m;
  add({.name = "hand_force_limit",
       .unit = "N",
       .most = force_N,
       .above_least = true,
       .value = force_N,
       .kind = rt::Command::hand_force_limit});
  add({.name = "depth_limit",
       .unit = "um",
       .unit_SI = 1e-6,
       .most = depth_m,
       .above_least = true,
       .value = depth_m,
       .kind = rt::Command::depth_limit});
  add({.name = "position_scale",
       .unit = "1",
       .least = config.mapping.least_position_scale(),
       .most = config.mapping.most_position_scale(),
       .value = config.mapping.position_scale,
       .kind = rt::Command::position_scale});
#define PUNCTUM_EFFECT(effect, Class)                                 \
  if (config.effect.has_value()) {                                    \
    add({.name = fmt::format("gain of {}", #effect),                  \
         .unit = "1",                                                 \
         .kind = rt::Command::effect_gain,                            \
         .target = static_cast<std::uint64_t>(rt::effect_##effect)}); \
  }
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
}

const Parameter* Parameters::find(std::string_view name) const {
  for (const Parameter& p : all_) {
    if (p.name == name) {
      return &p;
    }
  }
  return nullptr;
}

tl::expected<rt::Command, std::string> Parameters::command(std::string_view name, double value) const {
  const Parameter* p = find(name);
  if (p == nullptr) {
    return tl::unexpected(std::string("this station has no such parameter"));
  }
  const double least = p->least / p->unit_SI, most = p->most / p->unit_SI;
  // Not a number is in no range; what is hardly more than nothing may be nothing in SI units.
  const double value_SI = value * p->unit_SI;
  if (!((p->above_least ? value > least && value_SI > p->least : value >= least) && value <= most)) {
    return tl::unexpected(fmt::format("{}: allowed: {} {:g} to {:g} {}", p->name,
                                      p->above_least ? "more than" : "from", least, most, p->unit));
  }
  return rt::Command{p->kind, std::clamp(value_SI, p->least, p->most), p->target};
}

tl::expected<rt::Command, std::string> Parameters::undo(std::string_view name) const {
  const Parameter* p = find(name);
  if (p == nullptr) {
    return tl::unexpected(std::string("this station has no such parameter"));
  }
  return rt::Command{p->kind, p->before, p->target};
}

std::string Parameters::in_words(std::string_view name, const rt::Command& command) const {
  const Parameter* p = find(name);
  if (p == nullptr) {
    return std::string(name);
  }
  return fmt::format("{} = {:g}{}", p->name, command.value / p->unit_SI, p->unit == "1" ? "" : " " + p->unit);
}

bool Parameters::took(const rt::Event& event, const std::string& who) {
  if (event.kind != rt::Event::command) {
    return false;
  }
  for (Parameter& p : all_) {
    if (event.what == p.kind && (p.kind != rt::Command::effect_gain || event.target == p.target)) {
      p.before = p.value;
      p.value = event.value;
      p.who = who;
      p.changed_s = event.t_s;
      return true;
    }
  }
  return false;
}

std::string Parameters::json() const {
  nlohmann::ordered_json list = nlohmann::json::array();
  for (const Parameter& p : all_) {
    list.push_back({{"name", p.name},
                    {"unit", p.unit},
                    {"least", p.least / p.unit_SI},
                    {"above_least", p.above_least},
                    {"most", p.most / p.unit_SI},
                    {"value", p.value / p.unit_SI},
                    {"before", p.before / p.unit_SI},
                    {"who", p.who},
                    {"changed_s", p.changed_s}});
  }
  return nlohmann::json{{"parameters", std::move(list)}}.dump(-1, ' ', false,
                                                              nlohmann::json::error_handler_t::replace);
}

}  // namespace punctum::console
