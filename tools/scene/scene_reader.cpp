#include "tools/scene/scene_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "tools/scene/key_values.hpp"
#include "tools/scene/messages.hpp"

namespace punctum::tools {
namespace {

using Unexpected = tl::unexpected<std::string>;
using Done = tl::expected<void, std::string>;
using Names = std::vector<std::string>;

constexpr const char* kSimulation = "sim";  // [sim.*]

std::string name_of(const toml::key& key) { return std::string(key.str()); }

bool is_inside(std::string_view name, std::string_view table) {
  return name.size() > table.size() && name.starts_with(table) && name[table.size()] == '.';
}

// The tables and lists that stand directly in `group`: "sim", or the top of the file.
Names tables_of(const std::string& group) {
  Names names;
  const auto add = [&](const std::string& name) {
    const bool inside = group.empty()
                            ? name.find('.') == std::string::npos
                            : is_inside(name, group) && name.find('.', group.size() + 1) == std::string::npos;
    if (inside) {
      names.push_back(name);
    }
  };
  for (const auto& t : scene_tables()) {
    add(t.name);
  }
  for (const auto& l : scene_lists()) {
    add(l.name);
  }
  if (group.empty()) {
    names.emplace_back(kSimulation);
  }
  return names;
}

std::string now_in_simulation(const std::string& name) { return fmt::format("{}.{}", kSimulation, name); }

// A key or table that has moved below [sim]: to where.
std::optional<std::string> moved(const std::string& full, const Scene& scene) {
  const std::string there = now_in_simulation(full);
  if (table_named(there) != nullptr || list_named(there) != nullptr) {
    return there;
  }
  const auto dot = there.rfind('.');
  const Table* table = table_named(there.substr(0, dot));
  if (table == nullptr) {
    return std::nullopt;
  }
  Scene with = scene;
  table->put(with, true);
  if (!table->there(with)) {
    return std::nullopt;
  }
  const auto keys = table->keys(with);
  const bool known =
      std::any_of(keys.begin(), keys.end(), [&](const Key& k) { return k.name == there.substr(dot + 1); });
  return known ? std::optional(there) : std::nullopt;
}

// `table = "on"` and `"off"` (or true and false): a thing is there, or is not.
std::optional<bool> switched(const toml::node& node) {
  std::optional<bool> on = node.value_exact<bool>();
  if (const auto word = node.value_exact<std::string>()) {
    if (*word == "on") {
      on = true;
    }
    if (*word == "off") {
      on = false;
    }
  }
  return on;
}

}  // namespace

SceneReader::SceneReader(Scene& scene, std::filesystem::path folder, const Backends& backends,
                         std::string_view source)
    : scene_(scene),
      folder_(std::move(folder)),
      backends_(backends),
      source_{std::string(source)},
      first_(fmt::format("{}:1:1", source)) {}

Done SceneReader::read_file(std::string_view text) {
  if (auto r = read(text); !r) {
    return r;
  }
  return check_required();
}

Done SceneReader::read_override(std::string_view document) {
  source_ = {"--set", false};
  folder_.clear();
  return read(document);
}

std::string SceneReader::where(const std::string& key) const {
  if (const auto it = given_.find(key); it != given_.end()) {
    return it->second;
  }
  const auto dot = key.rfind('.');
  return dot == std::string::npos ? first_ : where(key.substr(0, dot));
}

tl::unexpected<std::string> SceneReader::wrong(const toml::source_position& p, std::string_view key,
                                               std::string_view text) const {
  return Unexpected(fmt::format("{}: {}: {}", source_.at(p), printable(key), text));
}

Done SceneReader::read(std::string_view text) {
  const auto root = parse_toml(text, source_);
  if (!root) {
    return Unexpected(root.error());
  }
  return read_group({}, *root);
}

// The tables of the file, or those below [sim], which come last: the backends decide which of them there
// are.
Done SceneReader::read_group(const std::string& group, const toml::table& content) {
  for (const bool simulation : {false, true}) {
    for (const auto& [key, node] : content) {
      const std::string name = group.empty() ? name_of(key) : group + "." + name_of(key);
      if ((name == kSimulation) != simulation) {
        continue;
      }
      if (auto r = read_part(name, key, node); !r) {
        return r;
      }
    }
  }
  return {};
}

Done SceneReader::read_part(const std::string& name, const toml::key& key, const toml::node& node) {
  const auto pos = key.source().begin;
  if (name == kSimulation) {
    const toml::table* content = node.as_table();
    return content != nullptr ? read_group(name, *content)
                              : Done(wrong(pos, name, "not a table, allowed: [sim.TABLE]"));
  }
  // A key "vision.holder" in quotes is not the table [vision.holder].
  const bool quoted_dot = key.str().find('.') != std::string_view::npos;
  if (const List* list = list_named(name); list != nullptr && !quoted_dot) {
    return read_list(*list, pos, node);
  }
  if (const Table* table = table_named(name); table != nullptr && !quoted_dot) {
    return read_table(*table, pos, node);
  }
  return unknown_table(name, pos, node);
}

tl::unexpected<std::string> SceneReader::unknown_table(const std::string& name,
                                                       const toml::source_position& pos,
                                                       const toml::node& node) const {
  const auto dot = name.rfind('.');
  const Names all = tables_of(dot == std::string::npos ? std::string{} : name.substr(0, dot));
  const auto there = moved(name, scene_);
  if (!there) {
    return wrong(pos, name, unknown("table", name, all));
  }
  // An override names one key: say where that has moved to.
  std::string full = name;
  const toml::table* content = node.as_table();
  while (overriding() && content != nullptr && content->size() == 1) {
    full += "." + name_of(content->begin()->first);
    content = content->begin()->second.as_table();
  }
  if (const auto key = moved(full, scene_); key && full != name) {
    return wrong(
        pos, full,
        fmt::format("unknown key (did you mean {}?), allowed: tables {}", *key, fmt::join(all, ", ")));
  }
  return wrong(pos, name,
               fmt::format("unknown table (did you mean {}?), allowed: {}", *there, fmt::join(all, ", ")));
}

// Of a [sim.*] table: is there a device that uses it?
Done SceneReader::check_use(const std::string& name, const Names& used_by,
                            const toml::source_position& pos) const {
  if (used_by.empty() || any_simulated(scene_, used_by)) {
    return {};
  }
  return wrong(
      pos, name,
      fmt::format("no simulated device uses it, allowed: with device = \"{}\" in [{}], or leave it out",
                  kSimulated, fmt::join(used_by, "] or [")));
}

Done SceneReader::switch_table(const Table& table, const toml::source_position& pos, bool on) {
  if (table.kind != Kind::thing && !on) {
    return wrong(pos, table.name, "cannot be left out, allowed: on");
  }
  if (const auto dot = table.name.rfind('.'); on && dot != std::string::npos) {
    const Table* parent = table_named(table.name.substr(0, dot));
    if (parent != nullptr && !parent->there(scene_)) {
      return wrong(pos, table.name, fmt::format("there is no [{}] in this scene", parent->name));
    }
  }
  table.put(scene_, on);
  given_[table.name] = source_.at(pos);
  return {};
}

Done SceneReader::read_table(const Table& table, const toml::source_position& pos, const toml::node& node) {
  if (auto r = check_use(table.name, table.used_by, pos); !r) {
    return r;
  }
  if (const auto on = switched(node); on && overriding()) {
    return switch_table(table, pos, *on);
  }
  const toml::table* content = node.as_table();
  if (content == nullptr) {
    return wrong(pos, table.name,
                 overriding() ? "not a table, allowed: on, off or table.key=value"
                              : fmt::format("not a table, allowed: [{}]", table.name));
  }
  if (overriding() && !table.there(scene_)) {
    return wrong(pos, table.name,
                 fmt::format("the scene has no [{}], allowed: --set {}=on first", table.name, table.name));
  }
  table.put(scene_, true);
  given_[table.name] = source_.at(pos);
  return read_content(table, *content);
}

// `device` first: it decides which other keys there are.
Done SceneReader::read_content(const Table& table, const toml::table& content) {
  for (const bool device : {true, false}) {
    for (const auto& [key, value] : content) {
      const std::string name = name_of(key);
      if ((name == "device") != device) {
        continue;
      }
      const Table* inner = table_named(table.name + "." + name);
      const List* list = list_named(table.name + "." + name);
      auto r = inner != nullptr  ? read_table(*inner, key.source().begin, value)
               : list != nullptr ? read_list(*list, key.source().begin, value)
                                 : read_key(table.name, keys_of_table(table), key, value);
      if (!r) {
        return r;
      }
    }
  }
  return {};
}

std::vector<Key> SceneReader::keys_of_table(const Table& table) {
  std::vector<Key> keys = table.keys(scene_);
  const auto known = backends_.find(table.name);
  for (Key& key : keys) {
    if (auto* backend = std::get_if<BackendName>(&key.value);
        backend != nullptr && known != backends_.end()) {
      backend->names = known->second;
    }
  }
  return keys;
}

Done SceneReader::read_list(const List& list, const toml::source_position& pos, const toml::node& node) {
  if (auto r = check_use(list.name, list.used_by, pos); !r) {
    return r;
  }
  const toml::array* entries = node.as_array();
  if (entries == nullptr) {
    return wrong(pos, list.name, fmt::format("not a list, allowed: [[{}]]", list.name));
  }
  list.count(scene_) = 0;
  for (const auto& entry : *entries) {
    if (auto r = read_entry(list, entry); !r) {
      return r;
    }
  }
  return {};
}

Done SceneReader::read_entry(const List& list, const toml::node& entry) {
  const auto here = entry.source().begin;
  const toml::table* content = entry.as_table();
  if (content == nullptr) {
    return wrong(here, list.name, fmt::format("not a table, allowed: [[{}]]", list.name));
  }
  int& count = list.count(scene_);
  if (count >= list.limit) {
    return wrong(here, list.name,
                 fmt::format("more than {} entries, allowed: at most {}", list.limit, list.limit));
  }
  const auto keys = list.keys(scene_, count);
  const std::string name = fmt::format("{}[{}]", list.name, count);
  ++count;
  given_[name] = source_.at(here);
  for (const auto& k : keys) {
    if ((k.name == "device" || k.name == "kind" || k.name == "at_s") && !content->contains(k.name)) {
      return wrong(here, name, fmt::format("{} is missing, allowed: {}", k.name, allowed(k)));
    }
  }
  for (const auto& [key, value] : *content) {
    if (auto r = read_key(name, keys, key, value); !r) {
      return r;
    }
  }
  return {};
}

Done SceneReader::read_key(const std::string& table, const std::vector<Key>& keys, const toml::key& key,
                           const toml::node& node) {
  const std::string name = name_of(key);
  const std::string full = table + "." + name;
  const auto k = std::find_if(keys.begin(), keys.end(), [&](const Key& one) { return one.name == name; });
  if (k == keys.end()) {
    return unknown_key(table, name, keys, key.source().begin);
  }
  const auto pos = node.source().begin;
  given_[full] = source_.at(pos);
  if (const std::string problem = store(*k, node, folder_); !problem.empty()) {
    return wrong(pos, full, fmt::format("{}, allowed: {}", problem, allowed(*k)));
  }
  return {};
}

tl::unexpected<std::string> SceneReader::unknown_key(const std::string& table, const std::string& name,
                                                     const std::vector<Key>& keys,
                                                     const toml::source_position& pos) const {
  Names names;
  for (const auto& k : keys) {
    names.push_back(k.name);
  }
  for (const auto& t : scene_tables()) {
    if (is_inside(t.name, table)) {
      names.push_back("[" + t.name + "]");
    }
  }
  for (const auto& l : scene_lists()) {
    if (is_inside(l.name, table)) {
      names.push_back("[[" + l.name + "]]");
    }
  }
  const std::string full = table + "." + name;
  if (const auto there = moved(full, scene_)) {
    return wrong(pos, full,
                 fmt::format("unknown key (did you mean {}?), allowed: {}", *there, fmt::join(names, ", ")));
  }
  return wrong(pos, full, unknown("key", name, names));
}

Done SceneReader::check_required() const {
  for (const auto& t : scene_tables()) {
    if (t.kind == Kind::required && t.there(scene_) && !given_.contains(t.name)) {
      return Unexpected(fmt::format("{}: {}: the table is missing, allowed: [{}] with {}any of its keys",
                                    first_, t.name, t.name, t.used_by.empty() ? "device, or with " : ""));
    }
  }
  return {};
}

}  // namespace punctum::tools
