#ifndef HEDDLE_FIBERS_SCATTERING_BCSDF_TABLE_H_
#define HEDDLE_FIBERS_SCATTERING_BCSDF_TABLE_H_
// One FiberScattering in the float form of the renderer and the path walker: value, sampling,
// response to spherical Gaussians and to spherical harmonics. Tables sample the double-precision
// functions of fiber_bcsdf.h and sg_scatter.h.
//
// Fiber frame: x = tangent. All directions point away from the fiber. Values are 1/sr without the
// cosine, densities 1/sr over the whole sphere.
//
// Sampling draws wi for a given wo. First it draws a lobe by the tabulated adjoint albedos, which
// are the integrals of S_R and S_TT cos(theta_i) over wi. Then it draws theta_i from the lobe's
// Gaussian cut to [-pi/2, pi/2], and the azimuth exactly. The density is that of the mixture.
//
// Albedos are weighed by `importance`, the throughput of the path so far. The sum of the
// throughput's colours then stays almost what it was. With all colours weighed alike, the weight
// after a white fiber's 30 bounces varies as the product of 30 factors: throughputs reach hundreds,
// and most of the light is in few paths. Worst change of that sum over the fibers and angles
// tested: a factor of 2.6 (hundreds when Schlick's F at theta_o chooses the lobe).
//
// Building one takes about 0.1 s. Tested, with the errors and the worst weights, in
// tests/fibers/scattering/bcsdf_table_test.cpp.

#include <array>
#include <span>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/math/vector.h"
#include "fibers/scattering/fiber_bcsdf.h"

namespace heddle {

class BcsdfTable {
 public:
  static constexpr int kRows = 512;    // inclinations theta_o, equally spaced in [-pi/2, pi/2]
  static constexpr int kMaxOrder = 5;  // of sh_coefficients

  explicit BcsdfTable(const FiberScattering& fiber);

  const FiberScattering& fiber() const { return fiber_; }

  Rgb evaluate(const Vec3& wi, const Vec3& wo) const;

  struct Sample {
    Vec3 wi;
    Rgb weight;  // S(wi, wo) cos(theta_i) / pdf; 1 for the isotropic white fiber
    float pdf;
    float deviation;  // beta of the lobe that was drawn, radians; pi for the isotropic white fiber
  };
  /// importance: not negative; all zero counts as one.
  Sample sample(const Vec3& wo, RandomStream& random, const Rgb& importance = Rgb::Ones()) const;
  float pdf(const Vec3& wi, const Vec3& wo, const Rgb& importance = Rgb::Ones()) const;

  /// Gamma of sg_scatter.h by SgMethod::kDefault, for a unit axis and sharpness >= 0.
  Rgb sg_scatter(const Vec3& axis, float sharpness, const Vec3& wo) const;

  /// One lobe's share of Gamma, and where that light comes from: a Gaussian of the given precisions
  /// (1 / variance, radians^-2) in inclination and azimuth. Its mean lies `theta_shift` further in
  /// inclination and `turn` further in azimuth than the axis.
  struct LobeResponse {
    Rgb value = Rgb::Zero();
    float theta_shift = 0;
    float turn = 0;
    float theta_precision = 0;
    float azimuth_precision = 0;
  };
  /// R's share, then TT's; their values add up to sg_scatter.
  std::array<LobeResponse, 2> sg_scatter_by_lobe(const Vec3& axis, float sharpness,
                                                 const Vec3& wo) const;

  using Lanes = Eigen::Array<float, 8, 1>;
  using RgbLanes = Eigen::Array<float, 8, 3>;
  /// Scattered towards inclination theta_o from light that is Gaussian in inclination: the sum over
  /// the lanes of light * integral of S cos(theta) N(theta; theta_i, variance) dtheta. theta_i and
  /// cos_turn, the cosine of the azimuth from wo's, are per lane. variance > 0. The product of
  /// Gaussians is exact; the factors beside it are taken at its mean.
  Rgb blurred_scatter(const Lanes& theta_i, const Lanes& cos_turn, float theta_o, float variance,
                      const RgbLanes& light) const;
  /// The same for each lane, under white light of 1.
  RgbLanes blurred_response(const Lanes& theta_i, const Lanes& cos_turn, float theta_o,
                            float variance) const;

  /// bcsdf_sh by linear interpolation between rows. out: [(order + 1)^2][3], order <= kMaxOrder.
  /// Error 1e-4, but where an end of [-pi/2, pi/2] cuts a narrow lobe: 2e-3 at beta = 1 degree, 0.1
  /// at 0.1 degrees.
  void sh_coefficients(float theta_o, int order, float* out) const;

 private:
  // One lobe's longitudinal part. Gn(theta) = (floor + decay cos^2) * end_ratio(distance from the
  // nearer end): the first factor is the mean of cos^2 over the uncut Gaussian, the second, 1 but
  // near the ends, is tabulated.
  struct LongitudinalLobe {
    float beta = 0;
    float inverse_variance = 0;
    float norm = 0;                // 1 / (sqrt(2 pi) beta)
    float floor = 0;               // (1 - exp(-2 beta^2)) / 2
    float decay = 0;               // exp(-2 beta^2)
    float end_scale = 0;           // table entries per radian from the end
    std::vector<float> end_ratio;  // [kEndRows + 1]

    float cos2_mean(float cosine, float from_end) const;
  };
  struct Inclination;
  struct Densities;
  struct SgNodes;
  struct SgSums;

  /// The colours' parts of blurred_response: R, R times Schlick's weight, TT less that; without the
  /// fiber's colours.
  struct BlurredLobes {
    Lanes r;
    Lanes r_grazing;
    Lanes tt;
  };
  BlurredLobes blurred_lobes(const Lanes& theta_i, const Lanes& cos_turn, float theta_o,
                             float variance) const;
  static LongitudinalLobe longitudinal_lobe(double beta);
  float probability_of_r(float theta_o, const Rgb& importance) const;
  Densities densities(const Inclination& in, const Inclination& out) const;
  Rgb value(const Densities& d, const Inclination& in) const;
  SgSums sg_sums(const Inclination& light, float sharpness, const Inclination& view) const;
  float sampling_density(const Densities& d, const Inclination& out, float probability_of_r) const;

  FiberScattering fiber_;
  Rgb color_r_;
  Rgb color_tt_;
  LongitudinalLobe r_;
  LongitudinalLobe tt_;
  float k_ = 0;             // gamma_tt^-2
  float azimuth_norm_ = 0;  // 1 / (2 pi I0(k) exp(-k))
  VonMisesSampler azimuth_sampler_;
  // [kRows] integrals of S_R cos(theta_i) over wi, up to a common factor
  std::vector<Rgb> adjoint_r_;
  std::vector<Rgb> adjoint_tt_;  // [kRows] the same of S_TT
  std::vector<float> sh_;        // [kRows][(kMaxOrder + 1)^2][3]
};

/// One table for each fiber.
std::vector<BcsdfTable> bcsdf_tables(std::span<const FiberScattering> fibers);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_SCATTERING_BCSDF_TABLE_H_
