#include "precompute/sg_fit.h"

#include <tbb/parallel_for.h>

#include <cassert>

#include "fibers/math/random.h"

namespace heddle {

SgVisibility fit_sgs(const VisibilityMaps& maps, const VisibilitySettings& settings) {
  assert(maps.first_segment == 0);
  assert(!maps.both_sides || settings.sgs.axes == FibonacciSet::kSphere);
  const SgSumFit fit(VisibilityMaps::kResolution, settings.sgs);
  SgVisibility visibility;
  visibility.sharpness = static_cast<float>(settings.sgs.sharpness);
  for (const Vec3d& axis : fit.axes()) visibility.axes.push_back(axis.cast<float>());
  visibility.sees_nothing = maps.sees_nothing;
  visibility.rotation.resize(maps.count());
  const std::size_t lobes = fit.axes().size();
  visibility.weights.resize(maps.count() * lobes);
  tbb::parallel_for(std::size_t{0}, maps.count(), [&](std::size_t s) {
    RandomStream random(settings.seed, RandomStage::kVisibility, s, 0);
    const auto turned_columns = static_cast<int>(random.index(VisibilityMaps::kResolution));
    const SphericalMap map = maps.map(s);
    visibility.rotation[s] =
        half_from_float(static_cast<float>(turned_columns * map.grid().column_step()));
    if (maps.sees_nothing[s] != 0) return;
    const Eigen::VectorXd weights = fit.weights(map, turned_columns);
    for (std::size_t q = 0; q < lobes; ++q) {
      visibility.weights[s * lobes + q] =
          half_from_float(static_cast<float>(weights[static_cast<Eigen::Index>(q)]));
    }
  });
  return visibility;
}

}  // namespace heddle
