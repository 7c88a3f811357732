// Files that are there as a whole or not at all: written beside their place, brought to the disk, and moved
// there in one step. Whoever reads meanwhile, or after a crash, finds the old file or the new one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace punctum::tools {

// Where a file is written until it is whole: beside its place, with the same suffix.
[[nodiscard]] std::filesystem::path unfinished(const std::filesystem::path& path);

// Makes an empty file to write into: unfinished(path), or a name like it where anything has that one, so that
// nothing that was there is written to, nor what a link points to. The error is one line.
[[nodiscard]] tl::expected<std::filesystem::path, std::string> begin_unfinished(
    const std::filesystem::path& path);

// Also a link that points nowhere.
[[nodiscard]] bool is_there(const std::filesystem::path& path);

enum class Sync : std::uint8_t {
  to_disk,  // whole also after the power fails: waits for the disk, for seconds where it is busy
  later,    // whole for every reader on this machine: for those that must not wait
};

// Moves what was written to `part`, of begin_unfinished(path), to its place. The errors are one line; nothing
// is left then.
[[nodiscard]] tl::expected<void, std::string> put_in_place(const std::filesystem::path& part,
                                                           const std::filesystem::path& path,
                                                           Sync sync = Sync::to_disk);

// All of a file that people write or a program wrote once. Refused, in one line: what is no file and may
// never end, such as a pipe or a device, and what is larger than that.
inline constexpr std::uintmax_t kReadMost = std::uintmax_t{64} << 20U;
[[nodiscard]] tl::expected<std::string, std::string> read_whole(const std::filesystem::path& path);

// Both are, or would be, one plain file: what is written to the one destroys what stands in the other. Never
// of devices: whoever wants no table has it written to /dev/null.
[[nodiscard]] bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

// A pipe, a terminal or another device is written directly.
[[nodiscard]] tl::expected<void, std::string> write_whole(const std::filesystem::path& path,
                                                          std::string_view content,
                                                          Sync sync = Sync::to_disk);

}  // namespace punctum::tools
