#ifndef HEDDLE_PIPELINE_PACK_CHECK_H_
#define HEDDLE_PIPELINE_PACK_CHECK_H_
// Is a pack fit to render from? Numbered checks, the cheap and general ones first; the first that fails is the message.
//    1-4 the manifest and every file's size and checksum (fibers/baked/fabric_pack.h)
//    5   every tensor file holds its stage, key, config and program version
//    6   the fibers keep the invariants of an exemplar (fibers/cloth/exemplar.h), scattering widths and colours are in range
//    7   every stored number is finite, and all parts speak of the same number of segments and cells
//    8   signed distances: flags are 0 or 1, the mean lies within [-pi, pi]
//    9   sums of Gaussians: sharpness above 0, unit axes, weights not negative and together at most the whole sphere
//   10   transfer: the grid covers the tile, light comes from where the manifest says, errors are not negative, and a cell
//        has paths exactly where it has segments
//   11   volume: the box covers the tile (and every segment id exists: load_pack)
// Tested in tests/pipeline/pack_check_test.cpp.

#include <filesystem>

#include "fibers/baked/fabric_pack.h"

namespace heddle {

/// Checks 8 to 11, on a pack that has been opened. Throws FileError naming the file and the number of the check.
void check_pack_contents(const FabricPack& pack);

/// All checks.
void check_pack(const std::filesystem::path& folder);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PACK_CHECK_H_
