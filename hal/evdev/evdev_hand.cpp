#include "hal/evdev/evdev_hand.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <grp.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <system_error>
#include <utility>
#include <vector>

#include "hal/evdev/which_hand.hpp"
#include "hal/kernel_call.hpp"

namespace punctum::evdev {
namespace {

using hal::Status;
using Unexpected = tl::unexpected<std::string>;

constexpr const char* kFolder = "/dev/input";
constexpr int kRounds = 4;  // of kAtOnce events in one reading; more wait for the next

Status status_of(int error) NONBLOCKING { return error == ENODEV ? Status::disconnected : Status::fault; }

std::string text_of(int error) { return std::generic_category().message(error); }

// What an opened device is.
InputDevice identify(const std::string& path, int file) {
  InputDevice found;
  found.path = path;
  std::array<char, 256> name{};
  if (ioctl(file, EVIOCGNAME(name.size() - 1), name.data()) >= 0) {
    found.name = name.data();
  }
  Abilities abilities;
  const auto fill = [file](unsigned type, auto& codes) {
    return ioctl(file, EVIOCGBIT(type, sizeof(codes.bits)), codes.bits.data()) >= 0;
  };
  if (fill(EV_KEY, abilities.keys) && fill(EV_REL, abilities.relative) && fill(EV_ABS, abilities.absolute)) {
    found.layout = layout_of(abilities);
  }
  return found;
}

int open_file(const std::string& path) { return ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC); }

// What a user who may not open it has to do.
std::string not_allowed(const std::string& path) {
  struct stat info{};
  const group* owner = stat(path.c_str(), &info) == 0 ? getgrgid(info.st_gid) : nullptr;
  const std::string name = owner != nullptr && info.st_gid != 0 ? owner->gr_name : "input";
  return path + ": this user may not read it: sudo usermod -aG " + name + " $USER, and log in again";
}

std::string refusal(const std::string& path, int error) {
  if (error == EACCES || error == EPERM) {
    return not_allowed(path);
  }
  return path + ": " + text_of(error) +
         ", allowed for evdev.path: an input device (/proc/bus/input/devices lists them)";
}

std::vector<std::string> input_paths() {
  std::vector<std::string> paths;
  if (DIR* folder = opendir(kFolder)) {
    while (const dirent* entry = readdir(folder)) {
      if (const std::string name = entry->d_name; name.starts_with("event")) {
        paths.push_back(std::string(kFolder) + "/" + name);
      }
    }
    closedir(folder);
  }
  // event2 before event10
  std::sort(paths.begin(), paths.end(), [](const std::string& a, const std::string& b) {
    return std::pair(a.size(), a) < std::pair(b.size(), b);
  });
  return paths;
}

// Those that are there; not one that cannot be opened for another reason than the user's rights.
std::vector<InputDevice> input_devices() {
  std::vector<InputDevice> devices;
  for (const std::string& path : input_paths()) {
    if (const int file = open_file(path); file >= 0) {
      devices.push_back(identify(path, file));
      ::close(file);
    } else if (errno == EACCES) {
      InputDevice shut;
      shut.path = path;
      shut.refused = not_allowed(path);
      devices.push_back(std::move(shut));
    }
  }
  return devices;
}

}  // namespace

tl::expected<void, std::string> EvdevHand::open() {
  std::string path = params_.path;
  if (path.empty()) {
    auto found = choose_hand(input_devices(), params_.name);
    if (!found) {
      return Unexpected(found.error());
    }
    path = std::move(*found);
  }
  const auto refuse = [this](std::string text) {
    close();
    return Unexpected(std::move(text));
  };
  file_ = open_file(path);
  if (file_ < 0) {
    return refuse(refusal(path, errno));
  }
  if (int version = 0; ioctl(file_, EVIOCGVERSION, &version) != 0) {
    return refuse(refusal(path, errno));
  }
  const InputDevice is = identify(path, file_);
  layout_ = is.layout;
  if (layout_ == nullptr) {
    return refuse(is_no_hand(is));
  }
  std::array<Range, 3> ranges;
  for (std::size_t i = 0; layout_->counts == Counts::positions && i < ranges.size(); ++i) {
    input_absinfo info{};
    if (ioctl(file_, EVIOCGABS(layout_->axes[i].code), &info) < 0 || info.minimum >= info.maximum) {
      return refuse(path + ": axis " + std::to_string(layout_->axes[i].code) + " of \"" + is.name +
                    "\" has no range");
    }
    ranges[i] = {info.minimum, info.maximum};
  }
  const int clock = CLOCK_MONOTONIC;
  if (ioctl(file_, EVIOCSCLOCKID, &clock) != 0) {
    return refuse(refusal(path, errno));
  }
  if (ioctl(file_, EVIOCGRAB, 1) != 0) {
    return refuse(path + ": \"" + is.name + "\" is taken by another program that keeps it to itself");
  }
  motion_.emplace(params_, *layout_, ranges);
  gone_ = Status::ok;
  return {};
}

hal::Served EvdevHand::served() noexcept {
  hal::Served served;
  served.haptic = this;
  return served;
}

// What is held from the beginning is no press.
tl::expected<void, std::string> EvdevHand::start(std::int64_t /*first_tick_ns*/) {
  return ask() == Status::ok ? tl::expected<void, std::string>{}
                             : Unexpected("the device is gone: " + text_of(errno));
}

void EvdevHand::close() noexcept {
  if (file_ >= 0) {
    ::close(file_);
  }
  file_ = -1;
  motion_.reset();
}

// A descriptor with O_NONBLOCK never waits for events.
Status EvdevHand::drain(std::int64_t now_ns) NONBLOCKING {
  for (int round = 0; round < kRounds; ++round) {
    const hal::Answer got =
        hal::kernel_call<::read>(file_, events_.data(), events_.size() * sizeof(input_event));
    if (got.value < 0) {
      return got.error == EAGAIN || got.error == EINTR ? Status::ok : status_of(got.error);
    }
    const std::size_t count = static_cast<std::size_t>(got.value) / sizeof(input_event);
    if (count == 0) {
      return Status::disconnected;
    }
    for (std::size_t i = 0; i < count; ++i) {
      motion_->take(events_[i], now_ns);
    }
  }
  return Status::ok;
}

// The ioctls, after events were lost, take the device's mutex, which the kernel holds for no longer than one
// of them.
Status EvdevHand::ask() NONBLOCKING {
  Keys held;
  std::array<int, 3> positions{};
  const hal::Answer keys = hal::kernel_call<::ioctl>(file_, EVIOCGKEY(sizeof(held.bits)), held.bits.data());
  if (keys.value < 0) {
    return status_of(keys.error);
  }
  for (std::size_t i = 0; layout_->counts == Counts::positions && i < positions.size(); ++i) {
    input_absinfo info{};
    const hal::Answer axis = hal::kernel_call<::ioctl>(file_, EVIOCGABS(layout_->axes[i].code), &info);
    if (axis.value < 0) {
      return status_of(axis.error);
    }
    positions[i] = info.value;
  }
  motion_->is(held, positions);
  return Status::ok;
}

Status EvdevHand::read(hal::HandState& out) NONBLOCKING {
  if (gone_ == Status::ok) {
    const std::int64_t now_ns = clock_.now_ns();
    gone_ = drain(now_ns);
    if (gone_ == Status::ok && motion_->wants_state()) {
      gone_ = ask();
    }
    if (gone_ == Status::ok) {
      out = motion_->at(now_ns);
    }
  }
  return gone_;
}

}  // namespace punctum::evdev
