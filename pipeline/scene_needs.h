#ifndef HEDDLE_PIPELINE_SCENE_NEEDS_H_
#define HEDDLE_PIPELINE_SCENE_NEEDS_H_
// Which precomputed data a picture needs, from its method and its lights: nothing where paths are
// traced or fibers are counted (dual scattering); otherwise the transfer; the signed distances for
// the rivals that derive their own visibility from them (PRT, Tsai and Shih); for the other methods
// the signed distances where a light is sharp (directional, or a Gaussian above the lower end of
// the blend), the sums of Gaussians where one is soft (below the blend's upper end), and the volume
// where eye rays march through it. Tested in tests/pipeline/scene_needs_test.cpp.

#include <span>

#include "pipeline/stages.h"
#include "render/lights.h"
#include "render/scene_config.h"
#include "render/single_scattering.h"

namespace heddle {

Needs needs_of(RenderMethod method, std::span<const Light> lights,
               const VisibilityBlend& blend = {});

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_SCENE_NEEDS_H_
