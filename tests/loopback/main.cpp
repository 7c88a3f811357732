// The loopback tests: no device under test, or no test, is a failure and not a skip. PUNCTUM_LOOPBACK_WITH
// names the devices, as toolchain/rt-guest/run --with does.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace {

struct Needed {
  std::string_view device;
  const char* path;
};
constexpr Needed kNeeded[] = {{"gpio", "/sys/kernel/config/gpio-sim"},
                              {"can", "/sys/class/net/can0"},
                              {"can", "/sys/class/net/can1"},
                              {"camera", "/sys/module/vivid"},
                              {"usb", "/sys/devices/platform/vhci_hcd.0"},
                              {"input", "/dev/uinput"},
                              {"watchdog", "/dev/watchdog"}};

}  // namespace

int main(int argc, char** argv) {
  constexpr std::string_view kWith = PUNCTUM_LOOPBACK_WITH;
  testing::InitGoogleTest(&argc, argv);
  for (const Needed& needed : kNeeded) {
    if (kWith.find(needed.device) != std::string_view::npos && !std::filesystem::exists(needed.path)) {
      std::printf(
          "this kernel has no %s: run the tests as toolchain/rt-guest/run --deterministic --with %s "
          "PROGRAM\n",
          needed.path, PUNCTUM_LOOPBACK_WITH);
      return 1;
    }
  }
  const int result = RUN_ALL_TESTS();
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  if (all.successful_test_count() + all.failed_test_count() == 0) {
    std::printf("no test was run: ask for one that exists\n");
    return 1;
  }
  return result;
}
