// What is plugged in, and whether a scene's devices are, on a machine of this test's own: folders as sysfs
// and /dev have them, a GPIO chip, a camera, and messages of rtnetlink as rtnetlink(7) lays them out. The
// kernel's own: tests/loopback/plugged_in.
#include "tools/punctum/device_looks.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "hal/ipc/segment.hpp"
#include "tests/support/fake_video.hpp"
#include "tools/punctum/kernel_watchdog.hpp"
#include "tools/punctum/plugged_in.hpp"
#include "tools/scene/scene_keys.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Is = hal::Finding::Is;

const std::string kSmallest = "[haptic]\n[stage]\n[sim.operator]\n[sim.needle]\n";
const std::string kWired =
    kSmallest +
    "[estop]\ndevice = \"gpiod\"\n[injector]\ndevice = \"gpiod\"\n[gpiod]\nchip = \"/dev/gpiochip0\"\n"
    "contact_a = 0\ncontact_b = 1\nreset = 2\nheartbeat = 3\ngate = 4\n";
const std::string kOnTheBus =
    "[haptic]\n[sim.operator]\n[stage]\ndevice = \"cia402\"\n[mapping]\nmax_tilt_rad = 0\n[cia402]\n"
    "[[cia402.axis]]\nnode = 1\ncount_um = [0.04, 0, 0]\n[[cia402.axis]]\nnode = 2\ncount_um = [0, 0.04, 0]\n"
    "[[cia402.axis]]\nnode = 3\ncount_um = [0, 0, 0.04]\n";
const std::string kWatched = kSmallest +
                             "[camera]\ndevice = \"v4l2\"\nwidth_px = 640\nheight_px = 480\n[v4l2]\npath = "
                             "\"/dev/video0\"\n[vision]\nmethod = \"paper\"\ninner = false\n";

// ---- a message of rtnetlink ----

class Message {
 public:
  Message(std::uint16_t device_type, unsigned flags) : bytes_(NLMSG_SPACE(sizeof(ifinfomsg))) {
    ifinfomsg info{};
    info.ifi_type = device_type;
    info.ifi_flags = flags;
    std::memcpy(&bytes_[NLMSG_HDRLEN], &info, sizeof info);
  }
  template <class T>
  Message& add(std::uint16_t type, const T& value) {
    return add(type, &value, sizeof value);
  }
  Message& add(std::uint16_t type, const char* text) { return add(type, text, std::strlen(text) + 1); }
  [[nodiscard]] std::size_t begin(std::uint16_t type) {
    const std::size_t at = bytes_.size();
    add(type, nullptr, 0);
    return at;
  }
  void end(std::size_t at) { put(at, static_cast<std::uint16_t>(bytes_.size() - at)); }
  [[nodiscard]] std::vector<std::byte> done() {
    nlmsghdr head{};
    head.nlmsg_type = RTM_NEWLINK;
    head.nlmsg_len = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &head, sizeof head);
    return bytes_;
  }

 private:
  void put(std::size_t at, std::uint16_t length) { std::memcpy(&bytes_[at], &length, sizeof length); }
  Message& add(std::uint16_t type, const void* value, std::size_t size) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + RTA_SPACE(size));
    put(at, static_cast<std::uint16_t>(RTA_LENGTH(size)));
    std::memcpy(&bytes_[at + 2], &type, sizeof type);
    if (size > 0) {
      std::memcpy(&bytes_[at + RTA_LENGTH(0)], value, size);
    }
    return *this;
  }
  std::vector<std::byte> bytes_;
};

std::vector<std::byte> controller(std::uint32_t bitrate, std::uint32_t restart_ms = 0,
                                  std::uint32_t queue = 128, std::uint32_t state = CAN_STATE_ERROR_ACTIVE,
                                  unsigned flags = IFF_UP) {
  Message m(ARPHRD_CAN, flags);
  m.add(IFLA_IFNAME, "can0").add(IFLA_TXQLEN, queue);
  const std::size_t link = m.begin(IFLA_LINKINFO);
  m.add(IFLA_INFO_KIND, "can");
  const std::size_t data = m.begin(IFLA_INFO_DATA);
  can_bittiming timing{};
  timing.bitrate = bitrate;
  m.add(IFLA_CAN_BITTIMING, timing).add(IFLA_CAN_STATE, state).add(IFLA_CAN_RESTART_MS, restart_ms);
  m.end(data);
  m.end(link);
  return m.done();
}

// ---- a machine ----

class OneChip final : public gpiod::Chip {
 public:
  explicit OneChip(const std::map<unsigned, gpiod::LineFacts>& facts) : facts_(facts) {}
  unsigned line_count() const override { return 5; }
  std::string label() const override { return "a board"; }
  gpiod::LineFacts facts(unsigned offset) const override {
    const auto found = facts_.find(offset);
    return found == facts_.end() ? gpiod::LineFacts{} : found->second;
  }
  tl::expected<std::unique_ptr<gpiod::Line>, std::string> claim(const gpiod::LineRequest&) override {
    ADD_FAILURE() << "a look claims nothing";
    return tl::unexpected(std::string("no"));
  }

 private:
  const std::map<unsigned, gpiod::LineFacts>& facts_;
};

class DeviceLooks : public testing::Test {
 protected:
  DeviceLooks() {
    std::string name = (fs::temp_directory_path() / "looksXXXXXX").string();
    machine.root = ::mkdtemp(name.data());
    machine.open_chip =
        [this](const std::string& path) -> tl::expected<std::unique_ptr<gpiod::Chip>, std::string> {
      if (!has_chip) {
        return tl::unexpected(std::string("No such file or directory"));
      }
      opened = path;
      return std::make_unique<OneChip>(lines);
    };
    machine.can_link = [this](const std::string& name_of_it) {
      return link && link->name == name_of_it ? link : std::nullopt;
    };
    machine.video = &video;
    machine.ask_network = [this]() -> NetworkCameras {
      return has_library ? NetworkCameras(network) : tl::unexpected(std::string("no library"));
    };
    video.width = 640;
    video.height = 480;
  }
  ~DeviceLooks() override { fs::remove_all(machine.root); }

  void file(const std::string& path, const std::string& text = "") const {
    fs::create_directories(machine.at(path).parent_path());
    std::ofstream(machine.at(path)) << text << "\n";
  }
  void link_to(const std::string& path, const std::string& target) const {
    fs::create_directories(machine.at(path).parent_path());
    fs::create_symlink(target, machine.at(path));
  }
  // What `check` finds: "device: ok|note|MISSING line", one after the other.
  [[nodiscard]] std::string look(const std::string& text) const {
    const auto scene = parse_scene(text, "s.toml");
    EXPECT_TRUE(scene) << scene.error();
    std::string found;
    for (const DeviceFinding& one : scene ? look_at_devices(*scene, machine) : std::vector<DeviceFinding>{}) {
      found += one.device + ": " +
               (one.finding.is == Is::found  ? "ok "
                : one.finding.is == Is::note ? "note "
                                             : "MISSING ") +
               one.finding.line + "\n";
    }
    return found;
  }

  Machine machine;
  bool has_chip = true;
  std::string opened;
  std::map<unsigned, gpiod::LineFacts> lines;
  std::optional<cia402::CanLink> link;
  tests::FakeVideo video;
  bool has_library = true;
  std::vector<aravis::NetworkCamera> network;
};

testing::AssertionResult says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos ? testing::AssertionSuccess()
                                               : testing::AssertionFailure() << text << "lacks: " << words;
}

TEST_F(DeviceLooks, every_backend_that_a_scene_may_name_has_one) {
  for (const auto& [device, backends] : known_backends()) {
    for (const std::string& backend : backends) {
      EXPECT_NE(std::ranges::find(device_looks(), backend, &DeviceLook::backend), device_looks().end())
          << device << ": " << backend;
    }
  }
}

TEST_F(DeviceLooks, simulated_devices_are_told_as_such_each_in_a_line) {
  EXPECT_EQ(look(kSmallest + "[force_sensor]\n"),
            "haptic: ok simulated\nstage: ok simulated\nestop: ok simulated\nforce_sensor: ok simulated\n");
}

TEST_F(DeviceLooks, a_chip_is_found_with_its_label_and_the_names_of_the_lines_each_device_uses) {
  lines[0].name = "STOP_A";
  lines[4].name = "VALVE";
  const std::string found = look(kWired);
  EXPECT_TRUE(says(found,
                   "estop: ok gpiod: /dev/gpiochip0 (a board, 5 lines), heartbeat 3, contact_a 0 "
                   "\"STOP_A\", contact_b 1, reset 2\n"));
  EXPECT_TRUE(says(found, "injector: ok gpiod: /dev/gpiochip0 (a board, 5 lines), gate 4 \"VALVE\"\n"));
}

TEST_F(DeviceLooks, an_enabling_device_is_a_button_of_the_handle_or_two_lines) {
  EXPECT_TRUE(says(look(kSmallest + "[enabling]\n"), "\nenabling: ok haptic: a button of the handle\n"));
  const std::string switch_on_line_3_and =
      "[enabling]\ndevice = \"gpiod\"\n[gpiod]\nenabling_a = 3\nenabling_b = ";
  EXPECT_TRUE(says(look(kSmallest + switch_on_line_3_and + "4\n"),
                   "enabling: ok gpiod: /dev/gpiochip0 (a board, 5 lines), enabling_a 3, enabling_b 4\n"));
  EXPECT_TRUE(says(look(kSmallest + switch_on_line_3_and + "5\n"),
                   "enabling: MISSING gpiod: gpiod.enabling_b = 5: no line of /dev/gpiochip0, allowed: 0 to "
                   "4\n"));
}

TEST_F(DeviceLooks, a_vacuum_on_lines_is_a_switch_and_a_gate) {
  EXPECT_TRUE(says(look(kSmallest + "[vacuum]\ndevice = \"gpiod\"\nstill_s = 0\n[gpiod]\nvacuum_switch = 1\n"
                                    "vacuum_switch_kPa = 1\nvacuum_gate = 2\n"),
                   "vacuum: ok gpiod: /dev/gpiochip0 (a board, 5 lines), vacuum_gate 2, vacuum_switch 1\n"));
}

TEST_F(DeviceLooks, a_chip_a_line_and_a_free_line_that_are_not_there_are_a_line_each) {
  lines[3] = {"", true, "leds"};
  const std::string found = look(kWired + "valve_contact = 9\n");
  EXPECT_TRUE(
      says(found, "estop: MISSING gpiod: gpiod.heartbeat = 3: is used by leds, allowed: a line that"));
  EXPECT_TRUE(says(found,
                   "injector: MISSING gpiod: gpiod.valve_contact = 9: no line of /dev/gpiochip0, "
                   "allowed: 0 to 4\n"));
  has_chip = false;
  EXPECT_TRUE(says(look(kWired),
                   "estop: MISSING gpiod: /dev/gpiochip0: No such file or directory, allowed "
                   "for gpiod.chip: the path of a GPIO chip that this user may use"));
}

TEST_F(DeviceLooks, a_bus_is_found_with_its_bit_rate_and_queue) {
  link = cia402::can_link_of(controller(1'000'000));
  ASSERT_TRUE(link);
  EXPECT_TRUE(says(look(kOnTheBus),
                   "stage: ok cia402: can0 (up, 1000000 bit/s, queue of 128 frames); asked "
                   "when it is opened: nodes 1 2 3\n"));
  EXPECT_FALSE(says(look(kOnTheBus), "MISSING"));
  EXPECT_FALSE(says(look(kOnTheBus), "note"));
}

TEST_F(DeviceLooks, a_bus_that_would_not_work_is_missing_with_the_command_that_helps) {
  const struct {
    const char* what;
    std::vector<std::byte> message;
    const char* line;
  } cases[] = {
      {"down", controller(1'000'000, 0, 128, CAN_STATE_STOPPED, 0),
       "MISSING cia402: can0: the interface is down: ip link set can0 txqueuelen 128 up type can bitrate "
       "1000000 restart-ms 0\n"},
      {"another rate", controller(500'000),
       "MISSING cia402: can0: runs at 500000 bit/s, and cia402.bitrate_kbit is 1000: ip link set can0 down"},
      {"a short queue", controller(1'000'000, 0, 10),
       "MISSING cia402: can0: its queue of 10 frames is too short: ip link set can0 txqueuelen 128\n"},
      {"bus-off", controller(1'000'000, 0, 128, CAN_STATE_BUS_OFF), "MISSING cia402: can0: is off the bus"},
      {"restarts by itself", controller(1'000'000, 100),
       "note cia402: can0: comes back by itself after bus-off (restart-ms 100)"},
      {"no CAN", Message(ARPHRD_ETHER, IFF_UP).add(IFLA_IFNAME, "can0").done(),
       "MISSING cia402: can0: is no CAN interface"},
  };
  for (const auto& c : cases) {
    link = cia402::can_link_of(c.message);
    ASSERT_TRUE(link) << c.what;
    EXPECT_TRUE(says(look(kOnTheBus), c.line)) << c.what;
  }
  link.reset();
  EXPECT_TRUE(says(look(kOnTheBus), "MISSING cia402: can0: there is no such CAN interface"));
}

TEST_F(DeviceLooks, a_virtual_bus_has_no_bit_rate_to_be_wrong) {
  Message m(ARPHRD_CAN, IFF_UP);
  m.add(IFLA_IFNAME, "can0").add(IFLA_TXQLEN, std::uint32_t{1000});
  const std::size_t info = m.begin(IFLA_LINKINFO);
  m.add(IFLA_INFO_KIND, "vcan");
  m.end(info);
  link = cia402::can_link_of(m.done());
  ASSERT_TRUE(link);
  EXPECT_TRUE(says(look(kOnTheBus), "stage: ok cia402: can0 (vcan, up, queue of 1000 frames)"));
}

TEST_F(DeviceLooks, a_message_cut_short_or_with_false_lengths_is_read_within_its_bytes) {
  const std::vector<std::byte> whole = controller(1'000'000);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    // In memory of its own, so that a sanitizer sees what is beyond.
    const std::vector<std::byte> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
    EXPECT_FALSE(cia402::can_link_of(part)) << n;
  }
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const unsigned value : {0x00U, 0x03U, 0x7fU, 0xffU}) {
      std::vector<std::byte> wrong = whole;
      wrong[i] = static_cast<std::byte>(value);
      (void)cia402::can_link_of(wrong);
    }
  }
}

TEST_F(DeviceLooks, a_camera_is_found_with_its_name_and_formats_and_nothing_of_it_is_set) {
  EXPECT_TRUE(
      says(look(kWatched), "camera: ok v4l2: /dev/video0 (a microscope camera), GREY 640 x 480 px\n"));
  EXPECT_FALSE(video.was_set);
  EXPECT_FALSE(video.is_open);
}

TEST_F(DeviceLooks, a_camera_that_another_program_streams_goes_on_streaming) {
  video.streams = true;
  (void)look(kWatched);
  EXPECT_EQ(video.stream_offs, 0);
}

TEST_F(DeviceLooks, a_camera_that_is_not_there_or_gives_another_picture_is_missing) {
  video.width = 320;
  EXPECT_TRUE(says(look(kWatched),
                   "MISSING v4l2: /dev/video0: camera.width_px and height_px: it does not give 640 "
                   "x 480 px, nearest: 320 x 480"));
  video.formats = {V4L2_PIX_FMT_YUYV};
  EXPECT_TRUE(says(look(kWatched),
                   "MISSING v4l2: /dev/video0: v4l2.format: it does not give GREY, it "
                   "offers: YUYV\n"));
  video.capabilities = V4L2_CAP_VIDEO_OUTPUT;
  EXPECT_TRUE(says(look(kWatched), "MISSING v4l2: /dev/video0: gives no pictures"));
  video.open_error = EACCES;
  EXPECT_TRUE(
      says(look(kWatched), "MISSING v4l2: /dev/video0: may not be opened: add the user to the group"));
}

TEST_F(DeviceLooks, a_usb_camera_of_genicam_is_found_by_maker_and_serial_number) {
  const std::string scene =
      kSmallest +
      "[camera]\ndevice = \"aravis\"\n[aravis]\nname = \"Basler-77\"\n[vision]\nmethod = "
      "\"paper\"\ninner = false\n";
  EXPECT_TRUE(says(look(scene),
                   "camera: MISSING aravis: Basler-77 is not on USB and does not answer on the "
                   "network, allowed for aravis.name: one that `punctum devices` shows\n"));
  for (const auto& [name, text] :
       {std::pair{"idVendor", "2676"}, std::pair{"idProduct", "ba02"}, std::pair{"manufacturer", "Basler"},
        std::pair{"product", "acA1300"}, std::pair{"serial", "77"}, std::pair{"busnum", "2"},
        std::pair{"devnum", "3"}}) {
    file(std::string("/sys/bus/usb/devices/2-1/") + name, text);
  }
  file("/sys/bus/usb/devices/2-1:1.0/bInterfaceClass", "ef");
  file("/sys/bus/usb/devices/2-1:1.0/bInterfaceSubClass", "05");
  has_library = false;  // it is not asked
  EXPECT_TRUE(says(look(scene), "camera: ok aravis: Basler acA1300 (USB 2676:ba02, serial number 77)"));
}

TEST_F(DeviceLooks, a_camera_on_the_network_is_found_by_its_name_or_address_or_missing_in_a_line) {
  const auto scene = [](const std::string& name) {
    return kSmallest + "[camera]\ndevice = \"aravis\"\n[aravis]\n" + name +
           "[vision]\nmethod = \"paper\"\ninner = false\n";
  };
  const std::string by_name = scene("name = \"FLIR-9\"\n"), the_only_one = scene("");
  EXPECT_TRUE(
      says(look(the_only_one),
           "camera: MISSING aravis: no camera is plugged in on USB, and none answers on the network\n"));
  network.push_back({"FLIR-BFS-9", "FLIR", "BFS", "9", "192.168.1.20"});
  const std::string found = "camera: ok aravis: FLIR BFS (GigE, serial number 9, at 192.168.1.20)\n";
  EXPECT_TRUE(says(look(by_name), found));
  EXPECT_TRUE(says(look(scene("name = \"FLIR-BFS-9\"\n")), found));
  EXPECT_TRUE(says(look(scene("name = \"192.168.1.20\"\n")), found));
  EXPECT_TRUE(says(look(scene("name = \"left\"\n")),
                   "camera: note aravis: left is not seen, but FLIR-BFS-9: "
                   "whether it is the same shows when it is opened\n"));
  EXPECT_TRUE(says(look(the_only_one), found));
  EXPECT_TRUE(says(look(scene("name = \"192.168.1.2\"\n")),
                   "camera: MISSING aravis: 192.168.1.2 is not on USB and does not answer on the network"));
  EXPECT_TRUE(says(look(scene("name = \"Fake_1\"\n")), "camera: note aravis: Fake_1 is a camera inside"));
  network.push_back({"Basler-3", "Basler", "acA640", "3", "192.168.1.21"});
  EXPECT_TRUE(says(look(the_only_one),
                   "camera: MISSING aravis: there are several cameras, allowed: "
                   "aravis.name = one of FLIR-BFS-9, Basler-3\n"));
  const std::string listed = plugged_in(machine);
  EXPECT_TRUE(says(listed,
                   "GigE Vision cameras\n  FLIR-BFS-9  FLIR BFS (GigE, serial number 9, at 192.168.1.20)\n"
                   "      [camera]\n      device = \"aravis\"\n      [aravis]\n      name = \"FLIR-BFS-9\"\n"
                   "  Basler-3  Basler acA640"));
  has_library = false;
  EXPECT_TRUE(says(look(by_name), "camera: MISSING aravis: no library\n"));
  EXPECT_TRUE(says(plugged_in(machine), "GigE Vision cameras\n  no library\nNovint Falcons: none\n"));
}

TEST_F(DeviceLooks, a_watchdog_is_asked_for_by_its_folder_and_never_opened) {
  const std::string scene = kSmallest + "[watchdog]\npath = \"/dev/watchdog0\"\n";
  EXPECT_TRUE(says(look(scene), "watchdog: MISSING /dev/watchdog0: no watchdog is there"));
  link_to("/dev/watchdog0", "/dev/null");
  file("/sys/class/watchdog/watchdog0/identity", "Software Watchdog");
  file("/sys/class/watchdog/watchdog0/timeout", "60");
  EXPECT_TRUE(says(look(scene), "watchdog: MISSING /dev/watchdog0: is no watchdog"));
  file("/sys/class/watchdog/watchdog0/dev", "1:3");  // as /dev/null, which stands for it
  EXPECT_TRUE(
      says(look(scene), "watchdog: MISSING /dev/watchdog0: nobody knows whether it could be disarmed"));
  file("/sys/class/watchdog/watchdog0/nowayout", "0");
  EXPECT_TRUE(says(look(scene), "watchdog: ok /dev/watchdog0 (Software Watchdog, 60 s)\n"));
  file("/sys/class/watchdog/watchdog0/nowayout", "1");
  EXPECT_TRUE(says(look(scene), "watchdog: MISSING /dev/watchdog0: could not be disarmed"));
  file("/sys/class/watchdog/watchdog0/state", "active");
  EXPECT_TRUE(says(look(scene), "watchdog: MISSING /dev/watchdog0: somebody feeds it already"));
}

TEST_F(DeviceLooks, a_watchdog_by_another_name_is_found_by_its_number) {
  link_to("/dev/the_watchdog", "/dev/null");
  for (const auto& [name, number, nowayout] :
       {std::tuple{"watchdog0", "248:0", "0"}, std::tuple{"watchdog1", "1:3", "1"}}) {
    file(std::string("/sys/class/watchdog/") + name + "/dev", number);
    file(std::string("/sys/class/watchdog/") + name + "/nowayout", nowayout);
  }
  EXPECT_TRUE(says(look(kSmallest + "[watchdog]\npath = \"/dev/the_watchdog\"\n"),
                   "watchdog: MISSING /dev/watchdog1: could not be disarmed"));
}

TEST_F(DeviceLooks, a_watchdog_may_be_armed_only_where_sysfs_says_that_it_can_be_disarmed_again) {
  const fs::path sysfs = machine.at("/sys");
  const auto why = [&](const char* device) {
    const auto may = may_be_armed(device, sysfs);
    return may ? std::string("it may") : may.error();
  };
  EXPECT_EQ(why("/dev/none"), "No such file or directory");
  EXPECT_EQ(why("/proc/version"), "is no watchdog, allowed: such as /dev/watchdog");
  EXPECT_EQ(why("/dev/null"), "is no watchdog, allowed: such as /dev/watchdog");
  file("/sys/class/watchdog/watchdog3/dev", "1:3");
  EXPECT_EQ(why("/dev/null"),
            "nobody knows whether it could be disarmed at the end of a run: " +
                (sysfs / "class/watchdog/watchdog3/nowayout").string() +
                " is missing, allowed: a watchdog whose driver and kernel tell it (CONFIG_WATCHDOG_SYSFS)");
  file("/sys/class/watchdog/watchdog3/nowayout", "1");
  EXPECT_EQ(
      why("/dev/null"),
      "could not be disarmed at the end of a run (its driver's option nowayout), allowed: with nowayout=0");
  file("/sys/class/watchdog/watchdog3/nowayout", "0");
  EXPECT_EQ(why("/dev/null"), "it may");
}

// A terminal's own end tells whether the other one was opened meanwhile.
TEST_F(DeviceLooks, a_watchdog_that_cannot_be_disarmed_is_not_opened) {
  const hal::Descriptor terminal(posix_openpt(O_RDWR | O_NOCTTY));
  ASSERT_GE(terminal.number(), 0);
  ASSERT_EQ(grantpt(terminal.number()), 0);
  ASSERT_EQ(unlockpt(terminal.number()), 0);
  WatchdogParams params;
  params.path = ptsname(terminal.number());
  struct stat about{};
  ASSERT_EQ(stat(params.path.c_str(), &about), 0);
  file("/sys/class/watchdog/watchdog0/dev",
       std::to_string(major(about.st_rdev)) + ":" + std::to_string(minor(about.st_rdev)));
  file("/sys/class/watchdog/watchdog0/nowayout", "1");
  const auto armed = KernelWatchdog().arm(params, machine.at("/sys"));
  ASSERT_FALSE(armed);
  EXPECT_EQ(armed.error(), "watchdog: " + params.path +
                               ": could not be disarmed at the end of a run (its driver's option nowayout), "
                               "allowed: with nowayout=0");
  pollfd was_opened{terminal.number(), POLLIN, 0};
  EXPECT_EQ(poll(&was_opened, 1, 0), 0);
}

TEST_F(DeviceLooks, what_is_plugged_in_is_listed_with_the_lines_that_would_use_it) {
  EXPECT_EQ(plugged_in(machine),
            "GPIO chips: none\nCAN interfaces: none\nV4L2 cameras: none\nUSB3 Vision cameras: none\n"
            "GigE Vision cameras: none\nNovint Falcons: none\nmice, gamepads, SpaceMice: none\nserial ports: "
            "none\nwatchdogs: none\n");
  file("/dev/gpiochip2");
  lines[1] = {"STOP_B", true, "punctum"};
  file("/sys/class/net/can0/type", "280");
  link = cia402::can_link_of(controller(500'000));
  file("/sys/class/video4linux/video3/name", "a microscope camera");
  link_to("/dev/v4l/by-id/usb-Maker_Camera_5-index0", "../../video3");
  file("/sys/class/watchdog/watchdog0/identity", "Software Watchdog");
  file("/sys/class/watchdog/watchdog0/nowayout", "0");
  const std::string text = plugged_in(machine);
  EXPECT_TRUE(says(text,
                   "GPIO chips\n  /dev/gpiochip2  a board, 5 lines, 1 \"STOP_B\" used by punctum\n"
                   "      [estop]\n      device = \"gpiod\"\n      [gpiod]\n      chip = "
                   "\"/dev/gpiochip2\"\n"));
  EXPECT_EQ(opened, machine.at("/dev/gpiochip2"));
  EXPECT_TRUE(says(text, "  can0  can, up, 500000 bit/s\n      [stage]\n      device = \"cia402\"\n"));
  EXPECT_TRUE(says(text, "      interface = \"can0\"\n"));
  EXPECT_TRUE(
      says(text, "  /dev/v4l/by-id/usb-Maker_Camera_5-index0  a microscope camera\n      [camera]\n"));
  EXPECT_TRUE(
      says(text, "  /dev/watchdog0  Software Watchdog\n      [watchdog]\n      path = \"/dev/watchdog0\"\n"));
}

// As /proc/bus/input/devices has them.
struct Input {
  const char *name, *key, *rel, *abs;
};
constexpr Input kKnob{"SpaceMouse Pro", "7fff 0 0 0 0", "3f", "0"};
constexpr Input kPad{"X-Box 360 pad", "7cdb000000000000 0 0 0 0", "0", "3003f"};
constexpr Input kMouse{"Optical Mouse", "1f0000 0 0 0 0", "903", "0"};
constexpr Input kKeyboard{"Keyboard (mouse)",
                          "1000000000007 ff9f207ac14057ff febeffdfffefffff fffffffffffffffe", "0", "0"};
// A joystick of six axes, whose buttons begin with the trigger, and a pad without shoulder buttons.
constexpr Input kJoystick{"Flight Stick", "fff00000000 0 0 0 0", "0", "3f"};
constexpr Input kOldPad{"Old Pad", "f000000000000 0 0 0 0", "0", "1b"};

// Event files that are /dev/null and /dev/zero, whose numbers are 1:3 and 1:5 on every Linux.
class InputLooks : public DeviceLooks {
 protected:
  void plug(int event, const Input& input, const char* number = "1:3") const {
    const std::string folder = "/sys/class/input/event" + std::to_string(event);
    file(folder + "/dev", number);
    file(folder + "/device/name", input.name);
    file(folder + "/device/capabilities/key", input.key);
    file(folder + "/device/capabilities/rel", input.rel);
    file(folder + "/device/capabilities/abs", input.abs);
    link_to("/dev/input/event" + std::to_string(event),
            number == std::string("1:3") ? "/dev/null" : "/dev/zero");
  }
  [[nodiscard]] std::string look_for(const std::string& keys) const {
    return look("[haptic]\ndevice = \"evdev\"\nforce_max_N = 0\n[evdev]\n" + keys +
                "[stage]\n[sim.needle]\n");
  }
};

TEST_F(InputLooks, those_are_listed_that_the_backend_takes_by_what_they_can) {
  int number = 8;
  for (const Input& input : {kKnob, kPad, kMouse, kKeyboard, kJoystick, kOldPad}) {
    plug(number++, input);
  }
  std::vector<std::string> found;
  for (const PluggedIn& one : hand_inputs(machine)) {
    found.push_back(one.place + " " + one.what);
  }
  EXPECT_EQ(found, (std::vector<std::string>{"/dev/input/event8 SpaceMouse Pro (SpaceMouse)",
                                             "/dev/input/event9 X-Box 360 pad (gamepad)",
                                             "/dev/input/event10 Optical Mouse (mouse)"}));
}

TEST_F(InputLooks, without_a_path_the_only_one_that_fits_is_found_and_of_several_none) {
  plug(3, kKeyboard);
  EXPECT_TRUE(says(look_for(""), "haptic: MISSING evdev: no mouse, gamepad or SpaceMouse in /dev/input"));
  plug(9, kPad);
  EXPECT_TRUE(says(look_for(""), "haptic: ok evdev: /dev/input/event9 (X-Box 360 pad, gamepad)\n"));
  plug(10, kMouse);
  EXPECT_TRUE(says(look_for(""),
                   "haptic: MISSING evdev: several devices can be the hand: /dev/input/event9 (X-Box 360 "
                   "pad), /dev/input/event10 (Optical Mouse), allowed: one of them as evdev.path\n"));
  EXPECT_TRUE(says(look_for("name = \"Mouse\"\n"), "haptic: ok evdev: /dev/input/event10 (Optical Mouse, "));
  // The kind, which is shown in brackets, is no part of the name.
  EXPECT_TRUE(
      says(look_for("name = \"(mouse)\"\n"),
           "haptic: MISSING evdev: no mouse, gamepad or SpaceMouse called \"(mouse)\" in /dev/input"));
}

TEST_F(InputLooks, a_path_that_is_no_hand_is_missing_whatever_else_is_plugged_in) {
  plug(3, kKeyboard, "1:5");
  plug(9, kPad);
  EXPECT_TRUE(says(look_for("path = \"/dev/input/event9\"\n"), "haptic: ok evdev: /dev/input/event9 ("));
  link_to("/dev/input/by-id/usb-Pad-event-joystick", "../event9");
  EXPECT_TRUE(says(look_for("path = \"/dev/input/by-id/usb-Pad-event-joystick\"\n"), "haptic: ok evdev: "));
  EXPECT_TRUE(says(look_for("path = \"/dev/input/event3\"\n"),
                   "haptic: MISSING evdev: /dev/input/event3: \"Keyboard (mouse)\" is neither a mouse, a "
                   "gamepad nor a SpaceMouse\n"));
  EXPECT_TRUE(says(look_for("path = \"/dev/input/event77\"\n"),
                   "haptic: MISSING evdev: /dev/input/event77: no such device, allowed for evdev.path: "));
  link_to("/dev/full", "/dev/full");  // a character device all the same
  EXPECT_TRUE(says(look_for("path = \"/dev/full\"\n"),
                   "haptic: MISSING evdev: /dev/full: is no input device, allowed for evdev.path: "));
}

TEST_F(DeviceLooks, a_falcon_is_known_by_its_usb_numbers_and_a_serial_port_by_the_name_that_stays) {
  file("/sys/bus/usb/devices/1-2/idVendor", "0403");
  file("/sys/bus/usb/devices/1-2/idProduct", "cb48");
  file("/sys/bus/usb/devices/1-2/product", "FALCON HAPTIC");
  file("/sys/bus/usb/devices/1-2/busnum", "1");
  file("/sys/bus/usb/devices/1-2/devnum", "14");
  file("/sys/bus/usb/devices/1-3/idVendor", "0403");
  file("/sys/bus/usb/devices/1-3/idProduct", "6001");
  const auto falcon = falcons(machine);
  ASSERT_EQ(falcon.size(), 1U);
  EXPECT_EQ(falcon[0].place, "/dev/bus/usb/001/014");

  file("/dev/ttyUSB0");
  file("/dev/ttyUSB1");
  link_to("/dev/serial/by-id/usb-Zaber_X-MCC_88-if00", "../../ttyUSB1");
  std::vector<std::string> ports;
  for (const PluggedIn& one : serial_ports(machine)) {
    ports.push_back(one.place);
  }
  EXPECT_EQ(ports, (std::vector<std::string>{"/dev/serial/by-id/usb-Zaber_X-MCC_88-if00", "/dev/ttyUSB0"}));
}

TEST_F(DeviceLooks, what_this_user_may_not_open_says_whose_group_may) {
  if (geteuid() == 0) {
    // Root may open everything: what is asked of the file is then asked as somebody else.
    ASSERT_EQ(seteuid(65534), 0);
  }
  // /dev/mem belongs to root and its group on every Linux that has it; a file of nobody's does elsewhere.
  const char* shut = access("/dev/mem", F_OK) == 0 ? "/dev/mem" : "/etc/shadow";
  const std::string remedy = remedy_for(shut, "/dev/thing");
  (void)seteuid(0);
  EXPECT_TRUE(says(remedy, "/dev/thing: this user may not use it: "));
}

// Lines of a scene laid over another one. A comment that would be a line is one: there stands what the
// operator has to fill in.
std::vector<std::string> laid_over(const std::string& lines) {
  std::vector<std::string> overrides;
  std::string table;
  std::istringstream in(lines);
  for (std::string line; std::getline(in, line);) {
    line.erase(0, line.starts_with("# ") ? 2 : 0);
    if (line.starts_with('[')) {
      table = line.substr(1, line.size() - 2);
      overrides.push_back(table + "=on");
    } else if (const auto equals = line.find(" = "); equals != std::string::npos) {
      overrides.push_back(table + "." + line.substr(0, equals) + "=" + line.substr(equals + 3));
    }
  }
  return overrides;
}

TEST_F(DeviceLooks, the_lines_that_it_proposes_make_a_scene_that_is_not_refused) {
  int loaded = 0;
  for (const PluggedKind& kind : plugged_kinds()) {
    const auto device = known_backends().find(kind.table);
    if (*kind.table != '\0' && (device == known_backends().end() ||
                                std::ranges::find(device->second, kind.backend) == device->second.end())) {
      continue;  // a backend that this program lacks: its lines are not shown
    }
    std::string block = kind.lines;
    if (const auto place = block.find("{}"); place != std::string::npos) {
      block.replace(place, 2, "/dev/thing");
    }
    // A cell under a camera, with everything simulated that the lines do not replace.
    std::vector<std::string> overrides = laid_over(block);
    if (*kind.table != '\0') {
      overrides.insert(overrides.begin(), "scene.clock=real");
    }
    const auto scene = load_scene("icsi", overrides);
    EXPECT_TRUE(scene) << kind.title << ": " << scene.error();
    ++loaded;
  }
  EXPECT_GE(loaded, 6);
}

}  // namespace
}  // namespace punctum::tools
