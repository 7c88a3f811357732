#include "hal/aravis/module.hpp"

#include <arv.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "hal/aravis/stamps.hpp"

namespace punctum::aravis {
namespace {

constexpr int kBuffers = 6;
// So long without a frame, a USB camera is asked whether it is still there: only of those on a network does
// the library notice by itself that they are gone.
constexpr std::int64_t kAsk_ns = 1'000'000'000;
constexpr std::int64_t kMostAhead_ns = 100'000'000;  // beyond any jitter of the arrival

using Done = tl::expected<void, std::string>;

tl::unexpected<std::string> wrong(std::string what) { return tl::unexpected<std::string>(std::move(what)); }

// An error of the library.
class Failure {
 public:
  Failure() = default;
  ~Failure() { g_clear_error(&error_); }
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  operator GError**() {  // NOLINT(google-explicit-constructor): an argument of every call
    g_clear_error(&error_);
    return &error_;
  }
  [[nodiscard]] bool happened() const { return error_ != nullptr; }
  [[nodiscard]] std::string text() const {
    std::string line = error_ == nullptr ? "" : error_->message;
    std::replace(line.begin(), line.end(), '\n', ' ');
    return line;
  }

 private:
  GError* error_ = nullptr;
};

template <class T>
struct Unref {
  void operator()(T* object) const { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref<T>>;

struct PixelFormat {
  std::int64_t code;
  int bits;
  const char* name;
};

const PixelFormat& format_of(AravisParams::Format format) {
  static const std::array<PixelFormat, 4> formats{{{ARV_PIXEL_FORMAT_MONO_8, 8, "Mono8"},
                                                   {ARV_PIXEL_FORMAT_MONO_10, 10, "Mono10"},
                                                   {ARV_PIXEL_FORMAT_MONO_12, 12, "Mono12"},
                                                   {ARV_PIXEL_FORMAT_MONO_16, 16, "Mono16"}}};
  return formats[static_cast<std::size_t>(format)];
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

class AravisCamera final : public hal::LiveCamera {
 public:
  AravisCamera(AravisParams params, const hal::CameraSettings& settings, const hal::Clock& clock)
      : params_(std::move(params)), settings_(settings), clock_(clock), format_(format_of(params_.format)) {}
  ~AravisCamera() override { close(); }
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  [[nodiscard]] Done open() override;
  void close() noexcept override;
  [[nodiscard]] hal::Status next(hal::Frame& out, std::int64_t timeout_ns) override;
  void release(const hal::Frame& frame) override;
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return notes_; }
  [[nodiscard]] const std::string& last_error() const noexcept override { return error_; }
  [[nodiscard]] const hal::CameraCounts& counts() const noexcept override { return counts_; }

 private:
  struct Taken {
    Object<ArvBuffer> buffer;
    std::uint64_t sequence = 0;
    std::int64_t exposure_ns = 0;
    const char* damage = nullptr;
  };

  [[nodiscard]] Done connect();
  [[nodiscard]] Done set_format();
  [[nodiscard]] Done set_region();
  [[nodiscard]] Done set_rate();
  [[nodiscard]] Done lock_exposure();
  [[nodiscard]] Done lock_gain();
  [[nodiscard]] Done start_streaming();
  [[nodiscard]] Taken judged(Object<ArvBuffer> buffer);
  [[nodiscard]] std::int64_t arrival_ns(ArvBuffer* buffer);
  [[nodiscard]] hal::Status lost(const std::string& why);
  void give_back(Object<ArvBuffer> buffer) {
    if (buffer && stream_) {
      arv_stream_push_buffer(stream_.get(), buffer.release());
    }
  }
  [[nodiscard]] std::string title() const { return params_.name.empty() ? "aravis" : params_.name; }

  const AravisParams params_;
  const hal::CameraSettings settings_;
  const hal::Clock& clock_;
  const PixelFormat& format_;

  Object<ArvCamera> camera_;
  Object<ArvStream> stream_;
  Object<ArvBuffer> held_;            // the caller looks at it
  std::atomic<bool> control_lost_{};  // set by the library's thread
  std::vector<std::uint8_t> grey_;
  double exposure_s_ = 0;  // as it is locked; 0: not known

  WallClock wall_clock_;
  CameraClock camera_clock_;
  bool counted_ = false;
  std::uint64_t last_id_ = 0, sequence_ = 0;
  std::int64_t last_exposure_ns_ = 0, last_frame_ns_ = 0;

  std::vector<std::string> notes_;
  std::string error_;
  hal::CameraCounts counts_;
};

Done AravisCamera::open() {
  close();
  notes_.clear();
  counted_ = false;
  control_lost_ = false;
  camera_clock_ = {};
  for (const auto step :
       {&AravisCamera::connect, &AravisCamera::set_format, &AravisCamera::set_region, &AravisCamera::set_rate,
        &AravisCamera::lock_exposure, &AravisCamera::lock_gain, &AravisCamera::start_streaming}) {
    if (const Done done = (this->*step)(); !done) {
      close();
      return wrong(title() + ": " + done.error());
    }
  }
  last_frame_ns_ = clock_.now_ns();
  return {};
}

Done AravisCamera::connect() {
  if (params_.name.starts_with("Fake")) {
    arv_enable_interface("Fake");
  }
  if (params_.name.empty()) {
    arv_update_device_list();
    const unsigned found = arv_get_n_devices();
    if (found > 1) {
      std::string names;
      for (unsigned i = 0; i < found; ++i) {
        names += (i == 0 ? "" : ", ") + std::string(arv_get_device_id(i));
      }
      return wrong("there are several cameras, allowed: aravis.name = one of " + names);
    }
  }
  Failure failure;
  camera_.reset(arv_camera_new(params_.name.empty() ? nullptr : params_.name.c_str(), failure));
  if (!camera_) {
    return wrong("no such camera is found (" + failure.text() + "); arv-tool-0.8 lists those that are");
  }
  g_signal_connect(
      arv_camera_get_device(camera_.get()), "control-lost",
      G_CALLBACK(+[](ArvDevice*, gpointer lost) { *static_cast<std::atomic<bool>*>(lost) = true; }),
      &control_lost_);
  arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, failure);
  arv_camera_clear_triggers(camera_.get(), failure);
  return {};
}

Done AravisCamera::set_format() {
  Failure failure;
  arv_camera_set_pixel_format(camera_.get(), static_cast<ArvPixelFormat>(format_.code), failure);
  if (!failure.happened() && arv_camera_get_pixel_format(camera_.get(), failure) == format_.code &&
      !failure.happened()) {
    return {};
  }
  std::string names;
  guint count = 0;
  const char** const offered =
      arv_camera_dup_available_pixel_formats_as_strings(camera_.get(), &count, failure);
  for (guint i = 0; offered != nullptr && i < count; ++i) {
    names += (i == 0 ? "" : ", ") + std::string(offered[i]);
  }
  g_free(static_cast<void*>(offered));
  return wrong("aravis.format: it does not give " + std::string(format_.name) + ", it offers: " + names);
}

// In the middle of the sensor, where the optical axis is.
Done AravisCamera::set_region() {
  Failure failure;
  int sensor_width = 0;
  int sensor_height = 0;
  arv_camera_get_sensor_size(camera_.get(), &sensor_width, &sensor_height, failure);
  const auto middle = [](int sensor, int wanted, int step) {
    const int offset = std::max(sensor - wanted, 0) / 2;
    return offset - offset % std::max(step, 1);
  };
  int x = -1;
  int y = -1;
  if (arv_camera_is_region_offset_available(camera_.get(), failure)) {
    x = middle(sensor_width, settings_.width, arv_camera_get_x_offset_increment(camera_.get(), failure));
    y = middle(sensor_height, settings_.height, arv_camera_get_y_offset_increment(camera_.get(), failure));
  }
  arv_camera_set_region(camera_.get(), x, y, settings_.width, settings_.height, failure);
  const bool refused = failure.happened();
  int width = 0;
  int height = 0;
  arv_camera_get_region(camera_.get(), nullptr, nullptr, &width, &height, failure);
  const bool fits = settings_.width <= sensor_width && settings_.height <= sensor_height;
  if (!fits || refused || failure.happened() || width != settings_.width || height != settings_.height) {
    return wrong("camera.width_px and height_px: it does not give " +
                 size_text(settings_.width, settings_.height) + " px, allowed: up to " +
                 size_text(sensor_width, sensor_height) + " in steps of " +
                 size_text(arv_camera_get_width_increment(camera_.get(), failure),
                           arv_camera_get_height_increment(camera_.get(), failure)));
  }
  return {};
}

Done AravisCamera::set_rate() {
  if (settings_.fps <= 0) {
    return {};
  }
  Failure failure;
  if (!arv_camera_is_frame_rate_available(camera_.get(), failure)) {
    return wrong("camera.fps: its frame rate cannot be set, allowed: 0 (as it is)");
  }
  arv_camera_set_frame_rate(camera_.get(), settings_.fps, failure);
  const bool refused = failure.happened();
  const double fps = arv_camera_get_frame_rate(camera_.get(), failure);
  constexpr double kSameRate = 5e-3;
  if (refused || failure.happened() || std::abs(fps - settings_.fps) > kSameRate * settings_.fps) {
    return wrong("camera.fps: it does not give " + number(settings_.fps) + ", nearest: " + number(fps));
  }
  return {};
}

Done AravisCamera::lock_exposure() {
  exposure_s_ = 0;
  const bool asked = settings_.exposure_s > 0;
  Failure failure;
  if (arv_camera_is_exposure_auto_available(camera_.get(), failure)) {
    arv_camera_set_exposure_time_auto(camera_.get(), ARV_AUTO_OFF, failure);
    if (failure.happened()) {
      if (asked) {
        return wrong("camera.exposure_ms: it stays automatic: " + failure.text());
      }
      notes_.push_back(title() + ": its exposure stays automatic; frames may become brighter or darker");
      return {};
    }
  }
  if (!arv_camera_is_exposure_time_available(camera_.get(), failure)) {
    if (asked) {
      return wrong("camera.exposure_ms: it cannot be set on this camera, allowed: leave it out (as it is)");
    }
    notes_.push_back(title() + ": it has no exposure to lock");
    return {};
  }
  if (asked) {
    double least_us = 0;
    double most_us = 0;
    arv_camera_get_exposure_time_bounds(camera_.get(), &least_us, &most_us, failure);
    const double wanted_us = settings_.exposure_s * 1e6;
    if (!failure.happened() && !(wanted_us >= least_us && wanted_us <= most_us)) {
      return wrong("camera.exposure_ms: is out of range, allowed: from " + number(least_us * 1e-3) + " to " +
                   number(most_us * 1e-3));
    }
    arv_camera_set_exposure_time(camera_.get(), wanted_us, failure);
    const bool refused = failure.happened();
    const double got_us = arv_camera_get_exposure_time(camera_.get(), failure);
    constexpr double kSameExposure = 0.02;  // a sensor exposes whole lines
    if (refused || failure.happened() ||
        std::abs(got_us - wanted_us) > std::max(kSameExposure * wanted_us, 50.0)) {
      return wrong("camera.exposure_ms: it does not keep what it is set to");
    }
  }
  const double exposure_us = arv_camera_get_exposure_time(camera_.get(), failure);
  exposure_s_ = failure.happened() ? 0 : exposure_us * 1e-6;
  return {};
}

Done AravisCamera::lock_gain() {
  const bool asked = settings_.gain != hal::kAsItIs;
  Failure failure;
  if (arv_camera_is_gain_auto_available(camera_.get(), failure)) {
    arv_camera_set_gain_auto(camera_.get(), ARV_AUTO_OFF, failure);
    if (failure.happened()) {
      if (asked) {
        return wrong("camera.gain: it stays automatic: " + failure.text());
      }
      notes_.push_back(title() + ": its gain stays automatic; frames may become brighter or darker");
      return {};
    }
  }
  if (!arv_camera_is_gain_available(camera_.get(), failure)) {
    if (asked) {
      return wrong("camera.gain: it cannot be set on this camera, allowed: leave it out (as it is)");
    }
    notes_.push_back(title() + ": it has no gain to lock");
    return {};
  }
  if (asked) {
    double least = 0;
    double most = 0;
    arv_camera_get_gain_bounds(camera_.get(), &least, &most, failure);
    if (!failure.happened() && !(settings_.gain >= least && settings_.gain <= most)) {
      return wrong("camera.gain: is out of range, allowed: from " + number(least) + " to " + number(most));
    }
    arv_camera_set_gain(camera_.get(), settings_.gain, failure);
    const bool refused = failure.happened();
    const double got = arv_camera_get_gain(camera_.get(), failure);
    constexpr double kSameGain = 0.5;  // whole steps
    if (refused || failure.happened() || std::abs(got - settings_.gain) > kSameGain) {
      return wrong("camera.gain: it does not keep what it is set to");
    }
  }
  return {};
}

Done AravisCamera::start_streaming() {
  Failure failure;
  if (arv_camera_is_gv_device(camera_.get())) {
    // Raw packets would need rights.
    arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  }
  stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, failure));
  if (!stream_) {
    return wrong("it does not stream: " + failure.text());
  }
  const guint payload = arv_camera_get_payload(camera_.get(), failure);
  if (failure.happened() || payload == 0) {
    return wrong("it does not say how large its pictures are: " + failure.text());
  }
  for (int i = 0; i < kBuffers; ++i) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
  }
  grey_.assign(format_.bits == 8
                   ? 0
                   : static_cast<std::size_t>(settings_.width) * static_cast<std::size_t>(settings_.height),
               0);
  arv_camera_start_acquisition(camera_.get(), failure);
  if (failure.happened()) {
    return wrong("it does not stream: " + failure.text());
  }
  if (exposure_s_ == 0 || settings_.readout_s == 0) {
    notes_.push_back(title() + ": when frames were taken is late by " +
                     (exposure_s_ == 0 ? "the exposure and " : "") +
                     "the readout and transfer of the fastest frame (camera.readout_ms)");
  }
  return {};
}

void AravisCamera::close() noexcept {
  if (camera_) {
    Failure ignored;
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &control_lost_);
    if (stream_ && !control_lost_) {
      arv_camera_stop_acquisition(camera_.get(), ignored);
    }
  }
  held_.reset();
  stream_.reset();
  camera_.reset();
}

hal::Status AravisCamera::lost(const std::string& why) {
  error_ = title() + ": " + why;
  return hal::Status::disconnected;
}

// On the station's clock. The library notes it on the wall clock.
std::int64_t AravisCamera::arrival_ns(ArvBuffer* buffer) {
  const auto then_ns = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
  const std::int64_t now_ns = clock_.now_ns();
  return now_ns - wall_clock_.ago_ns(then_ns, g_get_real_time() * 1000, now_ns);
}

AravisCamera::Taken AravisCamera::judged(Object<ArvBuffer> owned) {
  Taken taken;
  ArvBuffer* const buffer = owned.get();
  taken.buffer = std::move(owned);
  const bool complete = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
  const std::uint64_t id = arv_buffer_get_frame_id(buffer);
  const std::uint64_t missing = counted_ ? frames_between(last_id_, id) : 0;
  sequence_ += missing + 1;
  counts_.lost += missing;
  last_id_ = id;
  counted_ = true;
  taken.sequence = sequence_;

  const std::int64_t now_ns = clock_.now_ns();
  if (!complete) {
    taken.exposure_ns = now_ns;
    taken.damage = "the picture is incomplete";
    return taken;
  }
  const std::int64_t stamped_ns = camera_clock_.on_station_ns(
      static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer)), arrival_ns(buffer));
  taken.exposure_ns =
      std::min<std::int64_t>(stamped_ns - std::llround((exposure_s_ + settings_.readout_s) * 1e9), now_ns);
  std::size_t bytes = 0;
  (void)arv_buffer_get_data(buffer, &bytes);
  const std::size_t needed = static_cast<std::size_t>(settings_.width) *
                             static_cast<std::size_t>(settings_.height) * (format_.bits == 8 ? 1 : 2);
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE ||
      arv_buffer_get_image_width(buffer) != settings_.width ||
      arv_buffer_get_image_height(buffer) != settings_.height ||
      arv_buffer_get_image_pixel_format(buffer) != format_.code || bytes < needed) {
    taken.damage = "the picture has another size or format than was set";
  } else if (stamped_ns - now_ns > kMostAhead_ns) {
    taken.damage = "the picture is stamped ahead of the clock";
  } else if (taken.exposure_ns <= last_exposure_ns_) {
    taken.damage = "the picture is not stamped later than the one before";
  } else {
    last_exposure_ns_ = taken.exposure_ns;
  }
  return taken;
}

hal::Status AravisCamera::next(hal::Frame& out, std::int64_t timeout_ns) {
  give_back(std::move(held_));
  if (!stream_) {
    return hal::Status::disconnected;
  }
  error_.clear();
  Object<ArvBuffer> buffer(arv_stream_timeout_pop_buffer(
      stream_.get(), static_cast<guint64>(std::max<std::int64_t>(timeout_ns, 0) / 1000)));
  if (control_lost_) {
    give_back(std::move(buffer));
    return lost("it is gone, or another program has taken it");
  }
  if (!buffer) {
    if (clock_.now_ns() - last_frame_ns_ > kAsk_ns && !arv_camera_is_gv_device(camera_.get())) {
      last_frame_ns_ = clock_.now_ns();
      Failure failure;
      int width = 0;
      arv_camera_get_region(camera_.get(), nullptr, nullptr, &width, nullptr, failure);
      if (failure.happened()) {
        control_lost_ = true;
        return lost("it does not answer: " + failure.text());
      }
    }
    return hal::Status::no_data;
  }
  last_frame_ns_ = clock_.now_ns();
  Taken newest;
  Taken damaged;
  while (buffer) {
    Taken taken = judged(std::move(buffer));
    if (taken.damage != nullptr) {
      ++counts_.unusable;
      give_back(std::move(damaged.buffer));
      damaged = std::move(taken);
    } else {
      counts_.skipped += newest.buffer ? 1U : 0U;
      give_back(std::move(newest.buffer));
      newest = std::move(taken);
    }
    buffer.reset(arv_stream_try_pop_buffer(stream_.get()));
  }
  give_back(std::move(damaged.buffer));
  const Taken& shown = newest.buffer ? newest : damaged;
  out = {};
  out.sequence = shown.sequence;
  out.exposure_ns = shown.exposure_ns;
  out.width = settings_.width;
  out.height = settings_.height;
  if (!newest.buffer) {
    error_ = title() + ": " + damaged.damage;
    return hal::Status::fault;
  }
  ++counts_.delivered;
  std::size_t bytes = 0;
  const auto* const data = static_cast<const std::uint8_t*>(arv_buffer_get_data(newest.buffer.get(), &bytes));
  out.stride = settings_.width;
  if (format_.bits == 8) {
    out.pixels = data;
    held_ = std::move(newest.buffer);
    return hal::Status::ok;
  }
  for (std::size_t i = 0; i < grey_.size(); ++i) {
    const int value = data[2 * i] | data[2 * i + 1] << 8;
    grey_[i] = static_cast<std::uint8_t>(std::min(value >> (format_.bits - 8), 255));
  }
  out.pixels = grey_.data();
  give_back(std::move(newest.buffer));
  return hal::Status::ok;
}

void AravisCamera::release(const hal::Frame&) { give_back(std::move(held_)); }

}  // namespace
}  // namespace punctum::aravis

void punctum_list_network_cameras(std::vector<punctum::aravis::NetworkCamera>& out) {
  ArvInterface* const network = arv_gv_interface_get_instance();  // that of USB would open its cameras
  arv_interface_update_device_list(network);
  const auto text = [](const char* said) { return std::string(said == nullptr ? "" : said); };
  for (unsigned i = 0; i < arv_interface_get_n_devices(network); ++i) {
    out.push_back({text(arv_interface_get_device_id(network, i)),
                   text(arv_interface_get_device_vendor(network, i)),
                   text(arv_interface_get_device_model(network, i)),
                   text(arv_interface_get_device_serial_nbr(network, i)),
                   text(arv_interface_get_device_address(network, i))});
  }
}

punctum::hal::LiveCamera* punctum_make_aravis_camera(const punctum::aravis::AravisParams& params,
                                                     const punctum::hal::CameraSettings& settings,
                                                     const punctum::hal::Clock& clock) {
  return new punctum::aravis::AravisCamera(params, settings, clock);
}
