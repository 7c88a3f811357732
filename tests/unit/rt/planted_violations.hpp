// What a planted violation works on. One of planted_violations.cpp is built into each planted program.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

// A device that promises nothing.
class UnknownDevice {
 public:
  virtual void write(double value) noexcept = 0;

 protected:
  ~UnknownDevice() = default;
};

struct Material {
  std::uint64_t tick = 0;
  std::size_t size = 0;             // small
  double wanted = 0;                // about 1
  bool wrong = false;               // never true
  const char* text = nullptr;       // longer than a string holds by itself
  void* kept = nullptr;             // out of the optimiser's sight
  double* block = nullptr;          // on the heap, another one every tick
  std::byte* fresh_page = nullptr;  // never touched before, another one every tick
  UnknownDevice* device = nullptr;
  void (*callback)(double) noexcept = nullptr;
};

// Runs once per tick in a slot of the executive.
void plant(Material& m) NONBLOCKING;

}  // namespace punctum::rt
