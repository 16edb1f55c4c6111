#ifndef HEDDLE_PIPELINE_PACK_CHECK_H_
#define HEDDLE_PIPELINE_PACK_CHECK_H_
// Is a pack fit to render from? Numbered checks, the cheap and general ones first; the first that
// fails is the message.
//    1-4 the manifest and every file's size and checksum (fibers/baked/fabric_pack.h)
//    5   every tensor file holds its stage, key, config and program version
//    6   the fibers keep the invariants of an exemplar (fibers/cloth/exemplar.h)
//    7   what the readers ask: finite numbers, shapes that agree, flags 0 or 1, unit axes, weights
//        not negative, one number of segments in all files, ids of existing segments
//    8   signed distances: the mean lies within [-pi, pi]
//    9   sums of Gaussians: the weights of a segment are together at most the whole sphere
//   10   transfer: the grid covers the tile, light comes from where the manifest says, errors are
//        not negative, and a cell has paths exactly where it has segments
//   11   volume: the box covers the tile
// Tested in tests/pipeline/pack_check_test.cpp.

#include <filesystem>

#include "fibers/baked/fabric_pack.h"

namespace heddle {

/// Checks 8 to 11, on a pack that has been opened: its readers make 6 and 7. Throws FileError
/// naming the file and the number of the check.
void check_pack_contents(const FabricPack& pack);

/// All checks.
void check_pack(const std::filesystem::path& folder);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PACK_CHECK_H_
