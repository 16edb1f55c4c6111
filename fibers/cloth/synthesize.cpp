#include "fibers/cloth/synthesize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "fibers/cloth/fibers_of_yarn.h"
#include "fibers/cloth/sampled_line.h"
#include "fibers/cloth/yarn_paths.h"
#include "formats/memory_need.h"

namespace heddle {

namespace {

// A point is stored as 3 floats, a segment as two indices; writing copies them twice.
constexpr double kPointBytesPerSegment = 3 * 20;
constexpr double kMostSegments = 0x1p31;

using AddYarn =
    std::function<void(const YarnConfig&, const CentreLine&, const BlocksOfYarn& blocks)>;

/// The blocks along yarn `place` of a system that must fit, if any.
BlocksOfYarn blocks_along(const FabricConfig& config, bool is_warp, int place) {
  const auto [x, y] = config.fitting_blocks;
  if (x == 0) return {};
  const int warp_yarns = config.weave.ends * config.repeats_x;
  const int pattern_yarn =
      is_warp ? place % (config.weave.ends * x) : warp_yarns + place % (config.weave.picks * y);
  return {is_warp ? config.repeats_y / y : config.repeats_x / x,
          static_cast<std::uint32_t>(pattern_yarn)};
}

void add_courses(const FabricConfig& config, Exemplar& exemplar, const AddYarn& add_yarn) {
  const KnitConfig& knit = *config.knit;
  exemplar.width_mm = static_cast<float>(knit.width_mm());
  exemplar.height_mm = static_cast<float>(knit.height_mm());
  const LoopForm loop = solve_loop(knit, thickest_yarn_mm(config, knit.sequence));
  for (int course = 0; course < knit.courses; ++course) {
    const YarnConfig& yarn = config.yarn(knit.yarn_of(course));
    add_yarn(yarn, centre_line_of_course(loop, knit, course, yarn.width_mm, yarn.height_mm), {});
  }
}

void add_curves(const FabricConfig& config, Exemplar& exemplar, const AddYarn& add_yarn) {
  const CurvesConfig& curves = *config.curves;
  exemplar.width_mm = static_cast<float>(curves.size_mm[0]);
  exemplar.height_mm = static_cast<float>(curves.size_mm[1]);
  for (const TileCurve& curve : curves_on_tile(curves, config.segment_mm, nullptr)) {
    if (curves.as_yarns) {
      const YarnConfig& yarn = config.yarn(curves.yarn_of(curve.curve));
      add_yarn(yarn,
               sampled_line(curve.points, steady_ups(curve.points, curve.is_open), yarn.width_mm,
                            yarn.height_mm, curve.is_open),
               {});
      continue;
    }
    for (const Vec3d& point : curve.points) exemplar.points.push_back(point.cast<float>());
    const double own = config.fibers[static_cast<std::size_t>(curves.fiber)].radius_mm;
    end_fiber(exemplar, curves.radius_mm(curve, own), curves.fiber,
              static_cast<std::uint32_t>(curve.curve), curve.is_open);
  }
}

// The last point of a fiber that goes on is its first, one period on, to the last bit.
void close_periods(Exemplar& exemplar) {
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    if (exemplar.is_open[f] != 0) continue;
    const Vec3& first = exemplar.points[exemplar.first_point[f]];
    Vec3& last = exemplar.points[exemplar.first_point[f + 1] - 1];
    const Vec3 on = last - first;
    const bool along_x = std::abs(on.x()) > std::abs(on.y());
    last = first + (along_x ? Vec3(std::copysign(exemplar.width_mm, on.x()), 0, 0)
                            : Vec3(0, std::copysign(exemplar.height_mm, on.y()), 0));
  }
}

}  // namespace

ExemplarForecast forecast_exemplar(const FabricConfig& config) {
  ExemplarForecast forecast;
  const auto add_yarn = [&](const YarnConfig& yarn, double length_mm, int blocks) {
    forecast.segments += segments_of_yarn(yarn, length_mm, config.segment_mm, blocks);
    ++forecast.yarns;
  };
  double area = 0;
  if (config.knit) {
    const KnitConfig& knit = *config.knit;
    area = knit.width_mm() * knit.height_mm();
    for (int course = 0; course < knit.courses; ++course)
      add_yarn(config.yarn(knit.yarn_of(course)), knit.wales * usual_loop_length(knit), 0);
  } else if (config.curves) {
    area = config.curves->size_mm[0] * config.curves->size_mm[1];
    for (const TileCurve& curve : curves_on_tile(*config.curves, config.segment_mm, nullptr)) {
      if (config.curves->as_yarns) {
        add_yarn(config.yarn(config.curves->yarn_of(curve.curve)), length_of(curve), 0);
      } else {
        forecast.segments += static_cast<double>(curve.points.size() - 1);
      }
    }
  } else {
    const double width = warp_places(config).period_mm;
    const double height = weft_places(config).period_mm;
    area = width * height;
    // Whole sequences fill the tile.
    const auto add_system = [&](bool is_warp, int count, double period_mm) {
      const ThreadSystem& system = is_warp ? config.warp : config.weft;
      for (int k = 0; k < count; ++k) {
        add_yarn(config.yarn(system.yarn_at(k)), period_mm, blocks_along(config, is_warp, k).count);
      }
    };
    add_system(true, config.weave.ends * config.repeats_x, height);
    add_system(false, config.weave.picks * config.repeats_y, width);
  }
  if (config.pile) forecast.segments += segments_of_pile(*config.pile, area, config.segment_mm);
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
  Exemplar exemplar;
  for (const FiberType& fiber : config.fibers) exemplar.scattering.push_back(fiber.scattering);
  exemplar.first_point.push_back(0);
  // fibers have a point more than segments
  exemplar.points.reserve(static_cast<std::size_t>(1.25 * forecast.segments));
  std::uint32_t yarn_index = 0;
  const auto add_yarn = [&](const YarnConfig& yarn, const CentreLine& line,
                            const BlocksOfYarn& blocks) {
    add_fibers_of_yarn(yarn, config.fiber_of(yarn).radius_mm, line, config.segment_mm, config.seed,
                       yarn_index++, exemplar, blocks);
    yarn_done();
  };
  if (config.knit) {
    add_courses(config, exemplar, add_yarn);
  } else if (config.curves) {
    add_curves(config, exemplar, add_yarn);
  } else {
    const YarnPaths paths = lay_yarns(config);
    exemplar.width_mm = static_cast<float>(paths.width_mm);
    exemplar.height_mm = static_cast<float>(paths.height_mm);
    const auto add_system = [&](bool is_warp, const std::vector<YarnPath>& lines) {
      const ThreadSystem& system = is_warp ? config.warp : config.weft;
      for (int k = 0; k < static_cast<int>(lines.size()); ++k) {
        add_yarn(config.yarn(system.yarn_at(k)), centre_line(lines[static_cast<std::size_t>(k)]),
                 blocks_along(config, is_warp, k));
      }
    };
    add_system(true, paths.warp);
    add_system(false, paths.weft);
  }
  close_periods(exemplar);
  if (config.pile) {
    add_pile(*config.pile, config.fibers[static_cast<std::size_t>(config.pile->fiber)].radius_mm,
             config.segment_mm, config.seed, yarn_index, exemplar);
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
  double length_going_on = 0;
  double squared_angle = 0;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const std::uint32_t p = exemplar.segment_point[s];
    const std::uint32_t f = exemplar.segment_fiber[s];
    const Vec3d d = (exemplar.points[p + 1] - exemplar.points[p]).cast<double>();
    const double l = d.norm();
    const double r = exemplar.radius_mm[f];
    const Vec3 period =
        exemplar.points[exemplar.first_point[f + 1] - 1] - exemplar.points[exemplar.first_point[f]];
    length += l;
    volume += l * kPi * r * r;
    if (exemplar.is_open[f] != 0) continue;
    const double in_plane = std::abs(period.x()) > std::abs(period.y()) ? std::atan2(d.y(), d.x())
                                                                        : std::atan2(d.x(), d.y());
    length_going_on += l;
    squared_angle += l * in_plane * in_plane;
  }
  summary.mean_segment_mm = length / static_cast<double>(summary.segments);
  summary.areal_fiber_length_per_mm2 = length / area;
  summary.volume_fraction = volume / (area * summary.thickness_mm);
  summary.wander_rms_deg = degrees(std::sqrt(squared_angle / std::max(length_going_on, 1e-9)));
  return summary;
}

}  // namespace heddle
