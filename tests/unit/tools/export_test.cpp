// What becomes of the messages of a recording: rows to the last tick, and the surface of the moment that was
// asked for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/recorded/modules.hpp"
#include "hal/recorded/picture.hpp"
#include "tests/support/full_disk.hpp"
#include "tools/record/export_csv.hpp"
#include "tools/record/export_hdf5.hpp"
#include "tools/record/export_pictures.hpp"
#include "tools/record/export_surface.hpp"
#include "tools/record/mcap_writer.hpp"
#include "tools/record/overview.hpp"
#include "tools/record/recording.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/whole_file.hpp"
#include "tools/vision/surface_files.hpp"
#include "tools/wire/messages.hpp"

namespace punctum::tools {
namespace {

std::uint16_t add(mcap::Writer& file, Stream s) {
  const Topic& t = kTopics[static_cast<std::size_t>(s)];
  return file.add_channel(file.add_schema(t.schema, "protobuf", wire_schema()), t.name, "protobuf");
}

class ExportTest : public FullDisk {
 protected:
  // Ten ticks of a station that is not simulated, with a surface after each second one: frame 2, 4, ... 8.
  void SetUp() override {
    FullDisk::SetUp();
    auto file = mcap::Writer::create(recording(), "punctum test");
    ASSERT_TRUE(file) << file.error();
    const std::uint16_t telemetry = add(*file, Stream::telemetry), surface = add(*file, Stream::surface);
    for (std::uint64_t tick = 0; tick < 10; ++tick) {
      rt::TelemetrySample s;
      s.tick = tick;
      s.t_s = static_cast<double>(tick);
      v1::Telemetry t;
      to_wire(s, t);
      file->message(telemetry, tick, tick, t.SerializeAsString());
      if (tick % 2 == 0 && tick > 0) {
        rt::CellSurface c;
        c.frame = tick;
        c.flags = rt::CellSurface::outer_ok;
        for (int i = 0; i < rt::MembraneSurface::kControlPoints; ++i) {
          c.outer.control_m[i][0] = 1e-6 * i;
          c.outer.control_m[i][3] = c.outer.control_m[i][4] = 5e-5;
        }
        v1::CellSurface m;
        to_wire(c, m);
        file->message(surface, tick, tick, m.SerializeAsString());
      }
    }
    file->finish();
  }
  [[nodiscard]] std::string recording() const { return (folder_ / "r.mcap").string(); }
  // The frame that the exported surface is of.
  [[nodiscard]] std::string frame_at(std::optional<double> at_s) const {
    const std::string stem = (folder_ / "cell").string();
    const auto ends = export_surface(recording(), stem, at_s);
    EXPECT_TRUE(ends && ends->empty()) << (ends ? *ends : ends.error());
    std::ifstream in(stem + ".json");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    for (const std::string& file : surface_files(stem)) {
      std::filesystem::remove(file);
    }
    const std::string key = "\"frame\": ";
    const auto at = text.find(key);
    return at == std::string::npos ? text : text.substr(at + key.size(), 1);
  }
};

TEST_F(ExportTest, every_tick_is_a_row_without_a_simulated_world_too) {
  const auto exported = export_csv(recording(), folder_ / "t");
  ASSERT_TRUE(exported) << exported.error();
  EXPECT_EQ(exported->ends, "");
  EXPECT_EQ(exported->ticks, 10U);
  CsvReader rows(folder_ / "t" / "samples.csv");
  int n = 0;
  while (rows.next()) {
    EXPECT_EQ(rows.number("t_s"), n++);
    EXPECT_EQ(rows.text("true_gap_m"), "");
  }
  EXPECT_EQ(n, 10);
}

// Twelve pictures that differ in every pixel, 40 ms apart; the run began 100 ms before the first.
constexpr std::uint32_t kWidth = 31, kHeight = 9;
std::string grey(std::uint64_t frame) {
  std::string pixels(std::size_t{kWidth} * kHeight, '\0');
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = static_cast<char>(3 * i + 11 * frame);
  }
  return pixels;
}
std::string recorded_pictures(const std::filesystem::path& folder, std::uint32_t last_width = kWidth) {
  const std::string path = (folder / "pictures.mcap").string();
  auto file = mcap::Writer::create(path, "punctum test");
  EXPECT_TRUE(file) << file.error();
  const std::uint16_t picture = add(*file, Stream::picture), status = add(*file, Stream::status),
                      scene = add(*file, Stream::scene);
  v1::Scene s;
  s.set_toml(to_toml(*load_scene("icsi", {"camera.pixel_um=0.5"})));
  file->message(scene, 1, 1, s.SerializeAsString());
  for (std::uint64_t i = 0; i < 12; ++i) {
    v1::Picture p;
    p.set_frame(2 * i);
    p.set_exposure_ns(7'100'000'000 + static_cast<std::int64_t>(i) * 40'000'000);
    p.set_width(i == 11 ? last_width : kWidth);
    p.set_height(kHeight);
    p.set_grey(grey(i).substr(0, std::size_t{p.width()} * kHeight));
    file->message(picture, i, i, p.SerializeAsString());
  }
  v1::Status t;
  t.set_start_ns(7'000'000'000);
  file->message(status, 12, 12, t.SerializeAsString());
  file->finish();
  return path;
}
std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(ExportTest, pictures_become_png_files_with_their_times) {
  const std::string recording = recorded_pictures(folder_);
  const auto exported = export_png(recording, folder_ / "png");
  ASSERT_TRUE(exported) << exported.error();
  EXPECT_EQ(*exported, "");
  CsvReader rows(folder_ / "png" / "pictures.csv");
  std::uint64_t i = 0;
  for (; rows.next(); ++i) {
    EXPECT_EQ(rows.number("frame"), 2 * i);
    EXPECT_DOUBLE_EQ(rows.number("t_s").value_or(-1), 0.1 + 0.04 * static_cast<double>(i));
    const std::string file = bytes_of(folder_ / "png" / rows.text("file"));
    const auto decoded = recorded::decode({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()});
    ASSERT_TRUE(decoded) << decoded.error();
    EXPECT_EQ(decoded->width, static_cast<int>(kWidth));
    EXPECT_EQ(std::string(decoded->pixels.begin(), decoded->pixels.end()), grey(i));
  }
  EXPECT_EQ(i, 12U);
  EXPECT_EQ(export_png(recording, folder_ / "png").error(),
            (folder_ / "png").string() + ": is there already; an export replaces nothing");
}

// The first page by libtiff; the others, and the description, are read by the check `recording`.
TEST_F(ExportTest, pictures_become_pages_of_an_ome_tiff) {
  const std::string recording = recorded_pictures(folder_), tiff = (folder_ / "a.ome.tif").string();
  const auto exported = export_ome_tiff(recording, tiff);
  ASSERT_TRUE(exported) << exported.error();
  const std::string file = bytes_of(tiff);
  EXPECT_EQ(file.substr(0, 4), std::string("II\x2b\0", 4));
  EXPECT_NE(file.find("SizeT=\"12\" PhysicalSizeX=\"0.5\" PhysicalSizeY=\"0.5\""), std::string::npos);
  EXPECT_NE(file.find("TheT=\"11\" DeltaT=\"0.540000000\""), std::string::npos);
  const auto libtiff = recorded::load_pictures();
  ASSERT_TRUE(libtiff) << libtiff.error();
  const cv::Mat first =
      libtiff->decode(cv::Mat(1, static_cast<int>(file.size()), CV_8U, const_cast<char*>(file.data())));
  ASSERT_EQ(first.size(), cv::Size(kWidth, kHeight));
  ASSERT_TRUE(first.isContinuous());
  EXPECT_EQ(std::string(first.begin<char>(), first.end<char>()), grey(0));
  EXPECT_EQ(export_ome_tiff(recording, tiff).error(),
            tiff + ": is there already; an export replaces nothing");
}

TEST_F(ExportTest, a_file_name_that_is_no_text_leaves_the_xml_whole) {
  const std::string odd = (folder_ / "<a>&\x01\xff.mcap").string(), tiff = (folder_ / "odd.ome.tif").string();
  std::filesystem::rename(recorded_pictures(folder_), odd);
  ASSERT_TRUE(export_ome_tiff(odd, tiff));
  EXPECT_NE(bytes_of(tiff).find("Name=\"&lt;a&gt;&amp;\xEF\xBF\xBD\xEF\xBF\xBD.mcap\""), std::string::npos);
}

TEST_F(ExportTest, a_surface_of_no_numbers_and_a_picture_too_wide_are_said_and_leave_nothing) {
  const std::string odd = (folder_ / "odd.mcap").string();
  {
    auto file = mcap::Writer::create(odd, "punctum test");
    ASSERT_TRUE(file) << file.error();
    const std::uint16_t surface = add(*file, Stream::surface), picture = add(*file, Stream::picture);
    rt::CellSurface c;
    c.flags = rt::CellSurface::outer_ok;
    c.outer.control_m[3][2] = std::numeric_limits<double>::quiet_NaN();
    v1::CellSurface m;
    to_wire(c, m);
    file->message(surface, 1, 1, m.SerializeAsString());
    v1::Picture p;
    p.set_width(2'000'000);
    p.set_height(1);
    p.set_grey(std::string(2'000'000, 'x'));
    file->message(picture, 2, 2, p.SerializeAsString());
    file->finish();
  }
  const std::string stem = folder_ / "odd", pictures = folder_ / "png";
  EXPECT_NE(export_surface(odd, stem, {}).error().find("no numbers"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(stem + ".obj"));
  EXPECT_NE(export_png(odd, pictures).error().find("2000000 pixels along one side, allowed: 1000000"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(pictures));
}

TEST_F(ExportTest, what_cannot_become_pictures_is_said_and_leaves_nothing) {
  const std::string none = (folder_ / "none.ome.tif").string();
  EXPECT_NE(export_ome_tiff(recording(), none).error().find("holds no pictures"), std::string::npos);
  EXPECT_NE(export_png(recording(), none).error().find("holds no pictures"), std::string::npos);
  const std::string pictures = recorded_pictures(folder_, kWidth - 1);
  EXPECT_NE(export_ome_tiff(pictures, none).error().find("of several sizes"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(none));
  std::filesystem::remove(pictures);
  const std::string whole = recorded_pictures(folder_);
  full_beyond(2000);
  EXPECT_EQ(export_ome_tiff(whole, none).error(), none + ": File too large");
  has_room_again();
  EXPECT_FALSE(std::filesystem::exists(none));
  std::size_t left = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_)) {
    ++left;
  }
  EXPECT_EQ(left, 2U) << "the two recordings";
}

TEST_F(ExportTest, the_surface_is_the_one_that_was_told_nearest_to_the_moment) {
  EXPECT_EQ(frame_at(std::nullopt), "8") << "the last one";
  EXPECT_EQ(frame_at(0), "2");
  EXPECT_EQ(frame_at(4.4), "4");
  EXPECT_EQ(frame_at(5.6), "6");
  EXPECT_EQ(frame_at(9), "8");
}

TEST_F(ExportTest, a_moment_that_is_not_in_the_recording_is_refused) {
  const std::string stem = folder_ / "cell";
  for (const double at_s : {-1.0, 9.1, 1e300, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()}) {
    const auto exported = export_surface(recording(), stem, at_s);
    ASSERT_FALSE(exported) << at_s;
    EXPECT_NE(exported.error().find(": not in " + recording() + ", allowed: from 0.000 to 9.000"),
              std::string::npos)
        << exported.error();
  }
  EXPECT_FALSE(std::filesystem::exists(stem + ".json"));
}

TEST_F(ExportTest, a_full_disk_is_told) {
  full_beyond(300);
  const auto exported = export_csv(recording(), folder_ / "t");
  has_room_again();
  ASSERT_FALSE(exported);
  EXPECT_EQ(exported.error(), (folder_ / "t").string() + "/samples.csv: File too large");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "t" / "samples.csv")) << "a table that is cut off";
}

// A run of two cells. In the first the membrane gives way at 12 um and 3 uN, in the second it never does.
std::string recorded_run(const std::filesystem::path& folder, bool whole = true) {
  const std::string path = (folder / (whole ? "run.mcap" : "cut.mcap")).string();
  auto file = mcap::Writer::create(path, "punctum test");
  EXPECT_TRUE(file) << file.error();
  const std::uint16_t telemetry = add(*file, Stream::telemetry), truth = add(*file, Stream::truth),
                      event = add(*file, Stream::event), status = add(*file, Stream::status),
                      scene = add(*file, Stream::scene), loss = add(*file, Stream::loss);
  v1::Scene s;
  s.set_toml(to_toml(*load_scene("icsi", {"scene.seed=42"})));
  file->message(scene, 0, 0, s.SerializeAsString());
  std::uint64_t tick = 0;
  const auto ticks = [&](v1::Phase phase, std::uint32_t cell, int n, bool open = false) {
    for (int i = 0; i < n; ++i, ++tick) {
      v1::Telemetry t;
      t.set_tick(tick);
      t.set_t_s(0.01 * static_cast<double>(tick));
      t.set_phase(phase);
      t.set_cell(cell);
      t.set_injector_open(open);
      t.mutable_force_n()->set_x(cell == 0 ? 0.3 : -0.6);
      t.mutable_force_n()->set_y(cell == 0 ? 0.4 : 0.8);
      if (phase == v1::PHASE_INDENTATION) {
        t.set_wd_m(1e-6 * (i + 1));
        t.set_tip_force_n(0.25e-6 * (i + 1));
      }
      file->message(telemetry, tick, tick, t.SerializeAsString());
      v1::Truth w;
      w.set_tick(tick);
      w.set_lost(cell == 1 && phase == v1::PHASE_INDENTATION && i > 3);
      file->message(truth, tick, tick, w.SerializeAsString());
    }
  };
  ticks(v1::PHASE_FREE, 0, 3);
  ticks(v1::PHASE_CONTACT, 0, 2);
  ticks(v1::PHASE_INDENTATION, 0, 12);
  ticks(v1::PHASE_PUNCTURE, 0, 3);
  ticks(v1::PHASE_INJECTION, 0, 4, true);
  ticks(v1::PHASE_CLEAR, 0, 2);
  ticks(v1::PHASE_INDENTATION, 1, 30);
  for (const v1::Fault fault : {v1::FAULT_COMMAND_STOP, v1::FAULT_ESTOP}) {
    v1::Event e;
    e.set_kind(v1::Event::KIND_FAULT);
    e.set_fault(fault);
    file->message(event, tick, tick, e.SerializeAsString());
  }
  v1::Status c;
  c.set_missed(7);
  for (const int n : {0, 0, 998, 0, 0, 1}) {
    c.mutable_wake()->add_bin(static_cast<std::uint64_t>(n));
  }
  c.mutable_wake()->set_overflow(1);
  c.mutable_wake()->set_max_us(4321);
  file->message(status, tick, tick, c.SerializeAsString());
  v1::Loss l;
  l.set_telemetry(2);
  l.set_pictures(3);
  file->message(loss, tick, tick, l.SerializeAsString());
  if (whole) {
    file->finish();
  } else {
    file->close_chunk();
  }
  return path;
}

TEST_F(ExportTest, ticks_that_this_build_does_not_know_are_counted) {
  const std::string path = folder_ / "odd.mcap";
  auto file = mcap::Writer::create(path, "punctum test");
  ASSERT_TRUE(file) << file.error();
  const std::uint16_t telemetry = add(*file, Stream::telemetry);
  for (std::uint64_t tick = 0; tick < 10; ++tick) {
    v1::Telemetry t;
    t.set_tick(tick);
    t.set_t_s(tick < 8 ? 1e-3 * static_cast<double>(tick) : std::numeric_limits<double>::quiet_NaN());
    t.set_phase(tick == 3 ? static_cast<v1::Phase>(99) : v1::PHASE_FREE);
    file->message(telemetry, tick, tick, t.SerializeAsString());
  }
  file->finish();
  const auto exported = export_csv(path, folder_ / "t");
  ASSERT_TRUE(exported) << exported.error();
  EXPECT_EQ(exported->ticks, 7U);
  EXPECT_EQ(exported->unknown_ticks, 3U);
  EXPECT_EQ(exported->ends, path +
                                ": 3 ticks are left out of samples.csv: their phase, fault, stop or time is "
                                "none that this build knows");
}

TEST_F(ExportTest, nothing_that_is_there_is_replaced_and_what_is_refused_leaves_nothing) {
  const std::string run = recorded_run(folder_);
  const auto refused = [](const auto& exported, const std::string& file) {
    ASSERT_FALSE(exported) << file;
    EXPECT_EQ(exported.error(), file + ": is there already; an export replaces nothing");
  };
  for (const char* name : {"samples.csv", "events.csv", "observations.csv", "scene.toml"}) {
    const auto folder = folder_ / name;
    std::filesystem::create_directory(folder);
    std::ofstream(folder / name) << "mine";
    refused(export_csv(run, folder), folder / name);
    EXPECT_EQ(bytes_of(folder / name), "mine");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1) << name;
  }
  const std::string stem = folder_ / "cell";
  for (const std::string& file : surface_files(stem)) {
    std::ofstream(file) << "mine";
    refused(export_surface(recording(), stem, {}), file);
    EXPECT_EQ(bytes_of(file), "mine");
    std::filesystem::remove(file);
  }
  const std::string nowhere = folder_ / "link.nwb";
  std::filesystem::create_symlink(folder_ / "none", nowhere);
  refused(export_hdf5(run, nowhere), nowhere);
}

TEST_F(ExportTest, nothing_is_written_through_a_name_that_somebody_else_has_taken) {
  const std::string run = recorded_run(folder_), whole = bytes_of(run), pictures = recorded_pictures(folder_);
  std::filesystem::create_symlink(run, folder_ / "a.part.nwb");
  std::ofstream(folder_ / "a.ome.part.tif") << "mine";
  EXPECT_TRUE(export_hdf5(run, folder_ / "a.nwb"));
  EXPECT_TRUE(export_ome_tiff(pictures, folder_ / "a.ome.tif"));
  EXPECT_EQ(bytes_of(run), whole);
  EXPECT_EQ(bytes_of(folder_ / "a.nwb").substr(1, 3), "HDF");
  EXPECT_EQ(bytes_of(folder_ / "a.ome.part.tif"), "mine");
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "a.part.nwb"));
}

TEST_F(ExportTest, pictures_that_a_full_disk_did_not_take_leave_room_for_another_try) {
  const std::string pictures = recorded_pictures(folder_), out = folder_ / "png";
  full_beyond(100);
  EXPECT_FALSE(export_png(pictures, out));
  has_room_again();
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_TRUE(export_png(pictures, out));
}

// To the end of a process, where the library closes what is still open.
TEST_F(ExportTest, a_full_disk_is_told_by_an_export_to_hdf5_and_crashes_nothing) {
  const std::string run = recorded_run(folder_), out = folder_ / "run.nwb";
  EXPECT_EXIT(
      {
        full_beyond(30'000);
        const auto exported = export_hdf5(run, out);
        std::cerr << (exported ? "exported" : exported.error());
        std::exit(3);
      },
      testing::ExitedWithCode(3), "run.nwb: cannot be written: File too large");
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run.part.nwb"));
}

TEST_F(ExportTest, how_long_a_cell_was_pressed_is_unknown_where_the_contact_is_not_recorded) {
  const std::string path = (folder_ / "late.mcap").string();
  auto file = mcap::Writer::create(path, "punctum test");
  ASSERT_TRUE(file) << file.error();
  const std::uint16_t telemetry = add(*file, Stream::telemetry);
  const auto tick = [&](std::uint64_t number, v1::Phase phase) {
    v1::Telemetry t;
    t.set_tick(number);
    t.set_t_s(1e-3 * static_cast<double>(number));
    t.set_phase(phase);
    file->message(telemetry, static_cast<std::int64_t>(number), static_cast<std::int64_t>(number),
                  t.SerializeAsString());
  };
  const auto cell = [&](std::uint64_t first, std::uint64_t contact, std::uint64_t indentation) {
    for (std::uint64_t k = first; k < first + 300; ++k) {
      tick(k, k < contact       ? v1::PHASE_FREE
              : k < indentation ? v1::PHASE_CONTACT
              : k < first + 200 ? v1::PHASE_INDENTATION
                                : v1::PHASE_PUNCTURE);
    }
  };
  cell(5000, 5000, 5100);     // the recording begins in contact
  cell(6000, 6050, 6100);     // all of it
  cell(9000, 9000, 9100);     // the contact lies in a hole
  cell(10000, 10000, 10000);  // likewise, and the phase, too
  file->finish();
  const auto facts = facts_of(path);
  ASSERT_TRUE(facts) << facts.error();
  ASSERT_EQ(facts->punctures.size(), 4U);
  EXPECT_FALSE(facts->punctures[0].pressed_s);
  EXPECT_NEAR(facts->punctures[1].pressed_s.value_or(0), 0.149, 1e-9);
  EXPECT_FALSE(facts->punctures[2].pressed_s);
  EXPECT_FALSE(facts->punctures[3].pressed_s);
}

TEST_F(ExportTest, many_runs_stand_side_by_side) {
  const std::string other = (folder_ / "second.mcap").string();
  std::filesystem::rename(recording(), other);
  std::vector<RunFacts> runs;
  for (const std::string& path : {recorded_run(folder_), other}) {
    const auto facts = facts_of(path);
    ASSERT_TRUE(facts) << facts.error();
    runs.push_back(*facts);
  }
  const std::string out = folder_ / "runs";
  const auto written = write_overview(runs, out);
  ASSERT_TRUE(written) << written.error();
  const auto drawn = draw_overview(runs, out);
  EXPECT_TRUE(drawn) << drawn.error();
  CsvReader rows(std::filesystem::path(out) / "runs.csv");
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.text("scene"), "icsi");
  for (const auto& [name, value] : {std::pair{"seed", 42.0},
                                    {"seconds", 0.55},
                                    {"cells", 2},
                                    {"injected", 1},
                                    {"lost", 1},
                                    {"pressed_s", 0.13},
                                    {"depth_um", 12},
                                    {"needle_uN", 3},
                                    {"hand_N", 1},
                                    {"missed_ticks", 7},
                                    {"wake_p999_us", 6},
                                    {"wake_max_us", 4321},
                                    {"not_told", 5}}) {
    EXPECT_NEAR(rows.number(name).value_or(-1), value, 1e-9) << name;
  }
  EXPECT_EQ(rows.text("fault"), "command_stop") << "the first";
  EXPECT_EQ(rows.text("whole"), "no") << "it has holes";
  EXPECT_EQ(runs.front().ends, (folder_ / "run.mcap").string() +
                                   ": has holes: 5 messages did not reach the recorder, 2 ticks among them");
  // A station that is not simulated and tells neither its scene nor its timing.
  ASSERT_TRUE(rows.next());
  for (const char* unknown : {"scene", "seed", "lost", "depth_um", "fault", "wake_max_us"}) {
    EXPECT_EQ(rows.text(unknown), "") << unknown;
  }
  EXPECT_EQ(rows.number("seconds"), 9);
  EXPECT_EQ(rows.text("whole"), "yes");
  EXPECT_FALSE(rows.next());
  EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / "runs.svg"));
  EXPECT_FALSE(write_overview(runs, out)) << "nothing is replaced";
  const std::string table = overview_table(runs);
  EXPECT_NE(table.find("second.mcap"), std::string::npos);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
  EXPECT_FALSE(facts_of(folder_ / "none.mcap"));
}

TEST_F(ExportTest, a_recording_that_was_cut_off_is_in_the_overview_too) {
  const auto facts = facts_of(recorded_run(folder_, false));
  ASSERT_TRUE(facts) << facts.error();
  EXPECT_NE(facts->ends, "");
  EXPECT_EQ(facts->cells, 2U);
  EXPECT_NE(overview_table({*facts}).find(" no\n"), std::string::npos);
}

TEST_F(ExportTest, a_name_with_a_comma_stays_one_cell_of_the_overview) {
  const std::string named = folder_ / "one, two.mcap";
  std::filesystem::rename(recording(), named);
  const auto facts = facts_of(named);
  ASSERT_TRUE(facts) << facts.error();
  const auto written = write_overview({*facts}, folder_ / "runs");
  ASSERT_TRUE(written) << written.error();
  std::ifstream in(folder_ / "runs" / "runs.csv");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(text.find('"' + named + "\","), std::string::npos) << text;
}

}  // namespace
}  // namespace punctum::tools
