#ifndef HEDDLE_RENDER_STAND_IN_STAND_IN_H_
#define HEDDLE_RENDER_STAND_IN_STAND_IN_H_
// A fabric as a thin sheet with baked maps, for renderers that have no fibers: the layers of the
// Autodesk Standard Surface (Georgiev et al. 2019) that cloth needs, as MaterialX combines them:
//
//   specular   anisotropic GGX with the height-correlated masking of Smith, times the Fresnel term
//              of Schlick and a tint. It scatters once between facets.
//   sheen      the distribution of Estevez and Kulla 2017, over 4 (cos_i + cos_o - cos_i cos_o)
//   base       Lambertian reflection, and Lambertian transmission of a thin wall (`subsurface`)
//
// What a layer sends back to a view is lost to the layers below: 1 - E(cos_o), with E of the gloss
// as if it were isotropic with the mean roughness (paint.h). Directions in fabric space, the
// sheet's frame: x along the weft, z out of the face. Tested in
// tests/render/stand_in/stand_in_test.cpp.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fibers/math/vector.h"
#include "render/lights.h"
#include "render/stand_in/flat_maps.h"

namespace heddle {

/// What a stand-in holds besides its maps, by the names of standard_surface where it has them.
struct StandInParameters {
  double normal_strength = 1;  // factor on the x and y of the fabric's normals
  // alpha of the gloss along fibers and across them, to which the spread of normals in a texel adds
  double alpha_along = 0.2;
  double alpha_across = 0.4;
  Rgbd base_scale = Rgbd::Ones();       // base_color = base_scale * albedo, 1 at most
  double subsurface = 0;                // share of the base that goes through the sheet
  Rgbd subsurface_tint = Rgbd::Ones();  // subsurface_color = subsurface_tint * base_color
  double reflectance = 0.04;            // of the gloss at normal incidence, before its colour
  Rgbd specular_color = Rgbd::Ones();
  double sheen = 0;
  Rgbd sheen_color = Rgbd::Ones();
  double sheen_roughness = 0.3;

  /// specular_IOR: the index of refraction that has this reflectance.
  double ior() const;
};

/// What a texel's maps say.
struct StandInTexel {
  Vec3d normal;  // unit
  Vec3d along;   // unit, across the normal
  double alpha_along;
  double alpha_across;  // never below alpha_along
  Rgbd base_color;      // 0 .. 1
  double opacity;
};

/// The layers of a texel for one pair of directions, without colours; each times the light's
/// cosine.
struct StandInLayers {
  double reflected = 0;    // base
  double transmitted = 0;  // base
  double specular = 0;
  double sheen = 0;
};

class StandIn {
 public:
  /// `maps` outlives the object.
  StandIn(const FlatMaps& maps, const StandInParameters& parameters);

  const StandInParameters& parameters() const { return parameters_; }
  const FlatMaps& maps() const { return *maps_; }
  StandInTexel texel(std::size_t index) const;

  /// wi: to the light, from below where z < 0; wo: to the eye, z > 0.
  StandInLayers layers(const StandInTexel& texel, const Vec3d& wi, const Vec3d& wo) const;
  /// Radiance for light of irradiance 1 across its axis, per unit of the sheet's area.
  Rgbd radiance(const StandInTexel& texel, const Vec3d& wi, const Vec3d& wo) const;

 private:
  double sheen_albedo(double cos_out) const;

  const FlatMaps* maps_;
  StandInParameters parameters_;
  static constexpr int kSheenCells = 32;  // of cos_out in [0, 1]
  std::array<double, kSheenCells + 1> sheen_albedo_ = {};
};

/// [texel] radiance towards straight above under lights at infinity, from so many directions to
/// each.
std::vector<Rgb> picture_from_above(const StandIn& stand_in, std::span<const Light> lights,
                                    int directions, std::uint64_t seed);

/// `count` texels spread evenly over the maps.
std::vector<StandInTexel> spread_texels(const StandIn& stand_in, std::size_t count);

}  // namespace heddle

#endif  // HEDDLE_RENDER_STAND_IN_STAND_IN_H_
