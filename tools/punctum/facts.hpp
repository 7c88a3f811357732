// Reading report.json: of whatever version of this program, cut off or edited by hand. What is not there, or
// is of another kind, is absent, and nothing throws.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace punctum::tools {

[[nodiscard]] inline const nlohmann::ordered_json& fact(const nlohmann::ordered_json& in, const char* name) {
  static const nlohmann::ordered_json nothing;
  if (!in.is_object()) {
    return nothing;
  }
  const auto found = in.find(name);
  return found == in.end() ? nothing : *found;
}

[[nodiscard]] inline std::optional<double> number_in(const nlohmann::ordered_json& in, const char* name) {
  const auto& v = fact(in, name);
  return v.is_number() ? std::optional(v.get<double>()) : std::nullopt;
}

[[nodiscard]] inline std::string text_in(const nlohmann::ordered_json& in, const char* name) {
  const auto& v = fact(in, name);
  return v.is_string() ? v.get<std::string>() : std::string();
}

[[nodiscard]] inline bool flag_in(const nlohmann::ordered_json& in, const char* name) {
  const auto& v = fact(in, name);
  return v.is_boolean() && v.get<bool>();
}

[[nodiscard]] inline std::vector<nlohmann::ordered_json> list_in(const nlohmann::ordered_json& in,
                                                                 const char* name) {
  const auto& v = fact(in, name);
  return v.is_array() ? std::vector<nlohmann::ordered_json>(v.begin(), v.end())
                      : std::vector<nlohmann::ordered_json>{};
}

}  // namespace punctum::tools
