#include "precompute/visibility_maps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "fibers/baked/light_from.h"
#include "formats/tensor_file.h"

namespace heddle {
namespace {

constexpr int kN = VisibilityMaps::kResolution;
constexpr std::size_t kCells = static_cast<std::size_t>(kN) * kN;

// A piece of fiber is projected with its squared radius smaller by this share. That is far above
// the rounding of the test below for pieces up to kFarthest radii away, so no cell is closed whose
// ray would pass. The ring of cells left out is traced.
constexpr float kRadiusMargin = 2e-3F;

// Pieces farther away, in radii, subtend less than a cell: a ray each is cheaper.
constexpr float kFarthest = 30;

/// Directions of cell centres, and the order in which cells are traced.
struct Directions {
  std::array<float, kN> sin_polar, cos_polar, sin_azimuth, cos_azimuth;
  std::vector<std::uint16_t> coarse_to_fine;  // all cells; every prefix is spread over the sphere

  Directions() {
    const LatLongGrid grid(kN);
    for (std::size_t i = 0; i < kN; ++i) {
      const double polar = (static_cast<double>(i) + 0.5) * grid.row_step();
      const double azimuth = (static_cast<double>(i) + 0.5) * grid.column_step();
      sin_polar[i] = static_cast<float>(std::sin(polar));
      cos_polar[i] = static_cast<float>(std::cos(polar));
      sin_azimuth[i] = static_cast<float>(std::sin(azimuth));
      cos_azimuth[i] = static_cast<float>(std::cos(azimuth));
    }
    // The bits of row and column reversed and interleaved: a quadtree, breadth first.
    for (std::uint32_t i = 0; i < kCells; ++i) {
      std::uint32_t row = 0;
      std::uint32_t column = 0;
      for (int bit = 0; bit < 7; ++bit) {
        row |= ((i >> (2 * bit)) & 1U) << (6 - bit);
        column |= ((i >> (2 * bit + 1)) & 1U) << (6 - bit);
      }
      coarse_to_fine.push_back(static_cast<std::uint16_t>(row * kN + column));
    }
  }

  Vec3 of(std::size_t row, std::size_t column) const {
    return {sin_polar[row] * cos_azimuth[column], sin_polar[row] * sin_azimuth[column],
            cos_polar[row]};
  }
};

/// The map of one segment while it is being traced.
class MapTracer {
 public:
  MapTracer(const TileScene& scene, const Directions& directions, bool both_sides)
      : scene_(&scene),
        directions_(&directions),
        rows_(both_sides ? kN : kN / 2),
        closed_(kCells) {}

  /// Writes the bits of open cells; returns whether there are any.
  bool trace(std::uint32_t segment, const Vec3& origin, std::uint64_t* words) {
    const Exemplar& exemplar = scene_->exemplar();
    origin_ = origin;
    std::fill(closed_.begin(), closed_.begin() + rows_ * kN, 0);
    projected_.clear();
    bool any_open = false;
    for (const std::uint16_t cell : directions_->coarse_to_fine) {
      const int row = cell / kN;
      if (row >= rows_ || closed_[cell] != 0) continue;
      const Vec3 direction = directions_->of(static_cast<std::size_t>(row), cell % kN);
      const auto hit = scene_->intersect({origin_, direction}, exemplar.segment_fiber[segment]);
      if (hit) {
        closed_[cell] = 1;
        project_around(*hit, direction);
      } else {
        words[cell / 64] |= std::uint64_t{1} << (cell % 64);
        any_open = true;
      }
    }
    return any_open;
  }

 private:
  /// Projects the piece of fiber that was hit and its neighbours along the fiber while they look
  /// large.
  void project_around(const FiberHit& hit, const Vec3& direction) {
    const Exemplar& exemplar = scene_->exemplar();
    const std::uint32_t fiber = exemplar.segment_fiber[hit.segment];
    const std::uint32_t first = exemplar.first_point[fiber];
    const int pieces = static_cast<int>(exemplar.first_point[fiber + 1] - first) - 1;
    const Vec3 period =
        exemplar.points[first + static_cast<std::uint32_t>(pieces)] - exemplar.points[first];
    const float radius = exemplar.radius_mm[fiber];
    // The copy of the tile that was hit: its segment is the one near the hit.
    const Vec3 offset = origin_ + hit.t * direction - exemplar.segment_midpoint(hit.segment);
    const Vec3 copy(std::round(offset.x() / exemplar.width_mm) * exemplar.width_mm,
                    std::round(offset.y() / exemplar.height_mm) * exemplar.height_mm, 0);
    const int hit_piece = static_cast<int>(exemplar.segment_point[hit.segment] - first);
    for (const int step : {1, -1}) {
      for (int piece = step > 0 ? hit_piece : hit_piece - 1; std::abs(piece - hit_piece) < pieces;
           piece += step) {
        if (exemplar.is_open[fiber] != 0 && (piece < 0 || piece >= pieces)) break;
        const int turns = piece >= 0 ? piece / pieces : -((pieces - 1 - piece) / pieces);
        const auto point = first + static_cast<std::uint32_t>(piece - turns * pieces);
        const Vec3 shift = copy + static_cast<float>(turns) * period - origin_;
        const Vec3 begin = exemplar.points[point] + shift;
        const Vec3 end = exemplar.points[point + 1] + shift;
        if (0.25F * (begin + end).squaredNorm() > kFarthest * kFarthest * radius * radius) break;
        const Piece known{point, turns, copy.x(), copy.y()};
        if (std::find(projected_.begin(), projected_.end(), known) != projected_.end()) break;
        projected_.push_back(known);
        project(begin, end, radius);
      }
    }
  }

  /// Closes the cells whose ray passes a capsule's axis (begin and end relative to the origin)
  /// within its radius.
  void project(const Vec3& begin, const Vec3& end, float radius) {
    const Vec3 axis = end - begin;
    const Vec3 moment = begin.cross(axis);
    const float axis_axis = axis.squaredNorm();
    const float begin_axis = begin.dot(axis);
    const float square = radius * radius * (1 - kRadiusMargin);
    const float begin_free = begin.squaredNorm() - square;
    const float end_free = end.squaredNorm() - square;

    // Rows that a ball about the capsule can reach.
    const Vec3 middle = 0.5F * (begin + end);
    const float reach = 0.5F * std::sqrt(axis_axis) + radius;
    const float distance = middle.norm();
    int row_begin = 0;
    int row_end = rows_;
    if (distance > reach) {
      const float polar = std::atan2(std::hypot(middle.x(), middle.y()), middle.z());
      const float spread = std::asin(reach / distance);
      const float rows_per_radian = static_cast<float>(kN) / kPif;
      row_begin = std::clamp(static_cast<int>((polar - spread) * rows_per_radian - 0.5F), 0, rows_);
      row_end = std::clamp(static_cast<int>((polar + spread) * rows_per_radian + 1.5F), 0, rows_);
    }

    // Products with the horizontal part of the direction, [column].
    std::array<float, kN> begin_flat, axis_flat, moment_flat;
    for (std::size_t c = 0; c < kN; ++c) {
      const float x = directions_->cos_azimuth[c];
      const float y = directions_->sin_azimuth[c];
      begin_flat[c] = x * begin.x() + y * begin.y();
      axis_flat[c] = x * axis.x() + y * axis.y();
      moment_flat[c] = x * moment.x() + y * moment.y();
    }
    for (int row = row_begin; row < row_end; ++row) {
      const float sine = directions_->sin_polar[static_cast<std::size_t>(row)];
      const float cosine = directions_->cos_polar[static_cast<std::size_t>(row)];
      const float begin_up = cosine * begin.z();
      const float axis_up = cosine * axis.z();
      const float moment_up = cosine * moment.z();
      std::int32_t* const closed = &closed_[static_cast<std::size_t>(row) * kN];
      for (std::size_t c = 0; c < kN; ++c) {
        const float to_begin = sine * begin_flat[c] + begin_up;
        const float along = sine * axis_flat[c] + axis_up;
        const float to_end = to_begin + along;
        const float skew = sine * moment_flat[c] + moment_up;
        // Nearest approach of the ray's line and the axis' line: at share s = numerator /
        // denominator of the axis, at distance |skew| / sqrt(denominator). It is ahead of the
        // origin if to_begin + s along > 0.
        const float denominator = axis_axis - along * along;
        const float numerator = to_begin * along - begin_axis;
        const int side = (skew * skew < square * denominator) & (numerator >= 0) &
                         (numerator <= denominator) &
                         (to_begin * denominator + numerator * along > 0);
        const int begin_ball = (to_begin > 0) & (to_begin * to_begin > begin_free);
        const int end_ball = (to_end > 0) & (to_end * to_end > end_free);
        closed[c] |= side | begin_ball | end_ball;
      }
    }
  }

  struct Piece {
    std::uint32_t point;
    int turns;
    float copy_x, copy_y;
    bool operator==(const Piece&) const = default;
  };

  const TileScene* scene_;
  const Directions* directions_;
  int rows_;
  Vec3 origin_ = Vec3::Zero();
  std::vector<std::int32_t> closed_;  // [row][column]
  std::vector<Piece> projected_;
};

}  // namespace

SphericalMap VisibilityMaps::map(std::size_t i) const {
  std::vector<std::uint64_t> all(SphericalMap::word_count(kResolution), 0);
  const auto from = words.begin() + static_cast<std::ptrdiff_t>(i * words_per_map());
  std::copy(from, from + static_cast<std::ptrdiff_t>(words_per_map()), all.begin());
  return {kResolution, all};
}

void VisibilityMaps::append(const VisibilityMaps& next) {
  assert(next.both_sides == both_sides && next.first_segment == first_segment + count());
  words.insert(words.end(), next.words.begin(), next.words.end());
  sees_nothing.insert(sees_nothing.end(), next.sees_nothing.begin(), next.sees_nothing.end());
}

VisibilityMaps bake_visibility_maps(const TileScene& scene, const SegmentOrigins& origins,
                                    bool both_sides, std::uint32_t first, std::uint32_t last) {
  assert(first <= last && last <= scene.exemplar().segment_count());
  assert(origins.position.size() == scene.exemplar().segment_count());
  static const Directions directions;
  VisibilityMaps maps;
  maps.first_segment = first;
  maps.both_sides = both_sides;
  maps.sees_nothing.resize(last - first);
  maps.words.resize(maps.count() * maps.words_per_map(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, maps.count(), 16),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      MapTracer tracer(scene, directions, both_sides);
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        const std::uint32_t segment = first + static_cast<std::uint32_t>(i);
                        const bool any_open = tracer.trace(segment, origins.position[segment],
                                                           &maps.words[i * maps.words_per_map()]);
                        maps.sees_nothing[i] = any_open ? 0 : 1;
                      }
                    });
  return maps;
}

void write_visibility_maps(const std::filesystem::path& path, const VisibilityMaps& maps,
                           const std::map<std::string, std::string>& metadata) {
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "visibility maps");
  set_light_from(file, maps.both_sides);
  const std::array<std::uint32_t, 1> first = {maps.first_segment};
  file.add<std::uint32_t>("first_segment", {1}, first);
  file.add<std::uint64_t>("maps", {maps.count(), maps.words_per_map()}, maps.words);
  file.write(path);
}

VisibilityMaps read_visibility_maps(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  VisibilityMaps maps;
  maps.both_sides = get_light_from(file);
  maps.first_segment = file.get<std::uint32_t>("first_segment", {1})[0];
  maps.words = file.get<std::uint64_t>("maps", {0, maps.words_per_map()});
  const std::size_t count = maps.words.size() / maps.words_per_map();
  for (std::size_t i = 0; i < count; ++i) {
    const auto begin = maps.words.begin() + static_cast<std::ptrdiff_t>(i * maps.words_per_map());
    const bool closed =
        std::all_of(begin, begin + static_cast<std::ptrdiff_t>(maps.words_per_map()),
                    [](std::uint64_t word) { return word == 0; });
    maps.sees_nothing.push_back(closed ? 1 : 0);
  }
  return maps;
}

}  // namespace heddle
