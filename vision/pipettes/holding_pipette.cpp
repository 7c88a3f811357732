#include "vision/pipettes/holding_pipette.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "vision/image/correlation.hpp"
#include "vision/pipettes/wide_tube.hpp"

namespace punctum::vision {

namespace {

constexpr int kBlurred_px = 8;            // the smoothing before the gradient reaches so far
constexpr std::array kStill_px = {1, 3};  // a frame moves it by less
constexpr int kDoubledMost = 2;           // times that its window is, while it is not seen
constexpr double kCertainMouth_px = 1;    // of a mouth that is less certain nothing is claimed

}  // namespace

std::optional<TubeTrace> find_holder_tube(const GradientField& field, std::span<const Side> sides,
                                          double height, double R_max, double noise) {
  constexpr double kNarrowest_px = 20;
  std::optional<TubeTrace> best;
  const auto score = [](const TubeTrace& t) {
    return t.similarity * t.edge_share * std::min(t.length, 60.0);
  };
  for (const Side side : sides) {
    const auto t = trace_wide_tube(field, side == Side::right ? Border::right : Border::left, kNarrowest_px,
                                   std::min(0.7 * height, 2.2 * R_max), noise);
    if (t && t->similarity > 0.5 && t->length > 10 && std::abs(t->axis.y) < 0.25 &&
        (!best || score(*t) > score(*best))) {
      best = t;
    }
  }
  return best;
}

void HoldingPipette::use_template(const cv::Mat& pattern) {
  template_ = pattern.clone();
  registration_ = Registration(template_, 0);
  mouth_in_template_ = Point((pattern.cols - 1) / 2.0, (pattern.rows - 1) / 2.0);
  last_.reset();
}

std::string HoldingPipette::cut_template(const cv::Mat& grey, const TubeTrace& tube, double noise) {
  Point mouth = tube.end();
  const double half_face = 0.6 * tube.end_half_width,
               reach = std::clamp(0.4 * tube.end_half_width, 8.0, 25.0);
  const int side = static_cast<int>(half_face + reach) + kBlurred_px;
  GradientField field;
  field.compute(
      grey, {static_cast<int>(mouth.x) - side, static_cast<int>(mouth.y) - side, 2 * side, 2 * side}, 1.2);
  if (const auto s = end_face(field, mouth, tube.axis, half_face, reach, noise)) {
    mouth += *s * tube.axis;
  }
  // Mostly tube, and little of the cell, which is dented and moves by itself.
  const double deep = std::clamp(0.6 * tube.end_half_width, 12.0, 40.0);
  const double ahead = 3, wide = tube.end_half_width + 6;
  const Point back = mouth - deep * tube.axis, front = mouth + ahead * tube.axis;
  const int x0 = static_cast<int>(std::floor(std::min(back.x, front.x)));
  const int x1 = static_cast<int>(std::ceil(std::max(back.x, front.x)));
  const int y0 = static_cast<int>(std::floor(mouth.y - wide)),
            y1 = static_cast<int>(std::ceil(mouth.y + wide));
  const cv::Rect box = cv::Rect(x0, y0, x1 - x0 + 1, y1 - y0 + 1) & cv::Rect(0, 0, grey.cols, grey.rows);
  if (box.width < 8 || box.height < 12) {
    return "too little of it is in the picture";
  }
  template_ = grey(box).clone();
  registration_ = Registration(template_, noise);
  mouth_in_template_ = mouth - Point(box.x, box.y);
  last_ = Point(box.x, box.y);
  return {};
}

HolderPose HoldingPipette::find(const cv::Mat& grey) {
  HolderPose holder;
  if (template_.empty()) {
    holder.reason = "no template";
    return holder;
  }
  const cv::Rect all(0, 0, grey.cols, grey.rows);
  cv::Rect window = all;
  std::optional<Peak> p;
  const auto search = [&](int r) {
    window =
        cv::Rect(static_cast<int>(std::lround(last_->x)) - r, static_cast<int>(std::lround(last_->y)) - r,
                 template_.cols + 2 * r, template_.rows + 2 * r) &
        all;
    p = peak(correlation_map(grey(window), template_));
  };
  if (last_ && lost_ < 5) {
    // It hardly moves. Where the best place lies on the rim, a better one may lie outside.
    const auto on_rim = [](double at, int places) { return at <= 0 || at >= places - 1; };
    const auto found = [&] {
      return p && !on_rim(p->at.x, window.width - template_.cols + 1) &&
             !on_rim(p->at.y, window.height - template_.rows + 1);
    };
    for (std::size_t k = 0; lost_ == 0 && k < kStill_px.size() && !found(); ++k) {
      search(kStill_px[k]);
    }
    if (!found()) {
      search(config_.window_px << std::min(lost_, kDoubledMost));
    }
  } else {
    p = peak(correlation_map(grey, template_));
  }
  if (!p) {
    holder.reason = "template larger than the picture";
    return holder;
  }
  const Point corner = p->at + Point(window.x, window.y);
  holder.score = p->score;
  holder.box = cv::Rect2d(corner.x, corner.y, template_.cols, template_.rows);
  holder.mouth = corner + mouth_in_template_;
  const cv::Rect there = cv::Rect(static_cast<int>(std::lround(corner.x)),
                                  static_cast<int>(std::lround(corner.y)), template_.cols, template_.rows) &
                         all;
  if (there.size() == template_.size()) {
    holder.similarity = registration_.similarity(grey, there.tl());
  }
  // Eq. 1 is near 1 on any bright patch. The centred correlation tells whether it is the pipette.
  holder.ok = holder.score >= config_.min_score && holder.similarity >= 0.4;
  if (holder.ok) {
    before_ = {std::exchange(last_, corner), std::exchange(lost_, 0)};
  } else {
    holder.reason = holder.score < config_.min_score ? "correlation too low" : "pattern not recognised";
    ++lost_;
  }
  return holder;
}

void HoldingPipette::refine(const cv::Mat& grey, HolderPose& holder) {
  if (!holder.ok) {
    return;
  }
  const auto place = registration_.place(grey, holder.box.tl());
  if (!place || place->sd > kCertainMouth_px) {
    holder.ok = false;
    holder.reason = "its place is not certain";
    last_ = before_.last;
    lost_ = before_.lost + 1;
    return;
  }
  holder.box.x = place->corner.x;
  holder.box.y = place->corner.y;
  holder.mouth = place->corner + mouth_in_template_;
  holder.sd = place->sd;
}

}  // namespace punctum::vision
