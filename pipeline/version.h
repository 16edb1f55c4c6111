#ifndef HEDDLE_PIPELINE_VERSION_H_
#define HEDDLE_PIPELINE_VERSION_H_
// The program's version, set by the build from the project's.

namespace heddle {

inline constexpr char kProgramVersion[] = HEDDLE_VERSION;

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_VERSION_H_
