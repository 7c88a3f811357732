#include "hal/sim/camera/sim_camera.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "hal/sim/waiting.hpp"

namespace punctum::sim {
namespace {

// Calls each(pixel, random bits) for every pixel.
template <typename Each>
void at_random(std::uint64_t seed, std::span<std::uint8_t> pixels, Each each) noexcept {
  std::uint64_t state = seed * 0x9e3779b97f4a7c15ULL + 1;
  for (std::uint8_t& pixel : pixels) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    each(pixel, static_cast<std::uint32_t>(state >> 32));
  }
}

// What a broken line delivers: every grey equally likely.
void fill_with_noise(std::uint64_t seed, std::span<std::uint8_t> out) noexcept {
  at_random(seed, out,
            [](std::uint8_t& pixel, std::uint32_t bits) { pixel = static_cast<std::uint8_t>(bits); });
}

void add_noise(std::uint64_t seed, int most, std::span<std::uint8_t> out) noexcept {
  const auto span = static_cast<std::uint32_t>(2 * most + 1);
  at_random(seed, out, [&](std::uint8_t& pixel, std::uint32_t bits) {
    pixel = static_cast<std::uint8_t>(std::clamp(pixel + static_cast<int>(bits % span) - most, 0, 255));
  });
}

}  // namespace

SimCamera::SimCamera(const SimConfig& config, const Bench& bench, CameraAnswers& answers, Picture picture)
    : config_(config),
      params_(config.microscope.value_or(MicroscopeParams{})),
      picture_(picture),
      taker_(bench, answers) {
  if (config_.cell) {
    cell_.emplace(*config_.cell, config_.needle, config_.holder, config_.seed, 0);
    outer_.resize(Cell::kContour);
    inner_.resize(Cell::kContour);
  }
  if (picture_ == Picture::drawn) {
    microscope_.emplace(params_, config_.needle, config_.holder, config_.seed);
    pixels_.resize(static_cast<std::size_t>(microscope_->width()) *
                   static_cast<std::size_t>(microscope_->height()));
  }
  taker_.attach();
}

hal::Status SimCamera::next(hal::Frame& out, std::int64_t timeout_ns) {
  const std::int64_t give_up_ns = real_now_ns() + std::max<std::int64_t>(timeout_ns, 0);
  const std::size_t late_by = static_cast<std::size_t>(std::ceil(kDelay_s * std::max(params_.fps, 1.0)));
  for (;;) {
    Exposure exposure;
    const hal::Status status = taker_.next(exposure, std::max<std::int64_t>(give_up_ns - real_now_ns(), 0));
    if (status != hal::Status::ok) {
      return status;
    }

    const Failure failure = exposure.world.failure[static_cast<std::size_t>(Device::camera)].kind;
    if (failure != Failure::delay) {
      late_.clear();
    }
    if (failure == Failure::disconnect) {
      taker_.release();
      return hal::Status::disconnected;
    }
    if (failure == Failure::delay) {
      late_.push_back(exposure);
      if (late_.size() <= late_by) {
        taker_.release();
        continue;
      }
      // Delivered in the turn of the newest, which is what the clock waits for.
      late_.front().deliver_ns = exposure.deliver_ns;
      exposure = late_.front();
      late_.pop_front();
    }
    if (failure == Failure::drop) {
      taker_.release();
      continue;
    }

    out = {};
    out.width = params_.width;
    out.height = params_.height;
    out.stride = params_.width;
    out.sequence = exposure.frame;
    out.exposure_ns = exposure.exposure_ns;
    out.deliver_ns = exposure.deliver_ns;
    const bool unusable = failure == Failure::nan || failure == Failure::saturate;
    if (failure != Failure::freeze || !seen_any_) {
      look_at(exposure);
      seen_any_ = true;
      if (microscope_ && !unusable) {
        draw();
      }
    }
    if (!microscope_) {
      if (unusable) {
        taker_.release();
      }
      return unusable ? hal::Status::fault : hal::Status::ok;
    }
    if (failure == Failure::nan) {
      fill_with_noise(config_.seed ^ exposure.frame, pixels_);
    }
    if (failure == Failure::noise) {
      add_noise(config_.seed ^ exposure.frame, kInterference_grey, pixels_);
    }
    if (failure == Failure::saturate) {
      std::fill(pixels_.begin(), pixels_.end(), std::uint8_t{255});
    }
    out.pixels = pixels_.data();
    return hal::Status::ok;
  }
}

void SimCamera::release(const hal::Frame&) { taker_.release(); }

void SimCamera::look_at(const Exposure& exposure) {
  shown_ = exposure;
  const Snapshot& world = shown_.world;
  truth_ = truth_of(config_, world);
  outer_count_ = 0;
  inner_count_ = 0;
  if (!cell_ || world.has_cell == 0) {
    return;
  }
  if (world.cell_index != cell_index_) {
    cell_index_ = world.cell_index;
    cell_->renew(config_.seed, static_cast<int>(cell_index_));
  }
  outer_count_ = static_cast<std::size_t>(cell_->contour(world.cell, Membrane::outer, outer_));
  inner_count_ = static_cast<std::size_t>(cell_->contour(world.cell, Membrane::inner, inner_));
}

void SimCamera::draw() {
  PictureScene scene;
  scene.needle = NeedleInPicture{truth_.tip_m, truth_.axis};
  scene.holder_mouth_m = truth_.holder_mouth_m;
  if (outer_count_ > 0) {
    CellInPicture& cell = scene.cell.emplace();
    cell.outer = outer();
    cell.inner = inner();
    cell.centre_m = truth_.centre_m;
    cell.zona_h_m = config_.cell->zona_h_m;
    cell.identity = cell_index_;
  }
  microscope_->render(scene, shown_.frame, pixels_);
}

}  // namespace punctum::sim
