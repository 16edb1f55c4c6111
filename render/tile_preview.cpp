#include "render/tile_preview.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace heddle {
namespace {

// Samples along each side of a pixel.
constexpr int kGrid = 2;
constexpr float kAmbient = 0.3F;
constexpr float kDiffuse = 0.9F;
constexpr float kHighlight = 0.25F;
constexpr float kHighlightPower = 24;
// How much of the light is left at the cloth's back.
constexpr float kLightAtBack = 0.25F;

/// What a deep layer of the fiber shows in even light.
Rgb color_of(const FiberScattering& fiber) {
  if (fiber.isotropic_white) return Rgb::Ones();
  const Rgbd g = (1 - fiber.color_tt).max(0.0).sqrt();
  return ((1 - g) / (1 + g)).cast<float>();
}

Rgb shade(const TileScene& tile, std::span<const Rgb> colors, const Vec3& origin) {
  const Exemplar& exemplar = tile.exemplar();
  const Vec3 down(0, 0, -1);
  const auto hit = tile.intersect({origin, down}, kNoFiber);
  if (!hit) return Rgb::Zero();
  const Vec3 lamp = Vec3(-0.5F, 0.45F, 0.8F).normalized();
  const Vec3 point = origin + hit->t * down;
  const Vec3 tangent = exemplar.segment_tangent(hit->segment);
  // Across the fiber, towards the point: the segment lies in the nearest copy of the tile.
  Vec3 offset = point - exemplar.points[exemplar.segment_point[hit->segment]];
  offset.x() -= exemplar.width_mm * std::round(offset.x() / exemplar.width_mm);
  offset.y() -= exemplar.height_mm * std::round(offset.y() / exemplar.height_mm);
  const Vec3 normal = (offset - offset.dot(tangent) * tangent).normalized();
  const float depth = (exemplar.z_max - point.z()) / (exemplar.z_max - exemplar.z_min);
  const float open = 1 - (1 - kLightAtBack) * depth;
  const bool lit = !tile.occluded({point, lamp}, exemplar.segment_fiber[hit->segment]);
  const Vec3 half = (lamp - down).normalized();
  const float along = tangent.dot(half);
  // Kajiya and Kay: a fiber's highlight is a cone about it.
  const float highlight =
      kHighlight * std::pow(std::sqrt(std::max(0.0F, 1 - along * along)), kHighlightPower);
  const float direct = lit ? std::max(0.0F, normal.dot(lamp)) : 0.0F;
  const Rgb color = colors[exemplar.segment_material(hit->segment)];
  return open * (kAmbient + kDiffuse * direct) * color + (lit ? open * highlight : 0.0F);
}

}  // namespace

std::vector<Rgb> preview_tile(const TileScene& tile, double width_mm, int pixels) {
  const Exemplar& exemplar = tile.exemplar();
  std::vector<Rgb> colors;
  for (const FiberScattering& fiber : exemplar.scattering) colors.push_back(color_of(fiber));
  std::vector<Rgb> picture(static_cast<std::size_t>(pixels) * static_cast<std::size_t>(pixels));
  const double step = width_mm / (pixels * kGrid);
  tbb::parallel_for(0, pixels, [&](int row) {
    for (int column = 0; column < pixels; ++column) {
      Rgb sum = Rgb::Zero();
      for (int k = 0; k < kGrid * kGrid; ++k) {
        const double x = (kGrid * column + k % kGrid + 0.5) * step;
        const double y = width_mm - (kGrid * row + k / kGrid + 0.5) * step;
        sum += shade(tile, colors,
                     Vec3(static_cast<float>(x), static_cast<float>(y), exemplar.z_max + 1.0F));
      }
      picture[static_cast<std::size_t>(row) * static_cast<std::size_t>(pixels) +
              static_cast<std::size_t>(column)] = sum / (kGrid * kGrid);
    }
  });
  return picture;
}

}  // namespace heddle
