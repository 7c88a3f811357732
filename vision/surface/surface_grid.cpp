#include "vision/surface/surface_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

namespace {

void resize(GridVectors& v, std::size_t size) {
  v.x.resize(size);
  v.y.resize(size);
  v.z.resize(size);
}

// The circle of a section: its middle, and what goes with the cosine and the sine of the angle about the
// axis.
void circle(const Section& section, const double* cosine, const double* sine, std::size_t around, double* x,
            double* y, double* z) {
  const double mx = section[0], my = section[1], rx = section[2], ry = section[3], depth = section[4];
  for (std::size_t j = 0; j < around; ++j) {
    x[j] = mx + rx * cosine[j];
    y[j] = my + ry * cosine[j];
    z[j] = depth * sine[j];
  }
}

// The product of the tangent along the meridian, given by the section's slope, and that of the circle.
void normals_of(const Section& slope, const Section& section, const double* cosine, const double* sine,
                std::size_t around, double* x, double* y, double* z) {
  const double mx = slope[0], my = slope[1], rx = slope[2], ry = slope[3], depth = slope[4];
  const double cx = section[2], cy = section[3], cz = section[4];
  for (std::size_t j = 0; j < around; ++j) {
    const double px = mx + rx * cosine[j], py = my + ry * cosine[j], pz = depth * sine[j];
    const double tx = -cx * sine[j], ty = -cy * sine[j], tz = cz * cosine[j];
    const double nx = py * tz - pz * ty, ny = pz * tx - px * tz, nz = px * ty - py * tx;
    const double scale = 1 / std::sqrt(nx * nx + ny * ny + nz * nz);
    x[j] = nx * scale;
    y[j] = ny * scale;
    z[j] = nz * scale;
  }
}

}  // namespace

SurfaceGrid::SurfaceGrid(int control_points, int along, int around) {
  along = std::max(along, 2);
  for (int i = 0; i < along; ++i) {
    rows_.push_back(cubic_basis(control_points, static_cast<double>(i) / (along - 1)));
  }
  for (int j = 0; j < around; ++j) {
    const math::SinCos angle = math::sin_cos(2 * std::numbers::pi * j / around);
    cosine_.push_back(angle.cos);
    sine_.push_back(angle.sin);
  }
}

void SurfaceGrid::points(const MembraneNet& net, GridVectors& points) const {
  const std::size_t around = cosine_.size();
  resize(points, rows_.size() * around);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const std::size_t begin = i * around;
    circle(weighted(net, rows_[i].first, rows_[i].value), cosine_.data(), sine_.data(), around,
           &points.x[begin], &points.y[begin], &points.z[begin]);
  }
}

void SurfaceGrid::points_and_normals(const MembraneNet& net, GridVectors& points,
                                     GridVectors& normals) const {
  const std::size_t around = cosine_.size(), last = rows_.size() - 1;
  resize(points, rows_.size() * around);
  resize(normals, rows_.size() * around);
  for (std::size_t i = 0; i <= last; ++i) {
    const std::size_t begin = i * around;
    Section section = weighted(net, rows_[i].first, rows_[i].value);
    const Section slope = weighted(net, rows_[i].first, rows_[i].slope);
    circle(section, cosine_.data(), sine_.data(), around, &points.x[begin], &points.y[begin],
           &points.z[begin]);
    // At a pole the circle is a point; the circles beside it tell the directions of its tangents.
    if (i == 0) {
      section = slope;
    } else if (i == last) {
      section = -slope;
    }
    normals_of(slope, section, cosine_.data(), sine_.data(), around, &normals.x[begin], &normals.y[begin],
               &normals.z[begin]);
  }
}

}  // namespace punctum::vision
