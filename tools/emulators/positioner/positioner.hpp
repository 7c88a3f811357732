// A chain of manipulators with the Zaber ASCII protocol, written from its manual and from nothing of
// hal/zaber.
//
// Bytes in, bytes out, at times that the caller gives: it runs behind a pseudo-terminal (main.cpp) as well as
// inside a test. Commands: home, move abs|rel|min|max, stop, estop, get and set of pos, maxspeed, accel,
// limit.min, limit.max, system.axiscount; warnings, warnings clear, tools echo, and an empty one. A message
// number and a checksum are answered in kind.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::emulator {

struct PositionerParams {
  int devices = 3;
  int axes = 1;  // of each device
  double max_microsteps = 533'333;
  double speed = 100'000;     // microsteps/s
  double acceleration = 1e6;  // microsteps/s^2
  double start = 200'000;
  bool homed = true;
};

class Positioner {
 public:
  explicit Positioner(const PositionerParams& params);

  void receive(std::string_view bytes, std::int64_t now_ns);
  // Up to now: axes move. What it has to send.
  [[nodiscard]] std::string step(std::int64_t now_ns);

  // A fault or a bad habit, as a line of words. Empty: done. Otherwise what is wrong.
  [[nodiscard]] std::string command(std::string_view line);
  static const char* const kCommands;

  [[nodiscard]] double position(int device, int axis = 1) const;
  [[nodiscard]] double speed(int device, int axis = 1) const;

 private:
  struct Axis {
    double at = 0, speed = 0, target = 0;
    double min = 0, max = 0, top = 0, acceleration = 0;
    bool homed = true;
    bool stuck = false;
    std::string flag = {};  // that somebody set
    [[nodiscard]] bool busy() const { return speed != 0 || at != target; }
    void brake();
    void step(double dt_s);
  };
  struct Message {
    int device = 0, axis = 0, id = -1;
    bool with_checksum = false;
    std::vector<std::string> words;
  };

  [[nodiscard]] const Axis& at(int device, int axis) const {
    return axes_[static_cast<std::size_t>((device - 1) * params_.axes + axis - 1)];
  }
  [[nodiscard]] Axis& at(int device, int axis) {
    return axes_[static_cast<std::size_t>((device - 1) * params_.axes + axis - 1)];
  }
  void take_line(std::string line);
  void answer(int device, const Message& message);
  [[nodiscard]] std::string carry_out(int device, const Message& message, bool& accepted);
  [[nodiscard]] std::string move(Axis& axis, const Message& message, bool& accepted);
  [[nodiscard]] std::string setting(Axis& axis, const Message& message, bool& accepted);
  [[nodiscard]] std::string flag_of(int device, int axis) const;
  void say(const std::string& line, bool with_checksum);

  PositionerParams params_;
  std::vector<Axis> axes_;
  std::int64_t now_ns_ = 0;
  bool begun_ = false;
  std::string come_, out_;
  bool ignoring_ = false;  // until the end of a line that is too long
  int mute_ = 0;           // so many answers more are not given; -1: none for ever
  int garbage_ = 0;        // so many answers more have garbage before them
  int broken_ = 0;         // so many answers more are cut
  std::int64_t late_ns_ = 0;
  std::string rejects_;  // why every move is rejected; empty: it is not
  struct Delayed {
    std::int64_t at_ns;
    std::string text;
  };
  std::vector<Delayed> delayed_;
};

}  // namespace punctum::emulator
