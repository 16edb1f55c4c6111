#include "render/yarn_tints.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/tile_trace.h"

namespace heddle {
namespace {

constexpr double kMostDeviations = 3;
// Half width of the window of correlated yarns, in correlation_yarns: the rest weighs 2e-3.
constexpr double kWindow = 2.5;
// Eye rays of own_yarn_scatterings: its result is good to some per cent, and takes 0.1 s.
constexpr std::uint64_t kEyeRays = 8192;

std::size_t index_of(YarnSystem system) {
  return system == YarnSystem::kWarp ? 0 : 1;
}

/// Even in +-sqrt(3): mean 0, variance 1.
double draw(std::uint64_t seed, YarnSystem system, std::int64_t number) {
  RandomStream random(seed, RandomStage::kYarnTint, index_of(system),
                      static_cast<std::uint64_t>(number));
  return std::sqrt(3.0) * (2 * random.uniform_double() - 1);
}

/// What a fiber scatters of the light that arrives at normal incidence.
Rgb scattered_by(const FiberScattering& fiber) {
  if (fiber.isotropic_white) return Rgb::Ones();
  return (fiber.color_r + (1 - fiber.color_r) * fiber.color_tt).cast<float>().max(1e-3F);
}

}  // namespace

double yarn_dye(const YarnTintConfig& config, YarnSystem system, std::int64_t number) {
  double value = draw(config.seed, system, number);
  if (config.correlation_yarns > 0) {
    double sum = 0;
    double squares = 0;
    const auto half = static_cast<std::int64_t>(std::ceil(kWindow * config.correlation_yarns));
    for (std::int64_t k = -half; k <= half; ++k) {
      const double distance = static_cast<double>(k) / config.correlation_yarns;
      const double weight = std::exp(-distance * distance);
      sum += weight * draw(config.seed, system, number + k);
      squares += weight * weight;
    }
    value = sum / std::sqrt(squares);
  }
  return std::max(0.0, 1 + config.rms * std::clamp(value, -kMostDeviations, kMostDeviations));
}

YarnTints::OfExemplar YarnTints::of(const Exemplar& exemplar) {
  OfExemplar result;
  const std::uint32_t count = 1 + *std::max_element(exemplar.yarn.begin(), exemplar.yarn.end());
  result.yarns.resize(count);
  // Centres as angles about the tile, since yarns at its edge lie on both sides of it.
  std::vector<Eigen::Vector2d> sums(count, Eigen::Vector2d(0, 0));
  const double sizes[2] = {static_cast<double>(exemplar.width_mm),
                           static_cast<double>(exemplar.height_mm)};
  for (std::uint32_t f = 0; f < exemplar.fiber_count(); ++f) {
    if (exemplar.is_open[f] != 0) continue;
    const std::uint32_t first = exemplar.first_point[f];
    const std::uint32_t last = exemplar.first_point[f + 1] - 1;
    const Vec3 period = exemplar.points[last] - exemplar.points[first];
    TileYarn& yarn = result.yarns[exemplar.yarn[f]];
    yarn.system =
        std::abs(period.x()) > std::abs(period.y()) ? YarnSystem::kWeft : YarnSystem::kWarp;
    const auto axis = static_cast<Eigen::Index>(index_of(yarn.system));
    for (std::uint32_t p = first; p < last; ++p) {
      const double angle = 2 * kPi * static_cast<double>(exemplar.points[p][axis]) / sizes[axis];
      sums[exemplar.yarn[f]] += Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
  }
  for (std::uint32_t y = 0; y < count; ++y) {
    TileYarn& yarn = result.yarns[y];
    const double share = std::atan2(sums[y].y(), sums[y].x()) / (2 * kPi);
    yarn.centre = (share - std::floor(share)) * sizes[index_of(yarn.system)];
  }
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return result.yarns[a].centre < result.yarns[b].centre;
  });
  for (const std::uint32_t y : order)
    result.yarns[y].rank = result.count[index_of(result.yarns[y].system)]++;
  for (const FiberScattering& fiber : exemplar.scattering)
    result.scattered.push_back(scattered_by(fiber));
  return result;
}

YarnTints::YarnTints(const ClothTiling& tiling, const YarnTintConfig& config) : config_(config) {
  for (const ClothTiling::Tile& tile : tiling.tiles()) exemplars_.push_back(of(tile->exemplar()));
}

YarnTints::Yarn YarnTints::yarn_at(const ClothTiling& tiling, std::uint32_t exemplar,
                                   std::uint32_t segment, const Vec3d& fabric) const {
  const Exemplar& fibers = tiling.tiles()[exemplar]->exemplar();
  const OfExemplar& known = exemplars_[exemplar];
  const TileYarn& yarn = known.yarns[fibers.yarn[fibers.segment_fiber[segment]]];
  const BlockPlace place = tiling.place_of(fabric);
  const BlockLayout::Block block = tiling.block_at(place);
  const Vec3d in_tile = tiling.in_tile(place);
  const bool is_warp = yarn.system == YarnSystem::kWarp;
  const double size = static_cast<double>(is_warp ? fibers.width_mm : fibers.height_mm);
  // The copy of the yarn that is nearest, in tiles from that of the block.
  const auto tiles =
      static_cast<std::int64_t>(std::floor((in_tile[is_warp ? 0 : 1] - yarn.centre) / size + 0.5));
  std::int64_t blocks = 1;
  if (const BlockLayout* layout = tiling.layout())
    blocks = layout->tile_blocks[exemplar][is_warp ? 0 : 1];
  const std::int64_t moved =
      (is_warp ? place.column - block.column : place.row - block.row) + tiles * blocks;
  // Yarns in `moved` blocks, rounded down.
  const std::int64_t yarns = moved * known.count[index_of(yarn.system)];
  const std::int64_t before = yarns >= 0 ? yarns / blocks : -((-yarns + blocks - 1) / blocks);
  return {yarn.system, before + yarn.rank};
}

Rgb YarnTints::tint_at(const ClothTiling& tiling, std::uint32_t exemplar, std::uint32_t segment,
                       const Vec3d& fabric) const {
  const Yarn yarn = yarn_at(tiling, exemplar, segment, fabric);
  const std::uint16_t material = tiling.tiles()[exemplar]->exemplar().segment_material(segment);
  const auto more = static_cast<float>(yarn_dye(config_, yarn.system, yarn.number) - 1);
  return exemplars_[exemplar].scattered[material].pow(more);
}

Rgb own_yarn_scatterings(const TileScene& tile, std::span<const BcsdfTable> materials) {
  const Exemplar& exemplar = tile.exemplar();
  const TileTrace trace(tile);
  Rgb light = Rgb::Zero();
  Rgb counted = Rgb::Zero();
  for (std::uint64_t k = 0; k < kEyeRays; ++k) {
    RandomStream random(1, RandomStage::kYarnTint, 2, k);
    const Vec3 out = sample_hemisphere(Vec3(0, 0, 1), random);
    const Vec3 origin(random.uniform() * exemplar.width_mm, random.uniform() * exemplar.height_mm,
                      0);
    const Vec3 start = origin + exemplar.z_max / std::max(out.z(), 1e-3F) * out;
    const auto first = trace.first(start, -out);
    if (!first) continue;
    const std::uint32_t own = exemplar.yarn[first->fiber];
    int on_own = 0;
    const auto count = [&](const TileTrace::Vertex& vertex, const Mat3&, const Vec3&, const Rgb&,
                           int) {
      if (exemplar.yarn[vertex.fiber] == own) ++on_own;
      return true;
    };
    const auto escape =
        walk_path(trace, materials, *first, out, Rgb(1, 1, 1), random, WalkLimits{}, count);
    if (!escape || escape->scatterings < 2 || !(escape->direction.z() > 0)) continue;
    light += escape->throughput;
    counted += static_cast<float>(on_own) * escape->throughput;
  }
  Rgb mean = Rgb::Ones();
  for (int c = 0; c < 3; ++c) {
    if (light[c] > 0) mean[c] = counted[c] / light[c];
  }
  return mean;
}

}  // namespace heddle
