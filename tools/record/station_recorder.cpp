#include "tools/record/station_recorder.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "hal/sim/valid.hpp"
#include "rt/forces/list.hpp"
#include "tools/shared/station_values.hpp"
#include "tools/shared/version.hpp"

namespace punctum::tools {
namespace {

constexpr std::chrono::milliseconds kChunkLasts{400};  // with the round it is in, less than half a second
constexpr std::uint64_t kChunkSpans_ns = 500'000'000;
constexpr std::size_t kLargestChunk = 4U << 20U;
constexpr std::uint64_t kMostTicksPerRound = 4096;
constexpr std::uint64_t kTicksAtATime = 64;  // then the rings that are short
constexpr std::uint64_t kAll = ~std::uint64_t{0};

// A quarter of the ring ahead of the writer, who goes on meanwhile.
template <class Ring>
hal::Follower<Ring> follow(const Ring& ring, const RecordedStation& station) {
  if (station.from_the_first_tick) {
    return hal::Follower<Ring>(ring);
  }
  const std::uint64_t head = ring.head(), room = Ring::kSize - Ring::kSize / 4;
  return hal::Follower<Ring>(ring, head > room ? head - room : 0);
}

std::int64_t utc_less_station_ns(ClockKind clock) {
  if (clock == ClockKind::virtual_time) {
    return 0;
  }
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  const auto station = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count() -
         std::chrono::duration_cast<std::chrono::nanoseconds>(station).count();
}

}  // namespace

tl::expected<std::unique_ptr<StationRecorder>, std::string> StationRecorder::create(
    const std::string& path, const RecordedStation& station, const Scene& scene) {
  auto file = mcap::Writer::create(path, version_line("punctum-record"));
  if (!file) {
    return tl::unexpected(file.error());
  }
  const std::int64_t utc_ns = utc_less_station_ns(scene.clock);
  file->metadata("punctum", {{"station", station.name},
                             {"schema", "punctum.v1"},
                             {"clock", scene.clock == ClockKind::real ? "real" : "virtual"},
                             {"file_time_less_station_time_ns", std::to_string(utc_ns)}});
  return std::unique_ptr<StationRecorder>(new StationRecorder(std::move(*file), station, scene, utc_ns));
}

StationRecorder::StationRecorder(mcap::Writer file, const RecordedStation& station, const Scene& scene,
                                 std::int64_t utc_ns)
    : file_(std::move(file)),
      sync_(std::make_unique<DiskSync>(file_.descriptor())),
      core_(station.core),
      sim_(scene.sim.value_or(sim::SimConfig{})),
      utc_ns_(utc_ns),
      period_ns_(static_cast<std::uint64_t>(std::llround(1e9 / scene.servo.rate_Hz))),
      telemetry_(follow(station.core.telemetry, station)),
      events_(follow(station.core.events, station)),
      world_of_tick_(static_cast<std::int64_t>(period_ns_)) {
  if (station.observation != nullptr) {
    observations_ =
        std::make_unique<hal::Follower<rt::ObservationSlot>>(follow(station.observation->slot, station));
    surfaces_ =
        std::make_unique<hal::Follower<rt::SurfaceSlot>>(follow(station.observation->surface, station));
  }
  if (station.bench != nullptr) {
    snapshots_ = std::make_unique<hal::Follower<SnapshotRing>>(follow(station.bench->snapshots, station));
  }
  if (station.inputs != nullptr) {
    inputs_ring_ = &station.inputs->ring;
    inputs_ = std::make_unique<hal::Follower<rt::InputRing>>(follow(*inputs_ring_, station));
  }
  if (station.pictures != nullptr) {
    picture_ring_ = station.pictures;
    pictures_ = std::make_unique<hal::Follower<rt::PictureSegment::Ring::Heads>>(
        follow(picture_ring_->heads(), station));
  }
  for (std::size_t i = 0; i < kStreams; ++i) {
    channels_[i] = file_.add_channel(file_.add_schema(kTopics[i].schema, "protobuf", wire_schema()),
                                     kTopics[i].name, "protobuf");
  }
  scene_.set_station(station.name);
  scene_.set_toml(station.scene);
  for (std::size_t i = 0; i < rt::effect_count; ++i) {
    scene_.add_effect(rt::effect_name(i));
  }
  scene_.set_rate_hz(scene.servo.rate_Hz);
  scene_.set_simulated(scene.sim.has_value());
  scene_.set_virtual_time(scene.clock == ClockKind::virtual_time);
  chunk_begun_ = std::chrono::steady_clock::now();
}

template <class Message>
void StationRecorder::add(Stream stream, std::uint64_t log_ns, std::uint64_t publish_ns,
                          const Message& message) {
  if (!message.SerializeToString(&bytes_)) {
    ++unusable_;
    return;
  }
  const auto i = static_cast<std::size_t>(stream);
  file_.message(channels_[i], log_ns, publish_ns, bytes_);
  ++counts_[i];
}

void StationRecorder::take(const rt::TelemetrySample& sample) {
  now_ns_ = file_ns(static_cast<std::int64_t>(core_.status.start_ns.load(std::memory_order_relaxed) +
                                              sample.tick * period_ns_));
  if (!scene_told_) {
    if (sample.tick > 0) {
      ticks_from_s_ = sample.t_s;
    }
    chunk_begun_ns_ = now_ns_;
    scene_told_ = true;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    scene_.set_begun_ns(
        static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()));
    add(Stream::scene, scene_);
  }
  to_wire(sample, telemetry_message_);
  add(Stream::telemetry, telemetry_message_);
  if (!snapshots_) {
    return;
  }
  const sim::Snapshot* world = world_of_tick_(sample, [this](sim::Snapshot& out) {
    for (std::uint64_t i = 0; i < sim::kSnapshots && snapshots_->next(out) == hal::Read::ok; ++i) {
      if (sim::valid(out)) {
        return true;
      }
      ++unusable_;
    }
    return false;
  });
  if (world == nullptr) {
    return;
  }
  const RowTruth truth = row_truth(sim_, *world);
  v1::Truth& m = truth_message_;
  m.set_tick(sample.tick);
  m.mutable_tip_m()->set_x(truth.tip_m[0]);
  m.mutable_tip_m()->set_y(truth.tip_m[1]);
  m.mutable_tip_m()->set_z(truth.tip_m[2]);
  m.set_cell(truth.cell);
  m.set_axial_force_n(truth.axial_force_N);
  m.set_gap_m(truth.gap_m);
  m.set_wd_m(truth.wd_m);
  m.set_a_m(truth.a_m);
  m.set_contact(truth.contact);
  m.set_punctured(truth.punctured);
  m.set_lost(truth.lost);
  add(Stream::truth, m);
}

// Ticks with their inputs, and what they were given before both: a chunk that ends here, or a file that ends
// with it, is replayed to its last tick.
std::uint64_t StationRecorder::drain() {
  std::uint64_t taken = 0;
  for (std::uint64_t now = 1; now > 0 && taken < kMostTicksPerRound; taken += now) {
    const std::uint64_t told = inputs_ring_ != nullptr ? inputs_ring_->head() : kAll;
    now = take_ticks(told);
    take_what_vision_found();
    take_pictures();
    take_events();
    take_inputs(std::min(told, telemetry_.position()));
    // In virtual time a chunk of the clock on the wall would be long.
    if (chunk_spans_enough() || file_.chunk_bytes() >= kLargestChunk) {
      close_chunk();
    }
  }
  if (std::chrono::steady_clock::now() >= chunk_begun_ + kChunkLasts) {
    close_chunk();
  }
  return taken;
}

std::uint64_t StationRecorder::take_ticks(std::uint64_t until) {
  std::uint64_t taken = 0;
  while (taken < kTicksAtATime && !chunk_spans_enough() && telemetry_.position() < until &&
         telemetry_.next(sample_) == hal::Read::ok) {
    ++taken;
    if (usable(sample_)) {
      take(sample_);
    } else {
      ++unusable_;
    }
  }
  return taken;
}

// More at a time than ticks: none is left behind where ticks were lost.
void StationRecorder::take_inputs(std::uint64_t until) {
  rt::InputSample input;
  for (std::uint64_t i = 0; inputs_ && i < 2 * kTicksAtATime && inputs_->position() < until &&
                            inputs_->next(input) == hal::Read::ok;
       ++i) {
    to_wire(input, input_message_);
    add(Stream::input, file_ns(input.release_ns), file_ns(input.release_ns), input_message_);
  }
}

// A message is logged when the core could have seen it, and published when its picture was taken.
void StationRecorder::take_what_vision_found() {
  const auto logged = [this](std::uint64_t published) { return now_ns_ != 0 ? now_ns_ : published; };
  rt::Observation observation;
  for (std::size_t i = 0;
       observations_ && i < rt::ObservationSlot::kSize && observations_->next(observation) == hal::Read::ok;
       ++i) {
    to_wire(observation, observation_message_);
    observation_message_.set_number(observations_->position());
    if (counts_[static_cast<std::size_t>(Stream::observation)] == 0 && observations_->position() > 1) {
      observations_from_s_ =
          1e-9 * static_cast<double>(
                     observation.exposure_ns -
                     static_cast<std::int64_t>(core_.status.start_ns.load(std::memory_order_relaxed)));
    }
    const std::uint64_t published = file_ns(observation.exposure_ns);
    add(Stream::observation, logged(published), published, observation_message_);
  }
  rt::CellSurface surface;
  for (std::size_t i = 0;
       surfaces_ && i < rt::SurfaceSlot::kSize && surfaces_->next(surface) == hal::Read::ok; ++i) {
    to_wire(surface, surface_message_);
    const std::uint64_t published = file_ns(surface.exposure_ns);
    add(Stream::surface, logged(published), published, surface_message_);
  }
}

void StationRecorder::take_pictures() {
  rt::PictureHead head;
  for (std::size_t i = 0;
       pictures_ && i < rt::PictureSegment::Ring::Heads::kSize && pictures_->next(head) == hal::Read::ok;
       ++i) {
    if (head.bytes() > rt::PictureSegment::Ring::kLargest) {
      ++unusable_;
      continue;
    }
    std::string& grey = *picture_message_.mutable_grey();
    grey.resize(head.bytes() + 7);
    if (!picture_ring_->read(head, reinterpret_cast<std::uint8_t*>(grey.data()))) {
      ++pictures_lost_;
      continue;
    }
    grey.resize(head.bytes());
    to_wire(head, picture_message_);
    const std::uint64_t published = file_ns(head.exposure_ns);
    add(Stream::picture, now_ns_ != 0 ? now_ns_ : published, published, picture_message_);
    if (file_.chunk_bytes() >= kLargestChunk) {
      close_chunk();
    }
  }
}

void StationRecorder::take_events() {
  rt::Event event;
  for (std::size_t i = 0; i < rt::EventRing::kSize && events_.next(event) == hal::Read::ok; ++i) {
    to_wire(event, event_message_);
    add(Stream::event, event_message_);
    ended_ = ended_ || event.kind == rt::Event::ended;
  }
}

void StationRecorder::tell_state() {
  if (now_ns_ == 0) {  // it has not begun
    return;
  }
  to_wire(core_.status, status_message_);
  add(Stream::status, status_message_);
  if (!lost_nothing()) {
    add(Stream::loss, loss());
  }
}

bool StationRecorder::chunk_spans_enough() const noexcept {
  return now_ns_ - chunk_begun_ns_ >= kChunkSpans_ns;
}

void StationRecorder::close_chunk() {
  chunk_begun_ = std::chrono::steady_clock::now();
  chunk_begun_ns_ = now_ns_;
  if (file_.failure().empty()) {
    tell_state();
    file_.close_chunk();
    if (file_.failure().empty()) {
      written_ = counts_;
    }
    sync_->want();
  }
}

v1::Loss StationRecorder::loss() const {
  v1::Loss loss;
  loss.set_telemetry(telemetry_.lost());
  loss.set_events(events_.lost());
  loss.set_observations(observations_ ? observations_->lost() : 0);
  loss.set_surfaces(surfaces_ ? surfaces_->lost() : 0);
  loss.set_truth(snapshots_ ? snapshots_->lost() : 0);
  loss.set_unusable(unusable_);
  loss.set_inputs(inputs_ ? inputs_->lost() : 0);
  loss.set_pictures(pictures_ ? pictures_->lost() + pictures_lost_ : 0);
  return loss;
}

bool StationRecorder::lost_nothing() const {
  const v1::Loss l = loss();
  return l.telemetry() == 0 && l.events() == 0 && l.observations() == 0 && l.surfaces() == 0 &&
         l.truth() == 0 && l.unusable() == 0 && l.inputs() == 0 && l.pictures() == 0;
}

void StationRecorder::finish() {
  for (std::uint64_t taken = 0, now = 1; now > 0 && taken < rt::TelemetryRing::kSize; taken += now) {
    now = drain();
  }
  take_ticks(kAll);  // a core that was killed may have told of a tick whose input it did not
  if (!scene_told_) {
    scene_told_ = true;
    add(Stream::scene, scene_);
  }
  close_chunk();
  file_.finish();
  sync_->want();
  sync_.reset();
}

}  // namespace punctum::tools
