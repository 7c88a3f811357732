// What takes minutes is run by hand, with PUNCTUM_LONG=1: of tests with parameters those under the prefix
// "Further", and in others more of their pictures.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace punctum::by_hand {

inline bool takes_its_time() { return std::getenv("PUNCTUM_LONG") != nullptr; }

inline bool is_left_out() {
  const std::string suite = testing::UnitTest::GetInstance()->current_test_info()->test_suite_name();
  return suite.starts_with("Further/") && !takes_its_time();
}
constexpr const char* kLeftOut = "takes long with the others of its kind: PUNCTUM_LONG=1 runs them";

}  // namespace punctum::by_hand
