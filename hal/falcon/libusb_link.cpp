#include "hal/falcon/libusb_link.hpp"

#include <libusb.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "hal/kernel_call.hpp"

namespace punctum::falcon {
namespace {

using Unexpected = tl::unexpected<std::string>;

constexpr std::uint16_t kVendor = 0x0403, kProduct = 0xCB48;
constexpr int kInterface = 0;
constexpr unsigned char kIn = 0x81, kOut = 0x02;
constexpr std::uint8_t kToChip = 0x40;  // vendor request to the device
constexpr unsigned kControlWithin_ms = 500;
constexpr int kMostErrors = 50;  // in a row: a cable or a hub that is no more

// Each direction has its own: packets with nothing but status come in every millisecond, and say nothing of
// an endpoint that takes no force.
class Errors {
 public:
  // Whether they end the link.
  [[nodiscard]] bool one_more() { return ++in_a_row_ >= kMostErrors; }
  void none() { in_a_row_ = 0; }

 private:
  int in_a_row_ = 0;
};

// The one system call of the tick: it adds 1 to a counter in the kernel, and never waits for one that starts
// at 0.
void add_one(int counter) NONBLOCKING {
  const std::uint64_t one = 1;
  [[maybe_unused]] const hal::Answer written = hal::kernel_call<::write>(counter, &one, sizeof(one));
}

std::string text_of(int error) { return libusb_strerror(static_cast<libusb_error>(error)); }

class LibusbLink final : public UsbLink {
 public:
  explicit LibusbLink(const hal::Clock& clock) : clock_(clock) {}
  ~LibusbLink() override { close(); }
  LibusbLink(const LibusbLink&) = delete;
  LibusbLink& operator=(const LibusbLink&) = delete;

  tl::expected<void, std::string> open() override {
    auto opened = claim();
    if (!opened) {
      close();
    }
    return opened;
  }
  void close() noexcept override;
  bool control(std::uint8_t request, std::uint16_t value) override {
    return !gone_ &&
           libusb_control_transfer(device_, kToChip, request, value, 0, nullptr, 0, kControlWithin_ms) == 0;
  }
  bool send(std::span<const std::uint8_t> bytes) override;
  bool sending() const override { return out_.queued; }
  bool sent() const override { return out_.whole; }
  Event wait(std::int64_t longest_ns, Packet& out) override;
  void wake() NONBLOCKING override { add_one(wake_); }

 private:
  // A transfer and what became of it.
  struct Transfer {
    libusb_transfer* transfer = nullptr;
    std::array<std::uint8_t, kPacketSize> bytes{};
    std::int64_t ended_ns = 0;
    bool queued = false;
    bool ended = false;  // and nobody has looked yet
    bool whole = false;  // every byte that was asked for went over
    const hal::Clock* clock = nullptr;
  };

  [[nodiscard]] tl::expected<void, std::string> claim();
  [[nodiscard]] tl::expected<void, std::string> find();
  void fill(Transfer& t, unsigned char endpoint);
  [[nodiscard]] bool submit(Transfer& t);
  static void LIBUSB_CALL on_end(libusb_transfer* transfer);
  void handle_events();
  [[nodiscard]] static bool fatal(libusb_transfer_status status, Errors& errors);

  const hal::Clock& clock_;
  libusb_context* context_ = nullptr;
  libusb_device_handle* device_ = nullptr;
  bool claimed_ = false, gone_ = false;
  Transfer in_, out_;
  int wake_ = -1;
  Errors in_errors_, out_errors_, event_errors_;
  std::vector<pollfd> polled_;
};

tl::expected<void, std::string> LibusbLink::claim() {
  if (const int error = libusb_init(&context_); error != 0) {
    context_ = nullptr;
    return Unexpected("libusb cannot begin: " + text_of(error) + " (is there a USB bus, /dev/bus/usb?)");
  }
  if (auto found = find(); !found) {
    return found;
  }
  (void)libusb_set_auto_detach_kernel_driver(device_, 1);
  if (const int error = libusb_claim_interface(device_, kInterface); error != 0) {
    return Unexpected("the Falcon is used by another program, or cannot be claimed: " + text_of(error));
  }
  claimed_ = true;
  wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wake_ < 0) {
    return Unexpected("the kernel gives no event counter");
  }
  polled_ = {{wake_, POLLIN, 0}};
  const libusb_pollfd** const list = libusb_get_pollfds(context_);
  for (const libusb_pollfd** each = list; each != nullptr && *each != nullptr; ++each) {
    polled_.push_back({(*each)->fd, (*each)->events, 0});
  }
  libusb_free_pollfds(list);
  fill(in_, kIn);
  fill(out_, kOut);
  if (in_.transfer == nullptr || out_.transfer == nullptr || !submit(in_)) {
    return Unexpected("the Falcon cannot be read from: unplug it and plug it in again");
  }
  return {};
}

tl::expected<void, std::string> LibusbLink::find() {
  libusb_device** list = nullptr;
  const ssize_t size = libusb_get_device_list(context_, &list);
  int error = LIBUSB_ERROR_NO_DEVICE;
  for (ssize_t i = 0; i < size && device_ == nullptr; ++i) {
    libusb_device_descriptor about{};
    if (libusb_get_device_descriptor(list[i], &about) == 0 && about.idVendor == kVendor &&
        about.idProduct == kProduct) {
      error = libusb_open(list[i], &device_);
    }
  }
  if (size >= 0) {
    libusb_free_device_list(list, 1);
  }
  if (device_ != nullptr) {
    return {};
  }
  if (error == LIBUSB_ERROR_ACCESS) {
    return Unexpected("the Falcon may not be opened by this user: hal/falcon/README.md has the udev rule");
  }
  return Unexpected(error == LIBUSB_ERROR_NO_DEVICE
                        ? "no Falcon (USB 0403:cb48) is plugged in: lsusb shows what is"
                        : "the Falcon cannot be opened: " + text_of(error));
}

void LibusbLink::fill(Transfer& t, unsigned char endpoint) {
  t = {};
  t.clock = &clock_;
  t.transfer = libusb_alloc_transfer(0);
  if (t.transfer != nullptr) {
    libusb_fill_bulk_transfer(t.transfer, device_, endpoint, t.bytes.data(), kPacketSize, on_end, &t, 0);
  }
}

bool LibusbLink::submit(Transfer& t) {
  t.whole = false;
  t.queued = libusb_submit_transfer(t.transfer) == 0;
  return t.queued;
}

void LIBUSB_CALL LibusbLink::on_end(libusb_transfer* transfer) {
  auto& t = *static_cast<Transfer*>(transfer->user_data);
  t.ended_ns = t.clock->now_ns();
  t.queued = false;
  t.ended = true;
  t.whole = transfer->status == LIBUSB_TRANSFER_COMPLETED && transfer->actual_length == transfer->length;
}

void LibusbLink::close() noexcept {
  if (device_ != nullptr) {
    for (Transfer* t : {&in_, &out_}) {
      if (t->queued) {
        (void)libusb_cancel_transfer(t->transfer);
      }
    }
    // A device that is gone ends its transfers at once, another one within a frame of the bus.
    for (int i = 0; i < 100 && (in_.queued || out_.queued); ++i) {
      timeval ten_ms{0, 10'000};
      (void)libusb_handle_events_timeout_completed(context_, &ten_ms, nullptr);
    }
    for (Transfer* t : {&in_, &out_}) {
      if (!t->queued) {
        libusb_free_transfer(t->transfer);
      }
      t->transfer = nullptr;
    }
    if (claimed_) {
      (void)libusb_release_interface(device_, kInterface);
    }
    libusb_close(device_);
    device_ = nullptr;
  }
  claimed_ = gone_ = false;
  in_errors_ = out_errors_ = event_errors_ = {};
  if (context_ != nullptr) {
    libusb_exit(context_);
    context_ = nullptr;
  }
  if (wake_ >= 0) {
    ::close(wake_);
    wake_ = -1;
  }
}

bool LibusbLink::send(std::span<const std::uint8_t> bytes) {
  if (gone_ || out_.queued || bytes.size() > kPacketSize) {
    return false;
  }
  std::copy(bytes.begin(), bytes.end(), out_.bytes.begin());
  out_.transfer->length = static_cast<int>(bytes.size());
  const bool queued = submit(out_);
  gone_ = !queued && out_errors_.one_more();
  return queued;
}

// Whether this ends it. Packets that did not fit are none of its errors.
bool LibusbLink::fatal(libusb_transfer_status status, Errors& errors) {
  if (status == LIBUSB_TRANSFER_COMPLETED || status == LIBUSB_TRANSFER_OVERFLOW) {
    errors.none();
    return false;
  }
  return status == LIBUSB_TRANSFER_NO_DEVICE || errors.one_more();
}

void LibusbLink::handle_events() {
  timeval none{};
  if (const int error = libusb_handle_events_timeout_completed(context_, &none, nullptr);
      error != 0 && error != LIBUSB_ERROR_INTERRUPTED) {
    gone_ = event_errors_.one_more() || gone_;
  } else {
    event_errors_.none();
  }
}

Event LibusbLink::wait(std::int64_t longest_ns, Packet& out) {
  if (!gone_ && !in_.ended && !out_.ended) {
    const timespec longest{static_cast<time_t>(longest_ns / 1'000'000'000),
                           static_cast<long>(longest_ns % 1'000'000'000)};
    if (ppoll(polled_.data(), polled_.size(), &longest, nullptr) > 0) {
      if ((polled_.front().revents & POLLIN) != 0) {
        std::uint64_t calls = 0;
        [[maybe_unused]] const ssize_t taken = ::read(wake_, &calls, sizeof(calls));
      }
      handle_events();
    }
  }
  if (out_.ended) {
    out_.ended = false;
    gone_ = gone_ || fatal(out_.transfer->status, out_errors_);
  }
  if (!in_.ended) {
    return gone_ ? Event::gone : Event::nothing;
  }
  in_.ended = false;
  const auto status = in_.transfer->status;
  gone_ = gone_ || fatal(status, in_errors_);
  if (status == LIBUSB_TRANSFER_COMPLETED) {
    out.size = std::min(static_cast<std::size_t>(in_.transfer->actual_length), kPacketSize);
    out.bytes = in_.bytes;
    out.received_ns = in_.ended_ns;
  }
  gone_ = gone_ || !submit(in_);
  if (gone_) {
    return Event::gone;
  }
  return status == LIBUSB_TRANSFER_COMPLETED  ? Event::packet
         : status == LIBUSB_TRANSFER_OVERFLOW ? Event::oversized
                                              : Event::nothing;
}

}  // namespace

std::unique_ptr<UsbLink> libusb_link(const hal::Clock& clock) { return std::make_unique<LibusbLink>(clock); }

}  // namespace punctum::falcon
