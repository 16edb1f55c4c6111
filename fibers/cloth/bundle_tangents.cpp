#include "fibers/cloth/bundle_tangents.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <utility>

namespace heddle {
namespace {

constexpr float kBundleRadii = 4;
constexpr float kLeastCosine = 0.9F;  // between tangents of one bundle

// Columns along an axis. Those of any real fabric are fewer; more would be finer than a float tells
// places apart.
constexpr float kMostColumns = 4096;

}  // namespace

std::vector<Vec3> bundle_tangents(const Exemplar& exemplar) {
  const auto segments = static_cast<std::uint32_t>(exemplar.segment_count());
  std::vector<Vec3> midpoint(segments);
  std::vector<Vec3> tangent(segments);
  float reach = 0;
  for (std::uint32_t s = 0; s < segments; ++s) {
    midpoint[s] = exemplar.segment_midpoint(s);
    tangent[s] = exemplar.segment_tangent(s);
    reach = std::max(reach, kBundleRadii * exemplar.radius_mm[exemplar.segment_fiber[s]]);
  }

  // Columns over the period, at least `reach` wide, so that a segment's neighbours lie in its own
  // column and those around it.
  const auto columns = [reach](float period) {
    return std::max(1, static_cast<int>(std::min(period / reach, kMostColumns)));
  };
  const int nx = columns(exemplar.width_mm);
  const int ny = columns(exemplar.height_mm);
  const auto column_of = [](float place, float period, int count) {
    const float share = place / period - std::floor(place / period);
    return std::min(count - 1, static_cast<int>(share * static_cast<float>(count)));
  };
  const auto place_of = [&](std::uint32_t s) {
    return std::pair{column_of(midpoint[s].x(), exemplar.width_mm, nx),
                     column_of(midpoint[s].y(), exemplar.height_mm, ny)};
  };
  // Most columns of sparse yarns are empty: the segments are sorted by their column, instead of a
  // list for each column.
  struct Member {
    int column;
    std::uint32_t segment;
    auto operator<=>(const Member&) const = default;
  };
  std::vector<Member> members;
  for (std::uint32_t s = 0; s < segments; ++s) {
    const auto [x, y] = place_of(s);
    members.push_back({y * nx + x, s});
  }
  std::sort(members.begin(), members.end());
  // With fewer than three columns around a period, a step to either side would meet the same column
  // twice.
  const auto first_step = [](int count) { return count > 2 ? -1 : 0; };
  const auto last_step = [](int count) { return count > 1 ? 1 : 0; };

  std::vector<Vec3> mean(segments);
  tbb::parallel_for(std::uint32_t{0}, segments, [&](std::uint32_t s) {
    const float radius = kBundleRadii * exemplar.radius_mm[exemplar.segment_fiber[s]];
    const auto [x, y] = place_of(s);
    Vec3 sum = tangent[s];
    for (int dy = first_step(ny); dy <= last_step(ny); ++dy) {
      for (int dx = first_step(nx); dx <= last_step(nx); ++dx) {
        const int column = (y + dy + ny) % ny * nx + (x + dx + nx) % nx;
        for (auto member = std::lower_bound(members.begin(), members.end(), Member{column, 0});
             member != members.end() && member->column == column; ++member) {
          const std::uint32_t other = member->segment;
          if (other == s) continue;
          Vec3 apart = midpoint[other] - midpoint[s];
          apart.x() -= exemplar.width_mm * std::round(apart.x() / exemplar.width_mm);
          apart.y() -= exemplar.height_mm * std::round(apart.y() / exemplar.height_mm);
          const float cosine = tangent[other].dot(tangent[s]);
          if (apart.squaredNorm() > radius * radius || std::abs(cosine) < kLeastCosine) continue;
          sum += cosine > 0 ? tangent[other] : Vec3(-tangent[other]);
        }
      }
    }
    mean[s] = sum.normalized();
  });
  return mean;
}

double bundle_spread(const Exemplar& exemplar, std::span<const Vec3> bundle_tangent) {
  double sum = 0;
  for (std::uint32_t s = 0; s < bundle_tangent.size(); ++s) {
    const Vec3 tangent = exemplar.segment_tangent(s);
    const double angle =
        std::atan2(tangent.cross(bundle_tangent[s]).norm(), tangent.dot(bundle_tangent[s]));
    sum += angle * angle;
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, bundle_tangent.size())));
}

}  // namespace heddle
