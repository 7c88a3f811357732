#include "tools/shared/command_line.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <string_view>
#include <utility>

#include "tools/shared/exit_codes.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/suggestion.hpp"

namespace punctum::tools {
namespace {

constexpr std::size_t kColumn = 30;

class PlainHelp : public CLI::Formatter {
 public:
  PlainHelp() {
    column_width(kColumn);
    label("Positionals", "Arguments");
  }
  // The meaning of the value alone: no type, no default in brackets, no REQUIRED.
  std::string make_option_opts(const CLI::Option* option) const override {
    // What checks the value stands behind a colon; that of a positional is its own name.
    const std::string full = option->get_type_name(), type = full.substr(0, full.find(':'));
    return option->get_positional() || option->get_type_size() == 0 || type.empty() ? std::string()
                                                                                    : " " + type;
  }
  std::string make_usage(const CLI::App* app, std::string name) const override {
    std::string usage = "Usage: " + name;
    for (const CLI::Option* o :
         app->get_options([](const CLI::Option* one) { return one->get_positional(); })) {
      usage += " " + o->get_name(true) + (o->get_expected_max() > 1 ? "..." : "");
    }
    const bool commands = !app->get_subcommands([](const CLI::App*) { return true; }).empty();
    const bool alone = app->get_require_subcommand_min() == 0;  // it does something without a command
    return usage + (!commands ? " [options]" : alone ? " [options] [COMMAND ...]" : " COMMAND ...") + "\n";
  }
};

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(sub->get_name());
  }
  return names;
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      names.push_back("--" + name);
    }
  }
  return names;
}

const CLI::App* chosen(const CLI::App* app) {
  const auto subs = app->get_subcommands();
  return subs.empty() ? app : subs.front();
}

// The option that nobody knows, with what was probably meant; empty where every option is known.
std::string unknown_option(const CLI::App& app, int argc, char** argv) {
  const CLI::App& command = *chosen(&app);
  const std::vector<std::string> known = options_of(command);
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const std::string name(word.substr(0, word.find('=')));
    if (name == "--") {
      break;
    }
    if (name.starts_with("--") && std::find(known.begin(), known.end(), name) == known.end()) {
      return fmt::format("{}: unknown option{}, allowed: {}", name, suggestion(name, known),
                         fmt::join(known, ", "));
    }
  }
  return {};
}

std::string what_is_wrong(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  const std::vector<std::string> commands = commands_of(app);
  const std::string first = argc > 1 ? argv[1] : "";
  if (!commands.empty() && (first.empty() || first[0] != '-') &&
      std::find(commands.begin(), commands.end(), first) == commands.end()) {
    return first.empty() ? fmt::format("a command is missing, allowed: {}; --help tells more",
                                       fmt::join(commands, ", "))
                         : fmt::format("{}: unknown command{}, allowed: {}", first,
                                       suggestion(first, commands), fmt::join(commands, ", "));
  }
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr ||
      dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    if (std::string text = unknown_option(app, argc, argv); !text.empty()) {
      return text;
    }
  }
  return error.what();
}

template <class Number>
CLI::Validator between(Number least, Number most) {
  const auto wrong = [least, most](const std::string& text) {
    Number number{};
    const bool is_within = CLI::detail::lexical_cast(text, number) && number >= least && number <= most;
    return is_within ? std::string() : fmt::format("{}, allowed: from {} to {}", text, least, most);
  };
  return {wrong, std::string()};
}

}  // namespace

CLI::Validator within(double least, double most) { return between(least, most); }
CLI::Validator within(int least, int most) { return between(least, most); }

std::string help_footer(const std::vector<std::pair<const char*, const char*>>& examples,
                        const std::vector<std::pair<int, const char*>>& exit_codes) {
  std::string s = examples.empty() ? "" : "Examples:\n";
  for (const auto& [line, what] : examples) {
    s += fmt::format("  {}\n{:6}{}\n", line, "", what);
  }
  s += s.empty() ? "Exit codes:\n" : "\nExit codes:\n";
  for (const auto& [code, what] : exit_codes) {
    s += fmt::format("  {}  {}\n", code, what);
  }
  s.pop_back();
  return s;
}

void set_help_style(CLI::App& app) {
  app.formatter(std::make_shared<PlainHelp>());
  app.set_help_flag("-h,--help", "this help");
}

std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      (void)app.exit(error);
      return code_after_words(exit_done);
    }
    complain(what_is_wrong(app, error, argc, argv));
    return exit_bad_input;
  }
}

}  // namespace punctum::tools
