#include "tools/jitter/result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace punctum::jitter {
namespace {

using Json = nlohmann::json;
using tools::late::Cause, tools::late::Explained, tools::late::Proof;

constexpr std::size_t kMostBins = 10'000, kMostParts = 1000;
constexpr std::pair<const char*, double> kQuantiles[] = {
    {"p50", 0.5}, {"p90", 0.9}, {"p99", 0.99}, {"p99_9", 0.999}, {"p99_99", 0.9999}, {"p99_999", 0.99999}};

// Only bins that hold something: [[bin, count], ...].
Json json_of(const Distribution& d) {
  Json bins = Json::array();
  for (std::size_t k = 0; k < d.count.size(); ++k) {
    if (d.count[k] > 0) {
      bins.push_back({k, d.count[k]});
    }
  }
  return {{"bins_us", bins}, {"longer", d.longer}, {"max_us", d.max_us}};
}

Json with_quantiles(const Distribution& d) {
  Json out = json_of(d);
  for (const auto& [name, part] : kQuantiles) {
    out[name] = d.tells(part) ? Json(d.quantile_us(part)) : Json(nullptr);
  }
  return out;
}

Json json_of(const std::optional<std::uint64_t>& count) { return count ? Json(*count) : Json(nullptr); }

std::string text_of(const std::optional<std::uint64_t>& count) {
  return count ? std::to_string(*count) : "not told";
}

Json json_of(const Explained& e, std::int64_t first_release_ns) {
  return {{"t_s", 1e-9 * static_cast<double>(e.tick.release_ns - first_release_ns)},
          {"wake_us", 1e-3 * static_cast<double>(e.tick.wake_ns - e.tick.release_ns)},
          {"end_us", 1e-3 * static_cast<double>(e.tick.end_ns - e.tick.release_ns)},
          {"missed", e.tick.missed},
          {"slot", e.slot},
          {"slot_us", 1e-3 * static_cast<double>(e.tick.longest_slot_ns)},
          {"cause", name_of(e.verdict.cause)},
          {"what", e.verdict.what},
          {"cause_us", e.verdict.us},
          {"proof", name_of(e.verdict.proof)}};
}

template <class T>
T number(const Json& in, const char* key) {
  const Json& value = in.at(key);
  if (!value.is_number()) {
    throw std::invalid_argument(fmt::format("{}: is not a number", key));
  }
  if constexpr (std::is_unsigned_v<T>) {
    if (!value.is_number_unsigned()) {
      throw std::invalid_argument(fmt::format("{}: is not a whole number from 0 on", key));
    }
  }
  return value.get<T>();
}

Distribution distribution(const Json& in) {
  Distribution out;
  out.longer = number<std::uint64_t>(in, "longer");
  out.max_us = number<double>(in, "max_us");
  if (!(out.max_us >= 0)) {
    throw std::invalid_argument("max_us: is below 0");
  }
  for (const Json& entry : in.at("bins_us")) {
    if (!entry.is_array() || entry.size() != 2 || !entry[0].is_number_unsigned() ||
        !entry[1].is_number_unsigned()) {
      throw std::invalid_argument("bins_us: an entry is not [bin, count]");
    }
    const auto bin = entry[0].get<std::uint64_t>();
    if (bin >= kMostBins) {
      throw std::invalid_argument(fmt::format("bins_us: bin {}: allowed: 0 .. {}", bin, kMostBins - 1));
    }
    if (out.count.size() <= bin) {
      out.count.resize(bin + 1, 0);
    }
    out.count[bin] = entry[1].get<std::uint64_t>();
  }
  return out;
}

}  // namespace

std::uint64_t Distribution::entries() const { return std::accumulate(count.begin(), count.end(), longer); }

double Distribution::quantile_us(double part) const {
  const std::uint64_t all = entries();
  if (all == 0) {
    return 0;
  }
  const double wanted = part * static_cast<double>(all);
  double below = 0;
  for (std::size_t k = 0; k < count.size(); ++k) {
    const double here = static_cast<double>(count[k]);
    if (here > 0 && below + here >= wanted) {
      return std::min(static_cast<double>(k) + (wanted - below) / here, max_us);
    }
    below += here;
  }
  return max_us;
}

bool Distribution::tells(double part) const {
  constexpr double kRounding = 1e-6;
  return static_cast<double>(entries()) * (1 - part) >= 1 - kRounding;
}

Distribution since(const Distribution& before, const Distribution& after) {
  Distribution out = after;
  for (std::size_t k = 0; k < before.count.size(); ++k) {
    out.count[k] -= before.count[k];
  }
  out.longer -= before.longer;
  while (!out.count.empty() && out.count.back() == 0) {
    out.count.pop_back();
  }
  if (!(after.max_us > before.max_us)) {  // the largest of all came before
    out.max_us = static_cast<double>(out.longer > 0 ? after.count.size() : out.count.size());
  }
  return out;
}

std::string json_of(const Result& r) {
  Json out{{"kind", "punctum-jitter"},
           {"rate_Hz", r.rate_Hz},
           {"seconds", r.seconds},
           {"cpu", r.cpu},
           {"priority", r.priority},
           {"degraded", r.degraded},
           {"missing", r.missing},
           {"ticks", r.ticks},
           {"missed", r.missed},
           {"stopped_ticking", r.stopped_ticking},
           {"wake_us", with_quantiles(r.wake)},
           {"tick_us", with_quantiles(r.tick)},
           {"interval_us", with_quantiles(r.interval)},
           {"first_release_ns", r.first_release_ns},
           {"page_faults", {{"minor", json_of(r.minor_faults)}, {"major", json_of(r.major_faults)}}},
           {"switches",
            {{"voluntary", json_of(r.voluntary_switches)}, {"involuntary", json_of(r.involuntary_switches)}}},
           {"migrations", json_of(r.migrations)},
           {"smis", json_of(r.smis)},
           {"work", r.work},
           {"load", r.load},
           {"machine", r.machine}};
  out["allocations"] = r.allocations_watched ? Json(r.allocations) : Json(nullptr);
  if (!r.answered.empty()) {
    out["answer_us"] = with_quantiles(r.answer);
    out["answer_us"]["what"] = r.answered;
    out["answer_us"]["min_us"] = r.answer_min_us;
    out["answer_us"]["unanswered"] = r.unanswered;
  }
  out["spikes"] = Json::array();
  for (const Spike& s : r.spikes) {
    out["spikes"].push_back({{"t_s", s.t_s}, {"wake_us", s.wake_us}});
  }
  out["slots_us"] = Json::object();
  for (const auto& [name, times] : r.slots) {
    out["slots_us"][name] = with_quantiles(times);
  }
  out["late"] = Json::array();
  for (const Explained& e : r.explained) {
    out["late"].push_back(json_of(e, r.first_release_ns));
  }
  out["late_unexplained"] = r.unexplained;
  out["untraced"] = r.untraced;
  out["parts"] = Json::array();
  for (std::size_t i = 0; i < r.parts.size(); ++i) {
    Json& part = out["parts"].emplace_back(json_of(r.parts[i]));
    if (i < r.missed_in_parts.size()) {
      part["missed"] = r.missed_in_parts[i];
    }
  }
  return out.dump(1) + "\n";
}

tl::expected<Result, std::string> result_of_json(std::string_view text) {
  try {
    const Json in = Json::parse(text);
    if (!in.is_object() || in.value("kind", "") != "punctum-jitter") {
      return tl::unexpected(std::string("is no result of punctum-jitter --json"));
    }
    Result r;
    r.rate_Hz = number<double>(in, "rate_Hz");
    r.seconds = number<double>(in, "seconds");
    r.cpu = number<int>(in, "cpu");
    r.priority = number<int>(in, "priority");
    r.degraded = in.at("degraded").get<bool>();
    r.ticks = number<std::uint64_t>(in, "ticks");
    r.missed = number<std::uint64_t>(in, "missed");
    r.wake = distribution(in.at("wake_us"));
    r.tick = distribution(in.at("tick_us"));
    r.interval = distribution(in.at("interval_us"));
    r.work = in.value("work", "");
    r.load = in.at("load").get<std::string>();
    r.machine = in.at("machine").get<std::string>();
    const Json& parts = in.at("parts");
    if (!parts.is_array() || parts.size() > kMostParts) {
      return tl::unexpected(fmt::format("parts: allowed: a list of at most {}", kMostParts));
    }
    for (const Json& part : parts) {
      r.parts.push_back(distribution(part));
      if (part.contains("missed")) {
        r.missed_in_parts.push_back(number<std::uint64_t>(part, "missed"));
      }
    }
    if (!r.missed_in_parts.empty() && r.missed_in_parts.size() != r.parts.size()) {
      return tl::unexpected(std::string("parts: allowed: missed in each of them or in none"));
    }
    return r;
  } catch (const Json::parse_error& e) {
    return tl::unexpected(fmt::format("is no result of punctum-jitter --json: no JSON at byte {}", e.byte));
  } catch (const Json::exception& e) {
    const std::string_view all = e.what();  // its kind and number in brackets, then words
    return tl::unexpected(
        fmt::format("is no result of punctum-jitter --json: {}", all.substr(all.find("] ") + 2)));
  } catch (const std::exception& e) {
    return tl::unexpected(std::string(e.what()));
  }
}

std::string histogram_text(const Distribution& wake) {
  std::string out = "# Histogram\n";
  double sum = 0;
  std::size_t least = wake.count.size();
  for (std::size_t k = 0; k < wake.count.size(); ++k) {
    out += fmt::format("{:06} {:06}\n", k, wake.count[k]);
    sum += static_cast<double>(k) * static_cast<double>(wake.count[k]);
    if (wake.count[k] > 0) {
      least = std::min(least, k);
    }
  }
  const std::uint64_t within = wake.entries() - wake.longer;
  out += fmt::format("# Total: {:09}\n", within);
  out += fmt::format("# Min Latencies: {:05}\n", within > 0 ? least : 0);
  out += fmt::format("# Avg Latencies: {:05}\n",
                     within > 0 ? std::llround(sum / static_cast<double>(within)) : 0);
  out += fmt::format("# Max Latencies: {:05}\n", std::llround(std::floor(wake.max_us)));
  out += fmt::format("# Histogram Overflows: {:05}\n", wake.longer);
  return out;
}

namespace {

std::string quantile_line(const char* name, const Distribution& d) {
  std::string out = fmt::format("{:<10}", name);
  for (const auto& [label, part] : kQuantiles) {
    out += d.tells(part) ? fmt::format(" {:>8.1f}", d.quantile_us(part)) : fmt::format("{:>9}", "-");
  }
  return out + (d.entries() > 0 ? fmt::format(" {:>8.1f}\n", d.max_us) : fmt::format("{:>9}\n", "-"));
}

// One line per class of latency, classes a quarter of an octave wide; the bars are as long as the logarithm
// of the count, since one late wake-up in a million matters.
std::string bars(const Distribution& d, int columns) {
  struct Class {
    double from, to;
    std::uint64_t count;
  };
  std::vector<Class> classes;
  std::size_t k = 0;
  while (k < d.count.size()) {
    const std::size_t wide = k < 8 ? 1 : std::max<std::size_t>(1, k / 4);
    const std::size_t end = std::min(k + wide, d.count.size());
    std::uint64_t sum = 0;
    for (std::size_t i = k; i < end; ++i) {
      sum += d.count[i];
    }
    classes.push_back({static_cast<double>(k), static_cast<double>(end), sum});
    k = end;
  }
  if (d.longer > 0) {
    classes.push_back({static_cast<double>(d.count.size()), d.max_us, d.longer});
  }
  const auto filled = [](const Class& c) { return c.count > 0; };
  const auto first = std::find_if(classes.begin(), classes.end(), filled);
  const auto last = std::find_if(classes.rbegin(), classes.rend(), filled).base();
  double most = 0;
  for (const Class& c : classes) {
    most = std::max(most, std::log10(1.0 + static_cast<double>(c.count)));
  }
  std::string out;
  for (auto c = first; c < last; ++c) {
    const double part = std::log10(1.0 + static_cast<double>(c->count)) / most;
    const int length = static_cast<int>(std::lround(part * std::max(10, columns - 32)));
    out += fmt::format("{:>7.0f} .. {:<7.0f}{:>11} {:#<{}}\n", c->from, c->to, c->count, "", length);
  }
  return out;
}

}  // namespace

std::string late_text(const Result& r) {
  std::string out;
  if (!r.untraced.empty()) {
    out += "not traced: " + r.untraced + "\n";
  }
  if (r.explained.empty()) {
    return out;
  }
  // Each cause once, the most frequent first, with its latest tick.
  struct Kind {
    std::size_t count = 0;
    const Explained* latest = nullptr;
  };
  const auto lateness = [](const Explained& e) { return e.tick.end_ns - e.tick.release_ns; };
  std::map<Cause, Kind> kinds;
  for (const Explained& e : r.explained) {
    Kind& kind = kinds[e.verdict.cause];
    ++kind.count;
    if (kind.latest == nullptr || lateness(e) > lateness(*kind.latest)) {
      kind.latest = &e;
    }
  }
  std::vector<std::pair<Cause, Kind>> list(kinds.begin(), kinds.end());
  std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) {
    return a.second.count != b.second.count ? a.second.count > b.second.count : a.first < b.first;
  });
  out += fmt::format("{} late ticks explained{}; the latest of each cause:\n", r.explained.size(),
                     r.unexplained > 0 ? fmt::format(", {} more not", r.unexplained) : "");
  for (const auto& [cause, kind] : list) {
    const Explained& e = *kind.latest;
    out += fmt::format("{:>6} x {:<15} {:>8.1f} us late at {:.4f} s: {}{}{}\n", kind.count, name_of(cause),
                       1e-3 * static_cast<double>(lateness(e)),
                       1e-9 * static_cast<double>(e.tick.release_ns - r.first_release_ns), e.verdict.what,
                       e.verdict.proof == Proof::none
                           ? ""
                           : fmt::format(" ({}, {:.0f} us)", name_of(e.verdict.proof), e.verdict.us),
                       r.slots.empty() ? ""
                                       : fmt::format("; slot {} took {:.1f} us", e.slot,
                                                     1e-3 * static_cast<double>(e.tick.longest_slot_ns)));
  }
  return out;
}

std::string summary(const Result& r, int columns) {
  std::string out = fmt::format("{:.0f} Hz for {:.1f} s: {} ticks, {} releases missed", r.rate_Hz, r.seconds,
                                r.ticks, r.missed);
  out += r.degraded ? "; WITHOUT real-time rights\n" : "\n";
  out += r.stopped_ticking ? fmt::format("the core stopped ticking after {:.1f} s\n", r.seconds) : "";
  out += r.work.empty() ? "" : "each tick: " + r.work + "\n";
  out += r.load.empty() ? "" : "beside it: " + r.load + "\n";
  for (const std::string& one : r.missing) {
    out += "  missing: " + one + "\n";
  }
  out += fmt::format("{:<10}", "us");
  for (const char* label : {"p50", "p90", "p99", "p99.9", "p99.99", "p99.999", "max"}) {
    out += fmt::format("{:>9}", label);
  }
  out += "\n" + quantile_line("wake-up", r.wake) + quantile_line("tick", r.tick) +
         quantile_line("interval", r.interval);
  for (const auto& [name, times] : r.slots) {
    out += quantile_line(name.c_str(), times);
  }
  if (!r.answered.empty()) {
    out += quantile_line("answer", r.answer) +
           fmt::format("answer: {}; {} of them, least {:.1f} us, {} without one\n", r.answered,
                       r.answer.entries(), r.answer_min_us, r.unanswered);
  }
  out += fmt::format(
      "page faults {} minor, {} major; switches {} voluntary, {} involuntary; migrations {}; SMIs {}\n",
      text_of(r.minor_faults), text_of(r.major_faults), text_of(r.voluntary_switches),
      text_of(r.involuntary_switches), text_of(r.migrations), text_of(r.smis));
  if (!r.spikes.empty()) {
    const Spike& worst = r.spikes.back();
    out += fmt::format("worst wake-up {:.1f} us late at {:.4f} s, {:.4f} s on the kernel's clock\n",
                       worst.wake_us, worst.t_s, 1e-9 * static_cast<double>(r.first_release_ns) + worst.t_s);
  }
  out += late_text(r);
  out += "wake-up, us        count (bars: logarithm)\n" + bars(r.wake, columns);
  if (r.answer.entries() > 0) {
    out += "answer, us         count\n" + bars(r.answer, columns);
  }
  return out;
}

}  // namespace punctum::jitter
