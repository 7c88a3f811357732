#include "tools/punctum/plugged_in.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <linux/videodev2.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>

#include "tools/punctum/kernel_watchdog.hpp"
#include "tools/scene/messages.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/module.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// The first line of a file in sysfs, as it is; empty where there is none.
std::string bytes_of(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

// The same, to be shown.
std::string line_of(const fs::path& file) { return printable(bytes_of(file), 100); }

// Names in a folder that begin so, video2 before video10.
std::vector<std::string> names_in(const fs::path& folder, std::string_view begin) {
  std::vector<std::string> names;
  std::error_code ec;
  for (auto it = fs::directory_iterator(folder, ec); !ec && it != fs::directory_iterator();
       it.increment(ec)) {
    if (std::string name = it->path().filename().string(); name.starts_with(begin)) {
      names.push_back(std::move(name));
    }
  }
  std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
    return std::pair(a.size(), a) < std::pair(b.size(), b);
  });
  return names;
}

bool is_there(const fs::path& file) {
  std::error_code ec;
  return fs::exists(file, ec);
}

// The codes of one type that an input device knows, from a bitmap of sysfs: hexadecimal words of the
// machine's size, the highest first.
template <std::size_t Count>
evdev::Codes<Count> codes_of(const fs::path& file) {
  constexpr std::size_t kWord = 8 * sizeof(unsigned long);
  std::istringstream in(bytes_of(file));
  std::vector<std::string> parts;
  for (std::string part; in >> part;) {
    parts.push_back(part);
  }
  evdev::Codes<Count> codes;
  for (std::size_t bit = 0; bit < std::min(Count, kWord * parts.size()); ++bit) {
    const unsigned long word = std::strtoul(parts[parts.size() - 1 - bit / kWord].c_str(), nullptr, 16);
    if ((word >> bit % kWord & 1) != 0) {
      codes.add(bit);
    }
  }
  return codes;
}

PluggedIn usb_place(const Machine& machine, const UsbDevice& usb, std::string place) {
  return {std::move(place),
          fmt::format("{} {} (USB {}:{}{}{})", usb.maker, usb.name, usb.vendor, usb.product,
                      usb.serial.empty() ? "" : ", serial number ", usb.serial),
          remedy_for(machine.at(usb.path), usb.path)};
}

}  // namespace

std::string remedy_for(const fs::path& file, const std::string& shown, int rights) {
  if (faccessat(AT_FDCWD, file.c_str(), rights, AT_EACCESS) == 0 || errno != EACCES) {
    return "";
  }
  struct stat about{};
  const group* owner =
      stat(file.c_str(), &about) == 0 && about.st_gid != 0 ? getgrgid(about.st_gid) : nullptr;
  return owner != nullptr
             ? fmt::format("{}: this user may not use it: sudo usermod -aG {} $USER, and log in again", shown,
                           owner->gr_name)
             : fmt::format("{}: this user may not use it: give it to a group of yours by a udev rule", shown);
}

std::vector<PluggedIn> gpio_chips(const Machine& machine) {
  std::vector<PluggedIn> found;
  for (const std::string& name : names_in(machine.at("/dev"), "gpiochip")) {
    const std::string path = "/dev/" + name;
    const auto chip = machine.open_chip(machine.at(path).string());
    if (!chip) {
      const std::string remedy = remedy_for(machine.at(path), path);
      found.push_back({path, "a GPIO chip", remedy.empty() ? path + ": " + chip.error() : remedy});
      continue;
    }
    const unsigned lines = (*chip)->line_count();
    std::string what = fmt::format("{}, {} lines", printable((*chip)->label(), 100), lines);
    for (unsigned i = 0; i < lines; ++i) {
      const gpiod::LineFacts facts = (*chip)->facts(i);
      if (!facts.name.empty() || facts.used) {
        what += fmt::format(", {}{}{}", i,
                            facts.name.empty() ? "" : fmt::format(" \"{}\"", printable(facts.name, 40)),
                            facts.used ? fmt::format(" used by {}", printable(facts.user, 40)) : "");
      }
    }
    found.push_back({path, what, ""});
  }
  return found;
}

std::vector<PluggedIn> can_interfaces(const Machine& machine) {
  std::vector<PluggedIn> found;
  for (const std::string& name : names_in(machine.at("/sys/class/net"), "")) {
    const auto link = machine.can_link(name);
    if (!link || !link->can) {
      continue;
    }
    found.push_back(
        {name,
         fmt::format("{}{}{}", link->kind.empty() ? "can" : link->kind, link->up ? ", up" : ", down",
                     link->bitrate != 0 ? fmt::format(", {} bit/s", link->bitrate) : ""),
         link->up ? "" : cia402::bring_up(name, cia402::CanStageParams{}.bitrate_kbit)});
  }
  return found;
}

std::vector<PluggedIn> v4l2_cameras(const Machine& machine) {
  std::vector<PluggedIn> found;
  for (const std::string& name : names_in(machine.at("/sys/class/video4linux"), "video")) {
    std::string path = "/dev/" + name;
    const std::string card = line_of(machine.at("/sys/class/video4linux") / name / "name");
    const v4l2::Answer opened = machine.video->open(machine.at(path).c_str());
    if (opened.value < 0) {
      const std::string remedy = remedy_for(machine.at(path), path);
      found.push_back({path, card, remedy.empty() ? path + ": " + std::strerror(opened.error) : remedy});
      continue;
    }
    v4l2_capability about{};
    const bool asked = machine.video->ioctl(opened.value, VIDIOC_QUERYCAP, &about).value >= 0;
    machine.video->close(opened.value);
    const std::uint32_t can =
        (about.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? about.device_caps : about.capabilities;
    // A camera has nodes of other kinds too.
    if (!asked || (can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
      continue;
    }
    // A name that stays the same when it is plugged in again.
    for (const std::string& id : names_in(machine.at("/dev/v4l/by-id"), "")) {
      std::error_code ec;
      if (fs::read_symlink(machine.at("/dev/v4l/by-id") / id, ec).filename() == name) {
        path = "/dev/v4l/by-id/" + id;
        break;
      }
    }
    found.push_back({path, card, ""});
  }
  return found;
}

std::vector<UsbDevice> usb_devices(const Machine& machine) {
  std::vector<UsbDevice> found;
  const fs::path folder = machine.at("/sys/bus/usb/devices");
  for (const std::string& name : names_in(folder, "")) {
    const fs::path device = folder / name;
    if (!is_there(device / "idVendor")) {
      continue;  // an interface
    }
    UsbDevice usb;
    usb.vendor = line_of(device / "idVendor");
    usb.product = line_of(device / "idProduct");
    usb.maker = line_of(device / "manufacturer");
    usb.name = line_of(device / "product");
    usb.serial = line_of(device / "serial");
    usb.path =
        fmt::format("/dev/bus/usb/{:0>3}/{:0>3}", line_of(device / "busnum"), line_of(device / "devnum"));
    // Class "miscellaneous", subclass 5: USB3 Vision.
    for (const std::string& interface : names_in(folder, name + ":")) {
      usb.vision = usb.vision || (line_of(folder / interface / "bInterfaceClass") == "ef" &&
                                  line_of(folder / interface / "bInterfaceSubClass") == "05");
    }
    found.push_back(std::move(usb));
  }
  return found;
}

std::vector<PluggedIn> usb_vision_cameras(const Machine& machine) {
  std::vector<PluggedIn> found;
  for (const UsbDevice& usb : usb_devices(machine)) {
    if (usb.vision) {
      found.push_back(usb_place(machine, usb, usb.maker + "-" + usb.serial));
    }
  }
  return found;
}

NetworkCameras network_cameras() {
  const auto list = function_of_module(aravis::kModule, aravis::kListNetworkCameras);
  if (!list) {
    return tl::unexpected(fmt::format("{} ({})", aravis::kNotInstalled, list.error()));
  }
  std::vector<aravis::NetworkCamera> cameras;
  reinterpret_cast<aravis::ListNetworkCameras>(*list)(cameras);
  return cameras;
}

std::vector<PluggedIn> gige_vision_cameras(const Machine& machine) {
  const NetworkCameras cameras = machine.ask_network();
  return cameras ? gige_vision_cameras(*cameras) : std::vector<PluggedIn>{{"", cameras.error(), ""}};
}

std::vector<PluggedIn> gige_vision_cameras(const std::vector<aravis::NetworkCamera>& cameras) {
  std::vector<PluggedIn> found;
  for (const aravis::NetworkCamera& camera : cameras) {
    found.push_back({printable(camera.name, 100),
                     printable(fmt::format("{} {} (GigE, serial number {}, at {})", camera.maker,
                                           camera.model, camera.serial, camera.address),
                               200),
                     ""});
  }
  return found;
}

std::vector<PluggedIn> falcons(const Machine& machine) {
  std::vector<PluggedIn> found;
  for (const UsbDevice& usb : usb_devices(machine)) {
    if (usb.vendor == "0403" && usb.product == "cb48") {
      found.push_back(usb_place(machine, usb, usb.path));
    }
  }
  return found;
}

std::vector<NumberedInput> input_devices(const Machine& machine) {
  std::vector<NumberedInput> found;
  for (const std::string& name : names_in(machine.at("/sys/class/input"), "event")) {
    const fs::path folder = machine.at("/sys/class/input") / name;
    const fs::path can = folder / "device/capabilities";
    NumberedInput one;
    one.device.path = "/dev/input/" + name;
    one.device.name = bytes_of(folder / "device/name");
    one.device.layout = evdev::layout_of(
        {codes_of<KEY_CNT>(can / "key"), codes_of<REL_CNT>(can / "rel"), codes_of<ABS_CNT>(can / "abs")});
    one.device.refused = remedy_for(machine.at(one.device.path), one.device.path, R_OK);
    one.number = line_of(folder / "dev");
    found.push_back(std::move(one));
  }
  return found;
}

std::vector<PluggedIn> hand_inputs(const Machine& machine) {
  std::vector<PluggedIn> found;
  for (const auto& [device, number] : input_devices(machine)) {
    if (device.layout != nullptr) {
      found.push_back({device.path, fmt::format("{} ({})", printable(device.name, 100), device.layout->name),
                       device.refused});
    }
  }
  return found;
}

std::vector<PluggedIn> serial_ports(const Machine& machine) {
  std::vector<PluggedIn> found;
  std::set<std::string> named;
  for (const std::string& id : names_in(machine.at("/dev/serial/by-id"), "")) {
    const std::string path = "/dev/serial/by-id/" + id;
    std::error_code ec;
    const std::string to = fs::read_symlink(machine.at(path), ec).filename().string();
    named.insert(to);
    found.push_back({path, "serial port " + to, remedy_for(machine.at(path), path)});
  }
  for (const char* begin : {"ttyUSB", "ttyACM"}) {
    for (const std::string& name : names_in(machine.at("/dev"), begin)) {
      if (!named.contains(name)) {
        found.push_back(
            {"/dev/" + name, "serial port", remedy_for(machine.at("/dev/" + name), "/dev/" + name)});
      }
    }
  }
  return found;
}

std::vector<PluggedIn> watchdogs(const Machine& machine) {
  std::vector<PluggedIn> found;
  for (const std::string& name : names_in(machine.at("/sys/class/watchdog"), "watchdog")) {
    const fs::path device = machine.at("/sys/class/watchdog") / name;
    const std::string path = "/dev/" + name;
    const std::string identity = line_of(device / "identity");
    std::string what = identity.empty() ? "watchdog" : identity;
    if (const std::string timeout = line_of(device / "timeout"); !timeout.empty()) {
      what += ", " + timeout + " s";
    }
    std::string remedy = remedy_for(machine.at(path), path);
    if (line_of(device / "state") == "active") {
      remedy = path + ": somebody feeds it already (systemd: RuntimeWatchdogSec)";
    } else if (const std::string why = why_not_disarmed(device); !why.empty()) {
      remedy = path + ": " + why;
    }
    found.push_back({path, what, remedy});
  }
  return found;
}

const std::vector<PluggedKind>& plugged_kinds() {
  static const std::vector<PluggedKind> kinds = {
      {"GPIO chips", gpio_chips, "estop", "gpiod",
       "[estop]\n"
       "device = \"gpiod\"\n"
       "[gpiod]\n"
       "chip = \"{}\"\n"
       "# and its lines, as they are wired (hal/gpiod/README.md has those of other devices):\n"
       "# contact_a = 0\n"
       "# contact_b = 1\n"
       "# reset = 2\n"
       "# heartbeat = 3\n"},
      {"CAN interfaces", can_interfaces, "stage", "cia402",
       "[stage]\n"
       "device = \"cia402\"\n"
       "[mapping]\n"
       "max_tilt_rad = 0\n"
       "[cia402]\n"
       "interface = \"{}\"\n"
       "# and its drives, one to six, each a [[cia402.axis]] or here:\n"
       "# axis = [{node = 1, count_um = [0.04, 0, 0]}, {node = 2, count_um = [0, 0.04, 0]}, "
       "{node = 3, count_um = [0, 0, 0.04]}]\n"},
      {"V4L2 cameras", v4l2_cameras, "camera", "v4l2",
       "[camera]\n"
       "device = \"v4l2\"\n"
       "[v4l2]\n"
       "path = \"{}\"\n"},
      {"USB3 Vision cameras", usb_vision_cameras, "camera", "aravis",
       "[camera]\n"
       "device = \"aravis\"\n"
       "[aravis]\n"
       "name = \"{}\"\n"},
      {"GigE Vision cameras", [](const Machine& machine) { return gige_vision_cameras(machine); }, "camera",
       "aravis",
       "[camera]\n"
       "device = \"aravis\"\n"
       "[aravis]\n"
       "name = \"{}\"\n"},
      {"Novint Falcons", falcons, "haptic", "falcon",
       "[haptic]\n"
       "device = \"falcon\"\n"
       "[falcon]\n"},
      {"mice, gamepads, SpaceMice", hand_inputs, "haptic", "evdev",
       "[haptic]\n"
       "device = \"evdev\"\n"
       "force_max_N = 0\n"
       "[evdev]\n"
       "path = \"{}\"\n"},
      {"serial ports", serial_ports, "positioner", "zaber",
       "[positioner]\n"
       "device = \"zaber\"\n"
       "[zaber]\n"
       "port = \"{}\"\n"
       "# and its axes x, y and z, each a [[zaber.axis]] or here:\n"
       "# axis = [{device = 1}, {device = 2}, {device = 3}]\n"},
      {"watchdogs", watchdogs, "", "",
       "[watchdog]\n"
       "path = \"{}\"\n"},
  };
  return kinds;
}

std::string plugged_in(const Machine& machine) {
  std::string text;
  for (const PluggedKind& kind : plugged_kinds()) {
    const std::vector<PluggedIn> found = kind.list(machine);
    text += fmt::format("{}{}\n", kind.title, found.empty() ? ": none" : "");
    const auto device = known_backends().find(kind.table);
    const bool usable =
        *kind.table == '\0' || (device != known_backends().end() &&
                                std::ranges::find(device->second, kind.backend) != device->second.end());
    for (const PluggedIn& one : found) {
      if (one.place.empty()) {
        text += fmt::format("  {}\n", one.what);
        continue;
      }
      text += fmt::format("  {}  {}\n", one.place, one.what);
      if (!one.remedy.empty()) {
        text += fmt::format("      first: {}\n", one.remedy);
      }
      std::string lines = usable ? kind.lines : "# this program cannot use it\n";
      if (const auto place = lines.find("{}"); place != std::string::npos) {
        lines.replace(place, 2, one.place);
      }
      for (std::size_t at = 0; at < lines.size();) {
        const std::size_t end = lines.find('\n', at);
        text += "      " + lines.substr(at, end - at) + "\n";
        at = end + 1;
      }
    }
  }
  return text;
}

}  // namespace punctum::tools
