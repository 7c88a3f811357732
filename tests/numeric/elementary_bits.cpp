// Prints the hash of each elementary function over its grid, as lines of elementary_hashes.inc. Without a
// test library, so that any compiler builds it for any processor (toolchain/checks/elementary_bits).
#include <cinttypes>
#include <cstdio>

#include "tests/numeric/elementary_grid.hpp"

int main() {
  for (const auto& f : punctum::math::kUnary) {
    std::printf("{\"%s\", 0x%016" PRIx64 "},\n", f.name, punctum::math::hash_of(f));
  }
  for (const auto& f : punctum::math::kBinary) {
    std::printf("{\"%s\", 0x%016" PRIx64 "},\n", f.name, punctum::math::hash_of(f));
  }
}
