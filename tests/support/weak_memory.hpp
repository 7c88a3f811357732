// An exhaustive explorer of small concurrent programs under weak memory. The program is the real template
// code (hal/ipc/exchange.hpp) over model::Word in place of std::atomic<uint64_t>.
//
// Memory is what C++ release/acquire and relaxed atomics allow: every location keeps all values ever stored,
// in order; every thread has a view, the oldest value of each location it may still read. A load returns
// *any* value from its view on; a release store takes the thread's view along, an acquire load joins it. So a
// reader may see stores to different words in any order that the orderings do not forbid. Every location is
// written by one role only, and stores become visible at once (readers may still miss them), so threads need
// to be switched only before a load of another role's word; all such switches and all values are explored.
//
// Not simulated: a relaxed store that overtakes an earlier relaxed load (load buffering). A thread that does
// one after the other is reported as a failure, so a program that passes has no such behaviour.
#pragma once

#include <setjmp.h>
#include <ucontext.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace punctum::model {

inline constexpr int kMaxLocations = 24;
inline constexpr int kNobody = -1;
using View = std::array<std::uint8_t, kMaxLocations>;

// One access, as a mutation sees it: it may weaken the order, drop a store or force the result of a load.
struct Access {
  int role = 0;
  int location = 0;
  bool store = false;
  std::uint64_t value = 0;
  std::memory_order order = std::memory_order_relaxed;
  bool dropped = false;
  std::optional<std::uint64_t> forced = std::nullopt;
};

struct Mutation {
  std::function<void(Access&)> before = {};
  std::function<void(Access&)> after = {};  // of a load: value = what was read, and may be changed
};

class World {
 public:
  World(std::vector<std::pair<int, int>>& trail, const Mutation& mutation, bool traced)
      : trail_(trail), mutation_(mutation), traced_(traced) {
    current() = this;
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World() {
    for (std::unique_ptr<Fiber>& fiber : fibers_) {
      if (fiber->done ? !fiber->abandoned : !fiber->started) {
        fiber->body = nullptr;
        idle_fibers().push_back(std::move(fiber));
      }
    }
    current() = nullptr;
  }

  static World*& current() {
    static World* world = nullptr;
    return world;
  }

  // ---- what a scenario uses
  void thread(int role, std::function<void()> body) { add(role, std::move(body), true); }
  // The thread of this role may die before any of its stores; then the successor runs, and sees all it did.
  void mortal(int role, std::function<void()> successor) {
    mortal_role_ = role;
    successor_ = add(role, std::move(successor), false);
  }
  // The one role that writes the locations made from here on.
  void owned_by(int role) { next_owner_ = role; }
  void set_owner(int location, int role) { locations_[static_cast<std::size_t>(location)].writer = role; }
  // Runs after all threads, on the final values.
  void at_end(std::function<void()> check) { at_end_ = std::move(check); }
  void fail(const std::string& what) {
    if (failure_.empty()) {
      failure_ = what;
    }
  }
  void note(const std::string& what) {
    if (traced_) {
      trace_ += "  " + what + "\n";
    }
  }

  // ---- what model::Word uses
  int add_location() {
    locations_.push_back({});
    locations_.back().writer = next_owner_;
    locations_.back().messages.push_back({0, View{}});
    return static_cast<int>(locations_.size()) - 1;
  }

  std::uint64_t load(int id, std::memory_order order) {
    Location& location = locations_[static_cast<std::size_t>(id)];
    if (running_ == nullptr) {
      return location.messages.back().value;
    }
    Access access{.role = running_->role, .location = id, .order = order};
    if (mutation_.before) {
      mutation_.before(access);
    }
    if (access.forced) {
      return *access.forced;
    }
    const bool foreign = location.writer != running_->role;
    if (foreign) {
      pause(*running_);
    }
    std::size_t time = location.messages.size() - 1;
    const std::size_t oldest = running_->view[static_cast<std::size_t>(id)];
    if (foreign) {
      time -= static_cast<std::size_t>(choose(static_cast<int>(time - oldest) + 1));
    }
    const Message& message = location.messages[time];
    running_->view[static_cast<std::size_t>(id)] = static_cast<std::uint8_t>(time);
    if (access.order == std::memory_order_acquire) {
      join(running_->view, message.view);
    } else if (foreign) {
      running_->read_relaxed = true;
    }
    access.value = message.value;
    if (mutation_.after) {
      mutation_.after(access);
    }
    if (traced_) {
      note(said("loads", id, message.value) + (time + 1 == location.messages.size() ? "" : " (old)"));
    }
    return access.value;
  }

  void store(int id, std::uint64_t value, std::memory_order order) {
    if (running_ == nullptr) {
      locations_[static_cast<std::size_t>(id)].messages.push_back({value, View{}});
      return;
    }
    Access access{.role = running_->role, .location = id, .store = true, .value = value, .order = order};
    if (running_->role == mortal_role_ && successor_ != nullptr && choose(2) == 1) {
      die();
    }
    if (mutation_.before) {
      mutation_.before(access);
    }
    if (access.dropped) {
      return;
    }
    const bool release = access.order == std::memory_order_release;
    if (!release && running_->read_relaxed) {
      fail("a relaxed store may overtake an earlier relaxed load");
    }
    Location& location = locations_[static_cast<std::size_t>(id)];
    if (location.writer != running_->role) {
      fail("a location is written by a role that does not own it");
    }
    running_->view[static_cast<std::size_t>(id)] = static_cast<std::uint8_t>(location.messages.size());
    View carried{};
    if (release) {
      carried = running_->view;
    } else {
      carried[static_cast<std::size_t>(id)] = static_cast<std::uint8_t>(location.messages.size());
    }
    location.messages.push_back({access.value, carried});
    if (traced_) {
      note(said("stores", id, access.value));
    }
  }

  // ---- what the explorer uses
  void run() {
    while (failure_.empty()) {
      std::vector<Fiber*> ready;
      for (const auto& fiber : fibers_) {
        if (fiber->enabled && !fiber->done) {
          ready.push_back(fiber.get());
        }
      }
      if (ready.empty()) {
        break;
      }
      running_ = ready[static_cast<std::size_t>(choose(static_cast<int>(ready.size())))];
      resume(*running_);
      running_ = nullptr;
    }
    if (failure_.empty() && at_end_) {
      at_end_();
    }
  }
  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] std::string trace() const { return trace_; }

 private:
  struct Message {
    std::uint64_t value;
    View view;
  };
  struct Location {
    std::vector<Message> messages = {};
    int writer = kNobody;  // the role that owns it
  };
  struct Fiber {
    ucontext_t context = {};  // of its first entry; from then on `paused`, which needs no system call
    jmp_buf paused = {};
    std::unique_ptr<char[]> stack = std::make_unique_for_overwrite<char[]>(kStack);
    bool started = false;
    bool abandoned = false;  // in the middle of its body
    std::function<void()> body;
    View view{};
    int role = 0;
    bool enabled = true;
    bool done = false;
    bool read_relaxed = false;
  };

  static constexpr std::size_t kStack = std::size_t{64} << 10;

  // Hundreds of thousands of executions share a handful of stacks.
  static std::vector<std::unique_ptr<Fiber>>& idle_fibers() {
    static std::vector<std::unique_ptr<Fiber>> fibers;
    return fibers;
  }
  static std::unique_ptr<Fiber> fresh_fiber() {
    if (!idle_fibers().empty()) {
      std::unique_ptr<Fiber> fiber = std::move(idle_fibers().back());
      idle_fibers().pop_back();
      return fiber;
    }
    auto fiber = std::make_unique<Fiber>();
    getcontext(&fiber->context);
    fiber->context.uc_stack.ss_sp = fiber->stack.get();
    fiber->context.uc_stack.ss_size = kStack;
    makecontext(&fiber->context, &World::enter, 0);
    return fiber;
  }

  Fiber* add(int role, std::function<void()> body, bool enabled) {
    fibers_.push_back(fresh_fiber());
    Fiber& fiber = *fibers_.back();
    fiber.role = role;
    fiber.body = std::move(body);
    fiber.view = {};
    fiber.enabled = enabled;
    fiber.done = false;
    fiber.read_relaxed = false;
    return &fiber;
  }
  // One body after another, each for the world of its time.
  static void enter() {
    for (;;) {
      Fiber* self = current()->running_;
      self->body();
      self->done = true;
      pause(*self);
    }
  }
  static jmp_buf& scheduler() {
    static jmp_buf buffer;
    return buffer;
  }
  static void resume(Fiber& fiber) {
    if (_setjmp(scheduler()) == 0) {
      if (fiber.started) {
        _longjmp(fiber.paused, 1);
      }
      fiber.started = true;
      setcontext(&fiber.context);
    }
  }
  static void pause(Fiber& fiber) {
    if (_setjmp(fiber.paused) == 0) {
      _longjmp(scheduler(), 1);
    }
  }
  void die() {
    note("role " + std::to_string(running_->role) + " dies, its successor begins");
    join(successor_->view, running_->view);
    successor_->enabled = true;
    successor_ = nullptr;
    running_->done = true;
    running_->abandoned = true;
    pause(*running_);
  }
  [[nodiscard]] std::string said(const char* does, int id, std::uint64_t value) const {
    return "role " + std::to_string(running_->role) + " " + does + " [" + std::to_string(id) +
           "] = " + std::to_string(value);
  }
  int choose(int among) {
    if (among <= 1) {
      return 0;
    }
    if (position_ == trail_.size()) {
      trail_.emplace_back(0, among);
    }
    return trail_[position_++].first;
  }
  static void join(View& into, const View& from) {
    for (std::size_t i = 0; i < into.size(); ++i) {
      into[i] = std::max(into[i], from[i]);
    }
  }

  std::vector<std::pair<int, int>>& trail_;  // choice made, choices there were
  std::size_t position_ = 0;
  const Mutation& mutation_;
  bool traced_;
  std::string trace_;
  std::string failure_;
  std::vector<Location> locations_;
  std::vector<std::unique_ptr<Fiber>> fibers_;
  std::function<void()> at_end_;
  Fiber* running_ = nullptr;
  Fiber* successor_ = nullptr;
  int mortal_role_ = kNobody;
  int next_owner_ = kNobody;
};

// Takes the place of std::atomic<std::uint64_t>.
class Word {
 public:
  Word() : id_(World::current()->add_location()) {}
  [[nodiscard]] std::uint64_t load(std::memory_order order) const {
    return World::current()->load(id_, order);
  }
  void store(std::uint64_t value, std::memory_order order) { World::current()->store(id_, value, order); }

 private:
  int id_;
};

struct Verdict {
  std::uint64_t executions = 0;
  std::string failure;  // empty: no execution broke the rules
  std::string trace;    // of the first execution that did
};

// Runs the scenario in every way there is, or until one fails.
inline Verdict explore(const std::function<void(World&)>& scenario, const Mutation& mutation = {},
                       std::uint64_t most_executions = 50'000'000) {
  Verdict verdict;
  std::vector<std::pair<int, int>> trail;
  for (;;) {
    World world(trail, mutation, false);
    scenario(world);
    world.run();
    ++verdict.executions;
    if (!world.failure().empty()) {
      verdict.failure = world.failure();
      break;
    }
    if (verdict.executions == most_executions) {
      verdict.failure = "not finished";
      return verdict;
    }
    while (!trail.empty() && trail.back().first + 1 == trail.back().second) {
      trail.pop_back();
    }
    if (trail.empty()) {
      return verdict;
    }
    ++trail.back().first;
  }
  World world(trail, mutation, true);
  scenario(world);
  world.run();
  verdict.trace = world.trace();
  return verdict;
}

}  // namespace punctum::model
