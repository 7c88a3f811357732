// Not part of any program: one thing per build of this file that must not happen in the tick.
// planted_violations_test says which layer finds which.
#include "tests/unit/rt/planted_violations.hpp"

#if defined(PLANT_malloc)
#include <cstdlib>
void punctum::rt::plant(Material& m) NONBLOCKING { m.kept = std::malloc(m.size); }
#elif defined(PLANT_operator_new)
void punctum::rt::plant(Material& m) NONBLOCKING { m.kept = new double[m.size]; }
#elif defined(PLANT_operator_delete)
void punctum::rt::plant(Material& m) NONBLOCKING { delete m.block; }
#elif defined(PLANT_vector_growth)
#include <vector>
void punctum::rt::plant(Material& m) NONBLOCKING {
  std::vector<double> v;
  v.push_back(m.wanted);
  m.kept = v.data();
}
#elif defined(PLANT_string)
#include <string>
void punctum::rt::plant(Material& m) NONBLOCKING {
  const std::string twice = std::string(m.text) + m.text;
  m.size = twice.size() / 8;
}
#elif defined(PLANT_exception)
void punctum::rt::plant(Material& m) NONBLOCKING {
  try {
    if (!m.wrong) {
      throw m.wanted;
    }
  } catch (double thrown) {
    m.wanted = thrown;
  }
}
#elif defined(PLANT_range_check)
#include <array>
void punctum::rt::plant(Material& m) NONBLOCKING {
  const std::array<double, 64> numbers{1, 2, 3};
  m.wanted = 1 + numbers.at(m.size);
}
#elif defined(PLANT_dynamic_cast)
struct Base {
  virtual int number() const;
};
struct Derived : Base {
  int number() const override;
};
int Base::number() const { return 0; }
int Derived::number() const { return 1; }
const Derived derived;
void punctum::rt::plant(Material& m) NONBLOCKING {
  const Base* base = &derived;
  asm volatile("" : "+r"(base));
  m.wrong = dynamic_cast<const Derived*>(base) == nullptr;
}
#elif defined(PLANT_mutex)
#include <mutex>
std::mutex mutex;
void punctum::rt::plant(Material& m) NONBLOCKING {
  const std::lock_guard lock(mutex);
  m.wanted = 1;
}
#elif defined(PLANT_condition_variable)
#include <chrono>
#include <condition_variable>
#include <mutex>
std::mutex mutex;
std::condition_variable condition;
void punctum::rt::plant(Material& m) NONBLOCKING {
  std::unique_lock lock(mutex);
  m.wrong = condition.wait_for(lock, std::chrono::microseconds(200), [&m] { return m.wrong; });
}
#elif defined(PLANT_printf)
#include <cstdio>
void punctum::rt::plant(Material& m) NONBLOCKING { std::printf("%.17g\n", m.wanted); }
#elif defined(PLANT_iostream)
#include <iostream>
void punctum::rt::plant(Material& m) NONBLOCKING { std::cout << m.wanted << std::endl; }
#elif defined(PLANT_log)
#include <fmt/format.h>
void punctum::rt::plant(Material& m) NONBLOCKING { fmt::print("tick {}: {} N\n", m.tick, m.wanted); }
#elif defined(PLANT_file)
#include <fcntl.h>
#include <unistd.h>
void punctum::rt::plant(Material& m) NONBLOCKING {
  char text[64];
  const int file = ::open("/proc/self/stat", O_RDONLY);
  m.wrong = ::read(file, text, sizeof(text)) < 0;
  ::close(file);
}
#elif defined(PLANT_system_call)
#include <sys/syscall.h>
#include <unistd.h>
void punctum::rt::plant(Material& m) NONBLOCKING { m.wrong = ::syscall(SYS_gettid) < 0; }
#elif defined(PLANT_sleep)
#include <unistd.h>
void punctum::rt::plant(Material& m) NONBLOCKING { m.wrong = ::usleep(50) != 0; }
#elif defined(PLANT_page_touch)
void punctum::rt::plant(Material& m) NONBLOCKING { *m.fresh_page = std::byte{1}; }
#elif defined(PLANT_unbounded_loop)
void punctum::rt::plant(Material& m) NONBLOCKING {
  double x = 0;
  while (m.wanted - x > 1e-9) {
    x += 0.001 * (m.wanted - x);
  }
  m.wrong = x > m.wanted;
}
#elif defined(PLANT_virtual_call)
void punctum::rt::plant(Material& m) NONBLOCKING { m.device->write(m.wanted); }
#elif defined(PLANT_function_pointer)
void punctum::rt::plant(Material& m) NONBLOCKING { m.callback(m.wanted); }
#elif defined(PLANT_guarded_static)
#include <cmath>
void punctum::rt::plant(Material& m) NONBLOCKING {
  static const double root = std::sqrt(m.wanted);
  m.wanted = root;
}
#elif defined(PLANT_thread_local)
#include <string>
void punctum::rt::plant(Material& m) NONBLOCKING {
  thread_local std::string last;
  last = m.text;
}
#elif defined(PLANT_exit)
#include <cstdlib>
void punctum::rt::plant(Material& m) NONBLOCKING {
  if (!m.wrong) {
    std::exit(1);
  }
}
#elif defined(PLANT_assert)
#undef NDEBUG
#include <cassert>
void punctum::rt::plant(Material& m) NONBLOCKING { assert(m.wrong); }
#elif defined(PLANT_thread)
#include <unistd.h>

#include <thread>
void punctum::rt::plant(Material& m) NONBLOCKING {
  std::thread([&m] { m.wrong = ::usleep(50) != 0; }).join();
}
#elif defined(PLANT_nothing)
#include <cmath>
void punctum::rt::plant(Material& m) NONBLOCKING { m.wanted = 1 + 1e-3 * std::sqrt(m.wanted); }
#endif
