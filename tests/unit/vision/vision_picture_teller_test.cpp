// Pictures for whoever looks: only while somebody does, not more often than a page shows them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "hal/ipc/segment.hpp"
#include "tools/vision/picture_teller.hpp"

namespace punctum::tools {
namespace {

class PictureTellerTest : public testing::Test {
 protected:
  void SetUp() override {
    viewer_for_reading_ = std::move(*viewer_made_.segment().read_only_descriptor());
    HandedSegments handed;
    handed.add(kViewSegment, view_.segment().descriptor());
    handed.add(kViewerSegment, viewer_for_reading_.number());
    auto teller = PictureTeller::open(handed, 0.8e-6);
    ASSERT_TRUE(teller) << teller.error();
    teller_ = std::move(*teller);
    frame_.pixels = pixels_.data();
    frame_.width = 60;
    frame_.height = 40;
    frame_.stride = 64;
    frame_.exposure_ns = 123;
  }
  // The picture that was told last, if another one than before.
  std::optional<rt::PictureHead> told() {
    rt::PictureHead head;
    std::uint64_t index = 0;
    if (view_->ring.heads().newest(head, index) != hal::Read::ok || index + 1 == seen_) {
      return std::nullopt;
    }
    seen_ = index + 1;
    return head;
  }
  void tell(std::int64_t now_ns, const vision::Result* seen = nullptr) {
    ++frame_.sequence;
    teller_->tell(frame_, seen, now_ns);
  }

  hal::Shared<const rt::ViewSegment> view_ = hal::Shared<const rt::ViewSegment>::create("view").value();
  hal::Shared<const rt::ViewerSegment> viewer_made_ =
      hal::Shared<const rt::ViewerSegment>::create("viewer").value();
  hal::Shared<rt::ViewerSegment> viewer_ =
      hal::Shared<rt::ViewerSegment>::claim("viewer", viewer_made_.segment().descriptor()).value();
  hal::Descriptor viewer_for_reading_;
  std::optional<PictureTeller> teller_;
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(64 * 40, 9);
  hal::Frame frame_;
  std::uint64_t seen_ = 0;
};

TEST_F(PictureTellerTest, tells_nothing_unless_somebody_looks_and_then_some_a_second) {
  tell(1'000'000'000);
  EXPECT_FALSE(told());
  viewer_->looks_until_ns.store(3'000'000'000);
  int pictures = 0;
  for (std::int64_t ms = 1000; ms < 5000; ms += 10) {
    tell(ms * 1'000'000);
    pictures += told() ? 1 : 0;
  }
  EXPECT_GE(pictures, 2000 / 70);
  EXPECT_LE(pictures, 2000 / 60 + 1);
  tell(5'000'000'000);
  EXPECT_FALSE(told()) << "nobody looks any more";
}

TEST_F(PictureTellerTest, tells_the_contours_that_were_found_and_how_sure_they_are) {
  viewer_->looks_until_ns.store(INT64_MAX);
  vision::Result result;
  for (int i = 0; i < 256; ++i) {
    result.outer.contour.push_back(
        {30 + 10 * std::cos(2 * M_PI * i / 256), 20 + 10 * std::sin(2 * M_PI * i / 256)});
    result.outer.sd_px.push_back(0.001 * i);
  }
  result.outer.ok = true;
  result.inner.contour = result.outer.contour;  // but not ok
  tell(1'000'000'000, &result);
  const auto head = told();
  ASSERT_TRUE(head);
  EXPECT_EQ(head->frame, frame_.sequence);
  EXPECT_EQ(head->exposure_ns, 123);
  EXPECT_FLOAT_EQ(head->pixel_m, 0.8e-6F);
  EXPECT_EQ(head->step_px, 1U);
  EXPECT_EQ(head->inner.count, 0U);
  ASSERT_EQ(head->outer.count, 64U);
  for (std::size_t i = 0; i < 64; ++i) {  // evenly, all round
    EXPECT_NEAR(std::atan2(static_cast<double>(head->outer.point[i].y_px) - 20,
                           static_cast<double>(head->outer.point[i].x_px) - 30),
                std::remainder(2 * M_PI * static_cast<double>(i) / 64, 2 * M_PI), 1e-5);
    EXPECT_NEAR(static_cast<double>(head->outer.point[i].sd_px), 0.004 * static_cast<double>(i), 1e-6);
  }
  std::vector<std::uint8_t> read(head->bytes() + 7);
  ASSERT_TRUE(view_->ring.read(*head, read.data()));
  EXPECT_EQ(read[0], 9);
}

}  // namespace
}  // namespace punctum::tools
