#include "render/light_config.h"

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "render/environment_map.h"
#include "render/radiance_picture.h"

namespace heddle {
namespace {

constexpr NumberRange kBrightness{0, 1e9};
constexpr NumberRange kCoordinate{-1e6, 1e6};
constexpr NumberRange kExtentMm{0, 1e5, true};
constexpr int kMostGaussians = 128;
constexpr int kMostBrightSources = 64;

Rgb rgb_of(const TomlTable& table, std::string_view key,
           std::optional<std::array<double, 3>> fallback = {}) {
  const std::array<double, 3> value = table.number3(key, kBrightness, fallback);
  return Vec3d(value[0], value[1], value[2]).cast<float>().array();
}

Vec3d coordinates_of(const TomlTable& table, std::string_view key,
                     std::optional<std::array<double, 3>> fallback = {}) {
  const std::array<double, 3> value = table.number3(key, kCoordinate, fallback);
  return {value[0], value[1], value[2]};
}

Vec3d direction_of_light(const TomlTable& table, std::string_view key) {
  const Vec3d value = coordinates_of(table, key);
  if (value.norm() < 1e-9) table.fail(key, "expected a direction, not the zero vector");
  return value.normalized();
}

int gaussians_of(const TomlTable& table) {
  return static_cast<int>(table.integer("gaussians", 1, kMostGaussians, 16));
}

void read_environment(const TomlTable& table, Light& light,
                      std::vector<std::filesystem::path>& files) {
  light.type = LightType::kEnvironment;
  const std::filesystem::path file = table.existing_file("map");
  files.push_back(file);
  light.map = std::make_shared<const EnvironmentMap>(EnvironmentMap::read(file));
  const double turn = radians(table.number("turn_deg", {-360, 360}, 0.0));
  light.axis = Vec3d(std::cos(turn), std::sin(turn), 0).cast<float>();
  light.irradiance = rgb_of(table, "scale", std::array<double, 3>{1, 1, 1});
  light.gaussians = gaussians_of(table);
  light.bright_sources =
      static_cast<int>(table.integer("bright_sources", 0, kMostBrightSources, 0));
}

void read_rectangle(const TomlTable& table, Light& light,
                    std::vector<std::filesystem::path>& files) {
  light.type = LightType::kRectangle;
  const std::array<double, 2> size = table.number2("size_mm", kExtentMm);
  const Vec3d view = coordinates_of(table, "look_at_mm") - light.position_mm;
  if (view.norm() < 1e-9) table.fail("look_at_mm", "expected a point different from position_mm");
  const Vec3d normal = view.normalized();
  const Vec3d up = coordinates_of(table, "up", std::array<double, 3>{0, 0, 1});
  // As of a camera: rounding would decide which way is up.
  if (up.norm() < 1e-9 || normal.cross(up).norm() < 1e-3 * up.norm())
    table.fail("up", "expected a direction that is not parallel to the way to look_at_mm");
  const Vec3d right = up.cross(normal).normalized();
  light.axis = normal.cast<float>();
  light.half_right_mm = 0.5 * size[0] * right;
  light.half_up_mm = 0.5 * size[1] * normal.cross(right);
  light.gaussians = gaussians_of(table);
  if (!table.has("texture")) return;
  const std::filesystem::path file = table.existing_file("texture");
  files.push_back(file);
  light.texture = std::make_shared<const RadiancePicture>(read_radiance_picture(file));
}

}  // namespace

Light read_light(const TomlTable& table, std::vector<std::filesystem::path>& files) {
  Light light;
  const std::string type =
      table.choice("type", {"directional", "sg", "environment", "point", "sphere", "rectangle"});
  if (type == "environment") {
    read_environment(table, light, files);
    return light;
  }
  if (type == "directional" || type == "sg") {
    light.irradiance = rgb_of(table, "irradiance");
    if (type == "directional") {
      light.type = LightType::kDirectional;
      light.axis = direction_of_light(table, "direction").cast<float>();
    } else {
      light.type = LightType::kSphericalGaussian;
      light.axis = direction_of_light(table, "axis").cast<float>();
      light.sharpness = static_cast<float>(table.number("sharpness", {0, 1e6}));
    }
    return light;
  }
  light.position_mm = coordinates_of(table, "position_mm");
  if (type == "point") {
    light.type = LightType::kPoint;
    light.irradiance = rgb_of(table, "irradiance_at_1_m");
    return light;
  }
  light.irradiance = rgb_of(table, "radiance");
  if (type == "sphere") {
    light.type = LightType::kSphere;
    light.radius_mm = table.number("radius_mm", kExtentMm);
  } else {
    read_rectangle(table, light, files);
  }
  return light;
}

}  // namespace heddle
