// Files that are parts of the program: the built page (tools/console/page/built), and the schemas of JSON
// messages.
#pragma once

#include <span>
#include <string_view>

namespace punctum::console {

struct PageFile {
  std::string_view path;  // of the address
  std::string_view type;
  std::string_view bytes;
};
[[nodiscard]] std::span<const PageFile> page_files();
// messages.schema.json: a JSON Schema for each name.
[[nodiscard]] std::string_view json_schemas();

}  // namespace punctum::console
