#include "pipeline/artifact_record.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "formats/seal_json.h"
#include "pipeline/cache.h"
#include "pipeline/sealed_json.h"
#include "pipeline/version.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
/// The files of an artifact, by name inside its folder; one without a name where the artifact is a
/// file.
using Seals = std::map<std::string, FileSeal>;

Seals seals_of(const fs::path& artifact) {
  if (!fs::is_directory(artifact)) return {{"", seal_of_file(artifact)}};
  Seals seals;
  for (const auto& entry : fs::directory_iterator(artifact)) {
    seals[entry.path().filename().string()] = seal_of_file(entry.path());
  }
  return seals;
}

nlohmann::json record_json(const Seals& seals, const BuildCost& cost) {
  nlohmann::json files = nlohmann::json::object();
  for (const auto& [name, seal] : seals) files[name] = json_of(seal);
  return {{"files", files},
          {"seconds", cost.time.seconds},
          {"core_seconds", cost.time.core_seconds},
          {"threads", cost.threads},
          {"program_version", kProgramVersion}};
}

}  // namespace

BuildCost recorded_build_cost(const fs::path& record_file) {
  try {
    const nlohmann::json record = read_sealed_json(record_file);
    return {{record.at("seconds").get<double>(), record.at("core_seconds").get<double>()},
            record.at("threads").get<int>()};
  } catch (const std::exception&) {
    return {};
  }
}

ArtifactCheck check_artifact(const fs::path& artifact, const fs::path& record_file) {
  if (!fs::exists(artifact)) return {};
  try {
    const nlohmann::json record = read_sealed_json(record_file);
    for (const auto& [name, seal] : record.at("files").items()) {
      verify_seal(name.empty() ? artifact : artifact / name, seal_of(seal),
                  record_file.filename().string());
    }
  } catch (const std::exception& error) {
    return {ArtifactState::kBroken, error.what()};
  }
  return {ArtifactState::kSound, {}};
}

bool publish_artifact(const fs::path& artifact, const fs::path& record_file,
                      const std::function<BuildCost(const fs::path&)>& build) {
  make_folder(artifact.parent_path());
  TemporaryPath temporary(artifact);
  const BuildCost cost = build(temporary.path());
  const bool built = fs::exists(temporary.path());
  const ArtifactCheck meanwhile = check_artifact(artifact, record_file);
  if (meanwhile.state == ArtifactState::kSound) return built;
  if (!built)
    throw FileError(
        fmt::format("{}: vanished while this process waited for it", artifact.string()));
  std::error_code error;
  if (fs::is_directory(record_file)) fs::remove_all(record_file, error);
  write_sealed_json(record_file, record_json(seals_of(temporary.path()), cost));
  if (fs::is_directory(artifact) != fs::is_directory(temporary.path()))
    fs::remove_all(artifact, error);
  temporary.commit();
  return true;
}

}  // namespace heddle
