#include "fibers/baked/fabric_pack.h"
#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "pipeline/commands.h"
#include "pipeline/job.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

/// Copies a pack out of the cache, the manifest last: a copy cut short is refused by its checksums.
void copy_pack(const fs::path& from, const fs::path& to) {
  std::error_code error;
  if (fs::exists(to) && !fs::is_empty(to, error) && !fs::exists(to / kManifestName)) {
    throw FileError(to.string() + ": exists and is not a pack; remove it or choose another name");
  }
  make_folder(to);
  for (const auto& [name, file] : read_verified_manifest(from).files) {
    write_file_atomically(to / name, read_whole_file(from / name));
  }
  write_file_atomically(to / kManifestName, read_whole_file(from / kManifestName));
}

}  // namespace

int stage_command(const StageOptions& options, const CommonOptions& common) {
  Job job(common);
  FabricStages stages(options.fabric, job.context());
  std::optional<Artifact> artifact;
  switch (options.target) {
    case StageTarget::kSynth:
      artifact = stages.synth();
      break;
    case StageTarget::kVisibility:
      if (options.shard) {
        stages.visibility_shard(*options.shard);
      } else {
        job.add_artifact(stages.ssdf().path);
        artifact = stages.sgs();
      }
      break;
    case StageTarget::kTransfer:
      if (options.shard) {
        stages.transfer_shard(options.order, *options.shard);
      } else {
        artifact = stages.transfer(options.order);
      }
      break;
    case StageTarget::kAccuracy:
      artifact = stages.accuracy();
      break;
    case StageTarget::kPack: {
      Needs needs = kEverything;
      needs.order = options.order;
      artifact = stages.pack(needs);
      if (options.output) {
        copy_pack(artifact->path, *options.output);
        artifact->path = *options.output;
      }
      break;
    }
  }
  if (artifact) job.add_artifact(artifact->path);
  job.finish();
  return 0;
}

}  // namespace heddle
