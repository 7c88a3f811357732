#include "tools/report/vision_phases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <span>
#include <tuple>

#include "rt/station/surface.hpp"
#include "vision/image/polyline.hpp"
#include "vision/surface/surface_grid.hpp"
#include "vision/tracker.hpp"

namespace punctum::report {

namespace {

constexpr double kRight_px = 2, kWrong_px = 4;  // nowhere further away; somewhere further away
constexpr double kNormal95 = 1.96;
constexpr std::array<const char*, kStretches> kPhases{"approach", "contact", "puncture", "inside"};
constexpr std::array<const char*, 2> kMethods{"tracker", "paper's method"};

}  // namespace

// Signed numbers, and how many lie within one and 1.96 of their standard deviations, where they have some.
struct SignedErrors {
  std::size_t n = 0, told = 0, within_1 = 0, within_2 = 0;
  double sum = 0, sum2 = 0;

  void add(double e) {
    ++n;
    sum += e;
    sum2 += e * e;
  }
  void covered(double e, double sd) {
    ++told;
    within_1 += std::abs(e) < sd ? 1 : 0;
    within_2 += std::abs(e) < kNormal95 * sd ? 1 : 0;
  }
  [[nodiscard]] double bias() const { return n == 0 ? std::nan("") : sum / static_cast<double>(n); }
  [[nodiscard]] double rms() const {
    return n == 0 ? std::nan("") : std::sqrt(sum2 / static_cast<double>(n));
  }
  [[nodiscard]] double spread() const {
    return n == 0 ? std::nan("") : std::sqrt(std::max(0.0, rms() * rms() - bias() * bias()));
  }
  [[nodiscard]] double share(std::size_t within) const {
    return told == 0 ? std::nan("") : static_cast<double>(within) / static_cast<double>(told);
  }
};

// One membrane in one phase. SignedErrors in px along the normal, > 0: seen too far out; at the points of the
// true contour, with those that a pipette hides.
struct MembraneScore {
  int frames = 0, claimed = 0, right = 0, wrong = 0;
  double length_px = 0;  // sum over the frames
  SignedErrors at_truth{}, at_nodes{};

  void add(const vision::Contour& truth, const vision::Contour& seen, std::span<const double> sd_px,
           bool claims) {
    ++frames;
    length_px += cv::arcLength(std::vector<cv::Point2f>(truth.begin(), truth.end()), true);
    if (!claims) {
      return;
    }
    ++claimed;
    const vision::Polyline true_line(truth, true), seen_line(seen, true);
    const std::vector<cv::Point2f> polygon(seen.begin(), seen.end());
    double worst = 0;
    for (const vision::Point& p : truth) {
      const double d = seen_line.distance(p);
      at_truth.add(cv::pointPolygonTest(polygon, p, false) > 0 ? d : -d);
      worst = std::max(worst, d);
    }
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const double d = true_line.distance(seen[i]);
      worst = std::max(worst, d);
      if (sd_px.size() == seen.size()) {
        at_nodes.covered(d, sd_px[i]);
      }
    }
    right += worst < kRight_px ? 1 : 0;
    wrong += worst > kWrong_px ? 1 : 0;
  }
};

// What is one number per frame, px.
struct ObjectScore {
  int frames = 0;
  SignedErrors tip{}, wd{}, holder{};
};

namespace {

// Where the surface cuts the plane of the picture.
vision::Contour section_of(const vision::MembraneNet& net, const vision::SurfaceGrid& grid,
                           vision::GridVectors& points) {
  grid.points(net, points);
  vision::Contour out;
  const auto along = static_cast<std::size_t>(grid.along());
  for (std::size_t i = 0; i < along; ++i) {
    out.emplace_back(points.x[2 * i], points.y[2 * i]);
  }
  for (std::size_t i = along - 1; i-- > 1;) {
    out.emplace_back(points.x[2 * i + 1], points.y[2 * i + 1]);
  }
  return out;
}

}  // namespace

Interval share_interval(int good, int all) {
  if (all == 0) {
    return {};
  }
  const double n = all, p = good / n, z2 = kNormal95 * kNormal95;
  const double middle = (p + z2 / (2 * n)) / (1 + z2 / n);
  const double half = kNormal95 * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n)) / (1 + z2 / n);
  return {middle - half, middle + half};
}

double contour_bound_px(double noise, double length_px, double blur_px, double contrast) {
  const double variance = 2 * std::sqrt(std::numbers::pi) * blur_px * noise * noise / (contrast * contrast);
  return std::sqrt(variance * kContourModes / length_px);
}

struct PhaseScores::Scores {
  struct Key {
    PictureKind kind;
    int method, phase;
    std::string membrane;
    auto operator<=>(const Key&) const = default;
  };
  std::map<Key, MembraneScore> membranes;
  std::map<std::tuple<PictureKind, int, int>, ObjectScore> objects;  // kind, method, phase
  double pixel_um = 0, contrast = 0;

  void see(const PictureKind& kind, const DrawnInjection& injection, int method);
  [[nodiscard]] double bound_um(const Key& key, const MembraneScore& s) const {
    return pixel_um * contour_bound_px(key.kind.noise, s.length_px / s.frames, key.kind.blur_px, contrast);
  }
  // Of all phases together.
  [[nodiscard]] MembraneScore whole(const PictureKind& kind, int method, const std::string& membrane) const;
};

void PhaseScores::Scores::see(const PictureKind& kind, const DrawnInjection& injection, int method) {
  vision::VisionConfig config = injection.config();
  config.method = method == 0 ? vision::Method::tracker : vision::Method::paper;
  config.surface = method == 0;
  vision::Tracker tracker(config, injection.lens.width, injection.lens.height);
  const vision::SurfaceGrid grid(rt::MembraneSurface::kControlPoints, 257, 2);
  vision::GridVectors points;
  std::optional<vision::Point> holder_off;  // seen less true, in the first frame that shows it
  for (std::size_t f = 0; f < injection.truth.size(); ++f) {
    const vision::Result& seen = tracker.process(injection.frame(f));
    const FrameTruth& t = injection.truth[f];
    const int phase = static_cast<int>(t.stretch);
    membranes[{kind, method, phase, "outer"}].add(t.outer, seen.outer.contour, seen.outer.sd_px,
                                                  seen.outer.ok);
    membranes[{kind, method, phase, "inner"}].add(t.inner, seen.inner.contour, seen.inner.sd_px,
                                                  seen.inner.ok);
    if (method == 0) {
      const bool made = seen.outer.ok && seen.outer_net && seen.outer_net->ok;
      membranes[{kind, method, phase, "outer surface"}].add(
          t.outer, made ? section_of(*seen.outer_net, grid, points) : vision::Contour{}, {}, made);
    }
    ObjectScore& o = objects[{kind, method, phase}];
    ++o.frames;
    if (seen.needle.ok) {
      const double ahead = (seen.needle.tip - t.tip).dot(seen.needle.axis);
      o.tip.add(ahead);
      if (seen.needle.sd > 0) {
        o.tip.covered(ahead, seen.needle.sd);
      }
    }
    if (t.stretch == Stretch::indentation && seen.wd_px) {
      const double e = *seen.wd_px - t.wd_m / injection.lens.pixel_m;
      o.wd.add(e);
      if (seen.wd_sd_px > 0) {
        o.wd.covered(e, seen.wd_sd_px);
      }
    }
    if (seen.holder.ok && t.holder) {
      const vision::Point off = seen.holder.mouth - *t.holder;
      holder_off = holder_off.value_or(off);
      o.holder.add(cv::norm(off - *holder_off));
    }
  }
}

MembraneScore PhaseScores::Scores::whole(const PictureKind& kind, int method,
                                         const std::string& membrane) const {
  MembraneScore sum;
  for (const auto& [key, s] : membranes) {
    if (key.kind == kind && key.method == method && key.membrane == membrane) {
      sum.frames += s.frames;
      sum.claimed += s.claimed;
      sum.right += s.right;
      sum.wrong += s.wrong;
      sum.length_px += s.length_px;
      sum.at_truth.n += s.at_truth.n;
      sum.at_truth.sum += s.at_truth.sum;
      sum.at_truth.sum2 += s.at_truth.sum2;
    }
  }
  return sum;
}

PhaseScores::PhaseScores() : scores_(std::make_unique<Scores>()) {}
PhaseScores::~PhaseScores() = default;

void PhaseScores::see(const PictureKind& kind, const DrawnInjection& injection) {
  scores_->pixel_um = injection.lens.pixel_m * 1e6;
  scores_->contrast = injection.lens.contrast;
  for (int method = 0; method < static_cast<int>(kMethods.size()); ++method) {
    scores_->see(kind, injection, method);
  }
}

std::vector<Table> PhaseScores::tables() const {
  const double um = scores_->pixel_um;
  Table membranes{
      .name = "vision_phases",
      .columns = {"renderer", "pictures", "noise_grey", "method", "membrane", "phase", "frames", "claimed",
                  "right_share", "right_low", "right_high", "wrong_frames", "rms_um", "bias_um", "spread_um",
                  "bound_um", "rms_over_bound", "within_1_sd", "within_1_96_sd"}};
  for (const auto& [key, s] : scores_->membranes) {
    const Interval share = share_interval(s.right, s.frames);
    const double bound = scores_->bound_um(key, s);
    if (key.method == 0 && key.membrane == "outer") {
      membranes.shown_rows.push_back(membranes.rows.size());
    }
    membranes.add(
        {key.kind.renderer, key.kind.name, key.kind.noise, kMethods[static_cast<std::size_t>(key.method)],
         key.membrane, kPhases[static_cast<std::size_t>(key.phase)], s.frames, s.claimed,
         static_cast<double>(s.right) / s.frames, share.low, share.high, s.wrong, s.at_truth.rms() * um,
         s.at_truth.bias() * um, s.at_truth.spread() * um, bound, s.at_truth.rms() * um / bound,
         s.at_nodes.share(s.at_nodes.within_1), s.at_nodes.share(s.at_nodes.within_2)});
  }
  Table objects{.name = "vision_objects",
                .columns = {"renderer", "pictures", "noise_grey", "method", "phase", "frames",
                            "needle_frames", "tip_bias_px", "tip_spread_px", "tip_within_1_sd",
                            "tip_within_1_96_sd", "wd_frames", "wd_rms_px", "wd_bias_px", "wd_within_1_sd",
                            "wd_within_1_96_sd", "holder_frames", "holder_motion_rms_px"}};
  for (const auto& [key, o] : scores_->objects) {
    const auto& [kind, method, phase] = key;
    objects.add({kind.renderer, kind.name, kind.noise, kMethods[static_cast<std::size_t>(method)],
                 kPhases[static_cast<std::size_t>(phase)], o.frames, o.tip.n, o.tip.bias(), o.tip.spread(),
                 o.tip.share(o.tip.within_1), o.tip.share(o.tip.within_2), o.wd.n, o.wd.rms(), o.wd.bias(),
                 o.wd.share(o.wd.within_1), o.wd.share(o.wd.within_2), o.holder.n, o.holder.rms()});
  }
  return {std::move(membranes), std::move(objects)};
}

Figure PhaseScores::figure() const {
  Figure figure{.name = "vision_phases", .panels = {}, .columns = 2};
  const auto um = scores_->pixel_um;
  const auto series_of = [](Panel& panel, const std::string& name, Style style) -> Series& {
    for (Series& s : panel.series) {
      if (s.name == name) {
        return s;
      }
    }
    return panel.series.emplace_back(Series{.name = name, .style = style});
  };
  const auto put = [&](Panel& panel, const std::string& name, double x, double y,
                       Style style = Style::line_points) {
    if (std::isfinite(y)) {
      Series& s = series_of(panel, name, style);
      s.x.push_back(x);
      s.y.push_back(y);
    }
  };
  const auto panel = [](const std::string& title, const std::string& y, bool log_y) {
    return Panel{.title = title,
                 .x_label = "noise of the picture [grey levels]",
                 .y_label = y,
                 .log_x = true,
                 .log_y = log_y};
  };
  for (const std::string renderer : {"station", "another"}) {
    const std::string whose = renderer == "station" ? "the station's renderer" : "another renderer";
    Panel error = panel("outer membrane by phase, " + whose, "rms error [um]", true);
    Panel parts = panel("bias and spread, " + whose, "size of the error [um]", true);
    Panel share = panel("right within 2 px, " + whose, "share of all frames, with its 95 % interval", false);
    for (const auto& [key, s] : scores_->membranes) {
      if (key.kind.renderer != renderer || key.membrane != "outer" ||
          key.kind.name != fmt::format("noise-{:g}", key.kind.noise)) {
        continue;
      }
      const double x = key.kind.noise;
      const std::string phase = kPhases[static_cast<std::size_t>(key.phase)];
      if (key.method == 0) {
        put(error, phase, x, s.at_truth.rms() * um);
      } else if (phase == "approach" || phase == "contact") {
        put(error, "paper, " + phase, x, s.at_truth.rms() * um);
      }
      if (key.method == 0 && phase == "approach") {
        put(error, fmt::format("Cramer-Rao, {} modes", kContourModes), x, scores_->bound_um(key, s),
            Style::limit);
      }
    }
    std::vector<PictureKind> kinds;
    for (const auto& [key, s] : scores_->membranes) {
      if (key.kind.renderer == renderer && key.kind.name == fmt::format("noise-{:g}", key.kind.noise) &&
          (kinds.empty() || !(kinds.back() == key.kind))) {
        kinds.push_back(key.kind);
      }
    }
    std::sort(kinds.begin(), kinds.end(),
              [](const PictureKind& a, const PictureKind& b) { return a.noise < b.noise; });
    for (const PictureKind& kind : kinds) {
      for (const std::string membrane : {"outer", "inner"}) {
        const MembraneScore s = scores_->whole(kind, 0, membrane);
        put(parts, membrane + ", bias", kind.noise, std::abs(s.at_truth.bias()) * um);
        put(parts, membrane + ", spread", kind.noise, s.at_truth.spread() * um);
        for (int method = 0; method < 2; ++method) {
          if (method == 1 && membrane == "inner") {
            continue;
          }
          const MembraneScore of = scores_->whole(kind, method, membrane);
          const Interval i = share_interval(of.right, of.frames);
          const std::string name = membrane + (method == 0 ? "" : ", paper's method");
          put(share, name, kind.noise, static_cast<double>(of.right) / of.frames);
          put(share, name + ": interval", kind.noise, i.low, Style::points);
          put(share, name + ": interval", kind.noise, i.high, Style::points);
        }
      }
    }
    for (Panel* p : {&error, &parts, &share}) {
      for (Series& s : p->series) {  // by rising noise
        std::vector<std::pair<double, double>> points;
        for (std::size_t i = 0; i < s.x.size(); ++i) {
          points.emplace_back(s.x[i], s.y[i]);
        }
        std::sort(points.begin(), points.end());
        for (std::size_t i = 0; i < points.size(); ++i) {
          std::tie(s.x[i], s.y[i]) = points[i];
        }
      }
      if (!p->series.empty()) {
        figure.panels.push_back(std::move(*p));
      }
    }
  }
  figure.columns = 3;
  figure.note = fmt::format(
      "Rms over the points of the true contour in the frames that are claimed, hidden arcs included; the "
      "share counts a frame without a claim as wrong. Cramer-Rao: {} modes, with contrast, blur and "
      "background known.",
      kContourModes);
  return figure;
}

std::string PhaseScores::reading() const {
  std::string out;
  for (const auto& [key, s] : scores_->membranes) {
    if (key.method == 0 && key.membrane == "outer" && key.phase == static_cast<int>(Stretch::indentation) &&
        key.kind.name == fmt::format("noise-{:g}", key.kind.noise)) {
      out += fmt::format("{}{} {}: {:.2f} um", out.empty() ? "" : ", ", key.kind.renderer, key.kind.name,
                         s.at_truth.rms() * scores_->pixel_um);
    }
  }
  return "Outer membrane in contact, renderer and noise: " + out + ".";
}

}  // namespace punctum::report
