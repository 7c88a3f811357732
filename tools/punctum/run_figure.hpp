// Force, depth and phases of a run over time.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "tools/punctum/measures.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

// From FOLDER/samples.csv, which has `rows` rows, to FOLDER/figure.png. The error says why there is none.
[[nodiscard]] tl::expected<std::string, std::string> draw_run(const std::string& folder, const Scene& scene,
                                                              const Measures& m, std::uint64_t rows);

}  // namespace punctum::tools
