// The two exchanges of the station, every execution of small cases under weak memory, and proof that the
// explorer would have found what it looks for: each ordering and each step is taken away in turn.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <memory>

#include "hal/ipc/exchange.hpp"
#include "tests/support/weak_memory.hpp"

namespace punctum::model {
namespace {

// A sample that says which one it is and who wrote it, and shows when its halves do not belong together.
struct Sample {
  std::uint64_t word = 0;
  std::uint64_t complement = 0;
  static Sample of(std::uint64_t index, std::uint64_t author) {
    const std::uint64_t w = 1000 * author + index + 1;
    return {w, ~w};
  }
  [[nodiscard]] bool whole() const { return complement == ~word; }
  [[nodiscard]] std::uint64_t index() const { return word % 1000 - 1; }
};

constexpr int kWriter = 0;
constexpr int kReader = 1;

using Ring = hal::SeqRing<Sample, 2, Word>;
// Locations in the order of their construction: head, then per slot sequence, word, complement.
bool is_head(int location) { return location == 0; }
bool is_sequence(int location) { return location > 0 && (location - 1) % 3 == 0; }
bool is_payload(int location) { return location > 0 && (location - 1) % 3 != 0; }

// Readers never write, so one stands for any number of them.
struct RingCase {
  int pushes = 0;
  bool writer_dies = false;
  std::vector<int> reads;  // >= 0: read(index), -1: newest()

  void operator()(World& world) const {
    world.owned_by(kWriter);
    auto ring = std::make_shared<Ring>();
    const auto write = [ring](int count, std::uint64_t author) {
      for (int n = 0; n < count; ++n) {
        ring->push(Sample::of(next_index(*ring), author));
      }
    };
    world.thread(kWriter, [this, write] { write(pushes, 1); });
    if (writer_dies) {
      world.mortal(kWriter, [this, write] { write(pushes, 2); });
    }
    world.thread(kReader, [this, ring, &world] {
      std::uint64_t seen = 0;
      bool any = false;
      for (const int wanted : reads) {
        Sample sample;
        std::uint64_t index = 0;
        hal::Read result;
        if (wanted >= 0) {
          index = static_cast<std::uint64_t>(wanted);
          result = ring->read(index, sample);
          if (any && index <= seen && result == hal::Read::not_yet) {
            world.fail("a seen sample became not_yet");
          }
        } else {
          result = ring->newest(sample, index);
          if (any && result == hal::Read::not_yet) {
            world.fail("the ring became empty");
          }
          if (any && result == hal::Read::ok && index < seen) {
            world.fail("the newest became older");
          }
          if (pushes <= 2 && !writer_dies && result == hal::Read::overrun) {
            world.fail("overrun although nothing was overwritten");
          }
        }
        if (result != hal::Read::ok) {
          continue;
        }
        if (!sample.whole()) {
          world.fail("a torn sample was accepted");
        }
        if (sample.index() != index) {
          world.fail("a sample of another number was accepted");
        }
        if (wanted < 0) {
          seen = index;
          any = true;
        }
      }
    });
  }

  // The number the next push will use, as push() itself finds it, read from the writer's own words.
  static std::uint64_t next_index(const Ring& ring) {
    const std::uint64_t head = ring.head();
    Sample unused;
    return ring.read(head, unused) == hal::Read::ok ? head + 1 : head;
  }
};

const RingCase kAppend{.pushes = 2, .writer_dies = false, .reads = {-1, -1}};
const RingCase kOverwrite{.pushes = 4, .writer_dies = false, .reads = {1, -1}};
const RingCase kTwoLooks{.pushes = 4, .writer_dies = false, .reads = {-1, -1}};
const RingCase kFollow{.pushes = 4, .writer_dies = false, .reads = {0, 1, 2}};
const RingCase kCrash{.pushes = 3, .writer_dies = true, .reads = {1, 2}};
const RingCase kCrashNewest{.pushes = 2, .writer_dies = true, .reads = {-1, 2}};
const std::vector<std::pair<const char*, const RingCase*>> kRingCases{
    {"append", &kAppend}, {"overwrite", &kOverwrite},       {"follow", &kFollow},
    {"crash", &kCrash},   {"crash, newest", &kCrashNewest}, {"two looks", &kTwoLooks}};

TEST(SeqRingModel, no_execution_accepts_a_torn_sample_or_loses_one) {
  for (const auto& [name, scenario] : kRingCases) {
    const Verdict verdict = explore(*scenario);
    EXPECT_EQ(verdict.failure, "") << name << "\n" << verdict.trace;
    std::cout << name << ": " << verdict.executions << " executions\n";
  }
}

std::string first_failure(const Mutation& mutation) {
  for (const auto& [name, scenario] : kRingCases) {
    const Verdict verdict = explore(*scenario, mutation);
    if (!verdict.failure.empty()) {
      std::cout << "found in case " << name << " at execution " << verdict.executions << ": "
                << verdict.failure << "\n";
      return verdict.failure;
    }
  }
  return "";
}

Mutation weaken(const std::function<bool(const Access&)>& which) {
  return {.before = [which](Access& a) {
    if (which(a)) {
      a.order = std::memory_order_relaxed;
    }
  }};
}

TEST(SeqRingModel, finds_every_ordering_that_is_taken_away) {
  const auto store_of = [](bool (*where)(int)) {
    return [where](const Access& a) { return a.store && where(a.location); };
  };
  const auto load_of = [](bool (*where)(int)) {
    return [where](const Access& a) { return !a.store && a.role == kReader && where(a.location); };
  };
  EXPECT_NE(first_failure(weaken(store_of(is_payload))), "") << "payload stores relaxed";
  EXPECT_NE(first_failure(weaken(load_of(is_payload))), "") << "payload loads relaxed";
  EXPECT_NE(first_failure(weaken(store_of(is_sequence))), "") << "the even mark relaxed";
  EXPECT_NE(first_failure(weaken(load_of(is_sequence))), "") << "the first check relaxed";
  EXPECT_NE(first_failure(weaken(store_of(is_head))), "") << "head stored relaxed";
  EXPECT_NE(first_failure(weaken(load_of(is_head))), "") << "head loaded relaxed";
}

TEST(SeqRingModel, finds_a_missing_odd_mark) {
  EXPECT_NE(
      first_failure(
          {.before = [](Access& a) { a.dropped = a.store && is_sequence(a.location) && a.value % 2 == 1; }}),
      "");
}

TEST(SeqRingModel, finds_a_missing_second_check) {
  std::uint64_t first_check = 0;
  EXPECT_NE(first_failure({.before =
                               [&](Access& a) {
                                 if (a.role == kReader && is_sequence(a.location) &&
                                     a.order == std::memory_order_relaxed) {
                                   a.forced = first_check;
                                 }
                               },
                           .after =
                               [&](Access& a) {
                                 if (a.role == kReader && is_sequence(a.location)) {
                                   first_check = a.value;
                                 }
                               }}),
            "");
}

TEST(SeqRingModel, finds_a_writer_that_does_not_look_for_a_sample_its_predecessor_finished) {
  // Without it the successor rewrites a sample that readers accept: torn, with an unchanged sequence.
  EXPECT_NE(first_failure({.before =
                               [](Access& a) {
                                 if (a.role == kWriter && !a.store && is_sequence(a.location)) {
                                   a.forced = 0;
                                 }
                               }}),
            "");
}

using Queue = hal::CommandQueue<Sample, 2, Word>;
// Locations: put, taken, then per slot word, complement.
constexpr int kPut = 0;
constexpr int kTaken = 1;
bool is_entry(int location) { return location > 1; }

struct QueueCase {
  int attempts = 0;  // of each side
  bool producer_dies = false;

  void operator()(World& world) const {
    struct State {
      Queue queue;
      std::vector<std::uint64_t> accepted, received;
      std::uint64_t number = 0;
    };
    world.owned_by(kWriter);
    auto state = std::make_shared<State>();
    world.set_owner(kTaken, kReader);
    const auto produce = [this, state] {
      for (int n = 0; n < attempts; ++n) {
        const std::uint64_t number = state->number++;
        if (state->queue.try_push(Sample::of(number, 1))) {
          state->accepted.push_back(number);
        }
      }
    };
    const auto consume = [state, &world] {
      Sample sample;
      if (!state->queue.try_pop(sample)) {
        return false;
      }
      if (!sample.whole()) {
        world.fail("a torn command was taken");
      }
      if (!state->received.empty() && sample.index() <= state->received.back()) {
        world.fail("a command came twice or out of order");
      }
      state->received.push_back(sample.index());
      return true;
    };
    world.thread(kWriter, produce);
    if (producer_dies) {
      world.mortal(kWriter, produce);
    }
    world.thread(kReader, [this, consume] {
      for (int n = 0; n < attempts; ++n) {
        (void)consume();
      }
    });
    world.at_end([this, state, consume, &world] {
      while (consume()) {
      }
      // A producer that died after its last store has put a command that nobody counts as accepted.
      if (state->received.size() > state->accepted.size() + (producer_dies ? 1 : 0)) {
        world.fail("more was taken than was put");
      }
      if (!std::includes(state->received.begin(), state->received.end(), state->accepted.begin(),
                         state->accepted.end())) {
        world.fail("a command was lost");
      }
    });
  }
};

const QueueCase kExchange{.attempts = 4, .producer_dies = false};
const QueueCase kProducerDies{.attempts = 3, .producer_dies = true};

std::string queue_failure(const Mutation& mutation, bool said = true) {
  for (const QueueCase* scenario : {&kExchange, &kProducerDies}) {
    const Verdict verdict = explore(*scenario, mutation);
    if (said) {
      std::cout << (scenario->producer_dies ? "producer dies: " : "exchange: ") << verdict.executions
                << " executions " << verdict.failure << "\n";
    }
    if (!verdict.failure.empty()) {
      return verdict.failure + "\n" + verdict.trace;
    }
  }
  return "";
}

TEST(CommandQueueModel, no_execution_loses_repeats_reorders_or_tears_a_command) {
  EXPECT_EQ(queue_failure({}), "");
}

TEST(CommandQueueModel, finds_every_ordering_that_is_taken_away) {
  EXPECT_NE(queue_failure(weaken([](const Access& a) { return a.store && a.location == kPut; })), "");
  EXPECT_NE(queue_failure(weaken([](const Access& a) { return !a.store && a.location == kPut; })), "");
  // Entries travel with release and acquire themselves; the two sides of `taken` matter when they do not.
  EXPECT_NE(queue_failure(weaken([](const Access& a) {
              return (a.store && a.location == kTaken) || (!a.store && is_entry(a.location));
            })),
            "");
  EXPECT_NE(queue_failure(weaken([](const Access& a) {
              return (!a.store && a.location == kTaken) || (a.store && is_entry(a.location));
            })),
            "");
}

TEST(CommandQueueModel, is_not_alarmed_by_orderings_that_are_stronger_than_needed) {
  EXPECT_EQ(queue_failure(weaken([](const Access& a) { return is_entry(a.location); })), "");
}

TEST(CommandQueueModel, finds_a_bound_that_is_one_too_large) {
  // When two entries lie in the queue the producer is told that one more was taken.
  std::uint64_t put = 0;
  EXPECT_NE(queue_failure({.before =
                               [&](Access& a) {
                                 if (a.store && a.location == kPut) {
                                   put = a.value;
                                 }
                               },
                           .after =
                               [&](Access& a) {
                                 const bool full =
                                     a.role == kWriter && a.location == kTaken && a.value + 2 == put;
                                 if (full) {
                                   ++a.value;
                                 }
                               }}),
            "");
}

}  // namespace
}  // namespace punctum::model
