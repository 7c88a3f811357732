#include "vision/membrane/cleared_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vision/image/dispatched.hpp"
#include "vision/image/impurities.hpp"
#include "vision/image/noise.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr int kSmallest_px = 32;        // side of a picture in which something can be found
constexpr double kLeastContrast = 0.5;  // sd of the grey levels
constexpr double kLeastNoise = 0.3;     // grey levels
constexpr double kMostWhite = 0.5;      // share of the picture: beside white, edges show too far inside
constexpr double kMostOfNoise =
    1.5;  // of the variance that noise gives; of thousands of means it is known to 3 %
constexpr double kSmoothing_px = 1.2;   // sd of the Gaussian before the gradient
constexpr int kImpurityLeast_px = 6;    // pixels; fewer are noise
constexpr double kImpurityKeep_px = 4;  // nearer to a membrane, it belongs to the membrane
// By which the mouth of the holding pipette may be told too near to the cell, px per grey level of noise
// above.
constexpr double kFaceOff = 0.3, kClear_grey = 6;
constexpr double kReliefReach_px = 8;  // thick glass bends light away from far beside it
constexpr double kFaceReach_px =
    6.5;  // nearer to the face of the holding pipette, an edge is blurred into it

struct RowSums {
  std::uint32_t values = 0, squares = 0;  // of fewer than 66000 pixels
};
PUNCTUM_WIDE_LOOP RowSums sums_of(const std::uint8_t* row, int n) {
  RowSums out;
  for (int x = 0; x < n; ++x) {
    const std::uint32_t v = row[x];
    out.values += v;
    out.squares += v * v;
  }
  return out;
}

// The first rows that vary enough for the whole picture decide.
bool has_contrast(const cv::Mat& grey) {
  const double least = kLeastContrast * kLeastContrast * static_cast<double>(grey.total());
  double sum = 0, squares = 0, n = 0;
  for (int y = 0; y < grey.rows; ++y) {
    const RowSums row = sums_of(grey.ptr(y), grey.cols);
    sum += row.values;
    squares += row.squares;
    n += grey.cols;
    if (squares - sum * sum / n >= least) {
      return true;
    }
  }
  return false;
}

// Of means over some pixels in a row.
struct PartMeans {
  double variance = 0;
  double white = 0;  // share of them
};
constexpr int kPart_px = 8;
PartMeans means_of_parts(const cv::Mat& grey) {
  constexpr int kEveryRow = 16;
  double sum = 0, squares = 0, n = 0, white = 0;
  for (int y = 0; y < grey.rows; y += kEveryRow) {
    const std::uint8_t* row = grey.ptr(y);
    for (int x = 0; x + kPart_px <= grey.cols; x += kPart_px) {
      const double mean = static_cast<double>(sums_of(row + x, kPart_px).values) / kPart_px;
      sum += mean;
      squares += mean * mean;
      white += mean == 255 ? 1 : 0;
      ++n;
    }
  }
  return {(squares - sum * sum / n) / n, white / n};
}

// Rows of n pixels; short loops, which the compiler vectorises.
PUNCTUM_WIDE_LOOP void longer(const float* slope, int n, float square, std::uint8_t* out) {
  for (int i = 0; i < n; ++i) {
    out[i] = slope[2 * i] * slope[2 * i] + slope[2 * i + 1] * slope[2 * i + 1] > square ? 255 : 0;
  }
}

PUNCTUM_WIDE_LOOP void without(const std::uint8_t* v, const std::uint8_t* hidden, int n, std::uint8_t* out) {
  for (int i = 0; i < n; ++i) {
    const std::uint8_t here = v[i];
    out[i] = hidden[i] > 0 ? std::uint8_t{0} : here;
  }
}

std::string size_text(int w, int h) { return std::to_string(w) + "x" + std::to_string(h); }

}  // namespace

std::string ClearedPicture::lacking(const hal::Frame& frame, int width, int height) {
  if (frame.pixels == nullptr || frame.width <= 0 || frame.height <= 0 || frame.stride < frame.width) {
    return "no picture";
  }
  if (frame.width != width || frame.height != height) {
    return "size " + size_text(frame.width, frame.height) + " instead of " + size_text(width, height);
  }
  return {};
}

std::string ClearedPicture::load(const hal::Frame& frame, int width, int height) {
  if (std::string lacks = lacking(frame, width, height); !lacks.empty()) {
    return lacks;
  }
  if (width < kSmallest_px || height < kSmallest_px) {
    return "picture too small: at least " + size_text(kSmallest_px, kSmallest_px) + " is needed";
  }
  // OpenCV has no matrix over constant data.
  grey = cv::Mat(height, width, CV_8U, const_cast<std::uint8_t*>(frame.pixels),
                 static_cast<std::size_t>(frame.stride));
  if (!has_contrast(grey)) {
    return "no contrast: every pixel is about " + std::to_string(std::lround(cv::mean(grey)[0]));
  }
  noise = std::max(noise_level(grey), kLeastNoise);
  const PartMeans parts = means_of_parts(grey);
  if (parts.white > kMostWhite) {
    return "overexposed: " + std::to_string(std::lround(100 * parts.white)) +
           " % of the picture is white; a shorter exposure or less light is needed";
  }
  if (parts.variance < kMostOfNoise * noise * noise / kPart_px) {  // as in the dark
    return "nothing but noise round " + std::to_string(std::lround(cv::mean(grey)[0]));
  }
  return {};
}

void ClearedPicture::compute_gradient(const cv::Rect& area) {
  field.compute(grey, area, kSmoothing_px);
  gradient_noise = field.noise_of_gradient(noise);
}

void ClearedPicture::cover(const Vector<Polygon>& pipettes) {
  if (covered.size() != grey.size()) {
    covered = cv::Mat::zeros(grey.size(), CV_8U);
    rows_covered_ = {0, 0};
  }
  for (int y = rows_covered_.start; y < rows_covered_.end; ++y) {  // most rows have nothing that is covered
    std::fill_n(covered.ptr(y), covered.cols, std::uint8_t{0});
  }
  rows_covered_ = {0, 0};
  for (const Polygon& p : pipettes) {
    const auto [highest, lowest] =
        std::minmax_element(p.begin(), p.end(), [](const Point& a, const Point& b) { return a.y < b.y; });
    const auto row_of = [this](double y) {
      return static_cast<int>(std::clamp(y, 0.0, static_cast<double>(grey.rows)));
    };
    cover_rows({row_of(highest->y) - 1, row_of(lowest->y) + 3});
  }
  draw_mask(covered, pipettes);
}

void ClearedPicture::cover_rows(const cv::Range& rows) {
  const cv::Range within(std::clamp(rows.start, 0, grey.rows), std::clamp(rows.end, 0, grey.rows));
  rows_covered_ = rows_covered_.empty() ? within
                                        : cv::Range(std::min(rows_covered_.start, within.start),
                                                    std::max(rows_covered_.end, within.end));
}

int ClearedPicture::cover_impurities(const Vector<Contour>& membranes, double threshold, double max_side) {
  find_strong(threshold);
  if (membranes.empty()) {
    return 0;
  }
  Vector<Contour> local = membranes;
  for (Contour& c : local) {
    for (Point& p : c) {
      p -= Point(field.area.x, field.area.y);
    }
  }
  Vector<PixelRun> pixels;
  const int count = find_impurities(open_, local, max_side, kImpurityLeast_px, kImpurityKeep_px, pixels);
  for (const PixelRun& run : pixels) {  // and the pixels round it
    cover_rows({field.area.y + run.y - 1, field.area.y + run.y + 2});
    const int from = std::max(run.from - 1, 0), n = std::min(run.to + 1, field.area.width) - from;
    for (int y = std::max(run.y - 1, 0); y <= std::min(run.y + 1, field.area.height - 1); ++y) {
      std::fill_n(covered.ptr(field.area.y + y) + field.area.x + from, n, std::uint8_t{255});
      std::fill_n(strong.ptr(y) + from, n, std::uint8_t{0});
    }
  }
  return count;
}

// Sets strong, and open_: what is strong and not covered.
void ClearedPicture::find_strong(double threshold) {
  const cv::Rect& a = field.area;
  strong = kept_strong_.part(grey.size(), a.size(), CV_8U);
  open_ = kept_open_.part(grey.size(), a.size(), CV_8U);
  const auto square = static_cast<float>(threshold * threshold);
  for (int y = 0; y < a.height; ++y) {
    longer(field.slope.ptr<float>(y), a.width, square, strong.ptr(y));
    without(strong.ptr(y), covered.ptr(a.y + y) + a.x, a.width, open_.ptr(y));
  }
}

void ClearedPicture::exclude_holder(EdgeBand& band, const Vector<double>& expected, bool relief) const {
  if (!holder_face) {
    return;
  }
  const auto& [mouth, axis, half_width] = *holder_face;
  const double face = (mouth - band.centre).dot(axis);  // < 0: behind the centre
  if (face >= -2) {
    return;
  }
  const double reach = kFaceReach_px + (relief ? kReliefReach_px : 0), beside = relief ? kReliefReach_px : 2;
  const int n = static_cast<int>(band.middle.size());
  band.hidden.resize(band.middle.size(), 0);
  if (band.upper.empty()) {
    band.upper.assign(band.middle.size(), 1e9);
  }
  if (relief) {
    band.seen_to.assign(band.middle.size(), 1e9);
  }
  for (int i = 0; i < n; ++i) {
    const Point d = on_ray(Point(0, 0), i, n, 1);
    if (d.dot(axis) > -0.2) {  // this ray does not meet the face
      continue;
    }
    const double r = face / d.dot(axis);
    if (std::abs(axis.cross(band.centre + r * d - mouth)) > half_width + beside) {
      continue;
    }
    const std::size_t k = static_cast<std::size_t>(i);
    if (!relief) {
      band.upper[k] = std::min(band.upper[k], r + kFaceOff * std::max(0.0, noise - kClear_grey));
    }
    if (expected[k] > r - reach) {
      band.hidden[k] = 1;
    } else if (relief) {
      band.seen_to[k] = r - reach;
    }
  }
}

Vector<std::uint8_t> ClearedPicture::in_shadow_of_holder(const Contour& contour) const {
  constexpr double kShadow = 0.35;  // of half the width of the glass
  if (!holder_face) {
    return {};
  }
  const auto& [mouth, axis, half_width] = *holder_face;
  Vector<std::uint8_t> out;
  for (const Point& p : contour) {
    const Point from = p - mouth;
    out.push_back(
        from.dot(axis) < kShadow * half_width && std::abs(axis.cross(from)) < (1 + kShadow) * half_width ? 1
                                                                                                         : 0);
  }
  return out;
}

}  // namespace punctum::vision
