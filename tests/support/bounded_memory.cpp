// Linked into every test: what one takes is bounded, so that a test which goes wrong fails with
// std::bad_alloc instead of filling the machine. The bound holds for the programs that it starts, each by
// itself.
#include <sys/resource.h>

#include <algorithm>

namespace {

constexpr rlim_t kMost_bytes = rlim_t{8} << 30;  // of addresses

[[gnu::constructor]] void bound_memory() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0) {
    limit.rlim_cur = std::min(limit.rlim_max, kMost_bytes);
    limit.rlim_max = limit.rlim_cur;
    (void)setrlimit(RLIMIT_AS, &limit);
  }
}

}  // namespace
