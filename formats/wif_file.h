#ifndef HEDDLE_FORMATS_WIF_FILE_H_
#define HEDDLE_FORMATS_WIF_FILE_H_
// Weave drafts: the Weaving Information File, version 1.1 (R. Nielsen, 1997), and the dialects in
// use. Threads, shafts and treadles count from 1. A file that contradicts itself is refused with
// its line; what programs in use get wrong is read with a warning. Errors: FileError. Tested in
// tests/formats/wif_file_test.cpp.
//
// What a draft leaves open is settled so:
//   - A missing "Rising Shed" means a sinking shed, as the standard says, with a warning.
//   - With a lift plan as well as tie-up and treadling, the lift plan holds if [CONTENTS] lists it.
//   - Threads after the last one that threading or treadling puts on a shaft are left out.
//   - Threads without a colour take that of [WARP] or [WEFT], else the first of the palette.
//   - Of keys that come twice, the first holds.
//   - A line inside [TEXT], [NOTES] or a private section that is not a heading is text.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace heddle {

/// Limits of a draft: ends, picks, shafts and treadles each.
inline constexpr int kMaxDraftThreads = 4096;

/// What a draft says of the threads of one system. Each list is empty where it says nothing.
struct WifThreads {
  // [thread] red, green, blue from 0 to 1, as for a screen (not linear)
  std::vector<std::array<double, 3>> color;
  std::vector<double> spacing_mm;    // [thread]
  std::vector<double> thickness_mm;  // [thread]
};

struct WifDraft {
  std::string title;  // UTF-8
  int shafts = 0;
  int treadles = 0;          // 0 for a lift plan
  bool rising_shed = false;  // as it was read
  // Each sorted, without repetitions; no entry: none.
  std::vector<std::vector<int>> threading;  // [end] shafts
  std::vector<std::vector<int>> tieup;      // [treadle] shafts; empty for a lift plan
  std::vector<std::vector<int>> treadling;  // [pick] treadles; empty for a lift plan
  std::vector<std::vector<int>> liftplan;   // [pick] shafts; empty for a tie-up
  WifThreads warp;                          // [end]
  WifThreads weft;                          // [pick]
  std::vector<std::uint8_t> warp_up;        // [pick][end] the drawdown: 1 where the warp lies over
  std::vector<std::string> warnings;        // each with file and line

  int ends() const { return static_cast<int>(threading.size()); }
  int picks() const {
    return static_cast<int>(treadling.empty() ? liftplan.size() : treadling.size());
  }
};

/// `rising_shed`: in place of what the file says. A file has at most 64 MiB.
WifDraft read_wif(const std::filesystem::path& path, std::optional<bool> rising_shed = {});

/// The same for the bytes of a file; `name` stands for it in messages.
WifDraft parse_wif(std::string_view bytes, const std::string& name,
                   std::optional<bool> rising_shed = {});

}  // namespace heddle

#endif  // HEDDLE_FORMATS_WIF_FILE_H_
