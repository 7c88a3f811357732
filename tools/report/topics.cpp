// The topics there are, in the order of the report. A topic is one file: declared and listed here, added to
// tools/CMakeLists.txt, nothing else.
#include "tools/report/topic.hpp"

namespace punctum::report {

std::span<const Topic> topics() {
  static const std::vector<Topic> list = {};
  return list;
}

}  // namespace punctum::report
