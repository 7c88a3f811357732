// Not part of any program: one thing per build of this file that the core must not contain. The proof in
// core_symbols_test has to find each of them.
#if defined(PLANT_MALLOC)
#include <cstdlib>
void* plant(unsigned long n) { return std::malloc(n); }
#elif defined(PLANT_NEW)
double* plant(unsigned long n) { return new double[n]; }
#elif defined(PLANT_VECTOR)
#include <vector>
void plant(std::vector<int>& v) { v.push_back(1); }
#elif defined(PLANT_STRING)
#include <string>
std::string plant(const char* s) { return std::string(s) + s; }
#elif defined(PLANT_THROW)
void plant(int i) {
  if (i > 0) {
    throw i;
  }
}
#elif defined(PLANT_RANGE_CHECK)
#include <array>
int plant(const std::array<int, 4>& a, unsigned i) { return a.at(i); }
#elif defined(PLANT_RTTI)
struct Base {
  virtual int f();
};
struct Derived : Base {
  int f() override;
};
int Base::f() { return 0; }
int Derived::f() { return 1; }
bool plant(Base* b) { return dynamic_cast<Derived*>(b) != nullptr; }
#elif defined(PLANT_MUTEX)
#include <mutex>
void plant(std::mutex& m) { m.lock(); }
#elif defined(PLANT_PRINTF)
#include <cstdio>
void plant(double x) { std::printf("%f\n", x); }
#elif defined(PLANT_IOSTREAM)
#include <iostream>
void plant(double x) { std::cout << x; }
#elif defined(PLANT_GUARD)
int start();
int& plant() {
  static int once = start();
  return once;
}
#elif defined(PLANT_EXIT)
struct Global {
  ~Global();
};
Global global;
#elif defined(PLANT_SLEEP)
#include <unistd.h>
void plant() { usleep(10); }
#elif defined(PLANT_ASSERT)
#undef NDEBUG
#include <cassert>
void plant(int i) { assert(i > 0); }
#elif defined(PLANT_NOTHING)
#include <cmath>
double plant(double x) { return std::sin(x); }
#endif
