#include "tools/emulators/world/safety_chain.hpp"

#include <cmath>
#include <utility>

namespace punctum::emulator {
namespace {

constexpr std::int64_t kResetFor_ns = 100'000'000;

}  // namespace

SafetyChain::SafetyChain(const sim::SimConfig& config, GpioWires wires, WiredWorld& world,
                         std::int64_t now_ns, const SafetyLines& lines)
    : wires_(std::move(wires)),
      world_(world),
      heartbeat_(wires_.value_file(lines.heartbeat)),
      gate_(wires_.value_file(lines.gate)),
      contact_a_{lines.contact_a, true},
      contact_b_{lines.contact_b, true},
      reset_{lines.reset, false},
      there_(wires_.drive(lines.contact_a, true) && wires_.drive(lines.contact_b, true) &&
             wires_.drive(lines.reset, false) && heartbeat_.is_there() && gate_.is_there()),
      relay_(config),
      began_ns_(now_ns),
      stepped_ns_(now_ns) {
  if (config.injector) {
    injector_.emplace(*config.injector, config.seed);
  }
  relay_.step(now_ns, 0, 0, false, {});
}

bool SafetyChain::step(std::int64_t now_ns) {
  const auto since_s = [this](std::int64_t t_ns) { return static_cast<double>(t_ns - began_ns_) * 1e-9; };
  const bool was_powered = power(), resets = now_ns < reset_until_ns_;
  relay_.heartbeat(heartbeat_.level());
  relay_.step(now_ns, since_s(stepped_ns_), since_s(now_ns), resets, {});
  if (power() != was_powered) {
    world_.tell(now_ns, power() ? "the relay closes: the drives may have power"
                                : "the relay opens: the drives are without power");
  }
  const bool closed_a = a_closed_ && relay_.state().contact_a_closed != 0;
  const bool closed_b = b_closed_ && relay_.state().contact_b_closed != 0;
  there_ = there_ && put(contact_a_, closed_a, now_ns, "contact a is closed", "contact a is open") &&
           put(contact_b_, closed_b, now_ns, "contact b is closed", "contact b is open") &&
           put(reset_, resets, now_ns, "reset is pressed", "reset is let go") && heartbeat_.is_there();
  if (injector_) {
    const bool gate_is_open = gate_.level();
    injector_->gate(gate_is_open);
    injector_->step(now_ns, since_s(now_ns) - since_s(stepped_ns_), power(), {});
    if (gate_is_open != gate_was_open_) {
      world_.tell(now_ns, gate_is_open ? "the injector's gate opens" : "the injector's gate shuts");
    }
    gate_was_open_ = gate_is_open;
    hal::InjectorState valve;
    if (injector_->read(valve) == hal::Status::ok && valve.open != valve_was_open_) {
      const double delivered_s = injector_->state().delivered_s;
      if (!valve.open) {
        world_.tell(now_ns, "its valve is shut; it was open for " +
                                std::to_string(std::lround(1e3 * (delivered_s - dose_before_s_))) + " ms");
        dose_before_s_ = delivered_s;
      }
      valve_was_open_ = valve.open;
    }
  }
  stepped_ns_ = now_ns;
  return there_;
}

bool SafetyChain::put(Wire& wire, bool high, std::int64_t now_ns, const char* high_says,
                      const char* low_says) {
  if (wire.high == high) {
    return true;
  }
  wire.high = high;
  world_.tell(now_ns, high ? high_says : low_says);
  return wires_.drive(wire.line, high);
}

bool SafetyChain::command(std::string_view line, std::int64_t now_ns) {
  if (line == "reset") {
    reset_until_ns_ = now_ns + kResetFor_ns;
  } else if (line == "contact a open" || line == "contact a closed") {
    a_closed_ = line.ends_with("closed");
  } else if (line == "contact b open" || line == "contact b closed") {
    b_closed_ = line.ends_with("closed");
  } else {
    return false;
  }
  return true;
}

}  // namespace punctum::emulator
