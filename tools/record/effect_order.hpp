// The force effects of a recording by their names: its build may have had them in another order than this
// one.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/forces/list.hpp"
#include "tools/wire/messages.hpp"

namespace punctum::tools {

class EffectOrder {
 public:
  // A recording that names none has the order of this build. The error: an effect that this build does not
  // know.
  [[nodiscard]] static tl::expected<EffectOrder, std::string> of(const v1::Scene& scene) {
    EffectOrder order;
    for (const std::string& name : scene.effect()) {
      const auto* const found = std::find(std::begin(rt::kEffectNames), std::end(rt::kEffectNames), name);
      if (found == std::end(rt::kEffectNames)) {
        return tl::unexpected(fmt::format("its force effect \"{}\" is none that this build knows", name));
      }
      order.places_.push_back(static_cast<std::uint32_t>(found - std::begin(rt::kEffectNames)));
    }
    return order;
  }

  // Both from the order of the recording into that of this build.
  void apply(v1::Telemetry& t) const {
    if (places_.empty()) {
      return;
    }
    double effect_N[rt::effect_count] = {};
    for (std::size_t i = 0; i < std::min(places_.size(), static_cast<std::size_t>(t.effect_n_size())); ++i) {
      effect_N[places_[i]] = t.effect_n(static_cast<int>(i));
    }
    t.mutable_effect_n()->Assign(std::begin(effect_N), std::end(effect_N));
  }
  void apply(v1::Event& e) const {
    const bool has_target = e.command() == v1::COMMAND_KIND_EFFECT_GAIN;
    if (has_target && e.target() < places_.size()) {
      e.set_target(places_[e.target()]);
    }
  }

 private:
  std::vector<std::uint32_t> places_;  // where this build has the recording's n-th one
};

}  // namespace punctum::tools
