#include "render/surface/woven_cotton.h"

#include <algorithm>
#include <cmath>

#include "render/surface/sg_light_quadrature.h"

namespace heddle {
namespace {

// 0, 1/16 .. 15/16 in a random order, as evenly distributed deviates of mean 0 and standard
// deviation 1.
std::array<double, WovenCotton::kVariants> shuffled_deviates(RandomStream& random) {
  constexpr int kCount = WovenCotton::kVariants;
  std::array<double, kCount> deviates;
  const double scale =
      std::sqrt(12.0 / (1.0 - 1.0 / (kCount * kCount)));  // of as many equally spaced values
  for (int i = 0; i < kCount; ++i)
    deviates[static_cast<std::size_t>(i)] = scale * ((i + 0.5) / kCount - 0.5);
  for (std::size_t i = kCount - 1; i > 0; --i)
    std::swap(deviates[i], deviates[random.index(i + 1)]);
  return deviates;
}

}  // namespace

WovenCotton::WovenCotton(WovenCottonParameters parameters)
    : parameters_(std::move(parameters)), variants_(parameters_.irregularity ? kVariants : 1) {
  const WovenIrregularity irregularity = parameters_.irregularity.value_or(WovenIrregularity());
  std::size_t kind_index = 0;
  for (const FloatKind& kind : parameters_.pattern.kinds()) {
    const CottonYarn& yarn = parameters_.yarns[static_cast<std::size_t>(kind.system)];
    RandomStream random(irregularity.seed, RandomStage::kWovenIrregularity, kind_index++, 0);
    const auto angle = shuffled_deviates(random);
    const auto shift_x = shuffled_deviates(random);
    const auto shift_y = shuffled_deviates(random);
    const auto size = shuffled_deviates(random);
    Vec2d range = Vec2d::Zero();
    for (std::size_t v = 0; v < static_cast<std::size_t>(variants_); ++v) {
      WovenSegment segment;
      segment.size = kind.size;
      segment.semimajor = yarn.semimajor * (1.0 + irregularity.size * size[v]);
      segment.eccentricity = yarn.eccentricity;
      segment.angle = yarn.angle + irregularity.angle * angle[v];
      segment.k = yarn.k;
      segment.shift = irregularity.shift * kind.size.cwiseProduct(Vec2d(shift_x[v], shift_y[v]));
      // |c - middle| <= half window + half ellipse, with c of equation 2.
      const Vec2d reach = 0.5 * kind.size + segment.half_extent() + segment.shift.cwiseAbs();
      for (int axis = 0; axis < 2; ++axis) {
        const double per_half = 0.5 * kind.size[axis] * std::abs(segment.k[axis]);
        range[axis] = std::max(range[axis], reach[axis] < per_half ? reach[axis] / per_half : 1.0);
      }
      segments_.push_back(segment);
    }
    half_range_.push_back(range);
  }
  if (!parameters_.energy_safe) return;
  for (CottonYarn& yarn : parameters_.yarns) {
    yarn.diffuse *= kMostDiffuse / std::max(kPi * yarn.diffuse.maxCoeff(), kMostDiffuse);
  }
  energy_scale_ = make_energy_scale();
}

EnergyScale WovenCotton::make_energy_scale() const {
  constexpr int kDraws = 1024;
  const WovenPattern& pattern = parameters_.pattern;
  Rgbd room = Rgbd::Ones();
  for (const YarnSystem system : {YarnSystem::kWarp, YarnSystem::kWeft}) {
    room -= kPi * pattern.coverage(system) *
            parameters_.yarns[static_cast<std::size_t>(system)].diffuse;
  }
  return energy_scale_of(
      [&](const Vec3d& wi, const Vec3d& wo) -> Rgbd {
        const Vec2d half = half_vector(wi, wo);
        Rgbd value = Rgbd::Zero();
        for (std::size_t kind = 0; kind < pattern.kinds().size(); ++kind) {
          const FloatKind& floats = pattern.kinds()[kind];
          double area = 0;
          for (int v = 0; v < variants_; ++v) {
            const Rectangle whole = {Vec2d::Zero(), floats.size};
            area += highlight_area(
                segments_[kind * static_cast<std::size_t>(variants_) + static_cast<std::size_t>(v)],
                half, whole);
          }
          value += floats.share * area / (variants_ * floats.size.prod()) *
                   parameters_.yarns[static_cast<std::size_t>(floats.system)].specular;
        }
        return value * highlight(wi, wo);
      },
      room, kDraws);
}

double WovenCotton::highlight(const Vec3d& wi, const Vec3d& wo) const {
  const double reflectance = highlight_reflectance(wi, wo, parameters_.ior);
  return energy_scale_ ? reflectance * (*energy_scale_)(wi) * (*energy_scale_)(wo) : reflectance;
}

const WovenSegment& WovenCotton::segment_of(const PlacedFloat& placed) const {
  const auto kind = static_cast<std::size_t>(placed.segment->kind);
  if (variants_ == 1) return segments_[kind];
  const bool warp = placed.segment->system == YarnSystem::kWarp;
  const bool per_yarn = parameters_.irregularity->per_yarn;
  const auto item =
      static_cast<std::uint64_t>(per_yarn ? placed.segment->yarn + (warp ? 0 : 64)
                                          : placed.segment - parameters_.pattern.floats().data());
  // Along its yarn a segment's address is its repeat; of a yarn as a whole it has none.
  const std::int64_t x = per_yarn && !warp ? 0 : placed.repeat_x;
  const std::int64_t y = per_yarn && warp ? 0 : placed.repeat_y;
  const std::uint64_t repeat =
      mix64(static_cast<std::uint64_t>(x)) + 0x9e3779b97f4a7c15ULL * static_cast<std::uint64_t>(y);
  RandomStream random(parameters_.irregularity->seed, RandomStage::kWovenIrregularity, item + 1024,
                      repeat);
  return segments_[kind * static_cast<std::size_t>(kVariants) + random.index(kVariants)];
}

void WovenCotton::visit_pieces(const SurfacePoint& point,
                               const std::function<void(const Piece&)>& visitor) const {
  const WovenPattern& pattern = parameters_.pattern;
  const Vec2d position = point.position_mm.cast<double>() / parameters_.unit_mm;
  pattern.visit_footprint(
      position, point.footprint_mm / parameters_.unit_mm, [&](const FootprintPart& seen) {
        const YarnSystem system = pattern.kinds()[static_cast<std::size_t>(seen.kind)].system;
        if (seen.placed != nullptr) {
          visitor({&segment_of(*seen.placed), system, seen.part, seen.is_point, seen.share});
          return;
        }
        for (int v = 0; v < variants_; ++v) {
          const WovenSegment& segment =
              segments_[static_cast<std::size_t>(seen.kind * variants_ + v)];
          visitor({&segment, system, seen.part, false, seen.share / variants_});
        }
      });
}

Rgbd WovenCotton::reflected_by(const Piece& piece, const Vec2d& half, double cos_i,
                               double reflectance) const {
  const CottonYarn& yarn = parameters_.yarns[static_cast<std::size_t>(piece.system)];
  const double share = piece.is_point
                           ? (is_in_highlight(*piece.segment, piece.part.min, half) ? 1.0 : 0.0)
                           : highlight_area(*piece.segment, half, piece.part) / piece.part.area();
  return piece.weight * (yarn.diffuse * cos_i + yarn.specular * (share * reflectance));
}

Rgbd WovenCotton::reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const {
  Rgbd sum = Rgbd::Zero();
  if (!(wi.z() > 0.0) || !(wo.z() > 0.0)) return sum;
  const Vec2d half = half_vector(wi, wo);
  const double reflectance = highlight(wi, wo);
  visit_pieces(point,
               [&](const Piece& piece) { sum += reflected_by(piece, half, wi.z(), reflectance); });
  return sum;
}

Rgbd WovenCotton::reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                               const Vec3d& wo) const {
  if (!(wo.z() > 0.0)) return Rgbd::Zero();
  std::vector<Piece> pieces;
  visit_pieces(point, [&](const Piece& piece) { pieces.push_back(piece); });
  return integrate_sg_light(axis, sharpness, [&](const Vec3d& wi) {
    const Vec2d half = half_vector(wi, wo);
    const double reflectance = highlight(wi, wo);
    Rgbd sum = Rgbd::Zero();
    for (const Piece& piece : pieces) sum += reflected_by(piece, half, wi.z(), reflectance);
    return sum;
  });
}

double WovenCotton::density(const Vec3d& wi, const Vec3d& wo) const {
  if (!(wi.z() > 0.0) || !(wo.z() > 0.0)) return 0.0;
  const Vec3d sum = wi + wo;
  const double length = sum.norm();
  const double by_cosine = kCosineShare * wi.z() / kPi;
  if (!(length > kShortestSum)) return by_cosine;
  const Vec3d half = sum / length;
  double by_half = 0.0;
  for (std::size_t kind = 0; kind < half_range_.size(); ++kind) {
    const Vec2d& range = half_range_[kind];
    if (std::abs(half.x()) > range.x() || std::abs(half.y()) > range.y()) continue;
    by_half += parameters_.pattern.kinds()[kind].share / (4.0 * range.prod());
  }
  // Per area of (x, y) -> per solid angle of h: times h.z; of wi: over 4 wo . h, with wo . h = |wi
  // + wo| / 2.
  by_half *= half.z() / (2.0 * length);
  return by_cosine + (1.0 - kCosineShare) * by_half;
}

std::optional<Vec3d> WovenCotton::draw(double choice, double a, double b, const Vec3d& wo) const {
  if (choice < kCosineShare) return cosine_direction(a, b);
  choice = (choice - kCosineShare) / (1.0 - kCosineShare);
  std::size_t kind = 0;
  for (; kind + 1 < half_range_.size(); ++kind) {
    choice -= parameters_.pattern.kinds()[kind].share;
    if (choice < 0.0) break;
  }
  const Vec2d half = half_range_[kind].cwiseProduct(Vec2d(2.0 * a - 1.0, 2.0 * b - 1.0));
  const double rest = 1.0 - half.squaredNorm();
  if (rest <= 0.0) return std::nullopt;  // no such half vector
  const Vec3d h(half.x(), half.y(), std::sqrt(rest));
  if (h.dot(wo) <= 0.0) return std::nullopt;
  return 2.0 * h.dot(wo) * h - wo;
}

WovenCottonParameters read_woven_cotton(const TomlTable& document) {
  const auto read_yarn = [&](const char* section) {
    const TomlTable table = document.table(section);
    CottonYarn yarn;
    yarn.diffuse = read_yarn_color(table, "diffuse", 1);
    yarn.specular = read_yarn_color(table, "specular", 100);
    yarn.semimajor = table.number("semimajor", {.min = 0, .max = 1000, .exclusive_min = true});
    yarn.eccentricity = table.number("eccentricity", {.min = 0, .max = 0.9999999});
    yarn.angle = radians(table.number("angle_deg", {.min = -360, .max = 360}));
    const std::array<double, 2> k = table.number2("k", {.min = -100, .max = 100});
    yarn.k = {k[0], k[1]};
    return yarn;
  };
  WovenCottonParameters parameters{
      .unit_mm = document.number("unit_mm", {.min = 0.001, .max = 100}),
      .ior = document.number("ior", {.min = 1, .max = 4}, 1.5),
      .pattern = read_woven_pattern(document.table("weave")),
      .yarns = {read_yarn("warp"), read_yarn("weft")},
      .irregularity = {},
      .energy_safe = document.boolean("energy_safe", false),
  };
  if (const std::optional<TomlTable> table = document.optional_table("irregularity")) {
    WovenIrregularity irregularity;
    irregularity.angle = radians(table->number("angle_deg", {.min = 0, .max = 45}, 0));
    irregularity.shift = table->number("shift", {.min = 0, .max = 1}, 0);
    irregularity.size = table->number("size", {.min = 0, .max = 0.5}, 0);
    irregularity.per_yarn = table->choice("per", {"segment", "yarn"}, "segment") == "yarn";
    irregularity.seed = static_cast<std::uint64_t>(table->integer("seed", 0, 1000000000, 1));
    parameters.irregularity = irregularity;
  }
  return parameters;
}

}  // namespace heddle
