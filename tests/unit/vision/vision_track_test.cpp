// punctum-vision track: its input files, its output files, and its messages about bad ones.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tools/scene/scene.hpp"
#include "tools/vision/track.hpp"

namespace {

namespace fs = std::filesystem;
using punctum::tools::track;
using punctum::tools::TrackOptions;

class Track : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("punctum-track-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "frames");
    options_.frames = (folder_ / "frames").string();
    options_.scene = "outer-only";
    options_.out = (folder_ / "obs.csv").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  // A dark disc of radius 70 px; file f<number>.png.
  void frame(int number, double x = 150, double y = 120) const {
    cv::Mat m(240, 320, CV_8U, cv::Scalar(150));
    cv::circle(m, cv::Point(static_cast<int>(x * 16), static_cast<int>(y * 16)), 70 * 16, cv::Scalar(105),
               cv::FILLED, cv::LINE_AA, 4);
    cv::GaussianBlur(m, m, cv::Size(0, 0), 1.2);
    cv::imwrite(name(number), m);
  }
  [[nodiscard]] std::string name(int number) const {
    return (folder_ / "frames" / ("f" + std::to_string(number) + ".png")).string();
  }
  [[nodiscard]] static std::vector<std::vector<std::string>> table(const std::string& path) {
    std::ifstream in(path);
    std::vector<std::vector<std::string>> rows;
    for (std::string line; std::getline(in, line);) {
      std::vector<std::string> cells(1);
      for (const char c : line) {
        if (c == ',') {
          cells.emplace_back();
        } else {
          cells.back() += c;
        }
      }
      rows.push_back(std::move(cells));
    }
    return rows;
  }
  fs::path folder_;
  TrackOptions options_;
};

TEST_F(Track, writes_one_row_per_frame_in_natural_order_and_contours_of_at_least128_nodes) {
  for (const int k : {1, 2, 3, 10, 11}) {
    frame(k, 150 + 0.3 * k);
  }
  options_.contours = (folder_ / "contours.csv").string();
  options_.deviations = (folder_ / "deviations.csv").string();
  options_.overlay = (folder_ / "overlay").string();
  options_.fps = 10;
  ASSERT_EQ(track(options_), 0);
  const auto rows = table(options_.out);
  ASSERT_EQ(rows.size(), 6u);
  const std::string head =
      "frame,t_s,phase,contact,punctured,holder_x_px,holder_y_px,holder_score,tip_x_px,tip_y_px,outer_ok,"
      "inner_ok,wd_um,"
      "a_um,R_um,force_N,total_us,verdict";
  std::string first;
  for (std::size_t i = 0; i < 18; ++i) {
    first += (i > 0 ? "," : "") + rows[0][i];
  }
  EXPECT_EQ(first, head);
  for (std::size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), rows[0].size());
    EXPECT_EQ(rows[i][0], std::to_string(i - 1));
    EXPECT_NEAR(std::stod(rows[i][1]), 0.1 * static_cast<double>(i - 1), 1e-9);
    EXPECT_EQ(rows[i][10], "1") << rows[i][17];
    EXPECT_EQ(rows[i][8], "");                               // no needle: unknown, not 0
    EXPECT_NEAR(std::stod(rows[i][14]), 70.5 * 0.825, 0.3);  // OpenCV draws half a pixel wide
  }
  const auto nodes = table(options_.contours);
  EXPECT_EQ(nodes[0], (std::vector<std::string>{"frame", "membrane", "node", "x_px", "y_px"}));
  int of_last = 0;
  for (const auto& r : nodes) {
    if (r[0] == "4") {
      ++of_last;
      EXPECT_EQ(r[1], "outer");
      EXPECT_NEAR(std::hypot(std::stod(r[3]) - 153.3, std::stod(r[4]) - 120), 70.5, 0.7);
    }
  }
  EXPECT_GE(of_last, 128);
  const auto deviations = table(options_.deviations);
  EXPECT_EQ(deviations[0], (std::vector<std::string>{"frame", "membrane", "node", "sd_px"}));
  ASSERT_EQ(deviations.size(), nodes.size());
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    for (const std::size_t column : {0, 1, 2}) {
      EXPECT_EQ(deviations[i][column], nodes[i][column]);
    }
    EXPECT_GT(std::stod(deviations[i][3]), 0);
    EXPECT_LT(std::stod(deviations[i][3]), 1);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(options_.overlay), fs::directory_iterator()), 5);
}

// Read back as foreign programs read them.
TEST_F(Track, writes_the_surface_as_control_net_and_as_closed_meshes) {
  frame(7);
  options_.surface = (folder_ / "surface").string();
  ASSERT_EQ(track(options_), 0);
  const std::string stem = options_.surface + "/000000_f7";
  const double R_um = 70.5 * 0.825;
  const double middle_um[2] = {(150 - 159.5) * 0.825, (120 - 119.5) * 0.825};

  std::ifstream json_file(stem + ".json");
  const auto json = nlohmann::json::parse(json_file);
  ASSERT_EQ(json["membranes"].size(), 1U);  // the scene has no inner one
  const auto& net = json["membranes"][0];
  EXPECT_EQ(net["name"], "outer");
  const std::size_t along = net["size"][0], round = net["size"][1];
  ASSERT_EQ(net["points"].size(), along * round);
  EXPECT_EQ(net["knots"][0].size(), along + 4);
  EXPECT_EQ(net["knots"][1].size(), round + 3);
  for (const std::size_t pole : {std::size_t{0}, along - 1}) {
    const auto& p = net["points"][pole * round];
    EXPECT_NEAR(std::hypot(1e6 * p[0].get<double>() - middle_um[0], 1e6 * p[1].get<double>() - middle_um[1]),
                R_um, 0.3);
  }

  std::ifstream obj_file(stem + ".obj");
  std::vector<std::array<double, 3>> corner, normal;
  std::map<std::pair<int, int>, int> edges;
  double volume = 0;
  for (std::string word, line; std::getline(obj_file, line);) {
    std::istringstream in(line);
    in >> word;
    if (word == "v" || word == "vn") {
      auto& v = (word == "v" ? corner : normal).emplace_back();
      in >> v[0] >> v[1] >> v[2];
    } else if (word == "f") {
      std::array<int, 3> c{};
      for (int& i : c) {
        in >> word;
        i = std::stoi(word) - 1;
      }
      for (int k = 0; k < 3; ++k) {
        ++edges[{c[static_cast<std::size_t>(k)], c[static_cast<std::size_t>((k + 1) % 3)]}];
      }
      const auto &p = corner.at(static_cast<std::size_t>(c[0])),
                 &q = corner.at(static_cast<std::size_t>(c[1])),
                 &r = corner.at(static_cast<std::size_t>(c[2]));
      volume += (p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
                 p[2] * (q[0] * r[1] - q[1] * r[0])) /
                6;
    }
  }
  ASSERT_EQ(corner.size(), normal.size());
  for (const auto& [edge, times] : edges) {  // closed, and every triangle turns the same way
    EXPECT_EQ(times, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_NEAR(volume / (4.0 / 3 * std::numbers::pi * R_um * R_um * R_um), 1, 0.02);  // outwards

  const std::uintmax_t triangles = edges.size() / 3;
  EXPECT_EQ(fs::file_size(stem + "-outer.stl"), 84 + 50 * triangles);
  EXPECT_FALSE(fs::exists(stem + "-inner.stl"));
}

TEST_F(Track, gives_a_row_with_a_verdict_for_an_unreadable_frame_or_one_of_another_size) {
  frame(1);
  cv::imwrite(name(2), cv::Mat(100, 100, CV_8U, cv::Scalar(3)));
  std::ofstream(name(3)) << "this is no picture";
  std::ofstream(name(4)).close();
  frame(5);
  ASSERT_EQ(track(options_), 0);
  const auto rows = table(options_.out);
  ASSERT_EQ(rows.size(), 6u);
  for (const std::size_t bad : {2u, 3u, 4u}) {
    EXPECT_EQ(rows[bad][10], "0");
    EXPECT_FALSE(rows[bad][17].empty());
    EXPECT_EQ(rows[bad].size(), rows[0].size());
  }
  EXPECT_EQ(rows[5][10], "1");
}

// As after one that cannot be read, which no tracker sees.
TEST_F(Track, goes_on_after_a_broken_picture_with_what_it_knew) {
  for (const int k : {1, 2, 3, 5, 6}) {
    frame(k, 150 + 0.3 * k);
  }
  cv::Mat broken(240, 320, CV_8U);
  const auto rows_after = [&] {
    testing::internal::CaptureStderr();
    EXPECT_EQ(track(options_), 0);
    const bool told =
        testing::internal::GetCapturedStderr().find("what was learnt of it holds") != std::string::npos;
    auto rows = table(options_.out);
    for (auto& row : rows) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        if (rows[0][i].ends_with("_us") && &row != rows.data()) {
          row[i].clear();
        }
      }
    }
    rows.erase(rows.begin() + 4);
    return std::pair(rows, told);
  };
  std::ofstream(name(4)) << "no picture";
  const auto [unread, told_of_none] = rows_after();
  EXPECT_FALSE(told_of_none);
  ASSERT_EQ(unread.size(), 6u);
  for (const bool black : {false, true}) {
    broken.setTo(0);
    if (!black) {
      cv::randu(broken, 0, 256);
    }
    cv::imwrite(name(4), broken);
    const auto [broken_between, told] = rows_after();
    EXPECT_TRUE(told);
    EXPECT_EQ(broken_between, unread) << (black ? "black" : "noise");
  }
}

TEST_F(Track, exits_with_two_for_no_frame_a_bad_first_frame_or_a_bad_scene) {
  EXPECT_EQ(track(options_), 2);  // an empty folder
  std::ofstream(name(1)) << "this is no picture";
  frame(2);
  EXPECT_EQ(track(options_), 2);
  fs::remove(name(1));
  EXPECT_EQ(track(options_), 0);
  options_.scene = "no-such-scene";
  EXPECT_EQ(track(options_), 2);
  options_.scene = "free";  // nothing to look for
  EXPECT_EQ(track(options_), 2);
  options_.scene = "outer-only";
  options_.out = (folder_ / "no" / "such" / "folder" / "obs.csv").string();
  EXPECT_EQ(track(options_), 2);
}

TEST_F(Track, takes_region_and_seed_circle_in_pixels_of_the_whole_picture) {
  frame(1);
  options_.roi = {60, 30, 200, 190};
  options_.seed_circle = {148.0, 122.0, 68.0};
  options_.contours = (folder_ / "contours.csv").string();
  ASSERT_EQ(track(options_), 0);
  double x = 0, y = 0;
  int n = 0;
  for (const auto& r : table(options_.contours)) {
    if (r[1] == "outer") {
      x += std::stod(r[3]);
      y += std::stod(r[4]);
      ++n;
    }
  }
  ASSERT_GE(n, 128);
  EXPECT_NEAR(x / n, 150, 0.5);
  EXPECT_NEAR(y / n, 120, 0.5);
  options_.roi = {200, 100, 200, 200};
  EXPECT_EQ(track(options_), 2);
  options_.roi = {0, 0, 5, 5};
  EXPECT_EQ(track(options_), 2);
  options_.roi.reset();
  options_.seed_circle = {148.0, 122.0, -3.0};
  EXPECT_EQ(track(options_), 2);
}

TEST_F(Track, exits_with_two_for_a_missing_or_too_large_template) {
  frame(1);
  options_.scene = "icsi";
  options_.holder_template = (folder_ / "none.png").string();
  EXPECT_EQ(track(options_), 2);
  options_.holder_template = (folder_ / "large.png").string();
  cv::imwrite(options_.holder_template, cv::Mat(400, 400, CV_8U, cv::Scalar(3)));
  EXPECT_EQ(track(options_), 2);
}

TEST_F(Track, reports_a_table_that_cannot_be_written) {
  for (int i = 0; i < 3; ++i) {
    frame(i);
  }
  options_.out = "/dev/full";
  testing::internal::CaptureStderr();
  EXPECT_EQ(track(options_), 1);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("/dev/full: not complete"), std::string::npos);
  options_.out = (folder_ / "obs.csv").string();
  options_.contours = "/dev/full";
  EXPECT_EQ(track(options_), 1);
}

TEST_F(Track, an_overlay_or_a_surface_that_cannot_be_written_is_not_done) {
  frame(1);
  const std::string there = (folder_ / "there").string();
  fs::create_directories(there + "/000000_f1.png/in_its_way");
  fs::create_directories(there + "/000000_f1.json/in_its_way");
  options_.overlay = there;
  testing::internal::CaptureStderr();
  EXPECT_EQ(track(options_), 1);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("going on without overlays"), std::string::npos);
  options_.overlay = "";
  options_.surface = there;
  testing::internal::CaptureStderr();
  EXPECT_EQ(track(options_), 1);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("going on without surfaces"), std::string::npos);
  EXPECT_EQ(table(options_.out).size(), 2U) << "the row is there";
}

TEST_F(Track, refuses_an_output_that_is_an_input_or_another_output) {
  frame(1);
  frame(2);
  const std::string scene = (folder_ / "mine.toml").string();
  std::ofstream(scene) << punctum::tools::to_toml(*punctum::tools::load_scene("outer-only"));
  std::ofstream(folder_ / "poses.csv") << "t_s,tip_x_m,tip_y_m\n0,0,0\n";
  fs::create_symlink(name(2), folder_ / "link.csv");
  const auto refused = [this, options = options_](auto change, const std::string& words) {
    options_ = options;
    change(options_);
    testing::internal::CaptureStderr();
    EXPECT_EQ(track(options_), 2);
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  const std::string frames = ": is the file of --frames, allowed: another one\n";
  refused([this](TrackOptions& o) { o.out = name(1); }, "--out " + name(1) + frames);
  refused([this](TrackOptions& o) { o.contours = (folder_ / "link.csv").string(); }, "link.csv" + frames);
  refused([&scene](TrackOptions& o) { o.scene = o.deviations = scene; }, ": is the file of --scene,");
  refused([this](TrackOptions& o) { o.poses = o.contours = (folder_ / "poses.csv").string(); },
          ": is the file of --poses,");
  refused([](TrackOptions& o) { o.contours = o.out; }, ": is the file of --out,");
  refused([this](TrackOptions& o) { o.overlay = (folder_ / "frames" / ".").string(); },
          ": is the folder of --frames, allowed: another one\n");
  refused(
      [this](TrackOptions& o) {
        o.frames = name(1);
        o.overlay = (folder_ / "frames").string();
      },
      ": is the folder of --frames, allowed: another one\n");
  refused(
      [this](TrackOptions& o) {
        o.poses = (folder_ / "pipe").string();
        ASSERT_EQ(mkfifo(o.poses.c_str(), 0600), 0);
      },
      "pipe: not a file\n");
  refused([](TrackOptions& o) { o.poses = "/dev/zero"; }, "/dev/zero: not a file\n");
  refused([this](TrackOptions& o) { o.out = (folder_ / "pipe").string(); },
          "pipe: cannot be written: nobody reads it\n");
  EXPECT_FALSE(fs::exists(folder_ / "obs.csv"));
  EXPECT_GT(fs::file_size(name(1)), 100U);
  options_.contours = options_.overlay = "";
  options_.contours = options_.deviations = "/dev/null";
  options_.out = (folder_ / "frames" / "obs.csv").string();
  options_.poses = "";
  EXPECT_EQ(track(options_), 0) << "beside the frames, and twice to nowhere";
}

TEST_F(Track, refuses_a_seed_circle_outside_the_picture) {
  frame(0);
  options_.seed_circle = {-1000.0, 120.0, 70.0};
  EXPECT_EQ(track(options_), 2);
}

}  // namespace
