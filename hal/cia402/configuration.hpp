// What a drive is told before it may move, object by object, over SDO. Set-up code.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/cia402/can_bus.hpp"
#include "hal/cia402/canopen.hpp"
#include "hal/cia402/config.hpp"
#include "hal/devices.hpp"

namespace punctum::cia402 {

// Requests to one node at a time; each waits for its answer. Errors are one line: node, object, what the
// drive said, what to do.
class SdoClient {
 public:
  // `others` is given every frame that is no answer to a request.
  SdoClient(CanBus& bus, hal::Clock& clock, std::function<void(const CanFrame&)> others)
      : bus_(bus), clock_(clock), others_(std::move(others)) {}

  struct Object {
    ObjectId id;
    std::size_t bytes = 0;
    std::uint32_t value = 0;
    const char* name = "";
    const char* advice = "";  // what to look at when the drive refuses it
  };

  [[nodiscard]] tl::expected<void, std::string> download(int node, const Object& object);
  // object.bytes: how many the number has at least; the value is not used.
  [[nodiscard]] tl::expected<std::uint32_t, std::string> upload(int node, const Object& object);
  // As upload; an object that is not there, or cannot be read, is `otherwise`.
  [[nodiscard]] tl::expected<std::uint32_t, std::string> upload_if_there(int node, const Object& object,
                                                                         std::uint32_t otherwise);
  void pass(std::int64_t for_ns);  // the frames that come within this time

 private:
  [[nodiscard]] tl::expected<SdoAnswer, std::string> ask(int node, const Object& object,
                                                         const CanFrame& request);
  CanBus& bus_;
  hal::Clock& clock_;
  std::function<void(const CanFrame&)> others_;
};

[[nodiscard]] std::string hex(std::uint32_t value, int digits);
[[nodiscard]] std::string text_of(int node, const SdoClient::Object& object);  // "node 3: 6065:00 (window)"

// What is written to a drive, in this order, while it is pre-operational and without power.
[[nodiscard]] std::vector<SdoClient::Object> configuration(const CanStageParams& params,
                                                           const AxisParams& axis, double cycle_s);
// And to the force sensor (CiA 404).
[[nodiscard]] std::vector<SdoClient::Object> force_sensor_configuration(const CanStageParams& params);

}  // namespace punctum::cia402
