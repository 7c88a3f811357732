// Any bytes, at any time, in the memory that vision and the writers of commands share with the core: whole
// observations and commands, or a hostile writer's, rings and counters included. The core, taken up in any
// phase, holds its invariants; left out are those that ask what was told by sight and command, which nobody
// knows here.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "tests/search/schedule.hpp"

namespace {

using namespace punctum::rt;
using test::Invariant;

// What a record of the input does; the record's first byte.
enum Act : std::uint8_t {
  overwrite_sight,
  overwrite_parent,
  overwrite_console,
  observe,
  ask_parent,
  ask_console,
  move,
  wait,
  acts
};

// Of such a history only the writers could say whether it was broken.
constexpr Invariant kToldByOthers[] = {Invariant::lateral_bounded,     Invariant::vision_sum,
                                       Invariant::blind_only_outwards, Invariant::gate_seen,
                                       Invariant::stops_on_command,    Invariant::puncture_confirmed,
                                       Invariant::over_at_rest,        Invariant::gate_not_cut_short,
                                       Invariant::fixtures_fade,       Invariant::deeper_by_the_hand};
// Nor, once the scale between hand and needle may have been commanded, how far the needle has to go.
constexpr Invariant kOfTheScale[] = {Invariant::moves_with_the_hand, Invariant::begins_at_the_needle,
                                     Invariant::speed_bounded};

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  std::uint8_t byte() {
    if (rest_.empty()) {
      return 0;
    }
    const std::uint8_t value = rest_.front();
    rest_ = rest_.subspan(1);
    return value;
  }
  // So many of its bytes, or what is left, over `bytes` from a place on that the input names, too.
  void overwrite(std::span<std::uint8_t> bytes) {
    const std::size_t high = byte(), low = byte();
    const std::size_t place = (256 * high + low) % bytes.size();
    const std::size_t count = std::min<std::size_t>({byte(), rest_.size(), bytes.size() - place});
    std::copy_n(rest_.begin(), count, bytes.begin() + static_cast<std::ptrdiff_t>(place));
    rest_ = rest_.subspan(count);
  }
  template <class T>
  void overwrite_object(T& object) {
    overwrite({reinterpret_cast<std::uint8_t*>(&object), sizeof object});
  }

 private:
  std::span<const std::uint8_t> rest_;
};

test::Search& search() {
  static test::Search one;
  return one;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr int kMostTicks = 1500, kMoveTicks = 40;
  constexpr double kSpeed_m_s = 0.06;  // of a hand in a hurry; of the needle 0.1 mm/s
  Input input(data, size);
  const auto from = static_cast<test::From>(input.byte() % test::kFroms);
  (void)search().run({from, 0, {}, 0});
  test::LyingStation& station = search().station();
  LocalStation& memory = station.memory();
  bool scaled = false;
  for (int ticks = 0; !input.empty() && ticks < kMostTicks;) {
    int run = 1;
    double speed_m_s = 0;
    switch (input.byte() % acts) {
      case overwrite_sight:
        input.overwrite_object(memory.observation.slot);
        break;
      case overwrite_parent:
        input.overwrite_object(memory.parent.queue);
        break;
      case overwrite_console:
        input.overwrite_object(memory.console.queue);
        scaled = true;
        break;
      case observe: {
        Observation seen = station.truth.shown;
        seen.exposure_ns = station.truth.now;
        input.overwrite_object(seen);
        memory.observation.slot.push(seen);
        break;
      }
      case ask_parent: {
        Command command;
        input.overwrite_object(command);
        (void)memory.parent.queue.try_push(command);
        break;
      }
      case ask_console: {
        Command command;
        input.overwrite_object(command);
        (void)memory.console.queue.try_push(command);
        scaled = true;
        break;
      }
      case move:
        speed_m_s = kSpeed_m_s / 128 * static_cast<std::int8_t>(input.byte());
        run = kMoveTicks;
        break;
      default:
        run = 1 + input.byte();
        break;
    }
    for (int i = 0; i < run && ticks < kMostTicks; ++i, ++ticks) {
      station.truth.intention.x() += 1e-3 * speed_m_s;
      station.tick(ticks, {});
    }
  }
  for (const test::Broken& broken : station.checker().broken()) {
    const auto among = [&broken](std::span<const Invariant> some) {
      return std::find(some.begin(), some.end(), broken.what) != some.end();
    };
    if (!among(kToldByOthers) && !(scaled && among(kOfTheScale))) {
      std::fprintf(stderr, "%s %s on tick %d: %g, allowed %g\n", test::name(broken.what).number,
                   test::name(broken.what).name, broken.tick, broken.found, broken.allowed);
      std::abort();
    }
  }
  return 0;
}
