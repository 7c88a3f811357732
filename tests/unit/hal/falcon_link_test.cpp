// libusb's side of a Falcon, with a libusb in memory in place of the real one: what its transfers end with is
// up to the test, as no emulated device can make a host controller report it.
#include <gtest/gtest.h>
#include <libusb.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "hal/falcon/libusb_link.hpp"

namespace {

struct FakeUsb {
  libusb_transfer_status in = LIBUSB_TRANSFER_COMPLETED, out = LIBUSB_TRANSFER_COMPLETED;
  int out_short = 0;         // bytes that a packet out lacks when it ends
  bool out_refused = false;  // it cannot be queued
  bool out_hangs = false;
  std::vector<libusb_transfer*> queued;
  int always_ready = -1;
};
FakeUsb usb;

bool is_in(const libusb_transfer* t) { return (t->endpoint & LIBUSB_ENDPOINT_IN) != 0; }

}  // namespace

extern "C" {
int libusb_init(libusb_context** context) {
  *context = reinterpret_cast<libusb_context*>(&usb);
  return 0;
}
void libusb_exit(libusb_context*) {}
const char* libusb_strerror(int) { return "an error"; }
ssize_t libusb_get_device_list(libusb_context*, libusb_device*** list) {
  static std::array<libusb_device*, 2> devices = {reinterpret_cast<libusb_device*>(&usb), nullptr};
  *list = devices.data();
  return 1;
}
void libusb_free_device_list(libusb_device**, int) {}
int libusb_get_device_descriptor(libusb_device*, libusb_device_descriptor* about) {
  about->idVendor = 0x0403;
  about->idProduct = 0xCB48;
  return 0;
}
int libusb_open(libusb_device*, libusb_device_handle** device) {
  *device = reinterpret_cast<libusb_device_handle*>(&usb);
  return 0;
}
void libusb_close(libusb_device_handle*) {}
int libusb_set_auto_detach_kernel_driver(libusb_device_handle*, int) { return 0; }
int libusb_claim_interface(libusb_device_handle*, int) { return 0; }
int libusb_release_interface(libusb_device_handle*, int) { return 0; }
const libusb_pollfd** libusb_get_pollfds(libusb_context*) {
  static libusb_pollfd one;
  static std::array<const libusb_pollfd*, 2> list;
  one = {usb.always_ready, POLLIN};
  list = {&one, nullptr};
  return list.data();
}
void libusb_free_pollfds(const libusb_pollfd**) {}
libusb_transfer* libusb_alloc_transfer(int) { return new libusb_transfer{}; }
void libusb_free_transfer(libusb_transfer* t) { delete t; }
int libusb_submit_transfer(libusb_transfer* t) {
  if (!is_in(t) && usb.out_refused) {
    return LIBUSB_ERROR_IO;
  }
  usb.queued.push_back(t);
  return 0;
}
int libusb_cancel_transfer(libusb_transfer*) {
  usb.out_hangs = false;
  return 0;
}
int libusb_control_transfer(libusb_device_handle*, std::uint8_t, std::uint8_t, std::uint16_t, std::uint16_t,
                            unsigned char*, std::uint16_t, unsigned) {
  return 0;
}
// Everything that is queued ends, a packet in with its two bytes of status alone.
int libusb_handle_events_timeout_completed(libusb_context*, timeval*, int*) {
  std::vector<libusb_transfer*> ends;
  std::swap(ends, usb.queued);
  for (libusb_transfer* t : ends) {
    if (!is_in(t) && usb.out_hangs) {
      usb.queued.push_back(t);
      continue;
    }
    t->status = is_in(t) ? usb.in : usb.out;
    t->actual_length = t->status != LIBUSB_TRANSFER_COMPLETED ? 0 : is_in(t) ? 2 : t->length - usb.out_short;
    t->callback(t);
  }
  return 0;
}
}  // extern "C"

namespace punctum::falcon {
namespace {

class StandingClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return 1; }
  void sleep_until_ns(std::int64_t) noexcept override {}
};

class FalconLinkTest : public testing::Test {
 protected:
  FalconLinkTest() {
    usb = {};
    usb.always_ready = eventfd(1, EFD_CLOEXEC);
    link = libusb_link(clock);
    EXPECT_TRUE(link->open());
  }
  ~FalconLinkTest() override {
    link.reset();
    ::close(usb.always_ready);
  }
  FalconLinkTest(const FalconLinkTest&) = delete;
  FalconLinkTest& operator=(const FalconLinkTest&) = delete;
  Event exchange() {
    (void)link->send(std::array<std::uint8_t, 16>{});
    return link->wait(1'000'000, packet);
  }
  // How many of so many exchanges go by before it is gone.
  int exchanges(int at_most) {
    int done = 0;
    while (done < at_most && exchange() != Event::gone) {
      ++done;
    }
    return done;
  }

  StandingClock clock;
  std::unique_ptr<UsbLink> link;
  Packet packet;
};

// hal/falcon/README.md: gone when 50 transfers in a row fail.
TEST_F(FalconLinkTest, packets_out_that_fail_fifty_times_in_a_row_end_it_whatever_comes_in) {
  usb.out = LIBUSB_TRANSFER_STALL;
  EXPECT_EQ(exchanges(200), 49);
  usb.out = LIBUSB_TRANSFER_COMPLETED;
  EXPECT_EQ(exchange(), Event::gone) << "for good";
}

TEST_F(FalconLinkTest, packets_out_that_cannot_be_queued_end_it_too) {
  usb.out_refused = true;
  EXPECT_EQ(exchanges(200), 49);
}

TEST_F(FalconLinkTest, packets_in_that_fail_fifty_times_in_a_row_end_it_whatever_goes_out) {
  usb.in = LIBUSB_TRANSFER_ERROR;
  EXPECT_EQ(exchanges(200), 49);
}

TEST_F(FalconLinkTest, packets_that_are_too_long_are_no_failures) {
  usb.in = LIBUSB_TRANSFER_OVERFLOW;
  EXPECT_EQ(exchanges(200), 200);
}

TEST_F(FalconLinkTest, a_transfer_that_succeeds_begins_the_count_of_its_direction_anew) {
  for (int i = 0; i < 3; ++i) {
    usb.out = LIBUSB_TRANSFER_ERROR;
    EXPECT_EQ(exchanges(49), 49);
    usb.out = LIBUSB_TRANSFER_COMPLETED;
    usb.in = LIBUSB_TRANSFER_ERROR;
    EXPECT_EQ(exchanges(49), 49);
    usb.in = LIBUSB_TRANSFER_COMPLETED;
  }
}

TEST_F(FalconLinkTest, a_device_that_is_gone_is_gone_at_once) {
  usb.out = LIBUSB_TRANSFER_NO_DEVICE;
  EXPECT_EQ(exchange(), Event::gone);
}

TEST_F(FalconLinkTest, a_packet_is_sent_only_when_the_device_took_all_of_it) {
  EXPECT_FALSE(link->sent()) << "there was none yet";
  EXPECT_EQ(exchange(), Event::packet);
  EXPECT_TRUE(link->sent());
  for (const auto status : {LIBUSB_TRANSFER_STALL, LIBUSB_TRANSFER_ERROR, LIBUSB_TRANSFER_CANCELLED}) {
    usb.out = status;
    (void)exchange();
    EXPECT_FALSE(link->sending());
    EXPECT_FALSE(link->sent()) << status;
  }
  usb.out = LIBUSB_TRANSFER_COMPLETED;
  usb.out_short = 3;
  (void)exchange();
  EXPECT_FALSE(link->sent()) << "a part of it";
  usb.out_short = 0;
  (void)exchange();
  EXPECT_TRUE(link->sent());
  usb.out_hangs = true;
  (void)exchange();
  EXPECT_TRUE(link->sending());
  EXPECT_FALSE(link->sent());
  usb.out_hangs = false;
  (void)link->wait(1'000'000, packet);
  EXPECT_TRUE(link->sent());
  usb.out_refused = true;
  EXPECT_FALSE(link->send(std::array<std::uint8_t, 16>{}));
  EXPECT_FALSE(link->sent()) << "it was not even queued";
}

}  // namespace
}  // namespace punctum::falcon
