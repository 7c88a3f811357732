#include "hal/sim/camera/optical_path.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace punctum::sim {
namespace {

constexpr double kGlass = 0.14;  // refractive indices above that of the medium
constexpr double kZona = 0.006;
constexpr double kOoplasm = 0.017;

constexpr double kSharp_px = 0.6;     // the part of the point spread that acts before the contrast
constexpr double kBrightLimit = 0.8;  // of the modulation, relative to the background
constexpr double kDarkLimit = 0.65;
constexpr double kApertureSlope = 0.65;  // about which light misses the aperture

constexpr double kApart_px = 1.2;  // slices of a body, where they lie furthest apart: the blur joins them

// Integral of sqrt(r^2 - v^2) from 0 to v.
double under_circle(double r, double v) noexcept {
  v = std::clamp(v, -r, r);
  return 0.5 * (v * std::sqrt(std::max(r * r - v * v, 0.0)) + r * r * std::asin(v / r));
}
// Mean chord of a circle of radius r over the pixel at v.
double chord(double r, double v) noexcept {
  return r > 0 ? 2 * (under_circle(r, v + 0.5) - under_circle(r, v - 0.5)) : 0;
}

double between(const Tube& tube, double behind, double Tube::Station::* radius) noexcept {
  const auto& s = tube.stations;
  for (std::size_t i = 1; i < s.size(); ++i) {
    if (behind < s[i].behind_px) {
      const double whole = s[i].behind_px - s[i - 1].behind_px;
      const double t = std::clamp((behind - s[i - 1].behind_px) / std::max(whole, 1e-9), 0.0, 1.0);
      return s[i - 1].*radius + t * (s[i].*radius - s[i - 1].*radius);
    }
  }
  return s.back().*radius;
}

}  // namespace

void OpticalPath::start(const Box& picture) {
  picture_ = picture;
  const std::size_t pixels =
      static_cast<std::size_t>(picture.width()) * static_cast<std::size_t>(picture.height());
  path_.assign(pixels, 0.0F);
  index_.assign(pixels, 0.0F);
}

void OpticalPath::add_cell(std::span<const Pixel> outer, std::span<const Pixel> zona_inner,
                           std::span<const Pixel> ooplasm, const Pixel& centre, double blur_px,
                           double defocus) {
  const double sigma = std::hypot(kSharp_px, blur_px);
  const Box box = box_of(outer, kBlurReach * std::hypot(sigma, kBlurs_px.back()) + 2).meet(picture_);
  if (box.empty()) {
    return;
  }
  layer_.start(box);
  raster_.start(box);
  const auto take = [&](const AreaRaster& raster, auto each) {
    for (int y = 0; y < box.height(); ++y) {
      const float* const from = raster.row(y);
      float sum = 0;
      for (int x = 0; x < box.width(); ++x) {
        sum += from[x];
        each(x, y, sum);
      }
    }
  };
  struct Surface {
    std::span<const Pixel> line;
    double step;
  };
  const std::array<Surface, 3> surfaces{{{outer, kZona}, {zona_inner, -kZona}, {ooplasm, kOoplasm}}};
  for (const Surface& s : surfaces) {
    if (s.line.size() >= 3) {
      raster_.add(s.line, s.step);
    }
  }
  take(raster_, [&](int x, int y, float index) {
    index_[static_cast<std::size_t>(box.y0 + y - picture_.y0) * static_cast<std::size_t>(picture_.width()) +
           static_cast<std::size_t>(box.x0 + x - picture_.x0)] = index;
  });
  for (AreaRaster& raster : blurred_) {
    raster.start(box);
  }
  for (const Surface& s : surfaces) {
    if (s.line.size() >= 3) {
      add_body(s.line, centre, s.step, defocus);
    }
  }
  for (std::size_t i = 0; i < blurred_.size(); ++i) {
    take(blurred_[i], [&](int x, int y, float path) { layer_.row(y)[x] = path; });
    layer_.blur(std::hypot(sigma, kBlurs_px[i]));
    add_layer();
  }
}

void OpticalPath::add_body(std::span<const Pixel> equator, const Pixel& centre, double index,
                           double defocus) {
  const double radius = std::sqrt(std::abs(signed_area(equator)) / std::numbers::pi);
  slice_.resize(equator.size());
  // They shrink by equal angles, so that they lie close where the body is steep.
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  const int slices = static_cast<int>(std::clamp(std::ceil(kQuarter * radius / kApart_px), 16.0, 1000.0));
  const double step = kQuarter / slices;
  for (int k = 0; k < slices; ++k) {
    const double shrunk = std::cos((k + 0.5) * step);
    for (std::size_t i = 0; i < equator.size(); ++i) {
      slice_[i] = {centre.x + shrunk * (equator[i].x - centre.x),
                   centre.y + shrunk * (equator[i].y - centre.y)};
    }
    const double path = index * 2 * radius * (std::sin((k + 1) * step) - std::sin(k * step));
    // Between two blurs so that the variance is its own.
    const double blur = std::min(defocus * radius * std::sin((k + 0.5) * step), kBlurs_px.back());
    std::size_t above = 1;
    while (above + 1 < kBlurs_px.size() && kBlurs_px[above] < blur) {
      ++above;
    }
    const double low = kBlurs_px[above - 1], high = kBlurs_px[above],
                 share = (blur * blur - low * low) / (high * high - low * low);
    if (share < 1) {
      blurred_[above - 1].add(slice_, path * (1 - share));
    }
    if (share > 0) {
      blurred_[above].add(slice_, path * share);
    }
  }
}

void OpticalPath::add_tube(const Tube& tube, double blur_px) {
  const double sigma = std::hypot(kSharp_px, blur_px);
  double widest = 0;
  for (const Tube::Station& s : tube.stations) {
    widest = std::max(widest, s.outer_px);
  }
  const double margin = kBlurReach * sigma + 2;
  const double far =
      std::hypot(picture_.width(), picture_.height()) +
      std::hypot(tube.front.x - 0.5 * picture_.width(), tube.front.y - 0.5 * picture_.height());
  const auto [ux, uy] = tube.inwards;
  std::array<Pixel, 4> corner{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double along = i < 2 ? 0 : far;
    const double across = i == 0 || i == 3 ? widest : -widest;
    corner[i] = {tube.front.x + along * ux - across * uy, tube.front.y + along * uy + across * ux};
  }
  const Box box = box_of(corner, margin).meet(picture_.grown(static_cast<int>(std::ceil(margin))));
  if (box.empty()) {
    return;
  }
  layer_.start(box);
  for (int y = box.y0; y < box.y1; ++y) {
    float* const row = layer_.row(y - box.y0);
    const int py = std::clamp(y, picture_.y0, picture_.y1 - 1) - picture_.y0;
    for (int x = box.x0; x < box.x1; ++x) {
      const double dx = x - tube.front.x;
      const double dy = y - tube.front.y;
      const double along = dx * ux + dy * uy;
      const double across = dy * ux - dx * uy;
      row[x - box.x0] = 0;
      if (along < -0.5 || std::abs(across) > widest + 1) {
        continue;
      }
      const double covered = std::min(along + 0.5, 1.0);
      const double behind = std::max(along, 0.0);
      double outer = between(tube, behind, &Tube::Station::outer_px);
      if (const double left = tube.lip_px - behind; left > 0) {
        outer += std::sqrt(tube.lip_px * tube.lip_px - left * left) - tube.lip_px;
      }
      const double whole = chord(outer, across);
      const double glass =
          whole - chord(std::min(between(tube, behind, &Tube::Station::bore_px), outer), across);
      const int px = std::clamp(x, picture_.x0, picture_.x1 - 1) - picture_.x0;
      const float cell = index_[static_cast<std::size_t>(py) * static_cast<std::size_t>(picture_.width()) +
                                static_cast<std::size_t>(px)];
      row[x - box.x0] = static_cast<float>(covered * (kGlass * glass - static_cast<double>(cell) * whole));
    }
  }
  layer_.blur(sigma);
  add_layer();
}

void OpticalPath::add_layer() noexcept {
  const Box b = layer_.box.meet(picture_);
  for (int y = b.y0; y < b.y1; ++y) {
    float* const to =
        &path_[static_cast<std::size_t>(y - picture_.y0) * static_cast<std::size_t>(picture_.width())] -
        picture_.x0;
    const float* const from = layer_.row(y - layer_.box.y0) - layer_.box.x0;
    for (int x = b.x0; x < b.x1; ++x) {
      to[x] += from[x];
    }
  }
}

void OpticalPath::add_speck(const Pixel& centre, double sigma_px, double slope) noexcept {
  const int reach = static_cast<int>(std::ceil(4.5 * sigma_px));
  const int ix = static_cast<int>(std::floor(centre.x));
  const int iy = static_cast<int>(std::floor(centre.y));
  const Box b = Box{ix - reach, iy - reach, ix + reach + 2, iy + reach + 2}.meet(picture_);
  const double height = slope * sigma_px * std::exp(0.5);  // the steepest place of a Gaussian is at its sigma
  for (int y = b.y0; y < b.y1; ++y) {
    for (int x = b.x0; x < b.x1; ++x) {
      const double q =
          ((x - centre.x) * (x - centre.x) + (y - centre.y) * (y - centre.y)) / (sigma_px * sigma_px);
      path_[static_cast<std::size_t>(y - picture_.y0) * static_cast<std::size_t>(picture_.width()) +
            static_cast<std::size_t>(x - picture_.x0)] += static_cast<float>(height * std::exp(-0.5 * q));
    }
  }
}

void OpticalPath::shine(const std::array<double, 2>& towards, double gain, double blur_px,
                        std::vector<float>& light) {
  const int w = picture_.width();
  const int h = picture_.height();
  const auto row = [&](int y) {
    return &path_[static_cast<std::size_t>(std::clamp(y, 0, h - 1)) * static_cast<std::size_t>(w)];
  };
  layer_.start(picture_);
  for (int y = 0; y < h; ++y) {
    const float* const above = row(y - 1);
    const float* const here = row(y);
    const float* const below = row(y + 1);
    float* const out = layer_.row(y);
    for (int x = 0; x < w; ++x) {
      const double sx = 0.5 * static_cast<double>(here[std::min(x + 1, w - 1)] - here[std::max(x - 1, 0)]);
      const double sy = 0.5 * static_cast<double>(below[x] - above[x]);
      // The path falls towards the light on the side that faces it.
      const double slope = -gain * (sx * towards[0] + sy * towards[1]);
      const double limit = slope > 0 ? kBrightLimit : kDarkLimit;
      const double bent = (sx * sx + sy * sy) / (kApertureSlope * kApertureSlope);
      out[x] = static_cast<float>((1 + limit * std::tanh(slope / limit)) / (1 + bent * bent * bent));
    }
  }
  layer_.blur(std::sqrt(std::max(blur_px * blur_px - kSharp_px * kSharp_px, 0.01)));
  for (std::size_t i = 0; i < light.size(); ++i) {
    light[i] *= layer_.value[i];
  }
}

}  // namespace punctum::sim
