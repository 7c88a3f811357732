// Every table and key that a scene may have: one list drives reading, checking, printing and the "allowed"
// texts. The keys themselves stand beside the parameters that they set (hal/parameters.hpp).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hal/parameters.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

struct Real {
  double* target;
  hal::Unit unit;
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
  hal::Unit unit;
  double min, max;
  bool direction;  // normalised, never zero
};
// The name of a backend; it decides which other keys and tables there are.
struct BackendName {
  std::vector<std::string> names;
  std::function<const std::string&()> get;
  std::function<void(const std::string&)> set;
};

struct Key {
  std::string name;
  std::variant<Real, Whole, Flag, Text, Choice, Triple, BackendName> value;
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
  std::vector<std::string> used_by = {};  // [sim.*]: devices, one of which must be simulated
};

// [[name]]: a list of entries.
struct List {
  std::string name;
  int limit;
  std::function<int&(Scene&)> count;
  std::function<std::vector<Key>(Scene&, int index)> keys;  // of entry `index`
  std::vector<std::string> used_by = {};                    // as of a table
  std::function<bool(const Scene&)> there = [](const Scene& s) { return s.sim.has_value(); };
};

[[nodiscard]] const std::vector<Table>& scene_tables();
[[nodiscard]] const std::vector<List>& scene_lists();
[[nodiscard]] const Table* table_named(std::string_view name);
[[nodiscard]] const List* list_named(std::string_view name);
[[nodiscard]] std::string allowed(const Key& key);
[[nodiscard]] std::string value_text(const Key& key);  // as it would stand in a file

// Device by device: the name of its table, and of its backend in this scene.
struct NamedDevice {
  std::string table;
  std::string DeviceNames::* backend;
};
[[nodiscard]] const std::vector<NamedDevice>& scene_devices();
[[nodiscard]] bool any_simulated(const Scene& scene,
                                 const std::vector<std::string>& devices);  // by their tables

// What one table alone cannot tell. Returns the first problem: which key it is about, and the text after it.
struct Problem {
  std::string key;
  std::string text;
};
[[nodiscard]] std::optional<Problem> check_together(const Scene& scene);

}  // namespace punctum::tools
