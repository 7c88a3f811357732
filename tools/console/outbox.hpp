// What waits to be sent to one client: bounded, so that a client that does not read costs no memory and keeps
// nobody else waiting. When it is full the oldest message goes, and is counted; but not one that holds until
// the next of its kind, of which the newest alone waits.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace punctum::console {

struct Outgoing {
  std::string head;                                   // of this client alone
  std::shared_ptr<const std::string> body = nullptr;  // shared by all; null: there is none
  bool text = false;
  std::optional<std::uint32_t> holds_for = std::nullopt;  // its kind: the subscription
  double since_s = 0;                                     // it waits; what is pushed later has a later one

  [[nodiscard]] std::size_t size() const { return head.size() + (body ? body->size() : 0); }
};

class Outbox {
 public:
  Outbox(std::size_t most_messages, std::size_t most_bytes)
      : most_messages_(most_messages), most_bytes_(most_bytes) {}

  void push(Outgoing message) {
    if (message.holds_for) {
      forget(*message.holds_for);
    }
    bytes_ += message.size();
    waiting_.push_back(std::move(message));
    while (messages() > most_messages_ || bytes_ > most_bytes_) {
      const auto newest = waiting_.end() - 1;
      const auto oldest =
          std::find_if(waiting_.begin(), newest, [](const Outgoing& one) { return !one.holds_for; });
      if (oldest == newest) {
        return;
      }
      erase(oldest);
      ++dropped_;
    }
  }
  // Nobody listens to this kind any more.
  void forget(std::uint32_t kind) {
    const auto one = std::find_if(waiting_.begin(), waiting_.end(),
                                  [kind](const Outgoing& waits) { return waits.holds_for == kind; });
    if (one != waiting_.end()) {
      erase(one);
    }
  }
  // A message that is not even pushed, because the client is too far behind.
  void leave_out() { ++dropped_; }

  // The next one to send, null if there is none or one is under way. Its bytes stay where they are until
  // sent().
  [[nodiscard]] const Outgoing* begin_sending() {
    if (under_way_ || waiting_.empty()) {
      return nullptr;
    }
    under_way_ = std::move(waiting_.front());
    waiting_.pop_front();
    return &*under_way_;
  }
  void sent() {
    bytes_ -= under_way_->size();
    under_way_.reset();
  }

  // For how long the oldest has waited, sent as far as the kernel takes it or not.
  [[nodiscard]] double behind_s(double now_s) const {
    return under_way_ ? now_s - under_way_->since_s : waiting_.empty() ? 0 : now_s - waiting_.front().since_s;
  }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  [[nodiscard]] std::size_t messages() const { return waiting_.size() + (under_way_ ? 1 : 0); }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  void erase(const std::deque<Outgoing>::const_iterator& one) {
    bytes_ -= one->size();
    waiting_.erase(one);
  }

  std::size_t most_messages_, most_bytes_;
  std::deque<Outgoing> waiting_;
  std::optional<Outgoing> under_way_;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace punctum::console
