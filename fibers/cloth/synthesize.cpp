#include "fibers/cloth/synthesize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "fibers/cloth/fibers_of_yarn.h"
#include "fibers/cloth/yarn_paths.h"
#include "formats/memory_need.h"

namespace heddle {

namespace {

// A point is stored as 3 floats, a segment as two indices; writing copies them twice.
constexpr double kPointBytesPerSegment = 3 * 20;
constexpr double kMostSegments = 0x1p31;

}  // namespace

ExemplarForecast forecast_exemplar(const FabricConfig& config) {
  const double width = warp_places(config).period_mm;
  const double height = weft_places(config).period_mm;
  ExemplarForecast forecast;
  const auto add_system = [&](const ThreadSystem& system, double yarns, double period_mm) {
    // Whole sequences fill the tile.
    for (const int k : system.sequence) {
      const YarnConfig& yarn = config.yarns[static_cast<std::size_t>(k)];
      forecast.segments += yarns / static_cast<double>(system.sequence.size()) * yarn.plies *
                           yarn.fibers_per_ply *
                           segments_per_fiber(yarn, period_mm, config.segment_mm);
    }
    forecast.yarns += static_cast<std::uint64_t>(yarns);
  };
  add_system(config.warp, static_cast<double>(config.weave.ends) * config.repeats_x, height);
  add_system(config.weft, static_cast<double>(config.weave.picks) * config.repeats_y, width);
  forecast.bytes = kPointBytesPerSegment * forecast.segments;
  return forecast;
}

Exemplar synthesize(const FabricConfig& config, const std::function<void()>& yarn_done) {
  const ExemplarForecast forecast = forecast_exemplar(config);
  if (forecast.segments > kMostSegments) {
    throw std::invalid_argument(
        fmt::format("the tile would have {:.3g} segments, at most {:.3g} are possible: make "
                    "segment_um larger, repeats or "
                    "fibers_per_ply smaller",
                    forecast.segments, kMostSegments));
  }
  require_memory(static_cast<std::uint64_t>(forecast.bytes),
                 fmt::format("fibers of {:.3g} segments", forecast.segments));
  const YarnPaths paths = lay_yarns(config);
  Exemplar exemplar;
  exemplar.width_mm = static_cast<float>(paths.width_mm);
  exemplar.height_mm = static_cast<float>(paths.height_mm);
  for (const FiberType& fiber : config.fibers) exemplar.scattering.push_back(fiber.scattering);
  exemplar.first_point.push_back(0);
  // fibers have a point more than segments
  exemplar.points.reserve(static_cast<std::size_t>(1.25 * forecast.segments));
  std::uint32_t yarn_index = 0;
  const auto add_system = [&](const ThreadSystem& system, const std::vector<YarnPath>& paths) {
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const YarnConfig& yarn =
          config.yarns[static_cast<std::size_t>(system.yarn_at(static_cast<int>(k)))];
      add_fibers_of_yarn(yarn, config.fibers[static_cast<std::size_t>(yarn.fiber)].radius_mm,
                         centre_line(paths[k]), config.segment_mm, config.seed, yarn_index++,
                         exemplar);
      yarn_done();
    }
  };
  add_system(config.warp, paths.warp);
  add_system(config.weft, paths.weft);
  // The last point of a fiber that goes on is its first, one period on, to the last bit.
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    if (exemplar.is_open[f] != 0) continue;
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
    const Vec3 period =
        exemplar.points[exemplar.first_point[f + 1] - 1] - exemplar.points[exemplar.first_point[f]];
    const double in_plane =
        period.x() > period.y() ? std::atan2(d.y(), d.x()) : std::atan2(d.x(), d.y());
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
