#ifndef HEDDLE_FIBERS_CLOTH_WEAVE_H_
#define HEDDLE_FIBERS_CLOTH_WEAVE_H_
// The repeat of a weave as a warp-up matrix, from a notation or a matrix of 0 and 1. Rows are picks
// (weft yarns, y), columns are ends (warp yarns, x), seen from the face. Row 0 is the first pick,
// the lowest. configs/README.md has the grammar of notations; weave_config.h reads drafts and point
// papers. Tested in tests/fibers/cloth/weave_test.cpp.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fibers/math/wrapped.h"

namespace heddle {

/// Ends, and picks, of the largest weave.
inline constexpr int kMaxWeaveExtent = 4096;

/// Ends and picks.
enum class YarnSystem : std::uint8_t { kWarp, kWeft };
enum class WeaveFace : std::uint8_t { kWarp, kWeft };
enum class TwillDirection : std::uint8_t {
  kZ,
  kS
};  // the diagonal's rise to the right or the left

/// What a draft says of the threads of one system. Each list is empty where the draft says nothing.
struct DraftThreads {
  std::vector<std::array<float, 3>> color;  // [thread] linear rgb
  std::vector<double> spacing_mm;           // [thread] room that it takes across
  std::vector<double> thickness_mm;         // [thread]
};

struct Weave {
  std::string notation;  // as written; "matrix", or the name of the draft's or the picture's file
  int ends = 0;          // columns of the repeat
  int picks = 0;         // rows of the repeat
  WeaveFace face = WeaveFace::kWarp;  // the system that covers at least half of the face
  std::vector<std::uint8_t> warp_up;  // [pick][end] 1 where the warp lies over the weft
  DraftThreads warp;                  // [end]
  DraftThreads weft;                  // [pick]
  std::vector<std::string> warnings;  // of the draft's reader

  /// Is the warp over the weft where end and pick cross? Indices wrap.
  bool is_warp_up(int end, int pick) const {
    return warp_up[static_cast<std::size_t>(wrapped(pick, picks)) * ends + wrapped(end, ends)] != 0;
  }
};

/// What a notation leaves open.
struct WeaveChoices {
  // of twills, in ends per pick: 1 by default; of "UP/DOWN satin": the smallest that is one
  std::optional<int> step = {};
  TwillDirection direction = TwillDirection::kZ;  // of twills; S is the mirror image of Z
  int width = 0;  // of "herringbone" and "pointed": ends after which the twill turns
};

/// Parses a notation. Throws std::invalid_argument saying what was expected.
///   "plain"
///   "warp rib N/M"    an end over N picks and under M, the next the other way round
///   "weft rib N/M"    a pick over N ends and under M, the next the other way round
///   "basket N/M"      blocks of N and M ends on blocks of N and M picks
///   "twill N/M/..."   N up, M down, ...; the pattern moves by `step` ends from pick to pick
///   "herringbone N/M/...", "pointed N/M/..."   that twill, which turns every `width` ends: with a
///                     cut where warp meets weft, or in a point
///   "satin N/STEP"    of N ends, all but one crossing of each on `face`; STEP is the counter
///   "N/M satin"       of N + M ends, each up N times
/// A counter needs N >= 5, 2 <= step <= N - 2, and N and step without common divisor.
Weave parse_weave(std::string_view notation, WeaveFace face = WeaveFace::kWarp,
                  const WeaveChoices& choices = {});

/// Rows of 0 (weft over) and 1 (warp over) with blanks between them, the top row (the last pick)
/// first. Throws std::invalid_argument saying what was expected and where.
Weave parse_weave_matrix(std::string_view text);

/// Sets `face` from `warp_up`.
void find_face(Weave& weave);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_WEAVE_H_
