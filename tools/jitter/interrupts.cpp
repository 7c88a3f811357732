#include "tools/jitter/interrupts.hpp"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace punctum::jitter {
namespace {

namespace fs = std::filesystem;

std::string first_line_of(const fs::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

// The entries of a folder, sorted; none where it cannot be read.
std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    out.push_back(it->path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::optional<int> whole_number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

struct Thread {
  std::string comm;
  int priority = 0;
};

// By the numbers of their interrupts: "irq/24-xhci_hcd".
std::map<int, Thread> interrupt_threads(const std::string& root) {
  std::map<int, Thread> out;
  for (const fs::path& process : entries(root + "/proc")) {
    const std::string comm = first_line_of(process / "comm");
    int irq = 0;
    if (!comm.starts_with("irq/") ||
        std::from_chars(comm.data() + 4, comm.data() + comm.size(), irq).ec != std::errc{}) {
      continue;
    }
    // From the state on, which is field 3: 40 is the real-time priority, 41 the policy.
    const std::string stat = first_line_of(process / "stat");
    std::istringstream fields(stat.substr(std::min(stat.rfind(')') + 1, stat.size())));
    Thread thread{comm, 0};
    std::string field;
    for (int i = 3; i <= 41 && fields >> field; ++i) {
      if (i == 40) {
        thread.priority = whole_number(field).value_or(0);
      } else if (const auto policy = whole_number(field);
                 i == 41 && policy != SCHED_FIFO && policy != SCHED_RR) {
        thread.priority = 0;
      }
    }
    // A handler may have a second thread; the least urgent decides.
    const auto [at, first] = out.try_emplace(irq, thread);
    if (!first && thread.priority < at->second.priority) {
      at->second = thread;
    }
  }
  return out;
}

// A device by its link or folder in sysfs: the numbers of its interrupts, or of the nearest device above it
// that has any (of a USB device, the controller's).
std::set<int> numbers_of(const fs::path& device, const std::string& root) {
  std::error_code error;
  const fs::path top = fs::weakly_canonical(root + "/sys/devices", error);
  for (fs::path at = fs::canonical(device, error); !error && at != top && at.has_relative_path();
       at = at.parent_path()) {
    std::set<int> out;
    for (const fs::path& msi : entries(at / "msi_irqs")) {
      if (const auto number = whole_number(msi.filename().string())) {
        out.insert(*number);
      }
    }
    if (const auto number = whole_number(first_line_of(at / "irq")); out.empty() && number && *number > 0) {
      out.insert(*number);
    }
    if (!out.empty()) {
      return out;
    }
  }
  return {};
}

// Those that have a handler of this name.
std::set<int> numbers_named(const std::string& handler, const std::string& root) {
  std::set<int> out;
  for (const fs::path& irq : entries(root + "/proc/irq")) {
    std::error_code error;
    if (const auto number = whole_number(irq.filename().string());
        number && fs::is_directory(irq / handler, error)) {
      out.insert(*number);
    }
  }
  return out;
}

fs::path usb_device(const std::string& vendor, const std::string& product, const std::string& root) {
  for (const fs::path& device : entries(root + "/sys/bus/usb/devices")) {
    if (first_line_of(device / "idVendor") == vendor && first_line_of(device / "idProduct") == product) {
      return device;
    }
  }
  return {};
}

// The name of a device file without its folder; a link such as /dev/v4l/by-id/... is followed.
std::string device_file(const std::string& path, const std::string& root) {
  std::error_code error;
  const fs::path real = fs::canonical(root + path, error);
  return (error ? fs::path(path) : real).filename().string();
}

}  // namespace

std::vector<UsedDevice> used_devices(const tools::Scene& scene, const std::string& root) {
  const std::map<int, Thread> threads = interrupt_threads(root);
  std::vector<UsedDevice> out;
  const auto add = [&](const std::string& title, const fs::path& sysfs, std::string absent,
                       const std::string& handler = "") {
    UsedDevice device{.title = title, .absent = {}, .interrupts = {}};
    std::error_code error;
    if (sysfs.empty() || !fs::exists(sysfs, error)) {
      device.absent = std::move(absent);
    } else {
      std::set<int> numbers = numbers_of(sysfs, root);
      if (!handler.empty()) {
        numbers.merge(numbers_named(handler, root));
      }
      for (const int number : numbers) {
        const fs::path irq = fmt::format("{}/proc/irq/{}", root, number);
        Interrupt one{.number = number, .cpus = first_line_of(irq / "smp_affinity_list")};
        for (const fs::path& entry : entries(irq)) {
          if (fs::is_directory(entry, error)) {
            one.names.push_back(entry.filename().string());
          }
        }
        if (const auto thread = threads.find(number); thread != threads.end()) {
          one.thread = thread->second.comm;
          one.thread_priority = thread->second.priority;
        }
        if (!one.names.empty()) {
          device.interrupts.push_back(std::move(one));
        } else {
          device.idle = true;
        }
      }
    }
    out.push_back(std::move(device));
  };
  const tools::DeviceNames& names = scene.devices;
  const auto used_by = [](std::initializer_list<std::pair<const char*, const std::string*>> roles,
                          std::string_view backend) {
    std::string list;
    for (const auto& [role, name] : roles) {
      if (*name == backend) {
        list += (list.empty() ? "" : ", ") + std::string(role);
      }
    }
    return list;
  };
  if (names.haptic == tools::kFalcon) {
    add("haptic: falcon", usb_device("0403", "cb48", root), "no Falcon (USB 0403:cb48) is plugged in");
  }
  if (names.haptic == tools::kEvdev) {
    const std::string path = scene.evdev ? scene.evdev->path : "";
    fs::path found;
    if (!path.empty()) {
      found = root + "/sys/class/input/" + device_file(path, root);
    } else {
      for (const fs::path& event : entries(root + "/sys/class/input")) {
        const std::string called = first_line_of(event / "device" / "name");
        if (event.filename().string().starts_with("event") && !called.empty() && scene.evdev &&
            !scene.evdev->name.empty() && called.find(scene.evdev->name) != std::string::npos) {
          found = event;
          break;
        }
      }
    }
    add("haptic: evdev", found, "it has neither the path nor the name of an input device that is there");
  }
  if (const std::string roles =
          used_by({{"stage", &names.stage}, {"force sensor", &names.force_sensor}}, tools::kCia402);
      !roles.empty()) {
    const std::string interface = scene.cia402 ? scene.cia402->interface : "can0";
    add(fmt::format("{}: cia402 {}", roles, interface), root + "/sys/class/net/" + interface,
        fmt::format("there is no network interface {}", interface), interface);
  }
  if (const std::string roles = used_by({{"estop", &names.estop},
                                         {"enabling", &names.enabling},
                                         {"vacuum", &names.vacuum},
                                         {"injector", &names.injector}},
                                        tools::kGpiod);
      !roles.empty()) {
    const std::string chip = scene.gpiod ? scene.gpiod->chip : gpiod::GpiodParams{}.chip;
    add(fmt::format("{}: gpiod {}", roles, chip), root + "/sys/bus/gpio/devices/" + device_file(chip, root),
        fmt::format("there is no {}", chip));
  }
  if (names.camera == tools::kV4l2) {
    const std::string path = scene.v4l2 ? scene.v4l2->path : v4l2::V4l2Params{}.path;
    add(fmt::format("camera: v4l2 {}", path),
        root + "/sys/class/video4linux/" + device_file(path, root) + "/device",
        fmt::format("there is no {}", path));
  }
  if (names.camera == tools::kAravis) {
    // A USB3 Vision camera; where none is plugged in it is one on the network.
    for (const fs::path& interface : entries(root + "/sys/bus/usb/devices")) {
      if (first_line_of(interface / "bInterfaceClass") == "ef" &&
          first_line_of(interface / "bInterfaceSubClass") == "05") {
        add("camera: aravis, USB3 Vision", interface, "");
        break;
      }
    }
  }
  return out;
}

bool runs(const std::string& comm, const std::string& root) {
  const std::vector<fs::path> all = entries(root + "/proc");
  return std::any_of(all.begin(), all.end(),
                     [&](const fs::path& process) { return first_line_of(process / "comm") == comm; });
}

}  // namespace punctum::jitter
