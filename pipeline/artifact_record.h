#ifndef HEDDLE_PIPELINE_ARTIFACT_RECORD_H_
#define HEDDLE_PIPELINE_ARTIFACT_RECORD_H_
// The record beside an artifact: size and checksum (XXH3-128) of its file, or of every file of its
// folder, and what it took to build. It is published just before the artifact, so an artifact that
// stands there has one, and nothing is used that differs from it. The record seals itself with a
// checksum of its own. Errors: FileError with the system's reason. Tested in
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

/// Of the artifact that this record belongs to; unknown where there is no readable record.
BuildCost recorded_build_cost(const std::filesystem::path& record_file);

enum class ArtifactState : std::uint8_t { kAbsent, kSound, kBroken };

struct ArtifactCheck {
  ArtifactState state = ArtifactState::kAbsent;
  std::string problem;  // of a broken one: names the file and says what is wrong
};

/// Reads all of the artifact and holds it against its record.
ArtifactCheck check_artifact(const std::filesystem::path& artifact,
                             const std::filesystem::path& record_file);

/// build(temporary) makes a file or a folder there, which is then put in place of what lies at
/// `artifact`. Where build makes nothing, another process must have published the artifact
/// meanwhile. Of two that publish at once, whose bytes are the same, the first stays. Returns
/// whether `artifact` is what this call built.
bool publish_artifact(
    const std::filesystem::path& artifact, const std::filesystem::path& record_file,
    const std::function<BuildCost(const std::filesystem::path& temporary)>& build);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_ARTIFACT_RECORD_H_
