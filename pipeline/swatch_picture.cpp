#include "pipeline/swatch_picture.h"

#include <cmath>
#include <utility>

#include "formats/image_file.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/lights.h"
#include "render/path_tracer.h"
#include "render/tone_map.h"

namespace heddle {
namespace {

constexpr double kViewDegrees = 30;
constexpr double kDistance = 400;  // mm; as good as parallel for swatches of some millimetres
// The swatch reaches further than the picture, so that no rim is seen or lights it.
constexpr double kSizeOfPicture = 1.6;
constexpr double kMarginMm = 4;

Light soft(const Vec3& axis, float sharpness, float irradiance) {
  Light light;
  light.axis = axis.normalized();
  light.irradiance = Rgb::Constant(irradiance);
  light.type = LightType::kSphericalGaussian;
  light.sharpness = sharpness;
  return light;
}

/// A white surface under these shows about 0.8.
std::vector<Light> lights_of_swatch(bool both_sides) {
  std::vector<Light> lights = {soft(Vec3(0.6F, 0.3F, 1), 60, 2.1F),
                               soft(Vec3(-0.5F, 0.4F, 1), 6, 1.1F)};
  if (both_sides) lights.push_back(soft(Vec3(0.1F, 0.4F, -1), 3, 2.0F));
  return lights;
}

}  // namespace

std::vector<Rgb> trace_swatch(const std::shared_ptr<const TileScene>& tile, bool both_sides,
                              const SwatchView& view, std::uint64_t seed,
                              const std::function<void(double)>& progress) {
  const double size = kSizeOfPicture * view.width_mm + kMarginMm;
  std::vector<ClothPiece> pieces;
  pieces.push_back({tile, flat_cloth(size, size), !both_sides});
  const ClothScene scene(std::move(pieces), {});
  const std::vector<BcsdfTable> materials = scene_materials(scene);
  const std::vector<Light> lights = lights_of_swatch(both_sides);

  CameraConfig config;
  config.position =
      kDistance * Vec3d(0, -std::sin(radians(kViewDegrees)), std::cos(radians(kViewDegrees)));
  config.fov = 2 * std::atan(0.5 * view.width_mm / kDistance);
  config.width = config.height = view.pixels;
  const Camera camera(config);
  PathTracerSettings settings;
  settings.seed = seed;
  const PathTracer tracer(scene, materials, lights, Rgb::Constant(both_sides ? 0.6F : 0.0F),
                          settings);
  return trace_picture(tracer, camera, camera.full_frame(), seed,
                       SampleBudget{.spp = view.spp, .seconds = {}}, progress)
      .beauty;
}

void write_swatch(const std::filesystem::path& path, const std::vector<Rgb>& colors, int pixels) {
  write_png(path, pixels, pixels, tone_map(colors, 0));
}

}  // namespace heddle
