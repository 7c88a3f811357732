#include "hal/zaber/zaber_positioner.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace punctum::zaber {
namespace {

using hal::Status;
using hal::Vec3;

constexpr int kTries = 2;       // every command may be sent twice: each says what shall be, not by how much
constexpr int kMostLines = 50;  // that are no answer, before one that is
constexpr int kIds = 100;

std::string name_of(const AxisParams& axis) {
  return "device " + std::to_string(axis.device) + " axis " + std::to_string(axis.axis);
}

// "/1 2", as every command to an axis begins.
std::string address_of(const AxisParams& axis) {
  std::string text(1, '/');
  text += std::to_string(axis.device);
  text += ' ';
  text += std::to_string(axis.axis);
  return text;
}

// F: a fault. W: what it says of its position, its motion or its supply is not to be trusted. N: notes, such
// as a knob that somebody turned.
bool is_fault(const std::array<char, 2>& flag) { return flag[0] == 'F' || flag[0] == 'W'; }

}  // namespace

// ---- one command, one answer ----

ZaberPositioner::Answer ZaberPositioner::ask(const AxisParams& axis, std::string_view command) {
  Answer answer;
  for (int attempt = 0; attempt < kTries && answer.status == Status::no_data; ++attempt) {
    id_ = (id_ + 1) % kIds;
    std::string line = address_of(axis);
    line += ' ';
    line += std::to_string(id_);
    line += ' ';
    line += command;
    line += "\r\n";
    answer.status = wire_->send(line);
    if (answer.status == Status::ok) {
      answer = wait_for(axis, id_);
    }
  }
  gone_ = gone_ || answer.status == Status::disconnected;
  return answer;
}

ZaberPositioner::Answer ZaberPositioner::wait_for(const AxisParams& axis, int id) {
  Answer answer;
  const auto timeout_ns = static_cast<std::int64_t>(params_.answer_s * 1e9);
  std::string line;
  const std::int64_t end_ns = clock_.now_ns() + timeout_ns;
  for (int i = 0; i < kMostLines; ++i) {
    answer.status = wire_->receive(line, std::max<std::int64_t>(end_ns - clock_.now_ns(), 0));
    if (answer.status != Status::ok) {
      return answer;
    }
    const auto reply = parse_reply(line);
    if (reply && reply->device == axis.device && reply->axis == axis.axis && reply->id == id) {
      answer.accepted = reply->ok;
      answer.busy = reply->busy;
      answer.flag = reply->flag;
      answer.data = reply->data;
      return answer;
    }
  }
  answer.status = Status::no_data;
  return answer;
}

// ---- the life of the device ----

tl::expected<double, std::string> ZaberPositioner::ask_number(const AxisParams& axis,
                                                              std::string_view command) {
  const Answer answer = ask(axis, command);
  const std::string title = params_.port + ": " + name_of(axis) + ": ";
  if (answer.status != Status::ok) {
    return tl::unexpected(title + "no answer, allowed: a Zaber device with ASCII protocol at 115200 baud");
  }
  if (!answer.accepted) {
    return tl::unexpected(title + "refuses \"" + std::string(command) + "\": " + answer.data);
  }
  if (answer.flag == std::array{'W', 'R'} || answer.flag == std::array{'W', 'H'}) {
    return tl::unexpected(
        title + "has not been homed since it got power: move the needle out of the way and send it \"" +
        address_of(axis) + " home\"");
  }
  if (is_fault(answer.flag)) {
    return tl::unexpected(title + "warns " + std::string(answer.flag.data(), 2) +
                          ": look it up in its manual, mend it, and send it \"" + address_of(axis) +
                          " warnings clear\"");
  }
  if (const auto number = number_of(answer.data)) {
    return static_cast<double>(*number);
  }
  return tl::unexpected(title + "answers \"" + std::string(command) + "\" with what is no number");
}

tl::expected<void, std::string> ZaberPositioner::open_axis(std::size_t axis) {
  const AxisParams& params = params_.axes[axis];
  double value[3] = {};
  const char* const commands[] = {"get pos", "get limit.min", "get limit.max"};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = ask_number(params, commands[i]);
    if (!number) {
      return tl::unexpected(number.error());
    }
    value[i] = params.microstep_m * *number;
  }
  const auto k = static_cast<Eigen::Index>(axis);
  at_m_[k] = value[0];
  least_m_[k] = std::min(value[1], value[2]);
  most_m_[k] = std::max(value[1], value[2]);
  return {};
}

tl::expected<void, std::string> ZaberPositioner::open() {
  queue_.clear();
  why_.clear();
  moving_ = gone_ = false;
  if (auto opened = wire_->open(); !opened) {
    return opened;
  }
  for (std::size_t axis = 0; axis < params_.axes.size(); ++axis) {
    if (auto opened = open_axis(axis); !opened) {
      wire_->close();
      return opened;
    }
  }
  return {};
}

hal::Served ZaberPositioner::served() noexcept {
  hal::Served served;
  served.positioner = this;
  return served;
}

void ZaberPositioner::safe_state() noexcept {
  try {
    stop();
  } catch (...) {  // no memory for a line
    gone_ = true;
  }
}

void ZaberPositioner::close() noexcept { wire_->close(); }

// ---- moves ----

// Whatever is wrong, nothing goes on.
void ZaberPositioner::fail(std::string why) {
  if (why_.empty()) {
    why_ = std::move(why);
  }
  stop();
}

bool ZaberPositioner::trusted(const AxisParams& axis, const Answer& answer) {
  if (answer.status != Status::ok) {
    fail(name_of(axis) + (gone_ ? ": the line is gone" : ": no answer"));
    return false;
  }
  if (is_fault(answer.flag)) {
    fail(name_of(axis) + ": warns " + std::string(answer.flag.data(), 2));
    return false;
  }
  if (!answer.accepted) {
    fail(name_of(axis) + ": rejected: " + answer.data);
    return false;
  }
  return true;
}

// Where every axis is. False: there is a fault now.
bool ZaberPositioner::look() {
  bool busy = false;
  Vec3 at_m;
  for (std::size_t i = 0; i < params_.axes.size(); ++i) {
    const AxisParams& axis = params_.axes[i];
    const Answer answer = ask(axis, "get pos");
    if (!trusted(axis, answer)) {
      return false;
    }
    const auto number = number_of(answer.data);
    if (!number) {
      fail(name_of(axis) + ": no position");
      return false;
    }
    at_m[static_cast<Eigen::Index>(i)] = axis.microstep_m * static_cast<double>(*number);
    busy = busy || answer.busy;
  }
  at_m_ = at_m;
  at_ns_ = clock_.now_ns();
  moving_ = busy;
  return true;
}

bool ZaberPositioner::begin(const Vec3& position_m) {
  for (std::size_t i = 0; i < params_.axes.size(); ++i) {
    const AxisParams& axis = params_.axes[i];
    const auto target =
        static_cast<long long>(std::llround(position_m[static_cast<Eigen::Index>(i)] / axis.microstep_m));
    moving_ = true;
    if (!trusted(axis, ask(axis, "move abs " + std::to_string(target)))) {
      return false;
    }
  }
  return true;
}

Status ZaberPositioner::read(hal::PositionerState& out) {
  if (why_.empty() && look() && !moving_ && !queue_.empty()) {
    const Vec3 next_m = queue_.front();
    queue_.pop_front();
    (void)begin(next_m);
  }
  if (gone_) {
    return Status::disconnected;
  }
  out.position_m = at_m_;
  out.queued = static_cast<int>(queue_.size());
  out.moving = moving_;
  out.fault = !why_.empty();
  out.sample_ns = at_ns_;
  return Status::ok;
}

bool ZaberPositioner::move_to(const Vec3& position_m) {
  const bool within =
      (position_m.array() >= least_m_.array()).all() && (position_m.array() <= most_m_.array()).all();
  if (!why_.empty() || !within || queue_.size() == kQueue || !look()) {
    return false;
  }
  if (moving_ || !queue_.empty()) {
    queue_.push_back(position_m);
    return true;
  }
  return begin(position_m);
}

void ZaberPositioner::stop() {
  queue_.clear();
  if (!gone_) {
    stop_axes();
  }
}

// All of them are told before any answer is waited for.
void ZaberPositioner::stop_axes() {
  std::string lines;
  for (const AxisParams& axis : params_.axes) {
    lines += address_of(axis);
    lines += " stop\r\n";
  }
  gone_ = wire_->send(lines) == Status::disconnected;
  for (const AxisParams& axis : params_.axes) {
    if (gone_) {
      return;
    }
    const Answer answer = ask(axis, "stop");
    if (answer.status != Status::ok && why_.empty()) {
      why_ = name_of(axis) + ": does not answer to \"stop\"";
    }
  }
}

}  // namespace punctum::zaber
