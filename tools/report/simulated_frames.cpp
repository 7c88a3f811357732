#include "tools/report/simulated_frames.hpp"

#include <array>
#include <cmath>

#include "hal/sim/camera/microscope.hpp"
#include "hal/sim/plant/cell.hpp"

namespace punctum::report {
namespace {

constexpr int kTicksPerFrame = 40;  // of 1 ms
constexpr double kRecoil_s = 0.25;  // after a puncture the membranes move
constexpr double kTooLong_s = 30;

}  // namespace

hal::Frame DrawnInjection::frame(std::size_t i) const {
  hal::Frame f;
  f.pixels = pixels[i].data();
  f.width = lens.width;
  f.height = lens.height;
  f.stride = lens.width;
  f.sequence = i;
  f.exposure_ns = static_cast<std::int64_t>(i) * kTicksPerFrame * 1'000'000;
  return f;
}

vision::VisionConfig DrawnInjection::config() const {
  vision::VisionConfig config;
  config.pixel_m = lens.pixel_m;
  return config;
}

SimulatedInjection simulate_injection(const InjectionPlan& plan) {
  SimulatedInjection out;
  out.lens.noise = plan.noise;
  out.cell.spread = plan.spread;
  const sim::HolderParams holder;
  sim::Microscope microscope(out.lens, out.needle, holder, plan.seed);
  const sim::Cell cell(out.cell, out.needle, holder, plan.seed, 0);
  sim::CellState state;
  const auto pixel = [&](double x_m, double y_m) {
    return vision::Point(x_m / out.lens.pixel_m + (out.lens.width - 1) / 2.0,
                         y_m / out.lens.pixel_m + (out.lens.height - 1) / 2.0);
  };
  const sim::Vec3 axis(-std::cos(plan.tilt_rad), std::sin(plan.tilt_rad), 0);
  sim::Vec3 tip = cell.centre_m(state) + sim::Vec3(0, plan.aim_m, 0) - (cell.R_m() + plan.gap_m) * axis;
  std::vector<std::array<double, 2>> outer(sim::Cell::kContour), inner(sim::Cell::kContour);
  double inside_s = -1;
  for (int tick = 0; tick * 1e-3 < kTooLong_s; ++tick) {
    const double gap = (cell.centre_m(state) - tip).dot(axis) - cell.R_m();
    const bool through = state.outer.punctured && state.inner.punctured;
    if (through) {
      inside_s = inside_s < 0 ? 0 : inside_s + 1e-3;
      if (inside_s > kRecoil_s + plan.inside_s) {
        break;
      }
    }
    const double speed = through ? 10e-6 : gap > 2e-6 ? plan.approach_m_s : plan.indentation_m_s;
    sim::TipMotion motion;
    motion.tip_begin_m = tip;
    tip += axis * speed * 1e-3;
    motion.tip_end_m = tip;
    motion.axis_begin = motion.axis_end = axis;
    const sim::CellForce truth = cell.step(state, motion, 1e-3);
    if (tick % kTicksPerFrame != 0) {
      continue;
    }

    sim::PictureScene scene;
    scene.needle = sim::NeedleInPicture{tip, axis};
    scene.holder_mouth_m = cell.holder_mouth_m();
    sim::CellInPicture shown;
    shown.outer = {outer.data(), static_cast<std::size_t>(cell.contour(state, sim::Membrane::outer, outer))};
    shown.inner = {inner.data(), static_cast<std::size_t>(cell.contour(state, sim::Membrane::inner, inner))};
    shown.centre_m = cell.centre_m(state);
    shown.zona_h_m = out.cell.zona_h_m;
    scene.cell = shown;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(out.lens.width * out.lens.height));
    microscope.render(scene, out.pixels.size(), pixels);
    out.pixels.push_back(std::move(pixels));

    FrameTruth t;
    const bool broken = state.outer.punctured;
    t.stretch = !broken ? (state.contact ? Stretch::indentation : Stretch::approach)
                : !through || inside_s < kRecoil_s ? Stretch::recoil
                                                   : Stretch::inside;
    for (const auto& [x, y] : shown.outer) {
      t.outer.push_back(pixel(x, y));
    }
    for (const auto& [x, y] : shown.inner) {
      t.inner.push_back(pixel(x, y));
    }
    t.tip = pixel(tip.x(), tip.y());
    t.axis = {axis.x(), axis.y()};
    t.centre = pixel(shown.centre_m.x(), shown.centre_m.y());
    t.wd_m = truth.wd_m;
    t.a_m = truth.a_m;
    t.R_m = cell.R_m();
    t.holder = pixel(cell.holder_mouth_m().x(), cell.holder_mouth_m().y());
    out.truth.push_back(std::move(t));
  }
  return out;
}

}  // namespace punctum::report
