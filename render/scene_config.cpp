#include "render/scene_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <map>
#include <string_view>

#include "formats/image_file.h"
#include "formats/numbered_file.h"
#include "formats/srgb_color.h"
#include "render/light_config.h"
#include "render/surface/surface_presets.h"

namespace heddle {

namespace {

constexpr NumberRange kAnyLength{-1e6, 1e6};
constexpr NumberRange kSize{0, 1e5, true};
constexpr NumberRange kComponent{-1e6, 1e6};
constexpr NumberRange kLight{0, 1e9};
constexpr int kMaxPatternExtent = 4096;  // blocks
constexpr std::size_t kMaxPatternFabrics = 256;
// A layer of each; files of ours may have 1024 channels.
constexpr std::size_t kMostLightGroups = 64;

Vec3d vector_of(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
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

bool is_plain_name(std::string_view name) {
  return std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  });
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
  view.camera_of_frame_0 = view.camera = read_camera(table);
  view.turn_per_frame = radians(table.number("turntable_deg_per_frame", {-360, 360}, 0.0));
  view.spp = static_cast<int>(table.integer("spp", 1, 1 << 24, default_spp));
  if (traces_paths(scene.method) && view.spp % 2 != 0) {
    table.fail("spp", "expected an even number: the path tracer keeps two half pictures");
  }
  if (const std::optional<TomlTable> reference = table.optional_table("reference")) {
    view.reference = read_reference(*reference, view.camera);
  }
  return view;
}

/// Nothing where the key is absent.
std::string read_matte_name(const TomlTable& table) {
  if (!table.has("name")) return "";
  std::string name = table.string("name");
  if (name.empty() || !is_plain_name(name))
    table.fail("name", "expected letters, digits, - and _: it becomes the name of a matte");
  return name;
}

std::string read_view_name(const TomlTable& table, const SceneConfig& scene) {
  std::string name = table.string("name");
  if (name.empty() || !is_plain_name(name)) {
    table.fail("name", "expected letters, digits, - and _: it becomes a file name");
  }
  for (const ViewConfig& view : scene.views) {
    if (view.name == name) table.fail("name", "expected a name that no other view has");
  }
  return name;
}

Placement read_placement(const TomlTable& table) {
  constexpr std::array<double, 3> kNone = {0, 0, 0};
  Placement placement;
  placement.scale = table.number("scale", {0, 1000, true}, 1.0);
  placement.rotate = vector_of(table.number3("rotate_deg", {-360, 360}, kNone)) * radians(1);
  placement.translate_mm = vector_of(table.number3("translate_mm", kAnyLength, kNone));
  return placement;
}

MeshFile read_mesh(const TomlTable& table) {
  MeshFile mesh;
  mesh.path = table.file_name("mesh");
  std::error_code ignored;
  if (is_numbered(mesh.path) && !std::filesystem::is_regular_file(mesh.path, ignored)) {
    mesh.numbered = mesh.path;
  } else {
    mesh.path = table.existing_file("mesh");
  }
  const std::string unit = table.choice("mesh_unit", {"m", "cm", "mm"});
  mesh.mm_per_unit = unit == "m" ? 1000.0 : (unit == "cm" ? 10.0 : 1.0);
  if (table.has("group")) mesh.group = table.string("group");
  mesh.subdivide = static_cast<int>(table.integer("subdivide", 0, 8, 0));
  mesh.subdivide_px = table.optional_number("subdivide_px", {0.1, 1e4});
  if (mesh.subdivide > 0 && mesh.subdivide_px)
    table.fail("subdivide_px", "expected only one of subdivide and subdivide_px");
  mesh.sharp_corners = table.choice("subdivide_corners", {"sharp", "round"}, "sharp") == "sharp";
  mesh.near_vertices = table.choice("subdivide_vertices", {"cage", "near"}, "cage") == "near";
  mesh.placement = read_placement(table);
  mesh.table = table;
  return mesh;
}

Rgbd color_of(const TomlTable& table, const char* key) {
  const std::array<double, 3> values = table.color(key);
  return {values[0], values[1], values[2]};
}

MeshConfig read_solid(const TomlTable& table) {
  MeshConfig mesh{read_mesh(table), nullptr};
  const char* const of_gloss[] = {"roughness", "reflectance"};
  if (!table.has("color")) {
    for (const char* key : of_gloss) {
      if (table.has(key)) table.fail(key, "expected color beside it: without, the mesh is black");
    }
    return mesh;
  }
  PaintConfig paint;
  paint.color = color_of(table, "color");
  paint.roughness = table.optional_number("roughness", {PaintConfig::kLeastRoughness, 1});
  if (table.has("reflectance")) {
    if (!paint.roughness)
      table.fail("reflectance", "expected roughness beside it: without, the mesh has no gloss");
    paint.reflectance = color_of(table, "reflectance");
  }
  mesh.paint = std::make_shared<const Paint>(paint);
  return mesh;
}

FabricPlacement read_fabric_placement(const TomlTable& table) {
  FabricPlacement fabric;
  const std::array<double, 2> tiling = table.number2("uv_tiling", {0.001, 1000}, {{1, 1}});
  fabric.tiling = {tiling[0], tiling[1]};
  fabric.turn = radians(table.number("uv_turn_deg", {-360, 360}, 0.0));
  const std::array<double, 2> offset = table.number2("uv_offset_mm", {-1e5, 1e5}, {{0, 0}});
  fabric.offset_mm = {offset[0], offset[1]};
  return fabric;
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

/// Two whole numbers.
std::array<int, 2> whole_numbers(const TomlTable& table, std::string_view key,
                                 const NumberRange& range, std::array<double, 2> fallback) {
  const std::array<double, 2> values = table.number2(key, range, fallback);
  if (values[0] != std::floor(values[0]) || values[1] != std::floor(values[1]))
    table.fail(key, "expected whole numbers");
  return {static_cast<int>(values[0]), static_cast<int>(values[1])};
}

std::uint64_t read_seed(const TomlTable& table) {
  return static_cast<std::uint64_t>(table.integer("seed", 0, INT64_MAX, 1));
}

BlocksConfig read_blocks(const TomlTable& table) {
  BlocksConfig blocks;
  blocks.size_repeats = whole_numbers(table, "size_repeats", {1, 64}, {1, 1});
  if (table.choice("order", {"aligned", "scattered"}, "aligned") == "scattered")
    blocks.order = BlockOrder::kScattered;
  blocks.seed = read_seed(table);
  return blocks;
}

std::string hex_of(const std::uint8_t* rgb) {
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

PatternConfig read_pattern(const TomlTable& table) {
  PatternConfig pattern;
  std::map<std::string, std::uint16_t> fabric_of;  // by colour
  for (const TomlTable& fabric : table.tables("fabric")) {
    const auto color = bytes_of_hex(fabric.string("color"));
    if (!color) fabric.fail("color", "expected a colour of the picture as \"#rrggbb\"");
    if (!fabric_of
             .emplace(hex_of(color->data()), static_cast<std::uint16_t>(pattern.fabrics.size()))
             .second)
      fabric.fail("color", "expected a colour that no other fabric of the pattern has");
    pattern.fabrics.push_back(fabric.existing_file("file"));
  }
  if (pattern.fabrics.empty() || pattern.fabrics.size() > kMaxPatternFabrics) {
    table.fail("fabric",
               fmt::format("expected 1 to {} [[cloth.pattern.fabric]]", kMaxPatternFabrics));
  }
  pattern.picture = table.existing_file("picture");
  pattern.corner_blocks =
      whole_numbers(table, "corner_blocks", {-kMaxPatternExtent, kMaxPatternExtent}, {0, 0});
  if (table.choice("borders", {"cut", "woven"}, "cut") == "woven")
    pattern.borders = PatternBorders::kWoven;
  pattern.sample_blocks = static_cast<int>(table.integer("sample_blocks", 4, 4096, 64));
  const RgbPicture picture = read_png(pattern.picture, kMaxPatternExtent);
  pattern.columns = picture.width;
  pattern.rows = picture.height;
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      const std::size_t pixel = static_cast<std::size_t>(picture.height - 1 - row) *
                                    static_cast<std::size_t>(picture.width) +
                                static_cast<std::size_t>(column);
      const std::string color = hex_of(&picture.rgb[3 * pixel]);
      const auto found = fabric_of.find(color);
      if (found == fabric_of.end()) {
        table.fail("picture",
                   fmt::format("expected a picture of the colours of the pattern's fabrics; column "
                               "{}, row {} from the top, is {}",
                               column, picture.height - 1 - row, color));
      }
      pattern.blocks.push_back(found->second);
    }
  }
  return pattern;
}

YarnDriftConfig read_yarn_drift(const TomlTable& table) {
  YarnDriftConfig drift;
  drift.spacing_rms = 0.01 * table.number("spacing_rms_percent", {0, 15});
  drift.across_mm = table.number("across_mm", {0.01, 1e4});
  drift.along_mm = table.number("along_mm", {0.01, 1e5});
  if (drift.along_mm < drift.across_mm)
    table.fail("along_mm", "expected a length that is not below across_mm");
  drift.seed = read_seed(table);
  return drift;
}

YarnTintConfig read_yarn_tint(const TomlTable& table) {
  YarnTintConfig tint;
  tint.rms = 0.01 * table.number("rms_percent", {0, 100});
  tint.correlation_yarns = table.number("correlation_yarns", {0, 64}, 0.0);
  tint.seed = read_seed(table);
  return tint;
}

/// Fibers, in place of a surface.
void read_fibers(const TomlTable& table, ClothConfig& cloth) {
  if (const std::optional<TomlTable> pattern = table.optional_table("pattern")) {
    cloth.pattern = read_pattern(*pattern);
    cloth.blocks.emplace();
    cloth.fabric = cloth.pattern->fabrics.front();
  } else {
    cloth.fabric = table.existing_file("fabric");
    if (table.has("far_surface")) cloth.far_surface = read_surface(table, "far_surface");
  }
  if (const std::optional<TomlTable> blocks = table.optional_table("blocks"))
    cloth.blocks = read_blocks(*blocks);
  if (const std::optional<TomlTable> drift = table.optional_table("yarn_drift"))
    cloth.yarn_drift = read_yarn_drift(*drift);
  if (const std::optional<TomlTable> tint = table.optional_table("yarn_tint"))
    cloth.yarn_tint = read_yarn_tint(*tint);
  cloth.underlay = table.boolean("underlay", false);
  cloth.thickness = table.number("thickness", {0.01, 100}, 1.0);
}

ClothConfig read_cloth(const TomlTable& table) {
  ClothConfig cloth;
  cloth.name = read_matte_name(table);
  if (table.has("mesh") == table.has("flat_mm"))
    table.fail("mesh", "expected either mesh or flat_mm");
  if (table.has("mesh")) {
    cloth.mesh = read_mesh(table);
    cloth.uv_size_mm = table.number("uv_size_mm", kSize);
    cloth.on_uvs = read_fabric_placement(table);
  } else {
    cloth.flat_placement = read_placement(table);
    const std::array<double, 2> size = table.number2("flat_mm", kSize);
    cloth.flat_width_mm = size[0];
    cloth.flat_height_mm = size[1];
  }
  const int choices = (table.has("fabric") ? 1 : 0) + (table.has("surface") ? 1 : 0) +
                      (table.has("pattern") ? 1 : 0);
  if (choices != 1) table.fail("fabric", "expected one of fabric, surface and pattern");
  if (table.has("surface")) {
    cloth.surface = read_surface(table, "surface");
    cloth.surface_method = read_surface_method(table, *cloth.surface);
  } else {
    read_fibers(table, cloth);
  }
  return cloth;
}

/// Lights and the groups that they name, one without a name where none does.
void read_lights(const TomlTable& document, SceneConfig& scene) {
  bool any_named = false;
  std::vector<std::string> names;  // [light]
  for (const TomlTable& table : document.tables("light")) {
    scene.lights.push_back(read_light(table, scene.light_files));
    const std::string& name = names.emplace_back(table.string("group", "rest"));
    any_named = any_named || table.has("group");
    const bool begins_well =
        !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) != 0;
    if (!begins_well || !is_plain_name(name) || name.find('-') != std::string::npos) {
      table.fail("group",
                 "expected letters, digits and _, a letter first: it becomes the name of a layer");
    }
  }
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string name = any_named ? names[k] : "";
    const auto known = std::find(scene.light_groups.begin(), scene.light_groups.end(), name);
    scene.lights[k].group = static_cast<std::uint16_t>(known - scene.light_groups.begin());
    if (known == scene.light_groups.end()) scene.light_groups.push_back(name);
  }
  if (scene.light_groups.size() > kMostLightGroups)
    document.fail("light", fmt::format("expected at most {} groups", kMostLightGroups));
}

template <std::size_t n>
std::vector<std::string_view> names_of(const std::string_view (&names)[n]) {
  return {std::begin(names), std::end(names)};
}

PixelFilter read_filter(const TomlTable& render) {
  const std::string name = render.choice("filter", names_of(kFilterNames), "box");
  const auto shape = static_cast<std::size_t>(
      std::find(std::begin(kFilterNames), std::end(kFilterNames), name) - std::begin(kFilterNames));
  const std::optional<double> width = render.optional_number("filter_width_px", {0.1, 16});
  return {static_cast<FilterShape>(shape), width.value_or(kFilterWidths[shape])};
}

LayerChoice read_layers(const TomlTable& render) {
  LayerChoice layers;
  for (const std::string& name : render.optional_strings("layers", 1, 3)) {
    if (name == "lobes") {
      layers.lobes = true;
    } else if (name == "surface") {
      layers.surface = true;
    } else if (name == "cryptomatte") {
      layers.cryptomatte = true;
    } else {
      render.fail("layers", "expected some of lobes, surface and cryptomatte; got " + name);
    }
  }
  return layers;
}

/// The camera carried about its up, through what it looks at.
CameraConfig turned(const CameraConfig& camera, double angle) {
  CameraConfig result = camera;
  result.position = camera.look_at + Eigen::AngleAxisd(angle, camera.up.normalized()) *
                                         (camera.position - camera.look_at);
  return result;
}

void show_frame_of(MeshFile& mesh, int frame) {
  if (mesh.numbered.empty()) return;
  mesh.path = numbered_path(mesh.numbered, frame);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(mesh.path, ignored)) return;
  mesh.table->fail(
      "mesh", fmt::format("there is no file '{}', which is frame {}", mesh.path.string(), frame));
}

}  // namespace

std::vector<std::filesystem::path> fabric_files(const ClothConfig& cloth) {
  if (cloth.surface) return {};
  if (cloth.pattern) return cloth.pattern->fabrics;
  return {cloth.fabric};
}

bool is_cut_for_pictures(const SceneConfig& scene) {
  const auto is_cut = [](const MeshFile& mesh) { return mesh.subdivide_px.has_value(); };
  return std::any_of(scene.cloths.begin(), scene.cloths.end(),
                     [&](const ClothConfig& cloth) { return cloth.mesh && is_cut(*cloth.mesh); }) ||
         std::any_of(scene.meshes.begin(), scene.meshes.end(), is_cut);
}

std::vector<CameraConfig> cameras_of_cuts(const SceneConfig& scene) {
  // On a turntable from all around, so that shapes are the same in all frames.
  constexpr int kAround = 24;
  std::vector<CameraConfig> cameras;
  for (const ViewConfig& view : scene.views) {
    if (view.turn_per_frame == 0) {
      cameras.push_back(view.camera);
      continue;
    }
    for (int k = 0; k < kAround; ++k)
      cameras.push_back(turned(view.camera_of_frame_0, 2 * kPi * k / kAround));
  }
  return cameras;
}

void show_frame(SceneConfig& scene, int frame) {
  scene.frame = frame;
  for (ClothConfig& cloth : scene.cloths) {
    if (cloth.mesh) show_frame_of(*cloth.mesh, frame);
  }
  for (MeshConfig& mesh : scene.meshes) show_frame_of(mesh, frame);
  for (ViewConfig& view : scene.views) {
    if (view.turn_per_frame != 0)
      view.camera = turned(view.camera_of_frame_0, frame * view.turn_per_frame);
  }
}

SceneConfig read_scene_config(const TomlTable& document, std::optional<int> frame) {
  SceneConfig scene;
  scene.name = document.string("name");
  const auto usual_frame = static_cast<int>(document.integer("frame", 0, kMostFrames, 0));
  scene.background = color(document.number3("background", kLight, std::array<double, 3>{0, 0, 0}));
  read_lights(document, scene);
  if (scene.lights.empty()) document.fail("light", "expected at least one [[light]]");
  for (const TomlTable& table : document.tables("cloth")) scene.cloths.push_back(read_cloth(table));
  if (scene.cloths.empty()) document.fail("cloth", "expected at least one [[cloth]]");
  for (const TomlTable& table : document.tables("mesh")) {
    scene.meshes.push_back(read_solid(table));
    scene.meshes.back().name = read_matte_name(table);
  }
  int default_spp = 16;
  if (const std::optional<TomlTable> render = document.optional_table("render")) {
    scene.method = *render_method_of(render->choice("method", render_method_names(), "exact"));
    default_spp = static_cast<int>(render->integer("spp", 1, 1 << 24, default_spp));
    scene.seed = static_cast<std::uint64_t>(render->integer("seed", 0, INT64_MAX, 1));
    scene.shadow_sigma_mm = render->optional_number("shadow_sigma_mm", {0, 1e3});
    scene.bounces = static_cast<int>(render->integer("bounces", 0, 16, 0));
    scene.far_from = render->optional_number("far_from", {0, 1e6});
    scene.filter = read_filter(*render);
    scene.layers = read_layers(*render);
  }
  if (const std::optional<TomlTable> png = document.optional_table("png")) {
    scene.look.exposure_stops = png->number("exposure_stops", {-32, 32}, 0.0);
    if (png->choice("transform", names_of(kTransformNames), "srgb") == "filmic")
      scene.look.transform = ScreenTransform::kFilmic;
  }
  scene.views.push_back(read_view(document.table("camera"), scene, default_spp));
  for (const TomlTable& table : document.tables("view")) {
    const std::string name = read_view_name(table, scene);
    scene.views.push_back(read_view(table, scene, default_spp));
    scene.views.back().name = name;
  }
  document.finish();
  show_frame(scene, frame.value_or(usual_frame));
  return scene;
}

}  // namespace heddle
