#include "hal/falcon/falcon_handle.hpp"

#include <linux/capability.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include "hal/falcon/boot_stream.hpp"

namespace punctum::falcon {
namespace {

using Unexpected = tl::unexpected<std::string>;

// Memory is locked by then: the default of 8 MB would be, too.
constexpr std::size_t kStack = 256U << 10U;
constexpr std::int64_t kZeroWithin_ns = 100'000'000;

}  // namespace

FalconHandle::FalconHandle(FalconParams params, const ServoThread& servo, hal::Clock& clock,
                           std::unique_ptr<UsbLink> link)
    : params_(std::move(params)), servo_(servo), clock_(clock), link_(std::move(link)) {}

FalconHandle::~FalconHandle() { close(); }

tl::expected<void, std::string> FalconHandle::open() {
  std::vector<std::uint8_t> image;
  if (!params_.firmware.empty()) {
    auto read = read_boot_stream(params_.firmware);
    if (!read) {
      return Unexpected(read.error());
    }
    image = std::move(*read);
  }
  session_.emplace(*link_, clock_);
  auto opened = session_->open(image);
  if (!opened) {
    session_.reset();
  }
  return opened;
}

hal::Served FalconHandle::served() noexcept {
  hal::Served served;
  served.haptic = this;
  return served;
}

tl::expected<void, std::string> FalconHandle::start(std::int64_t /*first_tick_ns*/) {
  pthread_attr_t how;
  pthread_attr_init(&how);
  pthread_attr_setstacksize(&how, kStack);
  stop_ = false;
  pthread_t thread{};
  const int error = pthread_create(&thread, &how, run, this);
  pthread_attr_destroy(&how);
  if (error != 0) {
    return Unexpected(std::string("the thread of the Falcon cannot begin: ") + std::strerror(error));
  }
  thread_ = thread;
  return {};
}

void* FalconHandle::run(void* self) {
  auto& handle = *static_cast<FalconHandle*>(self);
  handle.settle_thread();
  while (!handle.stop_ && handle.session_->pass()) {
  }
  return nullptr;
}

// Without the right to a real-time priority it runs as what it inherited; the core's table of rights says so.
void FalconHandle::settle_thread() const {
  prctl(PR_SET_NAME, "falcon");
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  const long there = std::min<long>(sysconf(_SC_NPROCESSORS_CONF), CPU_SETSIZE);
  for (int cpu = 0; cpu < there; ++cpu) {
    if (params_.cpu >= 0 ? cpu == params_.cpu : (cpu != servo_.cpu || there == 1)) {
      CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    }
  }
  (void)sched_setaffinity(0, sizeof(cpus), &cpus);
  const sched_param below{std::max(servo_.priority - 1, 1)};
  (void)sched_setscheduler(0, SCHED_FIFO, &below);
  // Nothing from here on needs a capability.
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  const __user_cap_data_struct none[2] = {};
  (void)syscall(SYS_capset, &header, none);
}

void FalconHandle::safe_state() noexcept {
  if (!session_) {
    return;
  }
  session_->release();
  const std::int64_t until_ns = clock_.now_ns() + kZeroWithin_ns;
  while (!session_->released() && clock_.now_ns() < until_ns) {
    if (thread_) {
      clock_.sleep_until_ns(clock_.now_ns() + 1'000'000);
    } else if (!session_->pass()) {
      return;
    }
  }
}

void FalconHandle::stop_thread() noexcept {
  if (thread_) {
    stop_ = true;
    pthread_join(*thread_, nullptr);
    thread_.reset();
  }
}

void FalconHandle::close() noexcept {
  stop_thread();
  if (session_) {
    std::fputs(session_->report().c_str(), stderr);
    session_.reset();
    link_->close();
  }
}

}  // namespace punctum::falcon
