// The life of the handle, with and without its thread, against the emulated Falcon. Nothing here is about
// time.
#include "hal/falcon/falcon_handle.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tests/support/virtual_falcon.hpp"

namespace punctum::falcon {
namespace {

using hal::Status;
using hal::Vec3;

// The machine's clock, and the emulated device beside it on its own.
class WallClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  }
  void sleep_until_ns(std::int64_t t_ns) noexcept override {
    std::this_thread::sleep_for(std::chrono::nanoseconds(t_ns - now_ns()));
  }
};

// What the handle owns: the emulated device, whose own time passes while the thread waits. A packet is as old
// as the handle's clock says.
class PacedLink final : public UsbLink {
 public:
  PacedLink(tests::VirtualFalcon& usb, const hal::Clock& clock) : usb_(usb), clock_(clock) {}
  tl::expected<void, std::string> open() override { return usb_.open(); }
  void close() noexcept override { usb_.close(); }
  bool control(std::uint8_t request, std::uint16_t value) override { return usb_.control(request, value); }
  bool send(std::span<const std::uint8_t> bytes) override {
    const std::lock_guard lock(mutex);
    return usb_.send(bytes);
  }
  bool sending() const override { return usb_.sending(); }
  bool sent() const override { return usb_.sent(); }
  Event wait(std::int64_t longest_ns, Packet& out) override {
    std::this_thread::sleep_for(std::chrono::microseconds(100));
    const std::lock_guard lock(mutex);
    const Event event = usb_.wait(longest_ns, out);
    out.received_ns = clock_.now_ns();
    return event;
  }
  void wake() NONBLOCKING override { usb_.wake(); }
  std::mutex mutex;

 private:
  tests::VirtualFalcon& usb_;
  const hal::Clock& clock_;
};

class FalconHandleTest : public testing::Test {
 protected:
  FalconHandle& made(const FalconParams& params = {}) { return made(params, clock); }
  FalconHandle& made(const FalconParams& params, hal::Clock& its_clock) {
    auto paced = std::make_unique<PacedLink>(usb, its_clock);
    link = paced.get();
    handle = std::make_unique<FalconHandle>(params, ServoThread{}, its_clock, std::move(paced));
    return *handle;
  }
  // Within some seconds.
  template <class Condition>
  bool soon(Condition holds) {
    for (int i = 0; i < 5000; ++i) {
      if (holds()) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  bool pushes() {
    const std::lock_guard lock(link->mutex);
    return usb.falcon.motors() != std::array<int, 3>{};
  }

  tests::VirtualFalcon usb{{.booted = true, .homed = true}};
  WallClock clock;
  PacedLink* link = nullptr;
  std::unique_ptr<FalconHandle> handle;
};

TEST_F(FalconHandleTest, serves_the_handle_and_nothing_else) {
  const hal::Served served = made().served();
  EXPECT_EQ(served.haptic, handle.get());
  EXPECT_EQ(served.stage, nullptr);
  EXPECT_EQ(served.estop, nullptr);
}

TEST_F(FalconHandleTest, a_firmware_that_is_none_is_refused_before_anything_is_sent) {
  const std::string path = testing::TempDir() + "falcon_no_firmware";
  std::ofstream(path) << "no firmware at all, but long enough";
  const auto opened = made({path, -1}).open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().find('\n'), std::string::npos);
  EXPECT_EQ(usb.opened, 0);
  EXPECT_TRUE(usb.packets_out.empty());
}

TEST_F(FalconHandleTest, its_thread_reads_and_pushes_until_the_safe_state) {
  ASSERT_TRUE(made().open());
  ASSERT_TRUE(handle->start(0));
  hal::HandState state;
  EXPECT_TRUE(soon([&] { return handle->read(state) == Status::ok; }));
  EXPECT_TRUE(soon([&] { return handle->write_force({0, 0, 2}) == Status::ok && pushes(); }));
  handle->safe_state();
  EXPECT_TRUE(soon([&] { return !pushes(); }));  // a loaded machine may take longer than it waits
  for (int i = 0; i < 50; ++i) {
    const Status written = handle->write_force({0, 0, 2});
    // On a loaded machine its thread may be late with the answer, and a force is refused meanwhile.
    EXPECT_TRUE(written == Status::ok || written == Status::no_data);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_FALSE(pushes()) << "nothing but zero from then on";
  }
  handle->safe_state();
  handle->close();
  EXPECT_FALSE(usb.is_open);
}

TEST_F(FalconHandleTest, without_a_start_its_safe_state_still_sends_zero) {
  ASSERT_TRUE(made().open());
  const std::size_t before = usb.packets_out.size();
  handle->safe_state();
  ASSERT_GT(usb.packets_out.size(), before);
  EXPECT_EQ(std::string(usb.packets_out.back().begin(), usb.packets_out.back().end()), "<AAAAAAAAAAAADA>");
  handle->close();
}

// Under the clock of the emulated device: on a loaded machine, time enough may pass between two instructions
// for the next zero to be on its way already, or for the safe state to wait no longer.
TEST_F(FalconHandleTest, its_safe_state_sends_zero_until_it_arrives) {
  ASSERT_TRUE(made({}, usb).open());
  usb.out_fails = 3;
  handle->safe_state();
  EXPECT_EQ(usb.out_fails, 0);
  EXPECT_TRUE(usb.sent());
  handle->close();
}

TEST_F(FalconHandleTest, closed_and_opened_again_it_begins_anew) {
  for (int i = 1; i <= 2; ++i) {
    ASSERT_TRUE((i == 1 ? made() : *handle).open());
    ASSERT_TRUE(handle->start(0));
    hal::HandState state;
    EXPECT_TRUE(soon([&] { return handle->read(state) == Status::ok; }));
    handle->safe_state();
    handle->close();
    EXPECT_EQ(usb.opened, i);
  }
}

TEST_F(FalconHandleTest, unplugged_its_thread_ends_and_nobody_waits_for_it) {
  ASSERT_TRUE(made().open());
  ASSERT_TRUE(handle->start(0));
  {
    const std::lock_guard lock(link->mutex);
    usb.unplugged = true;
  }
  hal::HandState state;
  EXPECT_TRUE(soon([&] { return handle->read(state) == Status::disconnected; }));
  EXPECT_EQ(handle->write_force(Vec3::Zero()), Status::disconnected);
  handle->safe_state();
  handle->close();
}

TEST_F(FalconHandleTest, that_did_not_open_is_closed_and_stopped_without_harm) {
  usb.unplugged = true;
  EXPECT_FALSE(made().open());
  handle->safe_state();
  handle->close();
}

}  // namespace
}  // namespace punctum::falcon
