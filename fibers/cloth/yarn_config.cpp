#include "fibers/cloth/yarn_config.h"

#include <algorithm>
#include <cmath>

#include "fibers/cloth/yarn_file.h"

namespace heddle {
namespace {

constexpr double kYarnMmPerUm = 1e-3;

Rgbd color(const TomlTable& table, std::string_view key) {
  const auto c = table.number3(key, {.min = 0, .max = 1});
  return {c[0], c[1], c[2]};
}

}  // namespace

FiberType read_fiber(const TomlTable& table, const std::string& name) {
  FiberType fiber;
  fiber.name = name;
  fiber.radius_mm = kYarnMmPerUm * table.number("radius_um", {.min = 0.1, .max = 1000});
  if (table.choice("scattering", {"khungurn", "white-isotropic"}, "khungurn") ==
      "white-isotropic") {
    fiber.scattering.isotropic_white = true;
    return fiber;
  }
  fiber.scattering.color_r = color(table, "color_r");
  fiber.scattering.color_tt = color(table, "color_tt");
  const NumberRange width{.min = 0.1, .max = 60};
  fiber.scattering.beta_r = radians(table.number("beta_r_deg", width));
  fiber.scattering.beta_tt = radians(table.number("beta_tt_deg", width));
  fiber.scattering.gamma_tt = radians(table.number("gamma_tt_deg", {.min = 1, .max = 180}));
  return fiber;
}

double YarnConfig::round_radius_mm(double fiber_radius_mm) const {
  if (ply_mm) return reach_of(*ply_mm);
  return std::sqrt((0.5 * width_mm - fiber_radius_mm) * (0.5 * height_mm - fiber_radius_mm));
}

YarnConfig read_yarn(const TomlTable& table, const std::string& name,
                     const std::vector<FiberType>& fibers) {
  YarnConfig yarn;
  yarn.name = name;
  const std::string fiber = table.string("fiber");
  const auto found = std::find_if(fibers.begin(), fibers.end(), [&](const FiberType& candidate) {
    return candidate.name == fiber;
  });
  if (found == fibers.end()) {
    std::string known;
    for (const FiberType& candidate : fibers) known += (known.empty() ? "" : ", ") + candidate.name;
    table.fail("fiber", "expected the name of a [fiber.NAME] table: " + known);
  }
  yarn.fiber = static_cast<int>(found - fibers.begin());
  const double radius = found->radius_mm;
  if (table.has("from")) {
    read_yarn_file(table, radius, yarn);
    return yarn;
  }
  yarn.width_mm = table.number("width_mm", {.min = 1e-3, .max = 100});
  yarn.height_mm = table.number("height_mm", {.min = 1e-3, .max = 100});
  if (yarn.width_mm <= 2 * radius)
    table.fail("width_mm", "expected more than the thickness of one fiber");
  if (yarn.height_mm <= 2 * radius)
    table.fail("height_mm", "expected more than the thickness of one fiber");
  yarn.plies = static_cast<int>(table.integer("plies", 1, 12));
  yarn.fibers_per_ply = static_cast<int>(table.integer("fibers_per_ply", 1, 2000));
  const NumberRange twist{.min = -5000, .max = 5000};
  yarn.yarn_turns_per_mm = 1e-3 * table.number("yarn_twist_per_m", twist);
  yarn.ply_turns_per_mm = 1e-3 * table.number("ply_twist_per_m", twist);
  yarn.migration = table.number("migration", {.min = 0, .max = 1});
  yarn.wander_rms = radians(table.number("wander_rms_deg", {.min = 0, .max = 30}));
  read_irregularities(table, yarn);
  return yarn;
}

}  // namespace heddle
