#include "tools/emulators/positioner/positioner.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

namespace punctum::emulator {
namespace {

constexpr std::size_t kLongestLine = 256;
constexpr double kLargest = 1e9;  // microsteps

std::vector<std::string> words_of(std::string_view line) {
  std::istringstream in{std::string(line)};
  std::vector<std::string> words;
  for (std::string word; in >> word;) {
    words.push_back(word);
  }
  return words;
}

bool to_number(const std::string& word, double& number) {
  const char* const end = word.data() + word.size();
  const auto [at, error] = std::from_chars(word.data(), end, number);
  return error == std::errc{} && at == end && std::abs(number) <= kLargest;
}
bool to_small(const std::string& word, int& number) {
  const char* const end = word.data() + word.size();
  const auto [at, error] = std::from_chars(word.data(), end, number);
  return error == std::errc{} && at == end && number >= 0 && number <= 99;
}

unsigned sum_of(std::string_view text) {
  unsigned sum = 0;
  for (const char c : text) {
    sum += static_cast<unsigned char>(c);
  }
  return sum & 0xFFU;
}

}  // namespace

const char* const Positioner::kCommands =
    "stall DEVICE [AXIS] (it stops and says FS), knob DEVICE [AXIS] (it stops and says NI), unhome DEVICE "
    "[AXIS] (WR), stick DEVICE [AXIS] (its "
    "position hangs), "
    "flag XX DEVICE [AXIS], mute [N] (no answer, to the next N or for ever), speak, late MILLISECONDS, "
    "garbage N, "
    "broken N (answers cut short), reject REASON (of every move), accept, alert";

void Positioner::Axis::brake() {
  const double way = speed * speed / (2 * acceleration);
  target = std::round(std::clamp(at + (speed < 0 ? -way : way), std::min(at, min), std::max(at, max)));
}

// Towards the target at full speed, and so that it can still brake.
void Positioner::Axis::step(double dt_s) {
  if (!busy() || stuck) {
    return;
  }
  const double left = target - at;
  const double ahead = left < 0 ? -1 : 1;
  const double change = acceleration * dt_s;
  // Of the way that is left: this step's part at v, and v^2 / 2a to come to rest.
  const double can_brake = std::sqrt(change * change + 2 * acceleration * std::abs(left)) - change;
  const double wanted = ahead * std::min(top, can_brake);
  speed += std::clamp(wanted - speed, -change, change);
  const double way = speed * dt_s;
  if (std::abs(left) <= std::abs(way) + 0.5 && std::abs(speed) <= 2 * change) {
    at = target;
    speed = 0;
  } else {
    at += way;
  }
}

Positioner::Positioner(const PositionerParams& params) : params_(params) {
  Axis axis;
  axis.at = axis.target = params.start;
  axis.max = params.max_microsteps;
  axis.top = params.speed;
  axis.acceleration = params.acceleration;
  axis.homed = params.homed;
  axes_.assign(static_cast<std::size_t>(params.devices * params.axes), axis);
}

double Positioner::position(int device, int axis) const { return at(device, axis).at; }
double Positioner::speed(int device, int axis) const { return at(device, axis).speed; }

// A carriage return or a line feed ends a command; two of them, an empty line, which is none.
void Positioner::receive(std::string_view bytes, std::int64_t now_ns) {
  const std::string before = step(now_ns);
  out_ = before + out_;
  for (const char c : bytes) {
    if (c == '\r' || c == '\n') {
      if (!ignoring_ && !come_.empty()) {
        take_line(come_);
      }
      come_.clear();
      ignoring_ = false;
    } else if (come_.size() < kLongestLine) {
      come_ += c;
    } else {
      ignoring_ = true;
    }
  }
}

std::string Positioner::step(std::int64_t now_ns) {
  constexpr double kStep_s = 1e-3;
  constexpr std::int64_t kLongest_ns = 100'000'000'000;
  if (!begun_) {
    now_ns_ = now_ns;
    begun_ = true;
  }
  const std::int64_t end_ns = std::min(now_ns, now_ns_ + kLongest_ns);
  while (now_ns_ < end_ns) {
    const bool rest =
        std::none_of(axes_.begin(), axes_.end(), [](const Axis& a) { return a.busy() && !a.stuck; });
    const auto step_ns = rest ? end_ns - now_ns_ : std::min<std::int64_t>(1'000'000, end_ns - now_ns_);
    for (Axis& axis : axes_) {
      axis.step(std::min(1e-9 * static_cast<double>(step_ns), kStep_s));
    }
    now_ns_ += step_ns;
  }
  now_ns_ = std::max(now_ns_, now_ns);
  std::string text = std::move(out_);
  out_.clear();
  while (!delayed_.empty() && delayed_.front().at_ns <= now_ns_) {
    text += delayed_.front().text;
    delayed_.erase(delayed_.begin());
  }
  return text;
}

void Positioner::take_line(std::string line) {
  const std::size_t begin = line.rfind('/');
  if (begin == std::string::npos) {
    return;
  }
  Message message;
  line.erase(0, begin + 1);
  if (const std::size_t colon = line.rfind(':'); colon != std::string::npos) {
    unsigned told = 0;
    const char* const end = line.data() + line.size();
    const auto [at, error] = std::from_chars(line.data() + colon + 1, end, told, 16);
    if (line.size() != colon + 3 || error != std::errc{} || at != end ||
        ((sum_of(std::string_view(line).substr(0, colon)) + told) & 0xFFU) != 0) {
      return;  // a command with a wrong checksum is ignored
    }
    line.erase(colon);
    message.with_checksum = true;
  }
  message.words = words_of(line);
  int* const numbers[] = {&message.device, &message.axis, &message.id};
  for (int* const number : numbers) {
    if (message.words.empty() || !to_small(message.words.front(), *number)) {
      break;
    }
    message.words.erase(message.words.begin());
  }
  for (int device = 1; device <= params_.devices; ++device) {
    if (message.device == 0 || message.device == device) {
      answer(device, message);
    }
  }
}

void Positioner::answer(int device, const Message& message) {
  bool accepted = true;
  std::string data = "BADAXIS";
  const int axis = std::min(message.axis, params_.axes);
  if (message.axis <= params_.axes) {
    data = carry_out(device, message, accepted);
  } else {
    accepted = false;
  }
  bool busy = false;
  for (int a = 1; a <= params_.axes; ++a) {
    busy = busy || ((message.axis == 0 || message.axis == a) && at(device, a).busy());
  }
  char head[48];
  std::snprintf(head, sizeof(head), message.id >= 0 ? "@%02d %d %02d " : "@%02d %d ", device,
                message.axis % 10, message.id);
  say(std::string(head) + (accepted ? "OK " : "RJ ") + (busy ? "BUSY " : "IDLE ") + flag_of(device, axis) +
          " " + data,
      message.with_checksum);
}

// The gravest: a fault that somebody set, then a lost reference.
std::string Positioner::flag_of(int device, int axis) const {
  std::string flag = "--";
  for (int a = 1; a <= params_.axes; ++a) {
    if (axis != 0 && axis != a) {
      continue;
    }
    const Axis& one = at(device, a);
    flag = !one.homed && flag == "--" ? "WR" : flag;
    flag = !one.flag.empty() && flag[0] != 'F' ? one.flag : flag;
  }
  return flag;
}

std::string Positioner::carry_out(int device, const Message& message, bool& accepted) {
  const auto& words = message.words;
  if (words.empty()) {
    return "0";
  }
  if (words[0] == "warnings") {
    const std::string flag = flag_of(device, message.axis);
    for (int a = 1; a <= params_.axes && words.size() > 1 && words[1] == "clear"; ++a) {
      at(device, a).flag.clear();
    }
    return flag == "--" ? "00" : "01 " + flag;
  }
  if (words[0] == "tools" && words.size() > 1 && words[1] == "echo") {
    std::string data;
    for (std::size_t i = 2; i < words.size(); ++i) {
      data += (data.empty() ? "" : " ") + words[i];
    }
    return data.empty() ? "0" : data;
  }
  if (words[0] == "get" && words.size() == 2 && words[1] == "system.axiscount") {
    return std::to_string(params_.axes);
  }
  std::string data;
  for (int a = 1; a <= params_.axes; ++a) {
    if (message.axis != 0 && message.axis != a) {
      continue;
    }
    Axis& axis = at(device, a);
    const std::string one = words[0] == "get" || words[0] == "set" ? setting(axis, message, accepted)
                                                                   : move(axis, message, accepted);
    if (!accepted) {
      return one;
    }
    data = words[0] == "get" && !data.empty() ? data + " " + one : one;
  }
  return data;
}

std::string Positioner::move(Axis& axis, const Message& message, bool& accepted) {
  const auto& words = message.words;
  const auto reject = [&accepted](const char* why) {
    accepted = false;
    return std::string(why);
  };
  if (words[0] == "stop" || words[0] == "estop") {
    axis.brake();
    return "0";
  }
  if (words[0] == "home") {
    axis.target = axis.min;
    axis.homed = true;
    return "0";
  }
  if (words[0] != "move" || words.size() < 2) {
    return reject("BADCOMMAND");
  }
  if (!rejects_.empty()) {
    return reject(rejects_.c_str());
  }
  double value = 0;
  double target = 0;
  if (words[1] == "min" || words[1] == "max") {
    target = words[1] == "min" ? axis.min : axis.max;
  } else if (words[1] == "abs" || words[1] == "rel") {
    if (words.size() != 3 || !to_number(words[2], value)) {
      return reject("BADDATA");
    }
    target = std::round(words[1] == "abs" ? value : axis.target + value);
  } else {
    return reject("BADCOMMAND");
  }
  if (!axis.homed) {
    return reject("BADDATA");
  }
  if (target < axis.min || target > axis.max) {
    return reject("BADDATA");
  }
  axis.target = target;
  return "0";
}

std::string Positioner::setting(Axis& axis, const Message& message, bool& accepted) {
  const auto& words = message.words;
  struct Named {
    const char* name;
    double* value;
    double least;
  };
  const Named all[] = {{"pos", &axis.at, -kLargest},
                       {"maxspeed", &axis.top, 1},
                       {"accel", &axis.acceleration, 1},
                       {"limit.min", &axis.min, -kLargest},
                       {"limit.max", &axis.max, -kLargest}};
  for (const Named& one : all) {
    if (words.size() < 2 || words[1] != one.name) {
      continue;
    }
    if (words[0] == "get" && words.size() == 2) {
      return std::to_string(std::llround(*one.value));
    }
    double value = 0;
    if (words[0] != "set" || words.size() != 3 || !to_number(words[2], value) || value < one.least) {
      accepted = false;
      return "BADDATA";
    }
    *one.value = value;
    if (one.value == &axis.at) {
      axis.target = value;
      axis.speed = 0;
    }
    return "0";
  }
  accepted = false;
  return "BADCOMMAND";
}

void Positioner::say(const std::string& line, bool with_checksum) {
  std::string text = line;
  if (with_checksum) {
    char sum[8];
    std::snprintf(sum, sizeof(sum), ":%02X", (0x100U - sum_of(std::string_view(line).substr(1))) & 0xFFU);
    text += sum;
  }
  text += "\r\n";
  if (mute_ != 0) {
    mute_ = std::max(mute_ - 1, -1);
    return;
  }
  if (broken_ > 0) {
    --broken_;
    text = text.substr(0, text.size() / 2) + "\r\n";
  }
  if (garbage_ > 0) {
    --garbage_;
    text = "\x01\xff@@01\r\n!01 1 IDLE --\r\n#01 0 hello\r\n@99 9 OK\r\n\n" + text;
  }
  if (late_ns_ > 0) {
    delayed_.push_back({now_ns_ + late_ns_, text});
  } else {
    out_ += text;
  }
}

std::string Positioner::command(std::string_view line) {
  std::vector<std::string> words = words_of(line);
  if (words.empty()) {
    return "";
  }
  const std::string verb = words[0];
  words.erase(words.begin());
  const auto unknown = [&line] { return "\"" + std::string(line) + "\": unknown, allowed: " + kCommands; };
  std::string flag;
  if (verb == "flag") {
    if (words.empty() || words[0].size() != 2) {
      return unknown();
    }
    flag = words[0];
    words.erase(words.begin());
  }
  if (verb == "speak") {
    mute_ = 0;
    return "";
  }
  if (verb == "accept") {
    rejects_.clear();
    return "";
  }
  if (verb == "alert") {
    out_ += "!01 1 IDLE --\r\n";
    return "";
  }
  if (verb == "reject" && words.size() == 1) {
    rejects_ = words[0];
    return "";
  }
  int number = 0;
  const bool numbered = words.size() == 1 && to_small(words[0], number);
  if (verb == "mute" && words.empty()) {
    mute_ = -1;
    return "";
  }
  double value = 0;
  if (verb == "late" && words.size() == 1 && to_number(words[0], value) && value >= 0 && value <= 1e5) {
    late_ns_ = static_cast<std::int64_t>(value * 1e6);
    return "";
  }
  if (numbered && (verb == "mute" || verb == "garbage" || verb == "broken")) {
    (verb == "mute" ? mute_ : verb == "garbage" ? garbage_ : broken_) = number;
    return "";
  }
  int axis_number = 1;
  if (words.empty() || words.size() > 2 || !to_small(words[0], number) || number < 1 ||
      number > params_.devices ||
      (words.size() == 2 &&
       (!to_small(words[1], axis_number) || axis_number < 1 || axis_number > params_.axes))) {
    return unknown();
  }
  Axis& axis = at(number, axis_number);
  if (verb == "stall" || verb == "knob") {
    axis.target = axis.at;
    axis.speed = 0;
    axis.flag = verb == "stall" ? "FS" : "NI";
  } else if (verb == "unhome") {
    axis.homed = false;
  } else if (verb == "stick") {
    axis.stuck = true;
  } else if (verb == "flag") {
    axis.flag = flag;
  } else {
    return unknown();
  }
  return "";
}

}  // namespace punctum::emulator
