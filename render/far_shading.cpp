#include "render/far_shading.h"

#include <array>
#include <optional>

#include "fibers/math/light_dual.h"

namespace heddle {

struct FarShading::Seen {
  const ShellHit* hit;
  const FarForm* form;
  FarForm::View view;
};

FarShading::Radiance FarShading::under_lights(
    const ShellHit& hit, const Vec3& wo, std::span<const LightVisibility::OfLight> visible) const {
  Radiance sum;
  std::optional<Seen> seen;
  for (std::size_t l = 0; l < lights_.size(); ++l) {
    if (!visible[l].at_point && !visible[l].nearby) continue;
    if (!seen) seen = Seen{&hit, forms_[hit.part].get(), forms_[hit.part]->view(wo)};
    add(*seen, seen_from(lights_[l], hit.position), lights_[l].is_near() ? nullptr : &shapes_[l],
        visible[l], sum);
  }
  return sum;
}

FarShading::Radiance FarShading::under(const ShellHit& hit, const Vec3& wo,
                                       const SeenLight& light) const {
  Radiance sum;
  add({&hit, forms_[hit.part].get(), forms_[hit.part]->view(wo)}, light, nullptr, {true, true},
      sum);
  return sum;
}

void FarShading::add(const Seen& seen, const SeenLight& light,
                     const MultipleScattering::LightShape* shape,
                     const LightVisibility::OfLight& visible, Radiance& sum) const {
  const FarTable& table = seen.form->table();
  const Vec3 axis = scene_->smooth_fabric_direction(*seen.hit, light.axis);
  std::optional<float> sharpness;
  if (!light.is_directional) sharpness = light.sharpness;
  if (visible.at_point)
    sum.single += light.irradiance * seen.form->single(seen.view, axis, sharpness);
  if (!visible.nearby) return;
  std::array<float, sh_count(kMaxShOrder)> c_light;
  if (shape != nullptr) {
    shape->project(table.order, table.both_sides, axis, c_light.data());
  } else {
    near_shapes_->moments(table.order, table.both_sides, sharpness, axis, c_light.data());
    LightDual::of(table.order, table.both_sides).apply(c_light.data());
  }
  sum.multiple +=
      light.irradiance * seen.form->multiple(seen.view, axis, sharpness, c_light.data());
}

}  // namespace heddle
