#ifndef HEDDLE_PIPELINE_COMMANDS_H_
#define HEDDLE_PIPELINE_COMMANDS_H_
// What the subcommands do, apart from the parsing of their options (main.cpp). Each returns the exit status: 0 done,
// 1 beyond a limit that was asked for. Failures are exceptions: ConfigError (2), FileError (1), Interrupted (128 + signal).
// Data goes to standard output, messages and progress to standard error. Tested in tests/pipeline/end_to_end_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "pipeline/stages.h"

namespace heddle {

struct CommonOptions {
  std::filesystem::path cache;
  std::optional<std::uint64_t> seed;  // in place of the config's
  bool quiet = false;
  bool json = false;  // a report for programs on standard output
};

enum class StageTarget { kSynth, kVisibility, kTransfer, kPack };

struct StageOptions {
  std::filesystem::path fabric;
  StageTarget target = StageTarget::kPack;
  std::optional<int> order;
  std::optional<Shard> shard;                      // visibility and transfer
  std::optional<std::filesystem::path> output;     // pack: a copy outside the cache
};
/// Prints the path of the artifact.
int stage_command(const StageOptions& options, const CommonOptions& common);

/// Prints what a file holds.
int info_command(const std::filesystem::path& path, const CommonOptions& common);

/// Throws FileError with the first check that fails.
int check_command(const std::filesystem::path& pack, const CommonOptions& common);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_COMMANDS_H_
