#include "fibers/cloth/exemplar.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "formats/input_error.h"
#include "formats/tensor_file.h"

namespace heddle {
namespace {

[[noreturn]] void broken(const std::string& name, int invariant, const std::string& what) {
  throw FileError(
      fmt::format("{}: invariant {} of the exemplar does not hold: {}", name, invariant, what));
}

// Invariant 1 alone: what index_segments() relies on.
void validate_layout(const Exemplar& e, const std::string& name) {
  const std::size_t fibers = e.radius_mm.size();
  if (fibers == 0 || e.first_point.size() != fibers + 1 || e.material.size() != fibers ||
      e.yarn.size() > fibers || e.is_open.size() > fibers || e.first_point[0] != 0 ||
      e.first_point.back() != e.points.size()) {
    broken(name, 1, "the fibers do not cover the points exactly");
  }
  for (std::size_t f = 0; f < fibers; ++f) {
    if (e.first_point[f + 1] < e.first_point[f] + 3 || e.first_point[f + 1] > e.points.size()) {
      broken(name, 1, fmt::format("fiber {} has fewer than 2 segments", f));
    }
  }
}

constexpr float kMaxHeightMm = 1e3F;
constexpr float kMinRadiusMm = 1e-6F;

// Invariant 2. Code that comes later walks over the copies of a fiber by whole tiles.
void validate_sizes(const Exemplar& e, const std::string& name) {
  const auto is_length = [](float length) { return length > 0 && length <= kMaxTileMm; };
  if (!is_length(e.width_mm) || !is_length(e.height_mm)) {
    broken(name, 2,
           fmt::format("a tile of {} x {} mm is not between 0 and {} mm", e.width_mm, e.height_mm,
                       kMaxTileMm));
  }
  for (std::size_t f = 0; f < e.fiber_count(); ++f) {
    const float r = e.radius_mm[f];
    if (!(r >= kMinRadiusMm && r < 0.5F * std::min(e.width_mm, e.height_mm))) {
      broken(name, 2, fmt::format("fiber {} has radius {} mm", f, r));
    }
    for (std::uint32_t p = e.first_point[f]; p < e.first_point[f + 1]; ++p) {
      const Vec3& point = e.points[p];
      const auto is_near = [](float x, float period) { return x >= -period && x <= 2 * period; };
      if (!is_near(point.x(), e.width_mm) || !is_near(point.y(), e.height_mm) ||
          !(std::abs(point.z()) <= kMaxHeightMm)) {
        broken(
            name, 2,
            fmt::format(
                "point {} of fiber {} lies at ({}, {}, {}) mm, far from a tile of {} x {} mm",
                p - e.first_point[f], f, point.x(), point.y(), point.z(), e.width_mm, e.height_mm));
      }
    }
  }
}

// Invariant 6.
void validate_scattering(const Exemplar& e, const std::string& name) {
  if (e.scattering.size() > kMaxMaterials) {
    broken(name, 5, fmt::format("{} materials (at most {})", e.scattering.size(), kMaxMaterials));
  }
  for (std::size_t m = 0; m < e.scattering.size(); ++m) {
    const FiberScattering& fiber = e.scattering[m];
    if (fiber.isotropic_white) continue;
    const auto is_share = [](const Rgbd& color) {
      return (color >= 0).all() && (color <= 1).all();
    };
    const auto is_width = [](double width, double most_deg) {
      return width >= radians(0.01) && width <= radians(most_deg);
    };
    if (!is_share(fiber.color_r) || !is_share(fiber.color_tt)) {
      broken(name, 6, fmt::format("a colour of material {} is outside [0, 1]", m));
    }
    if (!is_width(fiber.beta_r, 90) || !is_width(fiber.beta_tt, 90) ||
        !is_width(fiber.gamma_tt, 360)) {
      broken(name, 6,
             fmt::format("material {} has lobes of {}, {} and {} radians", m, fiber.beta_r,
                         fiber.beta_tt, fiber.gamma_tt));
    }
  }
}

// Per material: color_r, color_tt, beta_r, beta_tt, gamma_tt, isotropic_white.
constexpr std::size_t kScatteringNumbers = 10;

}  // namespace

void end_fiber(Exemplar& e, double radius_mm, int material, std::uint32_t yarn, bool is_open) {
  e.first_point.push_back(static_cast<std::uint32_t>(e.points.size()));
  e.radius_mm.push_back(static_cast<float>(radius_mm));
  e.material.push_back(static_cast<std::uint16_t>(material));
  e.yarn.push_back(yarn);
  e.is_open.push_back(is_open ? 1 : 0);
}

void index_segments(Exemplar& e) {
  e.yarn.resize(e.fiber_count(), 0);
  e.is_open.resize(e.fiber_count(), 0);
  e.segment_point.clear();
  e.segment_fiber.clear();
  e.segment_point.reserve(e.points.size() - e.fiber_count());
  e.segment_fiber.reserve(e.points.size() - e.fiber_count());
  e.z_min = std::numeric_limits<float>::infinity();
  e.z_max = -e.z_min;
  for (std::uint32_t f = 0; f < e.fiber_count(); ++f) {
    for (std::uint32_t p = e.first_point[f]; p < e.first_point[f + 1]; ++p) {
      e.z_min = std::min(e.z_min, e.points[p].z() - e.radius_mm[f]);
      e.z_max = std::max(e.z_max, e.points[p].z() + e.radius_mm[f]);
      if (p + 1 == e.first_point[f + 1]) break;
      e.segment_point.push_back(p);
      e.segment_fiber.push_back(f);
    }
  }
}

void validate_exemplar(const Exemplar& e, const std::string& name) {
  validate_layout(e, name);
  validate_sizes(e, name);
  validate_scattering(e, name);
  for (std::size_t f = 0; f < e.fiber_count(); ++f) {
    const float r = e.radius_mm[f];
    const Vec3 period = e.points[e.first_point[f + 1] - 1] - e.points[e.first_point[f]];
    const float tolerance = 1e-5F * std::max(e.width_mm, e.height_mm);
    const Vec3 size = period.cwiseAbs();
    const bool is_open = f < e.is_open.size() && e.is_open[f] != 0;
    if (!is_open && (size - Vec3(e.width_mm, 0, 0)).norm() > tolerance &&
        (size - Vec3(0, e.height_mm, 0)).norm() > tolerance) {
      broken(name, 3, fmt::format("fiber {} does not continue in the next tile", f));
    }
    for (std::uint32_t p = e.first_point[f]; p + 1 < e.first_point[f + 1]; ++p) {
      if ((e.points[p + 1] - e.points[p]).norm() < 1e-3F * r) {
        broken(name, 4, fmt::format("fiber {} has a segment of no length at point {}", f, p));
      }
    }
    if (e.material[f] >= e.scattering.size()) {
      broken(name, 5,
             fmt::format("fiber {} has material {} of {}", f, e.material[f], e.scattering.size()));
    }
  }
}

void write_exemplar(const std::filesystem::path& path, const Exemplar& e,
                    const std::map<std::string, std::string>& metadata) {
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "fibers");
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  const std::span<const float> points(e.points.data()->data(), 3 * e.points.size());
  std::vector<double> scattering;
  for (const FiberScattering& s : e.scattering) {
    for (const Rgbd* color : {&s.color_r, &s.color_tt}) {
      scattering.insert(scattering.end(), {color->x(), color->y(), color->z()});
    }
    scattering.insert(scattering.end(),
                      {s.beta_r, s.beta_tt, s.gamma_tt, s.isotropic_white ? 1.0 : 0.0});
  }
  const float tile[2] = {e.width_mm, e.height_mm};
  file.add<float>("tile_mm", {2}, tile);
  file.add<float>("points_mm", {e.points.size(), 3}, points);
  file.add<std::uint32_t>("first_point", {e.first_point.size()}, e.first_point);
  file.add<float>("radius_mm", {e.radius_mm.size()}, e.radius_mm);
  file.add<std::uint16_t>("material", {e.material.size()}, e.material);
  file.add<std::uint32_t>("yarn", {e.yarn.size()}, e.yarn);
  file.add<std::uint8_t>("is_open", {e.is_open.size()}, e.is_open);
  file.add<double>("scattering", {e.scattering.size(), kScatteringNumbers}, scattering);
  file.write(path);
}

Exemplar read_exemplar(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  Exemplar e;
  const auto tile = file.get<float>("tile_mm", {2});
  e.width_mm = tile[0];
  e.height_mm = tile[1];
  const auto points = file.get<float>("points_mm", {0, 3});
  e.points.reserve(points.size() / 3);
  for (std::size_t i = 0; i + 2 < points.size(); i += 3) {
    e.points.emplace_back(points[i], points[i + 1], points[i + 2]);
  }
  e.first_point = file.get<std::uint32_t>("first_point", {0});
  e.radius_mm = file.get<float>("radius_mm", {0});
  e.material = file.get<std::uint16_t>("material", {0});
  e.yarn = file.get<std::uint32_t>("yarn", {e.radius_mm.size()});
  e.is_open = file.get<std::uint8_t>("is_open", {e.radius_mm.size()});
  const auto scattering = file.get<double>("scattering", {0, kScatteringNumbers});
  for (std::size_t i = 0; i < scattering.size(); i += kScatteringNumbers) {
    const double* v = scattering.data() + i;
    e.scattering.push_back(
        {Rgbd(v[0], v[1], v[2]), Rgbd(v[3], v[4], v[5]), v[6], v[7], v[8], v[9] != 0});
  }
  validate_exemplar(e, path.string());
  index_segments(e);
  return e;
}

}  // namespace heddle
