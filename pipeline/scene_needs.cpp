#include "pipeline/scene_needs.h"

#include "render/single_scattering.h"

namespace heddle {

Needs needs_of(RenderMethod method, std::span<const Light> lights) {
  Needs needs;
  if (method == RenderMethod::kPath) return needs;
  needs.transfer = true;
  needs.volume = method == RenderMethod::kVolume;
  for (const Light& light : lights) {
    // Gaussians that stand for an environment may be sharp and soft.
    if (light.type == LightType::kEnvironment) needs.ssdf = needs.sgs = true;
    needs.ssdf |= light.is_directional() || light.sharpness > SingleScattering::kBlendFrom;
    needs.sgs |= !light.is_directional() && light.sharpness < SingleScattering::kBlendTo;
  }
  return needs;
}

}  // namespace heddle
