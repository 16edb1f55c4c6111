#ifndef HEDDLE_RENDER_FAR_FORM_H_
#define HEDDLE_RENDER_FAR_FORM_H_
// A fabric's far form (fibers/baked/far_table.h) under the lights of a scene. The tables hold
// radiance under directional light. Under a Gaussian light it is their mean over the light's
// directions. Such means are kept for a ladder of widths, each twice as wide in variance as the one
// before, built when first used. Between two of them the radiance is mixed so that the light's mean
// cosine to its axis is right. Tested in tests/render/far_form_test.cpp.

#include <array>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "fibers/baked/far_table.h"
#include "fibers/math/vector.h"
#include "render/multiple_scattering.h"

namespace heddle {

/// One of a table's two tables by the light's direction, and its means over Gaussian lights.
class FarLadder {
 public:
  /// values: [view][light][rgb] of the table, which outlives the object.
  FarLadder(const FarTable& table, const std::vector<Half>& values)
      : table_(&table), values_(&values) {}

  /// Radiance for a light of irradiance 1 about `axis` (unit, fabric space). Thread-safe.
  Rgb radiance(const DirectionGrid::Place& view, const Vec3& axis,
               std::optional<float> sharpness) const;

 private:
  // From the variance of a cell of the table's grid to that of light from everywhere.
  static constexpr std::size_t kWidths = 14;
  struct Means {
    DirectionGrid grid{1};     // of the axes, which may lie below the horizon
    std::vector<Half> values;  // [view][axis][rgb]
  };
  struct Late {
    std::once_flag once;
    Means means;
  };
  float sharpness_of(std::size_t width) const;
  const Means& at(std::size_t width) const;
  Means mean_over(std::size_t width) const;
  Rgb directional(const DirectionGrid::Place& view, const Vec3& axis) const;
  Rgb wide(std::size_t width, const DirectionGrid::Place& view, const Vec3& axis) const;

  const FarTable* table_;
  const std::vector<Half>* values_;
  mutable std::array<Late, kWidths> means_;
};

class FarForm {
 public:
  /// The table outlives the object.
  explicit FarForm(const FarTable& table);

  const FarTable& table() const { return *table_; }
  /// What is seen from a direction towards the eye (unit, fabric space).
  struct View {
    DirectionGrid::Place place;
    std::array<float, 3 * sh_count(kMaxShOrder)> multiple;  // [coefficient][rgb]
    std::array<float, 3 * sh_count(kMaxShOrder)> on_cones;
  };
  View view(const Vec3& wo) const;

  /// For a light of irradiance 1 about `axis`, directional where it has no sharpness. c_light: its
  /// harmonics, LightShape::project.
  Rgb single(const View& view, const Vec3& axis, std::optional<float> sharpness) const;
  Rgb multiple(const View& view, const Vec3& axis, std::optional<float> sharpness,
               const float* c_light) const;

 private:
  const FarTable* table_;
  FarLadder single_;
  std::optional<FarLadder> cones_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_FAR_FORM_H_
