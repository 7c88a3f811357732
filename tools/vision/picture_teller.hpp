// Tells the pictures that vision looks at, with the contours that it sees: to a recorder every one, to a
// console some a second while somebody looks there. Nobody waits for either.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/devices.hpp"
#include "hal/ipc/segment.hpp"
#include "rt/station/picture.hpp"
#include "tools/shared/station_segments.hpp"
#include "vision/result.hpp"

namespace punctum::tools {

class PictureTeller {
 public:
  // Tells nothing where no such segments were handed over. The error is one line.
  [[nodiscard]] static tl::expected<PictureTeller, std::string> open(const HandedSegments& handed,
                                                                     double pixel_m);

  // seen: null where nothing was looked for. now_ns: of the monotonic clock.
  void tell(const hal::Frame& frame, const vision::Result* seen, std::int64_t now_ns);

 private:
  float pixel_m_ = 0;
  std::optional<hal::Shared<rt::PictureSegment>> recorded_;
  std::optional<hal::Shared<rt::ViewSegment>> view_;
  std::optional<hal::Shared<const rt::ViewerSegment>> viewer_;
  std::int64_t next_view_ns_ = 0;
  std::vector<std::uint8_t> reduced_;
};

}  // namespace punctum::tools
