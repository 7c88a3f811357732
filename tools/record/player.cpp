#include "tools/record/player.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "hal/ipc/sealed_text.hpp"
#include "tools/shared/event_words.hpp"
#include "tools/shared/shown_picture.hpp"
#include "tools/shared/station_segments.hpp"

namespace punctum::tools {
namespace {

constexpr std::size_t kMostMarks = 10'000;  // the first ones: they are told in one message

constexpr double kTellAtOnce_s =
    4;  // more than this at once is not told tick by tick: half of what a ring holds

template <class Segment>
tl::expected<void, std::string> make(const char* name, const std::string& station,
                                     std::optional<hal::Shared<const Segment>>& made,
                                     std::optional<hal::Shared<Segment>>& claimed,
                                     hal::Rendezvous& rendezvous) {
  auto segment = hal::Shared<const Segment>::create(station + "." + name);
  if (!segment) {
    return tl::unexpected(segment.error());
  }
  made = std::move(*segment);
  auto writer = hal::Shared<Segment>::claim(name, made->segment().descriptor());
  if (!writer) {
    return tl::unexpected(writer.error());
  }
  claimed = std::move(*writer);
  auto descriptor = made->segment().read_only_descriptor();
  if (!descriptor) {
    return tl::unexpected(descriptor.error());
  }
  rendezvous.offer(name, std::move(*descriptor));
  return {};
}

// For whoever claims it first.
void offer_for_writing(const char* name, const hal::Segment& segment, hal::Rendezvous& rendezvous) {
  rendezvous.offer(name, hal::Descriptor(::fcntl(segment.descriptor(), F_DUPFD_CLOEXEC, 0)));
}

}  // namespace

struct Player::Overview {
  std::vector<Mark> marks;
  std::string scene;
  std::optional<double> first_s;
  double last_s = 0;
  bool has_pictures = false;

  void operator()(const v1::Picture& /*p*/) { has_pictures = true; }
  void operator()(const v1::Scene& s) { scene = s.toml(); }
  void operator()(const v1::Telemetry& t) {
    first_s = first_s.value_or(t.t_s());
    last_s = t.t_s();
  }
  void operator()(const v1::Event& e) {
    rt::Event event;
    from_wire(e, event);
    if (event.kind != rt::Event::alarm_on && event.kind != rt::Event::alarm_off &&
        marks.size() < kMostMarks) {
      const EventWords words = words_of(event);
      marks.push_back({event.t_s, words.event + " " + words.what});
    }
  }
};

tl::expected<std::unique_ptr<Player>, std::string> Player::open(const std::string& recording,
                                                                const std::string& station) {
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  Overview overview;
  const std::string ends = reader->read_all(overview);
  if (!overview.first_s) {
    return tl::unexpected(recording + ": holds no ticks" + (ends.empty() ? "" : "; " + ends));
  }
  reader = RecordingReader::open(recording);
  auto rendezvous = hal::Rendezvous::open(station);
  if (!reader || !rendezvous) {
    return tl::unexpected(reader ? rendezvous.error() : reader.error());
  }
  std::unique_ptr<Player> player(new Player(recording, std::move(*reader), std::move(*rendezvous)));
  player->marks_ = std::move(overview.marks);
  player->ends_ = ends;
  player->first_s_ = player->now_s_ = *overview.first_s;
  player->last_s_ = overview.last_s;
  auto made = player->make_station(station, overview.scene);
  if (made) {
    made = player->make_controls(station);
  }
  if (made && overview.has_pictures) {
    made = player->make_view(station);
  }
  if (!made) {
    return tl::unexpected(made.error());
  }
  player->go_to(player->first_s_);
  return player;
}

tl::expected<void, std::string> Player::make_station(const std::string& station, const std::string& scene) {
  auto made = make(kCoreSegment, station, made_core_, core_, rendezvous_);
  if (made) {
    made = make(kObservationSegment, station, made_observation_, observation_, rendezvous_);
  }
  if (!made) {
    return made;
  }
  const std::string queue = command_segment(rt::kConsole);
  auto commands = hal::Shared<rt::CommandSegment>::create(station + "." + queue);
  if (!commands) {
    return tl::unexpected(commands.error());
  }
  commands_ = std::move(*commands);
  offer_for_writing(queue.c_str(), commands_->segment(), rendezvous_);
  auto text = hal::seal_text("scene", scene);
  if (!text) {
    return tl::unexpected(text.error());
  }
  rendezvous_.offer(kSceneText, std::move(*text));
  (*core_)->status.pid.store(static_cast<std::uint64_t>(::getpid()));
  (*core_)->status.started.store(1);
  return {};
}

tl::expected<void, std::string> Player::make_controls(const std::string& station) {
  if (auto made = make(kReplaySegment, station, made_replay_, replay_, rendezvous_); !made) {
    return made;
  }
  auto wishes = hal::Shared<ReplayWishSegment>::create(station + "." + kReplayWishSegment);
  if (!wishes) {
    return tl::unexpected(wishes.error());
  }
  wishes_ = std::move(*wishes);
  offer_for_writing(kReplayWishSegment, wishes_->segment(), rendezvous_);
  std::string lines;
  for (const Mark& mark : marks_) {
    lines += fmt::format("{} {}\n", mark.t_s, mark.text);  // all digits: of its tick, not of the one before
  }
  auto text = hal::seal_text("marks", lines);
  if (!text) {
    return tl::unexpected(text.error());
  }
  rendezvous_.offer(kReplayMarks, std::move(*text));
  return {};
}

tl::expected<void, std::string> Player::make_view(const std::string& station) {
  if (auto made = make(kViewSegment, station, made_view_, view_, rendezvous_); !made) {
    return made;
  }
  auto viewer = hal::Shared<const rt::ViewerSegment>::create(station + "." + kViewerSegment);
  if (!viewer) {
    return tl::unexpected(viewer.error());
  }
  viewer_ = std::move(*viewer);
  offer_for_writing(kViewerSegment, viewer_->segment(), rendezvous_);
  return {};
}

void Player::begin_again() {
  if (auto reader = RecordingReader::open(recording_)) {
    reader_ = std::move(*reader);
    over_ = false;
    events_ = 0;
    held_.clear();
    waiting_.reset();
    (*core_)->status.run_end.store(static_cast<std::uint64_t>(rt::RunEnd::running));
  }
}

void Player::go_to(double t_s) {
  t_s = std::clamp(t_s, first_s_, last_s_);
  skipping_ = t_s < now_s_ || t_s > now_s_ + kTellAtOnce_s;
  if (t_s < now_s_) {
    begin_again();
  }
  now_s_ = t_s;
  if (waiting_ && waiting_->t_s <= t_s) {
    newest_ = *waiting_;
    waiting_.reset();
    telemetry_waits_ = true;
    tell_newest();
    tell_events(newest_.tick);
  }
  Teller teller{*this};
  while (!over_ && !waiting_) {
    const auto more = reader_.next(teller);
    over_ = !more || !*more;
  }
  skipping_ = false;
  tell_newest();
  if (over_) {
    tell_events(UINT64_MAX);
  }
}

void Player::tell_newest() {
  if (skipping_) {
    return;
  }
  if (std::exchange(surface_waits_, false)) {
    (*observation_)->surface.push(newest_surface_);
  }
  if (std::exchange(observation_waits_, false)) {
    (*observation_)->slot.push(newest_observation_);
  }
  if (std::exchange(picture_waits_, false)) {
    show(newest_picture_, reinterpret_cast<const std::uint8_t*>(pixels_.data()), newest_picture_.width,
         reduced_, (*view_)->ring);
  }
  if (std::exchange(telemetry_waits_, false)) {
    rt::CoreStatus& status = (*core_)->status;
    status.fault.store(static_cast<std::uint64_t>(newest_.fault));
    status.phase.store(static_cast<std::uint64_t>(newest_.phase));
    status.tick_index.store(newest_.tick);
    (*core_)->telemetry.push(newest_);
  }
}

// Each once, in their order, however often it is gone back. After their tick: whoever ends with the last one
// has the last tick.
void Player::tell_events(std::uint64_t up_to_tick) {
  for (; !held_.empty() && held_.front().tick <= up_to_tick; held_.pop_front()) {
    if (held_.front().kind == rt::Event::ended) {
      (*core_)->status.run_end.store(held_.front().what);
    }
    if (events_++ == told_events_) {
      ++told_events_;
      (*core_)->events.push(held_.front());
    }
  }
}

void Player::Teller::operator()(const v1::Telemetry& t) const {
  rt::TelemetrySample sample;
  if (!from_wire(t, sample)) {
    return;
  }
  if (sample.t_s > player.now_s_) {
    player.waiting_ = sample;
    return;
  }
  player.newest_ = sample;
  player.telemetry_waits_ = true;
  player.tell_newest();
  player.tell_events(sample.tick);
}

void Player::Teller::operator()(const v1::Observation& o) const {
  from_wire(o, player.newest_observation_);
  player.observation_waits_ = true;
  player.tell_newest();
}

void Player::Teller::operator()(const v1::CellSurface& s) const {
  from_wire(s, player.newest_surface_);
  player.surface_waits_ = true;
  player.tell_newest();
}

void Player::Teller::operator()(const v1::Picture& p) const {
  if (player.view_ && from_wire(p, player.newest_picture_) && !p.grey().empty()) {
    player.pixels_ = p.grey();
    player.picture_waits_ = true;
    player.tell_newest();
  }
}

void Player::Teller::operator()(const v1::Event& e) const { from_wire(e, player.held_.emplace_back()); }

void Player::Teller::operator()(const v1::Status& s) const {
  rt::CoreStatus& status = (*player.core_)->status;
  status.start_ns.store(static_cast<std::uint64_t>(s.start_ns()));
  status.period_ns.store(s.period_ns());
  status.missed.store(s.missed());
  status.missed_in_window.store(s.missed_in_window());
  status.worst_lateness_ns.store(s.worst_lateness_ns());
  status.degraded.store(s.degraded() ? 1 : 0);
  status.faults_latched.store(s.faults_latched());
  status.task_finished.store(s.task_finished() ? 1 : 0);
  status.commands_refused.store(s.commands_refused());
  from_wire(s.wake(), status.wake);
  from_wire(s.tick(), status.tick);
}

bool Player::serve(double speed, bool playing) {
  rendezvous_.serve();
  (*replay_)->state.push({first_s_, last_s_, now_s_, speed, playing ? 1U : 0U});
  hal::Word& ticks = (*core_)->status.ticks;
  ticks.store(ticks.load() + 1);
  bool stop = false;
  rt::Command command;
  while ((*commands_)->queue.try_pop(command)) {
    stop = stop || command.kind == rt::Command::stop;
  }
  return stop;
}

}  // namespace punctum::tools
