#include "hal/gpiod/gpiod_devices.hpp"

#include <utility>

namespace punctum::gpiod {

using hal::Status;

// The level first, then the changes: one that comes in between is in this reading, not lost.
Status GpiodEstop::read_contact(Contact& contact, bool& closed, bool& pulse) NONBLOCKING {
  if (const Status read = contact.line->read(closed); read != Status::ok) {
    return read;
  }
  int changes = 0;
  if (const Status taken = contact.line->take_changes(changes); taken != Status::ok) {
    return taken;
  }
  // Closed before and after, a single change tells of an opening whose other edge was not kept. Closed now
  // and open before, the first change is the closing itself.
  pulse = pulse || (closed && changes >= (contact.closed ? 1 : 2));
  contact.closed = closed;
  return Status::ok;
}

Status GpiodEstop::read(hal::EstopState& out) NONBLOCKING {
  if (written_ != Status::ok) {
    return written_;
  }
  hal::EstopState state;
  state.sample_ns = clock_.now_ns();
  for (const Status status :
       {read_contact(a_, state.contact_a_closed, state.pulse_seen),
        read_contact(b_, state.contact_b_closed, state.pulse_seen), reset_->read(state.reset_pressed)}) {
    if (status != Status::ok) {
      return status;
    }
  }
  out = state;
  return Status::ok;
}

void GpiodEstop::heartbeat(bool level) NONBLOCKING { written_ = heartbeat_->write(level); }

void GpiodInjector::gate(bool open) NONBLOCKING { written_ = gate_->write(open); }

Status GpiodInjector::read(hal::InjectorState& out) NONBLOCKING {
  if (written_ != Status::ok) {
    return written_;
  }
  hal::InjectorState state;
  state.sample_ns = clock_.now_ns();
  bool active = false;
  if (const Status status = (valve_ ? valve_ : gate_)->read(active); status != Status::ok) {
    return status;
  }
  state.open = valve_ ? !active : active;
  out = state;
  return Status::ok;
}

GpiodDevices::GpiodDevices(GpiodParams params, GpiodParts parts, const hal::Clock& clock,
                           OpenChip open_chip_at)
    : params_(std::move(params)),
      parts_(parts),
      open_chip_at_(std::move(open_chip_at)),
      estop_(clock),
      injector_(clock) {}

tl::expected<void, std::string> GpiodDevices::open() {
  auto chip = open_chip_at_(params_.chip);
  if (!chip) {
    return tl::unexpected(
        params_.chip + ": " + chip.error() +
        ", allowed for gpiod.chip: the path of a GPIO chip that this user may use (gpiodetect "
        "lists them)");
  }
  chip_ = std::move(*chip);
  auto claimed = claim_all();
  if (!claimed) {
    close();
  }
  return claimed;
}

tl::expected<void, std::string> GpiodDevices::claim_all() {
  struct Wanted {
    bool there;
    const char* key;
    int offset;
    Use use;
    std::unique_ptr<Line>& into;
  };
  // Outputs first: they are in their safe state before anything else.
  for (const Wanted& wanted : {
           Wanted{parts_.estop, "heartbeat", params_.heartbeat, Use::output, estop_.heartbeat_},
           Wanted{parts_.injector, "gate", params_.gate, Use::output, injector_.gate_},
           Wanted{parts_.estop, "contact_a", params_.contact_a, Use::watched_input, estop_.a_.line},
           Wanted{parts_.estop, "contact_b", params_.contact_b, Use::watched_input, estop_.b_.line},
           Wanted{parts_.estop, "reset", params_.reset, Use::input, estop_.reset_},
           Wanted{parts_.injector && params_.valve_contact != kNotWired, "valve_contact",
                  params_.valve_contact, Use::input, injector_.valve_},
       }) {
    if (!wanted.there) {
      continue;
    }
    if (std::string error = claim(wanted.key, wanted.offset, wanted.use, wanted.into); !error.empty()) {
      return tl::unexpected(std::move(error));
    }
  }
  return {};
}

// Empty, or the line that says why not.
std::string GpiodDevices::claim(const char* key, int offset, Use use, std::unique_ptr<Line>& into) {
  const std::string title = std::string("gpiod.") + key + " = " + std::to_string(offset) + ": ";
  const unsigned lines = chip_->line_count();
  if (offset < 0 || static_cast<unsigned>(offset) >= lines) {
    return title + "no line of " + params_.chip + ", allowed: 0 to " +
           std::to_string(static_cast<int>(lines) - 1);
  }
  const bool closed_low = params_.contacts_closed == GpiodParams::Closed::low;
  LineRequest request{static_cast<unsigned>(offset), use};
  if (use != Use::output) {
    request.active_low = closed_low;
    if (params_.pull == GpiodParams::Pull::internal) {
      request.bias = closed_low ? Bias::pull_up : Bias::pull_down;
    }
  } else if (&into == &injector_.gate_) {
    request.active_low = params_.gate_opens_at == GpiodParams::Gate::low;
  }
  auto line = chip_->claim(request);
  if (!line) {
    return title + line.error() + ", allowed: a line of " + params_.chip +
           " that nothing else uses and that can do this (gpioinfo lists them)";
  }
  into = std::move(*line);
  return {};
}

hal::Served GpiodDevices::served() noexcept {
  hal::Served served;
  served.estop = parts_.estop ? &estop_ : nullptr;
  served.injector = parts_.injector ? &injector_ : nullptr;
  return served;
}

tl::expected<void, std::string> GpiodDevices::start(std::int64_t /*first_tick_ns*/) { return {}; }

void GpiodDevices::safe_state() noexcept {
  if (injector_.gate_) {
    injector_.gate(false);
  }
  if (estop_.heartbeat_) {
    estop_.heartbeat(false);
  }
}

void GpiodDevices::close() noexcept {
  safe_state();
  for (std::unique_ptr<Line>* line : {&injector_.gate_, &injector_.valve_, &estop_.heartbeat_,
                                      &estop_.a_.line, &estop_.b_.line, &estop_.reset_}) {
    line->reset();
  }
  chip_.reset();
}

}  // namespace punctum::gpiod
