// What one value of a surface model costs, for every preset: one thread, so that rates are per
// core.
//
//   heddle_surface_models [--benchmark_filter=REGEX]     model.quantity.fabric: reflected (a
//                                                        point), footprint_0.1mm, footprint_0.5mm,
//                                                        far (20 mm), sample, pdf, sg (sharpness
//                                                        100), all at a point
//   heddle_surface_models --pairs N                      instead: reflected() for N random, grazing
//                                                        and opposite pairs of directions and each
//                                                        preset, at random places, seen as points,
//                                                        at footprints from 0.01 to 1 mm, and from
//                                                        afar, and of the interactive form under
//                                                        Gaussian lights, on all threads; 1 where
//                                                        one is negative or not finite

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/combinable.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "render/lights.h"
#include "render/surface/interactive_microcylinder.h"
#include "render/surface/microcylinder.h"
#include "render/surface/surface_model.h"
#include "render/surface/surface_presets.h"
#include "tests/support/direction_pairs.h"

namespace heddle {
namespace {

constexpr float kFar = 20;                 // mm: a footprint of many repeats
constexpr std::size_t kDirections = 1024;  // pairs that a benchmark goes through: a power of 2

std::vector<std::pair<Vec3d, Vec3d>> directions() {
  RandomStream random(1, RandomStage::kBench, 0, 0);
  std::vector<std::pair<Vec3d, Vec3d>> pairs;
  for (std::size_t k = 0; k < kDirections; ++k)
    pairs.emplace_back(random_above(random), random_above(random));
  return pairs;
}

void add_benchmarks(const std::string& name) {
  const TomlTable config = surface_preset(name);
  const std::string model_name = config.string("model");
  const std::shared_ptr<const SurfaceModel> model = read_surface_model(config);
  const auto add = [&](const char* quantity, const auto& evaluate) {
    benchmark::RegisterBenchmark(fmt::format("{}.{}.{}", model_name, quantity, name).c_str(),
                                 [model, evaluate](benchmark::State& state) {
                                   const auto pairs = directions();
                                   std::size_t k = 0;
                                   for (auto _ : state) {
                                     const auto& [wi, wo] = pairs[k++ % kDirections];
                                     benchmark::DoNotOptimize(evaluate(*model, wi, wo, k));
                                   }
                                   state.SetItemsProcessed(state.iterations());
                                 });
  };
  add("reflected", [](const SurfaceModel& m, const Vec3d& wi, const Vec3d& wo, std::size_t) {
    return m.reflected({}, wi, wo).sum();
  });
  const auto add_footprint = [&](const char* quantity, float footprint) {
    add(quantity,
        [footprint](const SurfaceModel& m, const Vec3d& wi, const Vec3d& wo, std::size_t k) {
          const auto place = static_cast<float>(k % kDirections) / kDirections;
          return m.reflected({Vec2(3 * place, 7 * place), footprint}, wi, wo).sum();
        });
  };
  add_footprint("footprint_0.1mm", 0.1F);
  add_footprint("footprint_0.5mm", 0.5F);
  add_footprint("far", kFar);
  add("sample", [](const SurfaceModel& m, const Vec3d&, const Vec3d& wo, std::size_t k) {
    RandomStream random(1, RandomStage::kBench, 1, k);
    const auto sample = m.sample({}, wo.cast<float>(), random);
    return sample ? sample->pdf : 0;
  });
  add("pdf", [](const SurfaceModel& m, const Vec3d& wi, const Vec3d& wo, std::size_t) {
    return m.pdf({}, wi.cast<float>(), wo.cast<float>());
  });
  add("sg", [](const SurfaceModel& m, const Vec3d& wi, const Vec3d& wo, std::size_t) {
    return m.reflected_sg({}, wi, 100, wo).sum();
  });
}

/// A place on the cloth, and in turns a point, a footprint from 0.01 to 1 mm, and one of many
/// repeats.
SurfacePoint random_point(RandomStream& random, int k) {
  SurfacePoint point;
  point.position_mm = 20 * Vec2(random.uniform(), random.uniform());
  if (k / 3 % 3 == 1) point.footprint_mm = std::pow(10.0F, -2 * random.uniform());
  if (k / 3 % 3 == 2) point.footprint_mm = kFar;
  return point;
}

/// True where all values are finite and none is negative.
bool check_pairs(const std::string& name, int pairs) {
  const auto start = std::chrono::steady_clock::now();
  const std::unique_ptr<const SurfaceModel> model = read_surface_model(surface_preset(name));
  struct Result {
    int bad = 0;
    double most = 0;
  };
  tbb::combinable<Result> results;
  constexpr int kBlock = 10'000;
  tbb::parallel_for(0, (pairs + kBlock - 1) / kBlock, [&](int block) {
    Result& result = results.local();
    RandomStream random(1, RandomStage::kBench, 2, static_cast<std::uint64_t>(block));
    for (int k = block * kBlock; k < std::min(pairs, (block + 1) * kBlock); ++k) {
      const auto [wi, wo] = random_pair_above(random, k);
      const Rgbd value = model->reflected(random_point(random, k), wi, wo);
      const bool good = value.isFinite().all() && (value >= 0).all();
      if (good) result.most = std::max(result.most, value.maxCoeff());
      result.bad += !good;
    }
  });
  const Result all = results.combine([](const Result& a, const Result& b) {
    return Result{a.bad + b.bad, std::max(a.most, b.most)};
  });
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  fmt::print("{:<28} {} pairs, {} negative or not finite, largest {:.4g}, {:.1f} s\n", name, pairs,
             all.bad, all.most, seconds.count());
  return all.bad == 0;
}

/// The same of the interactive form of a microcylinder fabric: an open surface, one Gaussian light
/// of sharpness 0 or 0.01 to 10^6.
bool check_interactive(const std::string& name, int pairs) {
  const InteractiveMicrocylinder model(read_microcylinder_fabric(surface_preset(name)), {});
  const auto start = std::chrono::steady_clock::now();
  tbb::combinable<int> bad([] { return 0; });
  constexpr int kBlock = 1000;
  tbb::parallel_for(0, (pairs + kBlock - 1) / kBlock, [&](int block) {
    RandomStream random(1, RandomStage::kBench, 3, static_cast<std::uint64_t>(block));
    for (int k = block * kBlock; k < std::min(pairs, (block + 1) * kBlock); ++k) {
      const auto [wi, wo] = random_pair_above(random, k);
      Light light;
      light.type = LightType::kSphericalGaussian;
      light.axis = k % 10 == 0 ? sample_sphere(random) : wi.cast<float>();
      light.sharpness = k % 7 == 0 ? 0 : std::pow(10.0F, 8 * random.uniform() - 2);
      light.irradiance = Rgb::Ones();
      const Rgbd value = model.shade(Mat3d::Identity(), wo, {&light, 1}, {});
      bad.local() += !(value.isFinite().all() && (value >= 0).all());
    }
  });
  const int all = bad.combine(std::plus<>());
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  fmt::print(
      "{:<28} {} pairs by the interactive form, {} negative or not finite, {:.1f} s, {:.0f} a "
      "second\n",
      name, pairs, all, seconds.count(), pairs / seconds.count());
  return all == 0;
}

int run(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  CLI::App app("Cost and robustness of the surface models");
  int pairs = 0;
  app.add_option("--pairs", pairs, "check that many pairs of directions for each preset")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  if (pairs > 0) {
    bool good = true;
    for (const std::string& name : surface_preset_names()) good = check_pairs(name, pairs) && good;
    for (const std::string& name : surface_preset_names("microcylinder"))
      good = check_interactive(name, pairs) && good;
    return good ? 0 : 1;
  }
  for (const std::string& name : surface_preset_names()) add_benchmarks(name);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  return heddle::run(argc, argv);
}
