#ifndef HEDDLE_PIPELINE_SURFACE_STAGES_H_
#define HEDDLE_PIPELINE_SURFACE_STAGES_H_
// The stages of a scene's interactive surface cloths (surface_method = "interactive"). Their
// artifacts lie in the cache like those of fabrics:
//
//   surface-weights   curves, directions and shares of a fabric's threads      KEY.safetensors
//                     WeightingTable
//   surface-maps      shapes of all cloths and meshes; which cloth and side    KEY.safetensors
//                     DistanceMaps
//
// Neither depends on colours, indices of refraction, lights or widths of lobes, except for the
// class that sets the number of tangents (tangent_samples). So all those are edited without
// precomputing again. Errors: FileError, Interrupted. Tested in tests/pipeline/end_to_end_test.cpp.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/stages.h"
#include "render/cloth_scene.h"
#include "render/interactive_surface.h"
#include "render/scene_config.h"

namespace heddle {

class SurfaceStages {
 public:
  /// geometry_key: of a fabric file with fibers; asked only if a cloth is interactive. config and
  /// context outlive the object.
  SurfaceStages(
      const SceneConfig& config, StageContext& context,
      const std::function<std::string(const std::filesystem::path& fabric)>& geometry_key);

  /// Of all artifacts.
  std::vector<std::string> keys() const;
  std::vector<StageCost> costs() const;

  /// Builds what is missing. [surface cloth] is null if it is not interactive. `scene`: the
  /// config's.
  std::vector<std::shared_ptr<const InteractiveSurface>> load(const ClothScene& scene) const;

 private:
  struct Surface {
    const SurfaceFabric* fabric;
    Stage weights;
    Stage face;
    Stage back;
  };
  std::shared_ptr<const DistanceMaps> maps(const Surface& surface, ClothSide side,
                                           const ClothScene& scene,
                                           const SurfaceCloth& cloth) const;

  StageContext* context_;
  std::vector<std::optional<Surface>> surfaces_;  // [surface cloth]
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_SURFACE_STAGES_H_
