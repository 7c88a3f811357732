#include "vision/image/impurities.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::vision {

namespace {

// Which components have a pixel in the square of `reach` px round a point of a membrane.
std::vector<bool> near_membranes(const Components& all, const std::vector<Contour>& membranes, int reach) {
  std::vector<bool> near(all.box.size(), false);
  const int rows = static_cast<int>(all.row.size()) - 1;
  for (const Contour& c : membranes) {
    for (const Point& p : c) {
      const int px = static_cast<int>(std::lround(p.x)), py = static_cast<int>(std::lround(p.y));
      for (int y = std::max(0, py - reach); y <= std::min(rows - 1, py + reach); ++y) {
        for (const PixelRun& run : all.in_row(y)) {
          if (run.from <= px + reach && run.to > px - reach) {
            near[run.component] = true;
          }
        }
      }
    }
  }
  return near;
}

}  // namespace

int find_impurities(const cv::Mat& binary, const std::vector<Contour>& membranes, double max_side,
                    int min_area, double keep, std::vector<PixelRun>& pixels) {
  pixels.clear();
  const Components all = components_of(binary);
  // What lies on a membrane belongs to the cell.
  std::vector<bool> chosen = near_membranes(all, membranes, static_cast<int>(std::ceil(keep)));
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[i] = !chosen[i] && all.pixels[i] >= min_area && all.box[i].width <= max_side &&
                all.box[i].height <= max_side;
  }
  std::copy_if(all.runs.begin(), all.runs.end(), std::back_inserter(pixels),
               [&chosen](const PixelRun& run) { return chosen[run.component]; });
  return static_cast<int>(std::count(chosen.begin(), chosen.end(), true));
}

}  // namespace punctum::vision
