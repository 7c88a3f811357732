#include "vision/image/gaussian.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"

namespace punctum::vision {

namespace {

constexpr int kReach = 4;  // px to either side
using Weights = std::array<float, kReach + 1>;

Weights weights_of(double sigma) {
  std::array<double, kReach + 1> w{};
  double sum = 0;
  for (int d = 0; d <= kReach; ++d) {
    const double x = d / sigma, here = math::exp(-0.5 * x * x);
    w[static_cast<std::size_t>(d)] = here;
    sum += d == 0 ? here : 2 * here;
  }
  Weights out{};
  std::transform(w.begin(), w.end(), out.begin(), [sum](double v) { return static_cast<float>(v / sum); });
  return out;
}

// Of nine rows of n numbers; one long expression, which a compiler computes for several x at once.
using Rows = std::array<const float*, 2 * kReach + 1>;
PUNCTUM_WIDE_LOOP void blend(const Rows& r, const Weights& w, int n, float* out) {
  for (int x = 0; x < n; ++x) {
    out[x] = w[0] * r[4][x] + w[1] * (r[3][x] + r[5][x]) + w[2] * (r[2][x] + r[6][x]) +
             w[3] * (r[1][x] + r[7][x]) + w[4] * (r[0][x] + r[8][x]);
  }
}

PUNCTUM_WIDE_LOOP void widen(const std::uint8_t* in, int n, float* out) {
  for (int x = 0; x < n; ++x) {
    out[x] = in[x];
  }
}

}  // namespace

void smooth_part(const cv::Mat& grey, const cv::Rect& part, double sigma_px, SmoothingRows& kept,
                 cv::Mat& out) {
  const Weights weights = weights_of(sigma_px);
  const int n = part.width;
  out.create(part.size(), CV_32F);
  auto& [wide, across] = kept;  // across: of the last nine rows
  wide.resize(static_cast<std::size_t>(n + 2 * kReach));
  constexpr std::size_t kLine = kept::kAlignment / sizeof(float);  // where rows begin, loads cross no line
  const std::size_t row = (static_cast<std::size_t>(n) + kLine - 1) / kLine * kLine;
  across.resize(row * (2 * kReach + 1));
  const auto row_of = [&](int y) {
    return across.data() + static_cast<std::size_t>((y + kReach) % (2 * kReach + 1)) * row;
  };
  const int from = std::max(part.x - kReach, 0), to = std::min(part.x + n + kReach, grey.cols);
  for (int y = -kReach; y < part.height + kReach; ++y) {
    const std::uint8_t* in = grey.ptr(std::clamp(part.y + y, 0, grey.rows - 1));
    const auto first = wide.begin() + (from - part.x + kReach), last = first + (to - from);
    widen(in + from, to - from, &*first);
    std::fill(wide.begin(), first, *first);
    std::fill(last, wide.end(), *(last - 1));
    Rows rows{};
    for (std::size_t d = 0; d < rows.size(); ++d) {
      rows[d] = wide.data() + d;
    }
    blend(rows, weights, n, row_of(y));
    if (y >= kReach) {
      for (std::size_t d = 0; d < rows.size(); ++d) {
        rows[d] = row_of(y - 2 * kReach + static_cast<int>(d));
      }
      blend(rows, weights, n, out.ptr<float>(y - kReach));
    }
  }
}

}  // namespace punctum::vision
