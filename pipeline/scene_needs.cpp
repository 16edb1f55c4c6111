#include "pipeline/scene_needs.h"

namespace heddle {

Needs needs_of(RenderMethod method, std::span<const Light> lights, const VisibilityBlend& blend) {
  Needs needs;
  if (traces_paths(method) || method == RenderMethod::kDualScattering) return needs;
  needs.transfer = true;
  needs.volume = method == RenderMethod::kVolume;
  if (method == RenderMethod::kPrt || method == RenderMethod::kTsaiShih16 ||
      method == RenderMethod::kTsaiShihFull) {
    needs.ssdf = true;
    return needs;
  }
  for (const Light& light : lights) {
    // Gaussians that stand for an environment may be sharp and soft.
    if (light.type == LightType::kEnvironment) needs.ssdf = needs.sgs = true;
    needs.ssdf |= light.is_directional() || blend.uses_distance(light.sharpness);
    needs.sgs |= !light.is_directional() && blend.uses_lobes(light.sharpness);
  }
  return needs;
}

}  // namespace heddle
