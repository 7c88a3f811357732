// A recording as anyone may have written, cut or damaged it: read to its end or to one line of error, in
// bounded memory; and what is read of it, written again, reads back.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

#include "tests/fuzz/must.hpp"
#include "tools/record/mcap_reader.hpp"
#include "tools/wire/messages.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum::tools;
  if (size == 0) {
    return 0;
  }
  auto* bytes = const_cast<std::uint8_t*>(data);
  auto reader = mcap::Reader::read(fmemopen(bytes, size, "rb"), "input");
  const auto is_one_line = [](const std::string& error) {
    must(error.starts_with("input: byte ") && error.find('\n') == std::string::npos,
         "an error that says no place", error);
  };
  if (!reader) {
    is_one_line(reader.error());
    return 0;
  }
  mcap::Message message;
  std::uint64_t bytes_read = 0;
  for (;;) {
    const auto more = reader->next(message);
    if (!more) {
      is_one_line(more.error());
      const auto again = reader->next(message);
      must(again && !*again, "something after an error");
      must(!reader->finished(), "a finished file with an error");
      break;
    }
    if (!*more) {
      break;
    }
    bytes_read += message.data.size();
    const auto& channel = reader->channels().at(message.channel);
    must(channel.schema == 0 || reader->schemas().contains(channel.schema), "a channel without its schema");
    // Whatever the topic says: the bytes as each message that export reads.
    punctum::v1::Telemetry telemetry;
    punctum::rt::TelemetrySample sample;
    if (telemetry.ParseFromArray(message.data.data(), static_cast<int>(message.data.size())) &&
        from_wire(telemetry, sample)) {
      punctum::v1::Telemetry written;
      to_wire(sample, written);
      punctum::rt::TelemetrySample twice;
      must(from_wire(written, twice), "what was usable is not, once written");
      must(twice.tick == sample.tick && twice.phase == sample.phase && twice.cell == sample.cell,
           "another sample");
    }
    punctum::v1::Observation observation;
    punctum::rt::Observation seen;
    if (observation.ParseFromArray(message.data.data(), static_cast<int>(message.data.size()))) {
      from_wire(observation, seen);
    }
    punctum::v1::Input input;
    punctum::rt::InputSample given;
    if (input.ParseFromArray(message.data.data(), static_cast<int>(message.data.size()))) {
      from_wire(input, given);
    }
    punctum::v1::Picture picture;
    punctum::rt::PictureHead head;
    if (picture.ParseFromArray(message.data.data(), static_cast<int>(message.data.size())) &&
        from_wire(picture, head)) {
      must(head.outer.count <= punctum::rt::SeenContour::kMost && head.step_px > 0, "a contour too long");
    }
    punctum::v1::CellSurface surface;
    punctum::rt::CellSurface net;
    if (surface.ParseFromArray(message.data.data(), static_cast<int>(message.data.size()))) {
      from_wire(surface, net);
    }
  }
  must(bytes_read <= size, "more than there is");
  must(reader->complete() <= size, "a place behind the end");
  return 0;
}
