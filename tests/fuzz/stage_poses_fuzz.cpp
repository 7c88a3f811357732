// Any text is either rows, between which poses are finite, or one line that says what is wrong.
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "tests/fuzz/must.hpp"
#include "tools/vision/stage_poses.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("poses", 0);
  must(file >= 0 && write(file, data, size) == static_cast<ssize_t>(size), "no memory for a file");
  const auto poses = punctum::tools::StagePoses::read("/proc/self/fd/" + std::to_string(file));
  close(file);
  if (!poses) {
    must(!poses.error().empty(), "an error without a word");
    must(poses.error().find('\n') == std::string::npos, "an error of more than one line");
    return 0;
  }
  for (const double t_s : {-1e9, -1.0, 0.0, 1e-3, 0.04, 1.0, 1e5, 1e9}) {
    if (const auto tip = poses->at(t_s)) {
      must(std::isfinite(tip->x) && std::isfinite(tip->y), "a place that is none");
    }
  }
  return 0;
}
