// One page of pictures of all surface fabrics: the first view of a scene, drawn once for each
// preset in place of the scene's own surfaces, side by side with their names.
//
//   heddle_surface_gallery configs/scenes/surface-gallery.toml docs/surface-models.png [--columns
//     N] [--spp N]
// 22 fabrics at 32 samples per pixel take some four minutes of one core.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "formats/image_file.h"
#include "formats/toml_table.h"
#include "render/cloth_scene.h"
#include "render/precomputed_renderer.h"
#include "render/scene_config.h"
#include "render/surface/surface_presets.h"
#include "render/tone_map.h"

namespace heddle {
namespace {

constexpr int kLabelHeight = 14;

/// Letters of the labels, 5 x 7: rows from the top, '#' is ink. Letters with a descender start two
/// rows lower.
constexpr std::string_view kDescending = "gpqy";
struct Glyph {
  char letter;
  std::array<std::string_view, 7> rows;
};
// clang-format off
const std::vector<Glyph> kGlyphs = {
    {'a', {".....", ".....", ".###.", "....#", ".####", "#...#", ".####"}},
    {'b', {"#....", "#....", "####.", "#...#", "#...#", "#...#", "####."}},
    {'c', {".....", ".....", ".####", "#....", "#....", "#....", ".####"}},
    {'d', {"....#", "....#", ".####", "#...#", "#...#", "#...#", ".####"}},
    {'e', {".....", ".....", ".###.", "#...#", "#####", "#....", ".####"}},
    {'f', {"..##.", ".#...", "####.", ".#...", ".#...", ".#...", ".#..."}},
    {'g', {".####", "#...#", "#...#", "#...#", ".####", "....#", ".###."}},
    {'h', {"#....", "#....", "####.", "#...#", "#...#", "#...#", "#...#"}},
    {'i', {"..#..", ".....", ".##..", "..#..", "..#..", "..#..", ".###."}},
    {'j', {"...#.", ".....", "..##.", "...#.", "...#.", "#..#.", ".##.."}},
    {'k', {"#....", "#....", "#..#.", "#.#..", "##...", "#.#..", "#..#."}},
    {'l', {".##..", "..#..", "..#..", "..#..", "..#..", "..#..", ".###."}},
    {'m', {".....", ".....", "##.#.", "#.#.#", "#.#.#", "#.#.#", "#.#.#"}},
    {'n', {".....", ".....", "####.", "#...#", "#...#", "#...#", "#...#"}},
    {'o', {".....", ".....", ".###.", "#...#", "#...#", "#...#", ".###."}},
    {'p', {"####.", "#...#", "#...#", "#...#", "####.", "#....", "#...."}},
    {'q', {".####", "#...#", "#...#", "#...#", ".####", "....#", "....#"}},
    {'r', {".....", ".....", "#.##.", "##...", "#....", "#....", "#...."}},
    {'s', {".....", ".....", ".####", "#....", ".###.", "....#", "####."}},
    {'t', {".#...", ".#...", "####.", ".#...", ".#...", ".#...", "..##."}},
    {'u', {".....", ".....", "#...#", "#...#", "#...#", "#..##", ".##.#"}},
    {'v', {".....", ".....", "#...#", "#...#", "#...#", ".#.#.", "..#.."}},
    {'w', {".....", ".....", "#...#", "#.#.#", "#.#.#", "#.#.#", ".#.#."}},
    {'x', {".....", ".....", "#...#", ".#.#.", "..#..", ".#.#.", "#...#"}},
    {'y', {"#...#", "#...#", "#...#", "#...#", ".####", "....#", ".###."}},
    {'z', {".....", ".....", "#####", "...#.", "..#..", ".#...", "#####"}},
    {'0', {".###.", "#...#", "#..##", "#.#.#", "##..#", "#...#", ".###."}},
    {'1', {"..#..", ".##..", "..#..", "..#..", "..#..", "..#..", ".###."}},
    {'2', {".###.", "#...#", "....#", "..##.", ".#...", "#....", "#####"}},
    {'3', {".###.", "#...#", "....#", "..##.", "....#", "#...#", ".###."}},
    {'4', {"...#.", "..##.", ".#.#.", "#..#.", "#####", "...#.", "...#."}},
    {'5', {"#####", "#....", "####.", "....#", "....#", "#...#", ".###."}},
    {'6', {".###.", "#....", "####.", "#...#", "#...#", "#...#", ".###."}},
    {'7', {"#####", "....#", "...#.", "..#..", "..#..", ".#...", ".#..."}},
    {'8', {".###.", "#...#", "#...#", ".###.", "#...#", "#...#", ".###."}},
    {'9', {".###.", "#...#", "#...#", ".####", "....#", "....#", ".###."}},
    {'-', {".....", ".....", ".....", ".###.", ".....", ".....", "....."}},
};
// clang-format on

struct Page {
  int width;
  int height;
  std::vector<std::uint8_t> rgb;  // [row][column][3]

  std::uint8_t* pixel(int x, int y) { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

void write_label(Page& page, int left, int top, const std::string& text) {
  for (const char letter : text) {
    const auto glyph = std::find_if(kGlyphs.begin(), kGlyphs.end(), [&](const Glyph& candidate) {
      return candidate.letter == letter;
    });
    const int first = top + (kDescending.find(letter) == std::string_view::npos ? 0 : 2);
    for (int y = 0; glyph != kGlyphs.end() && y < 7; ++y) {
      for (int x = 0; x < 5; ++x) {
        if (glyph->rows[y][x] == '#') std::fill_n(page.pixel(left + x, first + y), 3, 230);
      }
    }
    left += 6;
  }
}

/// The scene's first view with all its cloths drawn by `model`, 8-bit sRGB.
std::vector<std::uint8_t> picture_of(SceneConfig config,
                                     const std::shared_ptr<const SurfaceModel>& model) {
  for (ClothConfig& cloth : config.cloths) cloth.surface.emplace().model = model;
  const ClothScene scene = make_cloth_scene(config, {});
  const ViewConfig& view = config.views.front();
  PrecomputedSettings settings;
  settings.seed = config.seed;
  const PrecomputedRenderer renderer(scene, {}, config.lights, config.background, settings);
  const FrameBuffers frame =
      shade_picture(renderer, Camera(view.camera), {0, 0, view.camera.width, view.camera.height},
                    view.spp, [](double) {});
  return tone_map(frame.beauty, {});
}

void draw_page(const std::string& scene_file, const std::string& page_file, int columns, int spp) {
  SceneConfig config = read_scene_config(TomlTable::load(scene_file));
  if (spp > 0) config.views.front().spp = spp;
  const int width = config.views.front().camera.width;
  const int height = config.views.front().camera.height + kLabelHeight;
  const std::vector<std::string> names = surface_preset_names();
  const int count = static_cast<int>(names.size());
  Page page{columns * width, (count + columns - 1) / columns * height, {}};
  page.rgb.resize(3 * static_cast<std::size_t>(page.width) * page.height);
  for (int k = 0; k < count; ++k) {
    const int left = k % columns * width;
    const int top = k / columns * height;
    const std::vector<std::uint8_t> picture =
        picture_of(config, read_surface_model(surface_preset(names[k])));
    for (int y = 0; y < height - kLabelHeight; ++y) {
      std::copy_n(&picture[static_cast<std::size_t>(3 * y * width)], 3 * width,
                  page.pixel(left, top + kLabelHeight + y));
    }
    write_label(page, left + 6, top + 4, names[k]);
    std::cout << names[k] << '\n';
  }
  write_png(page_file, page.width, page.height, page.rgb);
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  CLI::App app("One page of pictures of all surface fabrics");
  std::string scene;
  std::string page;
  int columns = 4;
  int spp = 0;
  app.add_option("scene", scene, "scene whose cloths take each surface in turn")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("page", page, "PNG to write")->required();
  app.add_option("--columns", columns, "pictures side by side")->check(CLI::Range(1, 64));
  app.add_option("--spp", spp, "samples per pixel; those of the scene where absent")
      ->check(CLI::Range(1, 65536));
  CLI11_PARSE(app, argc, argv);
  try {
    heddle::draw_page(scene, page, columns, spp);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
