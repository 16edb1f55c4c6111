#ifndef HEDDLE_RENDER_LIGHT_VISIBILITY_H_
#define HEDDLE_RENDER_LIGHT_VISIBILITY_H_
// Second pass of the precomputed methods: which lights reach what a G-buffer holds of fibers and
// far forms, past shells (as solids) and meshes. Shadows between fibers are not its matter. It
// knows where lights are and how wide, not how bright.
//
// Two shadow rays for each light. The first starts on the shell's surface straight above the hit,
// or below it where the light is under the cloth; it serves single scattering. The second starts
// from a point that is moved along the cloth by a 2D Gaussian; its mean is the smoothed visibility
// of multiple scattering. For a spherical Gaussian both go in one direction drawn from the light,
// and the mean is a soft shadow. For a sphere or rectangle both end at one point drawn from it, for
// a point light at that. Where the fabric takes light from its face only, that direction is
// drawn from the part of the light on the face's side, since precomputed data hold no other light.
// Tested in tests/render/precomputed_renderer_test.cpp.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"
#include "render/cloth_scene.h"
#include "render/g_buffer.h"
#include "render/lights.h"

namespace heddle {

struct LightVisibility {
  /// Of one light at one sample.
  struct OfLight {
    bool at_point = false;
    bool nearby = false;  // at the point moved along the cloth
  };
  std::size_t lights = 0;
  std::vector<OfLight> visible;  // [GBuffer::fibers, then GBuffer::far][light]
  // [GBuffer::fibers][light] drawn from the light, for methods that take all of it from there; set
  // where the light is visible at the point. Empty for other methods.
  std::vector<Vec3> direction;

  const OfLight& of(std::size_t seen, std::size_t light) const {
    return visible[seen * lights + light];
  }
};

/// All that visibility takes from lights: equal texts, equal visibility.
std::string visibility_text(std::span<const Light> lights);

class LightVisibilityPass {
 public:
  /// What visibility depends on of one part of the scene.
  struct Part {
    bool light_from_both_sides;  // data for it, and nothing below that keeps it away
    double shadow_sigma_mm;      // deviation of the Gaussian along the cloth
  };
  /// parts: [part of the scene]. lights: no environments. The scene and the lights
  /// outlive the object. draw_directions: LightVisibility::direction is wanted.
  LightVisibilityPass(const ClothScene& scene, std::vector<Part> parts,
                      std::span<const Light> lights, bool draw_directions, std::uint64_t seed);

  LightVisibility run(const GBuffer& g_buffer) const;
  /// What reaches one place: visible [light].
  void at(const ShellHit& hit, RandomStream& random,
          std::span<LightVisibility::OfLight> visible) const;

 private:
  /// Appends what reaches one hit.
  void look(const GBuffer& g_buffer, std::uint32_t sample, const ShellHit& hit,
            LightVisibility& result) const;
  /// `redraw`: of directions that lie behind the cloth.
  LightVisibility::OfLight find(const ShellHit& hit, const Light& light, RandomStream& random,
                                RandomStream& redraw) const;

  const ClothScene* scene_;
  std::vector<Part> parts_;
  std::span<const Light> lights_;
  bool draw_directions_;
  std::uint64_t seed_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_LIGHT_VISIBILITY_H_
