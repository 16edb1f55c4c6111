#ifndef HEDDLE_PIPELINE_ARTIFACT_RECORD_H_
#define HEDDLE_PIPELINE_ARTIFACT_RECORD_H_
// The record beside an artifact: size and checksum (XXH3-128) of its file, or of every file of its
// folder, and what it took to build. The record is published just before the artifact, so every
// artifact has one. An artifact that differs from its record is not used. The record holds a
// checksum of itself. Errors: FileError with the system's reason. Tested in
// tests/pipeline/artifact_record_test.cpp.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "pipeline/work_time.h"

namespace heddle {

/// What it took to build an artifact, without what it read.
struct BuildCost {
  WorkTime time = {-1, -1};  // -1: unknown
  int threads = 0;
};

/// Cost of the artifact that this record belongs to; unknown if there is no readable record.
BuildCost recorded_build_cost(const std::filesystem::path& record_file);

enum class ArtifactState : std::uint8_t { kAbsent, kSound, kBroken };

struct ArtifactCheck {
  ArtifactState state = ArtifactState::kAbsent;
  std::string problem;  // of a broken one: names the file and says what is wrong
};

/// Reads all of the artifact and compares it with its record.
ArtifactCheck check_artifact(const std::filesystem::path& artifact,
                             const std::filesystem::path& record_file);

/// build(temporary) makes a file or a folder there, which then replaces what lies at `artifact`. If
/// build makes nothing, another process must have published the artifact meanwhile. If two publish
/// at once, the first stays; their bytes are the same. Returns whether `artifact` is what this call
/// built.
bool publish_artifact(
    const std::filesystem::path& artifact, const std::filesystem::path& record_file,
    const std::function<BuildCost(const std::filesystem::path& temporary)>& build);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_ARTIFACT_RECORD_H_
