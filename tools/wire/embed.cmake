# Writes the bytes of FILE as a C++ source: the function DECLARATION returns them.
file(READ ${FILE} hex HEX)
string(LENGTH "${hex}" digits)
math(EXPR size "${digits} / 2")
string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
file(WRITE ${OUTPUT} "#include <string_view>\nnamespace punctum::tools {\n"
  "std::string_view wire_schema();\n"
  "static constexpr unsigned char kBytes[] = {${bytes}};\n"
  "std::string_view wire_schema() { return {reinterpret_cast<const char*>(kBytes), ${size}}; }\n}\n")
