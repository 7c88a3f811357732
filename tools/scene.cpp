#include "tools/scene.hpp"

#include <fmt/format.h>

// toml++ asserts, or lets the compiler assume, what a malformed key denies; without that it reports the key.
#define TOML_EXCEPTIONS 0
#define TOML_ASSERT(expr) static_assert(true)
#if __has_include(<toml++/impl/preprocessor.hpp>)  // 3.4
#include <toml++/impl/preprocessor.hpp>
#else
#include <toml++/impl/preprocessor.h>
#endif
#undef TOML_ASSERT_ASSUME
#define TOML_ASSERT_ASSUME(expr) static_assert(true)
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "tools/scene_keys.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Unexpected = tl::unexpected<std::string>;

constexpr std::size_t kFileMax = 256 * 1024;
constexpr std::size_t kTextMax = 1000;
constexpr std::size_t kNestingMax = 16;

// One line, whatever the file contained.
std::string printable(std::string_view s, std::size_t max = 80) {
  std::string out;
  for (const char ch : s) {
    const auto c = static_cast<unsigned char>(ch);
    if (out.size() >= max) return out + "...";
    out += (c < 0x20 || c == 0x7f) ? ' ' : ch;
  }
  return out;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t next =
          std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1] ? 1U : 0U)});
      diagonal = row[j];
      row[j] = next;
    }
  }
  return row[b.size()];
}

std::string unknown(std::string_view what, std::string_view given, const std::vector<std::string>& names) {
  std::string near;
  std::size_t best = std::max<std::size_t>(2, given.size() / 3) + 1;
  if (given.size() <= 60)
    for (const auto& n : names) {
      std::size_t d = edit_distance(given, n);
      if (!given.empty() && (n.starts_with(given) || given.starts_with(n))) d = std::min<std::size_t>(d, 2);
      if (d < best) best = d, near = n;
    }
  return fmt::format("unknown {}{}, allowed: {}", what, near.empty() ? "" : " (did you mean " + near + "?)",
                     fmt::join(names, ", "));
}

// Reads TOML documents onto a scene and remembers where every key was given.
class Reader {
 public:
  Reader(Scene& scene, fs::path folder) : scene_(scene), folder_(std::move(folder)) {}

  // `fixed` replaces `source:line:column` for overrides.
  [[nodiscard]] tl::expected<void, std::string> read(std::string_view text, std::string_view source,
                                                     bool fixed) {
    source_ = source;
    fixed_ = fixed;
    if (const auto deep = nested_too_deep(text); !deep.empty()) return Unexpected(deep);
    const auto ascii = in_ascii(text);
    if (!ascii) return Unexpected(ascii.error());
    const toml::parse_result result = toml::parse(*ascii);
    if (!result) {
      const auto& e = result.error();
      std::string what = printable(e.description(), 200);
      const auto pos = e.source().begin;
      const std::string key = key_on_line(text, pos.line);
      if (what.find("cannot redefine existing") != std::string::npos)
        return Unexpected(fmt::format("{}: {}: given twice, allowed: once", at(pos), key));
      return Unexpected(fmt::format("{}: {}: not valid TOML: {}", at(pos), key, tidy(what)));
    }
    return read_root(result.table());
  }

  // Where a key was given; or its table; or the beginning of the file.
  [[nodiscard]] std::string where(const std::string& key) const {
    if (const auto it = given_.find(key); it != given_.end()) return it->second;
    const auto dot = key.rfind('.');
    return dot == std::string::npos ? first_ : where(key.substr(0, dot));
  }
  void set_first(std::string first) { first_ = std::move(first); }

 private:
  using Done = tl::expected<void, std::string>;

  [[nodiscard]] std::string at(const toml::source_position& p) const {
    return fixed_ ? source_ : fmt::format("{}:{}:{}", source_, p.line, p.column);
  }
  [[nodiscard]] Unexpected wrong(const toml::source_position& p, std::string_view key,
                                 std::string_view text) const {
    return Unexpected(fmt::format("{}: {}: {}", at(p), printable(key), text));
  }

  static std::string tidy(std::string s) {
    const auto strip = s.find("Error while parsing ");
    if (strip == 0) {
      const auto colon = s.find(": ");
      if (colon != std::string::npos) s = s.substr(colon + 2);
    }
    return s;
  }

  // The word the writer of that line most probably meant, for messages about syntax.
  static std::string key_on_line(std::string_view text, std::uint32_t line) {
    std::string_view l = text;
    for (std::uint32_t n = 1; n < line && !l.empty(); ++n) {
      const auto end = l.find('\n');
      l = end == std::string_view::npos ? std::string_view{} : l.substr(end + 1);
    }
    l = l.substr(0, l.find('\n'));
    l = l.substr(0, l.find('='));
    const auto first = l.find_first_not_of(" \t\r");
    const auto last = l.find_last_not_of(" \t\r");
    if (first == std::string_view::npos) return "syntax";
    return printable(l.substr(first, last - first + 1), 40);
  }

  // toml++ recurses: a scene needs no more than a handful of levels.
  [[nodiscard]] std::string nested_too_deep(std::string_view text) const {
    std::size_t depth = 0;
    std::uint32_t line = 1, column = 0;
    for (const char c : text) {
      ++column;
      if (c == '\n') ++line, column = 0;
      if (c == '[' || c == '{') ++depth;
      if ((c == ']' || c == '}') && depth > 0) --depth;
      if (depth > kNestingMax)
        return fmt::format("{}: syntax: brackets are nested too deeply, allowed: {} levels",
                           fixed_ ? source_ : fmt::format("{}:{}:{}", source_, line, column), kNestingMax);
    }
    return {};
  }

  // The same text in ASCII: letters beyond it as \UXXXXXXXX, which means the same in a "string". toml++ 3.3
  // leaves open what it does with such a letter where a key or a value could begin.
  [[nodiscard]] tl::expected<std::string, std::string> in_ascii(std::string_view text) const {
    std::string out;
    out.reserve(text.size());
    std::uint32_t line = 1, column = 0;
    char quote = 0;  // of the string or comment we are in
    bool escaped = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
      const auto c = static_cast<unsigned char>(text[i]);
      ++column;
      if (c < 0x80) {
        out += text[i];
        if (c == '\n') {
          ++line, column = 0, quote = 0;
        } else if (quote == 0 && (c == '"' || c == '\'' || c == '#')) {
          quote = text[i], escaped = false;
        } else if (quote != '#' && c == static_cast<unsigned char>(quote) && !escaped) {
          quote = 0;
        }
        escaped = c == '\\' && quote == '"' && !escaped;
        continue;
      }
      const int more = c >= 0xf0 && c < 0xf5 ? 3 : c >= 0xe0 && c < 0xf0 ? 2 : c >= 0xc2 && c < 0xe0 ? 1 : 0;
      std::uint32_t letter = c & (0x3fU >> more);
      int read = 0;
      for (; read < more && i + 1 < text.size() && (text[i + 1] & 0xc0) == 0x80; ++read)
        letter = letter << 6 | (static_cast<unsigned char>(text[++i]) & 0x3fU);
      const bool valid = more > 0 && read == more &&
                         letter >= (more == 3   ? 0x10000U
                                    : more == 2 ? 0x800U
                                                : 0x80U) &&
                         letter < 0x110000 && (letter < 0xd800 || letter > 0xdfff);
      if (!valid || quote == 0 || quote == '\'')
        return Unexpected(fmt::format("{}: syntax: {}",
                                      fixed_ ? source_ : fmt::format("{}:{}:{}", source_, line, column),
                                      valid ? "a letter beyond ASCII, allowed: in comments and \"strings\""
                                            : "not a letter of UTF-8, allowed: text in UTF-8"));
      out += fmt::format("\\U{:08X}", letter);
    }
    return out;
  }

  static const Table* table_named(std::string_view name) {
    for (const auto& t : scene_tables())
      if (t.name == name) return &t;
    return nullptr;
  }
  static const List* list_named(std::string_view name) {
    for (const auto& l : scene_lists())
      if (l.name == name) return &l;
    return nullptr;
  }
  static std::vector<std::string> top_names() {
    std::vector<std::string> names;
    for (const auto& t : scene_tables())
      if (t.name.find('.') == std::string::npos) names.push_back(t.name);
    for (const auto& l : scene_lists()) names.push_back(l.name);
    return names;
  }

  Done read_root(const toml::table& root) {
    for (const auto& [key, node] : root) {
      const std::string name(key.str());
      const auto pos = key.source().begin;
      if (const List* list = list_named(name)) {
        if (auto r = read_list(*list, pos, node); !r) return r;
        continue;
      }
      const Table* table = table_named(name);
      if (table == nullptr || name.find('.') != std::string::npos)
        return wrong(pos, name, unknown("table", name, top_names()));
      if (auto r = read_table(*table, pos, node); !r) return r;
    }
    return {};
  }

  Done read_table(const Table& table, const toml::source_position& pos, const toml::node& node) {
    // `table = "on"` and `"off"` (or true and false): a thing is there, or is not.
    std::optional<bool> on = node.value_exact<bool>();
    if (const auto word = node.value_exact<std::string>()) {
      if (*word == "on") on = true;
      if (*word == "off") on = false;
    }
    if (on && fixed_) {
      if (table.kind != Kind::thing && !*on) return wrong(pos, table.name, "cannot be left out, allowed: on");
      if (const auto dot = table.name.rfind('.'); *on && dot != std::string::npos) {
        const Table* parent = table_named(table.name.substr(0, dot));
        if (!parent->there(scene_))
          return wrong(pos, table.name, fmt::format("there is no [{}] in this scene", parent->name));
      }
      table.put(scene_, *on);
      given_[table.name] = at(pos);
      return {};
    }
    const toml::table* content = node.as_table();
    if (content == nullptr)
      return wrong(pos, table.name,
                   fixed_ ? "not a table, allowed: on, off or table.key=value"
                          : fmt::format("not a table, allowed: [{}]", table.name));
    if (fixed_ && !table.there(scene_))
      return wrong(pos, table.name,
                   fmt::format("the scene has no [{}], allowed: --set {}=on first", table.name, table.name));
    table.put(scene_, true);
    given_[table.name] = at(pos);

    // `device` first: it decides which other keys there are.
    if (const auto it = content->find("device"); it != content->end())
      if (auto r = read_key(table, table.keys(scene_), it->first, it->second); !r) return r;
    for (const auto& [key, value] : *content) {
      const std::string full = table.name + "." + std::string(key.str());
      if (const Table* inner = table_named(full)) {
        if (auto r = read_table(*inner, key.source().begin, value); !r) return r;
      } else if (key.str() != "device" || !has_device(table)) {
        if (auto r = read_key(table, table.keys(scene_), key, value); !r) return r;
      }
    }
    return {};
  }

  bool has_device(const Table& table) {
    const auto keys = table.keys(scene_);
    return std::any_of(keys.begin(), keys.end(), [](const Key& k) { return k.name == "device"; });
  }

  Done read_list(const List& list, const toml::source_position& pos, const toml::node& node) {
    const toml::array* entries = node.as_array();
    if (entries == nullptr)
      return wrong(pos, list.name, fmt::format("not a list, allowed: [[{}]]", list.name));
    int& count = list.count(scene_);
    count = 0;
    for (const auto& entry : *entries) {
      const auto here = entry.source().begin;
      const toml::table* content = entry.as_table();
      if (content == nullptr)
        return wrong(here, list.name, fmt::format("not a table, allowed: [[{}]]", list.name));
      if (count >= list.limit)
        return wrong(here, list.name,
                     fmt::format("more than {} entries, allowed: at most {}", list.limit, list.limit));
      ++count;
      const auto keys = list.keys(scene_, count - 1);
      const std::string name = fmt::format("{}[{}]", list.name, count - 1);
      given_[name] = at(here);
      for (const auto& k : keys)
        if ((k.name == "device" || k.name == "kind" || k.name == "at_s") && !content->contains(k.name))
          return wrong(here, name, fmt::format("{} is missing, allowed: {}", k.name, allowed(k)));
      for (const auto& [key, value] : *content)
        if (auto r = read_key(name, keys, key, value); !r) return r;
    }
    return {};
  }

  Done read_key(const Table& table, const std::vector<Key>& keys, const toml::key& key,
                const toml::node& node) {
    return read_key(table.name, keys, key, node);
  }
  Done read_key(const std::string& table, const std::vector<Key>& keys, const toml::key& key,
                const toml::node& node) {
    const std::string name(key.str());
    const std::string full = table + "." + name;
    for (const auto& k : keys)
      if (k.name == name) {
        const auto pos = node.source().begin;
        given_[full] = at(pos);
        const std::string problem = std::visit([&](const auto& v) { return store(v, node); }, k.value);
        if (!problem.empty()) return wrong(pos, full, fmt::format("{}, allowed: {}", problem, allowed(k)));
        return {};
      }
    std::vector<std::string> names;
    for (const auto& k : keys) names.push_back(k.name);
    for (const auto& t : scene_tables())
      if (t.name.starts_with(table + ".")) names.push_back("[" + t.name + "]");
    return wrong(key.source().begin, full, unknown("key", name, names));
  }

  static std::string shown(const toml::node& node) {
    if (const auto s = node.value_exact<std::string>()) return "\"" + printable(*s, 40) + "\"";
    if (const auto b = node.value_exact<bool>()) return *b ? "true" : "false";
    if (const auto i = node.value_exact<std::int64_t>()) return fmt::format("{}", *i);
    if (const auto d = node.value_exact<double>()) return fmt::format("{}", *d);
    if (node.is_table()) return "a table";
    if (node.is_array()) return "a list";
    return "a date or time";
  }

  static std::optional<double> number(const toml::node& node) {
    if (const auto i = node.value_exact<std::int64_t>()) return static_cast<double>(*i);
    return node.value_exact<double>();
  }
  static std::string check_number(const toml::node& node, double min, double max, double& out) {
    const auto v = number(node);
    if (!v) return shown(node) + " is not a number";
    if (!std::isfinite(*v)) return shown(node) + " is not a finite number";
    if (*v < min || *v > max) return shown(node) + " is out of range";
    out = *v;
    return {};
  }

  std::string store(const Real& r, const toml::node& node) {
    double v = 0;
    if (auto p = check_number(node, r.min, r.max, v); !p.empty()) return p;
    *r.target = v * r.mul / r.div;
    return {};
  }
  std::string store(const Whole& w, const toml::node& node) {
    const auto v = node.value_exact<std::int64_t>();
    if (!v) return shown(node) + " is not a whole number";
    if (*v < w.min || *v > w.max) return shown(node) + " is out of range";
    std::visit([&](auto* t) { *t = static_cast<std::remove_pointer_t<decltype(t)>>(*v); }, w.target);
    return {};
  }
  std::string store(const Flag& f, const toml::node& node) {
    const auto v = node.value_exact<bool>();
    if (!v) return shown(node) + " is not true or false";
    *f.target = *v;
    return {};
  }
  std::string store(const Text& t, const toml::node& node) {
    const auto v = node.value_exact<std::string>();
    if (!v) return shown(node) + " is not text";
    if (v->size() > kTextMax) return "the text is too long";
    if (v->find('\0') != std::string::npos) return "the text contains a zero character";
    *t.target = *v;
    // Relative to the scene's own folder, so that a scene can be moved together with its frames.
    if (t.path && !fixed_ && !folder_.empty() && !v->empty() && fs::path(*v).is_relative())
      *t.target = (folder_ / *v).lexically_normal().string();
    return {};
  }
  std::string store(const Choice& c, const toml::node& node) {
    std::string given;
    if (const auto s = node.value_exact<std::string>(); s && c.quoted) {
      given = *s;
    } else if (const auto d = number(node); d && !c.quoted) {
      given = fmt::format("{}", *d);
    } else {
      return shown(node) + " is not one of the choices";
    }
    for (std::size_t i = 0; i < c.names.size(); ++i)
      if (c.names[i] == given) {
        c.set(static_cast<int>(i));
        return {};
      }
    return shown(node) + " is not one of the choices";
  }
  std::string store(const Triple& t, const toml::node& node) {
    const toml::array* a = node.as_array();
    if (a == nullptr || a->size() != 3) return shown(node) + " is not a list of three numbers";
    hal::Vec3 v;
    for (int i = 0; i < 3; ++i)
      if (auto p = check_number(*a->get(static_cast<std::size_t>(i)), t.min, t.max, v[i]); !p.empty())
        return p;
    if (t.unit) {
      if (v.norm() < 1e-3) return "the direction is zero";
      if (std::abs(v.norm() - 1) > 1e-15) v /= v.norm();
    }
    *t.target = v * t.mul / t.div;
    return {};
  }

  Scene& scene_;
  fs::path folder_;
  std::string source_;
  std::string first_;
  bool fixed_ = false;
  std::map<std::string, std::string> given_;
};

// An override as a small TOML document; bare words and paths (paper, on, frames/*.png) need no quotes.
std::string override_document(std::string_view text) {
  const auto equal = text.find('=');
  const std::string key(text.substr(0, equal));
  std::string value(text.substr(equal + 1));
  const bool plain = value.find_first_of("\"\\\t") == std::string::npos;
  const bool word =
      !value.empty() && (std::isalpha(static_cast<unsigned char>(value[0])) != 0 || value[0] == '/' ||
                         value[0] == '~' || value.starts_with("./") || value.starts_with("../"));
  if (plain && word && value != "true" && value != "false" && value != "nan" && value != "inf")
    value = "\"" + value + "\"";
  return key + " = " + value + "\n";
}

// Numbers that only follow from others.
void settle(Scene& s) {
  const auto& hand = s.sim->hand;
  s.servo.device = {hand.mass_kg, hand.damping_Ns_m, hand.encoder_step_m, hand.force_max_N, hand.delay_ticks};
  s.servo.vision = s.vision.has_value();
  s.sim->position_scale = s.servo.mapping.position_scale;
  s.sim->cells = s.servo.cells;
  if (s.vision) {
    s.vision->pixel_m = s.recorded          ? s.recorded->pixel_m
                        : s.sim->microscope ? s.sim->microscope->pixel_m
                                            : s.vision->pixel_m;
    if (const auto& m = s.servo.membrane) {
      s.vision->E_Pa = m->E_Pa;
      s.vision->nu = m->nu;
      s.vision->h_m = m->h_m;
      s.vision->c_m = m->c_m;
    }
  }
}

tl::expected<Scene, std::string> read_all(Scene scene, std::string_view text, std::string_view source,
                                          const std::vector<std::string>& overrides, const fs::path& folder) {
  // A scene names its things: none of them is there by default.
  scene.sim.emplace();
  scene.servo.phases.reset();
  scene.servo.local_model.reset();
  Reader reader(scene, folder);
  reader.set_first(fmt::format("{}:1:1", source));
  if (auto r = reader.read(text, source, false); !r) return Unexpected(r.error());
  for (const auto& t : scene_tables())
    if (t.kind == Kind::required && reader.where(t.name) == fmt::format("{}:1:1", source))
      return Unexpected(
          fmt::format("{}:1:1: {}: the table is missing, allowed: [{}] with device, or with any of its keys",
                      source, t.name, t.name));
  for (const auto& o : overrides) {
    if (o.find('=') == std::string::npos || o.find('\n') != std::string::npos || o.size() > 4000)
      return Unexpected(
          fmt::format("--set: {}: not an override, allowed: table.key=value or table=on|off", printable(o)));
    if (auto r = reader.read(override_document(o), "--set", true); !r) return Unexpected(r.error());
  }
  settle(scene);
  if (const auto p = check_together(scene))
    return Unexpected(fmt::format("{}: {}: {}", reader.where(p->key), p->key, p->text));
  return scene;
}

// The shortest decimal in the file's unit that reads back to exactly the same double.
std::string number_text(double si, double mul, double div) {
  for (int digits = 1; digits <= 17; ++digits) {
    const std::string s = fmt::format("{:.{}g}", si * div / mul, digits);
    if (const double v = std::stod(s); v * mul / div == si) return fmt::format("{}", v);
  }
  // The product was rounded the other way: a neighbour reads back.
  double v = si * div / mul;
  for (int step = 0; step < 4; ++step) {
    const double up = std::nextafter(v, 1e300), down = std::nextafter(v, -1e300);
    if (up * mul / div == si) return fmt::format("{}", up);
    if (down * mul / div == si) return fmt::format("{}", down);
    v = up;
  }
  return fmt::format("{}", si * div / mul);
}

std::string in_quotes(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    const auto u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (u < 0x20 || u == 0x7f) {
      out += fmt::format("\\u{:04x}", u);
    } else {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace

std::string value_text(const Key& key) {
  struct Visitor {
    std::string operator()(const Real& r) const { return number_text(*r.target, r.mul, r.div); }
    std::string operator()(const Whole& w) const {
      return std::visit([](const auto* t) { return fmt::format("{}", *t); }, w.target);
    }
    std::string operator()(const Flag& f) const { return *f.target ? "true" : "false"; }
    std::string operator()(const Text& t) const {
      return in_quotes(t.path && !t.target->empty() ? fs::absolute(*t.target).lexically_normal().string()
                                                    : *t.target);
    }
    std::string operator()(const Choice& c) const {
      const auto& n = c.names[static_cast<std::size_t>(std::max(0, c.get()))];
      return c.quoted ? in_quotes(n) : n;
    }
    std::string operator()(const Triple& t) const {
      return fmt::format("[{}, {}, {}]", number_text((*t.target)[0], t.mul, t.div),
                         number_text((*t.target)[1], t.mul, t.div),
                         number_text((*t.target)[2], t.mul, t.div));
    }
  };
  return std::visit(Visitor{}, key.value);
}

tl::expected<Scene, std::string> parse_scene(std::string_view text, std::string_view source,
                                             const std::vector<std::string>& overrides,
                                             std::string_view folder) {
  Scene scene;
  scene.name = fs::path(source).stem().string();
  scene.source = source;
  return read_all(std::move(scene), text, printable(source, 200), overrides, fs::path(folder));
}

tl::expected<Scene, std::string> load_scene(std::string_view name_or_path,
                                            const std::vector<std::string>& overrides) {
  if (const auto text = builtin_text(name_or_path)) {
    Scene scene;
    scene.name = name_or_path;
    scene.source = "built-in";
    return read_all(std::move(scene), *text, fmt::format("{}.toml", name_or_path), overrides, {});
  }
  const std::string shown = printable(name_or_path, 200);
  const fs::path path(name_or_path);
  std::error_code ec;
  const auto status = fs::status(path, ec);
  if (ec || !fs::exists(status)) {
    std::vector<std::string> names;
    for (const auto n : builtin_names()) names.emplace_back(n);
    if (name_or_path.find('/') == std::string_view::npos && !name_or_path.ends_with(".toml"))
      return Unexpected(
          fmt::format("{}: {}", shown, unknown("scene", printable(name_or_path), names) + ", or a path"));
    return Unexpected(fmt::format("{}: no such file, allowed: a path, or {}", shown, fmt::join(names, ", ")));
  }
  if (!fs::is_regular_file(status))
    return Unexpected(fmt::format("{}: not a file, allowed: a scene file (TOML)", shown));
  std::ifstream in(path, std::ios::binary);
  std::string text(kFileMax + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad() || (in.fail() && !in.eof()))
    return Unexpected(fmt::format("{}: cannot be read, check its permissions", shown));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kFileMax)
    return Unexpected(
        fmt::format("{}: too large for a scene, allowed: at most {} kB", shown, kFileMax / 1024));
  return parse_scene(text, name_or_path, overrides, path.parent_path().string());
}

std::string to_toml(const Scene& scene) {
  Scene s = scene;                        // the key tables point into a scene that could be written to
  std::string title = printable(s.name);  // of a file name, which need not be text
  for (char& c : title)
    if (static_cast<unsigned char>(c) >= 0x80) c = '?';
  std::string out = fmt::format("# {}{}\n", title, kResolvedScene);
  for (const auto& t : scene_tables()) {
    if (!t.there(s)) continue;
    out += fmt::format("\n[{}]\n", t.name);
    for (const auto& k : t.keys(s)) out += fmt::format("{} = {}\n", k.name, value_text(k));
  }
  for (const auto& l : scene_lists())
    for (int i = 0; i < l.count(s); ++i) {
      out += fmt::format("\n[[{}]]\n", l.name);
      for (const auto& k : l.keys(s, i)) out += fmt::format("{} = {}\n", k.name, value_text(k));
    }
  return out;
}

std::vector<TableState> tables(const Scene& scene) {
  std::vector<TableState> out;
  for (const auto& t : scene_tables())
    if (t.kind == Kind::thing) out.push_back({t.name, t.there(scene)});
  return out;
}

}  // namespace punctum::tools
