#include "fibers/cloth/yarn_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace heddle {
namespace {

constexpr double kYarnMmPerUm = 1e-3;

Rgbd color(const TomlTable& table, std::string_view key) {
  const auto c = table.number3(key, {.min = 0, .max = 1});
  return {c[0], c[1], c[2]};
}

PlyShape read_ply(const TomlTable& table) {
  const NumberRange length{.min = 0, .max = 50, .exclusive_min = true};
  return {table.number("centre_mm", {.min = 0, .max = 50}), table.number("radial_mm", length),
          table.number("tangential_mm", length)};
}

// Where something else already says how large the yarn is, the key need not.
void read_size(const TomlTable& table, std::string_view key, double& size_mm) {
  const auto given = table.optional_number(key, {.min = 1e-3, .max = 100});
  if (!given && size_mm == 0)
    table.fail(key, fmt::format("{} is missing: it is required without a table ply", key));
  size_mm = given.value_or(size_mm);
}

// All keys of a yarn but those that say of which fiber it is and how it lies in a cloth.
void read_structure(const TomlTable& table, double fiber_radius_mm, YarnConfig& yarn) {
  if (const auto ply = table.optional_table("ply")) {
    yarn.ply_mm = read_ply(*ply);
    yarn.width_mm = yarn.height_mm = 2 * (reach_of(*yarn.ply_mm) + fiber_radius_mm);
  }
  read_size(table, "width_mm", yarn.width_mm);
  read_size(table, "height_mm", yarn.height_mm);
  yarn.plies = static_cast<int>(table.integer("plies", 1, 12));
  yarn.fibers_per_ply = static_cast<int>(table.integer("fibers_per_ply", 1, 2000));
  const NumberRange twist{.min = -5000, .max = 5000};
  yarn.yarn_turns_per_mm = 1e-3 * table.number("yarn_twist_per_m", twist);
  yarn.ply_turns_per_mm = 1e-3 * table.number("ply_twist_per_m", twist);
  yarn.migration = table.number("migration", {.min = 0, .max = 1});
  yarn.migration_per_turn = table.number("migration_per_turn", {.min = 0, .max = 100}, 1);
  yarn.wander_rms = radians(table.number("wander_rms_deg", {.min = 0, .max = 30}));
  if (const auto density = table.optional_table("density")) {
    yarn.density.epsilon = density->number("epsilon", {.min = 0, .max = 0.5});
    yarn.density.beta = density->number("beta", {.min = 0, .max = 20});
  }
  if (const auto hairs = table.optional_table("hairs")) yarn.hairs = read_hairs(*hairs);
  if (const auto loops = table.optional_table("loops")) yarn.loops = read_loops(*loops);
  for (const TomlTable& slubs : table.tables("slubs")) yarn.slubs.push_back(read_slubs(slubs));
  if (const auto neps = table.optional_table("neps")) yarn.neps = read_neps(*neps);
}

// As if the yarn had been measured in a unit so many times as long. Its fibers stay as thick.
void scale_lengths(double scale, double fiber_radius_mm, YarnConfig& yarn) {
  for (double* size : {&yarn.width_mm, &yarn.height_mm})
    *size = scale * (*size - 2 * fiber_radius_mm) + 2 * fiber_radius_mm;
  if (yarn.ply_mm) {
    for (double* length : {&yarn.ply_mm->centre, &yarn.ply_mm->radial, &yarn.ply_mm->tangential})
      *length *= scale;
  }
  std::vector<double*> rates = {&yarn.yarn_turns_per_mm, &yarn.ply_turns_per_mm, &yarn.hairs.per_mm,
                                &yarn.loops.per_mm, &yarn.neps.per_mm};
  std::vector<MeanAndDeviation*> lengths = {&yarn.hairs.start_mm, &yarn.hairs.rise_mm,
                                            &yarn.hairs.along_mm, &yarn.loops.height_mm,
                                            &yarn.neps.diameter_mm};
  for (Slubs& slubs : yarn.slubs) {
    rates.push_back(&slubs.per_mm);
    lengths.push_back(&slubs.length_mm);
  }
  for (double* rate : rates) *rate /= scale;
  for (MeanAndDeviation* length : lengths) {
    length->mean *= scale;
    length->deviation *= scale;
  }
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
    const TomlTable file = TomlTable::load(table.existing_file("from"));
    read_structure(file, radius, yarn);
    file.finish();
    yarn.file_text = file.canonical_text();
    scale_lengths(table.number("scale", {.min = 0.01, .max = 100}, 1), radius, yarn);
    read_size(table, "width_mm", yarn.width_mm);
    read_size(table, "height_mm", yarn.height_mm);
  } else {
    read_structure(table, radius, yarn);
  }
  if (yarn.width_mm <= 2 * radius)
    table.fail("width_mm", "expected more than the thickness of one fiber");
  if (yarn.height_mm <= 2 * radius)
    table.fail("height_mm", "expected more than the thickness of one fiber");
  return yarn;
}

}  // namespace heddle
