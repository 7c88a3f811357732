#include "tools/jitter/comparison.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "tools/jitter/difference.hpp"
#include "tools/shared/child.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/stop_signal.hpp"

namespace punctum::jitter {
namespace {

namespace fs = std::filesystem;

constexpr double kSlice_s = 1;   // at least
constexpr int kMostSlices = 30;  // of either
constexpr int kBins = 2000;      // as the loop's own histogram

// A folder that goes with the object.
class Folder {
 public:
  Folder() {
    std::string path = (fs::temp_directory_path() / "punctum-jitter-XXXXXX").string();
    if (mkdtemp(path.data()) != nullptr) {
      path_ = path;
    }
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] bool is_there() const { return !path_.empty(); }
  [[nodiscard]] std::string file(const char* name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// Empty, or why it did not run to its end.
std::string run(const std::string& program, const std::vector<std::string>& arguments,
                const std::string& log) {
  auto child = tools::Child::start(program, arguments, log);
  if (!child) {
    return child.error();
  }
  tools::Ended how;
  while (!child->ended(how)) {
    if (tools::stop_signal::count() > 0) {
      return "--compare: stopped";  // and the child with it
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return how.exited && how.code == 0 ? ""
                                     : fmt::format("{}: {}: {}", program, how.text(), tools::last_line(log));
}

void add(const Distribution& part, Result& to) {
  Distribution& all = to.wake;
  all.count.resize(std::max(all.count.size(), part.count.size()), 0);
  for (std::size_t k = 0; k < part.count.size(); ++k) {
    all.count[k] += part.count[k];
  }
  all.longer += part.longer;
  all.max_us = std::max(all.max_us, part.max_us);
  to.ticks += part.entries();
  to.parts.push_back(part);
}

std::uint64_t number_after(std::string_view text, std::string_view key) {
  const auto at = text.find(key);
  std::uint64_t value = 0;
  if (at != std::string_view::npos) {
    const std::string_view rest = text.substr(std::min(text.size(), at + key.size()));
    (void)std::from_chars(rest.data(), rest.data() + rest.size(), value);
  }
  return value;
}

}  // namespace

tl::expected<Distribution, std::string> read_histogram(std::string_view text) {
  Distribution out;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    if (line.empty() || line.front() == '#') {
      continue;
    }
    std::uint64_t bin = 0, count = 0;
    const char *const first = line.data(), *const last = first + line.size();
    const auto [after_bin, bad_bin] = std::from_chars(first, last, bin);
    const char* from = after_bin;
    while (from < last && (*from == ' ' || *from == '\t')) {
      ++from;
    }
    const auto [after_count, bad_count] = std::from_chars(from, last, count);
    if (bad_bin != std::errc{} || bad_count != std::errc{} || bin >= kBins) {
      return tl::unexpected(fmt::format("\"{}\" is no line of a histogram", line));
    }
    out.count.resize(std::max<std::size_t>(out.count.size(), bin + 1), 0);
    out.count[bin] = count;
  }
  out.longer = number_after(text, "# Histogram Overflows: ");
  out.max_us = static_cast<double>(number_after(text, "# Max Latencies: "));
  if (out.entries() == 0) {
    return tl::unexpected(std::string("it holds no wake-up"));
  }
  return out;
}

tl::expected<Comparison, std::string> compare_with_cyclictest(const Wanted& wanted,
                                                              const std::vector<std::string>& tick) {
  if (tools::find_program("cyclictest").empty()) {
    return tl::unexpected(std::string("--compare: there is no cyclictest: apt-get install rt-tests"));
  }
  const int slices = std::min(static_cast<int>(wanted.seconds / 2 / kSlice_s), kMostSlices);
  if (slices < static_cast<int>(kLeastParts)) {
    return tl::unexpected(fmt::format("--compare: --seconds {}: allowed: {} or more, a second for each turn",
                                      wanted.seconds, 2 * kLeastParts * kSlice_s));
  }
  const double slice_s = wanted.seconds / 2 / slices;
  const Folder folder;
  if (!folder.is_there()) {
    return tl::unexpected(fmt::format("--compare: no folder can be made in {}: {}",
                                      fs::temp_directory_path().string(), std::strerror(errno)));
  }
  tools::stop_signal::watch({SIGINT, SIGTERM, SIGHUP});
  const std::string json = folder.file("loop.json"), histogram = folder.file("cyclictest.hist"),
                    log = folder.file("log");
  std::vector<std::string> loop{
      "--rate",     fmt::format("{}", wanted.rate_Hz),  "--seconds", fmt::format("{}", slice_s),
      "--priority", fmt::format("{}", wanted.priority), "--json",    json};
  loop.insert(loop.end(), tick.begin(), tick.end());
  std::vector<std::string> theirs{"-q",
                                  "-m",
                                  fmt::format("--priority={}", wanted.priority),
                                  fmt::format("--interval={}", std::lround(1e6 / wanted.rate_Hz)),
                                  fmt::format("--loops={}", std::lround(slice_s * wanted.rate_Hz)),
                                  fmt::format("--histogram={}", kBins),
                                  fmt::format("--histfile={}", histogram)};
  if (wanted.cpu >= 0) {
    loop.insert(loop.end(), {"--cpu", std::to_string(wanted.cpu)});
    theirs.push_back(fmt::format("--affinity={}", wanted.cpu));
  }
  Comparison out;
  for (Result* one : {&out.loop, &out.cyclictest}) {
    one->rate_Hz = wanted.rate_Hz;
    one->cpu = wanted.cpu;
    one->seconds = wanted.seconds / 2;
  }
  for (int slice = 0; slice < slices; ++slice) {
    if (const std::string failed = run("punctum-jitter", loop, log); !failed.empty()) {
      return tl::unexpected(failed);
    }
    const auto ours = result_of_json(text_of(json));
    if (!ours) {
      return tl::unexpected(ours.error());
    }
    add(ours->wake, out.loop);
    out.loop.missed += ours->missed;
    out.loop.missed_in_parts.push_back(ours->missed);
    out.loop.machine = out.cyclictest.machine = ours->machine;
    if (const std::string failed = run("cyclictest", theirs, log); !failed.empty()) {
      return tl::unexpected(failed);
    }
    const auto seen = read_histogram(text_of(histogram));
    if (!seen) {
      return tl::unexpected("cyclictest: " + seen.error());
    }
    add(*seen, out.cyclictest);
    if ((slice + 1) % 10 == 0 && slice + 1 < slices) {
      tools::say_aside(fmt::format("slice {} of {}\n", slice + 1, slices));
    }
  }
  return out;
}

}  // namespace punctum::jitter
