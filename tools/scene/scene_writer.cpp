#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tools/scene/messages.hpp"
#include "tools/scene/scene_keys.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// The shortest decimal in the file's unit that reads back to exactly the same double.
std::string number_text(double si, hal::Unit unit) {
  const auto read_back = [unit](double v) { return v * unit.multiply / unit.divide; };
  const double in_file = si * unit.divide / unit.multiply;
  for (int digits = 1; digits <= 17; ++digits) {
    const double v = std::strtod(fmt::format("{:.{}g}", in_file, digits).c_str(), nullptr);
    if (read_back(v) == si) {
      return fmt::format("{}", v);
    }
  }
  // The product was rounded the other way: a neighbour reads back.
  double v = in_file;
  for (int step = 0; step < 4; ++step) {
    const double up = std::nextafter(v, 1e300);
    const double down = std::nextafter(v, -1e300);
    for (const double near : {up, down}) {
      if (read_back(near) == si) {
        return fmt::format("{}", near);
      }
    }
    v = up;
  }
  return fmt::format("{}", in_file);
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

std::string lines(const std::vector<Key>& keys) {
  std::string out;
  for (const Key& key : keys) {
    out += fmt::format("{} = {}\n", key.name, value_text(key));
  }
  return out;
}

}  // namespace

std::string value_text(const Key& key) {
  struct Visitor {
    std::string operator()(const Real& r) const { return number_text(*r.target, r.unit); }
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
    std::string operator()(const BackendName& b) const { return in_quotes(b.get()); }
    std::string operator()(const Triple& t) const {
      return fmt::format("[{}, {}, {}]", number_text((*t.target)[0], t.unit),
                         number_text((*t.target)[1], t.unit), number_text((*t.target)[2], t.unit));
    }
  };
  return std::visit(Visitor{}, key.value);
}

std::string to_toml(const Scene& scene) {
  Scene s = scene;                        // the keys point into a scene that could be written to
  std::string title = printable(s.name);  // of a file name, which need not be text
  for (char& c : title) {
    if (static_cast<unsigned char>(c) >= 0x80) {
      c = '?';
    }
  }
  std::string out = fmt::format("# {}{}\n", title, kResolvedScene);
  for (const auto& t : scene_tables()) {
    if (t.there(s)) {
      out += fmt::format("\n[{}]\n", t.name) + lines(t.keys(s));
    }
  }
  for (const auto& l : scene_lists()) {
    for (int i = 0; l.there(s) && i < l.count(s); ++i) {
      out += fmt::format("\n[[{}]]\n", l.name) + lines(l.keys(s, i));
    }
  }
  return out;
}

std::vector<TableState> tables(const Scene& scene) {
  std::vector<TableState> out;
  for (const auto& t : scene_tables()) {
    if (t.kind == Kind::thing) {
      out.push_back({t.name, t.there(scene)});
    }
  }
  return out;
}

}  // namespace punctum::tools
