// Emulated drives on a CAN interface of the kernel.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tools/emulators/drive/drive.hpp"

namespace punctum::emulator {

// Empty, or what is wrong with these node numbers on one bus.
[[nodiscard]] std::string check_nodes(const std::vector<int>& nodes);

class DriveBus {
 public:
  DriveBus() = default;
  ~DriveBus();
  DriveBus(const DriveBus&) = delete;
  DriveBus& operator=(const DriveBus&) = delete;

  // Empty, or the line that says why not.
  [[nodiscard]] std::string open(const std::string& interface);
  void add(const DriveParams& params) { drives_.push_back(std::make_unique<Drive>(params)); }

  // Gives every frame that waits to every drive, moves them, and sends what they have to say. False: the
  // interface is gone. Wait for socket() to be readable, but not for longer than a millisecond.
  [[nodiscard]] bool serve();
  [[nodiscard]] int socket() const { return socket_; }

  // A fault or a bad habit (Drive::command) of all, or behind a node number of one. Empty: done.
  [[nodiscard]] std::string command(const std::string& line);

  [[nodiscard]] std::size_t size() const { return drives_.size(); }
  [[nodiscard]] Drive& drive(std::size_t i) { return *drives_[i]; }

 private:
  std::vector<std::unique_ptr<Drive>> drives_;
  int socket_ = -1;
};

}  // namespace punctum::emulator
