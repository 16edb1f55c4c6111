#include "render/stand_in/fit_stand_in.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "fibers/math/nonnegative_least_squares.h"

namespace heddle {
namespace {

// Texels that stand for all of them.
constexpr std::size_t kFitTexels = 128;
constexpr std::size_t kErrorTexels = 4096;

// Share of the base that goes through the sheet.
constexpr double kMostThrough = 0.95;

enum Layer { kReflected, kTransmitted, kSpecular, kSheen, kLayers };

/// What the layers send for one pair and colour, each in the amount that the fit multiplies.
using Columns = std::array<std::array<double, kLayers>, 3>;

/// The colours of the layers for everything else given.
class StandInFit {
 public:
  StandInFit(const FlatMaps& maps, const FlatResponse& response)
      : maps_(&maps), response_(&response), columns_(response.pair_count()) {
    Rgbd sum = Rgbd::Zero();
    for (const Rgb& albedo : maps.albedo) sum += albedo.cast<double>();
    mean_albedo_ = sum / static_cast<double>(maps.texel_count());
  }

  /// Sets the best colours and the share that goes through. Returns the sum of squares.
  double solve(StandInParameters& parameters) {
    fill_columns(parameters);
    std::array<Rgbd, kLayers> amounts;
    double squares = 0;
    for (int c = 0; c < 3; ++c) {
      const auto [of_channel, left] = solve_channel(c);
      for (std::size_t layer = 0; layer < kLayers; ++layer)
        amounts[layer][c] = of_channel[static_cast<Eigen::Index>(layer)];
      squares += left;
    }
    const Rgbd& reflected = amounts[kReflected];
    const Rgbd& transmitted = amounts[kTransmitted];
    const double both = reflected.sum() + transmitted.sum();
    parameters.subsurface = both > 0 ? std::min(kMostThrough, transmitted.sum() / both) : 0;
    parameters.base_scale = reflected / (1 - parameters.subsurface);
    for (int c = 0; c < 3; ++c) {
      const double through = parameters.subsurface * parameters.base_scale[c];
      parameters.subsurface_tint[c] = through > 0 ? transmitted[c] / through : 1;
    }
    parameters.specular_color = amounts[kSpecular];
    parameters.sheen_color = amounts[kSheen];
    return squares;
  }

 private:
  void fill_columns(const StandInParameters& parameters) {
    StandInParameters plain = parameters;
    plain.base_scale = Rgbd::Ones();
    const StandIn stand_in(*maps_, plain);
    const std::vector<StandInTexel> texels = spread_texels(stand_in, kFitTexels);
    tbb::parallel_for(std::size_t{0}, columns_.size(), [&](std::size_t pair) {
      const Vec3d wi = response_->light(pair).cast<double>();
      const Vec3d wo = response_->view(pair).cast<double>();
      Columns sums = {};
      for (const StandInTexel& texel : texels) {
        const StandInLayers layers = stand_in.layers(texel, wi, wo);
        const double share = texel.opacity / static_cast<double>(kFitTexels);
        for (int c = 0; c < 3; ++c) {
          auto& row = sums[static_cast<std::size_t>(c)];
          row[kReflected] += share * texel.base_color[c] * layers.reflected;
          row[kTransmitted] += share * texel.base_color[c] * layers.transmitted;
          row[kSpecular] += share * layers.specular;
          row[kSheen] += share * parameters.sheen * layers.sheen;
        }
      }
      columns_[pair] = sums;
    });
  }

  /// The amounts of the layers and the sum of squares that is left. No layer sends on more light
  /// than it gets: where the base would, less goes through it.
  std::pair<Eigen::VectorXd, double> solve_channel(int c) const {
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(kLayers, kLayers);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(kLayers);
    double values = 0;
    for (std::size_t pair = 0; pair < columns_.size(); ++pair) {
      const auto& row = columns_[pair][static_cast<std::size_t>(c)];
      const Eigen::Map<const Eigen::Vector<double, kLayers>> column(row.data());
      const double value = response_->mean(pair)[c];
      gram += column * column.transpose();
      right += value * column;
      values += value * value;
    }
    // A layer that sends nothing anywhere gets nothing.
    gram.diagonal().array() += 1e-12 + 1e-9 * gram.diagonal().maxCoeff();
    const double most_base = 1 / std::max(mean_albedo_[c], 1e-3);
    const Eigen::VectorXd most = Eigen::Vector<double, kLayers>(most_base, most_base, 1, 1);
    Eigen::VectorXd amounts = nonnegative_least_squares(gram, right, &most);
    amounts[kTransmitted] = std::min(amounts[kTransmitted], most_base - amounts[kReflected]);
    // Both colours are factors on one map, so one cannot be black alone.
    amounts[kReflected] =
        std::max(amounts[kReflected], (1 / kMostThrough - 1) * amounts[kTransmitted]);
    return {amounts, values - 2 * amounts.dot(right) + amounts.dot(gram * amounts)};
  }

  const FlatMaps* maps_;
  const FlatResponse* response_;
  Rgbd mean_albedo_;
  std::vector<Columns> columns_;  // [pair]
};

/// A parameter that is searched for, on a scale of its logarithm.
struct Searched {
  double StandInParameters::*member;
  double least;
  double most;
};
constexpr std::array<Searched, 6> kSearched = {{{&StandInParameters::alpha_along, 0.01, 1},
                                                {&StandInParameters::alpha_across, 0.05, 1},
                                                {&StandInParameters::reflectance, 0.002, 0.8},
                                                {&StandInParameters::sheen, 0.01, 1},
                                                {&StandInParameters::sheen_roughness, 0.07, 1},
                                                {&StandInParameters::normal_strength, 0.1, 1}}};

}  // namespace

StandInParameters fit_stand_in(const FlatMaps& maps, const FlatResponse& response) {
  constexpr double kFirstStep = 2;  // factor on a parameter
  constexpr double kLastStep = 1.05;
  // A step that gains less is not worth an odder material.
  constexpr double kGain = 0.999;
  StandInFit fit(maps, response);
  StandInParameters best;
  double least = std::numeric_limits<double>::infinity();
  // Highlights may be sharp or dull, and the search only goes downhill.
  for (const double along : {0.05, 0.2, 0.6}) {
    StandInParameters start;
    start.alpha_along = along;
    start.sheen = 0.1;
    const double squares = fit.solve(start);
    if (squares < least) {
      least = squares;
      best = start;
    }
  }
  for (double step = kFirstStep; step > kLastStep;) {
    bool better = false;
    for (const Searched& searched : kSearched) {
      for (const double factor : {step, 1 / step}) {
        StandInParameters tried = best;
        tried.*searched.member =
            std::clamp(best.*searched.member * factor, searched.least, searched.most);
        if (tried.*searched.member == best.*searched.member) continue;
        const double squares = fit.solve(tried);
        if (!(squares < kGain * least)) continue;
        least = squares;
        best = tried;
        better = true;
      }
    }
    if (!better) step = std::sqrt(step);
  }
  return best;
}

std::optional<StandInError> stand_in_error(const StandIn& stand_in, const FlatResponse& response,
                                           bool from_below) {
  const std::vector<StandInTexel> texels = spread_texels(stand_in, kErrorTexels);
  std::vector<Rgbd> values(response.pair_count(), Rgbd::Zero());
  tbb::parallel_for(std::size_t{0}, values.size(), [&](std::size_t pair) {
    const Vec3d wi = response.light(pair).cast<double>();
    const Vec3d wo = response.view(pair).cast<double>();
    for (const StandInTexel& texel : texels)
      values[pair] += stand_in.radiance(texel, wi, wo) / static_cast<double>(kErrorTexels);
  });
  double squares = 0;
  double sum = 0;
  double reference = 0;
  int count = 0;
  for (std::size_t pair = 0; pair < values.size(); ++pair) {
    if ((response.light(pair).z() < 0) != from_below) continue;
    const auto& halves = response.radiance[pair];
    squares += ((values[pair] - halves[0]) * (values[pair] - halves[1])).sum();
    sum += values[pair].sum();
    reference += response.mean(pair).sum();
    count += 3;
  }
  if (!(reference > 0)) return {};
  return StandInError{std::sqrt(std::max(0.0, squares / count)) * count / reference,
                      sum / reference - 1};
}

}  // namespace heddle
