#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "fibers/math/quadrature.h"
#include "fibers/math/sg_sum_fit.h"
#include "fibers/math/signed_distance.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/math/spherical_map.h"
#include "pipeline/eval/eval_quantities.h"

namespace heddle {
namespace {

// What one request may cost: about a second, and 70 MB.
constexpr std::size_t kMaxResolution = 256;
constexpr std::size_t kMaxCellsTimesGaussians = std::size_t{1} << 24;
constexpr std::size_t kMaxCellsTimesDirections = std::size_t{1} << 22;

// A Gaussian this sharp is 1e-6 wide. If it is sharper, the integral over the map changes only
// within that distance of an edge.
constexpr double kSharpest = 1e12;

SphericalMap read_map(EvalObject& request) {
  const nlohmann::json& rows = request.value("map");
  if (!rows.is_array() || rows.empty() || rows.size() > kMaxResolution) {
    request.fail("map", "expected 1 to " + std::to_string(kMaxResolution) + " strings");
  }
  const auto n = static_cast<int>(rows.size());
  SphericalMap map(n);
  for (int row = 0; row < n; ++row) {
    const nlohmann::json& cells = rows[static_cast<std::size_t>(row)];
    const auto* text = cells.get_ptr<const std::string*>();
    if (text == nullptr || text->size() != rows.size() ||
        text->find_first_not_of("01") != std::string::npos) {
      request.fail("map", "row " + std::to_string(row) + ": expected " + std::to_string(n) +
                              " characters 0 or 1");
    }
    for (int column = 0; column < n; ++column)
      map.set(row, column, (*text)[static_cast<std::size_t>(column)] == '1');
  }
  return map;
}

std::size_t cell_count(const SphericalMap& map) {
  return static_cast<std::size_t>(map.resolution()) * static_cast<std::size_t>(map.resolution());
}

std::vector<Vec3d> read_directions(EvalObject& request, const SphericalMap& map) {
  const nlohmann::json& list = request.value("directions");
  if (!list.is_array()) request.fail("directions", "expected a list of directions");
  const std::size_t most = kMaxCellsTimesDirections / cell_count(map);
  if (list.size() > most) {
    request.fail("directions",
                 "expected at most " + std::to_string(most) + " with a map of this size");
  }
  std::vector<Vec3d> directions;
  for (const nlohmann::json& item : list) {
    const std::string name = "directions[" + std::to_string(directions.size()) + "]";
    const bool numbers =
        item.is_array() && item.size() == 3 &&
        std::all_of(item.begin(), item.end(), [](const auto& x) { return x.is_number(); });
    if (!numbers) throw EvalError("field \"" + name + "\": expected 3 numbers");
    directions.push_back(unit_vector(Vec3d(item[0], item[1], item[2]), name));
  }
  return directions;
}

// Open cells below the horizon need axes there.
FibonacciSet default_axes(const SphericalMap& map) {
  const int n = map.resolution();
  for (int row = (n + 1) / 2; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      if (map.open(row, column)) return FibonacciSet::kSphere;
    }
  }
  return FibonacciSet::kHemisphere;
}

SgSumShape read_shape(EvalObject& request, const SphericalMap& map) {
  SgSumShape shape;
  shape.axes = default_axes(map);
  if (request.has("axes")) {
    const std::string axes = request.choice("axes", {"printed", "hemisphere", "sphere"});
    shape.axes = axes == "printed"  ? FibonacciSet::kPrinted
                 : axes == "sphere" ? FibonacciSet::kSphere
                                    : FibonacciSet::kHemisphere;
  }
  if (request.has("count")) {
    const std::size_t most = std::min<std::size_t>(1024, kMaxCellsTimesGaussians / cell_count(map));
    shape.count = request.integer("count", 1, static_cast<int>(most));
  }
  shape.sharpness = request.has("sharpness_svf") ? request.sharpness("sharpness_svf")
                                                 : default_sg_sharpness(shape.axes);
  if (request.choice("weights", {"voronoi", "nnls"}, "nnls") == "voronoi")
    shape.weights = SgWeights::kVoronoi;
  return shape;
}

// Integral of the Gaussian over part of a cell: polar angles and azimuths from `begin` to `end`.
// Halved until the parts are half a Gaussian's width. Five points per axis are then exact to 1e-10.
// Parts 9 widths away hold less than 1e-17.
double integrate(const SphericalGaussian& gaussian, double polar_begin, double polar_end,
                 double azimuth_begin, double azimuth_end) {
  const double width = 1 / std::sqrt(std::max(gaussian.sharpness, 1.0));
  const double polar = 0.5 * (polar_begin + polar_end);
  const double azimuth = 0.5 * (azimuth_begin + azimuth_end);
  const double widest = polar_begin < kPi / 2 && polar_end > kPi / 2
                            ? 1.0
                            : std::max(std::sin(polar_begin), std::sin(polar_end));
  const double height = polar_end - polar_begin;
  const double breadth = widest * (azimuth_end - azimuth_begin);
  const Vec3d centre(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                     std::cos(polar));
  if ((centre - gaussian.axis).norm() > 9 * width + 0.5 * (height + breadth)) return 0;
  if (height > 0.5 * width && height >= breadth) {
    return integrate(gaussian, polar_begin, polar, azimuth_begin, azimuth_end) +
           integrate(gaussian, polar, polar_end, azimuth_begin, azimuth_end);
  }
  if (breadth > 0.5 * width) {
    return integrate(gaussian, polar_begin, polar_end, azimuth_begin, azimuth) +
           integrate(gaussian, polar_begin, polar_end, azimuth, azimuth_end);
  }
  const QuadratureRule& rule = gauss_legendre(5);
  double sum = 0;
  for (std::size_t a = 0; a < rule.nodes.size(); ++a) {
    const double p = polar + 0.5 * height * rule.nodes[a];
    for (std::size_t b = 0; b < rule.nodes.size(); ++b) {
      const double q = azimuth + 0.5 * (azimuth_end - azimuth_begin) * rule.nodes[b];
      const Vec3d w(std::sin(p) * std::cos(q), std::sin(p) * std::sin(q), std::cos(p));
      sum += rule.weights[a] * rule.weights[b] * std::sin(p) * sg_value(gaussian, w);
    }
  }
  return sum * 0.25 * height * (azimuth_end - azimuth_begin);
}

double map_integral(const SphericalMap& map, const SphericalGaussian& gaussian) {
  const LatLongGrid& grid = map.grid();
  double sum = 0;
  for (int row = 0; row < map.resolution(); ++row) {
    for (int column = 0; column < map.resolution(); ++column) {
      if (!map.open(row, column)) continue;
      sum += integrate(gaussian, row * grid.row_step(), (row + 1) * grid.row_step(),
                       column * grid.column_step(), (column + 1) * grid.column_step());
    }
  }
  return sum / sg_mass(gaussian.sharpness);
}

}  // namespace

nlohmann::json eval_visibility(EvalObject& request) {
  const SphericalMap map = read_map(request);
  const std::vector<Vec3d> directions = read_directions(request, map);
  const SgSumShape shape = read_shape(request, map);
  const bool has_light = request.has("sharpness");
  const double light_sharpness = has_light ? request.sharpness("sharpness") : 0;
  request.finish();

  const ExactSignedDistance signed_distance(map);
  const SgSumFit fit(map.resolution(), shape);
  const Eigen::VectorXd weights = fit.weights(map);
  nlohmann::json value = {{"ssdf", nlohmann::json::array()}, {"sg_sum", nlohmann::json::array()}};
  if (has_light) {
    for (const char* name : {"ssdf_integral", "sg_sum_integral", "quadrature"})
      value[name] = nlohmann::json::array();
  }
  for (const Vec3d& direction : directions) {
    const double distance = signed_distance(direction);
    value["ssdf"].push_back(distance);
    value["sg_sum"].push_back(sg_sum_value(fit.axes(), weights, shape.sharpness, direction));
    if (!has_light) continue;
    value["ssdf_integral"].push_back(0.5 *
                                     (1 + std::erf(std::sqrt(0.5 * light_sharpness) * distance)));
    value["sg_sum_integral"].push_back(
        sg_sum_integral(fit.axes(), weights, shape.sharpness, direction, light_sharpness));
    value["quadrature"].push_back(
        map_integral(map, {direction, std::min(light_sharpness, kSharpest)}));
  }
  return value;
}

}  // namespace heddle
