#ifndef HEDDLE_PIPELINE_PLAN_PRIOR_H_
#define HEDDLE_PIPELINE_PLAN_PRIOR_H_
// What is expected of a way before it is tried in the view: from the fabrics' accuracy tables, by
// the light and the width of pixels on each cloth. Pure functions. Tested in
// tests/pipeline/plan_test.cpp.
//
// Squared errors are relative to the squared mean radiance. They add up over settings and cloths;
// over lights half as if the errors were the same, half as if they were independent.

#include <string>
#include <utility>
#include <vector>

#include "pipeline/plan/fabric_tables.h"
#include "pipeline/plan/ways.h"

namespace heddle {

/// A squared error over lights.
class OverLights {
 public:
  /// `weight`: of all light. `square` is relative to this light's own.
  void add(double weight, double square);
  double square() const;

 private:
  double together_ = 0;
  double apart_ = 0;
};

/// Names of table settings whose differences from `base` add up.
struct TableSettings {
  std::string base;
  // (setting, the one that it is a change of)
  std::vector<std::pair<std::string, std::string>> changes;
};
TableSettings table_settings_of(const WaySettings& way, const SceneVariant::OfFabric& of_fabric);

/// What a table says of one cloth: squares relative to the cloth's own light, noise and time
/// relative to path tracing.
struct ClothPrior {
  Estimate bias_square;
  double noise_ratio = 1;
  double time_ratio = 1;
  double setup_seconds = 0;  // per light
};
/// `bent`: the cloth lies on a mesh, so that what folds add counts.
ClothPrior prior_of_cloth(const AccuracyTable& table, const TableSettings& settings,
                          const SeenCloth& cloth, bool bent);

/// Adds what a cloth shows of light on its back, which data of light from the face do not hold.
/// `through`: as in AccuracyTable.
void add_light_from_behind(const SeenCloth& cloth, double through, ClothPrior& prior);

/// The same of a way and the whole picture.
struct WayPrior {
  Estimate bias_square;  // without light between cloths
  double noise_ratio = 1;
  double time_ratio = 1;
  double setup_seconds = 0;  // of a picture
};
WayPrior prior_of_way(const WaySettings& way, const SceneConfig& scene, const ViewFacts& view,
                      const FabricTables& tables);

/// Squared light between cloths, by what they see of each other, as in the folds of the fabrics'
/// tables.
Estimate prior_between(const SceneConfig& scene, const ViewFacts& view, const FabricTables& tables);

/// Squared change of the picture when the transfer is cut to `order`, all fabrics; 0 where some
/// cloth lies on a mesh or has no more than that order.
double prior_of_low_order(int order, const SceneConfig& scene, const ViewFacts& view,
                          const FabricTables& tables);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_PRIOR_H_
