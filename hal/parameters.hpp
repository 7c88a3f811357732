// How parameters are written in a file: the name of each, the member that holds it, its unit and its range.
// One table stands after each struct of parameters, in one of two forms:
//
//   constexpr auto keys_of(const ConeParams*) { return hal::keys(hal::real("K_N_m", &ConeParams::K_N_m, 0,
//   3000), ...); } inline constexpr auto kCellKeys = hal::keys(...);  // where the struct is spread over
//   several tables of the file
//
// Constant data: whoever reads files (tools/scene) walks the tables, the core never does. Ranges are in the
// unit of the file, which the name of the key carries.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>

#include "hal/devices.hpp"

namespace punctum::hal {

// Stored value = number in the file * multiply / divide. Two factors, each a power of ten that a double holds
// exactly.
struct Unit {
  double multiply = 1;
  double divide = 1;
};
inline constexpr Unit kOne{};
inline constexpr Unit kMicro{1, 1e6};
inline constexpr Unit kMilli{1, 1e3};
inline constexpr Unit kKilo{1e3, 1};

template <class Params>
struct RealKey {
  const char* name;
  double Params::* member;
  Unit unit;
  double min, max;
};

template <class Params, std::size_t Size>
struct ElementKey {  // one element of an array
  const char* name;
  double (Params::*member)[Size];
  std::size_t index;
  Unit unit;
  double min, max;
};

template <class Params, class Integer>
struct WholeKey {
  const char* name;
  Integer Params::* member;
  std::int64_t min, max;
};

template <class Params>
struct FlagKey {
  const char* name;
  bool Params::* member;
};

// An enumeration; names[i] stands for the i-th enumerator from `first` on.
template <class Params, class Enum, std::size_t Size>
struct ChoiceKey {
  const char* name;
  Enum Params::* member;
  Enum first;
  std::array<const char*, Size> names;
};

template <class Params, std::size_t Size>
struct OneOfKey {  // a number out of a few
  const char* name;
  double Params::* member;
  std::array<double, Size> numbers;
};

template <class Params>
struct VectorKey {
  const char* name;
  Vec3 Params::* member;
  Unit unit;
  double min, max;  // of each component
  bool direction;   // normalised when read, never zero
};

template <class Params, class String>
struct TextKey {
  const char* name;
  String Params::* member;
  bool path;  // relative to the folder of the file that names it
};

template <class P>
[[nodiscard]] constexpr RealKey<P> real(const char* name, double P::* member, double min, double max) {
  return {name, member, kOne, min, max};
}
template <class P>
[[nodiscard]] constexpr RealKey<P> micro(const char* name, double P::* member, double min, double max) {
  return {name, member, kMicro, min, max};
}
template <class P>
[[nodiscard]] constexpr RealKey<P> milli(const char* name, double P::* member, double min, double max) {
  return {name, member, kMilli, min, max};
}
template <class P>
[[nodiscard]] constexpr RealKey<P> kilo(const char* name, double P::* member, double min, double max) {
  return {name, member, kKilo, min, max};
}
template <class P, std::size_t N>
[[nodiscard]] constexpr ElementKey<P, N> element(const char* name, double (P::*member)[N], std::size_t index,
                                                 double min, double max) {
  return {name, member, index, kOne, min, max};
}
template <class P, class Integer>
[[nodiscard]] constexpr WholeKey<P, Integer> whole(const char* name, Integer P::* member, std::int64_t min,
                                                   std::int64_t max) {
  return {name, member, min, max};
}
template <class P>
[[nodiscard]] constexpr FlagKey<P> flag(const char* name, bool P::* member) {
  return {name, member};
}
template <class P, class Enum, class... Name>
[[nodiscard]] constexpr ChoiceKey<P, Enum, sizeof...(Name)> choice_from(Enum first, const char* name,
                                                                        Enum P::* member, Name... names) {
  return {name, member, first, {names...}};
}
template <class P, class Enum, class... Name>
[[nodiscard]] constexpr ChoiceKey<P, Enum, sizeof...(Name)> choice(const char* name, Enum P::* member,
                                                                   Name... names) {
  return choice_from(Enum{}, name, member, names...);
}
template <class P, class... Number>
[[nodiscard]] constexpr OneOfKey<P, sizeof...(Number)> one_of(const char* name, double P::* member,
                                                              Number... numbers) {
  return {name, member, {static_cast<double>(numbers)...}};
}
template <class P>
[[nodiscard]] constexpr VectorKey<P> micro_vector(const char* name, Vec3 P::* member, double min,
                                                  double max) {
  return {name, member, kMicro, min, max, false};
}
template <class P>
[[nodiscard]] constexpr VectorKey<P> direction(const char* name, Vec3 P::* member) {
  return {name, member, kOne, -1, 1, true};
}
template <class P, class String>
[[nodiscard]] constexpr TextKey<P, String> text(const char* name, String P::* member) {
  return {name, member, false};
}
template <class P, class String>
[[nodiscard]] constexpr TextKey<P, String> path(const char* name, String P::* member) {
  return {name, member, true};
}

template <class... Key>
[[nodiscard]] constexpr std::tuple<Key...> keys(Key... each) {
  return {each...};
}

}  // namespace punctum::hal
