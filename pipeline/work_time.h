#ifndef HEDDLE_PIPELINE_WORK_TIME_H_
#define HEDDLE_PIPELINE_WORK_TIME_H_
// How long work took, in wall-clock seconds and in core-seconds. Core-seconds are processor time of
// all threads of this process, so work that runs at the same time cannot be told apart. Tested in
// tests/pipeline/chart_test.cpp.

#include <chrono>

namespace heddle {

struct WorkTime {
  double seconds = 0;
  double core_seconds = 0;
};

inline WorkTime operator+(const WorkTime& a, const WorkTime& b) {
  return {a.seconds + b.seconds, a.core_seconds + b.core_seconds};
}
inline WorkTime operator-(const WorkTime& a, const WorkTime& b) {
  return {a.seconds - b.seconds, a.core_seconds - b.core_seconds};
}

/// Counts from its construction.
class Stopwatch {
 public:
  Stopwatch();
  WorkTime elapsed() const;

 private:
  std::chrono::steady_clock::time_point start_;
  double core_start_;
};

/// Threads that parallel loops may use, see --threads.
int working_threads();

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_WORK_TIME_H_
