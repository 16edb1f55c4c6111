#ifndef HEDDLE_PIPELINE_ACCURACY_MEASURE_ACCURACY_H_
#define HEDDLE_PIPELINE_ACCURACY_MEASURE_ACCURACY_H_
// Fills an accuracy table: every setting against path tracing on a flat swatch of the fabric, and
// on one that lies in folds over black, by the renderers' own code.
//
// Eight pairs of view and light, four of them with low light, five sharpnesses; each a picture of
// 32 x 32 pixels as wide as a fiber. Errors of wider pixels come from the same pictures:
// differences, averaged over squares of pixels, before they are squared. Path tracing and method
// share their eye rays (probe.h). Squares are relative to the squared mean radiance of their own
// pair, and pairs of one height of the light are averaged; their spread is the error. Folds bring
// light that grazes and shadows that end: four pairs, pixels of 4 mm (errors of folds are wide, and
// noise averages), many samples each, against paths that end where they leave the cloth; light from
// fold to fold is measured apart, with what the folds see of each other. The flat swatch is
// path-traced once more under directional light from behind. What a setting changes is measured
// against the one that it is a change of, too: both share all random numbers. Settings, all else as
// the fabric says:
//   path, path-6, dual-scattering             nothing baked
//   exact, volume                             everything
//   order K                                   exact with the transfer cut to harmonics up to K: the
//                                             same as one baked to that order
//   cells x F                                 exact with larger cells (FabricVariant::cell_size)
//   voxels x F                                volume with larger voxels (FabricVariant::voxel_rate)
//   signed distance, Gaussians                exact with one form of visibility for all spherical
//                                             Gaussians
// Tested in tests/pipeline/accuracy_test.cpp.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/accuracy/swatch.h"

namespace heddle {

/// Names of settings, also used by the planner.
std::string order_setting(int order);
std::string cells_setting(double factor);
std::string voxels_setting(double factor);
std::string surface_setting(const std::string& surface);
inline constexpr char kDistanceSetting[] = "signed distance";
inline constexpr char kGaussiansSetting[] = "Gaussians";

/// What is tried besides the fabric's own settings.
inline constexpr int kOtherOrders[] = {1, 3};
inline constexpr double kOtherCells[] = {2, 4};
inline constexpr double kOtherVoxels[] = {0.5};

/// Data of the other settings; the pack holds the fabric's own.
struct AccuracyData {
  FabricPack pack;                    // everything
  std::map<double, Transfer> cells;   // by factor
  std::map<double, IdVolume> voxels;  // by factor
};

/// Called with the share done, 0 .. 1; may throw to stop.
using AccuracyProgress = std::function<void(double)>;

/// sharpness, footprint_mm, settings and threads of a table. `data` is as it was afterwards.
AccuracyTable measure_accuracy(AccuracyData& data, std::uint64_t seed,
                               const AccuracyProgress& progress, const AccuracyEffort& effort = {});

/// The same for one surface model in place of the fibers: settings "path" and
/// surface_setting(name).
AccuracyTable measure_surface_accuracy(const Exemplar& exemplar, const SurfaceFabric& surface,
                                       std::uint64_t seed, const AccuracyProgress& progress,
                                       const AccuracyEffort& effort = {});

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_ACCURACY_MEASURE_ACCURACY_H_
