#include "render/interactive_surface.h"

#include <cassert>
#include <utility>
#include <vector>

namespace heddle {

DistanceMaps bake_distance_maps(const ClothScene& scene, const SurfaceCloth& surface,
                                ClothSide side, const std::function<void()>& vertex_done) {
  std::vector<Mat3> frames;
  for (std::uint32_t v = 0; v < surface.vertex_count(); ++v) {
    frames.push_back(surface.vertex_frame(v, side).cast<float>());
  }
  return {frames,
          [&](std::uint32_t v, const Vec3& direction) {
            return scene.globally_visible(
                {surface.vertex_position(v), frames[v].col(2).cast<double>()}, direction);
          },
          {},
          vertex_done};
}

InteractiveSurface::InteractiveSurface(std::shared_ptr<const InteractiveMicrocylinder> model,
                                       std::shared_ptr<const DistanceMaps> face,
                                       std::shared_ptr<const DistanceMaps> back)
    : model_(std::move(model)), face_(std::move(face)), back_(std::move(back)) {}

Rgb InteractiveSurface::light(const SurfaceHit& hit, const Vec3& wo,
                              std::span<const Light> lights) const {
  const DistanceMaps& maps = hit.side == ClothSide::kFace ? *face_ : *back_;
  std::vector<float> coefficients(maps.stride(), 0.0F);
  for (std::size_t k = 0; k < 3; ++k) {
    assert(hit.vertices[k] < maps.vertex_count());
    const std::span<const float> at = maps.coefficients(hit.vertices[k]);
    const auto weight = static_cast<float>(hit.vertex_weights[k]);
    for (std::size_t j = 0; j < at.size(); ++j) coefficients[j] += weight * at[j];
  }
  return model_->shade(hit.world_from_patch, wo.cast<double>(), lights, {&maps, coefficients})
      .cast<float>();
}

}  // namespace heddle
