// Brings a file to the disk now and then, beside whoever writes it: a disk that is busy keeps nobody waiting.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

namespace punctum::tools {

class DiskSync {
 public:
  explicit DiskSync(int descriptor);
  ~DiskSync();  // what was wanted is on the disk
  DiskSync(const DiskSync&) = delete;
  DiskSync& operator=(const DiskSync&) = delete;

  void want();  // all that is written so far; does not wait

 private:
  void run();

  int descriptor_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool wanted_ = false, over_ = false;
  std::thread thread_;
};

}  // namespace punctum::tools
