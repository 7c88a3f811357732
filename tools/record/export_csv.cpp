#include "tools/record/export_csv.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string>

#include "tools/record/recording_reader.hpp"
#include "tools/shared/event_words.hpp"
#include "tools/shared/row_file.hpp"
#include "tools/shared/sample_row.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::tools {
namespace {

constexpr const char* kSceneFile = "scene.toml";
constexpr const char* kObservationColumns =
    "frame,exposure_ns,holder_ok,tip_ok,outer_ok,inner_ok,contact,punctured,inner_punctured,tip_x_m,tip_y_m,"
    "tip_z_m,axis_x,axis_y,"
    "axis_z,holder_x_m,holder_y_m,holder_z_m,holder_score,centre_x_m,centre_y_m,centre_z_m,R_m,R_inner_m,"
    "entry_x_m,entry_y_m,"
    "entry_z_m,gap_m,wd_m,a_m,membrane_velocity_m_s,noise_m,wd_sd_m,a_sd_m,R_sd_m,total_us\n";

void write_observation_row(const v1::Observation& o, std::string& out) {
  out.clear();
  const auto put = [&out](double v) { fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:.9g},"), v); };
  const auto three = [&put](const v1::Vector& v) {
    put(v.x());
    put(v.y());
    put(v.z());
  };
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},{},{:d},{:d},{:d},{:d},{:d},{:d},{:d},"), o.frame(),
                 o.exposure_ns(), o.holder_ok(), o.tip_ok(), o.outer_ok(), o.inner_ok(), o.contact(),
                 o.punctured(), o.inner_punctured());
  three(o.tip_m());
  three(o.axis());
  three(o.holder_m());
  put(o.holder_score());
  three(o.centre_m());
  put(o.r_m());
  put(o.r_inner_m());
  three(o.entry_m());
  for (const double v : {o.gap_m(), o.wd_m(), o.a_m(), o.membrane_velocity_m_s(), o.noise_m(), o.wd_sd_m(),
                         o.a_sd_m(), o.r_sd_m()}) {
    put(v);
  }
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}\n"), o.total_us());
}

RowTruth truth_of(const v1::Truth& t) {
  return {.tip_m = {t.tip_m().x(), t.tip_m().y(), t.tip_m().z()},
          .cell = t.cell(),
          .axial_force_N = t.axial_force_n(),
          .gap_m = t.gap_m(),
          .wd_m = t.wd_m(),
          .a_m = t.a_m(),
          .contact = t.contact(),
          .punctured = t.punctured(),
          .lost = t.lost()};
}

class Tables {
 public:
  [[nodiscard]] tl::expected<void, std::string> open(const std::string& folder) {
    std::error_code ec;
    for (const std::string name : {samples_.name, events_.name, observations_.name, kSceneFile}) {
      if (is_there(folder + "/" + name)) {
        return tl::unexpected(folder + "/" + name + ": is there already; an export replaces nothing");
      }
    }
    folder_ = folder;
    new_folder_ = std::filesystem::create_directories(folder, ec);
    if (ec) {
      return tl::unexpected(folder + ": cannot be made: " + ec.message());
    }
    for (Table* table : {&samples_, &events_, &observations_}) {
      auto file = RowFile::open(folder + "/" + table->name, RowFile::Begin::empty);
      if (!file) {
        return tl::unexpected(given_up(file.error()));
      }
      table->file = std::move(*file);
    }
    samples_.file.append(sample_columns());
    events_.file.append(kEventColumns);
    observations_.file.append(kObservationColumns);
    return {};
  }

  void operator()(const v1::Telemetry& t) {
    write_waiting(nullptr);
    if (from_wire(t, sample_)) {
      waits_ = true;
      ++exported_.ticks;
    } else {
      ++exported_.unknown_ticks;
    }
  }
  void operator()(const v1::Truth& t) {
    if (waits_ && t.tick() == sample_.tick) {
      const RowTruth truth = truth_of(t);
      write_waiting(&truth);
    }
  }
  void operator()(const v1::Event& e) {
    rt::Event event;
    from_wire(e, event);
    events_.file.append(event_line(event));
    ++exported_.events;
  }
  void operator()(const v1::Observation& o) {
    write_observation_row(o, row_);
    observations_.file.append(row_);
    ++exported_.observations;
  }
  void operator()(const v1::Scene& s) { scene_ = s.toml(); }

  [[nodiscard]] tl::expected<Exported, std::string> finish() {
    write_waiting(nullptr);
    for (Table* table : {&samples_, &events_, &observations_}) {
      table->file.flush();
      if (!table->file.failure().empty()) {
        return tl::unexpected(
            given_up(fmt::format("{}/{}: {}", folder_, table->name, table->file.failure())));
      }
    }
    if (!scene_.empty()) {
      if (auto written = write_whole(folder_ + "/" + kSceneFile, scene_); !written) {
        return tl::unexpected(given_up(written.error()));
      }
    }
    return exported_;
  }

 private:
  // A table that is cut off looks like a whole one, and nothing would replace it.
  std::string given_up(const std::string& why) {
    std::error_code ignored;
    for (Table* table : {&samples_, &events_, &observations_}) {
      if (table->file.is_open()) {
        table->file = {};
        std::filesystem::remove(folder_ + "/" + table->name, ignored);
      }
    }
    if (new_folder_) {
      std::filesystem::remove(folder_, ignored);
    }
    return why;
  }

  struct Table {
    const char* name;
    RowFile file;
  };
  // The truth of a tick follows it.
  void write_waiting(const RowTruth* truth) {
    if (waits_) {
      write_sample_row(sample_, truth, row_);
      samples_.file.append(row_);
      waits_ = false;
    }
  }

  Table samples_{.name = "samples.csv", .file = {}};
  Table events_{.name = "events.csv", .file = {}};
  Table observations_{.name = "observations.csv", .file = {}};
  std::string folder_, scene_, row_;
  rt::TelemetrySample sample_;
  bool waits_ = false, new_folder_ = false;
  Exported exported_;
};

}  // namespace

tl::expected<Exported, std::string> export_csv(const std::string& recording, const std::string& folder) {
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  Tables tables;
  if (auto opened = tables.open(folder); !opened) {
    return tl::unexpected(opened.error());
  }
  const std::string ends = reader->read_all(tables);
  auto exported = tables.finish();
  if (exported) {
    exported->ends = ends;
    if (exported->unknown_ticks > 0) {
      exported->ends += fmt::format(
          "{}{} ticks are left out of samples.csv: their phase, fault, stop or time is none that this build "
          "knows",
          ends.empty() ? recording + ": " : "; ", exported->unknown_ticks);
    }
  }
  return exported;
}

}  // namespace punctum::tools
