// What a recording holds: one channel for each kind of message of tools/wire.
#pragma once

#include <cstddef>
#include <cstdint>

namespace punctum::tools {

enum class Stream : std::uint8_t {
  scene,
  telemetry,
  truth,
  observation,
  surface,
  event,
  status,
  loss,
  input,
  picture
};

struct Topic {
  const char* name;
  const char* schema;
};
inline constexpr Topic kTopics[] = {
    {"/scene", "punctum.v1.Scene"},         {"/telemetry", "punctum.v1.Telemetry"},
    {"/truth", "punctum.v1.Truth"},         {"/observation", "punctum.v1.Observation"},
    {"/surface", "punctum.v1.CellSurface"}, {"/event", "punctum.v1.Event"},
    {"/status", "punctum.v1.Status"},       {"/loss", "punctum.v1.Loss"},
    {"/input", "punctum.v1.Input"},         {"/picture", "punctum.v1.Picture"}};  // in the order of Stream
inline constexpr std::size_t kStreams = sizeof kTopics / sizeof kTopics[0];

}  // namespace punctum::tools
