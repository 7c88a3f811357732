#include "vision/pipettes/robust_line.hpp"

#include <cmath>
#include <cstddef>

namespace punctum::vision {

RobustLine fit_robust_line(const Vector<double>& x, const Vector<double>& y, const Vector<double>& weight,
                           double scale) {
  RobustLine out;
  Vector<double> w = weight;
  for (int round = 0; round < 5; ++round) {
    const auto line = fit_line(x, y, w);
    if (!line) {
      return out;
    }
    out.line = *line;
    double ss = 0, sw = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double e = line->residual(x[i], y[i]);
      ss += weight[i] * e * e;
      sw += weight[i];
      w[i] = weight[i] / (1 + e * e / (scale * scale));
    }
    out.rms = std::sqrt(ss / sw);
  }
  return out;
}

}  // namespace punctum::vision
