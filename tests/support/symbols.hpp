// What an object file or archive asks of others, and what of it the real-time core may ask.
#pragma once

#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace punctum::tests {

struct Symbols {
  std::set<std::string> defined;
  std::map<std::string, std::string> undefined;  // symbol -> where it is asked for
};

// `file` is an archive or an object, read by `nm` in its portable format: "file[member]: name type ...".
inline Symbols symbols_of(const std::string& nm, const std::string& file) {
  const std::string command = nm + " -A -P '" + file + "'";
  const auto close = [](std::FILE* f) { pclose(f); };
  const std::unique_ptr<std::FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  std::string text;
  std::array<char, 4096> buffer{};
  while (pipe != nullptr && std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) {
    text += buffer.data();
  }
  Symbols symbols;
  std::istringstream lines(text);
  std::string where;
  std::string name;
  std::string type;
  std::string rest;
  while (lines >> where >> name >> type && std::getline(lines, rest)) {
    if (type == "U" || type == "w" || type == "v") {
      symbols.undefined[name] = where;
    } else {
      symbols.defined.insert(name);
    }
  }
  return symbols;
}

// The functions of the mathematics library whose result is exact or correctly rounded on every machine (all
// others come from hal/math), the four memory functions a compiler may call by itself, its stack check, and
// the atomic operations that g++ for ARM keeps in libgcc.
inline const std::regex& allowed_in_the_core() {
  static const std::regex list(
      "sqrtf?|fmodf?|remainderf?|floorf?|ceilf?|truncf?|l?l?roundf?|l?l?rintf?|nearbyintf?|fmaf?|fabsf?|"
      "copysignf?|"
      "fminf?|fmaxf?|ldexpf?|frexpf?|"
      "memcpy|memmove|memset|memcmp|"
      "__stack_chk_fail|__stack_chk_guard|_GLOBAL_OFFSET_TABLE_|"
      "__aarch64_(cas|swp|ldadd|ldset|ldclr|ldeor)[0-9]+_(relax|acq|rel|acq_rel|sync)");
  return list;
}

// Type information, and the guards of statics in functions, may not even be defined.
inline bool forbidden_to_define(const std::string& symbol) {
  return symbol.starts_with("_ZTI") || symbol.starts_with("_ZTS") || symbol.starts_with("_ZGV");
}

// A line for each symbol that the core may not have; `besides` is allowed too.
inline std::string offences(const Symbols& symbols, const std::set<std::string>& besides = {}) {
  std::string found;
  for (const auto& [symbol, where] : symbols.undefined) {
    if (!symbols.defined.contains(symbol) && !besides.contains(symbol) &&
        !std::regex_match(symbol, allowed_in_the_core())) {
      found += "\n  " + where + " needs " + symbol;
    }
  }
  for (const std::string& symbol : symbols.defined) {
    if (forbidden_to_define(symbol)) {
      found += "\n  " + symbol + " is defined";
    }
  }
  return found;
}

}  // namespace punctum::tests
