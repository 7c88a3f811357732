// Recorded pictures: their order and depth, and the messages about damaged files. The files are written here
// by the library's encoders; the pixels to which they must decode are known.
#include "hal/recorded/recorded_camera.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "hal/recorded/picture.hpp"

namespace recorded = punctum::recorded;
namespace hal = punctum::hal;
namespace fs = std::filesystem;

namespace {

using Bytes = std::vector<std::uint8_t>;

class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "punctum-recorded-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder = pattern;
  }
  void TearDown() override { fs::remove_all(folder); }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder / name).string(); }
  void write(const std::string& name, const Bytes& bytes) const {
    std::ofstream(path(name), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  fs::path folder;
};

// A picture with structure, so that its files have some length.
cv::Mat disc(int width, int height, int seed = 0) {
  cv::Mat m(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double r = std::hypot(x - width / 2.0, y - height / 2.0);
      m.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(120 + 60 * std::cos(r / 3 + seed) + (x * 7 + y * 13) % 11);
    }
  }
  return m;
}

Bytes encoded(const cv::Mat& m, const std::string& ending, const std::vector<int>& how = {}) {
  Bytes out;
  cv::imencode(ending, m, out, how);
  return out;
}

bool one_line(const std::string& text) { return !text.empty() && text.find('\n') == std::string::npos; }

TEST(NaturalOrder, orders_numbers_in_names_by_value) {
  std::vector<std::string> names{"b1", "a10",     "a2",    "a", "a02", "a2b", "a1", "a9999999999999999999999",
                                 "A3", "a10.png", "a9.png"};
  std::sort(names.begin(), names.end(), recorded::natural_less);
  EXPECT_EQ(names, (std::vector<std::string>{"A3", "a", "a1", "a02", "a2", "a2b", "a9.png", "a10", "a10.png",
                                             "a9999999999999999999999", "b1"}));
}

TEST(NaturalOrder, is_a_strict_weak_order) {
  std::mt19937 random(1);
  std::vector<std::string> names;
  for (int i = 0; i < 60; ++i) {
    std::string s;
    for (auto k = random() % 6; k > 0; --k) {
      s += "001239ab"[random() % 8];
    }
    names.push_back(s);
  }
  for (const auto& a : names) {
    EXPECT_FALSE(recorded::natural_less(a, a));
    for (const auto& b : names) {
      EXPECT_NE(a == b, recorded::natural_less(a, b) || recorded::natural_less(b, a)) << a << " " << b;
      for (const auto& c : names) {
        if (recorded::natural_less(a, b) && recorded::natural_less(b, c)) {
          EXPECT_TRUE(recorded::natural_less(a, c)) << a << " " << b << " " << c;
        }
      }
    }
  }
}

TEST_F(Recorded, a_folder_plays_in_natural_order_at_its_rate) {
  for (const int i : {10, 9, 1, 2, 11}) {
    write("frame" + std::to_string(i) + ".png", encoded(cv::Mat(4, 6, CV_8UC1, cv::Scalar(i)), ".png"));
  }
  write("notes.txt", {'x'});
  fs::create_directory(folder / "sub.png");
  auto camera = recorded::Camera::open(folder.string(), 20);
  ASSERT_TRUE(camera) << camera.error();
  EXPECT_EQ(camera->count(), 5);
  EXPECT_EQ(camera->width(), 6);
  EXPECT_EQ(camera->height(), 4);
  EXPECT_EQ(camera->fps(), 20);
  hal::Frame frame;
  std::uint64_t sequence = 0;
  for (const int i : {1, 2, 9, 10, 11}) {
    ASSERT_EQ(camera->next(frame, 0), hal::Status::ok);
    EXPECT_EQ(frame.pixels[5], i);
    EXPECT_EQ(frame.sequence, sequence);
    EXPECT_EQ(frame.exposure_ns, static_cast<std::int64_t>(sequence) * 50'000'000);
    EXPECT_EQ(frame.width, 6);
    EXPECT_EQ(frame.height, 4);
    EXPECT_EQ(fs::path(camera->name()).filename(), "frame" + std::to_string(i) + ".png");
    camera->release(frame);
    ++sequence;
  }
  EXPECT_EQ(camera->next(frame, 0), hal::Status::disconnected);
  EXPECT_EQ(camera->next(frame, 0), hal::Status::disconnected);
}

TEST_F(Recorded, a_glob_plays_the_files_that_match) {
  write("a_img.png", encoded(disc(9, 9), ".png"));
  write("a_label.png", encoded(disc(9, 9), ".png"));
  write("b_img.png", encoded(disc(9, 9), ".png"));
  const auto camera = recorded::Camera::open(path("*_img.png"));
  ASSERT_TRUE(camera) << camera.error();
  EXPECT_EQ(camera->count(), 2);
  EXPECT_EQ(camera->fps(), 25);
}

TEST_F(Recorded, sixteen_bits_and_colour_become_eight_bits_of_grey) {
  cv::Mat deep(1, 4, CV_16UC1);
  for (int i = 0; i < 4; ++i) {
    deep.at<std::uint16_t>(0, i) = static_cast<std::uint16_t>(i * 0x5155);
  }
  auto picture = recorded::decode(encoded(deep, ".png"));
  ASSERT_TRUE(picture) << picture.error();
  EXPECT_EQ(picture->bits, 16);
  EXPECT_EQ(picture->pixels, (Bytes{0x00, 0x51, 0xa2, 0xf3}));

  cv::Mat twelve(1, 3, CV_16UC1);  // a 12-bit camera's pictures would be black by the high byte
  twelve.at<std::uint16_t>(0, 0) = 0x123;
  twelve.at<std::uint16_t>(0, 1) = 0x800;
  twelve.at<std::uint16_t>(0, 2) = 0xfff;
  for (const char* ending : {".png", ".tif", ".pgm"}) {
    picture = recorded::decode(encoded(twelve, ending));
    ASSERT_TRUE(picture) << ending << picture.error();
    EXPECT_EQ(picture->bits, 12) << ending;
    EXPECT_EQ(picture->pixels, (Bytes{0x12, 0x80, 0xff})) << ending;
  }

  const cv::Mat colour(2, 2, CV_8UC3, cv::Scalar(10, 200, 90));  // blue, green, red
  picture = recorded::decode(encoded(colour, ".png"));
  ASSERT_TRUE(picture) << picture.error();
  EXPECT_NEAR(picture->pixels[0], 0.114 * 10 + 0.587 * 200 + 0.299 * 90, 1);
}

TEST_F(Recorded, later_pictures_are_scaled_in_the_same_way_as_the_first) {
  write("1.png", encoded(cv::Mat(2, 2, CV_16UC1, cv::Scalar(0x0f00)), ".png"));  // 12 bits
  write("2.png", encoded(cv::Mat(2, 2, CV_16UC1, cv::Scalar(0x00f0)), ".png"));  // 8 bits would hold it
  write("3.png", encoded(cv::Mat(2, 2, CV_16UC1, cv::Scalar(0xf000)), ".png"));  // brighter than 12 bits
  auto camera = recorded::Camera::open(folder.string());
  ASSERT_TRUE(camera) << camera.error();
  hal::Frame frame;
  for (const int grey : {0xf0, 0x0f, 0xff}) {
    ASSERT_EQ(camera->next(frame, 0), hal::Status::ok);
    EXPECT_EQ(frame.pixels[0], grey);
  }
}

TEST_F(Recorded, a_first_picture_that_is_dark_does_not_scale_those_that_follow) {
  const auto plain = [](int grey) { return encoded(cv::Mat(2, 2, CV_16UC1, cv::Scalar(grey)), ".png"); };
  for (const int pictures : {3, 40}) {
    for (int i = 0; i < pictures; ++i) {
      write(std::to_string(i) + ".png", plain(i == 0 ? 0x00f0 : 0x0800));  // of a 12-bit camera
    }
    write("2.png", {});             // one that cannot be read tells nothing
    write("3.png", plain(0xff00));  // a flash
    auto camera = recorded::Camera::open(folder.string());
    ASSERT_TRUE(camera) << camera.error();
    hal::Frame frame;
    for (int i = 0; i < pictures; ++i) {
      ASSERT_EQ(camera->next(frame, 0), i == 2 ? hal::Status::fault : hal::Status::ok) << i;
      if (i != 2) {
        EXPECT_EQ(frame.pixels[0], i == 0 ? 0x0f : i == 3 ? 0xff : 0x80) << i;
      }
    }
  }
}

TEST_F(Recorded, a_bad_picture_is_a_fault_and_the_next_one_follows) {
  write("1.png", encoded(disc(40, 30), ".png"));
  Bytes cut = encoded(disc(40, 30), ".png");
  cut.resize(cut.size() / 2);
  write("2.png", cut);
  write("3.png", encoded(disc(41, 30), ".png"));
  write("4.png", {});
  write("5.jpg", {'h', 'e', 'l', 'l', 'o'});
  write("6.png", encoded(disc(40, 30, 1), ".png"));
  fs::create_symlink(folder / "nowhere", folder / "3b.png");
  auto camera = recorded::Camera::open(folder.string());
  ASSERT_TRUE(camera) << camera.error();
  hal::Frame frame;
  EXPECT_EQ(camera->next(frame, 0), hal::Status::ok);
  EXPECT_EQ(camera->last_error(), "");
  const std::vector<std::pair<std::string, std::string>> expected{
      {"2.png", "the file ends before the picture does"},
      {"3.png", "41 x 30 px, but the first is 40 x 30 px"},
      {"3b.png", "no such file, or it may not be read"},
      {"4.png", "the file is empty"},
      {"5.jpg", "not a picture this program reads; allowed: PNG, JPEG, TIFF, BMP, PGM, PPM"}};
  std::uint64_t sequence = 1;
  for (const auto& [name, what] : expected) {
    EXPECT_EQ(camera->next(frame, 0), hal::Status::fault);
    EXPECT_EQ(camera->last_error(), path(name) + ": " + what);
    EXPECT_EQ(frame.sequence, sequence++);
    EXPECT_EQ(frame.pixels, nullptr);
  }
  EXPECT_EQ(camera->next(frame, 0), hal::Status::ok);
  EXPECT_EQ(camera->last_error(), "");
  EXPECT_EQ(frame.sequence, 6U);
  EXPECT_EQ(frame.pixels[0], disc(40, 30, 1).at<std::uint8_t>(0, 0));
}

TEST_F(Recorded, what_another_system_has_laid_beside_the_pictures_is_none_of_them) {
  write("._a.png", {0, 5, 22, 7});
  write("a.png", encoded(disc(40, 30), ".png"));
  const auto camera = recorded::Camera::open(folder.string());
  ASSERT_TRUE(camera) << camera.error();
  EXPECT_EQ(camera->files(), std::vector<std::string>{path("a.png")});
}

TEST_F(Recorded, of_several_pictures_in_one_file_none_is_read_for_all) {
  const std::vector<cv::Mat> pages{disc(40, 30), disc(40, 30, 1)};
  ASSERT_TRUE(cv::imwritemulti(path("a.tif"), pages));
  const auto picture = recorded::read_picture(path("a.tif"));
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error(),
            path("a.tif") + ": the TIFF file holds several pictures; allowed: one in a file");
  EXPECT_TRUE(recorded::decode(encoded(disc(40, 30), ".tif")));
}

TEST(Picture, whose_coded_data_end_early_is_refused_and_the_library_stays_silent) {
  Bytes jpeg = encoded(disc(200, 150), ".jpg");
  jpeg.resize(jpeg.size() / 2);
  jpeg.insert(jpeg.end(), {0xff, 0xd9});
  testing::internal::CaptureStderr();
  const auto picture = recorded::decode(jpeg);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error(), "the picture's data are damaged or incomplete");
}

TEST(Picture, keeps_nothing_that_other_threads_write_to_the_standard_error_streams) {
  Bytes jpeg = encoded(disc(400, 300), ".jpg");
  jpeg.resize(jpeg.size() / 2);
  jpeg.insert(jpeg.end(), {0xff, 0xd9});
  constexpr int kLines = 20'000;
  testing::internal::CaptureStderr();
  std::atomic<bool> written{false};
  std::thread other([&] {
    for (int i = 0; i < kLines; ++i) {
      (void)std::fputs("by C\n", stderr);
      std::cerr << "by C++\n";
    }
    written = true;
  });
  int refused = 0, decoded = 0;
  for (; !written || decoded == 0; ++decoded) {
    refused += recorded::decode(jpeg) ? 0 : 1;
  }
  other.join();
  const std::string all = testing::internal::GetCapturedStderr();
  EXPECT_EQ(refused, decoded) << "what the library itself says is heard";
  std::size_t lines = 0;
  std::istringstream in(all);
  for (std::string line; std::getline(in, line); ++lines) {
    EXPECT_TRUE(line == "by C" || line == "by C++") << line;
  }
  EXPECT_EQ(lines, 2U * kLines);
}

TEST_F(Recorded, a_bad_first_picture_is_an_error_of_open) {
  Bytes cut = encoded(disc(40, 30), ".jpg");
  cut.resize(cut.size() - 40);
  write("1.jpg", cut);
  write("2.png", encoded(disc(40, 30), ".png"));
  const auto camera = recorded::Camera::open(folder.string());
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error(), path("1.jpg") + ": the file ends before the picture does");
}

TEST_F(Recorded, a_source_that_cannot_be_opened_is_reported_in_one_line) {
  fs::create_directory(folder / "empty");
  write("garbage.avi", Bytes(5000, 'x'));
  write("no_ending", encoded(disc(9, 9), ".png"));
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  const auto error = [&](const std::string& source, double fps = 0) {
    const auto camera = recorded::Camera::open(source, fps);
    return camera ? std::string("opened") : camera.error();
  };
  EXPECT_EQ(error(path("missing")), path("missing") + ": no such file or folder");
  EXPECT_EQ(error(""), ": no such file or folder");
  EXPECT_EQ(error(path("missing*.png")), path("missing*.png") + ": no file matches");
  EXPECT_EQ(
      error(path("empty")),
      path("empty") +
          ": no pictures in this folder; allowed: *.png, *.jpg, *.jpeg, *.tif, *.tiff, *.bmp, *.pgm, *.ppm");
  EXPECT_EQ(error(path("pipe")), path("pipe") + ": neither a file nor a folder");
  EXPECT_TRUE(one_line(error(path("garbage.avi"))));
  EXPECT_NE(error(path("garbage.avi")), "opened");
  EXPECT_EQ(error(path("empty"), std::nan("")), "fps: allowed: up to 100000 per second");
  EXPECT_EQ(error("http://127.0.0.1:1/x.avi"), "http://127.0.0.1:1/x.avi: no such file or folder");
}

TEST_F(Recorded, a_video_plays_at_its_own_rate_or_at_the_given_one) {
  const std::string video = path("video.avi");
  {
    cv::VideoWriter writer(video, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 12,
                           {64, 48}, true);
    ASSERT_TRUE(writer.isOpened());
    for (int i = 0; i < 10; ++i) {
      writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(20 * i)));
    }
  }
  for (const double fps : {0.0, 50.0}) {
    auto camera = recorded::Camera::open(video, fps);
    ASSERT_TRUE(camera) << camera.error();
    EXPECT_EQ(camera->fps(), fps > 0 ? fps : 12);
    hal::Frame frame;
    int n = 0;
    while (camera->next(frame, 0) == hal::Status::ok) {
      EXPECT_EQ(frame.width, 64);
      EXPECT_EQ(frame.height, 48);
      EXPECT_NEAR(frame.pixels[1000], 20 * n, 2);
      EXPECT_EQ(camera->name(), video + ":" + std::to_string(n));
      EXPECT_EQ(frame.exposure_ns, std::llround(n / camera->fps() * 1e9));
      ++n;
    }
    EXPECT_EQ(n, 10);
    EXPECT_EQ(camera->last_error(), "");
  }
  fs::resize_file(video, fs::file_size(video) * 6 / 10);
  auto cut = recorded::Camera::open(video);
  if (cut) {
    hal::Frame frame;
    int n = 0;
    while (n < 100 && cut->next(frame, 0) != hal::Status::disconnected) {
      ++n;
    }
    EXPECT_LT(n, 10);
    EXPECT_EQ(cut->last_error(), video + ": ends after " + std::to_string(n) + " of 10 pictures");
  } else {
    EXPECT_TRUE(one_line(cut.error()));
  }
}

// Offsets of the size in the headers written below.
TEST(Picture, huge_sizes_are_refused_before_decoding) {
  Bytes png = encoded(disc(20, 20), ".png");
  png[16] = 0x7f;  // width 0x7f000014, and its checksum no longer fits: either way it is refused
  EXPECT_FALSE(recorded::decode(png));

  Bytes bmp = encoded(disc(20, 20), ".bmp");
  bmp[20] = 0x7f;
  auto result = recorded::decode(bmp);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(),
            "its size is 8323092 x 20 px; allowed: sides of 1 .. 16384 px and at most 67108864 px in all");

  const std::string pgm = "P5 16000 16000 255\n";
  result = recorded::decode(Bytes(pgm.begin(), pgm.end()));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(),
            "its size is 16000 x 16000 px; allowed: sides of 1 .. 16384 px and at most 67108864 px in all");

  Bytes jpg = encoded(disc(20, 20), ".jpg");
  for (std::size_t i = 0; i + 9 < jpg.size(); ++i) {
    if (jpg[i] == 0xff && jpg[i + 1] == 0xc0) {
      jpg[i + 5] = jpg[i + 6] = jpg[i + 7] = jpg[i + 8] = 0xff;
      break;
    }
  }
  result = recorded::decode(jpg);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(),
            "its size is 65535 x 65535 px; allowed: sides of 1 .. 16384 px and at most 67108864 px in all");
}

TEST(Picture, every_cut_file_is_refused) {
  const std::vector<std::pair<std::string, std::vector<int>>> kinds{
      {".png", {}},
      {".jpg", {}},
      {".jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1}},
      {".jpg", {cv::IMWRITE_JPEG_RST_INTERVAL, 2}},
      {".bmp", {}},
      {".pgm", {}},
      {".tif", {}}};
  for (const auto& [ending, how] : kinds) {
    const Bytes whole = encoded(disc(33, 21), ending, how);
    const auto good = recorded::decode(whole);
    ASSERT_TRUE(good) << ending << ": " << good.error();
    EXPECT_EQ(good->width, 33);
    EXPECT_EQ(good->height, 21);
    int accepted = 0;
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const auto cut = recorded::decode({whole.data(), length});
      accepted += cut ? 1 : 0;
      EXPECT_TRUE(cut || one_line(cut.error()));
    }
    EXPECT_EQ(accepted, 0) << ending;
  }
}

TEST(Picture, every_flipped_bit_of_a_png_is_noticed) {
  Bytes png = encoded(disc(24, 17), ".png");
  int accepted = 0;
  for (std::size_t i = 0; i < png.size() * 8; ++i) {
    png[i / 8] ^= static_cast<std::uint8_t>(1U << (i % 8));
    accepted += recorded::decode(png) ? 1 : 0;
    png[i / 8] ^= static_cast<std::uint8_t>(1U << (i % 8));
  }
  EXPECT_EQ(accepted, 0);
}

TEST(Picture, damaged_files_give_a_picture_or_one_line) {
  std::mt19937 random(20);
  for (const char* ending : {".png", ".jpg", ".bmp", ".pgm", ".ppm", ".tif"}) {
    cv::Mat picture_in = disc(40, 31);
    if (std::string(ending) == ".ppm") {
      cv::merge(std::vector<cv::Mat>(3, picture_in), picture_in);
    }
    const Bytes whole = encoded(picture_in, ending);
    for (int round = 0; round < 1500; ++round) {
      Bytes bytes = whole;
      for (auto k = 1 + random() % 6; k > 0; --k) {
        // Headers are hit as often as data.
        const std::size_t at =
            random() % (random() % 2 == 0 ? std::min<std::size_t>(bytes.size(), 64) : bytes.size());
        switch (random() % 4) {
          case 0:
            bytes[at] ^= static_cast<std::uint8_t>(1U << (random() % 8));
            break;
          case 1:
            bytes[at] = random() % 2 == 0 ? 0xff : 0x00;
            break;
          case 2:
            bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at));
            break;
          default:
            bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                         static_cast<std::uint8_t>(random()));
        }
      }
      const auto picture = recorded::decode(bytes);
      if (picture) {
        ASSERT_GT(picture->width, 0);
        ASSERT_GT(picture->height, 0);
        ASSERT_EQ(picture->pixels.size(),
                  static_cast<std::size_t>(picture->width) * static_cast<std::size_t>(picture->height));
      } else {
        ASSERT_TRUE(one_line(picture.error()));
      }
    }
  }
}

// Real frames, if they are available.
TEST(Picture, real_frames_are_read) {
  const char* const named = std::getenv("PUNCTUM_DATA");
  const fs::path data = named != nullptr ? named : "../shared/data";
  if (!fs::exists(data)) {
    GTEST_SKIP() << "no recorded frames at " << data;
  }
  struct Source {
    const char* pattern;
    int count, width, height;
  };
  for (const Source& s :
       {Source{"icsi/*_img.png", 4, 272, 272}, Source{"zebrafish-timelapse", 16, 2048, 2048},
        Source{"vesicle-aspiration/*-01.png", 1, 600, 400}, Source{"vesicle-video", 86, 256, 256},
        Source{"pipette-focus", 15, 1280, 1024}}) {
    auto camera = recorded::Camera::open((data / s.pattern).string());
    ASSERT_TRUE(camera) << camera.error();
    EXPECT_EQ(camera->count(), s.count) << s.pattern;
    EXPECT_EQ(camera->width(), s.width) << s.pattern;
    EXPECT_EQ(camera->height(), s.height) << s.pattern;
    hal::Frame frame;
    int good = 0;
    while (camera->next(frame, 0) == hal::Status::ok) {
      ++good;
    }
    EXPECT_EQ(good, s.count) << s.pattern << " " << camera->last_error();
  }
  // The 16-bit picture against the 8-bit copy of the same data set.
  const auto deep = recorded::read_picture((data / "vesicle-aspiration/snapshot-image.png").string());
  const auto copy = recorded::read_picture((data / "vesicle-aspiration/snapshot-image_8bit.png").string());
  ASSERT_TRUE(deep && copy);
  EXPECT_EQ(deep->pixels, copy->pixels);
}

}  // namespace
