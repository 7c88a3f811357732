#include "hal/sim/camera/microscope.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "hal/sim/camera/area_raster.hpp"
#include "hal/sim/camera/blurred_layer.hpp"
#include "hal/sim/camera/optical_path.hpp"

namespace punctum::sim {
namespace {

// Grey of the empty picture at its centre. MicroscopeParams::contrast is measured on it.
constexpr double kBackground = 150;
constexpr double kMidGrey = 128;  // MicroscopeParams::noise is the deviation here

// Disc of an objective of NA 0.37 in water, as a Gaussian of the same variance: px of blur per px of depth.
constexpr double kDefocusSlope = 0.15;
constexpr double kMaxBlur_px = 12;

// The same of any aperture.
double blur_per_depth(double aperture) {
  constexpr double kWater = 1.33;
  return 0.5 * std::tan(std::asin(aperture / kWater));
}

constexpr double kFarAway_px = 1e6;  // anything further away counts as absent

// A little more light comes from the upper left (oblique illumination): unit vector, x right, y down.
constexpr double kLightX = -0.6;
constexpr double kLightY = -0.8;

// The cell, in shares of the zona's contrast. A rim is a bright line outside and an equally dark one inside
// an edge: it sharpens the edge without moving it.
constexpr double kRim_px = 1.3;
constexpr double kOuterRim = 0.30;
constexpr double kZonaInnerStep = 0.85;  // zona -> perivitelline space
constexpr double kInnerStep = 0.60;      // perivitelline space -> ooplasm
constexpr double kInnerRim = 0.85;
constexpr double kGrain = 0.22;       // standard deviation of the ooplasm's texture
constexpr double kCellRelief = 0.25;  // contrast towards and away from the light
constexpr double kOoplasmShade = 0.30;

// Injection pipette: shares of the background that it absorbs.
constexpr double kNeedleWall = 0.30;
constexpr double kNeedleLumen = 0.06;  // brighter than the background
constexpr double kNeedleBore = 0.62;   // inner over outer radius
constexpr double kNeedleFringe = 0.07;
constexpr double kNeedleEnd = 0.14;

// Holding pipette.
constexpr double kHolderEdge = 0.80;
constexpr double kHolderBody = 0.10;
constexpr double kHolderRelief = 0.20;
constexpr double kHolderLip = 0.5;    // radius of the fire-polished rim, over the outer radius
constexpr double kHolderBore = 0.42;  // lumen behind the fire-polished mouth, over the outer radius

constexpr double kReliefGain = 2.65;  // relative brightness per slope of the path, at the usual contrast
constexpr double kReliefOfSpeck =
    0.5;  // steepest slope, per share of the light that it takes in bright field

constexpr int kGrainSide = 256;  // texture tile, a power of two

std::uint64_t mix(std::uint64_t x) noexcept {  // splitmix64 finaliser
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// Counter-based: the n-th number of a stream does not depend on the others.
class Stream {
 public:
  explicit Stream(std::uint64_t key) noexcept : key_(mix(key)) {}
  std::uint64_t next() noexcept { return mix(key_ + 0xd1342543de82ef95ULL * n_++); }
  double uniform(double low, double high) noexcept {
    return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t key_;
  std::uint64_t n_ = 0;
};

// Standard normal numbers from 12 random bits: the mean of each of 4096 equally likely slices, scaled to unit
// variance. The largest is 3.9 standard deviations; a picture of 8 bits does not show more.
class NormalTable {
 public:
  NormalTable() {
    const double n = kSlices;
    double low_density = 0;
    double sum2 = 0;
    double from = -9;
    std::array<double, kSlices> mean{};
    for (int i = 0; i < kSlices; ++i) {
      double density = 0;
      if (i + 1 < kSlices) {
        const double p = (i + 1) / n;
        double lo = from;
        double hi = 9;
        for (int k = 0; k < 60; ++k) {
          const double mid = 0.5 * (lo + hi);
          (0.5 * std::erfc(-mid / std::numbers::sqrt2) < p ? lo : hi) = mid;
        }
        from = lo;
        density = std::exp(-0.5 * lo * lo) / std::sqrt(2 * std::numbers::pi);
      }
      mean[static_cast<std::size_t>(i)] = n * (low_density - density);
      low_density = density;
      sum2 += mean[static_cast<std::size_t>(i)] * mean[static_cast<std::size_t>(i)];
    }
    const double scale = 1 / std::sqrt(sum2 / n);
    for (int i = 0; i < kSlices; ++i) {
      value_[static_cast<std::size_t>(i)] = static_cast<float>(mean[static_cast<std::size_t>(i)] * scale);
    }
  }
  void fill(std::uint64_t key, float* out, int count) const noexcept {
    Stream bits(key);
    int i = 0;
    while (i < count) {
      std::uint64_t word = bits.next();
      const int end = std::min(i + 5, count);  // 5 x 12 bits of 64
      for (; i < end; ++i, word >>= 12) {
        out[i] = value_[word & (kSlices - 1)];
      }
    }
  }

 private:
  static constexpr int kSlices = 4096;
  std::array<float, kSlices> value_{};
};

// Granules of the ooplasm: band-passed noise, lit from one side, tiled; mean 0, deviation 1.
std::vector<float> make_grain(std::uint64_t seed) {
  constexpr int n = kGrainSide;
  const auto at = [](int x, int y) {
    return static_cast<std::size_t>(y & (n - 1)) * n + static_cast<std::size_t>(x & (n - 1));
  };
  NormalTable normal;
  std::vector<float> noise(static_cast<std::size_t>(n) * n);
  for (int y = 0; y < n; ++y) {
    normal.fill(mix(seed) + static_cast<std::uint64_t>(y), &noise[at(0, y)], n);
  }
  const auto smooth = [&](const std::vector<float>& in, double sigma) {
    const int reach = static_cast<int>(std::ceil(3 * sigma));
    std::vector<float> kernel;
    for (int i = -reach; i <= reach; ++i) {
      kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    }
    std::vector<float> across(in.size());
    std::vector<float> out(in.size());
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        float s = 0;
        for (int i = -reach; i <= reach; ++i) {
          s += kernel[static_cast<std::size_t>(i + reach)] * in[at(x + i, y)];
        }
        across[at(x, y)] = s;
      }
    }
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        float s = 0;
        for (int i = -reach; i <= reach; ++i) {
          s += kernel[static_cast<std::size_t>(i + reach)] * across[at(x, y + i)];
        }
        out[at(x, y)] = s;
      }
    }
    return out;
  };
  const auto normalise = [](std::vector<float>& v) {
    double sum = 0;
    double sum2 = 0;
    for (const float f : v) {
      sum += static_cast<double>(f);
      sum2 += static_cast<double>(f) * static_cast<double>(f);
    }
    const double mean = sum / static_cast<double>(v.size());
    const double deviation = std::sqrt(std::max(1e-12, sum2 / static_cast<double>(v.size()) - mean * mean));
    for (float& f : v) {
      f = static_cast<float>((static_cast<double>(f) - mean) / deviation);
    }
  };
  std::vector<float> fine = smooth(noise, 1.1);
  std::vector<float> coarse = smooth(noise, 5.0);
  normalise(fine);
  normalise(coarse);
  std::vector<float> grain(noise.size());
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      // The slope towards the light gives the relief, the height itself some darkness.
      const float slope = (fine[at(x + 1, y)] - fine[at(x - 1, y)]) * static_cast<float>(kLightX) +
                          (fine[at(x, y + 1)] - fine[at(x, y - 1)]) * static_cast<float>(kLightY);
      grain[at(x, y)] = slope + 0.5F * fine[at(x, y)] + 0.35F * coarse[at(x, y)];
    }
  }
  normalise(grain);
  return grain;
}

struct Impurity {
  double x = 0;  // px at frame 0
  double y = 0;
  double vx = 0;  // px/s
  double vy = 0;
  double wander = 0;  // px
  double phase = 0;
  double radius = 0;  // px, standard deviation of its core
  double depth = 0;   // share of the background that its middle absorbs; negative: bright
  double z_m = 0;
};

constexpr int kAngles = 512;  // of the table of the inner contour's radius

// Angle from the x axis, kAngles per turn: 0 .. kAngles. The error is below 1e-3 rad.
float turn(float x, float y) noexcept {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float t = std::min(ax, ay) / std::max(std::max(ax, ay), 1e-12F);
  const float t2 = t * t;
  float a = t * (0.99921F + t2 * (-0.32118F + t2 * (0.14627F - 0.03899F * t2)));
  if (ay > ax) {
    a = std::numbers::pi_v<float> / 2 - a;
  }
  if (x < 0) {
    a = std::numbers::pi_v<float> - a;
  }
  if (y < 0) {
    a = 2 * std::numbers::pi_v<float> - a;
  }
  return a * (kAngles / (2 * std::numbers::pi_v<float>));
}

}  // namespace

struct Microscope::Impl {
  MicroscopeParams params;
  NeedleParams needle;
  std::optional<HolderParams> holder;
  std::uint64_t seed = 0;
  Box picture;

  NormalTable normal;
  std::vector<float> grain;
  std::vector<Impurity> impurities;

  std::vector<float> empty;  // illumination alone
  std::vector<float> base;   // with the holding pipette
  std::optional<Vec3> base_mouth_m;
  std::vector<float> light;  // the present picture
  std::array<double, 2> towards_light{};
  OpticalPath path;  // in relief
  std::vector<float> noise_row;

  AreaRaster levels;
  AreaRaster ooplasm;
  BlurredLayer layer;
  std::vector<Pixel> outer;
  std::vector<Pixel> inner;
  std::vector<Pixel> moved;
  std::array<float, kAngles + 1> inner_radius{};

  Impl(const MicroscopeParams& p, const NeedleParams& n, const std::optional<HolderParams>& h,
       std::uint64_t s)
      : params(p), needle(n), holder(h), seed(s) {
    const MicroscopeParams usual;
    const auto finite = [](double& value, double low, double high, double otherwise) {
      value = std::isfinite(value) ? std::clamp(value, low, high) : otherwise;
    };
    params.width = std::clamp(params.width, 1, 16384);
    params.height = std::clamp(params.height, 1, 16384);
    params.impurities = std::clamp(params.impurities, 0, 10000);
    finite(params.pixel_m, 1e-9, 1e-3, usual.pixel_m);
    finite(params.fps, 1e-3, 1e6, usual.fps);
    finite(params.psf_px, 0.2, kMaxBlur_px, usual.psf_px);
    finite(params.defocus_m, -1, 1, 0);
    finite(params.contrast, -kBackground, kBackground, usual.contrast);
    finite(params.noise, 0, 1000, usual.noise);
    finite(params.gradient, -2, 2, usual.gradient);
    if (params.relief) {
      finite(params.relief->light_deg, -360, 360, 0);
      finite(params.relief->aperture, 0.01, 1.2, ReliefParams{}.aperture);
      const double angle = params.relief->light_deg * std::numbers::pi / 180;
      towards_light = {std::cos(angle), std::sin(angle)};
    }
    picture = {0, 0, params.width, params.height};
    grain = make_grain(seed);
    lay_illumination();
    base = empty;
    light.resize(empty.size());
    noise_row.resize(static_cast<std::size_t>(params.width));
    Stream random(seed ^ 0x1d0f1c5ULL);
    const double margin = 20;
    for (int i = 0; i < params.impurities; ++i) {
      Impurity b;
      b.x = random.uniform(-margin, params.width + margin);
      b.y = random.uniform(-margin, params.height + margin);
      const double speed = random.uniform(0.3, 2.0);
      const double heading = random.uniform(0, 2 * std::numbers::pi);
      b.vx = speed * std::cos(heading);
      b.vy = speed * std::sin(heading);
      b.wander = random.uniform(0.3, 1.5);
      b.phase = random.uniform(0, 2 * std::numbers::pi);
      b.radius = random.uniform(0.9, 2.4);
      b.depth = random.uniform(0.10, 0.28) * (random.uniform(0, 1) < 0.6 ? 1 : -0.8);
      b.z_m = random.uniform(-12e-6, 12e-6);
      impurities.push_back(b);
    }
  }

  [[nodiscard]] std::size_t index(int x, int y) const noexcept {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(params.width) + static_cast<std::size_t>(x);
  }

  [[nodiscard]] double defocus_px(double z_m) const noexcept {
    const double depth_px = (z_m + params.defocus_m) / params.pixel_m;
    return std::isfinite(depth_px) ? std::min(kMaxBlur_px, std::abs(kDefocusSlope * depth_px)) : kMaxBlur_px;
  }
  [[nodiscard]] double blur_px(double z_m) const noexcept {
    return std::min(kMaxBlur_px, std::hypot(params.psf_px, defocus_px(z_m)));
  }

  // From metres in the world frame to px. False: it cannot be drawn.
  [[nodiscard]] bool to_px(double x_m, double y_m, Pixel& p) const noexcept {
    p.x = x_m / params.pixel_m + (params.width - 1) / 2.0;
    p.y = y_m / params.pixel_m + (params.height - 1) / 2.0;
    return std::abs(p.x) < kFarAway_px && std::abs(p.y) < kFarAway_px;
  }
  [[nodiscard]] bool to_px(std::span<const std::array<double, 2>> line, std::vector<Pixel>& out) const {
    out.resize(line.size());
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (!to_px(line[i][0], line[i][1], out[i])) {
        return false;
      }
    }
    return line.size() >= 3;
  }

  // Brightest towards the upper left; the two far corners differ by `gradient` of the middle.
  void lay_illumination() {
    empty.resize(index(0, params.height));
    for (int y = 0; y < params.height; ++y) {
      for (int x = 0; x < params.width; ++x) {
        const double u = params.width > 1 ? static_cast<double>(x) / (params.width - 1) - 0.5 : 0;
        const double v = params.height > 1 ? static_cast<double>(y) / (params.height - 1) - 0.5 : 0;
        empty[index(x, y)] = static_cast<float>(kBackground * (1 - params.gradient * (0.6 * u + 0.4 * v)));
      }
    }
  }

  // light *= 1 - layer, over the area of the layer.
  void take_away(std::vector<float>& from) noexcept {
    const Box b = layer.box.meet(picture);
    for (int y = b.y0; y < b.y1; ++y) {
      float* const to = &from[index(0, y)];
      const float* const l = layer.row(y - layer.box.y0) - layer.box.x0;
      for (int x = b.x0; x < b.x1; ++x) {
        to[x] *= 1.0F - l[x];
      }
    }
  }

  void draw_holder(const Vec3& mouth_m) {
    base = empty;
    Pixel mouth;
    const double outer_px = holder->outer_radius_m / params.pixel_m;
    const double bore_px = std::min(holder->inner_radius_m, 0.9 * holder->outer_radius_m) / params.pixel_m;
    if (!to_px(mouth_m.x(), mouth_m.y(), mouth) || !(outer_px > 1 && outer_px < kFarAway_px) ||
        !(bore_px >= 0)) {
      return;
    }
    const double sigma = blur_px(mouth_m.z());
    const int margin = static_cast<int>(std::ceil(kBlurReach * sigma)) + 4;
    const Box reach{-margin - 1, static_cast<int>(std::floor(mouth.y - outer_px)) - margin,
                    static_cast<int>(std::ceil(mouth.x)) + margin,
                    static_cast<int>(std::ceil(mouth.y + outer_px)) + margin};
    const Box box = reach.meet(picture.grown(margin));
    if (box.empty()) {
      return;
    }
    layer.start(box);
    const double lip = kHolderLip * outer_px;
    const double wide = std::max(bore_px, kHolderBore * outer_px);
    for (int y = box.y0; y < box.y1; ++y) {
      float* const row = layer.row(y - box.y0);
      const double v = y - mouth.y;
      for (int x = box.x0; x < box.x1; ++x) {
        const double back = mouth.x - x;  // into the tube
        // Distance to the silhouette, a box with rounded front corners; negative inside.
        const double qx = lip - back;
        const double qy = std::abs(v) - (outer_px - lip);
        const double d =
            std::hypot(std::max(qx, 0.0), std::max(qy, 0.0)) + std::min(std::max(qx, qy), 0.0) - lip;
        const double inside = std::clamp(0.5 - d, 0.0, 1.0);
        double take = -0.08 * std::exp(-0.5 * (d - 2.5) * (d - 2.5) / 1.5);  // bright fringe outside
        if (inside > 0) {
          const double depth = std::max(-d, 0.0);
          // Near the silhouette the wall refracts light away.
          double glass =
              kHolderEdge * std::exp(-depth * depth / 18) + 0.42 * std::exp(-depth / (0.22 * outer_px));
          glass += kHolderBody - kHolderRelief * std::sin(0.5 * std::numbers::pi * v / outer_px);
          // The lumen narrows to the mouth.
          const double t = std::clamp(back / (1.3 * outer_px), 0.0, 1.0);
          const double bore = bore_px + (wide - bore_px) * t * t * (3 - 2 * t);
          const double to_bore = std::abs(v) - bore;
          const double lumen = 1 / (1 + std::exp(to_bore / 0.6));
          const double wall_line =
              std::exp(-0.5 * to_bore * to_bore / 2.5) + 0.35 * std::exp(-std::abs(to_bore) / 6);
          glass = glass * (1 - 0.6 * lumen) + std::clamp(back / 3.0, 0.0, 1.0) * 0.45 * wall_line;
          take = inside * glass + (1 - inside) * take;
        }
        row[x - box.x0] = static_cast<float>(std::min(take, 0.93));
      }
    }
    layer.blur(sigma);
    take_away(base);
  }

  void add_holder_to_path(const Vec3& mouth_m) {
    Tube tube;
    const double outer_px = holder->outer_radius_m / params.pixel_m;
    const double bore_px = std::min(holder->inner_radius_m, 0.9 * holder->outer_radius_m) / params.pixel_m;
    if (!to_px(mouth_m.x(), mouth_m.y(), tube.front) || !(outer_px > 1 && outer_px < kFarAway_px) ||
        !(bore_px >= 0)) {
      return;
    }
    tube.inwards = {-1, 0};
    tube.lip_px = kHolderLip * outer_px;
    const double wide = std::max(bore_px, kHolderBore * outer_px);
    tube.stations = {
        {{0, outer_px, bore_px}, {1.3 * outer_px, outer_px, wide}, {2 * outer_px, outer_px, wide}}};
    path.add_tube(tube, defocus_px(mouth_m.z()));
  }

  void draw_cell(const CellInPicture& cell) {
    Pixel centre;
    if (!to_px(cell.outer, outer) || !to_px(cell.centre_m.x(), cell.centre_m.y(), centre)) {
      return;
    }
    const bool has_inner = !cell.inner.empty() && to_px(cell.inner, inner);
    const double sigma = blur_px(cell.centre_m.z());
    const double margin = kBlurReach * sigma + 3;
    const Box box = box_of(outer, margin).meet(picture.grown(static_cast<int>(std::ceil(margin))));
    if (box.empty()) {
      return;
    }

    const double grain_contrast = params.contrast / kBackground;
    const double c = params.relief ? 0 : grain_contrast;  // in relief the path makes the picture
    levels.start(box);
    levels.add(outer, c);
    add_rim(outer, kOuterRim * c);
    const double size = std::sqrt(std::abs(signed_area(outer)));
    const double zona_px = std::clamp(cell.zona_h_m / params.pixel_m, 0.0, 0.3 * size);
    if (zona_px > 0) {
      offset(outer, -zona_px, moved);
      levels.add(moved, -kZonaInnerStep * c);
    }
    ooplasm.start(box);
    double reference = 0;
    if (params.relief) {
      const std::span<const Pixel> zona_inner =
          zona_px > 0 ? std::span<const Pixel>(moved) : std::span<const Pixel>();
      path.add_cell(outer, zona_inner, has_inner ? std::span<const Pixel>(inner) : zona_inner, centre,
                    defocus_px(cell.centre_m.z()), blur_per_depth(params.relief->aperture));
    }
    if (has_inner) {
      levels.add(inner, kInnerStep * c);
      add_rim(inner, kInnerRim * c);
      ooplasm.add(inner, 1);
      reference = table_inner_radius(centre);
    } else if (zona_px > 0) {
      ooplasm.add(moved, 1);  // without an inner membrane the content of the cell is granular too
      levels.add(moved, 0.3 * c);
      std::swap(inner, moved);
      reference = table_inner_radius(centre);
    }

    layer.start(box);
    const int w = box.width();
    const double radius = std::max(size / std::sqrt(std::numbers::pi), 1.0);
    const std::uint64_t shift = mix(cell.identity ^ 0x6a09e667f3bcc909ULL);
    const float shift_x = static_cast<float>(shift & 0xff);
    const float shift_y = static_cast<float>((shift >> 8) & 0xff);
    const float grain_scale = static_cast<float>(kGrain * grain_contrast);
    const float shade = static_cast<float>(kOoplasmShade * c / radius);
    const float relief = static_cast<float>(kCellRelief / radius);
    for (int y = 0; y < box.height(); ++y) {
      const float* const level = levels.row(y);
      const float* const cover = ooplasm.row(y);
      float* const row = layer.row(y);
      float sum = 0;
      float inside = 0;
      const float dy = static_cast<float>(box.y0 + y - centre.y);
      for (int x = 0; x < w; ++x) {
        sum += level[x];
        inside += cover[x];
        const float dx = static_cast<float>(box.x0 + x - centre.x);
        const float away = -(dx * static_cast<float>(kLightX) + dy * static_cast<float>(kLightY));
        float value = sum * std::clamp(1 + relief * away, 0.5F, 1.5F);
        if (inside > 1e-3F && reference > 0) {
          value +=
              inside * (std::clamp(shade * away, -0.2F, 0.2F) +
                        grain_scale * sample_grain(dx, dy, static_cast<float>(reference), shift_x, shift_y));
        }
        row[x] = value;
      }
    }
    layer.blur(sigma);
    take_away(light);
  }

  void add_rim(std::span<const Pixel> line, double strength) {
    offset(line, kRim_px, moved);
    levels.add(moved, -strength);  // bright outside
    levels.add(line, 2 * strength);
    offset(line, -kRim_px, moved);
    levels.add(moved, -strength);
  }

  // Radius of the inner contour by angle about the centre, so that the grain follows a dimple. Returns the
  // largest radius; 0 when the contour does not enclose the centre.
  double table_inner_radius(const Pixel& centre) {
    inner_radius.fill(0);
    double largest = 0;
    for (std::size_t i = 0, j = inner.size() - 1; i < inner.size(); j = i++) {
      const double ax = inner[j].x - centre.x;
      const double ay = inner[j].y - centre.y;
      const double bx = inner[i].x - centre.x;
      const double by = inner[i].y - centre.y;
      const double ra = std::hypot(ax, ay);
      const double rb = std::hypot(bx, by);
      const double ta = static_cast<double>(turn(static_cast<float>(ax), static_cast<float>(ay)));
      double tb = static_cast<double>(turn(static_cast<float>(bx), static_cast<float>(by)));
      if (tb - ta > kAngles / 2.0) {
        tb -= kAngles;
      }
      if (tb - ta < -kAngles / 2.0) {
        tb += kAngles;
      }
      const int from = static_cast<int>(std::floor(std::min(ta, tb)));
      const int to = static_cast<int>(std::ceil(std::max(ta, tb)));
      for (int t = from; t <= to; ++t) {
        const double f = std::abs(tb - ta) > 1e-9 ? std::clamp((t - ta) / (tb - ta), 0.0, 1.0) : 0.5;
        float& r = inner_radius[static_cast<std::size_t>((t + 2 * kAngles) % kAngles)];
        r = std::max(r, static_cast<float>(ra + f * (rb - ra)));
      }
      largest = std::max({largest, ra, rb});
    }
    inner_radius[kAngles] = inner_radius[0];
    for (const float r : inner_radius) {
      if (r <= 0) {
        return 0;
      }
    }
    return largest;
  }

  [[nodiscard]] float sample_grain(float dx, float dy, float reference, float shift_x,
                                   float shift_y) const noexcept {
    const float angle = std::min(turn(dx, dy), kAngles - 0.001F);
    const int a = static_cast<int>(angle);
    const float f = angle - static_cast<float>(a);
    const float here = inner_radius[static_cast<std::size_t>(a)] * (1 - f) +
                       inner_radius[static_cast<std::size_t>(a) + 1] * f;
    const float stretch = reference / std::max(here, 1.0F);
    // Tile coordinates, kept positive.
    const float u = dx * stretch + shift_x + 32768.0F;
    const float v = dy * stretch + shift_y + 32768.0F;
    if (!(u > 0 && u < 65536 && v > 0 && v < 65536)) {
      return 0;
    }
    const int iu = static_cast<int>(u);
    const int iv = static_cast<int>(v);
    const float fu = u - static_cast<float>(iu);
    const float fv = v - static_cast<float>(iv);
    const int m = kGrainSide - 1;
    const float* const top = &grain[static_cast<std::size_t>(iv & m) * kGrainSide];
    const float* const bottom = &grain[static_cast<std::size_t>((iv + 1) & m) * kGrainSide];
    const float p = top[iu & m] * (1 - fu) + top[(iu + 1) & m] * fu;
    const float q = bottom[iu & m] * (1 - fu) + bottom[(iu + 1) & m] * fu;
    return p * (1 - fv) + q * fv;
  }

  void draw_needle(const NeedleInPicture& n) {
    Pixel tip;
    if (!to_px(n.tip_m.x(), n.tip_m.y(), tip) || !n.axis.allFinite()) {
      return;
    }
    const double across = std::hypot(n.axis.x(), n.axis.y());
    const double full = n.axis.norm();
    if (!(full > 1e-6) || !(full < 1e6)) {
      return;
    }
    const double ax = across > 1e-6 * full ? n.axis.x() / across : -1;
    const double ay = across > 1e-6 * full ? n.axis.y() / across : 0;
    const double seen =
        std::max(across / full, 0.05);  // foreshortening of a needle tilted out of the picture
    const double tip_radius = needle.radius_m / params.pixel_m;
    const double shaft_radius = std::max(needle.shaft_radius_m / params.pixel_m, tip_radius);
    const double taper = std::max(needle.taper_m / params.pixel_m * seen, 1.0);
    if (!(tip_radius > 0) || !(shaft_radius < kFarAway_px) || !(taper < kFarAway_px)) {
      return;
    }

    if (params.relief) {
      const auto station = [](double behind_px, double radius_px) {
        return Tube::Station{behind_px, radius_px, kNeedleBore * radius_px};
      };
      const Tube tube{
          tip,
          {-ax, -ay},
          0,
          {station(0, tip_radius), station(taper, shaft_radius), station(2 * taper, shaft_radius)}};
      path.add_tube(tube, defocus_px(n.tip_m.z()));
      return;
    }

    const double sigma = blur_px(n.tip_m.z());
    const double margin = kBlurReach * sigma + 3;
    const Box near = picture.grown(static_cast<int>(std::ceil(margin)));
    // Long enough to leave the picture in any direction.
    const double beyond = std::hypot(tip.x - 0.5 * near.width(), tip.y - 0.5 * near.height()) +
                          std::hypot(near.width(), near.height()) + taper;
    // A strip about the axis, from `from` to `beyond` behind the tip.
    const auto strip = [&](double from, double at_tip, double at_shaft, std::array<Pixel, 6>& out) {
      const double at_from = at_tip + (at_shaft - at_tip) * std::min(from / taper, 1.0);
      const std::array<std::array<double, 2>, 3> station{
          {{from, at_from}, {taper, at_shaft}, {beyond, at_shaft}}};
      for (std::size_t i = 0; i < 3; ++i) {
        const double s = station[i][0];
        const double r = station[i][1];
        out[i] = {tip.x - s * ax - r * ay, tip.y - s * ay + r * ax};
        out[5 - i] = {tip.x - s * ax + r * ay, tip.y - s * ay - r * ax};
      }
    };
    std::array<Pixel, 6> wall;
    strip(0, tip_radius, shaft_radius, wall);
    const Box box = box_of(wall, margin).meet(near);
    if (box.empty()) {
      return;
    }
    levels.start(box);
    levels.add(wall, kNeedleWall + 2 * kNeedleFringe);
    std::array<Pixel, 6> other;
    for (const double beside : {kRim_px, -std::min(kRim_px, 0.5 * tip_radius)}) {
      strip(0, tip_radius + beside, shaft_radius + beside, other);
      levels.add(other, -kNeedleFringe);
    }
    strip(0, kNeedleBore * tip_radius, kNeedleBore * shaft_radius, other);
    levels.add(other, -kNeedleWall - kNeedleLumen + kNeedleEnd);
    strip(std::min(1.2, 0.5 * taper), kNeedleBore * tip_radius, kNeedleBore * shaft_radius, other);
    levels.add(other, -kNeedleEnd);

    layer.start(box);
    for (int y = 0; y < box.height(); ++y) {
      const float* const level = levels.row(y);
      float* const row = layer.row(y);
      float sum = 0;
      for (int x = 0; x < box.width(); ++x) {
        sum += level[x];
        row[x] = sum;
      }
    }
    layer.blur(sigma);
    take_away(light);
  }

  void draw_impurities(double t_s) noexcept {
    const double margin = 20;
    const double w = params.width + 2 * margin;
    const double h = params.height + 2 * margin;
    for (const Impurity& b : impurities) {
      const double px = b.x + b.vx * t_s + b.wander * std::sin(0.7 * t_s + b.phase) + margin;
      const double py = b.y + b.vy * t_s + b.wander * std::cos(0.9 * t_s + b.phase) + margin;
      const double cx = px - w * std::floor(px / w) - margin;
      const double cy = py - h * std::floor(py / h) - margin;
      if (params.relief) {
        path.add_speck({cx, cy}, std::hypot(b.radius, defocus_px(b.z_m)), kReliefOfSpeck * b.depth);
        continue;
      }
      const double s = std::hypot(b.radius, blur_px(b.z_m));
      const double depth = b.depth * b.radius * b.radius / (s * s) * 2.2;
      const int reach = static_cast<int>(std::ceil(4.5 * s));
      const int ix = static_cast<int>(std::floor(cx));
      const int iy = static_cast<int>(std::floor(cy));
      const Box box = Box{ix - reach, iy - reach, ix + reach + 2, iy + reach + 2}.meet(picture);
      const float inverse = static_cast<float>(0.5 / (s * s));
      for (int y = box.y0; y < box.y1; ++y) {
        float* const row = &light[index(0, y)];
        const float dy = static_cast<float>(y - cy);
        for (int x = box.x0; x < box.x1; ++x) {
          const float dx = static_cast<float>(x - cx);
          const float q = (dx * dx + dy * dy) * inverse;
          row[x] *= 1.0F - static_cast<float>(depth) * (1 - 0.8F * q) * std::exp(-q);
        }
      }
    }
  }

  // Shot noise: its variance is proportional to the light.
  void expose(std::uint64_t frame_number, std::span<std::uint8_t> out) noexcept {
    const float scale = static_cast<float>(params.noise / std::sqrt(kMidGrey));
    const std::uint64_t key = mix(mix(seed ^ 0x5b07ULL) ^ frame_number);
    const int w = params.width;
    float* const g = noise_row.data();
    if (!(scale > 0)) {
      std::fill(noise_row.begin(), noise_row.end(), 0.0F);
    }
    for (int y = 0; y < params.height; ++y) {
      if (scale > 0) {
        normal.fill(key + static_cast<std::uint64_t>(y) * 0x9e3779b97f4a7c15ULL, g, w);
      }
      const float* const from = &light[index(0, y)];
      std::uint8_t* const to = &out[index(0, y)];
      for (int x = 0; x < w; ++x) {
        const float clean = std::max(0.0F, from[x]);  // in this order NaN becomes 0
        const float value = clean + scale * std::sqrt(clean) * g[x] + 0.5F;
        to[x] = static_cast<std::uint8_t>(static_cast<std::int32_t>(std::min(255.0F, std::max(0.0F, value))));
      }
    }
  }

  void render(const PictureScene& scene, std::uint64_t frame_number, std::span<std::uint8_t> out) {
    if (out.size() < empty.size()) {
      return;
    }
    const bool holding = holder && scene.holder_mouth_m && scene.holder_mouth_m->allFinite();
    if (params.relief) {
      path.start(picture);
      if (holding) {
        add_holder_to_path(*scene.holder_mouth_m);
      }
    } else if (holding != base_mouth_m.has_value() || (holding && *scene.holder_mouth_m != *base_mouth_m)) {
      base_mouth_m.reset();
      if (holding) {
        draw_holder(*scene.holder_mouth_m);
        base_mouth_m = *scene.holder_mouth_m;
      } else {
        base = empty;
      }
    }
    std::copy(base.begin(), base.end(), light.begin());
    if (scene.cell) {
      draw_cell(*scene.cell);
    }
    if (scene.needle) {
      draw_needle(*scene.needle);
    }
    draw_impurities(static_cast<double>(frame_number) / params.fps);
    if (params.relief) {
      path.shine(towards_light, kReliefGain * params.contrast / MicroscopeParams{}.contrast, params.psf_px,
                 light);
    }
    expose(frame_number, out);
  }
};

Microscope::Microscope(const MicroscopeParams& params, const NeedleParams& needle,
                       const std::optional<HolderParams>& holder, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(params, needle, holder, seed)) {}
Microscope::~Microscope() = default;
Microscope::Microscope(Microscope&&) noexcept = default;
Microscope& Microscope::operator=(Microscope&&) noexcept = default;

int Microscope::width() const noexcept { return impl_->params.width; }
int Microscope::height() const noexcept { return impl_->params.height; }
double Microscope::blur_px(double z_m) const noexcept { return impl_->blur_px(z_m); }

void Microscope::render(const PictureScene& scene, std::uint64_t frame_number, std::span<std::uint8_t> out) {
  impl_->render(scene, frame_number, out);
}

}  // namespace punctum::sim
