// All topics, in the order of the report. A topic is a function that is declared and listed here; its file is
// named in CMakeLists.txt.
#include "tools/report/force_pairs.hpp"
#include "tools/report/topic.hpp"

namespace punctum::report {

Result run_force(const Job&);
Result run_integrators(const Job&);
Result run_velocity(const Job&);
Result run_elementary(const Job&);
#ifdef PUNCTUM_VISION
Result run_vision(const Job&);
Result run_surface(const Job&);
#endif
Result run_stability(const Job&);
Result run_scenes(const Job&);

std::span<const Topic> topics() {
  static const std::vector<Topic> list = {
      {"force", "the membrane's force: eq. 5 as it is evaluated, and the laws against large deflection",
       run_force, evaluate_pairs_file},
      {"integrators", "ways to step the plant through contact, friction and puncture", run_integrators},
      {"velocity", "the hand's velocity from its quantised positions: error, lag and noise", run_velocity},
      {"elementary", "sine, logarithm and their relatives beside the C library's: error and time",
       run_elementary},
#ifdef PUNCTUM_VISION
      {"vision", "contours, tip, dimple and force as seen in pictures whose truth is known", run_vision},
      {"surface", "descriptions of the indented cell's surface", run_surface},
#endif
      {"stability", "stiffness, delay and damping on the haptic device, with and without the guard",
       run_stability},
      {"scenes", "what each built-in scene costs: processes, libraries, instructions, stages of vision",
       run_scenes},
  };
  return list;
}

}  // namespace punctum::report
