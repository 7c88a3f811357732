// Outlines in pixels, and the exact area of each pixel that they cover.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace punctum::sim {

struct Pixel {
  double x = 0;  // pixel centres at integers
  double y = 0;
};

// A rectangle of pixels, half open.
struct Box {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;
  [[nodiscard]] int width() const noexcept { return x1 - x0; }
  [[nodiscard]] int height() const noexcept { return y1 - y0; }
  [[nodiscard]] bool empty() const noexcept { return x1 <= x0 || y1 <= y0; }
  [[nodiscard]] Box meet(const Box& b) const noexcept {
    return {std::max(x0, b.x0), std::max(y0, b.y0), std::min(x1, b.x1), std::min(y1, b.y1)};
  }
  [[nodiscard]] Box grown(int by) const noexcept { return {x0 - by, y0 - by, x1 + by, y1 + by}; }
};

// The pixels that an outline with a margin touches.
[[nodiscard]] Box box_of(std::span<const Pixel> line, double margin) noexcept;
[[nodiscard]] double signed_area(std::span<const Pixel> line) noexcept;

// Moves every point of a closed line outwards along its normal.
void offset(std::span<const Pixel> line, double outwards, std::vector<Pixel>& out);

// Adds up the exact area of each pixel that closed polygons cover, as differences along the row: a running
// sum over a row is the coverage. Only the part inside the box counts; a polygon may reach beyond it.
class AreaRaster {
 public:
  void start(const Box& box);
  void add(std::span<const Pixel> polygon, double weight) noexcept;
  [[nodiscard]] const float* row(int y) const noexcept {  // from the top of the box; its width() values
    return &sum_[static_cast<std::size_t>(y) * stride_];
  }

 private:
  void edge(double xa, double ya, double xb, double yb, double weight) noexcept;
  void inside(double x0, double y0, double x1, double y1, double weight) noexcept;

  Box box_;
  std::size_t stride_ = 0;
  std::vector<float> sum_;
};

}  // namespace punctum::sim
