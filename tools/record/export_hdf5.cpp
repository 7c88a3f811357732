#include "tools/record/export_hdf5.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/forces/list.hpp"
#include "tools/record/recording_reader.hpp"
#include "tools/shared/html.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::tools {
namespace {

// Something of HDF5, closed with it.
class H5Object {
 public:
  using Close = herr_t (*)(hid_t);
  H5Object(hid_t id, Close close) : id_(id), close_(close) {}
  H5Object(H5Object&& other) noexcept
      : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  H5Object& operator=(H5Object&&) = delete;
  ~H5Object() {
    if (id_ >= 0) {
      close_(id_);
    }
  }
  [[nodiscard]] hid_t id() const { return id_; }

 private:
  hid_t id_;
  Close close_;
};

struct H5Failed {   // within this file only
  std::string why;  // ": No space left on device", or empty
};
// The operating system's own words stand in the library's account of each level that failed.
herr_t find_system_error(unsigned, const H5E_error2_t* level, void* found) {
  constexpr std::string_view kBefore = "error message = '";
  const std::string_view text = level->desc == nullptr ? "" : level->desc;
  if (const auto at = text.find(kBefore); at != std::string_view::npos) {
    const std::string_view words = text.substr(at + kBefore.size());
    *static_cast<std::string*>(found) = fmt::format(": {}", words.substr(0, words.find('\'')));
  }
  return 0;
}
template <class Result>
Result must_be(Result result) {
  if (result < 0) {
    std::string why;
    (void)H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, find_system_error, &why);
    throw H5Failed{why};
  }
  return result;
}

H5Object group(hid_t in, const std::string& name) {
  return {must_be(H5Gcreate2(in, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), H5Gclose};
}

H5Object text_type() {
  H5Object type(must_be(H5Tcopy(H5T_C_S1)), H5Tclose);
  must_be(H5Tset_size(type.id(), H5T_VARIABLE));
  must_be(H5Tset_cset(type.id(), H5T_CSET_UTF8));
  return type;
}

void set_text(hid_t of, const char* name, const std::string& text) {
  const H5Object type = text_type(), space(must_be(H5Screate(H5S_SCALAR)), H5Sclose);
  const H5Object attribute(must_be(H5Acreate2(of, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT)),
                           H5Aclose);
  const char* bytes = text.c_str();
  must_be(H5Awrite(attribute.id(), type.id(), static_cast<const void*>(&bytes)));
}

template <class Number>
void set_number(hid_t of, const char* name, hid_t stored, hid_t native, Number number) {
  const H5Object space(must_be(H5Screate(H5S_SCALAR)), H5Sclose);
  const H5Object attribute(must_be(H5Acreate2(of, name, stored, space.id(), H5P_DEFAULT, H5P_DEFAULT)),
                           H5Aclose);
  must_be(H5Awrite(attribute.id(), native, &number));
}

void write_text(hid_t in, const char* name, const std::string& text, bool as_list = false) {
  const hsize_t one = 1;
  const H5Object type = text_type(),
                 space(must_be(as_list ? H5Screate_simple(1, &one, nullptr) : H5Screate(H5S_SCALAR)),
                       H5Sclose);
  const H5Object set(
      must_be(H5Dcreate2(in, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), H5Dclose);
  const char* bytes = text.c_str();
  must_be(H5Dwrite(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, static_cast<const void*>(&bytes)));
}

// A name that nothing else in the world has: a UUID, RFC 9562, version 4.
std::string own_name() {
  static std::random_device random;
  std::array<unsigned, 4> r{random(), random(), random(), random()};
  r[1] = (r[1] & 0xFFFF0FFFU) | 0x4000U;
  r[2] = (r[2] & 0x3FFFFFFFU) | 0x80000000U;
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:04x}{:08x}", r[0], r[1] >> 16U, r[1] & 0xFFFFU,
                     r[2] >> 16U, r[2] & 0xFFFFU, r[3]);
}

// Every object of NWB says what it is.
void set_kind(hid_t of, const char* kind) {
  set_text(of, "namespace", "core");
  set_text(of, "neurodata_type", kind);
  set_text(of, "object_id", own_name());
}

std::string date(std::uint64_t utc_ns) {
  const auto ms = static_cast<std::int64_t>(utc_ns / 1'000'000);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}+00:00", fmt::gmtime(static_cast<std::time_t>(ms / 1000)),
                     ms % 1000);
}

// Rows of doubles that grow, of which one block is in memory.
class Column {
 public:
  Column(hid_t in, const char* name, std::size_t width) : width_(width) {
    const std::array<hsize_t, 2> none{0, width}, most{H5S_UNLIMITED, width}, block{kBlock, width};
    const int rank = width > 1 ? 2 : 1;
    const H5Object space(must_be(H5Screate_simple(rank, none.data(), most.data())), H5Sclose);
    const H5Object how(must_be(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
    must_be(H5Pset_chunk(how.id(), rank, block.data()));
    must_be(H5Pset_shuffle(how.id()));
    must_be(H5Pset_deflate(how.id(), 4));
    set_.emplace_back(
        must_be(H5Dcreate2(in, name, H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, how.id(), H5P_DEFAULT)),
        H5Dclose);
  }

  template <class Values>
  void add(const Values& values) {
    waiting_.insert(waiting_.end(), std::begin(values), std::end(values));
    if (waiting_.size() >= kBlock * width_) {
      flush();
    }
  }
  void flush() {
    const hsize_t rows = waiting_.size() / width_;
    if (rows == 0) {
      return;
    }
    const std::array<hsize_t, 2> size{rows_ + rows, width_}, from{rows_, 0}, count{rows, width_};
    must_be(H5Dset_extent(id(), size.data()));
    const H5Object space(must_be(H5Dget_space(id())), H5Sclose);
    must_be(H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, from.data(), nullptr, count.data(), nullptr));
    const H5Object memory(must_be(H5Screate_simple(width_ > 1 ? 2 : 1, count.data(), nullptr)), H5Sclose);
    must_be(H5Dwrite(id(), H5T_NATIVE_DOUBLE, memory.id(), space.id(), H5P_DEFAULT, waiting_.data()));
    rows_ += rows;
    waiting_.clear();
  }
  [[nodiscard]] hid_t id() const { return set_.front().id(); }

 private:
  static constexpr std::size_t kBlock = 4096;
  std::size_t width_;
  hsize_t rows_ = 0;
  std::vector<double> waiting_;
  std::vector<H5Object> set_;  // one
};

// One quantity: the first of some makes the times, all others refer to these.
struct Series {
  Series(hid_t acquisition, const Series* times_of, const std::string& name, const char* unit,
         const std::string& description, const char* continuity, std::size_t width)
      : object(group(acquisition, name)), data(object.id(), "data", width) {
    set_kind(object.id(), "TimeSeries");
    set_text(object.id(), "description", description);
    set_text(object.id(), "comments", "no comments");
    set_text(data.id(), "unit", unit);
    set_text(data.id(), "continuity", continuity);
    set_number(data.id(), "conversion", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, 1.0F);
    set_number(data.id(), "offset", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, 0.0F);
    set_number(data.id(), "resolution", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, -1.0F);
    if (times_of != nullptr) {
      must_be(H5Lcreate_hard(times_of->object.id(), "timestamps", object.id(), "timestamps", H5P_DEFAULT,
                             H5P_DEFAULT));
    } else {
      times.emplace_back(object.id(), "timestamps", 1);
      set_number(times.front().id(), "interval", H5T_STD_I32LE, H5T_NATIVE_INT, 1);
      set_text(times.front().id(), "unit", "seconds");
    }
  }
  H5Object object;
  Column data;
  std::vector<Column> times;  // one or none
};

class NwbFile {
 public:
  explicit NwbFile(const std::string& path)
      : file_(must_be(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)), H5Fclose),
        acquisition_(group(file_.id(), "acquisition")) {
    set_text(file_.id(), "nwb_version", "2.6.0");
    set_kind(file_.id(), "NWBFile");
    for (const char* name :
         {"analysis", "processing", "general", "stimulus", "stimulus/presentation", "stimulus/templates"}) {
      (void)group(file_.id(), name);
    }
  }

  void operator()(const v1::Scene& s) { scene_ = s; }
  void operator()(const v1::Telemetry& t) {
    if (!begun_) {
      begun_ = true;
      begin_ns = log_ns - static_cast<std::uint64_t>(std::max(0.0, t.t_s()) * 1e9);
    }
    const auto three = [](const v1::Vector& v) { return std::array{v.x(), v.y(), v.z()}; };
    const auto one = [](double v) { return std::array{v}; };
    std::size_t next = 0;
    const auto put = [&](const char* name, const char* unit, const std::string& description,
                         const char* continuity, const auto& values) {
      add(ticks_, next++, t.t_s(), name, unit, description, continuity, values);
    };
    const char *smooth = "continuous", *step = "step";
    put("hand_position", "meters", "hand in the device's frame: x right, y up, z towards the operator",
        smooth, three(t.x_m()));
    put("hand_velocity", "meters/second", "hand, filtered", smooth, three(t.v_m_s()));
    put("hand_force", "newtons", "to the hand, after guard and limits", smooth, three(t.force_n()));
    put("tip_position", "meters", "needle tip by the stage's encoders, frame of the microscope", smooth,
        three(t.tip_m()));
    put("set_point", "meters", "of the stage", smooth, three(t.cmd_m()));
    std::array<double, rt::effect_count> effects{};
    std::copy_n(t.effect_n().begin(), std::min<int>(t.effect_n_size(), rt::effect_count), effects.begin());
    put("force_effects", "newtons", "magnitude at the hand, a column each: " + effect_names(), smooth,
        effects);
    put("guard_force", "newtons", "what the passivity guard changed", smooth, one(t.guard_n()));
    put("dimple_depth", "meters", "w_d of the local membrane model", smooth, one(t.wd_m()));
    put("dimple_half_width", "meters", "a of the local membrane model", smooth, one(t.a_m()));
    put("cell_radius", "meters", "R of the undeformed membrane", smooth, one(t.r_m()));
    put("tip_force", "newtons", "of the membrane law, not scaled", smooth, one(t.tip_force_n()));
    put("membrane_stress", "pascals", "of eq. 4", smooth, one(t.sigma_d_pa()));
    put("internal_pressure", "pascals", "of eq. 4", smooth, one(t.pressure_pa()));
    put("observation_age", "seconds", "of the newest observation; -1: none yet", smooth, one(t.obs_age_s()));
    put("force_sensor", "newtons", "0 where there is none", smooth, one(t.sensor_n()));
    put("holding_vacuum", "pascals", "below ambient", smooth, one(t.vacuum_pa()));
    put("stored_energy", "joules", "in the force effects, at the hand", smooth, one(t.stored_energy_j()));
    put("phase", "n/a", "0 free, 1 contact, 2 indentation, 3 puncture, 4 injection, 5 withdrawal, 6 clear",
        step, one(t.phase()));
    put("fault", "n/a", "number of punctum.v1.Fault; 0: none", step, one(t.fault()));
    put("alarms", "n/a", "bits of punctum.v1.Alarm", step, one(t.alarms()));
    put("buttons", "n/a", "bit 0 clutch, 1 inject, 2 next cell, 3 enable, 4 panic", step, one(t.buttons()));
    put("injector_open", "n/a", "1: open", step, one(t.injector_open() ? 1 : 0));
    put("cell", "n/a", "counts the cells of the run from 0", step, one(t.cell()));
    last_tick_ = t.tick();
    last_t_s_ = t.t_s();
  }
  void operator()(const v1::Truth& t) {
    if (!begun_ || t.tick() != last_tick_) {
      return;
    }
    std::size_t next = 0;
    const auto put = [&](const char* name, const char* unit, const char* description, const auto& values) {
      add(truth_, next++, last_t_s_, name, unit, std::string(description) + ", in the simulated world",
          "continuous", values);
    };
    put("true_tip_position", "meters", "needle tip", std::array{t.tip_m().x(), t.tip_m().y(), t.tip_m().z()});
    put("true_force", "newtons", "along the needle, compression positive", std::array{t.axial_force_n()});
    put("true_gap", "meters", "from the tip to the membrane along the axis", std::array{t.gap_m()});
    put("true_dimple_depth", "meters", "w_d", std::array{t.wd_m()});
    put("true_dimple_half_width", "meters", "a", std::array{t.a_m()});
  }

  // At its exposure, which may be told late: times rise all the same, since pictures are told in their order.
  void operator()(const v1::Observation& o) {
    if (!begun_) {
      return;
    }
    std::size_t next = 0;
    const double t_s = 1e-9 * static_cast<double>(static_cast<std::int64_t>(publish_ns - begin_ns));
    const auto put = [&](const char* name, const char* unit, const char* description, const auto& values) {
      add(seen_, next++, t_s, name, unit, std::string(description) + ", as vision found it", "continuous",
          values);
    };
    const auto three = [](const v1::Vector& v) { return std::array{v.x(), v.y(), v.z()}; };
    put("seen_tip_position", "meters", "needle tip, frame of the microscope", three(o.tip_m()));
    put("seen_cell_centre", "meters", "centre of the undeformed cell", three(o.centre_m()));
    put("seen_cell_radius", "meters", "R of the undeformed membrane", std::array{o.r_m()});
    put("seen_gap", "meters", "from the tip to the membrane along the axis", std::array{o.gap_m()});
    put("seen_gap_sd", "meters", "standard deviation of the gap", std::array{o.noise_m()});
    put("seen_dimple_depth", "meters", "w_d", std::array{o.wd_m()});
    put("seen_dimple_depth_sd", "meters", "standard deviation of w_d", std::array{o.wd_sd_m()});
    put("seen_dimple_half_width", "meters", "a", std::array{o.a_m()});
  }

  void finish(const std::string& recording) {
    for (auto* all : {&ticks_, &truth_, &seen_}) {
      for (Series& s : *all) {
        s.data.flush();
        for (Column& times : s.times) {
          times.flush();
        }
      }
    }
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    write_text(
        file_.id(), "file_create_date",
        date(static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count())),
        true);
    // A virtual clock begins in 1970.
    const std::string begin = date(scene_.virtual_time() ? scene_.begun_ns() : begin_ns);
    write_text(file_.id(), "session_start_time", begin);
    write_text(file_.id(), "timestamps_reference_time", begin);
    write_text(file_.id(), "identifier", own_name());
    write_text(
        file_.id(), "session_description",
        fmt::format("A run of {}, {} station, {} time; made of {}.",
                    scene_.station().empty() ? "a station" : scene_.station(),
                    scene_.simulated() ? "simulated" : "real", scene_.virtual_time() ? "virtual" : "real",
                    readable(std::filesystem::path(recording).filename().string())));
    const H5Object general(must_be(H5Gopen2(file_.id(), "general", H5P_DEFAULT)), H5Gclose);
    write_text(general.id(), "data_collection", scene_.toml());
    write_text(general.id(), "session_id", scene_.station());
    must_be(H5Fflush(file_.id(), H5F_SCOPE_GLOBAL));
  }

  std::uint64_t log_ns = 0, publish_ns = 0;  // of the message that comes now
  std::uint64_t begin_ns = 0;                // of the run

 private:
  template <class Values>
  void add(std::vector<Series>& all, std::size_t i, double t_s, const char* name, const char* unit,
           const std::string& description, const char* continuity, const Values& values) {
    if (i == all.size()) {
      all.emplace_back(acquisition_.id(), all.empty() ? nullptr : all.data(), name, unit, description,
                       continuity, values.size());
    }
    all[i].data.add(values);
    for (Column& times : all[i].times) {
      times.add(std::array{t_s});
    }
  }
  static std::string effect_names() {
    std::string names;
    for (std::size_t i = 0; i < rt::effect_count; ++i) {
      names += (i > 0 ? ", " : "") + std::string(rt::effect_name(i));
    }
    return names;
  }

  H5Object file_, acquisition_;
  std::vector<Series> ticks_, truth_, seen_;
  v1::Scene scene_;
  bool begun_ = false;
  std::uint64_t last_tick_ = 0;
  double last_t_s_ = 0;
};

}  // namespace

tl::expected<std::string, std::string> export_hdf5(const std::string& recording, const std::string& file) {
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  if (is_there(file)) {
    return tl::unexpected(file + ": is there already; an export replaces nothing");
  }
  (void)H5dont_atexit();  // it would touch a file again that could not be closed for want of room, and crash
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // its own words
  const auto part = begin_unfinished(file);
  if (!part) {
    return tl::unexpected(part.error());
  }
  std::string ends;
  try {
    NwbFile nwb(part->string());
    ends = reader->read_all(nwb);
    nwb.finish(recording);
  } catch (const H5Failed& failed) {
    std::error_code ignored;
    std::filesystem::remove(*part, ignored);
    return tl::unexpected(fmt::format("{}: cannot be written{}", file, failed.why));
  }
  if (auto placed = put_in_place(*part, file); !placed) {
    return tl::unexpected(placed.error());
  }
  return ends;
}

}  // namespace punctum::tools
