// The command line of every program: help in plain words with examples and exit codes, one line for a
// mistake, and the option or command that was probably meant.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

namespace punctum::tools {

// What stands below the options of --help: examples, and what the exit codes say.
[[nodiscard]] std::string help_footer(const std::vector<std::pair<const char*, const char*>>& examples,
                                      const std::vector<std::pair<int, const char*>>& exit_codes);

// Before any option or subcommand is added, which inherit it: values are named for what they mean, as each
// option's type_name says.
void set_help_style(CLI::App& app);

// What an option's number may be. In place of CLI::Range, which lets through what is no number (NaN).
[[nodiscard]] CLI::Validator within(double least, double most);
[[nodiscard]] CLI::Validator within(int least, int most);

// Nothing: go on. Otherwise the program is over with this exit code, and what was to be said has been said.
[[nodiscard]] std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv);

}  // namespace punctum::tools
