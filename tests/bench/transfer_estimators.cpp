// How much faster is the transfer baker's estimator than the one the paper prints? Both estimate
// the matrix of the same cells, in batches of equal path counts; the figure of merit is 1 /
// (variance of the matrix in Frobenius norm x seconds).
//   printed: w0 uniform over the face's hemisphere, w1 uniform over the sphere, next-event
//     estimation towards w0 at each
//            vertex of a BCSDF-sampled path (Khungurn 2017, section 4.2);
//   shipped: w1 uniform, the path itself finds w0 (precompute/transfer_bake.h), here without its
//     stratification too.
// usage: heddle_transfer_estimators FABRIC.toml ...

#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_harmonics.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/tile_trace.h"
#include "precompute/transfer_bake.h"

namespace heddle {
namespace {

constexpr int kOrder = 5;
constexpr int kCoefficients = (kOrder + 1) * (kOrder + 1);
constexpr int kPathsPerBatch = 1024;
constexpr int kBatches = 24;
constexpr int kCells = 6;

using Matrix = Eigen::ArrayXXd;  // [j0][3 * j1 + c]

struct Merit {
  Matrix mean = Matrix::Zero(kCoefficients, 3 * kCoefficients);
  double variance = 0;  // of one batch's matrix, summed over entries
  double seconds = 0;   // per batch
};

template <class Batch>
Merit measure(Batch&& batch) {
  Merit merit;
  Matrix squares = merit.mean;
  const auto start = std::chrono::steady_clock::now();
  for (int b = 0; b < kBatches; ++b) {
    const Matrix m = batch(b);
    merit.mean += m / kBatches;
    squares += m.square() / kBatches;
  }
  merit.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / kBatches;
  merit.variance = (squares - merit.mean.square()).sum() * kBatches / (kBatches - 1);
  return merit;
}

void add(Matrix& sum, double weight, const Vec3& w0, const Vec3& w1, const Rgb& radiance) {
  float y0[kCoefficients];
  float y1[kCoefficients];
  evaluate_sh(kOrder, w0, y0);
  evaluate_sh(kOrder, w1, y1);
  for (int j0 = 0; j0 < kCoefficients; ++j0) {
    for (int j1 = 0; j1 < kCoefficients; ++j1) {
      for (int c = 0; c < 3; ++c) {
        sum(j0, 3 * j1 + c) += weight * y0[j0] * y1[j1] * radiance[c] / kPathsPerBatch;
      }
    }
  }
}

void compare_estimators(const std::string& path) {
  const TileScene scene(synthesize(read_fabric_config(TomlTable::load(path))));
  const Exemplar& exemplar = scene.exemplar();
  std::vector<BcsdfTable> materials;
  for (const FiberScattering& fiber : exemplar.scattering) materials.emplace_back(fiber);
  const auto edge = static_cast<float>(scene.mean_free_path(1, 20000));
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kMidpoint, 1);
  const SegmentCells cells = make_segment_cells(exemplar, origins, edge);
  const TileTrace trace(scene);
  double ratio_sum = 0;
  for (int k = 0; k < kCells; ++k) {
    RandomStream pick(1, RandomStage::kBench, 1, static_cast<std::uint64_t>(k));
    const std::uint32_t cell = cells.cell_of_segment[pick.index(exemplar.segment_count())];
    std::vector<std::uint32_t> segments;
    for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
      if (cells.cell_of_segment[s] == cell) segments.push_back(s);
    }
    const Merit printed = measure([&](int batch) {
      Matrix sum = Matrix::Zero(kCoefficients, 3 * kCoefficients);
      for (int i = 0; i < kPathsPerBatch; ++i) {
        RandomStream random(1, RandomStage::kBench, 100 + cell,
                            static_cast<std::uint64_t>(batch * kPathsPerBatch + i));
        const std::uint32_t segment = segments[random.index(segments.size())];
        const Vec3 w0 = sample_hemisphere(Vec3(0, 0, 1), random);
        const Vec3 w1 = sample_sphere(random);
        const auto first = trace.next(trace.at(exemplar.segment_midpoint(segment), segment), w1);
        if (!first) continue;
        Rgb radiance = Rgb::Zero();
        walk_path(trace, materials, *first, -w1, Rgb::Ones(), random, WalkLimits{},
                  [&](const TileTrace::Vertex& v, const Mat3& frame, const Vec3& wo,
                      const Rgb& throughput, int) {
                    if (trace.escapes(v, w0)) {
                      const Vec3 local = frame.transpose() * w0;
                      radiance += throughput *
                                  materials[v.material].evaluate(local, frame.transpose() * wo) *
                                  std::sqrt(std::max(0.0F, 1 - local.x() * local.x()));
                    }
                    return true;
                  });
        add(sum, 2 * kPi * 4 * kPi, w0, w1, radiance);
      }
      return sum;
    });
    const Merit shipped = measure([&](int batch) {
      Matrix sum = Matrix::Zero(kCoefficients, 3 * kCoefficients);
      for (int i = 0; i < kPathsPerBatch; ++i) {
        RandomStream random(1, RandomStage::kBench, 200 + cell,
                            static_cast<std::uint64_t>(batch * kPathsPerBatch + i));
        const std::uint32_t segment = segments[random.index(segments.size())];
        const Vec3 w1 = sample_sphere(random);
        const auto first = trace.next(trace.at(exemplar.segment_midpoint(segment), segment), w1);
        if (!first) continue;
        const auto escape = walk_path(trace, materials, *first, -w1, Rgb::Ones(), random,
                                      WalkLimits{}, [](auto&&...) { return true; });
        if (escape && escape->direction.z() > 0)
          add(sum, 4 * kPi, escape->direction, w1, escape->throughput);
      }
      return sum;
    });
    const double ratio =
        (printed.variance * printed.seconds) / (shipped.variance * shipped.seconds);
    const double noise =
        std::sqrt((printed.variance + shipped.variance) / kBatches / shipped.mean.square().sum());
    const double difference =
        std::sqrt((printed.mean - shipped.mean).square().sum() / shipped.mean.square().sum());
    fmt::print(
        "  cell {:4}: efficiency shipped / printed {:6.2f} (variance {:5.2f} x, time {:5.2f} x); "
        "means differ by "
        "{:.3f}, noise of the difference {:.3f}\n",
        cell, ratio, printed.variance / shipped.variance, printed.seconds / shipped.seconds,
        difference, noise);
    ratio_sum += ratio;
  }
  fmt::print("{}: mean efficiency ratio {:.2f} over {} cells\n", path, ratio_sum / kCells, kCells);
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: {} FABRIC.toml ...\n", argv[0]);
    return 2;
  }
  for (int i = 1; i < argc; ++i) heddle::compare_estimators(argv[i]);
  return 0;
}
