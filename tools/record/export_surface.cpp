#include "tools/record/export_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <string>

#include "tools/record/recording_reader.hpp"
#include "tools/shared/whole_file.hpp"
#include "tools/vision/surface_files.hpp"

namespace punctum::tools {
namespace {

bool is_finite(const rt::MembraneSurface& s) {
  return std::all_of(std::begin(s.control_m), std::end(s.control_m), [](const auto& row) {
    return std::all_of(std::begin(row), std::end(row), [](double v) { return std::isfinite(v); });
  });
}

// The surface that was told nearest to a time of the run.
class NearestSurface {
 public:
  explicit NearestSurface(std::optional<double> at_s) : at_s_(at_s) {}

  void operator()(const v1::Telemetry& t) {
    now_s = t.t_s();
    first_s = first_s.value_or(now_s);
  }
  void operator()(const v1::CellSurface& s) {
    ++seen;
    const double off_s = at_s_ ? std::abs(now_s - *at_s_) : 0;
    if (off_s <= off_s_) {
      off_s_ = off_s;
      from_wire(s, surface);
    }
  }

  rt::CellSurface surface;
  std::uint64_t seen = 0;
  std::optional<double> first_s;  // of the ticks; nothing: there is none
  double now_s = 0;

 private:
  std::optional<double> at_s_;
  double off_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace

tl::expected<std::string, std::string> export_surface(const std::string& recording, const std::string& stem,
                                                      std::optional<double> at_s) {
  for (const std::string& file : surface_files(stem)) {
    if (is_there(file)) {
      return tl::unexpected(file + ": is there already; an export replaces nothing");
    }
  }
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  NearestSurface nearest(at_s);
  std::string ends = reader->read_all(nearest);
  const double first_s = nearest.first_s.value_or(0);
  if (at_s && !(*at_s >= first_s && *at_s <= nearest.now_s)) {
    return tl::unexpected(fmt::format("--at: {}: not in {}, allowed: from {:.3f} to {:.3f}", *at_s, recording,
                                      first_s, nearest.now_s));
  }
  if (nearest.seen == 0) {
    return tl::unexpected(recording + ": holds no surface; a scene tells them with vision.surface = true");
  }
  if (!is_finite(nearest.surface.outer) || !is_finite(nearest.surface.inner)) {
    return tl::unexpected(recording + ": the surface of that moment has control points that are no numbers");
  }
  if (auto written = write_surface(stem, nearest.surface); !written) {
    return tl::unexpected(written.error());
  }
  return ends;
}

}  // namespace punctum::tools
