// The energy-safe variants of the woven models: parameters with which the published forms return up
// to four times what arrives, and what the variants make of them.

#include "render/surface/energy_scale.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <string>

#include "fibers/math/sampling.h"
#include "render/surface/surface_presets.h"
#include "render/surface/woven_cotton.h"
#include "render/surface/woven_yarns.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

const SurfacePoint kFromAfar = {Vec2(0.1F, 0.2F), 1000};

std::unique_ptr<const SurfaceModel> cotton(const char* preset, bool energy_safe, double diffuse,
                                           double specular) {
  const TomlTable document = surface_preset(preset);
  document.string("model");
  WovenCottonParameters parameters = read_woven_cotton(document);
  for (CottonYarn& yarn : parameters.yarns) {
    yarn.diffuse = Rgbd(1, 0.5, 0.1) * diffuse / kPi;
    yarn.specular = Rgbd(1, 1, 0.3) * specular;
  }
  parameters.energy_safe = energy_safe;
  return std::make_unique<WovenCotton>(parameters);
}

std::unique_ptr<const SurfaceModel> yarns(const char* preset, bool energy_safe, double diffuse,
                                          double specular) {
  const TomlTable document = surface_preset(preset);
  document.string("model");
  WovenYarnsParameters parameters = read_woven_yarns(document);
  for (YarnMaterial& yarn : parameters.yarns) {
    yarn.diffuse = Rgbd(1, 0.5, 0.1) * diffuse;
    yarn.specular = Rgbd(1, 1, 0.3) * specular;
  }
  parameters.energy_safe = energy_safe;
  return std::make_unique<WovenYarns>(parameters);
}

struct Fabric {
  const char* preset;
  std::unique_ptr<const SurfaceModel> (*make)(const char*, bool, double, double);
  double diffuse;   // albedo
  double specular;  // k_s
  int samples;
};
const Fabric kViolating[] = {
    {"cotton-twill-2006", cotton, 0.3, 4, 4000},  {"cotton-plain-2006", cotton, 0.2, 6, 2000},
    {"cotton-sateen-2006", cotton, 1.4, 3, 4000}, {"irawan-polyester", yarns, 0.5, 1, 4000},
    {"irawan-charmeuse", yarns, 0.8, 2, 4000},    {"irawan-denim", yarns, 0.2, 1, 200}};

/// The energy-safe form of kViolating[k].
const SurfaceModel& safe_form(std::size_t k) {
  static std::array<std::unique_ptr<const SurfaceModel>, std::size(kViolating)> models;
  const Fabric& fabric = kViolating[k];
  if (!models[k]) models[k] = fabric.make(fabric.preset, true, fabric.diffuse, fabric.specular);
  return *models[k];
}

Vec3 direction_of(int k, RandomStream& random) {
  Vec3 direction = sample_hemisphere(Vec3(0, 0, 1), random);
  if (k % 3 == 1) direction.z() *= 0.05F;  // grazing
  if (k % 6 == 2) direction = Vec3(k % 4 < 2 ? 1 : 0, k % 4 < 2 ? 0 : -1, 0.2F);
  return direction.normalized();
}

/// Directional albedo, the largest channel, by the model's own sampling; BRDFs are reciprocal.
double albedo(const SurfaceModel& model, const Vec3& wo, int samples, double& standard_error) {
  RunningMean channels[3];
  for (int n = 0; n < samples; ++n) {
    RandomStream random(2, RandomStage::kTest, static_cast<std::uint64_t>(n), 0);
    const auto sample = model.sample(kFromAfar, wo, random);
    for (int c = 0; c < 3; ++c)
      channels[c].add(sample ? static_cast<double>(sample->weight[c]) : 0);
  }
  int most = 0;
  for (int c = 1; c < 3; ++c) most = channels[c].mean() > channels[most].mean() ? c : most;
  standard_error = channels[most].standard_error();
  return channels[most].mean();
}

TEST(EnergyScaleLaw, NoDirectionReturnsMoreThanArrives) {
  for (std::size_t f = 0; f < std::size(kViolating); ++f) {
    const Fabric& fabric = kViolating[f];
    const auto published = fabric.make(fabric.preset, false, fabric.diffuse, fabric.specular);
    double most = 0;
    double most_safe = 0;
    for (int k = 0; k < 30; ++k) {
      RandomStream random(1, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      const Vec3 wo = direction_of(k, random);
      double error = 0;
      most = std::max(most, albedo(*published, wo, fabric.samples, error));
      const double of_safe = albedo(safe_form(f), wo, fabric.samples, error);
      EXPECT_LT(of_safe - 3 * error, 1) << fabric.preset << " " << wo.transpose();
      most_safe = std::max(most_safe, of_safe);
    }
    std::printf("  %-20s largest directional albedo %.2f, energy safe %.2f\n", fabric.preset, most,
                most_safe);
    EXPECT_GT(most, 1.2) << fabric.preset;
    EXPECT_GT(most_safe, 0.5) << fabric.preset << ": no darker than it must be";
  }
}

TEST(EnergyScaleLaw, ReciprocityStays) {
  for (std::size_t f = 0; f < std::size(kViolating); ++f) {
    for (int k = 0; k < 60; ++k) {
      RandomStream random(3, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      const Vec3d wi = direction_of(k, random).cast<double>().normalized();
      const Vec3d wo = direction_of(k + 1, random).cast<double>().normalized();
      const SurfacePoint point = {Vec2(random.uniform(), random.uniform()),
                                  k % 3 == 0 ? 0 : (k % 3 == 1 ? 0.3F : 1000)};
      const Rgbd there = safe_form(f).reflected(point, wi, wo) / wi.z();
      const Rgbd back = safe_form(f).reflected(point, wo, wi) / wo.z();
      EXPECT_LT((there - back).abs().maxCoeff(), 1e-9 * there.maxCoeff()) << kViolating[f].preset;
    }
  }
}

TEST(EnergyScaleLaw, NothingChangesWhereEnergyHolds) {
  for (const Fabric& fabric : {kViolating[0], kViolating[3]}) {
    const auto published = fabric.make(fabric.preset, false, 0.2, 0.02 * fabric.specular);
    const auto safe = fabric.make(fabric.preset, true, 0.2, 0.02 * fabric.specular);
    for (int k = 0; k < 60; ++k) {
      RandomStream random(4, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      const Vec3d wi = direction_of(k, random).cast<double>().normalized();
      const Vec3d wo = direction_of(k + 1, random).cast<double>().normalized();
      EXPECT_TRUE(
          (safe->reflected(kFromAfar, wi, wo) == published->reflected(kFromAfar, wi, wo)).all())
          << fabric.preset;
    }
  }
}

TEST(EnergyScale, TakesTheRoomThatThereIs) {
  const EnergyScale scale([](const Vec3d& w) { return w.x() > 0 ? 4.0 : 0.5; });
  EXPECT_EQ(scale(Vec3d(-1, 0.1, 1).normalized()), 1);
  EXPECT_NEAR(scale(Vec3d(1, 0.1, 1).normalized()), kEnergyMargin / 4, 1e-12);
  EXPECT_NEAR(scale(Vec3d(1, 0.1, 1e-9).normalized()), kEnergyMargin / 4, 1e-12);
}

TEST(EnergyScale, LatticePointsAreEven) {
  Vec3d sum = Vec3d::Zero();
  Vec3d squares = Vec3d::Zero();
  for (int n = 0; n < 4096; ++n) {
    const Vec3d point = lattice_point(n);
    EXPECT_TRUE((point.array() >= 0).all() && (point.array() < 1).all());
    sum += point;
    squares += point.cwiseProduct(Vec3d(point.y(), point.z(), point.x()));
  }
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(sum[c] / 4096, 0.5, 1e-3);
    EXPECT_NEAR(squares[c] / 4096, 0.25, 2e-3);
  }
}

}  // namespace
}  // namespace heddle
