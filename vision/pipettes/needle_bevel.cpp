#include "vision/pipettes/needle_bevel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "hal/math/elementary.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/cut_model.hpp"
#include "vision/pipettes/glass.hpp"

namespace punctum::vision {

namespace {

// px along per px across; what is cut more steeply is no needle's end.
constexpr double kSteepestCut = 0.95;
// A needle that is ground sharp may be cut so, where that explains the picture better by so much of what the
// walls do.
constexpr double kSharpestCut = 2.8, kClearlySharp = 0.02, kClearlyCut = 0.025;
// And where light does not come from one side, better than granules beside it make a cut look: log
// likelihood, twice.
constexpr double kThanGranules = 20;
constexpr double kSteepestFrom = 0.1;  // of the steepest: it may be steeper still
constexpr double kLit = 0.02;  // the picture is explained better by so much where light comes from one side
constexpr double kOblique = 0.5;  // cut: of a blunter end in relief the walls tell the radius

// A granule is about as wide as a wall, and not drawn anew in every pixel as noise is: over an end its sum
// varies so many times as much as that of noise that leaves as much.
double with_granules(double misfit) {
  constexpr double kOfGranules = 4;
  return 1 + kOfGranules * (misfit - 1);
}

// Weighted, of a quantity.
struct Moments {
  double weight = 0, sum = 0, squares = 0;

  void add(double w, double x) {
    weight += w;
    sum += w * x;
    squares += w * x * x;
  }
  [[nodiscard]] double mean() const { return sum / weight; }
  [[nodiscard]] double variance() const { return std::max(squares / weight - mean() * mean(), 0.0); }
};

// Ends from..to px behind the tip of the pose, and cuts, with what is between two of them.
struct EndsAndCuts {
  double from, to, apart, cut_from, cut_to, cut_apart;
};

// Coarsely, of cuts like these.
template <std::size_t kCuts>
CutEnd likeliest_end(const CutModel& model, double back, double ahead,
                     const std::array<double, kCuts>& tangents) {
  CutEnd best;
  double most = -1e18;
  for (double at = -ahead; at <= back; at += 1) {
    for (const double tangent : tangents) {
      if (const double gain = model.gain({at, tangent}); gain > most) {
        most = gain;
        best = {at, tangent};
      }
    }
  }
  return best;
}

// Uphill from a likely one, by the steps that are tried.
CutEnd likeliest_near(const CutModel& model, const CutEnd& from, const EndsAndCuts& tried) {
  constexpr int kSteps = 16;
  CutEnd best = from;
  double most = model.gain(from);
  for (int step = 0; step < kSteps; ++step) {
    const CutEnd middle = best;
    for (const double along : {-tried.apart, 0.0, tried.apart}) {
      for (const double cut : {-tried.cut_apart, 0.0, tried.cut_apart}) {
        const CutEnd end{std::clamp(middle.at + along, tried.from, tried.to),
                         std::clamp(middle.tangent + cut, tried.cut_from, tried.cut_to)};
        if (const double gain = model.gain(end); gain > most) {
          most = gain;
          best = end;
        }
      }
    }
    if (best.at == middle.at && best.tangent == middle.tangent) {
      break;
    }
  }
  return best;
}

// With a cut that is a little steeper.
bool gets_likelier_beyond(const CutModel& model, const CutEnd& end) {
  const double gain = model.gain(end);
  for (double off = -0.5; off <= 0.5; off += 0.5) {
    if (model.gain({end.at + off, 1.1 * end.tangent}) > gain) {
      return true;
    }
  }
  return false;
}

// Rather than at right angles with a speck in line with one wall, which looks alike but for the light between
// the two.
bool is_clearly_cut(const CutModel& model, const CutEnd& cut, const CutEnd& right) {
  constexpr double kThanSpeck = 1.2;
  constexpr int kReach_px = 3;
  const double without = model.gain(right);
  double speck = 0;
  for (int off = -kReach_px; off <= kReach_px; ++off) {
    speck = std::max(speck, model.gain_with_speck({right.at + off, 0}, -cut.tangent) - without);
  }
  return model.gain(cut) - without > std::max(kThanSpeck * speck, kClearlyCut * without);
}

// Each as likely as it explains the picture; and the likeliest. radius: of the glass, px.
CutGlass mean_of(const CutModel& model, const EndsAndCuts& tried, double blur_px, double radius,
                 CutEnd& best) {
  struct Likely {
    CutEnd end;
    double gain;
  };
  Vector<Likely> ends;
  double most = -1e18;
  for (int k = static_cast<int>(std::ceil(tried.cut_from / tried.cut_apart));
       k * tried.cut_apart <= tried.cut_to; ++k) {
    for (double at = tried.from; at <= tried.to; at += tried.apart) {
      const CutEnd end{at, k * tried.cut_apart};
      ends.push_back({end, model.gain(end)});
      if (ends.back().gain > most) {
        most = ends.back().gain;
        best = end;
      }
    }
  }
  const double misfit = with_granules(model.misfit(most));
  // Of the end, of the cut, and of the end where the cut is known.
  Moments outermost, tangents, of_cut;
  double where_cut_is_known = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto& [end, gain] = ends[i];
    // Before anything is seen, a needle is as likely cut at right angles as anyhow up to the steepest.
    const double before = tried.cut_apart / (2 * kSteepestCut) + (end.tangent == 0 ? 1 : 0);
    const double weight = before * math::exp(0.5 * (gain - most) / misfit);
    const double place = std::abs(end.tangent) * radius - end.at;
    outermost.add(weight, place);
    tangents.add(weight, end.tangent);
    of_cut.add(weight, place);
    if (i + 1 == ends.size() || ends[i + 1].end.tangent != end.tangent) {
      where_cut_is_known += of_cut.weight > 0 ? of_cut.weight * of_cut.variance() : 0;
      of_cut = {};
    }
  }
  const double with_cut = outermost.variance() - tangents.variance() * radius * radius;
  return {{outermost.mean(), std::sqrt(std::max(with_cut, where_cut_is_known / outermost.weight)), blur_px},
          {tangents.mean(), std::sqrt(tangents.variance())}};
}

// The likeliest end `ahead` px ahead of the tip of the pose to `back` px behind it, of usual cuts and of
// sharp ones.
struct CoarseEnds {
  CoarseEnds(const CutModel& model, double back_px, double ahead_px)
      : back(back_px),
        ahead(ahead_px),
        usual(likeliest_end(model, back, ahead, std::array{-0.6, -0.3, 0.0, 0.3, 0.6})),
        sharp(likeliest_end(model, back, ahead, std::array{-2.4, -2.0, -1.6, -1.2, 1.2, 1.6, 2.0, 2.4})),
        gain(std::max(model.gain(usual), model.gain(sharp))),
        is_sharp(gain > (1 + kClearlySharp) * model.gain(usual) &&
                 (model.in_relief() ||
                  gain - model.gain(usual) > kThanGranules * with_granules(model.misfit(gain)))) {}
  double back, ahead;
  CutEnd usual, sharp;
  double gain;
  bool is_sharp;
};

// radius: outer, of the glass, px.
std::optional<CutGlass> cut_by(const CutModel& model, const CoarseEnds& coarse, double blur_px,
                               double radius) {
  CutEnd best = coarse.usual;
  // Ends far from the best one may be as likely: in noise the likelihood falls off in straight lines, not as
  // a parabola. Where they are not, it is sharp.
  constexpr double kBeyond_px = 2, kSharp_px2 = 0.1,
                   kReach_px = 1;  // of the range; variance; round the best end
  constexpr double kReachOfCut = 0.16;
  const EndsAndCuts usual{
      -coarse.ahead - kBeyond_px, coarse.back + kBeyond_px, 0.5, -kSteepestCut, kSteepestCut, 0.1};
  EndsAndCuts tried = usual;
  const auto try_sharp = [&](const CutEnd& likely) {
    const bool up = likely.tangent > 0;  // a needle that is cut the other way explains it far worse
    tried = {usual.from, usual.to, 0.5, up ? 0 : -kSharpestCut, up ? kSharpestCut : 0, 0.2};
    best = likely;
  };
  if (coarse.is_sharp) {
    best = likeliest_near(model, best, usual);
    if (coarse.gain > (1 + kClearlySharp) * model.gain(best)) {
      try_sharp(coarse.sharp);
    }
  }
  constexpr double kEdge_px = 1.5;  // of the range
  if (best.at < -coarse.ahead + kEdge_px || best.at > coarse.back - kEdge_px) {
    return CutGlass{{std::abs(best.tangent) * radius - best.at, coarse.back + coarse.ahead, blur_px},
                    {best.tangent, 0}};
  }
  CutGlass found = mean_of(model, tried, blur_px, radius, best);
  const auto is_steeper = [&] {
    return std::abs(best.tangent) > std::max(tried.cut_to, -tried.cut_from) - kSteepestFrom &&
           gets_likelier_beyond(model, best);
  };
  // A cut that is hardly steeper than usual explains the picture hardly better than a usual one, but better
  // than a right angle, with a speck before it or without.
  if (tried.cut_from == usual.cut_from && is_steeper()) {
    try_sharp(best);
    best = likeliest_near(model, best, tried);
    if (!is_clearly_cut(model, best, likeliest_end(model, coarse.back, coarse.ahead, std::array{0.0}))) {
      return std::nullopt;
    }
    found = mean_of(model, tried, blur_px, radius, best);
  }
  if (is_steeper()) {
    return std::nullopt;
  }
  if (const double of_cut = found.bevel.sd * radius;
      found.end.sd * found.end.sd + of_cut * of_cut < kSharp_px2) {
    const EndsAndCuts near{best.at - kReach_px,        best.at + kReach_px,        0.1,
                           best.tangent - kReachOfCut, best.tangent + kReachOfCut, 0.02};
    found = mean_of(model, near, blur_px, radius, best);
  }
  return found;
}

}  // namespace

std::optional<CutGlass> cut_of_glass(const GradientField& field, double noise, const NeedlePose& needle,
                                     double blur_px, double back, double ahead) {
  const auto as_in_bright_field = [&](const CutModel& model, const CoarseEnds& coarse) {
    return cut_by(model, coarse, blur_px, outer_radius_of_glass(needle.half_width, blur_px));
  };
  if (const CutModel even(field, needle, noise, blur_px, back, ahead); !even.stands_out()) {
    return std::nullopt;
  } else if (!even.walls_differ()) {
    return as_in_bright_field(even, {even, back, ahead});
  }
  const double radius = radius_in_relief(needle.half_width, field.sigma);
  const CutModel lit(field, needle, noise, blur_px, back, ahead, CutModel::Shaft::near, radius);
  const CoarseEnds coarse(lit, back, ahead);
  if (!coarse.is_sharp) {
    const CutModel plain(field, needle, noise, blur_px, back, ahead, CutModel::Shaft::near);
    if (const CoarseEnds of_plain(plain, back, ahead); coarse.gain <= (1 + kLit) * of_plain.gain) {
      return as_in_bright_field(plain, of_plain);
    }
  }
  auto cut = cut_by(lit, coarse, blur_px, radius);
  if (cut && std::abs(cut->bevel.tangent) > kOblique) {
    cut->bevel.radius = radius;
  }
  return cut;
}

std::optional<LikelyEnds> likely_ends(const GradientField& field, double noise, const NeedlePose& needle,
                                      double blur_px) {
  constexpr int kReach = LikelyEnds::kReach_px;
  const CutModel model(field, needle, noise, blur_px, kReach, kReach);
  if (!model.stands_out()) {
    return std::nullopt;
  }
  LikelyEnds out;
  double most = -1e18;
  for (std::size_t cut = 0; cut < LikelyEnds::kCuts; ++cut) {
    auto& of_cut = out.gain[cut];
    for (std::size_t k = 0; k < of_cut.size(); ++k) {
      of_cut[k] = model.gain({static_cast<double>(k) - kReach, LikelyEnds::tangent(cut)});
      most = std::max(most, of_cut[k]);
    }
  }
  const double misfit = with_granules(model.misfit(most));
  for (auto& of_cut : out.gain) {
    for (double& g : of_cut) {
      g /= misfit;
    }
  }
  return out;
}

std::optional<GlassEnd> end_of_known_cut(const GradientField& field, double noise, const NeedlePose& needle,
                                         const Bevel& bevel, double blur_px, double reach) {
  constexpr double kApart_px = 0.5;
  const CutModel model(field, needle, noise, blur_px, reach, reach,
                       bevel.radius > 0 ? CutModel::Shaft::near : CutModel::Shaft::all, bevel.radius);
  if (!model.stands_out()) {
    return std::nullopt;
  }
  Vector<double> gains;
  for (double at = -reach; at <= reach; at += kApart_px) {
    gains.push_back(model.gain({at, bevel.tangent}));
  }
  const double most = *std::max_element(gains.begin(), gains.end()),
               misfit = with_granules(model.misfit(most));
  Moments ends;
  for (std::size_t k = 0; k < gains.size(); ++k) {
    ends.add(math::exp(0.5 * (gains[k] - most) / misfit), reach - kApart_px * static_cast<double>(k));
  }
  return GlassEnd{ends.mean(), std::sqrt(ends.variance()), blur_px};
}

}  // namespace punctum::vision
