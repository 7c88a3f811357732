// What must hold for any input: a target that finds otherwise says what, and aborts.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

// text: what was read or written, told below.
inline void must(bool holds, const char* what, const std::string& text = {}) {
  if (!holds) {
    std::fprintf(stderr, "%s\n%s%s", what, text.c_str(), text.empty() ? "" : "\n");
    std::abort();
  }
}
