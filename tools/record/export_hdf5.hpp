// A recording as one HDF5 file in the layout of Neurodata Without Borders (NWB 2.6): each quantity of the
// telemetry, and of the simulated world where there is one, as a TimeSeries under /acquisition, with the
// times of the run.
#pragma once

#include <string>
#include <tl/expected.hpp>

namespace punctum::tools {

// The file is there as a whole or not at all; refused where there is one. The value: why the recording
// is not the whole run, in a line; empty if it is. The error is one line: nothing could be read or written.
[[nodiscard]] tl::expected<std::string, std::string> export_hdf5(const std::string& recording,
                                                                 const std::string& file);

}  // namespace punctum::tools
