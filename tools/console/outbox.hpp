// What waits to be sent to one client: bounded, so that a client that does not read costs no memory and keeps
// nobody else waiting. When it is full the oldest message goes, and is counted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace punctum::console {

struct Outgoing {
  std::string head;                         // of this client alone
  std::shared_ptr<const std::string> body;  // shared by all; null: there is none
  bool text = false;

  [[nodiscard]] std::size_t size() const { return head.size() + (body ? body->size() : 0); }
};

class Outbox {
 public:
  Outbox(std::size_t most_messages, std::size_t most_bytes)
      : most_messages_(most_messages), most_bytes_(most_bytes) {}

  void push(Outgoing message) {
    bytes_ += message.size();
    waiting_.push_back(std::move(message));
    while (waiting_.size() > 1 && (messages() > most_messages_ || bytes_ > most_bytes_)) {
      bytes_ -= waiting_.front().size();
      waiting_.pop_front();
      ++dropped_;
    }
  }

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

  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  [[nodiscard]] std::size_t messages() const { return waiting_.size() + (under_way_ ? 1 : 0); }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  std::size_t most_messages_, most_bytes_;
  std::deque<Outgoing> waiting_;
  std::optional<Outgoing> under_way_;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace punctum::console
