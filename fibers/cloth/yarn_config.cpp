#include "fibers/cloth/yarn_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "fibers/cloth/yarn_count.h"
#include "fibers/cloth/yarn_file.h"

namespace heddle {
namespace {

constexpr double kYarnMmPerUm = 1e-3;

// Packing of fibers in a section: Peirce's 1.1 cm^3 per gram is 0.6 of cotton. That of filament
// yarns is an assumption.
constexpr double kStaplePacking = 0.6;
constexpr double kFilamentPacking = 0.75;
// Fibers per ply may miss the count by this share: a yarn of 167 dtex has 48 filaments of 3.5 dtex.
constexpr double kCountTolerance = 0.15;
constexpr int kMostFibersPerPly = 2000;

Rgbd read_color(const TomlTable& table, std::string_view key) {
  const auto c = table.color(key);
  return {c[0], c[1], c[2]};
}

/// The radius, from whichever of the keys for it is there.
double read_radius_mm(const TomlTable& table, FiberType& fiber) {
  fiber.density_g_cm3 = table.optional_number("density_g_cm3", {.min = 0.5, .max = 20}).value_or(0);
  struct Fineness {
    const char* key;
    NumberRange range;
    double tex;
  };
  const std::optional<double> radius =
      table.optional_number("radius_um", {.min = 0.1, .max = 1000});
  const std::optional<double> diameter =
      table.optional_number("diameter_um", {.min = 0.2, .max = 2000});
  int given = (radius ? 1 : 0) + (diameter ? 1 : 0);
  double radius_mm = kYarnMmPerUm * (radius ? *radius : 0.5 * diameter.value_or(0));
  for (const Fineness& fineness : {Fineness{"dtex", {.min = 1e-3, .max = 1e4}, kTexPerDtex},
                                   {"denier", {.min = 1e-3, .max = 1e4}, kTexPerDenier},
                                   {"micronaire", {.min = 0.5, .max = 20}, kTexPerMicronaire}}) {
    const std::optional<double> value = table.optional_number(fineness.key, fineness.range);
    if (!value) continue;
    ++given;
    if (fiber.density_g_cm3 == 0)
      table.fail(fineness.key, "expected density_g_cm3 beside it: the thickness follows from both");
    radius_mm = fiber_radius_mm(*value * fineness.tex, fiber.density_g_cm3);
  }
  if (given != 1) {
    table.fail("radius_um",
               "expected one of radius_um, diameter_um, dtex, denier and micronaire, found " +
                   std::to_string(given));
  }
  return radius_mm;
}

/// Plies and fibers: as told, or as many as the count asks for.
void read_fibers_per_ply(const TomlTable& table, const std::optional<YarnCount>& count,
                         const FiberType& fiber, YarnConfig& yarn) {
  const bool is_plied = count && count->plies > 1;
  yarn.plies = is_plied ? count->plies : static_cast<int>(table.integer("plies", 1, 12));
  if (is_plied && table.has("plies")) table.fail("plies", "expected it either here or in count");
  if (!count) {
    yarn.fibers_per_ply = static_cast<int>(table.integer("fibers_per_ply", 1, kMostFibersPerPly));
    return;
  }
  if (fiber.density_g_cm3 == 0)
    table.fail("count",
               "expected density_g_cm3 in [fiber." + fiber.name + "]: the section follows");
  const double fitting = count->ply_tex / fiber_tex(fiber.radius_mm, fiber.density_g_cm3);
  if (table.has("fibers_per_ply")) {
    yarn.fibers_per_ply = static_cast<int>(table.integer("fibers_per_ply", 1, kMostFibersPerPly));
    if (std::abs(fitting / yarn.fibers_per_ply - 1) > kCountTolerance) {
      table.fail("fibers_per_ply",
                 fmt::format("expected about {:.0f}: so many of [fiber.{}] make up "
                             "the count; finer or thicker fibers need another "
                             "[fiber.NAME]",
                             fitting, fiber.name));
    }
    return;
  }
  if (fitting < 1 || fitting > kMostFibersPerPly) {
    table.fail("count",
               fmt::format("expected 1 to {} fibers per ply, found {:.3g}: other counts or "
                           "fibers fit",
                           kMostFibersPerPly, fitting));
  }
  yarn.fibers_per_ply = static_cast<int>(std::lround(fitting));
}

/// Width and height: as told, or those of an ellipse that the fibers fill.
void read_section(const TomlTable& table, bool has_count, const FiberType& fiber,
                  YarnConfig& yarn) {
  const NumberRange size{.min = 1e-3, .max = 100};
  if (has_count && !table.has("width_mm") && !table.has("height_mm")) {
    const bool is_staple = table.choice("form", {"staple", "filament"}, "staple") == "staple";
    const std::optional<double> packing =
        table.optional_number("packing", {.min = 0.05, .max = 0.9});
    const double flattening = table.number("flattening", {.min = 0.2, .max = 20}, 1);
    const double area = yarn.plies * yarn.fibers_per_ply * kPi * fiber.radius_mm * fiber.radius_mm /
                        packing.value_or(is_staple ? kStaplePacking : kFilamentPacking);
    const double diameter = 2 * std::sqrt(area / kPi);
    yarn.width_mm = diameter * std::sqrt(flattening);
    yarn.height_mm = diameter / std::sqrt(flattening);
  } else {
    yarn.width_mm = table.number("width_mm", size);
    yarn.height_mm = table.number("height_mm", size);
  }
  const bool is_told = table.has("width_mm");
  if (yarn.width_mm <= 2 * fiber.radius_mm)
    table.fail(is_told ? "width_mm" : "count", "expected more than the thickness of one fiber");
  if (yarn.height_mm <= 2 * fiber.radius_mm)
    table.fail(is_told ? "height_mm" : "flattening",
               "expected more than the thickness of one fiber");
}

}  // namespace

int find_fiber(const TomlTable& table, const std::vector<FiberType>& fibers) {
  const std::string name = table.string("fiber");
  std::string known;
  for (std::size_t k = 0; k < fibers.size(); ++k) {
    if (fibers[k].name == name) return static_cast<int>(k);
    known += (known.empty() ? "" : ", ") + fibers[k].name;
  }
  table.fail("fiber", "expected the name of a [fiber.NAME] table: " + known);
}

FiberType read_fiber(const TomlTable& table, const std::string& name) {
  FiberType fiber;
  fiber.name = name;
  fiber.radius_mm = read_radius_mm(table, fiber);
  if (table.choice("scattering", {"khungurn", "white-isotropic"}, "khungurn") ==
      "white-isotropic") {
    fiber.scattering.isotropic_white = true;
    return fiber;
  }
  fiber.scattering.color_r = read_color(table, "color_r");
  fiber.scattering.color_tt = read_color(table, "color_tt");
  const NumberRange width{.min = 0.1, .max = 60};
  fiber.scattering.beta_r = radians(table.number("beta_r_deg", width));
  fiber.scattering.beta_tt = radians(table.number("beta_tt_deg", width));
  fiber.scattering.gamma_tt = radians(table.number("gamma_tt_deg", {.min = 1, .max = 180}));
  return fiber;
}

int dyed_fiber(int fiber, const Rgbd& color, std::vector<FiberType>& fibers) {
  FiberType dyed = fibers[static_cast<std::size_t>(fiber)];
  dyed.scattering.color_tt = (4 * color / (1 + color).square()).min(1.0);
  const auto is_like = [&](const FiberType& other) {
    return other.name == dyed.name && (other.scattering.color_tt == dyed.scattering.color_tt).all();
  };
  const auto found = std::find_if(fibers.begin(), fibers.end(), is_like);
  if (found != fibers.end()) return static_cast<int>(found - fibers.begin());
  fibers.push_back(std::move(dyed));
  return static_cast<int>(fibers.size()) - 1;
}

double fill_of(const YarnConfig& yarn, const FiberType& fiber) {
  return 4.0 * yarn.plies * yarn.fibers_per_ply * fiber.radius_mm * fiber.radius_mm /
         (yarn.width_mm * yarn.height_mm);
}

double YarnConfig::round_radius_mm(double fiber_radius_mm) const {
  if (ply_mm) return reach_of(*ply_mm);
  return std::sqrt((0.5 * width_mm - fiber_radius_mm) * (0.5 * height_mm - fiber_radius_mm));
}

YarnConfig read_yarn(const TomlTable& table, const std::string& name,
                     std::vector<FiberType>& fibers) {
  YarnConfig yarn;
  yarn.name = name;
  yarn.fiber = find_fiber(table, fibers);
  const FiberType fiber = fibers[static_cast<std::size_t>(yarn.fiber)];
  if (table.has("color")) yarn.fiber = dyed_fiber(yarn.fiber, read_color(table, "color"), fibers);
  yarn.contact_flattening = table.number("contact_flattening", {.min = 0, .max = 0.5}, 0);
  yarn.spread = table.optional_number("spread", {.min = 0, .max = 1}).value_or(0);
  if (table.has("from")) {
    read_yarn_file(table, fiber.radius_mm, yarn);
    return yarn;
  }
  std::optional<YarnCount> count;
  if (table.has("count")) {
    try {
      count = parse_yarn_count(table.string("count"));
    } catch (const std::invalid_argument& error) {
      table.fail("count", error.what());
    }
  }
  read_fibers_per_ply(table, count, fiber, yarn);
  read_section(table, count.has_value(), fiber, yarn);
  const NumberRange twist{.min = -5000, .max = 5000};
  yarn.yarn_turns_per_mm = 1e-3 * table.number("yarn_twist_per_m", twist);
  yarn.ply_turns_per_mm = 1e-3 * table.number("ply_twist_per_m", twist);
  yarn.migration = table.number("migration", {.min = 0, .max = 1});
  yarn.wander_rms = radians(table.number("wander_rms_deg", {.min = 0, .max = 30}));
  read_irregularities(table, yarn);
  return yarn;
}

}  // namespace heddle
