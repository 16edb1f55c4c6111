#ifndef HEDDLE_TESTS_SUPPORT_TRACED_WORLD_H_
#define HEDDLE_TESTS_SUPPORT_TRACED_WORLD_H_
// A scene with what a path tracer of it needs.

#include <memory>
#include <vector>

#include "render/cloth_scene.h"
#include "render/path_tracer.h"

namespace heddle {

struct TracedWorld {
  std::unique_ptr<ClothScene> scene;
  std::vector<BcsdfTable> materials;
  std::vector<Light> lights;

  PathTracer tracer(LightEstimator estimator = LightEstimator::kCombined, bool local = false,
                    int max_scatterings = 4096) const {
    PathTracerSettings settings;
    settings.estimator = estimator;
    settings.local = local;
    settings.limits.max_scatterings = max_scatterings;
    return {*scene, materials, lights, Rgb(0, 0, 0), settings};
  }
};

}  // namespace heddle

#endif  // HEDDLE_TESTS_SUPPORT_TRACED_WORLD_H_
