// Writes samples.csv and feeds the measures: drains the station's telemetry and, when the world is simulated,
// the bench's snapshots, tick by tick. Under the virtual clock the same seed gives the same bytes.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "hal/exchange.hpp"
#include "hal/sim/bench.hpp"
#include "rt/station/station.hpp"
#include "tools/measures.hpp"

namespace punctum::tools {

class Recorder {
 public:
  // Every n-th tick becomes a row, and every tick on which phase, fault, e-stop or cell changes.
  static tl::expected<Recorder, std::string> create(const std::string& csv_path, const Scene& scene,
                                                    const rt::Station& station, sim::Bench* bench,
                                                    std::uint64_t every);

  // Takes what is there; returns the number of ticks taken. `to_the_end`: the writers are gone.
  std::uint64_t drain(bool to_the_end = false);

  [[nodiscard]] const Measures& measures() const noexcept { return measures_; }
  [[nodiscard]] std::uint64_t rows() const noexcept { return rows_; }
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return lost_;
  }  // samples overrun before they were read
  [[nodiscard]] std::uint64_t every() const noexcept { return every_; }
  [[nodiscard]] bool write_failed() const noexcept { return failed_; }
  void finish();

 private:
  struct Close {
    void operator()(std::FILE* f) const noexcept { std::fclose(f); }
  };
  Recorder(std::FILE* file, const Scene& scene, const rt::Station& station, sim::Bench* bench,
           std::uint64_t every);
  void take(const rt::TelemetrySample& s, const sim::Snapshot* world);
  void row(const rt::TelemetrySample& s, const sim::Snapshot* world);

  std::unique_ptr<std::FILE, Close> file_;
  sim::SimConfig sim_;
  Measures measures_;
  const rt::Station* station_;
  std::unique_ptr<sim::SnapshotTaker> taker_;
  std::uint64_t next_ = 0;  // telemetry sample
  std::uint64_t every_;
  std::uint64_t rows_ = 0, lost_ = 0;
  double half_period_s_;
  bool failed_ = false;
  bool have_ = false, have_world_ = false;
  rt::TelemetrySample sample_, before_;
  sim::Snapshot world_;
};

}  // namespace punctum::tools
