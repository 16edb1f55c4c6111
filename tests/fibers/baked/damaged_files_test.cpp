// Files of precomputed data with damaged bytes: refused, or data that can be asked without leaving
// their arrays.

#include <gtest/gtest.h>

#include "fibers/baked/fabric_pack.h"
#include "fibers/baked/segment_visibility.h"
#include "fibers/baked/transfer.h"
#include "formats/input_error.h"
#include "tests/support/mutations.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

constexpr std::string_view kReplacements("\0\x7f\xff", 3);

class DamagedFilesFormat : public testing::Test {
 protected:
  /// use(path) reads the file that write(path) wrote, damaged.
  template <class Write, class Use>
  void damage(const Write& write, const Use& use) {
    const std::filesystem::path path = folder_.path() / "data.safetensors";
    write(path);
    int refused = 0;
    int read = 0;
    for_each_mutation(bytes_of(path), 3, kReplacements, [&](const std::string& damaged) {
      write_bytes(path, damaged);
      try {
        use(path);
        ++read;
      } catch (const FileError& error) {
        EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
        ++refused;
      }
    });
    EXPECT_GT(refused, 300);
    EXPECT_GT(read, 10);
  }

  TemporaryFolder folder_;
};

TEST_F(DamagedFilesFormat, SignedDistances) {
  SsdfVisibility ssdf;
  ssdf.resolution = 4;
  ssdf.components = 2;
  ssdf.mean.assign(16, 0.25F);
  ssdf.basis.assign(32, 0.5F);
  ssdf.coefficients.assign(6, half_from_float(0.5F));
  ssdf.sees_nothing = {0, 1, 0};
  damage([&](const auto& path) { write_ssdf(path, ssdf, {}); },
         [](const auto& path) {
           const SsdfVisibility read = read_ssdf(path);
           for (std::uint32_t s = 0; s < read.sees_nothing.size(); ++s)
             read.signed_distance(s, Vec3(0, 0.6F, -0.8F));
         });
}

TEST_F(DamagedFilesFormat, SumsOfGaussians) {
  SgVisibility sgs;
  sgs.axes = {Vec3(0, 0, 1), Vec3(1, 0, 0)};
  sgs.weights.assign(6, half_from_float(0.5F));
  sgs.rotation.assign(3, half_from_float(1));
  sgs.sees_nothing = {0, 1, 0};
  damage([&](const auto& path) { write_sg_visibility(path, sgs, {}); },
         [](const auto& path) {
           const SgVisibility read = read_sg_visibility(path);
           EXPECT_EQ(read.weights.size(), read.sees_nothing.size() * read.axes.size());
           EXPECT_EQ(read.rotation.size(), read.sees_nothing.size());
           EXPECT_GT(read.sharpness, 0);
         });
}

TEST_F(DamagedFilesFormat, Transfer) {
  Transfer transfer;
  transfer.order = 1;
  transfer.cell_of_segment = {0, 1, 0};
  transfer.matrices.assign(2 * 4 * 4 * 3, 0.5F);
  transfer.standard_error.assign(2 * 2 * 3, 0.1F);
  transfer.paths = {8, 9};
  damage([&](const auto& path) { write_transfer(path, transfer, {}); },
         [](const auto& path) {
           const heddle::Transfer read = read_transfer(path);
           const auto n = static_cast<std::size_t>(read.coefficients());
           const std::vector<float> light(n, 1);
           std::vector<float> result(3 * n);
           for (const std::uint32_t cell : read.cell_of_segment)
             read.incoming(cell, light.data(), result.data());
         });
}

TEST_F(DamagedFilesFormat, NoManifestIsReadThatWasChanged) {
  write_bytes(folder_.path() / "fibers.safetensors", "fibers");
  PackManifest manifest{.name = "n",
                        .key = "k",
                        .program_version = "v",
                        .light_from_both_sides = false,
                        .counts = {{"fibers", 3}},
                        .files = {{"fibers.safetensors", {}}}};
  write_manifest(folder_.path(), manifest);
  const std::filesystem::path path = folder_.path() / kManifestName;
  const std::string whole = bytes_of(path);
  ASSERT_NO_THROW(read_verified_manifest(folder_.path()));
  for_each_mutation(whole, 2, std::string_view("\0\"[}", 4), [&](const std::string& damaged) {
    write_bytes(path, damaged);
    try {
      // Blanks may change, and the last line's end.
      const PackManifest read = read_verified_manifest(folder_.path());
      EXPECT_EQ(read.name + read.key + read.program_version, "nkv") << damaged;
      EXPECT_EQ(read.counts, manifest.counts) << damaged;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(folder_.path().string()), std::string::npos)
          << error.what();
    }
  });
}

}  // namespace
}  // namespace heddle
