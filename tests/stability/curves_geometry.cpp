// Shells over folds that get tighter than the cloth is thick.

#include <cmath>

#include "pipeline/warnings.h"
#include "render/shell.h"
#include "tests/stability/folded_mesh.h"
#include "tests/stability/stability_curve.h"

namespace heddle::stability {

Curve shell_curve(Effort) {
  Curve curve{.title = "Shells over tight folds",
              .driver = "half the thickness of the cloth over the least radius of curvature",
              .measure = "share of tetrahedra without a picture",
              .is_log = false,
              .drivers = {0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 1.6, 2, 3},
              .series = {{"flipped", {}}, {"share of the folds that curves too tightly", {}}},
              // kHiddenTetShare is passed with the first folds that are too tight
              .warning_from = 1.0};
  constexpr double kHalf = 0.1;  // mm
  for (const double ratio : curve.drivers) {
    const FoldedMesh fold(kHalf / ratio);
    const Shell shell(fold.mesh(), -kHalf, kHalf);
    curve.series[0].values.push_back(
        static_cast<double>(shell.flipped_count() + shell.degenerate_count()) /
        static_cast<double>(shell.tets().size()));
    curve.series[1].values.push_back(fold.share_tighter_than(kHalf));
  }
  return curve;
}

}  // namespace heddle::stability
