// A mouse, a gamepad or a keyboard made with uinput: behind its device file all of the kernel's input code is
// real; what is outside, fingers and cable, is this object. Needs root.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/uinput.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace punctum::loopback {

inline constexpr const char* kUinput = "/dev/uinput";
inline constexpr int kStickMax = 32767;

struct InputModel {
  std::string name;
  std::vector<int> keys, relative, absolute;
};

inline InputModel mouse_model() {
  return {
      "Test Mouse", {BTN_LEFT, BTN_RIGHT, BTN_MIDDLE, BTN_SIDE}, {REL_X, REL_Y, REL_WHEEL, REL_HWHEEL}, {}};
}
inline InputModel gamepad_model() {
  return {"Test Pad",
          {BTN_SOUTH, BTN_EAST, BTN_NORTH, BTN_WEST, BTN_TL, BTN_TR, BTN_START},
          {},
          {ABS_X, ABS_Y, ABS_RX, ABS_RY}};
}
inline InputModel knob_model() {
  return {"Test SpaceMouse", {BTN_0, BTN_1}, {REL_X, REL_Y, REL_Z, REL_RX, REL_RY, REL_RZ}, {}};
}
inline InputModel keyboard_model() { return {"Test Keyboard", {KEY_A, KEY_B, KEY_ENTER}, {}, {}}; }

class VirtualInput {
 public:
  explicit VirtualInput(const InputModel& model) : file_(::open(kUinput, O_WRONLY | O_CLOEXEC)) {
    EXPECT_GE(file_, 0);
    const auto can = [this](unsigned long request, int type, unsigned long code_request,
                            const std::vector<int>& codes) {
      if (!codes.empty()) {
        EXPECT_EQ(ioctl(file_, request, type), 0);
      }
      for (const int code : codes) {
        EXPECT_EQ(ioctl(file_, code_request, code), 0);
      }
    };
    can(UI_SET_EVBIT, EV_KEY, UI_SET_KEYBIT, model.keys);
    can(UI_SET_EVBIT, EV_REL, UI_SET_RELBIT, model.relative);
    can(UI_SET_EVBIT, EV_ABS, UI_SET_ABSBIT, model.absolute);
    for (const int code : model.absolute) {
      uinput_abs_setup axis{};
      axis.code = static_cast<__u16>(code);
      axis.absinfo.minimum = -kStickMax - 1;
      axis.absinfo.maximum = kStickMax;
      EXPECT_EQ(ioctl(file_, UI_ABS_SETUP, &axis), 0);
    }
    uinput_setup setup{};
    setup.id.bustype = BUS_VIRTUAL;
    std::strncpy(setup.name, model.name.c_str(), sizeof(setup.name) - 1);
    EXPECT_EQ(ioctl(file_, UI_DEV_SETUP, &setup), 0);
    EXPECT_EQ(ioctl(file_, UI_DEV_CREATE), 0);
    char sysname[64] = {};
    EXPECT_GE(ioctl(file_, UI_GET_SYSNAME(sizeof(sysname)), sysname), 0);
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string("/sys/devices/virtual/input/") + sysname)) {
      if (const std::string name = entry.path().filename(); name.starts_with("event")) {
        path_ = "/dev/input/" + name;
      }
    }
    EXPECT_FALSE(path_.empty());
  }
  ~VirtualInput() { unplug(); }
  VirtualInput(const VirtualInput&) = delete;
  VirtualInput& operator=(const VirtualInput&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  void emit(int type, int code, int value) const {
    input_event event{};
    event.type = static_cast<__u16>(type);
    event.code = static_cast<__u16>(code);
    event.value = value;
    EXPECT_EQ(::write(file_, &event, sizeof(event)), static_cast<ssize_t>(sizeof(event)));
  }
  void report() const { emit(EV_SYN, SYN_REPORT, 0); }
  void press(int key, bool down) const {
    emit(EV_KEY, key, down ? 1 : 0);
    report();
  }
  void move(int axis, int counts) const {
    emit(EV_REL, axis, counts);
    report();
  }
  void deflect(int axis, int value) const {
    emit(EV_ABS, axis, value);
    report();
  }
  void unplug() {
    if (file_ >= 0) {
      ioctl(file_, UI_DEV_DESTROY);
      ::close(file_);
    }
    file_ = -1;
  }

 private:
  int file_;
  std::string path_;
};

}  // namespace punctum::loopback
