#include "pipeline/fabric_report.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/pipeline/small_fabric.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

nlohmann::ordered_json report_of(const std::string& text) {
  TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "fabric.toml";
  std::ofstream(file) << text;
  return fabric_report(read_fabric_document(file, {}));
}

// Of 20 ends per cm and a crimp of c, 10 tex each: 20 * 100 m of yarn on a square metre, (1 + c)
// times as long, 10 g a kilometre.
TEST(FabricReport, WeighsTheCloth) {
  const std::string text = edited(kSmallFabric, "radius_um", "density_g_cm3 = 1.5\nradius_um");
  const auto report = report_of(text);
  double expected = 0;
  for (const char* system : {"warp", "weft"}) {
    const bool is_warp = std::string(system) == "warp";
    const double per_cm = report[is_warp ? "ends_per_cm" : "picks_per_cm"];
    const double crimp = report[is_warp ? "warp_crimp_percent" : "weft_crimp_percent"];
    const double tex = report["yarns"][system]["tex"];
    expected += 100 * per_cm * (1 + crimp / 100) * tex * 1e-3;
  }
  EXPECT_NEAR(report["grams_per_m2"].get<double>(), expected, 0.01 * expected);
  EXPECT_LE(report["interpenetration"]["percent_of_segments"].get<double>(), 5);
}

}  // namespace
}  // namespace heddle
