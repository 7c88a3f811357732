// Reads TOML documents onto a scene and remembers where every key was given.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "tools/scene/scene_keys.hpp"
#include "tools/scene/toml_document.hpp"

namespace punctum::tools {

class SceneReader {
 public:
  using Done = tl::expected<void, std::string>;
  using Unexpected = tl::unexpected<std::string>;

  SceneReader(Scene& scene, std::filesystem::path folder, const Backends& backends, std::string_view source);

  [[nodiscard]] Done read_file(std::string_view text);
  // Replaces what the file says; paths are relative to where the program runs.
  [[nodiscard]] Done read_override(std::string_view document);
  // Where a key was given; or its table; or the beginning of the file.
  [[nodiscard]] std::string where(const std::string& key) const;

 private:
  Done read(std::string_view text);
  Done read_group(const std::string& group, const toml::table& content);
  Done read_part(const std::string& name, const toml::key& key, const toml::node& node);
  Done read_table(const Table& table, const toml::source_position& pos, const toml::node& node);
  Done switch_table(const Table& table, const toml::source_position& pos, bool on);
  Done read_content(const Table& table, const toml::table& content);
  Done read_list(const List& list, const toml::source_position& pos, const toml::node& node);
  Done read_entry(const List& list, const toml::node& entry);
  Done read_key(const std::string& table, const std::vector<Key>& keys, const toml::key& key,
                const toml::node& node);
  [[nodiscard]] Done check_use(const std::string& name, const std::vector<std::string>& used_by,
                               const toml::source_position& pos) const;
  [[nodiscard]] Done check_required() const;
  [[nodiscard]] std::vector<Key> keys_of_table(const Table& table);
  [[nodiscard]] Unexpected wrong(const toml::source_position& pos, std::string_view key,
                                 std::string_view text) const;
  [[nodiscard]] Unexpected unknown_table(const std::string& name, const toml::source_position& pos,
                                         const toml::node& node) const;
  [[nodiscard]] Unexpected unknown_key(const std::string& table, const std::string& name,
                                       const std::vector<Key>& keys, const toml::source_position& pos) const;
  [[nodiscard]] bool overriding() const { return !source_.has_lines; }

  Scene& scene_;
  std::filesystem::path folder_;
  const Backends& backends_;
  Source source_;
  std::string first_;
  std::map<std::string, std::string> given_;
};

}  // namespace punctum::tools
