#ifndef HEDDLE_FIBERS_CLOTH_WEAVE_H_
#define HEDDLE_FIBERS_CLOTH_WEAVE_H_
// Weave notation to a warp-up matrix: "plain", "twill 2/2" (up/down), "satin 5/2" (ends/step).
// Rows are picks (weft yarns, y), columns are ends (warp yarns, x), seen from the face.
// Tested in tests/fibers/cloth/weave_test.cpp.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace heddle {

enum class WeaveFace : std::uint8_t { kWarp, kWeft };

struct Weave {
  std::string notation;
  int ends = 0;                       // columns of the repeat
  int picks = 0;                      // rows of the repeat
  int step = 1;                       // shift of the pattern from one pick to the next, in ends
  WeaveFace face = WeaveFace::kWarp;  // which system floats on the face
  std::vector<std::uint8_t> warp_up;  // [pick][end] 1 where the warp lies over the weft

  /// Is the warp over the weft where end and pick cross? Indices wrap.
  bool is_warp_up(int end, int pick) const {
    const int e = ((end % ends) + ends) % ends;
    const int p = ((pick % picks) + picks) % picks;
    return warp_up[static_cast<std::size_t>(p) * ends + e] != 0;
  }
};

/// Parses a notation. twill n/m: n up, m down, step 1. satin n/step: warp-faced (one weft float of
/// n - 1 hidden) or weft-faced. It needs n >= 5, 2 <= step <= n - 2, and n and step coprime. Throws
/// std::invalid_argument saying what was expected.
Weave parse_weave(std::string_view notation, WeaveFace face);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_WEAVE_H_
