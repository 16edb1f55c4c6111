#include "fibers/cloth/fabric_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "fibers/cloth/exemplar.h"

namespace heddle {
namespace {

constexpr double kMmPerUm = 1e-3;

void check_tile(const TomlTable& weave, std::string_view key, double size_mm) {
  if (size_mm <= kMaxTileMm) return;
  weave.fail(key, fmt::format("expected a tile of at most {} mm, found {:g} mm: yarns of a repeat "
                              "x repeats x spacing_mm",
                              kMaxTileMm, size_mm));
}

Rgbd color(const TomlTable& table, std::string_view key) {
  const auto c = table.number3(key, {.min = 0, .max = 1});
  return {c[0], c[1], c[2]};
}

FiberType read_fiber(const TomlTable& table, const std::string& name) {
  FiberType fiber;
  fiber.name = name;
  fiber.radius_mm = kMmPerUm * table.number("radius_um", {.min = 0.1, .max = 1000});
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

YarnConfig read_yarn(const TomlTable& table, const FabricConfig& config) {
  YarnConfig yarn;
  const std::string fiber = table.string("fiber");
  const auto found =
      std::find_if(config.fibers.begin(), config.fibers.end(),
                   [&](const FiberType& candidate) { return candidate.name == fiber; });
  if (found == config.fibers.end()) {
    std::string known;
    for (const FiberType& candidate : config.fibers)
      known += (known.empty() ? "" : ", ") + candidate.name;
    table.fail("fiber", "expected the name of a [fiber.NAME] table: " + known);
  }
  yarn.fiber = static_cast<int>(found - config.fibers.begin());
  const double radius = found->radius_mm;
  yarn.spacing_mm = table.number("spacing_mm", {.min = 1e-3, .max = 100});
  yarn.width_mm = table.number("width_mm", {.min = 1e-3, .max = 100});
  yarn.height_mm = table.number("height_mm", {.min = 1e-3, .max = 100});
  if (yarn.width_mm > yarn.spacing_mm)
    table.fail("width_mm", "expected at most spacing_mm: neighbouring yarns overlap");
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
  return yarn;
}

}  // namespace

FabricConfig read_fabric_config(const TomlTable& document) {
  FabricConfig config;
  config.name = document.string("name");
  config.seed = static_cast<std::uint64_t>(document.integer("seed", 0, 1'000'000'000, 1));
  config.light_from_both_sides = document.choice("light_from", {"face", "both"}, "face") == "both";
  config.segment_mm = kMmPerUm * document.number("segment_um", {.min = 1, .max = 10000});

  const TomlTable weave = document.table("weave");
  const std::string notation = weave.string("notation");
  WeaveFace face = WeaveFace::kWarp;
  if (notation.starts_with("satin")) {
    face = weave.choice("face", {"warp", "weft"}) == "warp" ? WeaveFace::kWarp : WeaveFace::kWeft;
  }
  try {
    config.weave = parse_weave(notation, face);
  } catch (const std::invalid_argument& error) {
    weave.fail("notation", error.what());
  }
  config.repeats_x = static_cast<int>(weave.integer("repeats_x", 1, 64));
  config.repeats_y = static_cast<int>(weave.integer("repeats_y", 1, 64));
  config.crimp_warp = weave.number("crimp_warp", {.min = 0, .max = 1});

  const TomlTable fibers = document.table("fiber");
  for (const std::string& name : fibers.table_names())
    config.fibers.push_back(read_fiber(fibers.table(name), name));
  if (config.fibers.empty() || config.fibers.size() > kMaxMaterials) {
    document.fail("fiber", fmt::format("expected 1 to {} tables [fiber.NAME]", kMaxMaterials));
  }
  config.warp = read_yarn(document.table("warp"), config);
  config.weft = read_yarn(document.table("weft"), config);
  check_tile(weave, "repeats_x", config.weave.ends * config.repeats_x * config.warp.spacing_mm);
  check_tile(weave, "repeats_y", config.weave.picks * config.repeats_y * config.weft.spacing_mm);
  return config;
}

}  // namespace heddle
