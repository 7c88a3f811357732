// Every table and key a scene may have: one list drives reading, checking, printing and the "allowed" texts.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "rt/station/telemetry.hpp"
#include "tools/scene.hpp"

namespace punctum::tools {

// A number; in the file it carries the unit of its key's name: SI value = number * mul / div.
struct Real {
  double* target;
  double mul, div;
  double min, max;  // in the file's unit
};
struct Whole {
  std::variant<int*, std::uint64_t*> target;
  std::int64_t min, max;
};
struct Flag {
  bool* target;
};
struct Text {
  std::string* target;
  bool path;  // relative to the scene file
};
// One of a few words or numbers, as written in the file.
struct Choice {
  std::vector<std::string> names;
  bool quoted;
  std::function<int()> get;
  std::function<void(int)> set;
};
struct Triple {  // three numbers
  hal::Vec3* target;
  double mul, div;
  double min, max;
  bool unit;  // a direction: normalised, never zero
};

struct Key {
  std::string name;
  std::variant<Real, Whole, Flag, Text, Choice, Triple> value;
};

// required: an error without it; settings: always there, the file may change it; thing: absent = does not
// exist.
enum class Kind { required, settings, thing };

struct Table {
  std::string name;
  Kind kind;
  std::function<bool(const Scene&)> there;
  std::function<void(Scene&, bool on)> put;
  std::function<std::vector<Key>(Scene&)> keys;
};

// [[name]]: a list of entries.
struct List {
  std::string name;
  int limit;
  std::function<int&(Scene&)> count;
  std::function<std::vector<Key>(Scene&, int index)> keys;  // of entry `index`
};

[[nodiscard]] const std::vector<Table>& scene_tables();
[[nodiscard]] const std::vector<List>& scene_lists();
[[nodiscard]] std::string allowed(const Key& key);
[[nodiscard]] std::string value_text(const Key& key);  // as it would stand in a file

// What one table alone cannot tell. Returns the first problem: which key it is about, and the text after it.
struct Problem {
  std::string key;
  std::string text;
};
[[nodiscard]] std::optional<Problem> check_together(const Scene& scene);

}  // namespace punctum::tools
