// The built page (tools/console/page/built), which is part of the program.
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

}  // namespace punctum::console
