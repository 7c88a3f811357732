# cmake -DSOURCE=.. -DOUTPUT=.. -P commit.cmake: writes the commit that is built; touches nothing when it is the same.
execute_process(COMMAND git -c safe.directory=* -C ${SOURCE} describe --always --exclude=* --abbrev=12 --dirty=+changes
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE code)
if(NOT code STREQUAL "0" OR commit STREQUAL "")
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
#include "tools/shared/version.hpp"
const char* punctum::tools::built_commit() noexcept { return "@commit@"; }
]])
