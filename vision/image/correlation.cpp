#include "vision/image/correlation.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "vision/image/dispatched.hpp"
#include "vision/image/kept_memory.hpp"
#include "vision/image/parabola.hpp"

namespace punctum::vision {

namespace {

constexpr int kFewPlaces = 150;  // are faster one by one than by the Fourier transform

cv::Mat match(const cv::Mat& window, const cv::Mat& pattern, int method) {
  cv::Mat map;
  if (window.empty() || pattern.empty() || window.cols < pattern.cols || window.rows < pattern.rows) {
    return map;
  }
  cv::matchTemplate(window, pattern, map, method);
  cv::patchNaNs(map, 0);
  return map;
}

struct RowProducts {
  int dot = 0, squares = 0;
};
PUNCTUM_WIDE_LOOP RowProducts products_of_row(const std::int16_t* m, const std::int16_t* i, int n) {
  RowProducts out;
  for (int x = 0; x < n; ++x) {
    out.dot += m[x] * i[x];
    out.squares += i[x] * i[x];
  }
  return out;
}

// Eq. 1 of grey levels as whole numbers, whose sums over a row are exact.
double correlation_at(const cv::Mat& window, const cv::Mat& pattern, double power, int left, int top) {
  std::int64_t dot = 0, squares = 0;
  for (int y = 0; y < pattern.rows; ++y) {
    const RowProducts row =
        products_of_row(pattern.ptr<std::int16_t>(y), window.ptr<std::int16_t>(top + y) + left, pattern.cols);
    dot += row.dot;
    squares += row.squares;
  }
  const double norm = std::sqrt(power * static_cast<double>(squares));
  return norm > 0 ? static_cast<double>(dot) / norm : 0;
}

PUNCTUM_WIDE_LOOP void add_row_sums(const float* row, float usual, std::size_t n, float* sum,
                                    float* squares) {
  for (std::size_t x = 0; x < n; ++x) {
    const float here = row[x] - usual;
    sum[x] += here;
    squares[x] += here * here;
  }
}

PUNCTUM_WIDE_LOOP void add_row_products(const float* a, const float* b, std::size_t n, float* sum) {
  for (std::size_t x = 0; x < n; ++x) {
    sum[x] += a[x] * b[x];
  }
}

// Of floats. Column by column, of which a compiler makes several at once, and then over the columns.
cv::Mat centred_correlations(const cv::Mat& window, const cv::Mat& pattern, const cv::Size& places) {
  cv::Mat map = kept_picture(places, CV_32F), centred = kept_picture(pattern.size(), CV_32F);
  const auto mean = static_cast<float>(cv::mean(pattern)[0]);
  for (int y = 0; y < pattern.rows; ++y) {
    std::transform(pattern.ptr<float>(y), pattern.ptr<float>(y) + pattern.cols, centred.ptr<float>(y),
                   [mean](float v) { return v - mean; });
  }
  const double power = cv::norm(centred, cv::NORM_L2SQR), count = static_cast<double>(pattern.total());
  const float usual = window.at<float>(0, 0);  // taken off: squares of small numbers lose fewer digits
  const auto n = static_cast<std::size_t>(pattern.cols), all = static_cast<std::size_t>(window.cols);
  Vector<float> sum(all), squares(all), dot(n);
  const auto total = [n](const Vector<float>& v, int from) {
    return std::accumulate(v.begin() + from, v.begin() + from + static_cast<std::ptrdiff_t>(n), 0.0);
  };
  for (int top = 0; top < places.height; ++top) {
    std::fill(sum.begin(), sum.end(), 0.0F);
    std::fill(squares.begin(), squares.end(), 0.0F);
    for (int y = 0; y < pattern.rows; ++y) {
      add_row_sums(window.ptr<float>(top + y), usual, all, sum.data(), squares.data());
    }
    for (int left = 0; left < places.width; ++left) {
      std::fill(dot.begin(), dot.end(), 0.0F);
      for (int y = 0; y < pattern.rows; ++y) {
        add_row_products(centred.ptr<float>(y), window.ptr<float>(top + y) + left, n, dot.data());
      }
      const double here = total(sum, left), spread = total(squares, left) - here * here / count;
      map.at<float>(top, left) =
          spread > 0 && power > 0 ? static_cast<float>(total(dot, 0) / std::sqrt(power * spread)) : 0;
    }
  }
  return map;
}

}  // namespace

cv::Mat correlation_map(const cv::Mat& window, const cv::Mat& pattern) {
  const cv::Size places(window.cols - pattern.cols + 1, window.rows - pattern.rows + 1);
  if (!pattern.empty() && places.width > 0 && places.height > 0 && places.area() <= kFewPlaces) {
    cv::Mat map = kept_picture(places, CV_32F), in = kept_picture(window.size(), CV_16S),
            of = kept_picture(pattern.size(), CV_16S);
    window.convertTo(in, CV_16S);
    pattern.convertTo(of, CV_16S);
    const double power = cv::norm(pattern, cv::NORM_L2SQR);
    for (int y = 0; y < places.height; ++y) {
      for (int x = 0; x < places.width; ++x) {
        map.at<float>(y, x) = static_cast<float>(correlation_at(in, of, power, x, y));
      }
    }
    return map;
  }
  return match(window, pattern, cv::TM_CCORR_NORMED);
}

cv::Mat centred_correlation_map(const cv::Mat& window, const cv::Mat& pattern) {
  const cv::Size places(window.cols - pattern.cols + 1, window.rows - pattern.rows + 1);
  if (!pattern.empty() && places.width > 0 && places.height > 0 && places.area() <= kFewPlaces) {
    return centred_correlations(window, pattern, places);
  }
  return match(window, pattern, cv::TM_CCOEFF_NORMED);
}

std::optional<Peak> peak(const cv::Mat& map) {
  if (map.empty()) {
    return std::nullopt;
  }
  double top = 0;
  cv::Point p;
  cv::minMaxLoc(map, nullptr, &top, nullptr, &p);
  if (!std::isfinite(top)) {
    return std::nullopt;
  }
  Peak out{Point(p.x, p.y), top};
  if (p.x > 0 && p.y > 0 && p.x + 1 < map.cols && p.y + 1 < map.rows) {
    const auto at = [&](int x, int y) { return static_cast<double>(map.at<float>(y, x)); };
    out.at.x += vertex_offset(at(p.x - 1, p.y), top, at(p.x + 1, p.y));
    out.at.y += vertex_offset(at(p.x, p.y - 1), top, at(p.x, p.y + 1));
  }
  return out;
}

}  // namespace punctum::vision
