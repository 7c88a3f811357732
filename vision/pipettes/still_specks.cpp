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
  const double to = std::min(free_px - kOfMembrane_px, kFarthest_px), wide = needle.half_width + kBeside_px;
  if (to <= kClearAhead_px + kLeast_px) {
    return;
  }
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const double s : {-kClearAhead_px, -to}) {
    for (const double u : {-wide, wide}) {
      const Point p = needle.at(s, u);
      left = std::min(left, p.x);
      right = std::max(right, p.x);
      top = std::min(top, p.y);
      bottom = std::max(bottom, p.y);
    }
  }
  const cv::Rect area = cv::Rect(static_cast<int>(left), static_cast<int>(top),
                                 static_cast<int>(right - left) + 2, static_cast<int>(bottom - top) + 2) &
                        field.area;
  if (area.width < kMost_px || area.height < kMost_px) {
    return;
  }
  // within: of the sides where what is seen may be a part of something that is cut off.
  const auto is_ahead = [&](int x, int y, double within, double beyond = 0) {
    const Point from_tip = Point(x, y) - needle.tip;
    const double ahead = from_tip.dot(needle.axis);
    return ahead > kClearAhead_px + within && ahead < to + beyond &&
           std::abs(from_tip.cross(needle.axis)) < wide - within;
  };
  Vector<float> levels;
  levels.reserve(static_cast<std::size_t>(area.area()));
  for (int y = area.y; y < area.y + area.height; ++y) {
    const float* row = field.smooth.ptr<float>(y - field.area.y) - field.area.x;
    for (int x = area.x; x < area.x + area.width; x += 2) {
      if (is_ahead(x, y, 0)) {
        levels.push_back(row[x]);
      }
    }
  }
  if (levels.empty()) {
    return;
  }
  const auto level = static_cast<float>(median_in_place(levels));
  // What is left of the noise of a pixel in the smoothed picture.
  const double left_of_noise = noise / (2 * std::sqrt(std::numbers::pi) * std::max(field.sigma, 0.5));
  const auto least = static_cast<float>(std::max(kStandsOut * left_of_noise, kLeast_grey));
  cv::Mat stands_out = kept_picture(area.size(), CV_8U);
  for (int y = 0; y < area.height; ++y) {
    const float* row = field.smooth.ptr<float>(area.y + y - field.area.y) + area.x - field.area.x;
    std::uint8_t* out = stands_out.ptr(y);
    for (int x = 0; x < area.width; ++x) {
      out[x] = std::abs(row[x] - level) > least && is_ahead(area.x + x, area.y + y, 0) ? 255 : 0;
    }
  }
  const Components found = components_of(stands_out);
  Vector<std::uint8_t> cut(found.box.size(), 0);  // by the border of what is looked at
  Vector<float> peak(found.box.size(), 0.0F);
  for (const PixelRun& run : found.runs) {
    const int y = area.y + run.y;
    const float* row = field.smooth.ptr<float>(y - field.area.y) + area.x - field.area.x;
    for (int x = run.from; x < run.to; ++x) {
      peak[run.component] = std::max(peak[run.component], std::abs(row[x] - level));
    }
    if (!is_ahead(area.x + run.from, y, 1) || !is_ahead(area.x + run.to - 1, y, 1)) {
      cut[run.component] = 1;
    }
  }
  for (std::size_t c = 0; c < found.box.size() && specks_.size() < kMostSpecks; ++c) {
    const cv::Rect core = found.box[c] + area.tl();
    if (cut[c] == 0 && peak[c] > kClear_grey && found.pixels[c] >= kLeast_px &&
        std::max(core.width, core.height) <= kMost_px) {
      add(found, c, core, [&](const cv::Point& p) { return is_ahead(p.x, p.y, 0, 2); }, noise);
    }
  }
}

// Where it is all in the picture, and not known yet.
template <class Ahead>
void StillSpecks::add(const Components& found, std::size_t component, const cv::Rect& core,
                      const Ahead& is_ahead, double noise) {
  const cv::Point margin(kMargin_px, kMargin_px);
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
  const cv::Point in_box = core.tl() - found.box[component].tl() - box.tl();
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
