// The loopback tests: no device under test, or no test, is a failure and not a skip.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "tests/loopback/gpio_sim.hpp"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (!std::filesystem::exists(punctum::loopback::kGpioSim)) {
    std::printf(
        "loopback_test: this kernel has no gpio-sim: run it as toolchain/rt-guest/run --deterministic --with "
        "gpio "
        "PROGRAM\n");
    return 1;
  }
  const int result = RUN_ALL_TESTS();
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  if (all.successful_test_count() + all.failed_test_count() == 0) {
    std::printf("loopback_test: no test was run: ask for one that exists\n");
    return 1;
  }
  return result;
}
