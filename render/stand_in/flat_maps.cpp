#include "render/stand_in/flat_maps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/random.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/tile_trace.h"

namespace heddle {
namespace {

/// Sums over the rays of one texel that meet fiber.
struct TexelSums {
  int hits = 0;
  double relief = 0;
  Rgb albedo = Rgb::Zero();
  Rgb picture = Rgb::Zero();
  Vec3 normal = Vec3::Zero();
  // of the normals' x x, x y and y y
  Vec3 products = Vec3::Zero();
  // of the tangents, by twice their angle: a fiber has no sense
  Vec2 doubled = Vec2::Zero();
};

/// Outward normal of the fiber's surface at a point on it.
Vec3 surface_normal(const Exemplar& exemplar, const TileTrace::Vertex& hit) {
  Vec3 from = hit.position - exemplar.points[exemplar.segment_point[hit.segment]];
  // The fiber may be a copy of the one in the tile.
  from.x() -= exemplar.width_mm * std::round(from.x() / exemplar.width_mm);
  from.y() -= exemplar.height_mm * std::round(from.y() / exemplar.height_mm);
  return (from - from.dot(hit.tangent) * hit.tangent).normalized();
}

class FlatMapBaker {
 public:
  FlatMapBaker(const TileScene& scene, std::span<const BcsdfTable> materials,
               std::span<const Light> lights, const FlatMapSettings& settings)
      : trace_(scene),
        exemplar_(scene.exemplar()),
        materials_(materials),
        lights_(lights),
        settings_(settings) {}

  TexelSums texel(std::size_t texel, double x, double y, double width, double height) const {
    TexelSums sums;
    for (int sample = 0; sample < settings_.spp; ++sample) {
      RandomStream random = RandomStream::stratified(settings_.seed, RandomStage::kFlatMaps, texel,
                                                     static_cast<std::uint64_t>(sample));
      const double right = x + width * random.uniform_double();
      const double up = y + height * random.uniform_double();
      const Vec3 origin(static_cast<float>(right), static_cast<float>(up), exemplar_.z_max);
      if (const auto hit = trace_.first(origin, -Vec3::UnitZ())) add(*hit, random, sums);
    }
    return sums;
  }

 private:
  void add(const TileTrace::Vertex& hit, RandomStream& random, TexelSums& sums) const {
    const Vec3 normal = surface_normal(exemplar_, hit);
    const Vec2 flat = hit.tangent.head<2>();
    ++sums.hits;
    sums.relief += static_cast<double>(hit.position.z());
    sums.normal += normal;
    sums.products +=
        Vec3(normal.x() * normal.x(), normal.x() * normal.y(), normal.y() * normal.y());
    sums.doubled += Vec2(flat.x() * flat.x() - flat.y() * flat.y(), 2 * flat.x() * flat.y());
    const auto escape =
        walk_path(trace_, materials_, hit, Vec3::UnitZ(), Rgb(1, 1, 1), random, WalkLimits{},
                  [](const auto&, const Mat3&, const Vec3&, const Rgb&, int) { return true; });
    if (!escape) return;
    if (escape->direction.z() > 0) sums.albedo += escape->throughput;
    for (const Light& light : lights_)
      sums.picture += escape->throughput * light_radiance(light, escape->direction);
  }

  TileTrace trace_;
  const Exemplar& exemplar_;
  std::span<const BcsdfTable> materials_;
  std::span<const Light> lights_;
  FlatMapSettings settings_;
};

void set_texel(FlatMaps& maps, std::size_t texel, const TexelSums& sums, int spp) {
  if (sums.hits == 0) return;
  const auto hits = static_cast<float>(sums.hits);
  maps.opacity[texel] = hits / static_cast<float>(spp);
  maps.relief_mm[texel] = static_cast<float>(sums.relief / sums.hits);
  maps.albedo[texel] = sums.albedo / hits;
  maps.picture[texel] = sums.picture / static_cast<float>(spp);
  if (sums.normal.z() > 0) maps.normal[texel] = sums.normal.normalized();
  // Weft and warp, along x and y, lie in the middle of this range: twist never turns a direction
  // into its opposite.
  float angle = 0.5F * std::atan2(sums.doubled.y(), sums.doubled.x());
  if (angle < -kPif / 4) angle += kPif;
  const Vec2 along(std::cos(angle), std::sin(angle));
  const Vec2 across(-along.y(), along.x());
  const auto variance = [&](const Vec2& axis) {
    const float mean = sums.normal.head<2>().dot(axis) / hits;
    const float square = axis.x() * axis.x() * sums.products.x() +
                         2 * axis.x() * axis.y() * sums.products.y() +
                         axis.y() * axis.y() * sums.products.z();
    return std::max(0.0F, square / hits - mean * mean);
  };
  maps.along[texel] = along;
  maps.tilt_along[texel] = variance(along);
  maps.tilt_across[texel] = variance(across);
}

/// Texels without fiber take the means of the others, so that filters of textures mix nothing odd
/// into their neighbours.
void fill_gaps(FlatMaps& maps) {
  double cover = 0;
  double relief = 0;
  Rgbd albedo = Rgbd::Zero();
  for (std::size_t k = 0; k < maps.texel_count(); ++k) {
    const double share = maps.opacity[k];
    cover += share;
    relief += share * static_cast<double>(maps.relief_mm[k]);
    albedo += share * maps.albedo[k].cast<double>();
  }
  if (!(cover > 0)) return;
  for (std::size_t k = 0; k < maps.texel_count(); ++k) {
    if (maps.opacity[k] > 0) continue;
    maps.relief_mm[k] = static_cast<float>(relief / cover);
    maps.albedo[k] = (albedo / cover).cast<float>();
  }
}

}  // namespace

double FlatMaps::cover() const {
  double sum = 0;
  for (const float share : opacity) sum += static_cast<double>(share);
  return sum / static_cast<double>(texel_count());
}

std::pair<float, float> FlatMaps::relief_range_mm() const {
  const auto [low, high] = std::minmax_element(relief_mm.begin(), relief_mm.end());
  return {*low, *high};
}

FlatMaps bake_flat_maps(const TileScene& scene, std::span<const BcsdfTable> materials,
                        std::span<const Light> lights, const FlatMapSettings& settings,
                        const std::function<void(double)>& progress) {
  const Exemplar& exemplar = scene.exemplar();
  FlatMaps maps;
  maps.width_mm = exemplar.width_mm;
  maps.height_mm = exemplar.height_mm;
  const double texel_mm =
      static_cast<double>(std::max(exemplar.width_mm, exemplar.height_mm)) / settings.pixels;
  maps.width = std::max(1, static_cast<int>(std::lround(exemplar.width_mm / texel_mm)));
  maps.height = std::max(1, static_cast<int>(std::lround(exemplar.height_mm / texel_mm)));
  const auto columns = static_cast<std::size_t>(maps.width);
  const auto rows = static_cast<std::size_t>(maps.height);
  const std::size_t count = columns * rows;
  maps.opacity.assign(count, 0);
  maps.relief_mm.assign(count, 0);
  maps.albedo.assign(count, Rgb::Zero());
  maps.normal.assign(count, Vec3::UnitZ());
  maps.along.assign(count, Vec2::UnitX());
  maps.tilt_along.assign(count, 0);
  maps.tilt_across.assign(count, 0);
  maps.picture.assign(count, Rgb::Zero());
  const FlatMapBaker baker(scene, materials, lights, settings);
  const double width = static_cast<double>(exemplar.width_mm) / maps.width;
  const double height = static_cast<double>(exemplar.height_mm) / maps.height;
  constexpr std::size_t kRowsPerReport = 16;
  for (std::size_t first = 0; first < rows; first += kRowsPerReport) {
    progress(static_cast<double>(first) / static_cast<double>(rows));
    tbb::parallel_for(first, std::min(rows, first + kRowsPerReport), [&](std::size_t row) {
      for (std::size_t column = 0; column < columns; ++column) {
        const std::size_t texel = row * columns + column;
        const TexelSums sums =
            baker.texel(texel, static_cast<double>(column) * width,
                        static_cast<double>(rows - 1 - row) * height, width, height);
        set_texel(maps, texel, sums, settings.spp);
      }
    });
  }
  progress(1);
  fill_gaps(maps);
  return maps;
}

}  // namespace heddle
