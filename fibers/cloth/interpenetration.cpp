#include "fibers/cloth/interpenetration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <vector>

#include "fibers/math/wrapped.h"

namespace heddle {
namespace {

// Cells along an axis at most: more would be finer than any fabric's segments.
constexpr float kMostCells = 1024;

/// Segments sorted into cells over the periodic tile; one that a segment can touch lies in its own
/// cell or the next.
class SegmentGrid {
 public:
  explicit SegmentGrid(const Exemplar& exemplar) : exemplar_(&exemplar) {
    float reach = 0;
    for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
      const std::uint32_t p = exemplar.segment_point[s];
      reach = std::max(reach, (exemplar.points[p + 1] - exemplar.points[p]).norm() +
                                  2 * exemplar.radius_mm[exemplar.segment_fiber[s]]);
    }
    const Vec3 size(exemplar.width_mm, exemplar.height_mm, exemplar.z_max - exemplar.z_min);
    for (int axis = 0; axis < 3; ++axis) {
      count_[axis] = std::max(1, static_cast<int>(std::min(size[axis] / reach, kMostCells)));
      per_mm_[axis] = static_cast<float>(count_[axis]) / size[axis];
    }
    members_.reserve(exemplar.segment_count());
    for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s)
      members_.push_back({index(cell_of(exemplar.segment_midpoint(s))), s});
    std::sort(members_.begin(), members_.end());
  }

  /// Calls visit(other) for the segments in the cells about a segment, itself among them.
  template <class Visit>
  void for_each_near(std::uint32_t segment, Visit&& visit) const {
    const std::array<int, 3> middle = cell_of(exemplar_->segment_midpoint(segment));
    for (int dz = -1; dz <= 1; ++dz) {
      const int z = middle[2] + dz;
      if (z < 0 || z >= count_[2]) continue;
      for (int dy = first_step(1); dy <= last_step(1); ++dy) {
        for (int dx = first_step(0); dx <= last_step(0); ++dx) {
          const std::uint64_t cell = index({(middle[0] + dx + count_[0]) % count_[0],
                                            (middle[1] + dy + count_[1]) % count_[1], z});
          for (auto member = std::lower_bound(members_.begin(), members_.end(), Member{cell, 0});
               member != members_.end() && member->cell == cell; ++member) {
            visit(member->segment);
          }
        }
      }
    }
  }

 private:
  struct Member {
    std::uint64_t cell;
    std::uint32_t segment;
    auto operator<=>(const Member&) const = default;
  };

  // With fewer than three cells around a period, a step to either side would meet one cell twice.
  int first_step(std::size_t axis) const { return count_[axis] > 2 ? -1 : 0; }
  int last_step(std::size_t axis) const { return count_[axis] > 1 ? 1 : 0; }

  std::array<int, 3> cell_of(const Vec3& place) const {
    const auto along = [&](int axis, float x) {
      const int cell = static_cast<int>(std::floor(x * per_mm_[axis]));
      const int n = count_[static_cast<std::size_t>(axis)];
      return axis == 2 ? std::clamp(cell, 0, n - 1) : wrapped(cell, n);
    };
    return {along(0, place.x()), along(1, place.y()), along(2, place.z() - exemplar_->z_min)};
  }

  std::uint64_t index(const std::array<int, 3>& cell) const {
    return (static_cast<std::uint64_t>(cell[2]) * static_cast<std::uint64_t>(count_[1]) +
            static_cast<std::uint64_t>(cell[1])) *
               static_cast<std::uint64_t>(count_[0]) +
           static_cast<std::uint64_t>(cell[0]);
  }

  const Exemplar* exemplar_;
  std::array<int, 3> count_{};
  Vec3 per_mm_;
  std::vector<Member> members_;
};

}  // namespace

// The nearest points of two lines, moved onto the pieces one after the other.
float segment_distance(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1) {
  const Vec3 u = p1 - p0;
  const Vec3 v = q1 - q0;
  const Vec3 w = p0 - q0;
  const float uu = u.dot(u);
  const float uv = u.dot(v);
  const float vv = v.dot(v);
  const float uw = u.dot(w);
  const float vw = v.dot(w);
  const float determinant = uu * vv - uv * uv;
  float s = determinant > 1e-7F * uu * vv
                ? std::clamp((uv * vw - vv * uw) / determinant, 0.0F, 1.0F)
                : 0.0F;
  float t = (uv * s + vw) / vv;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0F, 1.0F);
    s = std::clamp((uv * t - uw) / uu, 0.0F, 1.0F);
  }
  return (w + s * u - t * v).norm();
}

Interpenetration measure_interpenetration(const Exemplar& exemplar) {
  const SegmentGrid grid(exemplar);
  const auto segments = static_cast<std::uint32_t>(exemplar.segment_count());
  std::vector<float> depth(segments, 0.0F);
  tbb::parallel_for(std::uint32_t{0}, segments, [&](std::uint32_t s) {
    const std::uint32_t fiber = exemplar.segment_fiber[s];
    const Vec3 p0 = exemplar.points[exemplar.segment_point[s]];
    const Vec3 p1 = exemplar.points[exemplar.segment_point[s] + 1];
    const Vec3 middle = 0.5F * (p0 + p1);
    const float half = 0.5F * (p1 - p0).norm();
    grid.for_each_near(s, [&](std::uint32_t other) {
      const std::uint32_t other_fiber = exemplar.segment_fiber[other];
      if (exemplar.yarn[other_fiber] == exemplar.yarn[fiber]) return;
      const float radii = exemplar.radius_mm[fiber] + exemplar.radius_mm[other_fiber];
      Vec3 q0 = exemplar.points[exemplar.segment_point[other]];
      Vec3 q1 = exemplar.points[exemplar.segment_point[other] + 1];
      Vec3 apart = 0.5F * (q0 + q1) - middle;
      const Vec3 shift(exemplar.width_mm * std::round(apart.x() / exemplar.width_mm),
                       exemplar.height_mm * std::round(apart.y() / exemplar.height_mm), 0);
      apart -= shift;
      const float near = half + 0.5F * (q1 - q0).norm() + radii;
      if (apart.squaredNorm() >= near * near) return;
      const float overlap = radii - segment_distance(p0, p1, q0 - shift, q1 - shift);
      const float thinner = std::min(exemplar.radius_mm[fiber], exemplar.radius_mm[other_fiber]);
      depth[s] = std::max(depth[s], overlap / thinner);
    });
  });
  Interpenetration result;
  for (std::uint32_t s = 0; s < segments; ++s) {
    if (!(depth[s] > 0)) continue;
    result.share += 1.0 / segments;
    result.mean_depth += static_cast<double>(depth[s]);
    if (static_cast<double>(depth[s]) > result.deepest) {
      result.deepest = static_cast<double>(depth[s]);
      result.segment = s;
    }
  }
  if (result.share > 0) result.mean_depth /= result.share * segments;
  return result;
}

}  // namespace heddle
