// What a scene would start, and what it leaves out; and whether this machine can run it.
#pragma once

#include <string>

#include "tools/scene/scene.hpp"

namespace punctum::tools {

// Processes, threads, rates, priorities, CPUs, the effects in the tick, the stages of vision, what is left
// out and what that saves.
[[nodiscard]] std::string explain(const Scene& scene);

// Every table and key with its unit, range and value in this scene.
[[nodiscard]] std::string explain_keys(const Scene& scene);

// The files a scene names are there and can be read. The error is one line.
[[nodiscard]] tl::expected<std::string, std::string> files_of(const Scene& scene);

// Files, devices and permissions, without touching an actuator. 0 = can run, 2 = cannot.
[[nodiscard]] int check(const Scene& scene, std::string& text);

}  // namespace punctum::tools
