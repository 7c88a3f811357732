#include "tools/console/page_files.hpp"

#include <array>
#include <cstdint>

// The assembler takes the files as they are; as an array in C++ they would take the compiler much memory
// and seconds.
#define PUNCTUM_EMBED(name, file)                              \
  asm(".pushsection .rodata\n"                                 \
      ".global punctum_page_" #name                            \
      "\n"                                                     \
      ".global punctum_page_" #name                            \
      "_size\n"                                                \
      "punctum_page_" #name                                    \
      ":\n"                                                    \
      ".incbin \"" PUNCTUM_PAGE_FOLDER "/" file                \
      "\"\n"                                                   \
      "punctum_page_" #name                                    \
      "_end:\n"                                                \
      ".balign 8\n"                                            \
      "punctum_page_" #name                                    \
      "_size:\n"                                               \
      ".quad punctum_page_" #name "_end - punctum_page_" #name \
      "\n"                                                     \
      ".popsection\n");                                        \
  extern "C" const char punctum_page_##name[];                 \
  extern "C" const std::uint64_t punctum_page_##name##_size

PUNCTUM_EMBED(html, "index.html");
PUNCTUM_EMBED(js, "page.js");
PUNCTUM_EMBED(css, "page.css");
PUNCTUM_EMBED(schemas, "../../messages.schema.json");

namespace punctum::console {

std::span<const PageFile> page_files() {
  static const std::array<PageFile, 3> files = {{
      {"/", "text/html; charset=utf-8", {punctum_page_html, punctum_page_html_size}},
      {"/page.js", "text/javascript; charset=utf-8", {punctum_page_js, punctum_page_js_size}},
      {"/page.css", "text/css; charset=utf-8", {punctum_page_css, punctum_page_css_size}},
  }};
  return files;
}

std::string_view json_schemas() { return {punctum_page_schemas, punctum_page_schemas_size}; }

}  // namespace punctum::console
