// A test that takes more memory than it may fails by itself; the machine goes on.
#include <gtest/gtest.h>

#include <new>

namespace punctum {
namespace {

TEST(BoundedMemory, a_test_that_takes_too_much_fails_instead_of_filling_the_machine) {
  constexpr std::size_t kBlock = std::size_t{256} << 20;
  constexpr int kBlocks = 64;  // 16 GiB; never touched, so that they cost nothing where nobody refuses them
  std::vector<char*> taken;
  try {
    while (taken.size() < kBlocks) {
      taken.push_back(new char[kBlock]);
    }
  } catch (const std::bad_alloc&) {
  }
  EXPECT_LT(taken.size(), std::size_t{kBlocks});
  EXPECT_GT(taken.size(), 4U) << "a test may take a gigabyte";
  for (const char* block : taken) {
    delete[] block;
  }
}

}  // namespace
}  // namespace punctum
