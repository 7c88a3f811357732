// Impurities of the medium: components of the thresholded Sobel picture that do not belong to the cell.
#pragma once

#include <opencv2/core.hpp>

#include "vision/image/components.hpp"
#include "vision/image/contour.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// binary: CV_8U, 255 where the Sobel magnitude is above the threshold, without the pipettes. A component is
// an impurity when both sides of its box are at most max_side px, it has at least min_area pixels, and it is
// further than `keep` px from all membranes. `pixels` become those of the impurities. Returns the number of
// impurities.
[[nodiscard]] int find_impurities(const cv::Mat& binary, const Vector<Contour>& membranes, double max_side,
                                  int min_area, double keep, Vector<PixelRun>& pixels);

}  // namespace punctum::vision
