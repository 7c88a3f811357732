#include "tools/record/disk_sync.hpp"

#include <unistd.h>

namespace punctum::tools {

DiskSync::DiskSync(int descriptor) : descriptor_(descriptor), thread_([this] { run(); }) {}

DiskSync::~DiskSync() {
  {
    const std::scoped_lock lock(mutex_);
    over_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void DiskSync::want() {
  {
    const std::scoped_lock lock(mutex_);
    wanted_ = true;
  }
  changed_.notify_one();
}

void DiskSync::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return wanted_ || over_; });
    if (!wanted_) {
      return;
    }
    wanted_ = false;
    lock.unlock();
    (void)::fdatasync(descriptor_);  // a pipe or a file system without: there is nothing to be done
    lock.lock();
  }
}

}  // namespace punctum::tools
