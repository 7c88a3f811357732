// The messages of a recording, each as what it is, force effects in the order of this build.
#pragma once

#include <fmt/format.h>

#include <climits>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "tools/record/effect_order.hpp"
#include "tools/record/mcap_reader.hpp"
#include "tools/record/recording.hpp"
#include "tools/wire/messages.hpp"

namespace punctum::tools {

// Of all kinds together: what the recorder has not seen.
[[nodiscard]] inline std::uint64_t lost_messages(const v1::Loss& l) {
  return l.telemetry() + l.observations() + l.surfaces() + l.events() + l.truth() + l.unusable() +
         l.inputs() + l.pictures();
}

class RecordingReader {
 public:
  // The error is one line.
  [[nodiscard]] static tl::expected<RecordingReader, std::string> open(const std::string& path) {
    auto file = mcap::Reader::open(path);
    if (!file) {
      return tl::unexpected(file.error());
    }
    return RecordingReader(std::move(*file), path);
  }

  // Calls `take` with the next message if it takes such; false at the end. The error is one line: why it ends
  // before its end.
  template <class Take>
  [[nodiscard]] tl::expected<bool, std::string> next(Take& take) {
    mcap::Message m;
    const auto more = file_.next(m);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      return file_.finished()
                 ? tl::expected<bool, std::string>(false)
                 : tl::unexpected(fmt::format("{}: was not finished; all of it up to byte {} is read", path_,
                                              file_.complete()));
    }
    const bool known = give(m, take);
    if (!refusal_.empty()) {
      return tl::unexpected(path_ + ": " + refusal_);
    }
    if (!known) {
      return tl::unexpected(
          fmt::format("{}: a message of channel {} is none of its schema", path_, m.channel));
    }
    return true;
  }

  // All that are left, in the order of the file. The result: why it is not the whole run, in a line, for it
  // ends before its end or has holes; empty if it is.
  template <class Take>
  [[nodiscard]] std::string read_all(Take& take) {
    for (;;) {
      const auto more = next(take);
      if (!more) {
        return more.error();
      }
      if (!*more) {
        return holes();
      }
    }
  }

 private:
  RecordingReader(mcap::Reader file, std::string path) : file_(std::move(file)), path_(std::move(path)) {}

  [[nodiscard]] std::string holes() const {
    const std::uint64_t lost = lost_messages(loss_);
    return lost == 0
               ? std::string()
               : fmt::format("{}: has holes: {} messages did not reach the recorder, {} ticks among them",
                             path_, lost, loss_.telemetry());
  }

  template <class Message>
  static void put_in_order(Message& /*message*/) {}
  void put_in_order(v1::Telemetry& t) const { order_.apply(t); }
  void put_in_order(v1::Event& e) const { order_.apply(e); }
  void put_in_order(v1::Scene& s) {
    auto order = EffectOrder::of(s);
    if (order) {
      order_ = std::move(*order);
    } else {
      refusal_ = order.error();
    }
  }

  template <class Message, class Take>
  [[nodiscard]] bool give(const mcap::Message& m, Message& message, Take& take) {
    if (m.data.size() > INT_MAX || !message.ParseFromArray(m.data.data(), static_cast<int>(m.data.size()))) {
      return false;
    }
    put_in_order(message);
    if (!refusal_.empty()) {
      return true;
    }
    if constexpr (requires { take.log_ns; }) {
      take.log_ns = m.log_ns;
    }
    if constexpr (requires { take.publish_ns; }) {
      take.publish_ns = m.publish_ns;
    }
    if constexpr (requires { take(std::as_const(message)); }) {
      take(std::as_const(message));
    }
    return true;
  }
  template <class Take>
  [[nodiscard]] bool give(const mcap::Message& m, Take& take) {
    const mcap::Channel& channel = file_.channels().at(m.channel);
    const auto schema = file_.schemas().find(channel.schema);
    const auto is = [&](Stream s) {
      const Topic& t = kTopics[static_cast<std::size_t>(s)];
      return channel.topic == t.name && schema != file_.schemas().end() && schema->second.name == t.schema;
    };
    return is(Stream::telemetry)     ? give(m, telemetry_, take)
           : is(Stream::truth)       ? give(m, truth_, take)
           : is(Stream::observation) ? give(m, observation_, take)
           : is(Stream::event)       ? give(m, event_, take)
           : is(Stream::surface)     ? give(m, surface_, take)
           : is(Stream::status)      ? give(m, status_, take)
           : is(Stream::scene)       ? give(m, scene_, take)
           : is(Stream::loss)        ? give(m, loss_, take)
           : is(Stream::input)       ? give(m, input_, take)
           : is(Stream::picture)     ? give(m, picture_, take)
                                     : true;
  }

  mcap::Reader file_;
  std::string path_, refusal_;
  EffectOrder order_;
  v1::Scene scene_;
  v1::Telemetry telemetry_;
  v1::Truth truth_;
  v1::Observation observation_;
  v1::CellSurface surface_;
  v1::Event event_;
  v1::Status status_;
  v1::Loss loss_;
  v1::Input input_;
  v1::Picture picture_;
};

}  // namespace punctum::tools
