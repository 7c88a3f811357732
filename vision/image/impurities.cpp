#include "vision/image/impurities.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>

#include "vision/image/dispatched.hpp"

namespace punctum::vision {

namespace {

// Whether one of n pixels lies in the box.
PUNCTUM_WIDE_LOOP bool any_within(const int* x, const int* y, std::size_t n, const cv::Rect& box) {
  const int left = box.x, top = box.y, right = box.x + box.width, bottom = box.y + box.height;
  int any = 0;
  for (std::size_t i = 0; i < n; ++i) {
    any |= static_cast<int>(x[i] >= left) & static_cast<int>(x[i] < right) & static_cast<int>(y[i] >= top) &
           static_cast<int>(y[i] < bottom);
  }
  return any != 0;
}

// Drops the components that have a pixel in the square of `reach` px round a point of a membrane. Most are
// far from all of them, as their boxes tell.
void drop_near_membranes(const Components& all, const Vector<Contour>& membranes, int reach,
                         Vector<std::uint8_t>& chosen) {
  const std::size_t points = std::accumulate(membranes.begin(), membranes.end(), std::size_t{0},
                                             [](std::size_t n, const Contour& c) { return n + c.size(); });
  Vector<int> x, y;  // of the membranes' pixels
  x.reserve(points);
  y.reserve(points);
  for (const Contour& c : membranes) {
    for (const Point& p : c) {
      x.push_back(static_cast<int>(std::lround(p.x)));
      y.push_back(static_cast<int>(std::lround(p.y)));
    }
  }
  const auto near = [&](const cv::Rect& box) {
    return any_within(x.data(), y.data(), points,
                      {box.x - reach, box.y - reach, box.width + 2 * reach, box.height + 2 * reach});
  };
  Vector<std::uint8_t> may_be_near(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    may_be_near[i] = chosen[i] != 0 && near(all.box[i]) ? 1 : 0;
  }
  for (const PixelRun& run : all.runs) {
    if (may_be_near[run.component] != 0 && near({run.from, run.y, run.to - run.from, 1})) {
      chosen[run.component] = may_be_near[run.component] = 0;
    }
  }
}

}  // namespace

int find_impurities(const cv::Mat& binary, const Vector<Contour>& membranes, double max_side, int min_area,
                    double keep, Vector<PixelRun>& pixels) {
  pixels.clear();
  const Components all = components_of(binary);
  Vector<std::uint8_t> chosen(all.box.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[i] =
        all.pixels[i] >= min_area && all.box[i].width <= max_side && all.box[i].height <= max_side ? 1 : 0;
  }
  // What lies on a membrane belongs to the cell.
  drop_near_membranes(all, membranes, static_cast<int>(std::ceil(keep)), chosen);
  std::copy_if(all.runs.begin(), all.runs.end(), std::back_inserter(pixels),
               [&chosen](const PixelRun& run) { return chosen[run.component] != 0; });
  return static_cast<int>(std::count(chosen.begin(), chosen.end(), 1));
}

}  // namespace punctum::vision
