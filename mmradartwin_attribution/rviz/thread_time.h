#pragma once

#include <ctime>

namespace mmradartwin {

/// Seconds of the processor that this thread has had: what it costs, whatever else runs on the computer.
inline double threadTime_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace mmradartwin
