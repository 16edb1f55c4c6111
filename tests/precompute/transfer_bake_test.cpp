#include "precompute/transfer_bake.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "fibers/cloth/bundle_tangents.h"
#include "fibers/cloth/synthesize.h"
#include "fibers/math/spherical_harmonics.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/tile_trace.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

TransferSettings settings_of(int order, int paths, bool both_sides) {
  TransferSettings settings;
  settings.order = order;
  settings.min_paths = settings.max_paths = paths;
  settings.target_error = 1;
  settings.both_sides = both_sides;
  return settings;
}

// Light 1 from everywhere on white fibers: indirect light fills exactly what the sky does not,
// sqrt(4 pi) a[0][j] + integral of V Y_j = sqrt(4 pi) delta_j0, V the mean visibility of the cell's
// segments, weighted as the baker weights them.
TEST(TransferBakeStatistical, FurnaceBalancesVisibility) {
  for (const FabricConfig& config : test::kinds_of_cloth()) {
    Exemplar exemplar = synthesize(config);
    exemplar.scattering = {test::white_fiber()};
    const TileScene scene(exemplar);
    const std::vector<BcsdfTable> materials = {BcsdfTable(test::white_fiber())};
    const SegmentOrigins origins = find_segment_origins(scene, true, OriginChoice::kExposed, 1);
    const SegmentCells cells =
        make_segment_cells(exemplar, origins, config.knit || config.repeats_x > 1 ? 0.4F : 0.2F);
    const TransferSettings settings = settings_of(2, 16384, true);
    const TransferBaker baker(scene, materials, origins, settings, cells);
    const std::vector<TransferChunk> chunks = {baker.bake(0, cells.count)};
    const Transfer transfer = baker.assemble(chunks);
    double worst = 0;
    int compared = 0;
    for (std::uint32_t cell = 0; cell < cells.count; ++cell) {
      std::vector<std::uint32_t> segments;
      float most_open = 0;
      for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
        if (cells.cell_of_segment[s] != cell) continue;
        segments.push_back(s);
        most_open = std::max(most_open, origins.openness[s] + kLeastOpenness);
      }
      const int samples = 16384;
      double open[9] = {};
      double open_squares[9] = {};
      for (int i = 0; i < samples; ++i) {
        RandomStream random(1, RandomStage::kTest, 30 + cell, static_cast<std::uint64_t>(i));
        std::uint32_t s = segments[random.index(segments.size())];
        while (random.uniform() * most_open > origins.openness[s] + kLeastOpenness)
          s = segments[random.index(segments.size())];
        const Vec3 w = sample_sphere(random);
        if (scene.occluded({origins.position[s], w}, exemplar.segment_fiber[s])) continue;
        float y[9];
        evaluate_sh(2, w, y);
        for (int j = 0; j < 9; ++j) {
          open[j] += 4 * kPi * y[j] / samples;
          open_squares[j] += std::pow(4 * kPi * y[j], 2) / samples;
        }
      }
      for (int j = 0; j < 9; ++j) {
        const double indirect =
            std::sqrt(4 * kPi) * transfer.matrices[(static_cast<std::size_t>(cell) * 81 + j) * 3];
        const double expected = j == 0 ? std::sqrt(4 * kPi) : 0;
        const int band = j == 0 ? 0 : j < 4 ? 1 : 2;
        const double from_transfer =
            std::sqrt(4 * kPi) *
            transfer.standard_error[(static_cast<std::size_t>(cell) * 3 + band) * 3];
        const double from_visibility = std::sqrt((open_squares[j] - open[j] * open[j]) / samples);
        const double z =
            (indirect + open[j] - expected) / std::hypot(from_transfer, from_visibility);
        worst = std::max(worst, std::abs(z));
        ++compared;
      }
    }
    std::printf("stored furnace: %d sums, worst %.2f standard errors\n", compared, worst);
    EXPECT_GT(compared, 50);
    // The stored error is the rms of a band's entries; 5.5 leaves room for the unevenness within a
    // band.
    EXPECT_LT(worst, 5.5);
  }
}

TEST(TransferBakeLaw, FaceLightIsPartOfLightFromBothSides) {
  Exemplar exemplar = synthesize(test::small_fabric());
  const TileScene scene(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(exemplar.scattering[0])};
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const SegmentCells cells = make_segment_cells(exemplar, origins, 0.3F);
  const TransferBaker face(scene, materials, origins, settings_of(0, 8192, false), cells);
  const TransferBaker both(scene, materials, origins, settings_of(0, 8192, true), cells);
  const TransferChunk a = face.bake(0, cells.count);
  const TransferChunk b = both.bake(0, cells.count);
  for (std::size_t i = 0; i < a.matrices.size(); ++i) {
    EXPECT_LE(a.matrices[i], b.matrices[i] * (1 + 1e-5F));  // the same paths, some dropped
    EXPECT_GE(a.matrices[i], 0);
  }
}

// What light from the face misses of light from both sides comes from below: it is light from the
// face of the mirrored cloth, mirrored. Y_lm is even or odd in z as l + m is. Independent paths, so
// the three errors add up to what the sum may be off by.
TEST(TransferBakeStatistical, LightFromBelowIsThatOfTheMirroredFace) {
  Exemplar exemplar = synthesize(test::small_fabric());
  Exemplar mirrored = exemplar;
  for (Vec3& point : mirrored.points) point.z() = -point.z();
  index_segments(mirrored);
  const TileScene scene(exemplar);
  const TileScene below(mirrored);
  const std::vector<BcsdfTable> materials = {BcsdfTable(exemplar.scattering[0])};
  const SegmentOrigins origins = find_segment_origins(scene, true, OriginChoice::kExposed, 1);
  SegmentOrigins mirrored_origins = origins;
  for (Vec3& position : mirrored_origins.position) position.z() = -position.z();
  const SegmentCells cells = make_segment_cells(exemplar, origins, 0.2F);
  const auto bake = [&](const TileScene& of, const SegmentOrigins& from, bool both_sides,
                        std::uint64_t seed) {
    TransferSettings settings = settings_of(1, 8192, both_sides);
    settings.seed = seed;
    return TransferBaker(of, materials, from, settings, cells).bake(0, cells.count);
  };
  const TransferChunk both = bake(scene, origins, true, 1);
  const TransferChunk face = bake(scene, origins, false, 2);
  const TransferChunk back = bake(below, mirrored_origins, false, 3);
  const double parity[4] = {1, 1, -1, 1};  // 1, y, z, x
  double squares = 0;
  double stated = 0;
  double from_face = 0;
  double from_back = 0;
  for (std::size_t cell = 0; cell < cells.count; ++cell) {
    for (std::size_t j0 = 0; j0 < 4; ++j0) {
      for (std::size_t j1 = 0; j1 < 4; ++j1) {
        for (std::size_t c = 0; c < 3; ++c) {
          const std::size_t k = ((cell * 4 + j0) * 4 + j1) * 3 + c;
          const double sum = face.matrices[k] + parity[j0] * parity[j1] * back.matrices[k];
          squares += std::pow(both.matrices[k] - sum, 2);
          for (const TransferChunk* chunk : {&both, &face, &back})
            stated += std::pow(chunk->standard_error[(cell * 2 + (j1 > 0 ? 1 : 0)) * 3 + c], 2);
        }
      }
    }
    from_face += face.matrices[cell * 48];
    from_back += back.matrices[cell * 48];
  }
  std::printf("%u cells: rms difference %.3f of what the errors say\n", cells.count,
              std::sqrt(squares / stated));
  EXPECT_NEAR(std::sqrt(squares / stated), 1, 0.15);
  // Neither side is without light: the yarns are alike, and so is the cloth from above and below.
  EXPECT_NEAR(from_face / from_back, 1, 0.1);
}

/// Parallel filaments in a loose stack, slightly wandering.
Exemplar filaments() {
  std::vector<Vec2> places;
  for (int y = 0; y < 6; ++y) {
    for (int z = 0; z < 4; ++z)
      places.emplace_back(0.03F * (static_cast<float>(y) + 0.5F), 0.03F * static_cast<float>(z));
  }
  const FiberScattering silk = test::fiber_in_degrees({.7, .2, .1}, {.6, .5, .5}, 1, 10, 20);
  Exemplar exemplar = test::straight_fibers(0.6F, 0.18F, places, 0.01F, 12, silk);
  RandomStream random(5, RandomStage::kTest, 1, 0);
  // Both ends of a fiber stay where they are: it is periodic.
  for (std::size_t f = 0; f + 1 < exemplar.first_point.size(); ++f) {
    for (std::uint32_t p = exemplar.first_point[f] + 1; p + 1 < exemplar.first_point[f + 1]; ++p) {
      exemplar.points[p].tail<2>() += 0.002F * sample_disk(random);
    }
  }
  index_segments(exemplar);
  return exemplar;
}

TEST(TransferBakeLaw, ConesSortPathsAndLoseNone) {
  const Exemplar exemplar = filaments();
  const TileScene scene(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(exemplar.scattering[0])};
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const SegmentCells cells = make_segment_cells(exemplar, origins, 0.1F);
  TransferSettings settings = settings_of(3, 8192, false);
  settings.cones = TransferSettings::Cones::kOff;
  const TransferChunk without =
      TransferBaker(scene, materials, origins, settings, cells).bake(0, cells.count);
  EXPECT_FALSE(without.cones.has_value());
  settings.cones = TransferSettings::Cones::kAuto;  // these fibers are parallel and specular
  const TransferChunk with =
      TransferBaker(scene, materials, origins, settings, cells).bake(0, cells.count);
  ASSERT_TRUE(with.cones.has_value());

  // The matrices are those of all paths, to rounding.
  double largest = 0;
  double difference = 0;
  for (std::size_t i = 0; i < with.matrices.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(without.matrices[i])));
    difference =
        std::max(difference, std::abs(static_cast<double>(with.matrices[i]) - without.matrices[i]));
  }
  EXPECT_LT(difference, 1e-5 * largest);

  // Over all azimuths, f_d is sqrt(2 pi) times its constant's coefficient; the mean over directions
  // has Y_0 = 1 / sqrt(4 pi) before it.
  constexpr std::size_t n = 16;
  double on_cones = 0;
  double all = 0;
  for (std::size_t cell = 0; cell < cells.count; ++cell) {
    for (std::size_t j0 = 0; j0 < n; ++j0) {
      for (std::size_t c = 0; c < 3; ++c) {
        double moments = 0;
        for (std::size_t d = 0; d < ConeTransfer::kWidths; ++d) {
          moments += with.cones->moments[((cell * ConeTransfer::kWidths + d) * n + j0) *
                                             ConeTransfer::kAzimuths * 3 +
                                         c];
        }
        EXPECT_NEAR(with.cones->harmonics[((cell * n + j0) * n) * 3 + c], moments * std::sqrt(0.5),
                    1e-5 * largest);
      }
    }
    on_cones += with.cones->harmonics[cell * n * n * 3];
    all += with.matrices[cell * n * n * 3];
  }
  // Red light reflects at 1 degree and wander is 2 to 3 degrees: most of the light stays on cones,
  // but light through fibers (10 degrees each) does not for long.
  EXPECT_GT(on_cones, 0.3 * all);
  EXPECT_LT(on_cones, 0.95 * all);
}

/// Filaments along x whose pieces lean by the angle to one side and to the other, neighbours apart:
/// their bundles run nearly along x.
Exemplar leaning_filaments(double angle, double beta) {
  FiberScattering mirror;
  mirror.color_r = Rgbd(0.9, 0.9, 0.9);
  mirror.beta_r = beta;
  mirror.beta_tt = beta;
  mirror.gamma_tt = radians(20);
  Exemplar exemplar;
  exemplar.width_mm = 0.6F;
  exemplar.height_mm = 0.24F;
  exemplar.scattering = {mirror};
  exemplar.first_point = {0};
  constexpr int kPieces = 12;
  const auto rise = static_cast<float>(0.6 / kPieces * std::tan(angle));
  for (int z = 0; z < 6; ++z) {
    for (int y = 0; y < 12; ++y) {
      // A zigzag, so that the fiber is periodic.
      for (int k = 0; k <= kPieces; ++k) {
        const float aside = (k + y + z) % 2 == 0 ? 0 : rise;
        exemplar.points.emplace_back(0.6F * static_cast<float>(k) / kPieces,
                                     0.02F * (static_cast<float>(y) + 0.5F) + aside,
                                     0.02F * static_cast<float>(z));
      }
      exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
      exemplar.radius_mm.push_back(0.008F);
      exemplar.material.push_back(0);
    }
  }
  index_segments(exemplar);
  return exemplar;
}

// A path widens with every hit by beta^2, and by sin^2 of the angle between the fiber and the
// bundle that it began in; its class is that of the sum. The moments of each class are those of
// paths that are sorted by hand, on mirrors of one beta.
TEST(TransferBakeStatistical, PathsAreSortedByLobesAndByTheFibersAroundThem) {
  const double beta = radians(1.5);
  const Exemplar exemplar = leaning_filaments(radians(4), beta);
  const TileScene scene(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(exemplar.scattering[0])};
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const std::vector<Vec3> bundles = bundle_tangents(exemplar);
  SegmentCells cells;
  cells.count = 1;
  cells.cell_of_segment.assign(exemplar.segment_count(), 0);
  TransferSettings settings = settings_of(0, 65536, false);
  settings.cones = TransferSettings::Cones::kOn;
  const TransferChunk chunk = TransferBaker(scene, materials, origins, settings, cells).bake(0, 1);

  std::vector<double> chance;  // of a segment, running sum
  for (const float openness : origins.openness)
    chance.push_back((chance.empty() ? 0 : chance.back()) + openness + kLeastOpenness);
  const TileTrace trace(scene);
  constexpr int kPaths = 65536;
  double sum[ConeTransfer::kWidths + 1] = {};
  double squares[ConeTransfer::kWidths + 1] = {};
  double below = 0;
  for (int i = 0; i < kPaths; ++i) {
    RandomStream random(1, RandomStage::kTest, 77, static_cast<std::uint64_t>(i));
    const auto found =
        std::upper_bound(chance.begin(), chance.end() - 1, random.uniform_double() * chance.back());
    const auto segment = static_cast<std::uint32_t>(found - chance.begin());
    const Vec3 w1 = sample_sphere(random);
    const auto first = trace.next(trace.at(origins.position[segment], segment), w1);
    if (!first) continue;
    double variance = 0;
    const auto escape = walk_path(trace, materials, *first, -w1, Rgb::Ones(), random, WalkLimits{},
                                  [&](const TileTrace::Vertex& vertex, auto&&...) {
                                    const double cosine = vertex.tangent.dot(bundles[segment]);
                                    variance += beta * beta + 1 - cosine * cosine;
                                    return true;
                                  });
    if (!escape || escape->direction.z() <= 0) continue;
    const double predicted = degrees(std::sqrt(variance));
    const int width = predicted < 5 ? 0 : predicted < 9 ? 1 : predicted < 13 ? 2 : 3;
    sum[width] += escape->throughput[0];
    squares[width] += escape->throughput[0] * escape->throughput[0];
    below += w1.z() < 0 ? escape->throughput[0] : 0;
  }
  for (int width = 0; width < ConeTransfer::kWidths; ++width) {
    // 4 pi Y_0 F_0 = 4 pi / sqrt(4 pi) / sqrt(2 pi) per unit of throughput.
    const double unit = std::sqrt(2.0);
    const double expected = unit * sum[width] / kPaths;
    const double error = unit * std::sqrt(squares[width]) / kPaths;
    const double got =
        chunk.cones->moments[static_cast<std::size_t>(width) * ConeTransfer::kAzimuths * 3];
    std::printf("class %d: %.4f, by hand %.4f +- %.4f\n", width, got, expected, error);
    EXPECT_NEAR(got, expected, 5 * error) << width;
    EXPECT_GT(expected, 20 * error) << width;
    // Azimuths are measured from up: most of the light that was scattered before comes from below,
    // where the cloth is. Of even and odd layers as much comes from either side.
    const float* series =
        &chunk.cones->moments[static_cast<std::size_t>(width) * ConeTransfer::kAzimuths * 3];
    EXPECT_LT(series[3], -0.2 * got) << width;
    EXPECT_LT(std::abs(series[6]), 0.1 * got) << width;
  }
  EXPECT_GT(below, 0.6 * (sum[0] + sum[1] + sum[2] + sum[3]));
}

TEST(TransferBakeLaw, ConesAreKeptWhereFilamentsAreParallelAndSpecular) {
  Exemplar exemplar = filaments();
  EXPECT_TRUE(keeps_light_on_cones(exemplar, bundle_tangents(exemplar)));
  exemplar.scattering[0].beta_r = radians(4);
  EXPECT_FALSE(keeps_light_on_cones(exemplar, bundle_tangents(exemplar)));
  exemplar.scattering[0].beta_r = radians(1);
  RandomStream random(5, RandomStage::kTest, 2, 0);
  for (Vec3& point : exemplar.points) point.tail<2>() += 0.008F * sample_disk(random);
  index_segments(exemplar);
  EXPECT_FALSE(keeps_light_on_cones(exemplar, bundle_tangents(exemplar)));
}

TEST(TransferBakeLaw, AnyCutAndAnyThreadCountGiveTheSameBits) {
  const Exemplar exemplar = filaments();
  const TileScene scene(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(exemplar.scattering[0])};
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const SegmentCells cells = make_segment_cells(exemplar, origins, 0.1F);
  ASSERT_GT(cells.count, 5U);
  // Cells end after different numbers of paths.
  TransferSettings settings = settings_of(1, 4096, false);
  settings.max_paths = 16384;
  settings.target_error = 0.02;
  const TransferBaker baker(scene, materials, origins, settings, cells);
  const std::vector<TransferChunk> in_one = {baker.bake(0, cells.count)};
  const Transfer whole = baker.assemble(in_one);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<TransferChunk> chunks;
  for (const auto& [first, last] : {std::pair{0U, 3U}, {3U, 4U}, {4U, cells.count}})
    chunks.push_back(baker.bake(first, last));
  const Transfer cut = baker.assemble(chunks);
  EXPECT_EQ(cut.matrices, whole.matrices);
  EXPECT_EQ(cut.standard_error, whole.standard_error);
  EXPECT_EQ(cut.paths, whole.paths);
  ASSERT_TRUE(cut.cones && whole.cones);
  EXPECT_EQ(cut.cones->harmonics, whole.cones->harmonics);
  EXPECT_EQ(cut.cones->moments, whole.cones->moments);
  EXPECT_EQ(cut.cell_of_segment, cells.cell_of_segment);
  EXPECT_EQ(whole.cell_of_segment, cells.cell_of_segment);
  EXPECT_EQ(cut.order, 1);
  EXPECT_FALSE(cut.both_sides);
  // Every cell has numbers of its own.
  EXPECT_EQ(whole.matrices.size(), cells.count * 48U);
  for (std::size_t cell = 0; cell < cells.count; ++cell) {
    EXPECT_GT(whole.matrices[cell * 48], 0) << cell;
    EXPECT_GE(whole.paths[cell], 4096U) << cell;
    if (cell > 0) {
      EXPECT_NE(whole.matrices[cell * 48], whole.matrices[(cell - 1) * 48]) << cell;
    }
  }
}

// A cell's paths end once the errors of its entries, in the mean square, are below the share asked
// for of its brightest colour's first entry, and not a batch before. A cell that is seen less than
// the mean one may err more, by the square root of that share.
TEST(TransferBakeLaw, PathsEndWhereTheErrorMeetsTheTarget) {
  const Exemplar exemplar = synthesize(test::small_fabric());
  const TileScene scene(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(exemplar.scattering[0])};
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const SegmentCells cells = make_segment_cells(exemplar, origins, 0.3F);
  TransferSettings settings = settings_of(1, 4096, false);
  settings.max_paths = 200 * TransferBaker::kBatch;
  settings.target_error = 0.01;
  const TransferChunk chunk = TransferBaker(scene, materials, origins, settings, cells).bake(0, 4);
  const auto error_share = [&](const TransferChunk& of, std::size_t cell) {
    double squares = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      // [band of j1]: one column of four in band 0, three in band 1.
      squares += std::pow(of.standard_error[(cell * 2 + 0) * 3 + c], 2) / 12;
      squares += std::pow(of.standard_error[(cell * 2 + 1) * 3 + c], 2) * 3 / 12;
    }
    const float* first = &of.matrices[cell * 48];
    return std::sqrt(squares) / std::max({first[0], first[1], first[2]});
  };
  std::vector<double> openness(cells.count);
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s)
    openness[cells.cell_of_segment[s]] += origins.openness[s] + kLeastOpenness;
  const double mean = std::accumulate(openness.begin(), openness.end(), 0.0) / cells.count;
  int longer = 0;
  for (std::uint32_t cell = 0; cell < 4; ++cell) {
    const double allowed = 0.01 / std::sqrt(std::min(1.0, openness[cell] / mean));
    EXPECT_LT(error_share(chunk, cell), allowed * (1 + 1e-5)) << cell;
    if (chunk.paths[cell] == 4096) continue;
    ++longer;
    settings.min_paths = settings.max_paths =
        static_cast<int>(chunk.paths[cell]) - TransferBaker::kBatch;
    const TransferBaker shorter(scene, materials, origins, settings, cells);
    EXPECT_GT(error_share(shorter.bake(cell, cell + 1), 0), allowed * (1 - 1e-5)) << cell;
  }
  EXPECT_GT(longer, 0);
}

TEST(TransferBakeStatistical, StoredErrorIsTheSpreadOverSeeds) {
  Exemplar exemplar = synthesize(test::small_fabric());
  const TileScene scene(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(exemplar.scattering[0])};
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const SegmentCells cells = make_segment_cells(exemplar, origins, 0.3F);
  const int seeds = 24;
  double sum = 0;
  double squares = 0;
  double stated = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    TransferSettings settings = settings_of(0, 16384, false);
    settings.seed = static_cast<std::uint64_t>(seed);
    const TransferBaker baker(scene, materials, origins, settings, cells);
    const TransferChunk chunk = baker.bake(0, 1);
    sum += chunk.matrices[0];
    squares += static_cast<double>(chunk.matrices[0]) * chunk.matrices[0];
    stated += static_cast<double>(chunk.standard_error[0]) * chunk.standard_error[0] / seeds;
  }
  const double variance = (squares - sum * sum / seeds) / (seeds - 1);
  std::printf("standard error stated %.3g, spread over seeds %.3g\n", std::sqrt(stated),
              std::sqrt(variance));
  // The variance of 24 values is known to sqrt(2 / 23) = 29 %, that of the statement to about 7
  // %: 3.3 deviations.
  EXPECT_NEAR(variance / stated, 1, 1.0);
}

}  // namespace
}  // namespace heddle
