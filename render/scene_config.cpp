#include "render/scene_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string_view>

#include "render/environment_map.h"
#include "render/surface/surface_presets.h"

namespace heddle {

namespace {

constexpr NumberRange kAnyLength{-1e6, 1e6};
constexpr NumberRange kSize{0, 1e5, true};
constexpr NumberRange kComponent{-1e6, 1e6};
constexpr NumberRange kLight{0, 1e9};

Vec3d vector_of(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

Vec3d unit_vector(const TomlTable& table, std::string_view key) {
  const Vec3d value = vector_of(table.number3(key, kComponent));
  if (value.norm() < 1e-9) table.fail(key, "expected a direction, not the zero vector");
  return value.normalized();
}

Rgb color(const std::array<double, 3>& values) {
  return vector_of(values).cast<float>().array();
}

std::array<int, 2> whole_pixels(const TomlTable& table, std::string_view key, double min) {
  const std::array<double, 2> values = table.number2(key, {min, 16384});
  if (values[0] != std::floor(values[0]) || values[1] != std::floor(values[1])) {
    table.fail(key, "expected whole numbers of pixels");
  }
  return {static_cast<int>(values[0]), static_cast<int>(values[1])};
}

CameraConfig read_camera(const TomlTable& table) {
  CameraConfig camera;
  camera.position = vector_of(table.number3("position_mm", kAnyLength));
  camera.look_at = vector_of(table.number3("look_at_mm", kAnyLength));
  camera.up = vector_of(table.number3("up", kComponent, std::array<double, 3>{0, 0, 1}));
  camera.fov = radians(table.number("fov_deg", {0, 170, true}));
  camera.fov_axis = table.choice("fov_axis", {"horizontal", "vertical"}) == "horizontal"
                        ? FovAxis::kHorizontal
                        : FovAxis::kVertical;
  const std::array<int, 2> resolution = whole_pixels(table, "resolution_px", 1);
  camera.width = resolution[0];
  camera.height = resolution[1];
  const Vec3d view = camera.look_at - camera.position;
  if (view.norm() < 1e-9) table.fail("look_at_mm", "expected a point different from position_mm");
  // Below a milliradian the picture's upright direction would be decided by rounding.
  if (view.normalized().cross(camera.up).norm() < 1e-3 * camera.up.norm() ||
      camera.up.norm() < 1e-9) {
    table.fail("up", "expected a direction that is not parallel to the view direction");
  }
  return camera;
}

ReferenceConfig read_reference(const TomlTable& table, const CameraConfig& camera) {
  ReferenceConfig reference;
  const std::array<int, 2> corner = whole_pixels(table, "corner_px", 0);
  const std::array<int, 2> size = whole_pixels(table, "size_px", 1);
  reference.crop = {corner[0], corner[1], size[0], size[1]};
  if (corner[0] + size[0] > camera.width || corner[1] + size[1] > camera.height) {
    table.fail("size_px", "expected a rectangle inside the picture");
  }
  reference.spp = static_cast<int>(table.integer("spp", 2, 1 << 24, reference.spp));
  if (reference.spp % 2 != 0)
    table.fail("spp", "expected an even number: the path tracer keeps two half pictures");
  reference.local = table.boolean("local", false);
  return reference;
}

/// [camera] and every [[view]], which holds the same keys and a name.
ViewConfig read_view(const TomlTable& table, const SceneConfig& scene, int default_spp) {
  ViewConfig view;
  view.camera = read_camera(table);
  view.spp = static_cast<int>(table.integer("spp", 1, 1 << 24, default_spp));
  if (traces_paths(scene.method) && view.spp % 2 != 0) {
    table.fail("spp", "expected an even number: the path tracer keeps two half pictures");
  }
  if (const std::optional<TomlTable> reference = table.optional_table("reference")) {
    view.reference = read_reference(*reference, view.camera);
  }
  return view;
}

std::string read_view_name(const TomlTable& table, const SceneConfig& scene) {
  std::string name = table.string("name");
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  if (name.empty() || !std::all_of(name.begin(), name.end(), is_plain)) {
    table.fail("name", "expected letters, digits, - and _: it becomes a file name");
  }
  for (const ViewConfig& view : scene.views) {
    if (view.name == name) table.fail("name", "expected a name that no other view has");
  }
  return name;
}

Light read_light(const TomlTable& table, std::vector<std::filesystem::path>& environment_files) {
  Light light;
  const std::string type = table.choice("type", {"directional", "sg", "environment"});
  if (type == "environment") {
    light.type = LightType::kEnvironment;
    const std::filesystem::path file = table.existing_file("map");
    environment_files.push_back(file);
    light.map = std::make_shared<const EnvironmentMap>(EnvironmentMap::read(file));
    const double turn = radians(table.number("turn_deg", {-360, 360}, 0.0));
    light.axis = Vec3d(std::cos(turn), std::sin(turn), 0).cast<float>();
    light.irradiance = color(table.number3("scale", kLight, std::array<double, 3>{1, 1, 1}));
    light.gaussians = static_cast<int>(table.integer("gaussians", 1, 128, 16));
    return light;
  }
  if (type == "directional") {
    light.type = LightType::kDirectional;
    light.axis = unit_vector(table, "direction").cast<float>();
  } else {
    light.type = LightType::kSphericalGaussian;
    light.axis = unit_vector(table, "axis").cast<float>();
    light.sharpness = static_cast<float>(table.number("sharpness", {0, 1e6}));
  }
  light.irradiance = color(table.number3("irradiance", kLight));
  return light;
}

MeshFile read_mesh(const TomlTable& table) {
  MeshFile mesh;
  mesh.path = table.existing_file("mesh");
  const std::string unit = table.choice("mesh_unit", {"m", "cm", "mm"});
  mesh.mm_per_unit = unit == "m" ? 1000.0 : (unit == "cm" ? 10.0 : 1.0);
  return mesh;
}

/// A preset's name, or a file that ends in .toml, relative to the scene's folder.
SurfaceFabric read_surface(const TomlTable& table, const char* key) {
  const std::string name = table.string(key);
  const auto document = [&] {
    if (name.ends_with(".toml")) {
      const std::filesystem::path file =
          std::filesystem::path(table.document_name()).parent_path() / name;
      if (!std::filesystem::is_regular_file(file))
        table.fail(key, "no such file: " + file.string());
      return TomlTable::load(file);
    }
    const std::vector<std::string> known = surface_preset_names();
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      table.fail(key, fmt::format("expected a file that ends in .toml, or one of {}",
                                  fmt::join(known, ", ")));
    }
    return surface_preset(name);
  }();
  SurfaceFabric fabric{name, "", read_surface_model(document), {}};
  fabric.text = document.canonical_text();  // once read: a draft stands in it by its content
  if (document.string("model") == "microcylinder") {
    const MicrocylinderFabric threads = read_microcylinder_fabric(document);
    if (!threads.energy_safe) fabric.interactive = threads;
  }
  return fabric;
}

SurfaceMethod read_surface_method(const TomlTable& table, const SurfaceFabric& fabric) {
  if (table.choice("surface_method", {"sampled", "interactive"}, "sampled") == "sampled")
    return SurfaceMethod::kSampled;
  if (!fabric.interactive) {
    table.fail("surface_method",
               fmt::format("{} has no interactive form; fabrics of the model microcylinder without "
                           "energy_safe have: {}",
                           fabric.name, fmt::join(surface_preset_names("microcylinder"), ", ")));
  }
  return SurfaceMethod::kInteractive;
}

ClothConfig read_cloth(const TomlTable& table) {
  ClothConfig cloth;
  if (table.has("mesh") == table.has("flat_mm"))
    table.fail("mesh", "expected either mesh or flat_mm");
  if (table.has("mesh")) {
    cloth.mesh = read_mesh(table);
    cloth.uv_size_mm = table.number("uv_size_mm", kSize);
  } else {
    const std::array<double, 2> size = table.number2("flat_mm", kSize);
    cloth.flat_width_mm = size[0];
    cloth.flat_height_mm = size[1];
  }
  if (table.has("fabric") == table.has("surface"))
    table.fail("fabric", "expected either fabric or surface");
  if (table.has("surface")) {
    cloth.surface = read_surface(table, "surface");
    cloth.surface_method = read_surface_method(table, *cloth.surface);
  } else {
    cloth.fabric = table.existing_file("fabric");
    cloth.underlay = table.boolean("underlay", false);
    if (table.has("far_surface")) cloth.far_surface = read_surface(table, "far_surface");
  }
  return cloth;
}

}  // namespace

SceneConfig read_scene_config(const TomlTable& document) {
  SceneConfig scene;
  scene.name = document.string("name");
  scene.background = color(document.number3("background", kLight, std::array<double, 3>{0, 0, 0}));
  for (const TomlTable& table : document.tables("light"))
    scene.lights.push_back(read_light(table, scene.environment_files));
  if (scene.lights.empty()) document.fail("light", "expected at least one [[light]]");
  for (const TomlTable& table : document.tables("cloth")) scene.cloths.push_back(read_cloth(table));
  if (scene.cloths.empty()) document.fail("cloth", "expected at least one [[cloth]]");
  for (const TomlTable& table : document.tables("mesh")) scene.meshes.push_back(read_mesh(table));
  int default_spp = 16;
  if (const std::optional<TomlTable> render = document.optional_table("render")) {
    scene.method = *render_method_of(render->choice("method", render_method_names(), "exact"));
    default_spp = static_cast<int>(render->integer("spp", 1, 1 << 24, default_spp));
    scene.seed = static_cast<std::uint64_t>(render->integer("seed", 0, INT64_MAX, 1));
    scene.shadow_sigma_mm = render->optional_number("shadow_sigma_mm", {0, 1e3});
  }
  scene.views.push_back(read_view(document.table("camera"), scene, default_spp));
  for (const TomlTable& table : document.tables("view")) {
    const std::string name = read_view_name(table, scene);
    scene.views.push_back(read_view(table, scene, default_spp));
    scene.views.back().name = name;
  }
  document.finish();
  return scene;
}

}  // namespace heddle
