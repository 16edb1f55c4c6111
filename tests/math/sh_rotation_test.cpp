#include "fibers/math/sh_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle {
namespace {

Mat3d random_rotation(RandomStream& random) {
  return Eigen::Quaterniond(random.uniform_double() - 0.5, random.uniform_double() - 0.5,
                            random.uniform_double() - 0.5, random.uniform_double() - 0.5)
      .normalized()
      .toRotationMatrix();
}

// Generic, the identity, about z only, upside down, and tilted by so little that a and g are only
// defined together.
std::vector<Mat3d> rotations() {
  RandomStream random(5, RandomStage::kTest, 0, 0);
  std::vector<Mat3d> list;
  for (int k = 0; k < 10; ++k) list.push_back(random_rotation(random));
  list.push_back(Mat3d::Identity());
  list.push_back(Eigen::AngleAxisd(0.7, Vec3d::UnitZ()).toRotationMatrix());
  list.push_back(Eigen::AngleAxisd(kPi, Vec3d::UnitX()).toRotationMatrix());
  list.push_back(Eigen::AngleAxisd(kPi, Vec3d(1.0, 2.0, 0.0).normalized()).toRotationMatrix());
  for (const double tilt : {1e-4, 1e-8, 1e-12, 1e-15}) {
    list.push_back((Eigen::AngleAxisd(1.1, Vec3d::UnitZ()) *
                    Eigen::AngleAxisd(tilt, Vec3d(1.0, 1.0, 0.0).normalized()))
                       .toRotationMatrix());
  }
  return list;
}

TEST(ShRotationLaw, HarmonicsOfTheTurnedDirection) {
  RandomStream random(6, RandomStage::kTest, 0, 0);
  for (const Mat3d& rotation : rotations()) {
    const Vec3d w = sample_sphere(random).cast<double>().normalized();
    for (int order = 0; order <= kMaxShOrder; ++order) {
      const auto count = static_cast<std::size_t>(sh_count(order));
      std::vector<double> here(count);
      std::vector<double> turned(count);
      std::vector<double> result(count);
      evaluate_sh(order, w, here.data());
      evaluate_sh(order, Vec3d(rotation * w), turned.data());
      ShRotation(order, rotation).rotate(here.data(), result.data());
      for (std::size_t j = 0; j < count; ++j)
        EXPECT_NEAR(result[j], turned[j], 1e-12) << "order " << order << ", j " << j;
    }
  }
}

TEST(ShRotationLaw, CoefficientsOfTheTurnedFunction) {
  // rotate(project f) = project(rotate f): the series with turned coefficients at w is the old one
  // at R^T w.
  RandomStream random(7, RandomStage::kTest, 0, 0);
  for (const Mat3d& rotation : rotations()) {
    std::vector<double> f(sh_count(5));
    for (double& c : f) c = random.uniform_double() - 0.5;
    std::vector<double> turned(f.size());
    ShRotation(5, rotation).rotate(f.data(), turned.data());
    const Vec3d w = sample_sphere(random).cast<double>().normalized();
    std::vector<double> at_w(f.size());
    std::vector<double> at_source(f.size());
    evaluate_sh(5, w, at_w.data());
    evaluate_sh(5, Vec3d(rotation.transpose() * w), at_source.data());
    double left = 0.0;
    double right = 0.0;
    for (std::size_t j = 0; j < f.size(); ++j) {
      left += turned[j] * at_w[j];
      right += f[j] * at_source[j];
    }
    EXPECT_NEAR(left, right, 1e-12);
  }
}

TEST(ShRotationLaw, ProductsOfRotations) {
  RandomStream random(8, RandomStage::kTest, 0, 0);
  const Mat3d a = random_rotation(random);
  const Mat3d b = random_rotation(random);
  std::vector<double> f(sh_count(7));
  for (double& c : f) c = random.uniform_double() - 0.5;
  std::vector<double> stepwise = f;
  std::vector<double> at_once = f;
  ShRotation(7, b).rotate(stepwise.data(), stepwise.data());
  ShRotation(7, a).rotate(stepwise.data(), stepwise.data());
  ShRotation(7, a * b).rotate(at_once.data(), at_once.data());
  for (std::size_t j = 0; j < f.size(); ++j) EXPECT_NEAR(stepwise[j], at_once[j], 1e-13);
}

TEST(ShRotationAgreement, ThreeFloatColoursAgainstDouble) {
  RandomStream random(9, RandomStage::kTest, 0, 0);
  for (const Mat3d& rotation : rotations()) {
    constexpr int kCount = sh_count(5);
    std::vector<float> in(3 * kCount);
    std::vector<float> out(3 * kCount);
    for (float& c : in) c = random.uniform() - 0.5F;
    const ShRotation turn(5, rotation);
    turn.rotate<3>(in.data(), out.data());
    for (int channel = 0; channel < 3; ++channel) {
      std::vector<double> one(kCount);
      for (int j = 0; j < kCount; ++j)
        one[static_cast<std::size_t>(j)] = in[static_cast<std::size_t>(3 * j + channel)];
      turn.rotate(one.data(), one.data());
      for (int j = 0; j < kCount; ++j) {
        EXPECT_NEAR(out[static_cast<std::size_t>(3 * j + channel)],
                    one[static_cast<std::size_t>(j)], 3e-6);
      }
    }
  }
}

}  // namespace
}  // namespace heddle
