#ifndef HEDDLE_FIBERS_CLOTH_WEAVE_CONFIG_H_
#define HEDDLE_FIBERS_CLOTH_WEAVE_CONFIG_H_
// The weave of a config: one of a notation, a matrix, a draft (WIF) and a point paper (PNG). Keys:
// configs/README.md, "Weaves". Tested in tests/fibers/cloth/weave_config_test.cpp.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "fibers/cloth/weave.h"
#include "formats/image_file.h"
#include "formats/toml_table.h"
#include "formats/wif_file.h"

namespace heddle {

/// Reads those keys of a table [weave] that say how warp and weft cross. The canonical text of the
/// document then holds a draft or a picture by its content. Errors: ConfigError; FileError of the
/// draft or the picture.
Weave read_weave(const TomlTable& weave);

/// The draft's drawdown, with what it says of the threads. `name`: what `notation` is to be.
Weave weave_of_draft(const WifDraft& draft, const std::string& name);

/// Which colours of a point paper mean what. A pixel is a crossing, the top row is the last pick.
/// The lists hold "#rrggbb". Without both, the darker half of all greys is warp. With one of them,
/// every other colour is of the other system.
struct PaperColors {
  std::vector<std::string> warp;
  std::vector<std::string> weft;
};
/// Throws std::invalid_argument saying what was expected.
Weave weave_of_paper(const RgbPicture& picture, const PaperColors& colors, const std::string& name);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_WEAVE_CONFIG_H_
