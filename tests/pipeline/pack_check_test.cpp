#include "pipeline/pack_check.h"

#include <gtest/gtest.h>

#include <functional>

#include "formats/input_error.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

/// A pack in memory whose parts fit together: one cell per tile, one lobe, two voxels.
FabricPack sound_pack() {
  FabricPack pack;
  pack.folder = "x.pack";
  pack.exemplar = crossed_layers(test_cotton());
  const std::size_t segments = pack.exemplar.segment_count();
  pack.ssdf = SsdfVisibility{.resolution = 2,
                             .components = 1,
                             .mean = {1, 0, 0, -1},
                             .basis = {1, 1, 1, 1},
                             .coefficients = std::vector<Half>(segments),
                             .sees_nothing = std::vector<std::uint8_t>(segments)};
  pack.sgs = SgVisibility{.sharpness = 48,
                          .axes = {Vec3(0, 0, 1)},
                          .weights = std::vector<Half>(segments, half_from_float(2)),
                          .rotation = std::vector<Half>(segments),
                          .sees_nothing = std::vector<std::uint8_t>(segments)};
  Transfer transfer;
  transfer.order = 0;
  transfer.cell_of_segment.assign(segments, 0);
  transfer.matrices = {0.1F, 0.1F, 0.1F};
  transfer.standard_error = {0, 0, 0};
  transfer.paths = {1024};
  pack.transfer = transfer;
  IdVolume volume;
  volume.size = {2, 1, 1};
  volume.voxel_mm = {pack.exemplar.width_mm / 2, pack.exemplar.height_mm, 1};
  volume.ids = {-1, 0};
  pack.volume = volume;
  return pack;
}

TEST(PackCheck, EveryNumberedCheckCanFail) {
  EXPECT_NO_THROW(check_pack_contents(sound_pack()));
  struct Damage {
    const char* expected;
    std::function<void(FabricPack&)> apply;
  };
  const Damage damages[] = {
      {"ssdf.safetensors: check 8", [](FabricPack& p) { p.ssdf->mean[2] = 4; }},
      {"sg.safetensors: check 9", [](FabricPack& p) { p.sgs->weights[0] = half_from_float(13); }},
      {"transfer.safetensors: check 10",
       [](FabricPack& p) {
         p.transfer->matrices.resize(6);
         p.transfer->standard_error.resize(6);
         p.transfer->paths.push_back(1024);
       }},
      {"transfer.safetensors: check 10", [](FabricPack& p) { p.transfer->both_sides = true; }},
      {"transfer.safetensors: check 10", [](FabricPack& p) { p.transfer->standard_error[1] = -1; }},
      {"transfer.safetensors: check 10", [](FabricPack& p) { p.transfer->paths[0] = 0; }},
      {"volume.vdb: check 11", [](FabricPack& p) { p.volume->voxel_mm[1] *= 1.01; }},
  };
  for (const Damage& damage : damages) {
    FabricPack pack = sound_pack();
    damage.apply(pack);
    try {
      check_pack_contents(pack);
      ADD_FAILURE() << damage.expected << " did not fail";
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(damage.expected), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace heddle
