// The exchanges under load: several readers, writers that are killed in the middle of a sample.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iostream>
#include <memory>
#include <thread>
#include <vector>

#include "hal/ipc/exchange.hpp"

namespace punctum::hal {
namespace {

std::uint64_t mix(std::uint64_t x) {  // splitmix64
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// Every word follows from the number and the author, so a single foreign word shows.
struct Sample {
  std::uint64_t number = 0;
  std::uint64_t author = 0;
  std::uint64_t words[62] = {};
  static Sample of(std::uint64_t number, std::uint64_t author) {
    Sample s{number, author, {}};
    for (std::size_t i = 0; i < std::size(s.words); ++i) {
      s.words[i] = mix(number + (author << 48) + (i << 40));
    }
    return s;
  }
  [[nodiscard]] bool whole() const {
    const Sample expected = of(number, author);
    return std::memcmp(words, expected.words, sizeof words) == 0;
  }
};

using Ring = SeqRing<Sample, 8>;
using Queue = CommandQueue<Sample, 8>;

// Memory that parent and children share, zeroed.
template <class T>
class SharedMemory {
 public:
  SharedMemory()
      : data_(new (::mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))
                  T()) {}
  ~SharedMemory() { ::munmap(static_cast<void*>(data_), sizeof(T)); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  T* operator->() const { return data_; }
  T& operator*() const { return *data_; }

 private:
  T* data_;
};

struct Seen {
  std::uint64_t good = 0, torn = 0, wrong = 0, backwards = 0, lost = 0, overrun = 0;
  void look(const Sample& s, std::uint64_t index) {
    ++good;
    if (!s.whole()) {
      ++torn;
    }
    if (s.number != index) {
      ++wrong;
    }
  }
};

void read_newest(const Ring& ring, const std::atomic<bool>& stop, Seen& seen) {
  Sample s;
  std::uint64_t last = 0;
  for (bool last_round = false; !last_round;) {
    last_round = stop.load();  // the writer is done: what it left is there to be read
    std::uint64_t index = 0;
    const Read r = ring.newest(s, index);
    if (r == Read::overrun) {
      ++seen.overrun;
    }
    if (r != Read::ok) {
      continue;
    }
    seen.look(s, index);
    if (index < last) {
      ++seen.backwards;
    }
    last = index;
  }
}

void follow(const Ring& ring, const std::atomic<bool>& stop, Seen& seen) {
  Follower<Ring> follower(ring);
  Sample s;
  for (bool last_round = false; !last_round;) {
    last_round = stop.load();  // the writer is done: everything up to its end
    for (Read r = follower.next(s); r != Read::not_yet; r = follower.next(s)) {
      if (r == Read::ok) {
        seen.look(s, follower.position() - 1);
      }
    }
  }
  seen.lost = follower.lost();
}

void read_the_edge(const Ring& ring, const std::atomic<bool>& stop, Seen& seen) {
  Sample s;
  for (bool last_round = false; !last_round;) {  // the oldest one, which the writer is about to overwrite
    last_round = stop.load();
    const std::uint64_t head = ring.head();
    if (head < Ring::kSize) {
      continue;
    }
    const std::uint64_t index = head - Ring::kSize;
    const Read r = ring.read(index, s);
    if (r == Read::overrun) {
      ++seen.overrun;
    }
    if (r == Read::ok) {
      seen.look(s, index);
    }
  }
}

void expect_clean(const std::vector<Seen>& all) {
  for (const Seen& s : all) {
    EXPECT_GT(s.good + s.overrun, 0U);  // the edge is overwritten at once where a writer is never still
    EXPECT_EQ(s.torn, 0U);
    EXPECT_EQ(s.wrong, 0U);
    EXPECT_EQ(s.backwards, 0U);
  }
}

TEST(SeqRing, readers_of_a_busy_ring_never_see_a_torn_sample) {
  auto ring = std::make_unique<Ring>();
  std::atomic<bool> stop{false};
  std::vector<Seen> seen(4);
  std::vector<std::thread> readers;
  readers.emplace_back([&] { read_newest(*ring, stop, seen[0]); });
  readers.emplace_back([&] { follow(*ring, stop, seen[1]); });
  readers.emplace_back([&] { read_the_edge(*ring, stop, seen[2]); });
  readers.emplace_back([&] { read_newest(*ring, stop, seen[3]); });
  const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(1500);
  std::uint64_t pushed = 0;
  const auto enough = [&] { return std::chrono::steady_clock::now() > until; };
  while (!enough()) {
    ring->push(Sample::of(pushed, 1));
    ++pushed;
    if (pushed % 64 == 0) {
      std::this_thread::yield();
    }
  }
  stop = true;
  for (std::thread& r : readers) {
    r.join();
  }
  EXPECT_EQ(ring->head(), pushed);
  expect_clean(seen);
  EXPECT_GT(seen[0].good, 0U);
  EXPECT_EQ(seen[1].good + seen[1].lost, pushed) << "a follower accounts for all it lost";
}

TEST(SeqRing, an_empty_ring_says_so_and_a_future_sample_is_not_yet_there) {
  auto ring = std::make_unique<Ring>();
  Sample s;
  std::uint64_t index = 0;
  EXPECT_EQ(ring->newest(s, index), Read::not_yet);
  EXPECT_EQ(ring->read(0, s), Read::not_yet);
  EXPECT_EQ(ring->push(Sample::of(0, 1)), 0U);
  EXPECT_EQ(ring->newest(s, index), Read::ok);
  EXPECT_EQ(ring->read(1, s), Read::not_yet);
}

TEST(SeqRing, an_overwritten_sample_is_an_overrun_and_the_tail_is_still_there) {
  auto ring = std::make_unique<Ring>();
  for (std::uint64_t i = 0; i < 20; ++i) {
    EXPECT_EQ(ring->push(Sample::of(i, 1)), i);
  }
  Sample s;
  EXPECT_EQ(ring->read(11, s), Read::overrun);
  EXPECT_EQ(ring->read(12, s), Read::ok);
  EXPECT_EQ(ring->tail(), 13U);
  Follower<Ring> follower(*ring);
  EXPECT_EQ(follower.next(s), Read::ok);
  EXPECT_EQ(s.number, follower.lost());
  EXPECT_EQ(follower.lost(), 14U) << "two slots in hand before the writer comes round again";
}

// Kills the child after a moment; true if it died with a sample half written.
void let_run_and_kill(pid_t child, std::uint64_t round) {
  ::usleep(static_cast<useconds_t>(3000 + mix(round) % 7000));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

TEST(SeqRing, a_writer_killed_in_the_middle_of_a_sample_harms_no_reader_and_the_next_writer_goes_on) {
  SharedMemory<Ring> ring;
  std::atomic<bool> stop{false};
  std::vector<Seen> seen(3);
  const auto fork_writer = [&ring](std::uint64_t author) {
    const pid_t child = ::fork();
    if (child == 0) {
      // The number as push() finds it: a predecessor's finished but unannounced sample counts.
      Sample unused;
      std::uint64_t number = ring->head();
      if (ring->read(number, unused) == Read::ok) {
        ++number;
      }
      for (;; ++number) {
        ring->push(Sample::of(number, author));
      }
    }
    return child;
  };
  pid_t child = fork_writer(1);
  while (ring->head() == 0) {
    std::this_thread::yield();  // on a busy machine the first one may start late
  }
  std::vector<std::thread> readers;
  readers.emplace_back([&] { read_newest(*ring, stop, seen[0]); });
  readers.emplace_back([&] { follow(*ring, stop, seen[1]); });
  readers.emplace_back([&] { read_the_edge(*ring, stop, seen[2]); });
  int half_written = 0;
  for (std::uint64_t round = 2; round < 120; ++round) {
    let_run_and_kill(child, round);
    // The slot's sequence is its first word; odd: killed between first and last word.
    std::uint64_t sequence = 0;
    const std::size_t slot_size = (sizeof(Ring) - 64) / Ring::kSize;
    std::memcpy(&sequence,
                reinterpret_cast<const char*>(&*ring) + 64 + slot_size * (ring->head() % Ring::kSize), 8);
    half_written += sequence == 2 * ring->head() + 1 ? 1 : 0;
    const std::uint64_t head = ring->head();
    Sample s;
    std::uint64_t index = 0;
    ASSERT_EQ(ring->newest(s, index), Read::ok) << "the last whole sample stays readable";
    ASSERT_EQ(index, head - 1);
    ASSERT_TRUE(s.whole());
    child = fork_writer(round);
  }
  let_run_and_kill(child, 0);
  stop = true;
  for (std::thread& r : readers) {
    r.join();
  }
  expect_clean(seen);
  EXPECT_GT(std::min(seen[0].good, seen[1].good), 0U) << "the writer's last sample is there";
  EXPECT_GT(half_written, 0) << "no writer was caught in the middle";
  std::cout << "writers killed within a sample: " << half_written << " of 118, samples " << ring->head()
            << "\n";
}

TEST(CommandQueue, is_first_in_first_out_bounded_and_empty_when_drained) {
  auto queue = std::make_unique<Queue>();
  Sample s;
  EXPECT_FALSE(queue->try_pop(s));
  for (std::uint64_t i = 0; i < 8; ++i) {
    EXPECT_TRUE(queue->try_push(Sample::of(i, 1)));
  }
  EXPECT_FALSE(queue->try_push(Sample::of(8, 1)));
  for (std::uint64_t i = 0; i < 8; ++i) {
    ASSERT_TRUE(queue->try_pop(s));
    EXPECT_EQ(s.number, i);
  }
  EXPECT_FALSE(queue->try_pop(s));
}

TEST(CommandQueue, between_two_threads_nothing_is_lost_repeated_or_torn) {
  auto queue = std::make_unique<Queue>();
  constexpr std::uint64_t kCommands = 100'000;
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < kCommands; ++i) {
      while (!queue->try_push(Sample::of(i, 1))) {
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < kCommands; ++i) {
    Sample s;
    while (!queue->try_pop(s)) {
      std::this_thread::yield();
    }
    if (s.number != i || !s.whole()) {
      ++wrong;
    }
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
}

TEST(CommandQueue, a_killed_producer_leaves_whole_commands_and_the_next_one_goes_on) {
  SharedMemory<Queue> queue;
  std::uint64_t taken = 0;
  std::uint64_t bad = 0;
  for (std::uint64_t author = 1; author < 60; ++author) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (std::uint64_t i = 0;; ++i) {
        while (!queue->try_push(Sample::of(i, author))) {
        }
      }
    }
    std::uint64_t expected = 0;
    Sample s;
    const auto look = [&] {
      if (!s.whole() || s.author != author || s.number != expected++) {
        ++bad;
      }
      ++taken;
    };
    while (!queue->try_pop(s)) {
      std::this_thread::yield();  // on a busy machine the producer may start late
    }
    look();
    const auto until =
        std::chrono::steady_clock::now() + std::chrono::microseconds(2000 + mix(author) % 5000);
    const auto drain = [&] {
      while (queue->try_pop(s)) {
        look();
        if (std::chrono::steady_clock::now() > until) {
          return;
        }
      }
    };
    while (std::chrono::steady_clock::now() < until) {
      drain();
    }
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (queue->try_pop(s)) {
      look();
    }
  }
  EXPECT_EQ(bad, 0U);
  EXPECT_GT(taken, 59U) << "one of each producer, and what followed";
}

TEST(CommandQueue, counters_that_make_no_sense_empty_the_queue_instead_of_running_wild) {
  auto queue = std::make_unique<Queue>();
  const std::uint64_t nonsense = 1ULL << 40;
  std::memcpy(static_cast<void*>(queue.get()), &nonsense, sizeof nonsense);  // put, the first word
  Sample s;
  EXPECT_FALSE(queue->try_pop(s));
  EXPECT_TRUE(queue->try_push(Sample::of(7, 1)));
  ASSERT_TRUE(queue->try_pop(s));
  EXPECT_EQ(s.number, 7U);
}

}  // namespace
}  // namespace punctum::hal
