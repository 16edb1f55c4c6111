#include "fibers/cloth/synthesize.h"

#include <algorithm>
#include <cmath>

#include "fibers/cloth/fibers_of_yarn.h"
#include "fibers/cloth/yarn_paths.h"

namespace heddle {

Exemplar synthesize(const FabricConfig& config) {
  const YarnPaths paths = lay_yarns(config);
  Exemplar exemplar;
  exemplar.width_mm = static_cast<float>(paths.width_mm);
  exemplar.height_mm = static_cast<float>(paths.height_mm);
  for (const FiberType& fiber : config.fibers) exemplar.scattering.push_back(fiber.scattering);
  exemplar.first_point.push_back(0);
  std::uint32_t yarn_index = 0;
  auto add_system = [&](const YarnConfig& yarn, const std::vector<YarnPath>& system) {
    for (const YarnPath& path : system) {
      add_fibers_of_yarn(yarn, config.fibers[static_cast<std::size_t>(yarn.fiber)].radius_mm, path, config.segment_mm,
                         config.seed, yarn_index++, exemplar);
    }
  };
  add_system(config.warp, paths.warp);
  add_system(config.weft, paths.weft);
  // The last point of a fiber is its first, one period on, to the last bit.
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    const Vec3& first = exemplar.points[exemplar.first_point[f]];
    Vec3& last = exemplar.points[exemplar.first_point[f + 1] - 1];
    const bool along_x = last.x() - first.x() > last.y() - first.y();
    last = first + (along_x ? Vec3(exemplar.width_mm, 0, 0) : Vec3(0, exemplar.height_mm, 0));
  }
  index_segments(exemplar);
  return exemplar;
}

ExemplarSummary summarize(const Exemplar& exemplar) {
  ExemplarSummary summary;
  summary.fibers = exemplar.fiber_count();
  summary.segments = exemplar.segment_count();
  summary.thickness_mm = static_cast<double>(exemplar.z_max) - exemplar.z_min;
  const double area = static_cast<double>(exemplar.width_mm) * exemplar.height_mm;
  double length = 0;
  double volume = 0;
  double squared_angle = 0;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const std::uint32_t p = exemplar.segment_point[s];
    const std::uint32_t f = exemplar.segment_fiber[s];
    const Vec3d d = (exemplar.points[p + 1] - exemplar.points[p]).cast<double>();
    const double l = d.norm();
    const double r = exemplar.radius_mm[f];
    const Vec3 period = exemplar.points[exemplar.first_point[f + 1] - 1] - exemplar.points[exemplar.first_point[f]];
    const double in_plane = period.x() > period.y() ? std::atan2(d.y(), d.x()) : std::atan2(d.x(), d.y());
    length += l;
    volume += l * kPi * r * r;
    squared_angle += l * in_plane * in_plane;
  }
  summary.mean_segment_mm = length / static_cast<double>(summary.segments);
  summary.areal_fiber_length_per_mm2 = length / area;
  summary.volume_fraction = volume / (area * summary.thickness_mm);
  summary.wander_rms_deg = degrees(std::sqrt(squared_angle / length));
  return summary;
}

}  // namespace heddle
