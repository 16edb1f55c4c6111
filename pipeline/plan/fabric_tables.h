#ifndef HEDDLE_PIPELINE_PLAN_FABRIC_TABLES_H_
#define HEDDLE_PIPELINE_PLAN_FABRIC_TABLES_H_
// Accuracy tables of a scene's fabrics and of the surface models that may stand in for them, and
// what their data take to build. Errors: ConfigError, FileError, Interrupted. Tested in
// tests/pipeline/end_to_end_test.cpp.

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/plan/view_facts.h"
#include "pipeline/stages.h"

namespace heddle {

/// What a fabric's file and its table say.
struct FabricFacts {
  std::filesystem::path file;
  std::string name;
  int order = 5;  // its own, of the transfer
  bool light_from_both_sides = false;
  AccuracyTable table;
};

struct FabricTables {
  std::vector<FabricFacts> fabrics;  // one per fabric file
  std::map<std::pair<std::filesystem::path, std::string>, AccuracyTable> surfaces;

  const FabricFacts& of(const std::filesystem::path& file) const;
  /// Of the cloth's far_surface in place of its fibers.
  const AccuracyTable& of_far_surface(const ClothConfig& cloth) const;
};

/// Is the cloth drawn by fibers that the view sees?
bool shows_fibers(const SceneConfig& scene, const ViewFacts& view, std::size_t cloth);

/// Does the variant draw a fabric by its fibers?
bool draws_fibers(const SceneConfig& scene, const SceneVariant& variant,
                  const std::filesystem::path& fabric);

/// Tables and stages of a scene's fabrics.
class FabricLibrary {
 public:
  /// Both outlive the object.
  FabricLibrary(const SceneConfig& scene, StageContext& context);
  ~FabricLibrary();

  bool empty() const { return tables_.fabrics.empty(); }
  /// Reads the tables, and measures those that are missing. Where one is missing and path tracing
  /// takes fewer samples than measuring it (`path_samples`): says so, and reads nothing more.
  /// Empty where all were read.
  std::string read_tables(double path_samples);
  const FabricTables& tables() const { return tables_; }

  /// What the cache lacks of the data of a method and variant; by the tables, for the threads at
  /// work.
  double build_seconds(RenderMethod method, const SceneVariant& variant);

 private:
  FabricStages& stages_of(const FabricFacts& fabric, const FabricVariant& variant);

  const SceneConfig* scene_;
  StageContext* context_;
  FabricTables tables_;
  std::map<std::pair<std::filesystem::path, FabricVariant>, std::unique_ptr<FabricStages>> stages_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_FABRIC_TABLES_H_
