#include "tools/vision/observation_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string_view>
#include <utility>

#include "rt/forces/membrane.hpp"

namespace punctum::tools {

namespace {

constexpr std::string_view kColumns =
    "frame,t_s,phase,contact,punctured,holder_x_px,holder_y_px,holder_score,tip_x_px,tip_y_px,outer_ok,inner_"
    "ok,"
    "wd_um,a_um,R_um,force_N,total_us,verdict,"
    "gap_um,gap_sd_um,R_inner_um,centre_x_px,centre_y_px,entry_x_px,entry_y_px,axis_x,axis_y,needle_score,"
    "merged,"
    "contact1_x_px,contact1_y_px,contact2_x_px,contact2_y_px,membrane_um_s,outer_support,outer_visible,"
    "outer_scatter_px,inner_support,impurities,noise,prepare_us,holder_us,needle_us,erase_us,start_us,outer_"
    "us,"
    "inner_us,contact_us,measure_us";
constexpr std::string_view kTruthColumns =
    ",outer_rms_um,outer_p95_um,outer_max_um,inner_rms_um,tip_error_um,tip_lateral_um,gap_error_um,wd_error_"
    "um,"
    "a_error_um";
constexpr std::string_view kLaterColumns =
    ",surface_us,outer_sd_um,inner_sd_um,wd_sd_um,a_sd_um,R_sd_um,force_sd_N";

class Row {
 public:
  explicit Row(RowFile& file) : file_(file) {}
  ~Row() {
    line_ += '\n';
    file_.append(line_);
  }
  Row(const Row&) = delete;
  Row& operator=(const Row&) = delete;

  void text(std::string_view s) {
    separate();
    for (const char c : s) {
      line_ += c == ',' || c == '\n' || c == '\r' ? ';' : c == '"' ? '\'' : c;
    }
  }
  void number(double v, int digits) {
    separate();
    line_ += fmt::format("{:.{}f}", v, digits);
  }
  void number(const std::optional<double>& v, int digits, double scale = 1) {
    if (v) {
      number(*v * scale, digits);
    } else {
      separate();
    }
  }
  void flag(bool v) { text(v ? "1" : "0"); }
  void point(const std::optional<vision::Point>& p, cv::Point offset) {
    if (p) {
      number(p->x + offset.x, 3);
      number(p->y + offset.y, 3);
    } else {
      nothing(2);
    }
  }
  void nothing(int cells) {
    for (int i = 0; i < cells; ++i) {
      separate();
    }
  }

 private:
  void separate() {
    if (!first_) {
      line_ += ',';
    }
    first_ = false;
  }
  RowFile& file_;
  std::string line_;
  bool first_ = true;
};

}  // namespace

tl::expected<ObservationCsv, std::string> ObservationCsv::open(const std::string& path, bool append,
                                                               bool with_truth) {
  const std::string head = std::string(kColumns) + (with_truth ? std::string(kTruthColumns) : std::string()) +
                           std::string(kLaterColumns);
  bool same = false;
  if (append) {
    std::ifstream old(path, std::ios::binary);
    std::string first;
    same = std::getline(old, first) && !old.eof() && first == head;
  }
  auto rows = RowFile::open(path, same ? RowFile::Begin::after : RowFile::Begin::empty);
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  ObservationCsv csv;
  csv.rows_ = std::move(*rows);
  csv.with_truth_ = with_truth;
  if (!same) {
    csv.rows_.append(head + "\n");
  }
  return csv;
}

std::optional<double> ObservationCsv::force_N(const vision::Result& r, const vision::VisionConfig& config) {
  if (!r.wd_px) {
    return std::nullopt;
  }
  if (*r.wd_px <= 0 || r.punctured) {
    return 0.0;
  }
  const double a_m = r.a_px.value_or(0) * config.pixel_m;
  if (!(a_m > config.c_m)) {
    return std::nullopt;
  }
  return rt::membrane_force(config.E_Pa, config.nu, config.h_m, config.c_m, *r.wd_px * config.pixel_m, a_m);
}

std::optional<double> ObservationCsv::force_sd_N(const vision::Result& r,
                                                 const vision::VisionConfig& config) {
  const auto force = force_N(r, config);
  if (!force || *force <= 0 || !(*r.wd_px > 0)) {
    return std::nullopt;
  }
  const double c_px = config.px(config.c_m);
  const double by_a = 2 + rt::membrane_shape(c_px, *r.a_px - c_px).steepness;  // -dlnF / dln a
  return *force * std::hypot(3 * r.wd_sd_px / *r.wd_px, by_a * r.a_sd_px / *r.a_px);
}

void ObservationCsv::row(std::uint64_t frame, double t_s, double total_us, const std::string& verdict) {
  Row row(rows_);
  row.text(std::to_string(frame));
  row.number(t_s, 6);
  row.nothing(8);
  row.flag(false);
  row.flag(false);
  row.nothing(4);
  row.number(total_us, 0);
  row.text(verdict);
  const auto more = std::count(kColumns.begin(), kColumns.end(), ',') + 1 - 18 +
                    std::count(kLaterColumns.begin(), kLaterColumns.end(), ',') +
                    (with_truth_ ? std::count(kTruthColumns.begin(), kTruthColumns.end(), ',') : 0);
  row.nothing(static_cast<int>(more));
}

void ObservationCsv::row(const vision::Result& r, const vision::VisionConfig& config, double t_s,
                         cv::Point offset, const TruthError* truth) {
  if (!r.usable) {
    row(r.frame, t_s, r.us.total, r.verdict);
    return;
  }
  const double um = config.pixel_m * 1e6;
  const auto some = [](bool known, const vision::Point& p) {
    return known ? std::optional<vision::Point>(p) : std::nullopt;
  };
  Row row(rows_);
  row.text(std::to_string(r.frame));
  row.number(t_s, 6);
  row.text(rt::name(r.phase));
  const bool touch_known = !config.needle || (r.needle.ok && r.outer.ok);
  if (touch_known) {
    row.flag(r.contact);
  } else {
    row.nothing(1);
  }
  row.flag(r.punctured);
  row.point(some(r.holder.ok, r.holder.mouth), offset);
  row.number(r.holder.ok || r.holder.score > 0 ? std::optional<double>(r.holder.score) : std::nullopt, 5);
  row.point(some(r.needle.ok, r.needle.point()), offset);
  row.flag(r.outer.ok);
  row.flag(r.inner.ok);
  row.number(r.wd_px, 4, um);
  row.number(r.a_px, 4, um);
  row.number(r.undeformed ? std::optional<double>(r.undeformed->r) : std::nullopt, 4, um);
  if (const auto f = force_N(r, config)) {
    row.text(fmt::format("{:.6e}", *f));
  } else {
    row.nothing(1);
  }
  row.number(r.us.total, 0);
  row.text(r.verdict);
  row.number(r.gap_px, 4, um);
  row.number(r.gap_px ? std::optional<double>(r.gap_sd_px) : std::nullopt, 4, um);
  row.number(r.inner_radius_px, 4, um);
  row.point(r.undeformed ? std::optional<vision::Point>(r.undeformed->centre) : std::nullopt, offset);
  row.point(r.entry, offset);
  row.number(r.needle.ok ? std::optional<double>(r.needle.axis.x) : std::nullopt, 6);
  row.number(r.needle.ok ? std::optional<double>(r.needle.axis.y) : std::nullopt, 6);
  row.number(r.needle.ok ? std::optional<double>(r.needle.score) : std::nullopt, 4);
  row.flag(r.merged);
  row.point(r.points.point[0], offset);
  row.point(r.points.point[1], offset);
  row.number(r.membrane_velocity_px_s * um, 3);
  const auto when = [](bool known, double v) { return known ? std::optional<double>(v) : std::nullopt; };
  row.number(when(!r.outer.contour.empty(), r.outer.support), 3);
  row.number(when(!r.outer.contour.empty(), r.outer.visible), 3);
  row.number(when(!r.outer.contour.empty(), r.outer.residual_px), 3);
  row.number(when(!r.inner.contour.empty(), r.inner.support), 3);
  row.text(std::to_string(r.impurities));
  row.number(r.noise, 2);
  for (const double us : {r.us.prepare, r.us.holder, r.us.needle, r.us.erase, r.us.start, r.us.outer,
                          r.us.inner, r.us.contact, r.us.measure}) {
    row.number(when(us > 0, us), 0);  // empty: the stage did not run
  }
  if (with_truth_) {
    const TruthError none;
    const TruthError& e = truth != nullptr ? *truth : none;
    for (const auto& v : {e.outer_rms_um, e.outer_p95_um, e.outer_max_um, e.inner_rms_um, e.tip_um,
                          e.tip_lateral_um, e.gap_um, e.wd_um, e.a_um}) {
      row.number(v, 4);
    }
  }
  row.number(when(r.us.surface > 0, r.us.surface), 0);
  for (const vision::Membrane* m : {&r.outer, &r.inner}) {
    double square = 0;
    for (const double sd : m->sd_px) {
      square += sd * sd / static_cast<double>(m->sd_px.size());
    }
    row.number(when(square > 0, std::sqrt(square) * um), 4);
  }
  row.number(when(r.wd_sd_px > 0, r.wd_sd_px * um), 4);
  row.number(when(r.a_px.has_value(), r.a_sd_px * um), 4);
  row.number(r.undeformed ? std::optional<double>(r.undeformed->r_sd) : std::nullopt, 4, um);
  if (const auto sd = force_sd_N(r, config)) {
    row.text(fmt::format("{:.6e}", *sd));
  } else {
    row.nothing(1);
  }
}

bool ObservationCsv::flush() {
  rows_.flush();
  return rows_.failure().empty();
}

tl::expected<ContoursCsv, std::string> ContoursCsv::open(const std::string& path, Of of) {
  auto rows = RowFile::open(path, RowFile::Begin::empty);
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  ContoursCsv csv;
  csv.of_ = of;
  csv.rows_ = std::move(*rows);
  csv.rows_.append(of == Of::place ? "frame,membrane,node,x_px,y_px\n" : "frame,membrane,node,sd_px\n");
  return csv;
}

void ContoursCsv::rows(const vision::Result& r, cv::Point offset) {
  for (const auto& [name, m] : {std::pair{"outer", &r.outer}, std::pair{"inner", &r.inner}}) {
    if (!m->ok) {
      continue;
    }
    for (std::size_t i = 0; i < m->contour.size() && of_ == Of::place; ++i) {
      rows_.append(fmt::format("{},{},{},{:.3f},{:.3f}\n", r.frame, name, i, m->contour[i].x + offset.x,
                               m->contour[i].y + offset.y));
    }
    for (std::size_t i = 0; i < m->sd_px.size() && of_ == Of::deviation; ++i) {
      rows_.append(fmt::format("{},{},{},{:.3f}\n", r.frame, name, i, m->sd_px[i]));
    }
  }
}

bool ContoursCsv::flush() {
  rows_.flush();
  return rows_.failure().empty();
}

}  // namespace punctum::tools
