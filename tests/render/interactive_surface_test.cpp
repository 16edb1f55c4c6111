#include "render/interactive_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "render/path_tracer.h"
#include "render/precomputed_renderer.h"
#include "render/surface/surface_presets.h"
#include "tests/support/pictures.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

MicrocylinderFabric linen_preset() {
  const TomlTable document = surface_preset("linen-plain");
  return read_microcylinder_fabric(document);
}

std::shared_ptr<const InteractiveMicrocylinder> interactive_linen() {
  static const auto model = [] {
    InteractiveSettings settings;
    settings.table.columns = 16;
    settings.table.rows = 8;
    return std::make_shared<const InteractiveMicrocylinder>(linen_preset(), settings);
  }();
  return model;
}

std::shared_ptr<const InteractiveSurface> bake(const ClothScene& scene, std::size_t surface) {
  const auto maps = [&](ClothSide side) {
    return std::make_shared<const DistanceMaps>(
        bake_distance_maps(scene, scene.surfaces()[surface], side));
  };
  return std::make_shared<const InteractiveSurface>(interactive_linen(), maps(ClothSide::kFace),
                                                    maps(ClothSide::kBack));
}

ClothMesh lifted(ClothMesh mesh, const Vec3d& by) {
  for (Vec3d& position : mesh.positions) position += by;
  return mesh;
}

Light gaussian(const Vec3& axis, float sharpness) {
  return {LightType::kSphericalGaussian, axis.normalized(), sharpness, Rgb(1, 2, 3)};
}

/// Relative RMSE of the interactive picture of all surfaces against a path-traced one.
double picture_error(const ClothScene& scene, const std::vector<Light>& lights,
                     const Camera& camera, int spp) {
  PrecomputedSettings settings;
  for (std::size_t k = 0; k < scene.surfaces().size(); ++k)
    settings.interactive.push_back(bake(scene, k));
  const PrecomputedRenderer renderer(scene, {}, lights, Rgb(0, 0, 0), settings);
  const PathTracer tracer(scene, {}, lights, Rgb(0, 0, 0), {});
  const PixelRect all = {0, 0, camera.width(), camera.height()};
  const FrameBuffers ours = shade_picture(renderer, camera, all, 8, test::no_progress);
  const FrameBuffers truth = trace_picture(tracer, camera, all, 7, {spp, {}}, test::no_progress);
  double error = 0;
  double mean = 0;
  for (std::size_t k = 0; k < ours.pixel_count(); ++k) {
    EXPECT_TRUE((ours.multiple[k] == 0).all());
    error += static_cast<double>(
        ((ours.beauty[k] - truth.half0[k]) * (ours.beauty[k] - truth.half1[k])).mean());
    mean += static_cast<double>(truth.beauty[k].mean());
  }
  const auto count = static_cast<double>(ours.pixel_count());
  return std::sqrt(std::max(error, 0.0) / count) / (mean / count);
}

TEST(InteractiveSurfaceAgreement, APictureIsNearThePathTracedOne) {
  // A roof over a part of the cloth; 8 times 8 pixels of the open part, its penumbra and its
  // shadow.
  const TriangleMesh roof{{Vec3(0.5F, -3, 1), Vec3(4, -3, 1), Vec3(4, 3, 1), Vec3(0.5F, 3, 1)},
                          {{0, 1, 2}, {0, 2, 3}}};
  const std::vector<SurfaceCloth> cloth = {
      {read_surface_model(surface_preset("linen-plain")), flat_cloth(4, 4, 24)}};
  const ClothScene open({}, {}, cloth);
  const ClothScene covered({}, {roof}, cloth);
  const std::vector<Light> lights = {gaussian({-0.3F, 0.2F, 1}, 60),
                                     gaussian({0.6F, -0.6F, 1}, 200)};
  const Camera camera = test::camera_from({-0.5, 0.3, 40}, 2, 8);
  const double in_the_open = picture_error(open, lights, camera, 1024);
  const double under_the_roof = picture_error(covered, lights, camera, 1024);
  std::printf("  relative RMSE: open %.4f, under a roof %.4f\n", in_the_open, under_the_roof);
  EXPECT_LT(in_the_open, 0.05);
  EXPECT_LT(under_the_roof, 0.12);
}

TEST(InteractiveSurface, BothSidesShowTheFaceWithTheirOwnShadows) {
  // Something large below the cloth: it hides light from below only.
  const TriangleMesh floor{{Vec3(-90, -90, -0.5F), Vec3(90, -90, -0.5F), Vec3(0, 90, -0.5F)},
                           {{0, 1, 2}}};
  const std::vector<SurfaceCloth> cloth = {
      {read_surface_model(surface_preset("linen-plain")), flat_cloth(4, 4, 4)}};
  const ClothScene scene({}, {floor}, cloth);
  const ClothScene open({}, {}, cloth);
  const auto light_on = [](const ClothScene& in, float side, const Light& light) {
    const EyeRay ray{{0.1, 0.2, static_cast<double>(side) * 0.3}, Vec3(0, 0, -side)};
    const std::optional<MeshHit> mesh = in.first_mesh(ray.origin, ray.direction);
    const SurfaceHit hit = mesh->surface->hit(mesh->triangle, mesh->u, mesh->v, ray.direction, 0);
    EXPECT_EQ(hit.side, side > 0 ? ClothSide::kFace : ClothSide::kBack);
    return bake(in, 0)->light(hit, -ray.direction, {&light, 1});
  };
  const Light above = gaussian({0.2F, 0, 1}, 50);
  const Light below = gaussian({0.2F, 0, -1}, 50);
  const Light sun = {LightType::kDirectional, Vec3(0.2F, 0, -1).normalized(), 0, Rgb(1, 2, 3)};
  const Rgb face = light_on(scene, 1, above);
  EXPECT_GT(face.minCoeff(), 0.01F);
  EXPECT_LT(light_on(scene, -1, below).maxCoeff(), 1e-3F * face.minCoeff());
  EXPECT_EQ(light_on(scene, -1, sun).maxCoeff(), 0);
  EXPECT_GT(light_on(open, -1, sun).minCoeff(), 0.01F);
  // The model is symmetric about its threads, the light lies in the plane of one.
  EXPECT_LT((light_on(open, -1, below) - face).abs().maxCoeff(), 0.01F * face.maxCoeff());
}

TEST(InteractiveSurface, ShellsOfFibersHideLight) {
  const auto tile = std::make_shared<TileScene>(single_fiber(test_cotton()));
  const ClothScene scene(
      {{tile, lifted(flat_cloth(30, 30), {0, 0, 1})}}, {},
      {{read_surface_model(surface_preset("linen-plain")), flat_cloth(2, 2, 2)}});
  const DistanceMaps maps = bake_distance_maps(scene, scene.surfaces()[0], ClothSide::kFace);
  EXPECT_LT(maps.evaluate(maps.coefficients(4), Vec3d(0, 0, 1)).distance, -radians(60));
}

}  // namespace
}  // namespace heddle
