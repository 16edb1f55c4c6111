#include "precompute/visibility_settings.h"

#include <string>

namespace heddle {

VisibilitySettings read_visibility_settings(const TomlTable& section, bool both_sides) {
  VisibilitySettings settings;
  settings.both_sides = both_sides;
  settings.components =
      static_cast<int>(section.integer("components", 1, 128, settings.components));
  settings.pca_segments =
      static_cast<int>(section.integer("pca_segments", 1, 20000, settings.pca_segments));
  settings.sgs.count = static_cast<int>(section.integer("sg_count", 1, 256, settings.sgs.count));
  const std::string axes = section.choice("sg_axes", {"hemisphere", "sphere", "printed"},
                                          both_sides ? "sphere" : "hemisphere");
  settings.sgs.axes = axes == "printed"  ? FibonacciSet::kPrinted
                      : axes == "sphere" ? FibonacciSet::kSphere
                                         : FibonacciSet::kHemisphere;
  if (both_sides && settings.sgs.axes != FibonacciSet::kSphere) {
    section.fail(
        "sg_axes",
        "expected \"sphere\": light comes from both sides, and these axes lie above the horizon");
  }
  settings.sgs.sharpness = section.number("sg_sharpness", {.min = 1, .max = 1000},
                                          default_sg_sharpness(settings.sgs.axes));
  settings.sgs.weights = section.choice("sg_weights", {"nnls", "voronoi"}, "nnls") == "voronoi"
                             ? SgWeights::kVoronoi
                             : SgWeights::kNnls;
  return settings;
}

}  // namespace heddle
