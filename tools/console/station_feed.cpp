#include "tools/console/station_feed.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "tools/console/fixtures.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/fault_advice.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/station_values.hpp"

namespace punctum::console {
namespace {

std::int64_t monotonic_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Since 1970 as the clock said when this was first asked for, and steady from then on: the page tells by it
// how old a message is, whatever sets the clock meanwhile.
std::uint64_t wall_ns() {
  static const std::int64_t begin_ns =
      std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count() - monotonic_ns();
  return static_cast<std::uint64_t>(begin_ns + monotonic_ns());
}

template <class Message, class Struct>
std::shared_ptr<const std::string> as_message(const Struct& from) {
  Message message;
  tools::to_wire(from, message);
  auto bytes = std::make_shared<std::string>();
  message.SerializeToString(bytes.get());
  return bytes;
}

// Of a process that must not be mistaken for a later one with its number.
hal::Descriptor process(std::uint64_t pid) {
  return hal::Descriptor(static_cast<int>(syscall(SYS_pidfd_open, static_cast<pid_t>(pid), 0)));
}
bool has_ended(const hal::Descriptor& process) {
  pollfd look{process.number(), POLLIN, 0};
  return !process || ::poll(&look, 1, 0) > 0;
}

}  // namespace

tl::expected<StationFeed, std::string> StationFeed::join(std::string_view station) {
  auto joined = hal::Joined::join(station);
  if (!joined) {
    return tl::unexpected(joined.error());
  }
  StationFeed feed;
  feed.station_ = station;
  auto core = hal::Shared<const rt::CoreSegment>::attach(tools::kCoreSegment,
                                                         joined->descriptor(tools::kCoreSegment));
  if (!core) {
    return tl::unexpected(core.error());
  }
  feed.core_ = std::move(*core);
  if (const int descriptor = joined->descriptor(tools::kObservationSegment); descriptor >= 0) {
    auto observed = hal::Shared<const rt::ObservationSegment>::attach(tools::kObservationSegment, descriptor);
    if (!observed) {
      return tl::unexpected(observed.error());
    }
    feed.observation_ = std::move(*observed);
  }
  const std::string queue = tools::command_segment(rt::kConsole);
  auto commands = hal::Shared<rt::CommandSegment>::claim(queue, joined->descriptor(queue));
  if (!commands) {
    return tl::unexpected(commands.error());
  }
  feed.commands_ = std::move(*commands);
  if (auto pictures = feed.join_pictures(*joined); !pictures) {
    return tl::unexpected(pictures.error());
  }
  if (auto replay = feed.join_replay(*joined); !replay) {
    return tl::unexpected(replay.error());
  }
  if (const int fingers = joined->descriptor(tools::kFingersSegment); fingers >= 0) {
    auto claimed = hal::Shared<browser::FingersSegment>::claim(tools::kFingersSegment, fingers);
    if (!claimed) {
      return tl::unexpected(claimed.error());
    }
    feed.fingers_ = std::move(*claimed);
  }
  if (const int text = joined->descriptor(tools::kSceneText); text >= 0) {
    feed.read_scene(text);
  }
  feed.parent_ = process((*feed.core_)->header.owner_pid);
  if (!feed.parent_) {
    return tl::unexpected(fmt::format("station {}: its parent has ended", station));
  }
  feed.read_ = (*feed.core_)->telemetry.head();
  feed.events_.emplace((*feed.core_)->events);
  return feed;
}

// A scene that cannot be read, as in a recording of another version, costs what needs it, not the page.
void StationFeed::read_scene(int descriptor) {
  std::ifstream file(fmt::format("/proc/self/fd/{}", descriptor));
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const auto scene = tools::parse_scene(text, "the scene of the station");
  if (!scene) {
    tools::complain("punctum-console: " + scene.error() + ": no parameters, no fixtures");
    return;
  }
  parameters_ = Parameters(scene->servo);
  fixtures_ = fixtures_json(scene->servo);
  if (scene->stream && !replay_) {  // a recording moves nothing that somebody else would follow
    auto stream = PositionStream::open(scene->stream->to);
    if (stream) {
      stream_ = std::move(*stream);
    } else {  // a line that is down costs the stream, not the page
      tools::complain("punctum-console: " + stream.error() + ": nobody is told over UDP");
    }
  }
}

tl::expected<void, std::string> StationFeed::join_pictures(const hal::Joined& joined) {
  const int view = joined.descriptor(tools::kViewSegment);
  if (view < 0) {
    return {};
  }
  auto pictures = hal::Shared<const rt::ViewSegment>::attach(tools::kViewSegment, view);
  if (!pictures) {
    return tl::unexpected(pictures.error());
  }
  auto viewer =
      hal::Shared<rt::ViewerSegment>::claim(tools::kViewerSegment, joined.descriptor(tools::kViewerSegment));
  if (!viewer) {
    return tl::unexpected(viewer.error());
  }
  view_ = std::move(*pictures);
  viewer_ = std::move(*viewer);
  return {};
}

tl::expected<void, std::string> StationFeed::join_replay(const hal::Joined& joined) {
  const int replay = joined.descriptor(tools::kReplaySegment);
  if (replay < 0) {
    return {};
  }
  auto player = hal::Shared<const tools::ReplaySegment>::attach(tools::kReplaySegment, replay);
  if (!player) {
    return tl::unexpected(player.error());
  }
  auto wishes = hal::Shared<tools::ReplayWishSegment>::claim(tools::kReplayWishSegment,
                                                             joined.descriptor(tools::kReplayWishSegment));
  if (!wishes) {
    return tl::unexpected(wishes.error());
  }
  std::ifstream marks(fmt::format("/proc/self/fd/{}", joined.descriptor(tools::kReplayMarks)));
  std::string text;
  for (double t_s = 0; marks >> t_s && std::getline(marks >> std::ws, text);) {
    marks_.emplace_back(t_s, text);
  }
  replay_ = std::move(*player);
  replay_wishes_ = std::move(*wishes);
  return {};
}

std::uint64_t StationFeed::now_ns() { return wall_ns(); }

bool StationFeed::is_over() const { return has_ended(parent_); }

tl::expected<void, std::string> StationFeed::stop(const std::string& who) {
  if (!(*commands_)->queue.try_push({rt::Command::stop, 0, 0})) {
    return tl::unexpected(std::string("the core does not take commands: press the emergency stop"));
  }
  remember(who);
  ++stops_asked_;
  return {};
}

void StationFeed::remember(const std::string& who) {
  if (!replay_ && asked_by_.size() < kMostAsked) {
    asked_by_.push_back(who);
  }
}

std::string StationFeed::refusal() const {
  if (std::string_view(core_state_) != "ticking") {
    return fmt::format("the core is {}", core_state_);
  }
  const auto fault = tools::fault_in((*core_)->status.fault.load());
  if (!fault || *fault != rt::Fault::none || newest_.stop != rt::StopStage::running) {
    return "a stop is latched";
  }
  return {};
}

tl::expected<void, std::string> StationFeed::ask(const rt::Command& command, const std::string& who) {
  if (std::string why = refusal(); !why.empty()) {
    return tl::unexpected(std::move(why));
  }
  if (!(*commands_)->queue.try_push(command)) {
    return tl::unexpected(std::string("the core does not take commands"));
  }
  remember(who);
  return {};
}

tl::expected<void, std::string> StationFeed::move_hand(const browser::Fingers& fingers) {
  if (!fingers_) {
    return tl::unexpected(std::string("the hand of this station is not on the page"));
  }
  browser::Fingers told = fingers;
  told.told_ns = monotonic_ns();
  (*fingers_)->newest.push(told);
  return {};
}

void StationFeed::let_go_of_hand() {
  if (fingers_) {
    (*fingers_)->newest.push(browser::Fingers{});
  }
}

tl::expected<void, std::string> StationFeed::ask(const tools::ReplayWish& wish) {
  if (!replay_wishes_) {
    return tl::unexpected(std::string("this station is no recording"));
  }
  if (!(*replay_wishes_)->queue.try_push(wish)) {
    return tl::unexpected(std::string("punctum-replay does not listen"));
  }
  return {};
}

void StationFeed::read_every_tick(bool wanted, std::vector<Told>& out) {
  const rt::TelemetryRing& ring = (*core_)->telemetry;
  const std::uint64_t head = ring.head();
  if (!wanted || !ticks_from_) {
    ticks_from_ = wanted ? std::optional(head) : std::nullopt;
    ticks_lost_ = 0;
    return;
  }
  if (head <= *ticks_from_) {
    return;
  }
  const std::uint64_t from = std::max(*ticks_from_, ring.tail());
  ticks_lost_ += from - *ticks_from_;
  const std::uint64_t to = std::min(head, from + kMostTicks);
  ticks_from_ = to;
  every_tick_.clear_sample();
  for (std::uint64_t i = from; i < to; ++i) {
    rt::TelemetrySample sample;
    if (ring.read(i, sample) == hal::Read::ok && tools::usable(sample)) {
      tools::to_wire(sample, *every_tick_.add_sample());
    } else {
      ++ticks_lost_;
    }
  }
  every_tick_.set_lost(ticks_lost_);
  out.push_back(
      {every_tick, wall_ns(), std::make_shared<const std::string>(every_tick_.SerializeAsString())});
}

void StationFeed::read_picture(bool wanted, std::vector<Told>& out) {
  if (!view_ || !wanted) {
    return;
  }
  (*viewer_)->looks_until_ns.store(static_cast<std::uint64_t>(monotonic_ns() + kLooks_ns));
  const rt::ViewSegment::Ring& ring = (*view_)->ring;
  rt::PictureHead head;
  std::uint64_t index = 0;
  if (ring.heads().newest(head, index) != hal::Read::ok || index + 1 == viewed_ || head.bytes() == 0 ||
      head.bytes() > rt::ViewSegment::kLargest) {
    return;
  }
  viewed_ = index + 1;
  std::string& grey = *picture_.mutable_grey();
  grey.resize(head.bytes() + 7);
  const bool whole = ring.read(head, reinterpret_cast<std::uint8_t*>(grey.data()));
  grey.resize(head.bytes());
  if (whole) {
    tools::to_wire(head, picture_);
    out.push_back({picture, wall_ns(), std::make_shared<const std::string>(picture_.SerializeAsString())});
  }
}

std::string StationFeed::replay_in_words(bool with_marks) const {
  tools::ReplayState now;
  std::uint64_t index = 0;
  (void)(*replay_)->state.newest(now, index);
  nlohmann::ordered_json s = {{"first_s", now.first_s},
                              {"last_s", now.last_s},
                              {"now_s", now.now_s},
                              {"speed", now.speed},
                              {"playing", now.playing != 0}};
  if (with_marks) {
    s["marks"] = nlohmann::json::array();
    for (const auto& [t_s, text] : marks_) {
      s["marks"].push_back({{"t_s", t_s}, {"text", text}});
    }
  }
  return s.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void StationFeed::read_telemetry(bool wanted, std::vector<Told>& out) {
  const rt::TelemetryRing& ring = (*core_)->telemetry;
  const std::uint64_t head = ring.head();
  if (head <= read_) {
    return;
  }
  // A ring holds so many; a defective writer may say anything.
  const std::uint64_t from = std::max(read_, ring.tail());
  read_ = head;
  const std::uint64_t stride = (head - from + kSamplesPerPoll - 1) / kSamplesPerPoll;
  for (std::uint64_t back = (head - from - 1) / stride + 1; back-- > 0;) {
    rt::TelemetrySample sample;
    if (ring.read(head - 1 - back * stride, sample) != hal::Read::ok) {
      continue;
    }
    if (!tools::usable(sample)) {
      ++unusable_;
      continue;
    }
    newest_ = sample;
    has_sample_ = true;
    if (wanted) {
      out.push_back({telemetry, wall_ns(), as_message<v1::Telemetry>(sample)});
    }
  }
  if (stream_ && has_sample_) {
    stream_->send(newest_);
  }
}

void StationFeed::read_observation(bool wanted, std::vector<Told>& out) {
  rt::Observation found;
  std::uint64_t index = 0;
  if (wanted && (*observation_)->slot.newest(found, index) == hal::Read::ok && index + 1 != frame_) {
    frame_ = index + 1;
    out.push_back({observation, wall_ns(), as_message<v1::Observation>(found)});
  }
}

void StationFeed::read_surface(bool wanted, std::vector<Told>& out) {
  rt::CellSurface found;
  std::uint64_t index = 0;
  if (wanted && (*observation_)->surface.newest(found, index) == hal::Read::ok && index + 1 != surface_) {
    surface_ = index + 1;
    out.push_back({surface, wall_ns(), as_message<v1::CellSurface>(found)});
  }
}

void StationFeed::read_events(bool wanted, std::vector<Told>& out) {
  // No more than it holds, whatever its writer does meanwhile.
  rt::Event happened;
  for (std::size_t i = 0; i < rt::EventRing::kSize && events_->next(happened) == hal::Read::ok; ++i) {
    if (happened.kind == rt::Event::fault && !fault_at_s_) {
      fault_at_s_ = happened.t_s;
    } else if (happened.kind == rt::Event::fault_cleared) {
      fault_at_s_.reset();
    }
    account_for(happened);
    told_events_.push_back({event, wall_ns(), as_message<v1::Event>(happened)});
    if (told_events_.size() > kMostEvents) {
      told_events_.pop_front();
    }
    if (wanted) {
      out.push_back(told_events_.back());
    }
  }
}

// Who changed what: the core tells its commands in the order in which they stood in the queue.
void StationFeed::account_for(const rt::Event& happened) {
  if (happened.kind != rt::Event::command && happened.kind != rt::Event::command_refused) {
    return;
  }
  std::string who =
      happened.writer < rt::kCommandWriterCount ? rt::kCommandWriters[happened.writer]->name : "";
  if (happened.writer < rt::kCommandWriterCount && rt::kCommandWriters[happened.writer] == &rt::kConsole &&
      !asked_by_.empty()) {
    who = asked_by_.front();
    asked_by_.pop_front();
  }
  parameters_changed_ = parameters_.took(happened, who) || parameters_changed_;
}

void StationFeed::watch_core(double now_s) {
  const rt::CoreStatus& core = (*core_)->status;
  if (!core_process_ && core.pid.load() != 0) {
    core_process_ = process(core.pid.load());
  }
  const std::uint64_t ticks = core.ticks.load();
  if (ticks != ticks_) {
    ticks_ = ticks;
    ticked_s_ = now_s;
  }
  const bool has_begun = core.started.load() != 0;
  if (core.run_end.load() != static_cast<std::uint64_t>(rt::RunEnd::running)) {
    core_state_ = "ended";
  } else if (core.pid.load() != 0 && has_ended(core_process_)) {
    core_state_ = "died";
  } else if (!has_begun) {
    core_state_ = "waiting";
  } else {
    core_state_ = now_s - ticked_s_ > kSilent_s ? "silent" : "ticking";
  }
}

std::string StationFeed::state_in_words() const {
  const rt::CoreStatus& core = (*core_)->status;
  nlohmann::ordered_json s;
  s["core"] = core_state_;
  const auto end = tools::run_end_in(core.run_end.load());
  s["run_end"] = end ? rt::name(*end) : "unknown";
  s["t_s"] = has_sample_ ? newest_.t_s : 0;
  s["tick"] = core.tick_index.load();
  s["phase"] = has_sample_ ? rt::name(newest_.phase) : "";
  s["cell"] = newest_.cell;
  constexpr const char* kStages[] = {"running", "stopping", "stopped"};
  s["stop"] = kStages[static_cast<std::size_t>(newest_.stop)];
  const auto fault = tools::fault_in(core.fault.load());
  if (fault && *fault != rt::Fault::none) {
    const tools::FaultAdvice& advice = tools::kFaultAdvice[static_cast<std::size_t>(*fault)];
    s["fault"] = {{"name", rt::name(*fault)},
                  {"cause", advice.cause},
                  {"next", advice.next},
                  {"cleared", tools::clearing_condition(*fault)}};
    if (fault_at_s_) {
      s["fault"]["t_s"] = *fault_at_s_;
    }
  }
  s["alarms"] = nlohmann::json::array();
  for (std::size_t bit = 0; bit < std::size(rt::kAlarmNames); ++bit) {
    if (((newest_.alarms >> bit) & 1U) != 0) {
      s["alarms"].push_back(rt::kAlarmNames[bit]);
    }
  }
  s["refused"] = refusal();  // why nothing but a stop is taken
  s["vision"] = observation_.has_value();
  s["hand_here"] = fingers_.has_value();
  s["stops_asked"] = stops_asked_;
  s["events_lost"] = events_->lost();
  s["samples_unusable"] = unusable_;
  s["missed_ticks"] = core.missed.load();
  // A text of another program need not be UTF-8; nothing here throws.
  return s.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void StationFeed::poll(double now_s, ChannelSet wanted, std::vector<Told>& out) {
  watch_core(now_s);
  read_telemetry(wanted[telemetry], out);
  read_every_tick(wanted[every_tick], out);
  read_events(wanted[event], out);
  if (observation_) {
    read_observation(wanted[observation], out);
    read_surface(wanted[surface], out);
  }
  read_picture(wanted[picture], out);
  if (replay_ && wanted[replay] && now_s - replay_told_s_ > kState_s - kPoll_s / 2) {
    replay_told_s_ = now_s;
    out.push_back({replay, wall_ns(), std::make_shared<const std::string>(replay_in_words(false))});
  }
  if (wanted[status] && now_s - status_told_s_ > kStatus_s - kPoll_s / 2) {
    status_told_s_ = now_s;
    out.push_back({status, wall_ns(), as_message<v1::Status>((*core_)->status)});
  }
  if (parameters_changed_ && wanted[parameters]) {
    parameters_changed_ = false;
    out.push_back({parameters, wall_ns(), std::make_shared<const std::string>(parameters_.json()), true});
  }
  if (wanted[state]) {
    // What changes with every tick does not count as a change.
    const rt::CoreStatus& core = (*core_)->status;
    std::string key = fmt::format("{} {} {} {} {} {} {}", core_state_, core.run_end.load(), core.fault.load(),
                                  static_cast<int>(newest_.phase), static_cast<int>(newest_.stop),
                                  newest_.alarms, stops_asked_);
    if (key != state_ || now_s - state_told_s_ > kState_s - kPoll_s / 2) {
      state_ = std::move(key);
      state_told_s_ = now_s;
      out.push_back({state, wall_ns(), std::make_shared<const std::string>(state_in_words())});
    }
  }
}

void StationFeed::catch_up(ChannelId channel, std::vector<Told>& out) {
  switch (channel) {
    case event:
      out.insert(out.end(), told_events_.begin(), told_events_.end());
      break;
    case state:
      out.push_back({state, wall_ns(), std::make_shared<const std::string>(state_in_words())});
      break;
    case status:
      out.push_back({status, wall_ns(), as_message<v1::Status>((*core_)->status)});
      break;
    case observation:
      frame_ = 0;  // the newest is told again, to everybody
      break;
    case surface:
      surface_ = 0;
      break;
    case parameters:
      out.push_back({parameters, wall_ns(), std::make_shared<const std::string>(parameters_.json()), true});
      break;
    case picture:
      viewed_ = 0;
      break;
    case replay:
      if (replay_) {
        out.push_back({replay, wall_ns(), std::make_shared<const std::string>(replay_in_words(true)), true});
      }
      break;
    case fixtures:
      if (!fixtures_.empty()) {
        out.push_back({fixtures, wall_ns(), std::make_shared<const std::string>(fixtures_), true});
      }
      break;
    case telemetry:
    case every_tick:
      break;
  }
}

}  // namespace punctum::console
