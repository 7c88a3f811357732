// What a followed frame costs: processor time (median and 99th percentile, the least of several runs over the
// same frames), memory taken, and a sum of all bits of the results; points and normals of both surfaces on a
// grid of 64 x 64 are a part of it, and are told alone, too. Pictures are decoded before; the first half of
// the frames is not counted. By hand, on a folder of frame_0000.png, frame_0001.png ... :
//     vision_cost FOLDER [FRAMES [RUNS]]
//     vision_cost --draw FOLDER [FRAMES]     draws them: a needle comes to a cell
// Instructions of a frame: under valgrind --tool=callgrind with 2N frames less N, once each.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "rt/station/surface.hpp"
#include "tests/support/counted_memory.hpp"
#include "tests/support/drawn_microscope.hpp"
#include "vision/surface/surface_grid.hpp"
#include "vision/tracker.hpp"

namespace {

using namespace punctum;
using namespace punctum::vision;

constexpr double kPixel_um = 0.825;

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

// Fowler, Noll and Vo.
class Bits {
 public:
  void add(double v) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &v, sizeof bits);
    sum_ = (sum_ ^ bits) * 0x100000001b3;
  }
  void add(const Membrane& m) {
    for (std::size_t i = 0; m.ok && i < m.contour.size(); ++i) {
      add(m.contour[i].x);
      add(m.contour[i].y);
      add(m.sd_px[i]);
    }
  }
  [[nodiscard]] unsigned long long sum() const { return sum_; }

 private:
  std::uint64_t sum_ = 0xcbf29ce484222325;
};

void add(Bits& bits, const Result& r) {
  for (const double v :
       {r.noise, r.needle.tip.x, r.needle.tip.y, r.needle.sd, r.holder.mouth.x, r.holder.mouth.y, r.gap_sd_px,
        r.gap_px.value_or(-1), r.wd_px.value_or(-1), r.a_px.value_or(-1), r.contact ? 1.0 : 0.0,
        r.punctured ? 1.0 : 0.0, static_cast<double>(r.impurities)}) {
    bits.add(v);
  }
  bits.add(r.outer);
  bits.add(r.inner);
  for (const auto* net : {&r.outer_net, &r.inner_net}) {
    for (int i = 0; *net && (*net)->ok && i < (*net)->size; ++i) {
      bits.add((*net)->control[static_cast<std::size_t>(i)][4]);
    }
  }
}

std::string picture_of(const std::string& folder, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "/frame_%04d.png", frame);
  return folder + name;
}

int draw(const std::string& folder, int frames) {
  for (int k = 0; k < frames; ++k) {
    test::DrawnMicroscope microscope({.seed = 1, .gap_px = 3.0 * (frames - k) - 12});
    if (!cv::imwrite(picture_of(folder, k), microscope.draw().picture)) {
      std::fprintf(stderr, "%s cannot be written\n", folder.c_str());
      return 1;
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const bool draws = argc > 2 && std::string(argv[1]) == "--draw";
  if (argc < 2 || (!draws && argv[1][0] == '-')) {
    std::fprintf(stderr, "vision_cost [--draw] FOLDER [FRAMES [RUNS]]\n");
    return 2;
  }
  const std::string folder = argv[draws ? 2 : 1];
  const int given = draws ? 3 : 2;
  const int most = argc > given ? std::atoi(argv[given]) : 60,
            runs = argc > given + 1 ? std::atoi(argv[given + 1]) : 1;
  if (draws) {
    return draw(folder, most);
  }
  std::vector<cv::Mat> pictures;
  for (int k = 0; k < most; ++k) {
    pictures.push_back(cv::imread(picture_of(folder, k), cv::IMREAD_GRAYSCALE));
    if (pictures.back().empty()) {
      std::fprintf(stderr, "%s cannot be read\n", picture_of(folder, k).c_str());
      return 1;
    }
  }
  VisionConfig config;
  config.pixel_m = kPixel_um * 1e-6;
  config.surface = true;
  std::vector<double> least(pictures.size(), std::numeric_limits<double>::max());
  std::vector<long> taken(pictures.size());
  Bits bits;
  const SurfaceGrid grid(rt::MembraneSurface::kControlPoints, 64, 64);
  GridVectors points, normals;
  std::vector<double> grid_us(pictures.size(), std::numeric_limits<double>::max());
  for (int run = 0; run < runs; ++run) {
    Tracker tracker(config, pictures[0].cols, pictures[0].rows);
    for (std::size_t k = 0; k < pictures.size(); ++k) {
      hal::Frame frame;
      frame.pixels = pictures[k].data;
      frame.width = pictures[k].cols;
      frame.height = pictures[k].rows;
      frame.stride = static_cast<int>(pictures[k].step);
      frame.sequence = k;
      frame.exposure_ns = static_cast<std::int64_t>(k) * 40'000'000;
      const long before = memory_taken;
      const double from = thread_ms();
      const Result& r = tracker.process(frame);
      const double seen = thread_ms();
      for (const auto* net : {&r.outer_net, &r.inner_net}) {
        if (*net && (*net)->ok) {
          grid.points_and_normals(**net, points, normals);
        }
      }
      const double to = thread_ms();
      least[k] = std::min(least[k], to - from);
      grid_us[k] = std::min(grid_us[k], (to - seen) * 1e3);
      taken[k] = memory_taken - before;
      if (run == 0) {
        add(bits, r);
        if (r.verdict != "ok") {
          std::printf("%zu: %s\n", k, r.verdict.c_str());
        }
      }
    }
  }
  const auto followed = static_cast<std::ptrdiff_t>(pictures.size() / 2);
  std::vector<double> ms(least.begin() + followed, least.end());
  std::vector<long> times(taken.begin() + followed, taken.end());
  std::sort(ms.begin(), ms.end());
  std::sort(times.begin(), times.end());
  std::vector<double> grids(grid_us.begin() + followed, grid_us.end());
  std::sort(grids.begin(), grids.end());
  std::printf(
      "%zu followed frames: median %.3f ms, 99 %% %.3f ms, of which both grids %.1f us; memory taken %ld "
      "times, %ld at most; bits "
      "%016llx\n",
      ms.size(), ms[ms.size() / 2], ms[(ms.size() - 1) * 99 / 100], grids[grids.size() / 2],
      times[times.size() / 2], times.back(), bits.sum());
}
