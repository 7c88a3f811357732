#include "hal/browser/browser_hand.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

namespace punctum::browser {

hal::Served BrowserHand::served() noexcept {
  hal::Served served;
  served.haptic = this;
  return served;
}

hal::Status BrowserHand::read(hal::HandState& out) NONBLOCKING {
  const std::int64_t now_ns = clock_.now_ns();
  Fingers fingers;
  std::uint64_t index = 0;
  const bool told = fingers_.newest.newest(fingers, index) == hal::Read::ok && fingers.session != 0 &&
                    fingers.told_ns >= now_ns - kSilent_ns && fingers.told_ns <= now_ns + kSilent_ns;
  out = {};
  if (told) {
    out.buttons = follow(fingers);
  } else {
    session_ = 0;
  }
  out.position_m = follower_.at(now_ns);
  out.sample_ns = now_ns;
  return hal::Status::ok;
}

// The buttons that count.
std::uint32_t BrowserHand::follow(const Fingers& now) NONBLOCKING {
  constexpr std::uint32_t kButtons =
      hal::kButtonClutch | hal::kButtonInject | hal::kButtonNextCell | hal::kButtonEnable;
  const bool same = now.session == session_;
  let_go_ = let_go_ && same;  // since it was taken
  double way_m[3] = {};
  for (std::size_t i = 0; i < 3; ++i) {
    way_m[i] = same ? now.moved_m[i] - moved_m_[i] : 0;
    if (!std::isfinite(now.moved_m[i]) || !(std::abs(way_m[i]) <= kFarthest_m)) {
      session_ = 0;
      return 0;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    follower_.move(i, way_m[i]);
  }
  session_ = now.session;
  std::copy(std::begin(now.moved_m), std::end(now.moved_m), std::begin(moved_m_));
  let_go_ = let_go_ || (now.buttons & hal::kButtonEnable) == 0;
  return now.buttons & (let_go_ ? kButtons : kButtons & ~hal::kButtonEnable);
}

}  // namespace punctum::browser
