#ifndef HEDDLE_PIPELINE_JOB_H_
#define HEDDLE_PIPELINE_JOB_H_
// One command's console, cache and report. The report goes to standard output. It is the paths of
// what was made, one a line, or with --json one object:
//   {"stages": [...], "artifacts": [...], "seconds": ...}

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/commands.h"
#include "pipeline/console.h"
#include "pipeline/stages.h"

namespace heddle {

class Job {
 public:
  explicit Job(const CommonOptions& options);

  Console& console() { return console_; }
  StageContext& context() { return context_; }
  void add_artifact(const std::filesystem::path& path) { artifacts_.push_back(path); }
  /// One more entry of the JSON report.
  void add_entry(const std::string& name, nlohmann::ordered_json value) {
    entries_.emplace_back(name, std::move(value));
  }
  /// Prints the report.
  void finish() const;

 private:
  bool json_;
  std::chrono::steady_clock::time_point start_;
  Console console_;
  StageContext context_;
  std::vector<std::filesystem::path> artifacts_;
  std::vector<std::pair<std::string, nlohmann::ordered_json>> entries_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_JOB_H_
