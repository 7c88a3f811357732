#include "vision/pipettes/still_specks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "vision/image/components.hpp"
#include "vision/image/kept_memory.hpp"
#include "vision/image/median.hpp"

namespace punctum::vision {

namespace {

constexpr double kClearAhead_px = 4;  // of the glass: its blur
constexpr double kFarthest_px = 100;
constexpr double kOfMembrane_px = 3;  // before the cell: its blur
constexpr double kBeside_px = 14;     // of the walls: a whole speck that touches them
constexpr int kEvery = 4;             // frames
constexpr int kBlur_px = 4, kMargin_px = 5;
constexpr int kLeast_px = 6, kMost_px = 24;  // pixels of one that is no noise; a side of its box
constexpr std::size_t kMostSpecks = 12;
constexpr float kLeastLight = 0.25F, kMostLight = 4;  // of less too little is left to be put right

// What of the medium lies before the needle.
struct Way {
  const NeedlePose& needle;
  double to, wide;  // px: ahead of the tip; to either side of the axis

  // within: of the sides where what is seen may be a part of something that is cut off. beyond: towards the
  // cell.
  [[nodiscard]] bool holds(const cv::Point& p, double within, double beyond) const {
    const Point from_tip = Point(p) - needle.tip;
    const double ahead = from_tip.dot(needle.axis);
    return ahead > kClearAhead_px + within && ahead < to + beyond &&
           std::abs(from_tip.cross(needle.axis)) < wide - within;
  }
  [[nodiscard]] cv::Rect in(const cv::Rect& area) const {
    const Point a = needle.at(-kClearAhead_px, 0), b = needle.at(-to, 0);
    const cv::Rect2d box(std::min(a.x, b.x) - wide, std::min(a.y, b.y) - wide, std::abs(a.x - b.x) + 2 * wide,
                         std::abs(a.y - b.y) + 2 * wide);
    return {box & cv::Rect2d(area)};
  }
};

const float* smooth_row(const GradientField& field, const cv::Point& from) {
  return field.smooth.ptr<float>(from.y - field.area.y) + from.x - field.area.x;
}

// Grey level of the medium.
float usual_grey(const GradientField& field, const cv::Rect& area, const Way& way) {
  Vector<float> levels;
  levels.reserve(static_cast<std::size_t>(area.area()));
  for (int y = 0; y < area.height; ++y) {
    const float* row = smooth_row(field, area.tl() + cv::Point(0, y));
    for (int x = 0; x < area.width; x += 2) {
      if (way.holds(area.tl() + cv::Point(x, y), 0, 0)) {
        levels.push_back(row[x]);
      }
    }
  }
  return static_cast<float>(median_in_place(levels));
}

struct Beside {
  double grey = 0, even = 0;  // the middle one; share of those that are like it
};
// The outermost pixels of a box: medium, but for a membrane to one side.
Beside beside(const cv::Mat& grey, const cv::Rect& box, double noise) {
  constexpr double kAlike = 2.5, kAlike_grey = 2;
  Vector<float> v;
  v.reserve(static_cast<std::size_t>(2 * (box.width + box.height)));
  for (int y = box.y; y < box.y + box.height; ++y) {
    const bool whole = y == box.y || y == box.y + box.height - 1;
    for (int x = box.x; x < box.x + box.width; x += whole ? 1 : box.width - 1) {
      v.push_back(static_cast<float>(grey.ptr(y)[x]));
    }
  }
  const double middle = median_of(v);
  const auto alike = std::count_if(v.begin(), v.end(), [&](float g) {
    return std::abs(static_cast<double>(g) - middle) < kAlike * noise + kAlike_grey;
  });
  return {middle, static_cast<double>(alike) / static_cast<double>(v.size())};
}

}  // namespace

const cv::Mat& StillSpecks::without(const cv::Mat& grey) {
  constexpr double kThere = 0.2;
  constexpr int kMissed = 3;
  frame_ = grey;
  for (Speck& s : specks_) {
    const double level = beside(grey, s.box, 0).grey;
    double alike = 0, all = 0;
    for (int y = 0, k = 0; y < s.box.height; ++y) {
      const std::uint8_t* row = grey.ptr(s.box.y + y) + s.box.x;
      for (int x = 0; x < s.box.width; ++x, ++k) {
        const double takes = static_cast<double>(s.light[static_cast<std::size_t>(k)]) - 1;
        alike += takes * (row[x] / std::max(level, 1.0) - 1);
        all += takes * takes;
      }
    }
    s.missed = alike > kThere * all ? 0 : s.missed + 1;
  }
  std::erase_if(specks_, [](const Speck& s) { return s.missed >= kMissed; });
  if (specks_.empty()) {
    return frame_;
  }
  grey.copyTo(without_);
  for (const Speck& s : specks_) {
    for (int y = 0, k = 0; y < s.box.height; ++y) {
      std::uint8_t* row = without_.ptr(s.box.y + y) + s.box.x;
      for (int x = 0; x < s.box.width; ++x, ++k) {
        const auto i = static_cast<std::size_t>(k);
        if (s.part[i] != 0) {
          const float light = std::clamp(s.light[i], kLeastLight, kMostLight), now = row[x];
          const float v = 0.5F * (now / light + now + (1 - light) * s.grey);
          row[x] = static_cast<std::uint8_t>(std::clamp(v + 0.5F, 0.0F, 255.0F));
        }
      }
    }
  }
  return without_;
}

void StillSpecks::learn(const GradientField& field, double noise, const NeedlePose& needle, double free_px) {
  if (!needle.ok || frame_.empty()) {
    return;
  }
  std::erase_if(specks_, [&](Speck& s) {
    const Point middle(s.box.x + 0.5 * (s.box.width - 1), s.box.y + 0.5 * (s.box.height - 1));
    const double ahead = (middle - needle.tip).dot(needle.axis),
                 half = 0.5 * std::max(s.box.width, s.box.height);
    return ahead - half > kClearAhead_px && !look_at(s, noise);
  });
  if (frames_++ % kEvery == 0) {
    find_new(field, noise, needle, free_px);
  }
}

// False where it is there no more.
bool StillSpecks::look_at(Speck& s, double noise) const {
  constexpr int kMemory = 16;
  constexpr double kEven = 0.5, kSds = 3;
  constexpr double kNoisier = 1.2;  // pixels differ in their noise
  const Beside around = beside(frame_, s.box, noise);
  if (around.even < kEven || around.grey < 1) {  // something else lies beside it
    return s.frames > 0;
  }
  const auto light_at = [&](std::size_t i) {
    const int w = s.box.width, k = static_cast<int>(i);
    return static_cast<float>(frame_.ptr(s.box.y + k / w)[s.box.x + k % w] / around.grey);
  };
  const double of_noise = std::pow(kNoisier * noise / around.grey, 2);  // in a pixel of one frame
  double off = 0;
  int pixels = 0;
  for (std::size_t i = 0; i < s.light.size(); ++i) {
    if (s.part[i] != 0) {
      off += std::pow(static_cast<double>(light_at(i) - s.light[i]), 2);
      ++pixels;
    }
  }
  const double by_chance = pixels + kSds * std::sqrt(2.0 * pixels);  // of as many squares
  const bool stays = s.frames > 0 && off < of_noise * (1 + 1.0 / s.frames) * by_chance;
  s.grey = static_cast<float>(around.grey);
  s.frames = stays ? std::min(s.frames + 1, kMemory) : 1;
  double shows = 0;
  for (std::size_t i = 0; i < s.light.size(); ++i) {
    if (s.part[i] != 0) {
      s.light[i] += (light_at(i) - s.light[i]) / static_cast<float>(s.frames);
      shows += std::pow(static_cast<double>(s.light[i]) - 1, 2);
    }
  }
  return shows > of_noise / s.frames * by_chance;
}

void StillSpecks::find_new(const GradientField& field, double noise, const NeedlePose& needle,
                           double free_px) {
  constexpr double kStandsOut = 5, kLeast_grey = 6;
  constexpr float kClear_grey = 15;
  const Way way{needle, std::min(free_px - kOfMembrane_px, kFarthest_px), needle.half_width + kBeside_px};
  const cv::Rect area = way.in(field.area);
  if (way.to <= kClearAhead_px || area.empty()) {
    return;
  }
  const float level = usual_grey(field, area, way);
  // What is left of the noise of a pixel in the smoothed picture.
  const double left_of_noise = noise / (2 * std::sqrt(std::numbers::pi) * std::max(field.sigma, 0.5));
  const auto least = static_cast<float>(std::max(kStandsOut * left_of_noise, kLeast_grey));
  cv::Mat stands_out = kept_picture(area.size(), CV_8U);
  for (int y = 0; y < area.height; ++y) {
    const cv::Point from = area.tl() + cv::Point(0, y);
    const float* row = smooth_row(field, from);
    std::uint8_t* out = stands_out.ptr(y);
    for (int x = 0; x < area.width; ++x) {
      out[x] = std::abs(row[x] - level) > least && way.holds(from + cv::Point(x, 0), 0, 0) ? 255 : 0;
    }
  }
  const Components found = components_of(stands_out);
  Vector<std::uint8_t> cut(found.box.size(), 0);  // by the border of what is looked at
  Vector<float> peak(found.box.size(), 0.0F);
  for (const PixelRun& run : found.runs) {
    const cv::Point from = area.tl() + cv::Point(0, run.y);
    const float* row = smooth_row(field, from);
    for (int x = run.from; x < run.to; ++x) {
      peak[run.component] = std::max(peak[run.component], std::abs(row[x] - level));
    }
    if (!way.holds(from + cv::Point(run.from, 0), 1, 0) ||
        !way.holds(from + cv::Point(run.to - 1, 0), 1, 0)) {
      cut[run.component] = 1;
    }
  }
  for (std::size_t c = 0; c < found.box.size() && specks_.size() < kMostSpecks; ++c) {
    const cv::Size size = found.box[c].size();
    if (cut[c] == 0 && peak[c] > kClear_grey && found.pixels[c] >= kLeast_px &&
        std::max(size.width, size.height) <= kMost_px) {
      // Towards the cell, too, where it may go on.
      constexpr double kBeyond_px = 2;
      add(found, c, area.tl(), [&](const cv::Point& p) { return way.holds(p, 0, kBeyond_px); }, noise);
    }
  }
}

// Where it is all in the picture, and not known yet.
template <class Ahead>
void StillSpecks::add(const Components& found, std::size_t component, const cv::Point& origin,
                      const Ahead& is_ahead, double noise) {
  const cv::Point margin(kMargin_px, kMargin_px);
  const cv::Rect core = found.box[component] + origin;
  const cv::Rect box(core.tl() - margin, core.br() + margin);
  const auto core_of = [&](const Speck& s) { return cv::Rect(s.box.tl() + margin, s.box.br() - margin); };
  if ((box & cv::Rect({}, frame_.size())) != box ||
      std::any_of(specks_.begin(), specks_.end(),
                  [&](const Speck& s) { return !(core_of(s) & core).empty(); })) {
    return;
  }
  const auto is_of_another = [&](const cv::Point& p) {
    return std::any_of(specks_.begin(), specks_.end(), [&](const Speck& s) {
      const cv::Point in = p - s.box.tl();
      return s.box.contains(p) && s.part[static_cast<std::size_t>(in.y * s.box.width + in.x)] != 0;
    });
  };
  Speck s;
  s.box = box;
  s.light.assign(static_cast<std::size_t>(box.area()), 1.0F);
  s.part.assign(s.light.size(), 0);
  const cv::Point in_box = origin - box.tl();
  for (const PixelRun& run : found.runs) {
    for (int y = run.y - kBlur_px; run.component == component && y <= run.y + kBlur_px; ++y) {
      for (int x = run.from - kBlur_px; x < run.to + kBlur_px; ++x) {
        const cv::Point p = cv::Point(x, y) + in_box;
        const bool is = is_ahead(p + box.tl()) && !is_of_another(p + box.tl());
        s.part[static_cast<std::size_t>(p.y * box.width + p.x)] = is ? 1 : 0;
      }
    }
  }
  if (look_at(s, noise)) {
    specks_.push_back(std::move(s));
  }
}

}  // namespace punctum::vision
