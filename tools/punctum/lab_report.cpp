#include "tools/punctum/lab_report.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>

#include "tools/punctum/facts.hpp"
#include "tools/punctum/folder_lock.hpp"
#include "tools/punctum/provenance.hpp"
#include "tools/punctum/rebuilt_facts.hpp"
#include "tools/punctum/run_figure.hpp"
#include "tools/punctum/run_page.hpp"
#include "tools/punctum/run_sentence.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/whole_file.hpp"
#include "tools/shared/written_number.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Done = tl::expected<void, std::string>;

void write_numbers_as_people_do(Json& j) {
  if (j.is_number_float()) {
    j = as_written(j.get<double>());
  }
  if (j.is_structured()) {
    for (Json& part : j) {
      write_numbers_as_people_do(part);
    }
  }
}

std::string text_of(const Json& j) { return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

// Null where there is no such file, or nothing that could be read as one.
Json read_json(const fs::path& path) {
  const auto text = read_whole(path);
  Json j = text ? Json::parse(*text, nullptr, false) : Json();
  return j.is_object() ? j : Json();
}

// The first of the files that a report is made of, or that it becomes, that may never end or be no file of
// its own, such as a pipe; empty if there is none.
fs::path no_file_in(const fs::path& folder) {
  for (const char* name : {"report.json", "report.html", "figure.svg", kBegun, "scene.toml", "samples.csv",
                           "events.csv", "obs.csv"}) {
    std::error_code ec;
    const fs::file_status there = fs::status(folder / name, ec);
    if (fs::exists(there) && !fs::is_regular_file(there) && !fs::is_directory(there)) {
      return folder / name;
    }
  }
  return {};
}

// The page and the figure beside it; without samples there is a page still.
Done write_page(const std::string& folder, const Json& facts, const std::optional<TimeChart>& chart) {
  std::string drawing;
  if (chart && !chart->panels.empty()) {
    drawing = svg(*chart);
    if (auto written = write_whole(fs::path(folder) / "figure.svg", drawing); !written) {
      return written;
    }
  }
  return write_whole(fs::path(folder) / "report.html", run_page(folder, facts, drawing));
}

// A page that would take the place of what one of these reports holds. Another page of its own it may hold.
bool would_destroy(const fs::path& page, const std::vector<std::string>& folders) {
  std::error_code ec;
  const fs::path real = fs::weakly_canonical(page, ec);
  if (!fs::is_regular_file(real, ec) || (real.extension() == ".html" && real.filename() != "report.html")) {
    return false;
  }
  return std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) {
    const fs::path from = real.lexically_relative(fs::weakly_canonical(folder, ec));
    return !from.empty() && *from.begin() != "..";
  });
}

// Empty where samples.csv is the table of a run, or has no row yet; else what it lacks.
std::string what_samples_lack(const fs::path& folder) {
  const CsvReader table((folder / "samples.csv").string());
  if (table.is_empty()) {
    return "";
  }
  for (const char* column : {"t_s", "phase", "fz_N", "fault"}) {
    if (!table.has(column)) {
      return fmt::format("{}: no table of a run: it has no column {}", (folder / "samples.csv").string(),
                         column);
    }
  }
  return "";
}

}  // namespace

Json whole_facts(const Json& begun, Json facts) {
  if (begun.is_object()) {
    facts.update(begun);
  }
  write_numbers_as_people_do(facts);
  return facts;
}

Done write_begun(const std::string& folder, const Json& begun) {
  return write_whole(fs::path(folder) / kBegun, text_of(begun), Sync::later);
}

Done write_report_json(const std::string& folder, const Json& facts) {
  return write_whole(fs::path(folder) / "report.json", text_of(facts));
}

Done write_report_page(const std::string& folder, const Json& facts, bool figure) {
  return write_page(folder, facts, figure ? std::optional(chart_of_run(folder, facts)) : std::nullopt);
}

int report_folders(const std::vector<std::string>& folders, const std::string& out) {
  if (folders.size() == 1 && !out.empty()) {
    complain("--out: is for the comparison of several reports, and one is given");
    return exit_bad_input;
  }
  if (folders.size() > 1 && would_destroy(out, folders)) {
    complain(fmt::format("--out: {}: belongs to one of these reports, allowed: another file", out));
    return exit_bad_input;
  }
  std::vector<ComparedRun> runs;
  int code = exit_done;
  for (const std::string& folder : folders) {
    const fs::path path = fs::path(folder).lexically_normal();
    std::error_code ec;
    if (!fs::is_regular_file(path / "samples.csv", ec) && !fs::is_regular_file(path / "report.json", ec)) {
      complain(
          fmt::format("{}: no report of a run, allowed: a folder with samples.csv or report.json", folder));
      return exit_bad_input;
    }
    // Nor does a run take this folder's place while its page is made.
    const auto lock = FolderLock::take(path.string());
    if (!lock) {
      complain(lock.error() + "; its report comes with its end, and samples.csv can be read meanwhile");
      return exit_bad_input;
    }
    if (const fs::path odd = no_file_in(path); !odd.empty()) {
      complain(odd.string() + ": not a file");
      return exit_bad_input;
    }
    Json facts = read_json(path / "report.json");
    if (facts.is_null()) {
      if (const std::string lack = what_samples_lack(path); !lack.empty()) {
        complain(lack);
        return exit_bad_input;
      }
      const Json begun = read_json(path / kBegun);
      facts = whole_facts(begun, rebuilt_facts(path.string()));
      if (begun.is_null() && fs::exists(path / kBegun, ec)) {
        facts["not_kept"].push_back({{"file", kBegun}, {"t_s", 0}, {"why", "cannot be read"}});
      }
      facts["sentence"] = run_sentence(facts);
      if (auto written = write_report_json(path.string(), facts); !written) {
        complain(written.error());
        return exit_not_done;
      }
    }
    TimeChart chart = chart_of_run(path.string(), facts);
    if (auto written = write_page(path.string(), facts, chart); !written) {
      complain(written.error());
      return exit_not_done;
    }
    Terminal().say("{}: {}\n{}", (path / "report.html").string(), text_in(facts, "outcome"),
                   run_sentence(facts));
    for (const Json& n : list_in(facts, "not_kept")) {
      complain(fmt::format("{}: {} from about {:.3f} s on: {}", path.string(), text_in(n, "file"),
                           number_in(n, "t_s").value_or(0), text_in(n, "why")));
      code = exit_not_done;
    }
    const fs::path named = path.has_filename() ? path : path.parent_path();
    runs.push_back({named.filename().string(), std::move(facts), std::move(chart)});
  }
  if (runs.size() < 2) {
    return code;
  }
  const fs::path page = out.empty() ? fs::path(fmt::format("reports/comparison-{:%Y%m%d-%H%M%S}.html",
                                                           fmt::localtime(std::time(nullptr))))
                                    : fs::path(out);
  std::error_code ec;
  if (page.has_parent_path()) {
    fs::create_directories(page.parent_path(), ec);
  }
  if (auto written = write_whole(page, comparison_page(runs)); !written) {
    complain(written.error());
    return exit_not_done;
  }
  say("\n" + comparison_text(runs) + "\n" + page.string() + "\n");
  return code;
}

}  // namespace punctum::tools
