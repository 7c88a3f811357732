// Who controls: at most one client at a time, and only as long as it keeps saying so.
#pragma once

#include <cstdint>

namespace punctum::console {

class ControlLease {
 public:
  static constexpr double kTerm_s = 1.5;  // from one heartbeat on; a page sends one every 0.5 s

  // Takes or keeps it; false while another has it. `client` is not 0; now_s never goes back.
  [[nodiscard]] bool hold(std::uint64_t client, double now_s) {
    if (holder_ != 0 && holder_ != client) {
      return false;
    }
    holder_ = client;
    until_s_ = now_s + kTerm_s;
    return true;
  }
  void give_back(std::uint64_t client) { holder_ = holder_ == client ? 0 : holder_; }
  // True once, when its holder has been silent for too long. Until this was asked for nobody else gets it.
  [[nodiscard]] bool lapses(double now_s) {
    if (holder_ == 0 || now_s <= until_s_) {
      return false;
    }
    holder_ = 0;
    return true;
  }
  [[nodiscard]] bool is_held_by(std::uint64_t client, double now_s) const {
    return holder_ == client && now_s <= until_s_;
  }
  [[nodiscard]] std::uint64_t holder() const { return holder_; }  // 0: nobody

 private:
  std::uint64_t holder_ = 0;
  double until_s_ = 0;
};

}  // namespace punctum::console
