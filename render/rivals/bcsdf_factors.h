#ifndef HEDDLE_RENDER_RIVALS_BCSDF_FACTORS_H_
#define HEDDLE_RENDER_RIVALS_BCSDF_FACTORS_H_
// A fiber's BCSDF times cos(theta_i) as a matrix over directions (wi, wo), cut to the R largest
// terms of its singular value decomposition, sum over r of g_r(wi) h_r(wo). This is the factored
// BRDF of Tsai and Shih 2006, with one decomposition per colour.
//
// The matrix's symmetry does most of the work. S depends on azimuths through phi_o - phi_i only. On
// a lattice equally spaced in azimuth, Fourier modes cos(m (phi_o - phi_i)) therefore split the
// matrix into blocks over (theta_i, theta_o): m = 0 once, m > 0 twice, as cos cos and sin sin. The
// singular values of the blocks are the matrix's. Mode 0 holds R and TT. Every other mode is the
// block of TT times a number. So there are two decompositions per colour, whatever the number of
// azimuths.
//
// The cut depends on the matrix that is decomposed. kWeighted takes S cos(theta_i) times the square
// roots of the two solid angles; the cut is then the best in the mean over the spheres. kPlain
// takes the values of S alone. S grows as 1 / Gn near grazing, a thousandfold for beta = 1 degree.
// The first terms of the plain matrix hold little else, and all other directions go black. If one
// of a pair's two terms would be cut off, both are.
//
// The lattice in theta resolves the narrowest lobe (deviations from 0.7 degrees, half a deviation
// per step). Linear interpolation between lattice points widens a lobe: the peak of the narrowest
// is 2 % low. With all terms the matrix is not decomposed. A second or two per fiber at R = 16.
// Tested in tests/render/rivals/bcsdf_factors_test.cpp.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/scattering/fiber_bcsdf.h"

namespace heddle {

class BcsdfFactors {
 public:
  static constexpr int kRecommendedTerms = 16;
  static constexpr int kAllTerms = -1;

  enum class Matrix { kWeighted, kPlain };

  BcsdfFactors(const FiberScattering& fiber, int terms, Matrix matrix = Matrix::kWeighted);

  /// S(wi, wo) cos(theta_i), fiber frame. Can be negative when terms are cut.
  Rgb value(const Vec3& wi, const Vec3& wo) const;

  /// Integral over wi of G(wi; axis, sharpness) times that, G not normalised: exact in azimuth, by
  /// the lattice in theta.
  Rgb response(const Vec3& axis, float sharpness, const Vec3& wo) const;

  int thetas() const { return thetas_; }
  /// Terms kept, and the share of the matrix's squared norm that they hold, per colour; 1 with all
  /// terms.
  const std::array<int, 3>& terms() const { return terms_; }
  const std::array<double, 3>& energy() const { return energy_; }

 private:
  using Block = Eigen::MatrixXf;  // [theta_i, theta_o] values at the middles of equal steps
  static constexpr int kMaxMode = 64;
  /// The factor of cos(m (phi_o - phi_i)), one colour: scale * blocks_[block].
  struct Mode {
    int m;
    int block;
    float scale;
  };
  struct Colour {
    std::vector<Mode> modes;
    std::vector<Block> blocks;
  };
  void cut(const Block& both, const Block& tt, const std::vector<double>& mode_scales, int terms,
           Matrix matrix, int c);

  int thetas_;
  int highest_mode_ = 0;
  std::array<Colour, 3> colours_;
  std::array<int, 3> terms_{};
  std::array<double, 3> energy_{};
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_RIVALS_BCSDF_FACTORS_H_
