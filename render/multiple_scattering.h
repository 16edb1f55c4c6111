#ifndef HEDDLE_RENDER_MULTIPLE_SCATTERING_H_
#define HEDDLE_RENDER_MULTIPLE_SCATTERING_H_
// Light that scatters more than once, from the precomputed transfer of a cell (Khungurn 2017,
// section 5.3.1), in real spherical harmonics. Everything is in fabric space. Radiance for a light
// of irradiance 1, before macroscopic shadows.
//
//   c_light[j]   directional: Y_j(w); spherical Gaussian: A_l(sharpness) Y_lm(axis)
//   c_T          = a^T c_light: the indirect light that arrives at the cell (Transfer::incoming)
//   outgoing     = c_S(theta_o) . D(R) c_T: rotated into the wo-space of the BCSDF's coefficients
//                  (x = tangent, wo in the xy plane, y > 0)
//
// A truncated expansion rings: an incoming field, and with it the outgoing radiance, can be
// slightly negative. Signs are kept, so that sums over samples have the expansion's mean. Whoever
// shows a picture may clamp it.
//
// The transfer's stored coefficients are moments of a response to light: over the upper hemisphere
// with light from the face only, else over the sphere. Light is projected onto their dual
// (fibers/math/light_dual.h). The printed form takes moments for coefficients, and the response for
// 0 below the horizon. That loses light near it, 13 % on flat gabardine under light at 70 degrees,
// and lets light from both sides leak through the cloth's plane (docs/decisions.md).
//
// A transfer may keep light on cones apart (fibers/baked/cone_transfer.h). It is then taken out of
// the harmonics and scattered on its own, per light (fibers/baked/cone_scattering.h). Lights that
// are soft enough for the harmonics do without (LightShape::OnCones).
//
// The shape of a near light changes from point to point. Its projection is interpolated between
// shapes of a few sharpnesses (LightShapes). The transfer is linear in the light, so near lights
// are summed in each colour before it, and each costs a projection only. On cones they stay apart.
// Tested in tests/render/multiple_scattering_test.cpp.

#include <array>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "fibers/baked/transfer.h"
#include "fibers/math/spherical_harmonics.h"
#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"
#include "render/lights.h"
#include "render/single_scattering.h"

namespace heddle {

/// Indirect light that arrives at a point, fabric space.
using IncomingField =
    std::array<float, 3 * sh_count(kMaxShOrder)>;  // [j][rgb]; the first sh_count(order) are used

/// What one light sends to a cell: harmonics, without what is on cones, and that.
struct CellLight {
  IncomingField harmonics;
  // [width][azimuth][rgb]
  std::array<float, ConeTransfer::kWidths * ConeTransfer::kAzimuths * 3> cones;
};

/// What several near lights send to a point, before the transfer.
struct SummedLight {
  static constexpr int kMost = sh_count(kMaxShOrder);
  // [rgb][coefficient] moments or coefficients (LightShape::moments), the first sh_count(order)
  // used
  std::array<std::array<float, kMost>, 3> all;
  std::array<std::array<float, kMost>, 3> on_cones;  // each light times its share on cones
};

class LightShapes;

class MultipleScattering {
 public:
  /// What is passed must outlive this object. bundle_tangent [segment] is needed where the transfer
  /// has cones.
  MultipleScattering(const Transfer& transfer, std::span<const BcsdfTable> materials,
                     std::span<const Vec3> bundle_tangent = {})
      : transfer_(&transfer), materials_(materials), bundle_tangent_(bundle_tangent) {}

  /// A light's shape, computed once for all samples: tables of its moments by the inclination of
  /// its axis, and for the printed form the band factors A_l. Without a sharpness: directional.
  class LightShape {
   public:
    /// How light is projected.
    enum class Projection : std::uint8_t {
      kDual,     // onto the dual of the moments
      kPrinted,  // onto the harmonics
    };
    /// may_come_from_both_sides: also for fabrics whose data take light from below, for which a
    /// Gaussian needs a table more.
    explicit LightShape(std::optional<float> sharpness, Projection projection = Projection::kDual,
                        bool may_come_from_both_sides = true);

    /// How light that stays on cones is scattered.
    struct OnCones {
      /// Share that is scattered as such; the rest is left in the harmonics. From 0 at sharpness 8
      /// to 1 at 20. On flat silk, errors of multiple scattering at sharpness 8 are 9.0 % by
      /// harmonics alone and 10.8 % by cones; at 30 they are 27 % and 14 %.
      float share = 1;
      float variance = 0;  // that the light's own width adds to a cone's
    };
    static OnCones on_cones_of(std::optional<float> sharpness, Projection projection);
    OnCones on_cones() const { return on_cones_; }

    /// Moments of a light about `axis` over the directions that the transfer knows:
    /// [sh_count(order)]. If not as printed, the dual makes c_light of them.
    void moments(int order, bool both_sides, const Vec3& axis, float* moments) const;
    /// c_light for a light about `axis` (unit, fabric space): [sh_count(order)].
    void project(int order, bool both_sides, const Vec3& axis, float* coefficients) const;

   private:
    // Rows of a table, for axis inclinations from +z in equal steps. Between them, interpolation is
    // linear, with an error below 2e-3 of the largest coefficient (measured by its test).
    static constexpr int kInclinations = 129;
    static constexpr int kColumns = sh_count(kMaxShOrder);
    /// rooted: integrals over z > 0 of the light times sqrt(z) Y_j, laid out like the tables.
    void fill_both(const std::vector<float>& rooted);
    /// Row of a table for `axis`, turned to its azimuth: [sh_count(order)].
    static void moments_by_inclination(const std::vector<float>& table, int order, const Vec3& axis,
                                       float* moments);

    bool directional_;
    Projection projection_;
    OnCones on_cones_;
    std::array<float, kMaxShOrder + 1> band_;  // [l]
    // [inclination][j] of a light whose axis lies in the xz plane; m < 0 are 0
    std::vector<float> upper_;  // integrals over z > 0 of the normalised Gaussian times Y_j
    std::vector<float> both_;   // two_sided_moments of it
  };

  /// What a light about `axis` (unit, fabric space) sends to `cell`.
  void incoming(std::uint32_t cell, const LightShape& light, const Vec3& axis,
                CellLight& result) const;

  /// Radiance towards wo from a fiber with this tangent in the field (unit vectors, fabric space).
  Rgb outgoing(const IncomingField& field, std::uint16_t material, const Vec3& tangent,
               const Vec3& wo) const;
  /// Radiance towards wo from a segment, by the part of `incoming` that one light sends on cones; 0
  /// where there is none.
  Rgb outgoing_from_cones(const CellLight& incoming, const LightShape::OnCones& light,
                          const Vec3& axis, std::uint32_t segment, std::uint16_t material,
                          const Vec3& tangent, const Vec3& wo) const;

  /// Empties a sum.
  void clear(SummedLight& sum) const;
  /// Adds a near light as seen from a point, about `axis` in fabric space. Returns what the part of
  /// it on cones sends towards point.wo.
  Rgb add(const SeenLight& light, const Vec3& axis, const LightShapes& shapes,
          const ShadingPoint& point, SummedLight& sum) const;
  /// Adds to `field` what the sum sends to `cell`, without what is on cones.
  void incoming(std::uint32_t cell, const LightShapes& shapes, const SummedLight& sum,
                IncomingField& field) const;

  /// Both, for one light.
  Rgb radiance(const LightShape& light, const Vec3& axis, std::uint32_t segment,
               std::uint16_t material, const Vec3& tangent, const Vec3& wo) const;

 private:
  const Transfer* transfer_;
  std::span<const BcsdfTable> materials_;
  std::span<const Vec3> bundle_tangent_;
};

/// Shapes of every sharpness: those of powers of the root of 2, built when first used (30 ms each),
/// and quadratic interpolation in the logarithm between. That is off by 5e-3 of the largest
/// coefficient at most (measured by its test). Thread-safe.
class LightShapes {
 public:
  using LightShape = MultipleScattering::LightShape;
  explicit LightShapes(LightShape::Projection projection, bool may_come_from_both_sides = true);

  LightShape::Projection projection() const { return projection_; }
  /// Without a sharpness: directional. Sharpnesses are clamped to kLeast .. kMost.
  void moments(int order, bool both_sides, std::optional<float> sharpness, const Vec3& axis,
               float* moments) const;

  static constexpr float kLeast = 1;
  static constexpr float kMost = 16384;

 private:
  static constexpr int kPerOctave = 2;
  static constexpr std::size_t kCount = 14 * kPerOctave + 1;
  struct Late {
    std::once_flag once;
    std::optional<LightShape> shape;
  };
  const LightShape& at(std::size_t k) const;

  LightShape::Projection projection_;
  bool may_come_from_both_sides_;
  LightShape directional_;
  mutable std::array<Late, kCount> shapes_;
};

/// Radiance towards wo from a fiber with this tangent in the field of harmonics up to `order`.
Rgb outgoing_from_field(int order, const IncomingField& field, const BcsdfTable& bcsdf,
                        const Vec3& tangent, const Vec3& wo);

}  // namespace heddle

#endif  // HEDDLE_RENDER_MULTIPLE_SCATTERING_H_
