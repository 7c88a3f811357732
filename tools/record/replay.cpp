#include "tools/record/replay.hpp"

#include <fmt/format.h>

#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "rt/control/servo.hpp"
#include "tools/record/recording_reader.hpp"
#include "tools/record/telemetry_fields.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/taped_devices.hpp"

namespace punctum::tools {
namespace {

// A recorder writes the telemetry and the inputs of a tick within a few hundred messages of each other.
constexpr std::size_t kMostApart = 65'536;

std::string text(const TelemetryField& field, const std::byte* at) {
  switch (field.type) {
    case TelemetryField::byte:
      return fmt::format("{}", static_cast<unsigned>(*at));
    case TelemetryField::word: {
      std::uint32_t value = 0;
      std::memcpy(&value, at, sizeof value);
      return fmt::format("{}", value);
    }
    case TelemetryField::count: {
      std::uint64_t value = 0;
      std::memcpy(&value, at, sizeof value);
      return fmt::format("{}", value);
    }
    case TelemetryField::number:
      break;
  }
  double value = 0;
  std::memcpy(&value, at, sizeof value);
  return fmt::format("{:.17g}", value);
}

std::optional<Difference> first_difference(const rt::TelemetrySample& recorded,
                                           const rt::TelemetrySample& now) {
  std::optional<Difference> first;
  const auto* a = reinterpret_cast<const std::byte*>(&recorded);
  const auto* b = reinterpret_cast<const std::byte*>(&now);
  for (const TelemetryField& field : kTelemetryFields) {
    for (std::size_t i = 0; i < field.values; ++i) {
      const std::size_t at = field.offset + i * size_of(field.type);
      if (std::memcmp(a + at, b + at, size_of(field.type)) == 0) {
        continue;
      }
      if (first) {
        ++first->more;
        continue;
      }
      first = {.tick = recorded.tick,
               .t_s = recorded.t_s,
               .field = field.values > 1 ? fmt::format("{}[{}]", field.name, i) : field.name,
               .recorded = text(field, a + at),
               .now = text(field, b + at)};
    }
  }
  return first;
}

// Takes the messages of a recording in their order: what a tick was given stands before its input.
class Replay {
 public:
  void operator()(const v1::Scene& s) {
    auto scene = parse_scene(s.toml(), "its scene");
    if (!scene) {
      wrong = scene.error();
    } else if (!config_) {
      config_ = scene->servo;
    }
  }
  void operator()(const v1::Observation& o) { from_wire(o, observations_[o.number()]); }
  void operator()(const v1::Event& e) {
    if (e.kind() == v1::Event::KIND_COMMAND || e.kind() == v1::Event::KIND_COMMAND_REFUSED) {
      from_wire(e, commands_[e.tick()].emplace_back());
    }
  }
  void operator()(const v1::Telemetry& t) {
    if (!over()) {
      Recorded& recorded = recorded_.emplace_back();
      recorded.known = from_wire(t, recorded.sample);
      recorded.sample.tick = t.tick();
      compare();
    }
  }
  void operator()(const v1::Input& i) {
    if (!over()) {
      from_wire(i, input_);
      tick();
      compare();
    }
  }

  Replayed result;
  std::string wrong;  // why it cannot be replayed

  [[nodiscard]] bool any_inputs() const { return next_ > 0; }
  // No further message comes, and the recording is whole: what waits for another one waits in vain.
  void finish() {
    if (!over()) {
      result.not_told += now_.size();
      result.not_given += recorded_.size();
    }
  }

 private:
  [[nodiscard]] bool over() const { return result.differs || !result.ends.empty() || !wrong.empty(); }

  void tick() {
    if (!config_) {
      wrong = "holds no scene before its ticks";
      return;
    }
    if (input_.number != next_) {
      if (servo_) {
        result.ends =
            fmt::format("the inputs of the ticks before tick {} are not in the recording", input_.tick);
      } else {
        wrong = fmt::format("its inputs begin at tick {}, and what the servo was before is not known",
                            input_.tick);
      }
      return;
    }
    ++next_;
    if (!servo_) {
      devices_.at(input_);
      servo_ = std::make_unique<rt::Servo>(*config_, devices_.of(input_.flags), station_->station,
                                           (input_.flags & rt::InputSample::degraded) != 0);
    }
    if (input_.observations != seen_ && !observe()) {
      return;
    }
    command();
    const auto asked = [this](rt::InputSample::Flag flag) { return (input_.flags & flag) != 0; };
    if (asked(rt::InputSample::stop)) {
      servo_->request_stop();
    }
    if (asked(rt::InputSample::end)) {
      servo_->request_end();
    }
    if (asked(rt::InputSample::end_here)) {
      servo_->request_end_here();
    }
    servo_->tick({input_.tick, input_.release_ns, input_.start_ns, input_.period_s, input_.missed_in_window});
    now_.push_back(servo_->sample());
  }
  [[nodiscard]] bool observe() {
    seen_ = input_.observations;
    const auto found = observations_.find(seen_);
    if (found == observations_.end()) {
      result.ends =
          fmt::format("observation {}, which tick {} took, is not in the recording", seen_, input_.tick);
      return false;
    }
    station_->observation.slot.push(found->second);
    observations_.erase(observations_.begin(), std::next(found));
    return true;
  }
  void command() {
    const auto commands = commands_.find(input_.tick);
    if (commands == commands_.end()) {
      return;
    }
    rt::CommandSegment* const writers[] = {&station_->parent, &station_->console};
    static_assert(std::size(writers) == rt::kCommandWriterCount);
    for (const rt::Event& e : commands->second) {
      if (e.writer < std::size(writers)) {
        (void)writers[e.writer]->queue.try_push({.kind = e.what, .value = e.value, .target = e.target});
      }
    }
    commands_.erase(commands_.begin(), std::next(commands));
  }

  void compare() {
    while (!over() && !recorded_.empty() && !now_.empty()) {
      const rt::TelemetrySample &recorded = recorded_.front().sample, &now = now_.front();
      if (recorded.tick < now.tick) {
        ++result.not_given;
        recorded_.pop_front();
        continue;
      }
      if (recorded.tick > now.tick) {
        ++result.not_told;
        now_.pop_front();
        continue;
      }
      if (recorded_.front().known) {
        ++result.ticks;
        result.end_s = recorded.t_s;
        result.differs = first_difference(recorded, now);
      } else {
        ++result.not_known;
      }
      recorded_.pop_front();
      now_.pop_front();
    }
    if (recorded_.size() > kMostApart || now_.size() > kMostApart) {
      wrong = "its ticks and their inputs stand too far apart";
    }
  }

  std::optional<rt::ServoConfig> config_;
  std::map<std::uint64_t, std::vector<rt::Event>> commands_;  // by tick; that have not been taken
  std::map<std::uint64_t, rt::Observation> observations_;     // by number; likewise
  TapedDevices devices_;
  std::unique_ptr<rt::LocalStation> station_ = std::make_unique<rt::LocalStation>();
  std::unique_ptr<rt::Servo> servo_;
  rt::InputSample input_;
  std::uint64_t next_ = 0, seen_ = 0;
  struct Recorded {
    rt::TelemetrySample sample;
    bool known = false;
  };
  std::deque<Recorded> recorded_;
  std::deque<rt::TelemetrySample> now_;
};

}  // namespace

tl::expected<Replayed, std::string> replay_inputs(const std::string& recording) {
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  Replay replay;
  const std::string ends = reader->read_all(replay);
  if (ends.empty()) {
    replay.finish();
  }
  if (replay.wrong.empty() && !replay.any_inputs()) {
    return tl::unexpected(ends.empty()
                              ? recording +
                                    ": holds no inputs of ticks; `punctum run --record` writes them, "
                                    "punctum-record beside a run that was started without it cannot"
                              : ends + "; it holds no input of a tick up to there");
  }
  if (!replay.wrong.empty()) {
    return tl::unexpected(recording + ": " + replay.wrong);
  }
  Replayed result = std::move(replay.result);
  if (result.ends.empty() && !ends.empty()) {
    result.ends = ends;
  }
  return result;
}

}  // namespace punctum::tools
