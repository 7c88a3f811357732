#include "vision/image/impurities.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::vision {

namespace {

// Drops the components that have a pixel in the square of `reach` px round a point of a membrane.
void drop_near_membranes(const Components& all, const Vector<Contour>& membranes, int reach,
                         Vector<bool>& chosen) {
  // Most runs belong to components that are not chosen anyhow.
  Vector<PixelRun> runs;
  Vector<std::size_t> row;
  runs.reserve(all.runs.size());
  row.reserve(all.row.size());
  for (std::size_t y = 0; y + 1 < all.row.size(); ++y) {
    row.push_back(runs.size());
    std::copy_if(all.runs.begin() + static_cast<std::ptrdiff_t>(all.row[y]),
                 all.runs.begin() + static_cast<std::ptrdiff_t>(all.row[y + 1]), std::back_inserter(runs),
                 [&chosen](const PixelRun& run) { return chosen[run.component]; });
  }
  row.push_back(runs.size());
  const int rows = static_cast<int>(row.size()) - 1;
  for (const Contour& c : membranes) {
    for (const Point& p : c) {
      const int px = static_cast<int>(std::lround(p.x)), py = static_cast<int>(std::lround(p.y));
      const int top = std::max(0, py - reach), bottom = std::min(rows - 1, py + reach);
      for (std::size_t k = top <= bottom ? row[static_cast<std::size_t>(top)] : 0,
                       end = top <= bottom ? row[static_cast<std::size_t>(bottom) + 1] : 0;
           k < end; ++k) {
        if (runs[k].from <= px + reach && runs[k].to > px - reach) {
          chosen[runs[k].component] = false;
        }
      }
    }
  }
}

}  // namespace

int find_impurities(const cv::Mat& binary, const Vector<Contour>& membranes, double max_side, int min_area,
                    double keep, Vector<PixelRun>& pixels) {
  pixels.clear();
  const Components all = components_of(binary);
  Vector<bool> chosen(all.box.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[i] = all.pixels[i] >= min_area && all.box[i].width <= max_side && all.box[i].height <= max_side;
  }
  // What lies on a membrane belongs to the cell.
  drop_near_membranes(all, membranes, static_cast<int>(std::ceil(keep)), chosen);
  std::copy_if(all.runs.begin(), all.runs.end(), std::back_inserter(pixels),
               [&chosen](const PixelRun& run) { return chosen[run.component]; });
  return static_cast<int>(std::count(chosen.begin(), chosen.end(), true));
}

}  // namespace punctum::vision
