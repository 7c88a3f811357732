// How often one client may send: `most` messages at once, and `per_s` a second in the long run.
#pragma once

#include <algorithm>

namespace punctum::console {

class TokenBucket {
 public:
  TokenBucket(double most, double per_s) : most_(most), per_s_(per_s), tokens_(most) {}

  // now_s never goes back.
  [[nodiscard]] bool take(double now_s) {
    tokens_ = std::min(most_, tokens_ + (now_s - last_s_) * per_s_);
    last_s_ = now_s;
    if (tokens_ < 1) {
      return false;
    }
    tokens_ -= 1;
    return true;
  }

 private:
  double most_, per_s_, tokens_;
  double last_s_ = 0;
};

}  // namespace punctum::console
