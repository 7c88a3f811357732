#include "tools/vision/surface_files.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/shared/whole_file.hpp"
#include "vision/surface/surface_grid.hpp"

namespace punctum::tools {

namespace {

using vision::GridVectors;

constexpr int kAlong = 64, kAround = 64;  // of the triangles' corners
constexpr double kUm = 1e6;

struct NamedNet {
  const char* name;
  vision::MembraneNet net;
};

std::vector<NamedNet> nets_of(const rt::CellSurface& surface) {
  std::vector<NamedNet> nets;
  for (const auto& [name, flag, membrane] :
       {std::tuple{"outer", rt::CellSurface::outer_ok, &surface.outer},
        std::tuple{"inner", rt::CellSurface::inner_ok, &surface.inner}}) {
    if (!surface.has(flag)) {
      continue;
    }
    NamedNet& named = nets.emplace_back(NamedNet{name, {}});
    named.net.ok = true;
    named.net.size = rt::MembraneSurface::kControlPoints;
    for (std::size_t i = 0; i < std::size(membrane->control_m); ++i) {
      named.net.control[i] = Eigen::Map<const vision::Section>(membrane->control_m[i]);
    }
  }
  return nets;
}

std::string json_of(const rt::CellSurface& surface, const std::vector<NamedNet>& nets) {
  std::string text = fmt::format(
      "{{\n \"format\": \"punctum surface\", \"version\": 1, \"frame\": {}, \"exposure_ns\": {}, \"unit\": "
      "\"m\",\n"
      " \"axes\": \"origin in the middle of the picture, x right, y down, z away from the observer\",\n"
      " \"order\": \"points[i * size[1] + j]: x, y, z, weight; i from the needle's pole to the far one, j "
      "round\",\n"
      " \"membranes\": [",
      surface.frame, surface.exposure_ns);
  for (std::size_t n = 0; n < nets.size(); ++n) {
    const vision::MembraneNet& net = nets[n].net;
    text += fmt::format("{}\n  {{\"name\": \"{}\", \"degree\": [3, 2], \"size\": [{}, {}],\n   \"knots\": [[",
                        n > 0 ? "," : "", nets[n].name, net.size, vision::kCirclePoints);
    for (int i = 0; i < net.size + 4; ++i) {
      text += fmt::format("{}{}", i > 0 ? "," : "", vision::cubic_knot(net.size, i));
    }
    text += "], [0,0,0,1,1,2,2,3,3,4,4,4]],\n   \"points\": [";
    for (int i = 0; i < net.size; ++i) {
      const vision::Section& c = net.control[static_cast<std::size_t>(i)];
      for (const vision::CirclePoint& p : vision::circle_points()) {
        text += fmt::format("{}[{},{},{},{}]", i > 0 || &p != vision::circle_points().data() ? ",\n    " : "",
                            c[0] + p.along * c[2], c[1] + p.along * c[3], p.across * c[4], p.weight);
      }
    }
    text += "]}";
  }
  return text + "\n ]\n}\n";
}

struct Mesh {
  std::vector<std::array<double, 3>> corner, normal;   // um; the near pole first, the far pole last
  std::vector<std::array<std::uint32_t, 3>> triangle;  // counter-clockwise from outside
};

Mesh mesh_of(const vision::MembraneNet& net) {
  const vision::SurfaceGrid grid(net.size, kAlong, kAround);
  GridVectors points, normals;
  grid.points_and_normals(net, points, normals);
  Mesh mesh;
  const auto corner = [&](std::size_t k) {
    mesh.corner.push_back({kUm * points.x[k], kUm * points.y[k], kUm * points.z[k]});
    mesh.normal.push_back({normals.x[k], normals.y[k], normals.z[k]});
  };
  constexpr std::uint32_t kRows = kAlong - 2;  // between the poles
  corner(0);
  for (std::size_t k = kAround; k < static_cast<std::size_t>(kAlong - 1) * kAround; ++k) {
    corner(k);
  }
  corner(static_cast<std::size_t>(kAlong - 1) * kAround);
  const auto at = [](std::uint32_t row, std::uint32_t j) { return 1 + row * kAround + j % kAround; };
  for (std::uint32_t j = 0; j < kAround; ++j) {
    mesh.triangle.push_back({0, at(0, j), at(0, j + 1)});
    for (std::uint32_t row = 0; row + 1 < kRows; ++row) {
      mesh.triangle.push_back({at(row, j), at(row + 1, j), at(row + 1, j + 1)});
      mesh.triangle.push_back({at(row, j), at(row + 1, j + 1), at(row, j + 1)});
    }
    mesh.triangle.push_back({at(kRows - 1, j), at(kRows, 0), at(kRows - 1, j + 1)});
  }
  return mesh;
}

void append_obj(std::string& text, const char* name, const Mesh& mesh, std::uint32_t corners_before) {
  text += fmt::format("o {}\n", name);
  for (const auto& [x, y, z] : mesh.corner) {
    text += fmt::format("v {:.6f} {:.6f} {:.6f}\n", x, y, z);
  }
  for (const auto& [x, y, z] : mesh.normal) {
    text += fmt::format("vn {:.6f} {:.6f} {:.6f}\n", x, y, z);
  }
  for (const auto& [a, b, c] : mesh.triangle) {
    const std::uint32_t first = corners_before + 1;
    text += fmt::format("f {0}//{0} {1}//{1} {2}//{2}\n", a + first, b + first, c + first);
  }
}

// Binary STL is little-endian, as every processor is that this is built for.
std::string stl_of(const char* name, const Mesh& mesh) {
  std::string bytes = fmt::format("{:<80}", fmt::format("{} membrane, micrometres", name));
  const auto append = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(static_cast<std::uint32_t>(mesh.triangle.size()));
  for (const auto& triangle : mesh.triangle) {
    using Vector = Eigen::Vector3d;
    const auto corner = [&](std::size_t i) { return Vector(mesh.corner[triangle[i]].data()); };
    const Vector normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    for (const Vector& v : {normal, corner(0), corner(1), corner(2)}) {
      append(std::array<float, 3>{static_cast<float>(v.x()), static_cast<float>(v.y()),
                                  static_cast<float>(v.z())});
    }
    append(std::uint16_t{0});
  }
  return bytes;
}

}  // namespace

std::vector<std::string> surface_files(const std::string& stem) {
  return {stem + ".json", stem + ".obj", stem + "-outer.stl", stem + "-inner.stl"};
}

tl::expected<void, std::string> write_surface(const std::string& stem, const rt::CellSurface& surface) {
  const std::vector<NamedNet> nets = nets_of(surface);
  if (nets.empty()) {
    return {};
  }
  std::vector<std::pair<std::string, std::string>> files{{stem + ".json", json_of(surface, nets)}};
  std::string obj = "# micrometres; x right, y down, z away from the observer\n";
  std::uint32_t corners = 0;
  for (const NamedNet& named : nets) {
    const Mesh mesh = mesh_of(named.net);
    append_obj(obj, named.name, mesh, corners);
    corners += static_cast<std::uint32_t>(mesh.corner.size());
    files.emplace_back(fmt::format("{}-{}.stl", stem, named.name), stl_of(named.name, mesh));
  }
  files.emplace_back(stem + ".obj", std::move(obj));
  for (const auto& [path, bytes] : files) {
    if (auto written = write_whole(path, bytes, Sync::later); !written) {
      return written;
    }
  }
  return {};
}

}  // namespace punctum::tools
