#include "render/fabric_shading.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace heddle {
namespace {

/// What a light sends to a cell from one direction.
struct KeptLight {
  std::uint32_t cell = 0xffffffffU;
  Vec3 axis = Vec3::Zero();  // fabric space
  CellLight light;
};

Rgb scattered_once(const SingleScatteringModel& model, const ShadingPoint& point,
                   const SeenLight& light, const DirectionPair& axis) {
  return light.is_directional ? model.directional(point, axis)
                              : model.spherical_gaussian(point, axis, light.sharpness);
}

std::unique_ptr<const Transfer> cut_transfer(const ShadingInputs& inputs) {
  if (!inputs.transfer_order) return nullptr;
  return std::make_unique<const Transfer>(
      cut_to_order(*inputs.pack->transfer, *inputs.transfer_order));
}

}  // namespace

TransferShading::TransferShading(const ShadingInputs& inputs,
                                 std::unique_ptr<const SingleScatteringModel> single,
                                 std::unique_ptr<const SingleScatteringModel> reflecting)
    : scene_(inputs.scene),
      lights_(inputs.lights),
      shapes_(inputs.shapes),
      near_shapes_(inputs.near_shapes),
      single_(std::move(single)),
      reflecting_(std::move(reflecting)),
      cut_transfer_(cut_transfer(inputs)),
      transfer_(cut_transfer_ ? cut_transfer_.get() : &*inputs.pack->transfer),
      multiple_(*transfer_, inputs.pack->materials, inputs.pack->bundle_tangent) {}

void TransferShading::shade(const GBuffer& g_buffer, const LightVisibility& visibility,
                            std::span<const std::uint32_t> fibers,
                            std::span<EyeSample> seen) const {
  const int values = 3 * transfer_->coefficients();
  std::vector<KeptLight> kept(lights_.size());
  SummedLight near_light;
  for (const std::uint32_t k : fibers) {
    const SeenFiber& fiber = g_buffer.fibers[k];
    const ShadingPoint& point = fiber.point;
    const float weight = fiber.weight;
    EyeSample& sample = seen[fiber.sample];
    IncomingField field;
    std::fill_n(field.begin(), values, 0.0F);
    bool any_nearby = false;
    bool any_near = false;
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      const LightVisibility::OfLight visible = visibility.of(k, l);
      if (!visible.at_point && !visible.nearby) continue;
      const SeenLight light = seen_from(lights_[l], fiber.hit.position);
      const DirectionPair axis = {light.axis, scene_->fabric_direction(fiber.hit, light.axis)};
      if (visible.at_point) {
        const Rgb single = weight * light.irradiance * scattered_once(*single_, point, light, axis);
        sample.single += single;
        if (reflecting_) {
          const Rgb reflected =
              weight * light.irradiance * scattered_once(*reflecting_, point, light, axis);
          sample.transmitted += single - reflected;
        }
      }
      if (!visible.nearby) continue;
      any_nearby = true;
      if (lights_[l].is_near()) {
        if (!any_near) multiple_.clear(near_light);
        any_near = true;
        sample.multiple +=
            weight * multiple_.add(light, axis.fabric, *near_shapes_, point, near_light);
        continue;
      }
      KeptLight& own = kept[l];
      if (own.cell != point.cell || own.axis != axis.fabric) {
        own.cell = point.cell;
        own.axis = axis.fabric;
        multiple_.incoming(point.cell, shapes_[l], axis.fabric, own.light);
      }
      for (int j = 0; j < values; ++j) field[j] += light.irradiance[j % 3] * own.light.harmonics[j];
      sample.multiple += weight * light.irradiance *
                         multiple_.outgoing_from_cones(own.light, shapes_[l].on_cones(),
                                                       axis.fabric, point.segment, point.material,
                                                       point.tangent.fabric, point.wo.fabric);
    }
    if (any_near) multiple_.incoming(point.cell, *near_shapes_, near_light, field);
    if (any_nearby) {
      sample.multiple +=
          weight * multiple_.outgoing(field, point.material, point.tangent.fabric, point.wo.fabric);
    }
  }
}

Rgb TransferShading::under(const SeenFiber& fiber, const SeenLight& light) const {
  const ShadingPoint& point = fiber.point;
  const DirectionPair axis = {light.axis, scene_->fabric_direction(fiber.hit, light.axis)};
  const Rgb single = light.irradiance * (light.is_directional ? single_->directional(point, axis)
                                                              : single_->spherical_gaussian(
                                                                    point, axis, light.sharpness));
  SummedLight sum;
  multiple_.clear(sum);
  const Rgb on_cones = multiple_.add(light, axis.fabric, *near_shapes_, point, sum);
  IncomingField field;
  std::fill_n(field.begin(), 3 * transfer_->coefficients(), 0.0F);
  multiple_.incoming(point.cell, *near_shapes_, sum, field);
  return single + on_cones +
         multiple_.outgoing(field, point.material, point.tangent.fabric, point.wo.fabric);
}

DualScatteringShading::DualScatteringShading(const ShadingInputs& inputs)
    : scene_(inputs.scene),
      pack_(inputs.pack),
      lights_(inputs.lights),
      dual_(*inputs.tile, inputs.pack->materials) {}

void DualScatteringShading::shade(const GBuffer& g_buffer, const LightVisibility& visibility,
                                  std::span<const std::uint32_t> fibers,
                                  std::span<EyeSample> seen) const {
  for (const std::uint32_t k : fibers) {
    EyeSample& sample = seen[g_buffer.fibers[k].sample];
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      if (!visibility.of(k, l).at_point) continue;
      const DualScattering::Parts parts =
          scattered(g_buffer.fibers[k], visibility.direction[k * lights_.size() + l]);
      const Rgb irradiance = g_buffer.fibers[k].weight *
                             seen_from(lights_[l], g_buffer.fibers[k].hit.position).irradiance;
      sample.single += irradiance * parts.single;
      sample.multiple += irradiance * parts.multiple;
    }
  }
}

DualScattering::Parts DualScatteringShading::scattered(const SeenFiber& fiber,
                                                       const Vec3& direction) const {
  const Vec3 fabric = scene_->fabric_direction(fiber.hit, direction);
  if (!pack_->light_from_both_sides && !(fabric.z() > 0)) return {};
  const ClothTiling& tiling = scene_->tiling(fiber.hit.cloth);
  const Vec3d position = tiling.in_tile(tiling.place_of(fiber.hit.fabric));
  return dual_.directional(fiber.point, position.cast<float>(), {direction, fabric});
}

}  // namespace heddle
