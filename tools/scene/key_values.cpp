#include "tools/scene/key_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tools/scene/messages.hpp"
#include "tools/shared/suggestion.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestText = 1000;

std::string shown(const toml::node& node) {
  if (const auto s = node.value_exact<std::string>()) {
    return "\"" + printable(*s, 40) + "\"";
  }
  if (const auto b = node.value_exact<bool>()) {
    return *b ? "true" : "false";
  }
  if (const auto i = node.value_exact<std::int64_t>()) {
    return fmt::format("{}", *i);
  }
  if (const auto d = node.value_exact<double>()) {
    return fmt::format("{}", *d);
  }
  if (node.is_table()) {
    return "a table";
  }
  if (node.is_array()) {
    return "a list";
  }
  return "a date or time";
}

std::optional<double> number(const toml::node& node) {
  if (const auto i = node.value_exact<std::int64_t>()) {
    return static_cast<double>(*i);
  }
  return node.value_exact<double>();
}

std::string read_number(const toml::node& node, double min, double max, double& out) {
  const auto v = number(node);
  if (!v) {
    return shown(node) + " is not a number";
  }
  if (!std::isfinite(*v)) {
    return shown(node) + " is not a finite number";
  }
  if (*v < min || *v > max) {
    return shown(node) + " is out of range";
  }
  out = *v;
  return {};
}

class Storing {
 public:
  Storing(const toml::node& node, const fs::path& folder) : node_(node), folder_(folder) {}

  std::string operator()(const Real& r) const {
    double v = 0;
    std::string problem = read_number(node_, r.min, r.max, v);
    if (problem.empty()) {
      *r.target = v * r.unit.multiply / r.unit.divide;
    }
    return problem;
  }

  std::string operator()(const Whole& w) const {
    const auto v = node_.value_exact<std::int64_t>();
    if (!v) {
      return shown(node_) + " is not a whole number";
    }
    if (*v < w.min || *v > w.max) {
      return shown(node_) + " is out of range";
    }
    std::visit([&](auto* t) { *t = static_cast<std::remove_pointer_t<decltype(t)>>(*v); }, w.target);
    return {};
  }

  std::string operator()(const Flag& f) const {
    const auto v = node_.value_exact<bool>();
    if (!v) {
      return shown(node_) + " is not true or false";
    }
    *f.target = *v;
    return {};
  }

  std::string operator()(const Text& t) const {
    const auto v = node_.value_exact<std::string>();
    if (!v) {
      return shown(node_) + " is not text";
    }
    if (v->size() > kLongestText) {
      return "the text is too long";
    }
    if (v->find('\0') != std::string::npos) {
      return "the text contains a zero character";
    }
    const bool relative = t.path && !folder_.empty() && !v->empty() && fs::path(*v).is_relative();
    *t.target = relative ? (folder_ / *v).lexically_normal().string() : *v;
    return {};
  }

  std::string operator()(const Choice& c) const {
    std::optional<std::string> given;
    if (c.quoted) {
      given = node_.value_exact<std::string>();
    } else if (const auto d = number(node_)) {
      given = fmt::format("{}", *d);
    }
    const auto it = given ? std::find(c.names.begin(), c.names.end(), *given) : c.names.end();
    if (it == c.names.end()) {
      return shown(node_) + " is not one of the choices" +
             (given && c.quoted ? suggestion(*given, c.names) : "");
    }
    c.set(static_cast<int>(it - c.names.begin()));
    return {};
  }

  std::string operator()(const BackendName& b) const {
    const auto given = node_.value_exact<std::string>();
    if (!given || std::find(b.names.begin(), b.names.end(), *given) == b.names.end()) {
      return shown(node_) + " is not one of the choices" + (given ? suggestion(*given, b.names) : "");
    }
    b.set(*given);
    return {};
  }

  std::string operator()(const Triple& t) const {
    const toml::array* a = node_.as_array();
    if (a == nullptr || a->size() != 3) {
      return shown(node_) + " is not a list of three numbers";
    }
    hal::Vec3 v;
    for (int i = 0; i < 3; ++i) {
      std::string problem = read_number(*a->get(static_cast<std::size_t>(i)), t.min, t.max, v[i]);
      if (!problem.empty()) {
        return problem;
      }
    }
    if (t.direction) {
      if (v.norm() < 1e-3) {
        return "the direction is zero";
      }
      if (std::abs(v.norm() - 1) > 1e-15) {
        v /= v.norm();
      }
    }
    *t.target = v * t.unit.multiply / t.unit.divide;
    return {};
  }

 private:
  const toml::node& node_;
  const fs::path& folder_;
};

}  // namespace

std::string store(const Key& key, const toml::node& node, const fs::path& folder) {
  return std::visit(Storing(node, folder), key.value);
}

}  // namespace punctum::tools
