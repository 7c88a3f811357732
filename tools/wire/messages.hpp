// The structs of a station's segments as messages of station.proto. A message is filled in place, so that one
// may be used again and again. Whatever stands in a segment becomes a message that can be read: enumerators
// that do not exist keep their number.
#pragma once

#include <cstdint>
#include <string_view>

#include "rt/station/core_status.hpp"
#include "rt/station/event.hpp"
#include "rt/station/input.hpp"
#include "rt/station/observation.hpp"
#include "rt/station/picture.hpp"
#include "rt/station/surface.hpp"
#include "rt/station/telemetry.hpp"
#include "tools/wire/station.pb.h"

namespace punctum::tools {

// The schema as a serialised google.protobuf.FileDescriptorSet, for whoever reads without this program.
[[nodiscard]] std::string_view wire_schema();

void to_wire(const rt::TelemetrySample& from, v1::Telemetry& to);
void to_wire(const rt::Observation& from, v1::Observation& to);
void to_wire(const rt::InputSample& from, v1::Input& to);
void to_wire(const rt::CellSurface& from, v1::CellSurface& to);
void to_wire(const rt::Event& from, v1::Event& to);
void to_wire(const rt::PictureHead& from, v1::Picture& to);  // all but the pixels
void to_wire(const rt::CoreStatus& from, v1::Status& to);    // may be written meanwhile

// Back again, for whoever works on a recording. False: it names what this program does not know.
[[nodiscard]] bool from_wire(const v1::Telemetry& from, rt::TelemetrySample& to);
void from_wire(const v1::Observation& from, rt::Observation& to);
void from_wire(const v1::Input& from, rt::InputSample& to);
void from_wire(const v1::CellSurface& from, rt::CellSurface& to);
void from_wire(const v1::Event& from, rt::Event& to);
void from_wire(const v1::Histogram& from, rt::TimeHistogram& to);
// All but the pixels. False: it has not as many pixels as it says.
[[nodiscard]] bool from_wire(const v1::Picture& from, rt::PictureHead& to);

}  // namespace punctum::tools
