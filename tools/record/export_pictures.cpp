#include "tools/record/export_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/record/big_tiff.hpp"
#include "tools/record/recording_reader.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/html.hpp"
#include "tools/shared/version.hpp"
#include "tools/shared/whole_file.hpp"
#include "tools/vision/picture_file.hpp"

namespace punctum::tools {
namespace {

[[nodiscard]] bool is_whole(const v1::Picture& p) {
  return p.width() > 0 && p.height() > 0 && p.grey().size() == std::uint64_t{p.width()} * p.height();
}

// What is to be known of all pictures before the first is written.
struct PicturesOverview {
  struct One {
    std::uint64_t frame;
    std::int64_t exposure_ns;
  };
  std::vector<One> pictures;
  std::uint32_t width = 0, height = 0, longest_side = 0;
  bool one_size = true;
  std::optional<std::int64_t> start_ns;  // of the run, station clock
  std::string scene;
  std::string ends;

  void operator()(const v1::Scene& s) { scene = s.toml(); }
  void operator()(const v1::Status& s) { start_ns = s.start_ns(); }
  void operator()(const v1::Picture& p) {
    if (!is_whole(p)) {
      return;
    }
    if (pictures.empty()) {
      width = p.width();
      height = p.height();
    }
    longest_side = std::max({longest_side, p.width(), p.height()});
    one_size = one_size && p.width() == width && p.height() == height;
    pictures.push_back({p.frame(), p.exposure_ns()});
  }
  // Of the run; the first picture's, where the recording does not tell when the run began.
  [[nodiscard]] double t_s(const One& p) const {
    return 1e-9 * static_cast<double>(p.exposure_ns - start_ns.value_or(pictures.front().exposure_ns));
  }
};

tl::expected<PicturesOverview, std::string> look_over(const std::string& recording) {
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  PicturesOverview all;
  all.ends = reader->read_all(all);
  if (all.pictures.empty()) {
    return tl::unexpected(recording + ": holds no pictures; `punctum run --record --pictures` records them");
  }
  return all;
}

// Calls `take` with each picture until it says no.
template <class Take>
struct EachPicture {
  Take take;
  bool more = true;
  void operator()(const v1::Picture& p) { more = more && (!is_whole(p) || take(p)); }
};
template <class Take>
tl::expected<void, std::string> each_picture(const std::string& recording, Take take) {
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  EachPicture<Take> each{std::move(take)};
  (void)reader->read_all(each);
  return {};
}

// https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/; lengths in um, times in s, as its defaults are.
std::string ome_xml(const PicturesOverview& all, double pixel_m, const std::string& name) {
  std::string size;
  if (pixel_m > 0) {
    size = fmt::format(" PhysicalSizeX=\"{0:.9g}\" PhysicalSizeY=\"{0:.9g}\"", pixel_m * 1e6);
  }
  const char* space = "http://www.openmicroscopy.org/Schemas/OME/2016-06";
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OME xmlns=\"{0}\" "
      "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"{0} {0}/ome.xsd\" "
      "Creator=\"{1}\"><Image ID=\"Image:0\" Name=\"{2}\"><Pixels ID=\"Pixels:0\" DimensionOrder=\"XYCZT\" "
      "Type=\"uint8\" SizeX=\"{3}\" SizeY=\"{4}\" SizeC=\"1\" SizeZ=\"1\" SizeT=\"{5}\"{6}>"
      "<Channel ID=\"Channel:0:0\" SamplesPerPixel=\"1\"/><TiffData IFD=\"0\" PlaneCount=\"{5}\"/>",
      space, version_line("punctum-export"), escaped(name), all.width, all.height, all.pictures.size(), size);
  for (std::size_t i = 0; i < all.pictures.size(); ++i) {
    fmt::format_to(std::back_inserter(xml), "<Plane TheZ=\"0\" TheC=\"0\" TheT=\"{}\" DeltaT=\"{:.9f}\"/>", i,
                   all.t_s(all.pictures[i]));
  }
  return xml + "</Pixels></Image></OME>\n";
}

std::string picture_name(std::size_t i) { return fmt::format("{:06}.png", i); }

struct CloseFile {
  void operator()(std::FILE* f) const noexcept { (void)std::fclose(f); }
};

}  // namespace

tl::expected<std::string, std::string> export_png(const std::string& recording, const std::string& folder) {
  const auto all = look_over(recording);
  if (!all) {
    return tl::unexpected(all.error());
  }
  constexpr std::uint32_t kLongestSide = 1'000'000;  // of libpng
  if (all->longest_side > kLongestSide) {
    return tl::unexpected(fmt::format("{}: a picture of {} pixels along one side, allowed: {}", recording,
                                      all->longest_side, kLongestSide));
  }
  std::error_code error;
  if (is_there(folder)) {
    return tl::unexpected(folder + ": is there already; an export replaces nothing");
  }
  std::filesystem::create_directories(folder, error);
  if (error) {
    return tl::unexpected(fmt::format("{}: {}", folder, error.message()));
  }
  std::string table = "file,frame,t_s\n", why;
  std::size_t i = 0;
  const auto read = each_picture(recording, [&](const v1::Picture& p) {
    const std::string name = picture_name(i);
    fmt::format_to(std::back_inserter(table), "{},{},{:.9f}\n", name, p.frame(), all->t_s(all->pictures[i]));
    ++i;
    const auto written =
        write_picture(folder + "/" + name, cv::Mat(static_cast<int>(p.height()), static_cast<int>(p.width()),
                                                   CV_8U, const_cast<char*>(p.grey().data())));
    why = written ? "" : written.error();
    return why.empty() && i < all->pictures.size();
  });
  if (!read) {
    why = read.error();
  }
  if (why.empty()) {
    if (const auto written = write_whole(folder + "/pictures.csv", table); !written) {
      why = written.error();
    }
  }
  if (!why.empty()) {  // a folder of some of the pictures looks like one of all, and nothing would replace it
    for (std::size_t n = 0; n < i; ++n) {
      std::filesystem::remove(folder + "/" + picture_name(n), error);
    }
    std::filesystem::remove(folder, error);
    return tl::unexpected(why);
  }
  return all->ends;
}

tl::expected<std::string, std::string> export_ome_tiff(const std::string& recording,
                                                       const std::string& file) {
  const auto all = look_over(recording);
  if (!all) {
    return tl::unexpected(all.error());
  }
  if (!all->one_size) {
    return tl::unexpected(recording +
                          ": its pictures are of several sizes; an OME-TIFF has one, PNG files any");
  }
  if (is_there(file)) {
    return tl::unexpected(file + ": is there already; an export replaces nothing");
  }
  const auto part = begin_unfinished(file);
  if (!part) {
    return tl::unexpected(part.error());
  }
  std::unique_ptr<std::FILE, CloseFile> out(std::fopen(part->c_str(), "wb"));
  if (!out) {
    return tl::unexpected(fmt::format("{}: {}", file, std::strerror(errno)));
  }
  const auto scene = parse_scene(all->scene, "scene");
  const double pixel_m = scene && scene->vision ? scene->vision->pixel_m : 0;
  BigTiff tiff(out.get(), all->width, all->height, pixel_m > 0 ? 1 / pixel_m : 0,
               ome_xml(*all, pixel_m, std::filesystem::path(recording).filename().string()));
  std::size_t i = 0;
  const auto read = each_picture(recording, [&](const v1::Picture& p) {
    tiff.page(p.grey());
    return tiff.good() && ++i < all->pictures.size();
  });
  const bool good = read && tiff.good() && std::fflush(out.get()) == 0;
  const int why = errno;
  if (!good) {
    (void)std::remove(part->c_str());
    return tl::unexpected(read ? fmt::format("{}: {}", file, std::strerror(why)) : read.error());
  }
  out.reset();
  if (const auto placed = put_in_place(*part, file); !placed) {
    return tl::unexpected(placed.error());
  }
  return all->ends;
}

}  // namespace punctum::tools
