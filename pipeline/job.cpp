#include "pipeline/job.h"

#include <unistd.h>

#include <iostream>
#include <nlohmann/json.hpp>

namespace heddle {

Job::Job(const CommonOptions& options)
    : json_(options.json),
      start_(std::chrono::steady_clock::now()),
      console_(std::cerr, ::isatty(STDERR_FILENO) == 1, options.quiet),
      context_{.cache = Cache(options.cache),
               .console = &console_,
               .fabric_seed = options.fabric_seed,
               .picture_seed = options.picture_seed,
               .results = {}} {}

void Job::finish() const {
  if (!json_) {
    for (const std::filesystem::path& path : artifacts_) std::cout << path.string() << '\n';
    return;
  }
  auto stages = nlohmann::ordered_json::array();
  for (const StageResult& result : context_.results) {
    stages.push_back({{"fabric", result.fabric},
                      {"stage", result.stage},
                      {"key", result.key},
                      {"artifact", result.artifact.string()},
                      {"built", result.built},
                      {"chunks_built", result.chunks},
                      {"chunks_found", result.resumed},
                      {"seconds", result.seconds}});
  }
  auto artifacts = nlohmann::ordered_json::array();
  for (const std::filesystem::path& path : artifacts_) artifacts.push_back(path.string());
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  nlohmann::ordered_json report = {
      {"stages", stages}, {"artifacts", artifacts}, {"seconds", seconds}};
  for (const auto& [name, value] : entries_) report[name] = value;
  std::cout << report.dump(2) << '\n';
}

}  // namespace heddle
