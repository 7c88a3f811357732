#include "tools/punctum/terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "tools/shared/say.hpp"

namespace punctum::tools {
namespace {

constexpr std::size_t kBar = 8;            // letters: phase, force, depth and vision fit into 80 columns
constexpr std::size_t kUsualColumns = 80;  // of a terminal that does not tell

// https://no-color.org: set and not empty, whatever the value.
bool shows_colour(int file) {
  const char* const no_color = std::getenv("NO_COLOR");
  const char* const term = std::getenv("TERM");
  const bool dumb = term == nullptr || std::string_view(term) == "dumb" || *term == '\0';
  return isatty(file) != 0 && !dumb && (no_color == nullptr || *no_color == '\0');
}

// 0: it is no terminal.
std::size_t columns_of(int file) {
  winsize size{};
  if (isatty(file) == 0) {
    return 0;
  }
  return ioctl(file, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsualColumns;
}

// Of the locale, as the environment says it.
bool writes_utf8() {
  for (const char* variable : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* const value = std::getenv(variable);
    if (value != nullptr && *value != '\0') {
      const std::string_view v = value;
      return v.find("UTF-8") != std::string_view::npos || v.find("utf8") != std::string_view::npos;
    }
  }
  return false;
}

// One part of the line; the less important leave first.
struct Part {
  std::string text;  // without colour
  std::size_t width = 0;
  Colour colour = Colour::plain;
  int importance = 0;
};

Part part(std::string text, int importance, Colour colour = Colour::plain) {
  const std::size_t width = text.size();
  return {std::move(text), width, colour, importance};
}

Part bar(double filled, bool blocks) {
  const double eighths = std::clamp(filled, 0.0, 1.0) * 8 * static_cast<double>(kBar);
  const auto n = static_cast<std::size_t>(std::lround(eighths));
  std::string s;
  for (std::size_t i = 0; i < kBar; ++i) {
    const std::size_t here = std::min<std::size_t>(8, n > 8 * i ? n - 8 * i : 0);
    constexpr const char* kBlocks[] = {" ", "▏", "▎", "▍", "▌", "▋", "▊", "▉", "█"};
    s += blocks ? kBlocks[here] : here >= 4 ? "#" : " ";
  }
  const Colour colour = filled > 0.9 ? Colour::bad : filled > 0.6 ? Colour::warning : Colour::good;
  return {s, kBar, colour, 4};
}

// By their tables in the scene.
std::string silent_devices(unsigned bits) {
  std::string names;
  for (std::size_t i = 0; i < std::size(rt::kDeviceNames); ++i) {
    if ((bits >> i & 1U) != 0) {
      names += (names.empty() ? "" : ", ") + std::string(rt::kDeviceNames[i]);
    }
  }
  return names.empty() ? "a device" : names;
}

Part vision_part(const Scene& scene, const rt::TelemetrySample& newest) {
  if (newest.obs_age_s < 0) {
    return part("vision starts", 6, Colour::warning);
  }
  if ((newest.alarms & rt::alarm_vision_stale) != 0) {
    return part(fmt::format("vision stale {:.1f} s", newest.obs_age_s), 9, Colour::bad);
  }
  if ((newest.alarms & rt::alarm_vision_implausible) != 0) {
    return part("vision implausible", 9, Colour::bad);
  }
  return part(scene.vision ? "vision ok" : "", 3, Colour::good);
}

// For somebody who does it for the first time: what to do now. Empty where the hand is simulated.
const char* next_step(const Scene& scene, const Measures& measures) {
  const rt::TelemetrySample& newest = measures.last;
  if (scene.devices.haptic == kSimulated || !scene.servo.phases || newest.stop != rt::StopStage::running) {
    return "";
  }
  if ((newest.alarms & rt::alarm_not_enabled) != 0) {
    return "hold enable";
  }
  switch (newest.phase) {
    case rt::Phase::free:
    case rt::Phase::contact:
      return "to the cell";
    case rt::Phase::indentation:
      return "push on";
    case rt::Phase::puncture:
      return (newest.alarms & rt::alarm_injection_refused) != 0 ? "deeper" : "press inject";
    case rt::Phase::injection:
      // A press asks for one dose, which late vision may have kept back.
      return newest.injector_open != 0   ? "hold inject"
             : measures.dose_kept_back() ? "inject anew"
                                         : "draw back";
    case rt::Phase::withdrawal:
      return "draw back";
    case rt::Phase::clear:
      break;
  }
  return "";
}

// Columns on a terminal: colours take none, a letter of UTF-8 takes one.
std::size_t width_of(std::string_view text) {
  std::size_t width = 0;
  bool in_escape = false;
  for (const char c : text) {
    if (in_escape) {
      in_escape = c != 'm';
    } else if (c == '\033') {
      in_escape = true;
    } else {
      width += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1U : 0U;
    }
  }
  return width;
}

// Where a line goes on that is too long: under its text, where a title and two blanks stand before that.
std::size_t hanging_indent(std::string_view line) {
  constexpr std::size_t kWidestTitle = 24;
  const std::size_t first = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", first);
  if (gap > kWidestTitle) {  // or there is none
    return first + 2;
  }
  return std::min(line.find_first_not_of(' ', gap), line.size());
}

std::string wrapped_line(std::string_view line, std::size_t columns) {
  if (width_of(line) < columns) {
    return std::string(line);
  }
  const std::size_t indent = hanging_indent(line);
  std::string text;
  std::size_t at = 0;
  while (!line.empty()) {
    const std::size_t blanks = std::min(line.find_first_not_of(' '), line.size());
    const std::size_t end = std::min(line.find(' ', blanks), line.size());
    const std::string_view word = line.substr(blanks, end - blanks);
    const std::size_t width = width_of(word);
    // The last column stays free. A word that is too long anywhere stays where it is.
    if (at + blanks > indent && at + blanks + width >= columns) {
      text += "\n" + std::string(indent, ' ');
      at = indent;
    } else {
      text.append(blanks, ' ');
      at += blanks;
    }
    text += word;
    at += width;
    line.remove_prefix(end);
  }
  return text;
}

}  // namespace

std::string wrapped(std::string_view text, std::size_t columns) {
  std::string all;
  while (columns > 0 && !text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    all += wrapped_line(text.substr(0, end), columns);
    all += end < text.size() ? "\n" : "";
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return all + std::string(text);
}

std::string painted(Colour colour, const std::string& text, bool coloured) {
  if (!coloured || colour == Colour::plain || text.empty()) {
    return text;
  }
  constexpr const char* kCodes[] = {"", "\033[32m", "\033[33m", "\033[1;31m", "\033[2m"};
  return kCodes[static_cast<std::size_t>(colour)] + text + "\033[0m";
}

// Writes in a thread of its own: whoever says something watches a needle meanwhile. Without a thread it
// writes at once.
class Terminal::Writer {
 public:
  using Say = void (*)(std::string_view) noexcept;

  Writer() {
    try {
      thread_ = std::thread([this] { write(); });
    } catch (const std::system_error&) {
      has_thread_ = false;
    }
  }
  ~Writer() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    changed_.notify_one();
    if (has_thread_) {
      thread_.join();
    }
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void say(Say how, std::string text) {
    constexpr std::size_t kMostWaiting = 10'000;  // more nobody will read
    if (!has_thread_) {
      how(text);
      return;
    }
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.size() < kMostWaiting) {
        waiting_.push_back({how, std::move(text)});
      }
    }
    changed_.notify_one();
  }
  [[nodiscard]] bool has_written_all() {
    const std::lock_guard lock(mutex_);
    return waiting_.empty();
  }

 private:
  struct Words {
    Say how;
    std::string text;
  };
  void write() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return over_ || !waiting_.empty(); });
      if (waiting_.empty()) {
        return;
      }
      const Words& next = waiting_.front();  // stays there until it is written
      lock.unlock();
      next.how(next.text);
      lock.lock();
      waiting_.pop_front();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Words> waiting_;
  bool over_ = false, has_thread_ = true;
  std::thread thread_;
};

Terminal::Terminal()
    : writer_(std::make_unique<Writer>()),
      is_terminal_(isatty(STDOUT_FILENO) != 0),
      coloured_(shows_colour(STDOUT_FILENO)),
      errors_coloured_(shows_colour(STDERR_FILENO)) {}

Terminal::~Terminal() = default;

void Terminal::complain(const std::string& text) {
  clear_progress();
  writer_->say(tools::complain, painted(Colour::bad, wrapped("punctum: " + text, columns_of(STDERR_FILENO)),
                                        errors_coloured_));
}

void Terminal::print(const std::string& text) {
  clear_progress();
  writer_->say(tools::say, wrapped(text, columns_of(STDOUT_FILENO)));
}

void Terminal::progress(const std::string& line) {
  if (!writer_->has_written_all()) {
    return;
  }
  if (!is_terminal_) {
    say("{}", line);
    return;
  }
  writer_->say(tools::say, "\r\033[K" + line);
  progress_drawn_ = true;
}

void Terminal::clear_progress() {
  if (progress_drawn_) {
    writer_->say(tools::say, "\r\033[K");
  }
  progress_drawn_ = false;
}

LineStyle Terminal::line_style() const {
  if (!is_terminal_) {
    return {};
  }
  return {.coloured = coloured_, .blocks = writes_utf8(), .columns = columns_of(STDOUT_FILENO)};
}

std::string progress_line(const Scene& scene, const Measures& measures, const rt::CoreStatus& core,
                          const LineStyle& style) {
  const rt::TelemetrySample& newest = measures.last;
  const double hand_N = std::hypot(newest.force_N[0], newest.force_N[1], newest.force_N[2]);
  const double most_N = scene.servo.limits.hand_force_N;
  std::vector<Part> parts;
  parts.push_back(part(fmt::format("{:6.1f} s", newest.t_s), 10));
  if (newest.fault != rt::Fault::none) {
    parts.push_back(part(fmt::format("FAULT {}", rt::name(newest.fault)), 10, Colour::bad));
  }
  parts.push_back(part(fmt::format("{:<11}", rt::name(newest.phase)), 10));
  parts.push_back(bar(most_N > 0 ? hand_N / most_N : 0, style.blocks));
  parts.push_back(part(fmt::format("{:4.2f} N", hand_N), 8));
  if (const char* const next = next_step(scene, measures); *next != '\0') {
    parts.push_back(part(fmt::format("> {:<15}", next), 9, Colour::good));
  }
  if (scene.servo.membrane) {
    parts.push_back(part(fmt::format("depth {:5.1f} um", newest.wd_m * 1e6), 7));
    parts.push_back(part(fmt::format("needle {:5.1f} uN", newest.tip_force_N * 1e6), 2));
  }
  if (scene.servo.cells != 1 && scene.servo.phases) {
    parts.push_back(part(fmt::format("cell {}", newest.cell + 1), 6));
  }
  if (scene.vision) {
    parts.push_back(vision_part(scene, newest));
  }
  if ((newest.alarms & rt::alarm_sensor) != 0) {
    parts.push_back(part(silent_devices(newest.unusable) + " without usable data", 8, Colour::warning));
  }
  if (core.missed.load() > 0) {
    parts.push_back(part(fmt::format("missed {}", core.missed.load()), 1, Colour::warning));
  }
  if (scene.seconds > 0) {
    parts.push_back(
        part(fmt::format("{:.0f} s left", std::max(0.0, scene.seconds - newest.t_s)), 5, Colour::faint));
  }
  if ((newest.alarms & rt::alarm_degraded) != 0 && scene.clock == ClockKind::real) {
    parts.push_back(part("degraded", 1, Colour::warning));
  }
  const auto width = [&parts] {
    std::size_t sum = 0;
    for (const Part& p : parts) {
      sum += p.width + 2;
    }
    return sum - 2;
  };
  // The last column stays free: some terminals go to the next line there.
  while (style.columns > 0 && parts.size() > 1 && width() + 1 > style.columns) {
    parts.erase(std::min_element(parts.begin(), parts.end(),
                                 [](const Part& a, const Part& b) { return a.importance < b.importance; }));
  }
  std::string line;
  for (const Part& p : parts) {
    line += (line.empty() ? "" : "  ") + painted(p.colour, p.text, style.coloured);
  }
  return line;
}

}  // namespace punctum::tools
