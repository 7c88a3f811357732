// Three numbers as plain data, for what lives in shared memory (Eigen's vectors are not trivially copyable).
#pragma once

#include <cstdint>
#include <type_traits>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::sim {

using hal::Quat;
using hal::Vec3;

struct Point {
  double x = 0;
  double y = 0;
  double z = 0;

  Point() = default;
  Point(double x_, double y_, double z_) : x(x_), y(y_), z(z_) {}
  template <typename Derived>
  Point(const Eigen::MatrixBase<Derived>& v)  // NOLINT(google-explicit-constructor)
      : Point(Vec3(v)) {}
  Point(const Vec3& v) : x(v.x()), y(v.y()), z(v.z()) {}  // NOLINT(google-explicit-constructor)
  operator Vec3() const { return {x, y, z}; }             // NOLINT(google-explicit-constructor)
  [[nodiscard]] Vec3 vec() const { return {x, y, z}; }
};
static_assert(std::is_trivially_copyable_v<Point>);

[[nodiscard]] constexpr std::int64_t to_ns(double seconds) NONBLOCKING {
  const double ns = seconds * 1e9;
  return static_cast<std::int64_t>(ns < 0 ? ns - 0.5 : ns + 0.5);
}

}  // namespace punctum::sim
