// The simulated camera: takes exposures from the bench and draws what the microscope shows of them.
//
// In real time the newest exposure (older ones are gaps in the sequence), in virtual time each one in its
// turn; the clock of the core waits for release(). A camera that died and was started again goes on with the
// next exposure. Failures of Device::camera:
//   freeze      the same picture again and again, with fresh numbers and times
//   drop        no picture arrives
//   delay       pictures arrive kDelay_s late, with the number and time of their exposure
//   nan         noise in place of a picture
//   disconnect  next() says so
//   saturate    a white picture
//   noise       kInterference_grey more on every pixel, up or down; the truth has none
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "hal/devices.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/camera/microscope.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/plant/cell.hpp"
#include "hal/sim/truth.hpp"

namespace punctum::sim {

class SimCamera final : public hal::Camera {
 public:
  static constexpr double kDelay_s = 0.25;
  static constexpr int kInterference_grey = 60;  // at most, every value equally likely

  enum class Picture : std::uint8_t {
    drawn,
    none,  // for the observer that reads the truth: no pixels; noise and white are a `fault`
  };

  // Ready when it returns: solves the cell's tables (up to a second or so), then attaches to the bench.
  SimCamera(const SimConfig& config, const Bench& bench, CameraAnswers& answers,
            Picture picture = Picture::drawn);

  [[nodiscard]] hal::Status next(hal::Frame& out, std::int64_t timeout_ns) override;
  void release(const hal::Frame& frame) override;

  // What the last frame shows, or would show if it were not noise or white. Valid after next() gave ok or
  // fault.
  [[nodiscard]] const Truth& truth() const noexcept { return truth_; }
  [[nodiscard]] const Snapshot& snapshot() const noexcept { return shown_.world; }
  // Closed contours of truth, world frame; empty where the membrane does not exist.
  [[nodiscard]] std::span<const std::array<double, 2>> outer() const noexcept {
    return {outer_.data(), outer_count_};
  }
  [[nodiscard]] std::span<const std::array<double, 2>> inner() const noexcept {
    return {inner_.data(), inner_count_};
  }
  [[nodiscard]] int width() const noexcept { return params_.width; }
  [[nodiscard]] int height() const noexcept { return params_.height; }

 private:
  void look_at(const Exposure& exposure);
  void draw();

  SimConfig config_;
  MicroscopeParams params_;
  Picture picture_;
  ExposureTaker taker_;
  std::optional<Microscope> microscope_;
  std::optional<Cell> cell_;
  std::uint64_t cell_index_ = 0;

  Exposure shown_;
  bool seen_any_ = false;
  std::deque<Exposure> late_;
  Truth truth_;
  std::vector<std::array<double, 2>> outer_, inner_;
  std::size_t outer_count_ = 0, inner_count_ = 0;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace punctum::sim
