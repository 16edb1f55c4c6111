#ifndef HEDDLE_FIBERS_CLOTH_WEAVE_REPORT_H_
#define HEDDLE_FIBERS_CLOTH_WEAVE_REPORT_H_
// What a weaver asks of a weave: floats, interlacings, cover, and whether the cloth holds together.
// Tested in tests/fibers/cloth/weave_report_test.cpp.

#include <optional>
#include <vector>

#include "fibers/cloth/weave.h"

namespace heddle {

/// Runs of crossings of one yarn on one side of the cloth.
struct FloatLengths {
  int longest = 0;  // crossings; 0: there is none, or none that ends
  double mean = 0;  // over the floats that end
  int endless = 0;  // yarns that stay on this side all along
};

/// Threads of a layer: none of them is held by a thread of another layer.
struct ClothLayer {
  std::vector<int> ends;
  std::vector<int> picks;
};

struct WeaveReport {
  int repeat_ends = 0;  // of the smallest repeat within the weave
  int repeat_picks = 0;
  double warp_share = 0;  // crossings with the warp on the face / all
  FloatLengths warp_face, warp_back, weft_face, weft_back;
  // times that a yarn changes sides, per crossing: 1 for plain weave, less for longer floats
  double warp_interlacing = 0;
  double weft_interlacing = 0;
  // how many ends (picks) cross like their neighbour before them, as in ribs and baskets
  int alike_ends = 0;
  int alike_picks = 0;
  std::vector<ClothLayer> layers;  // from the face down; one: the cloth holds together
};
WeaveReport report_weave(const Weave& weave);

/// The layers into which cloth falls apart, from the face down. A set of threads lifts off if each
/// of them lies over every thread of the other system outside the set. With s ends and t picks
/// that holds for some set just if it does for the s ends most often up and the t picks most often
/// over (Clapham, "When a fabric hangs together", Bull. London Math. Soc. 12, 1980). One layer: the
/// cloth holds together.
std::vector<ClothLayer> find_layers(const Weave& weave);

/// The share of the plane that a system covers, threads of these thicknesses side by side; at most
/// 1. Nothing where the draft lacks either.
std::optional<double> cover_of(const DraftThreads& threads);

/// Threads per centimetre; nothing where the draft states no spacing.
std::optional<double> threads_per_cm(const DraftThreads& threads);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_WEAVE_REPORT_H_
