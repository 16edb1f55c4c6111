#include "render/surface_cloth.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "fibers/math/sampling.h"

namespace heddle {
namespace {

/// Least cosine between the eye and the normal, about 89.4 degrees: the models hold nothing beyond
/// the horizon.
constexpr double kLeastCosine = 0.01;

/// The part of `direction` across z, or any direction across z where nothing is left of it.
Vec3d across(const Vec3d& direction, const Vec3d& z) {
  const Vec3d part = direction - direction.dot(z) * z;
  if (part.norm() > 1e-9 * direction.norm()) return part.normalized();
  return frame_about(z.cast<float>()).col(1).cast<double>();
}

/// Columns x, y, z of the patch frame.
Mat3d patch_frame(const Vec3d& tangent, const Vec3d& z) {
  Mat3d frame;
  frame.col(0) = across(tangent, z);
  frame.col(1) = z.cross(Vec3d(frame.col(0)));
  frame.col(2) = z;
  return frame;
}

}  // namespace

SurfaceCloth::SurfaceCloth(std::shared_ptr<const SurfaceModel> model, ClothMesh mesh, bool is_solid)
    : model_(std::move(model)),
      mesh_(std::move(mesh)),
      is_solid_(is_solid),
      tangents_(mesh_.positions.size(), Vec3d::Zero()),
      bitangents_(mesh_.positions.size(), Vec3d::Zero()) {
  for (const auto& [a, b, c] : mesh_.triangles) {
    const Vec3d edge_b = mesh_.positions[b] - mesh_.positions[a];
    const Vec3d edge_c = mesh_.positions[c] - mesh_.positions[a];
    const Eigen::Vector2d uv_b = mesh_.fabric[b] - mesh_.fabric[a];
    const Eigen::Vector2d uv_c = mesh_.fabric[c] - mesh_.fabric[a];
    // Solution of edge = du * uv.x + dv * uv.y, times the size of the determinant: weighted by the
    // area in UV.
    const double sign = uv_b.x() * uv_c.y() < uv_b.y() * uv_c.x() ? -1 : 1;
    for (const std::uint32_t vertex : {a, b, c}) {
      tangents_[vertex] += sign * (uv_c.y() * edge_b - uv_b.y() * edge_c);
      bitangents_[vertex] += sign * (uv_b.x() * edge_c - uv_c.x() * edge_b);
    }
  }
}

TriangleMesh SurfaceCloth::triangle_mesh() const {
  TriangleMesh mesh;
  for (const Vec3d& position : mesh_.positions) mesh.positions.push_back(position.cast<float>());
  mesh.triangles = mesh_.triangles;
  return mesh;
}

Mat3d SurfaceCloth::vertex_frame(std::uint32_t vertex, ClothSide side) const {
  return patch_frame(tangents_[vertex], side == ClothSide::kFace ? mesh_.normals[vertex]
                                                                 : Vec3d(-mesh_.normals[vertex]));
}

Eigen::Vector2d SurfaceCloth::fabric_at(const SurfaceHit& hit) const {
  Eigen::Vector2d fabric(0, 0);
  for (std::size_t k = 0; k < 3; ++k)
    fabric += hit.vertex_weights[k] * mesh_.fabric[hit.vertices[k]];
  return fabric;
}

SurfaceHit SurfaceCloth::hit(std::uint32_t triangle, double u, double v, const Vec3& ray_direction,
                             double footprint_mm) const {
  const auto& [a, b, c] = mesh_.triangles[triangle];
  const auto interpolate = [&, a = a, b = b, c = c](const auto& values) {
    return ((1 - u - v) * values[a] + u * values[b] + v * values[c]).eval();
  };
  const Vec3d wo = -ray_direction.cast<double>();
  SurfaceHit hit;
  hit.model = model_.get();
  hit.position = interpolate(mesh_.positions);
  hit.normal = (mesh_.positions[b] - mesh_.positions[a])
                   .cross(mesh_.positions[c] - mesh_.positions[a])
                   .normalized();
  if (hit.normal.dot(wo) < 0) hit.normal = -hit.normal;

  Vec3d z = interpolate(mesh_.normals).normalized();
  hit.side = z.dot(hit.normal) < 0 ? ClothSide::kBack : ClothSide::kFace;
  if (hit.side == ClothSide::kBack) z = -z;
  const double cosine = z.dot(wo);
  if (cosine < kLeastCosine) z = (z + (kLeastCosine - cosine) * wo).normalized();
  hit.world_from_patch = patch_frame(interpolate(tangents_), z);
  hit.vertices = {a, b, c};
  hit.vertex_weights = {1 - u - v, u, v};

  const Eigen::Vector2d fabric = interpolate(mesh_.fabric);
  const double along_y =
      interpolate(bitangents_).dot(hit.world_from_patch.col(1)) < 0 ? -fabric.y() : fabric.y();
  hit.point = {Vec2(static_cast<float>(fabric.x()), static_cast<float>(along_y)),
               static_cast<float>(footprint_mm)};
  return hit;
}

Rgb light_by_shadow_rays(const SurfaceHit& hit, const Vec3& wo, std::span<const Light> lights,
                         LightEstimator estimator, RandomStream& random, const OpenTowards& open) {
  const SurfaceModel& model = *hit.model;
  const Mat3d patch_from_world = hit.world_from_patch.transpose();
  const Vec3d local_out = patch_from_world * wo.cast<double>();
  Rgb sum = Rgb::Zero();
  for (const Light& light : lights) {
    const LightSample incoming = sample_light(light, hit.position, random);
    const Vec3d local_in = patch_from_world * incoming.direction.cast<double>();
    Rgb value = incoming.weight * model.reflected(hit.point, local_in, local_out).cast<float>();
    if ((value == 0).all()) continue;
    if (estimator == LightEstimator::kCombined && !light.is_delta()) {
      value *= power_heuristic(
          incoming.pdf, model.pdf(hit.point, local_in.cast<float>(), local_out.cast<float>()));
    }
    if (open(incoming.direction, incoming.distance)) sum += value;
  }
  return sum;
}

Rgb surface_direct_light(const SurfaceHit& hit, const Vec3& wo, std::span<const Light> lights,
                         LightEstimator estimator, RandomStream& random, const OpenTowards& open) {
  Rgb sum = Rgb::Zero();
  if (estimator != LightEstimator::kEscapes)
    sum = light_by_shadow_rays(hit, wo, lights, estimator, random, open);
  const bool any_to_meet = std::any_of(lights.begin(), lights.end(),
                                       [](const Light& light) { return !light.is_delta(); });
  if (!any_to_meet || estimator == LightEstimator::kShadowRays) return sum;

  const Vec3d local_out = hit.world_from_patch.transpose() * wo.cast<double>();
  const std::optional<SurfaceSample> sample =
      hit.model->sample(hit.point, local_out.cast<float>(), random);
  if (!sample) return sum;
  const Vec3 direction = (hit.world_from_patch * sample->wi.cast<double>()).cast<float>();
  const auto weight = [&](float pdf) {
    return estimator == LightEstimator::kCombined ? power_heuristic(sample->pdf, pdf) : 1.0F;
  };
  Rgb radiance = Rgb::Zero();  // from infinity
  for (const Light& light : lights) {
    if (!light.is_near()) {
      radiance += weight(light_pdf(light, direction)) * light_radiance(light, direction);
      continue;
    }
    const std::optional<MetLight> met = meet_light(light, hit.position, direction);
    if (!met) continue;
    const Rgb value = sample->weight * (weight(met->pdf) * met->radiance);
    if (!(value == 0).all() && open(direction, met->distance)) sum += value;
  }
  const Rgb value = sample->weight * radiance;
  if (!(value == 0).all() && open(direction, std::numeric_limits<double>::infinity())) sum += value;
  return sum;
}

}  // namespace heddle
