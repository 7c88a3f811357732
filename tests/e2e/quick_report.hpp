// `punctum-report all --quick`, made once for all tests that look at it.
#pragma once

#include <string>

#include "tests/support/programs.hpp"

namespace punctum::e2e {

class QuickReport {
 public:
  QuickReport() {
    std::string name = (fs::temp_directory_path() / "punctum-report-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      said = "no temporary folder";
      return;
    }
    folder_ = name;
    Running run({"all", "--quick", "--out", folder_.string()}, folder_ / "said.txt", "punctum-report");
    code = run.wait();
    said = run.output();
  }
  ~QuickReport() { fs::remove_all(folder_); }
  QuickReport(const QuickReport&) = delete;
  QuickReport& operator=(const QuickReport&) = delete;

  [[nodiscard]] const fs::path& folder() const { return folder_; }

  int code = -1;
  std::string said;

 private:
  fs::path folder_;
};

inline const QuickReport& quick_report() {
  static const QuickReport made;
  return made;
}

}  // namespace punctum::e2e
