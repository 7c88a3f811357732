#include "tools/vision/picture_teller.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "tools/shared/shown_picture.hpp"

namespace punctum::tools {
namespace {

rt::SeenContour thinned(const vision::Membrane& membrane) {
  rt::SeenContour out;
  const vision::Contour& contour = membrane.contour;
  if (!membrane.ok || contour.empty()) {
    return out;
  }
  out.count = static_cast<std::uint32_t>(std::min(contour.size(), rt::SeenContour::kMost));
  for (std::uint32_t i = 0; i < out.count; ++i) {
    const std::size_t k = i * contour.size() / out.count;
    out.point[i] = {static_cast<float>(contour[k].x), static_cast<float>(contour[k].y),
                    k < membrane.sd_px.size() ? static_cast<float>(membrane.sd_px[k]) : 0};
  }
  return out;
}

}  // namespace

tl::expected<PictureTeller, std::string> PictureTeller::open(const HandedSegments& handed, double pixel_m) {
  PictureTeller teller;
  teller.pixel_m_ = static_cast<float>(pixel_m);
  if (const int pictures = handed.descriptor(kPictureSegment); pictures >= 0) {
    auto claimed = hal::Shared<rt::PictureSegment>::claim(kPictureSegment, pictures);
    if (!claimed) {
      return tl::unexpected(claimed.error());
    }
    teller.recorded_ = std::move(*claimed);
  }
  if (const int view = handed.descriptor(kViewSegment); view >= 0) {
    auto claimed = hal::Shared<rt::ViewSegment>::claim(kViewSegment, view);
    if (!claimed) {
      return tl::unexpected(claimed.error());
    }
    auto viewer =
        hal::Shared<const rt::ViewerSegment>::attach(kViewerSegment, handed.descriptor(kViewerSegment));
    if (!viewer) {
      return tl::unexpected(viewer.error());
    }
    teller.view_ = std::move(*claimed);
    teller.viewer_ = std::move(*viewer);
  }
  return teller;
}

void PictureTeller::tell(const hal::Frame& frame, const vision::Result* seen, std::int64_t now_ns) {
  const bool shown = view_ && now_ns >= next_view_ns_ &&
                     now_ns < static_cast<std::int64_t>((*viewer_)->looks_until_ns.load());
  if (frame.pixels == nullptr || (!recorded_ && !shown)) {
    return;
  }
  rt::PictureHead head{.frame = frame.sequence,
                       .exposure_ns = frame.exposure_ns,
                       .width = static_cast<std::uint32_t>(frame.width),
                       .height = static_cast<std::uint32_t>(frame.height),
                       .pixel_m = pixel_m_};
  if (seen != nullptr) {
    head.outer = thinned(seen->outer);
    head.inner = thinned(seen->inner);
  }
  if (recorded_) {
    (void)(*recorded_)->ring.push(head, frame.pixels, static_cast<std::size_t>(frame.stride));
  }
  if (shown) {
    next_view_ns_ = now_ns + rt::ViewSegment::kBetween_ns;
    show(head, frame.pixels, static_cast<std::size_t>(frame.stride), reduced_, (*view_)->ring);
  }
}

}  // namespace punctum::tools
