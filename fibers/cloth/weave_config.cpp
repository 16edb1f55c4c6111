#include "fibers/cloth/weave_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string_view>

#include "formats/srgb_color.h"

namespace heddle {
namespace {

constexpr std::size_t kMaxPaperColors = 256;

Weave read_notation(const TomlTable& weave) {
  const std::string notation = weave.string("notation");
  const bool turns = notation.starts_with("herringbone") || notation.starts_with("pointed");
  const bool twill = turns || notation.starts_with("twill");
  WeaveFace face = WeaveFace::kWarp;
  WeaveChoices choices;
  if (notation.starts_with("satin"))
    face = weave.choice("face", {"warp", "weft"}) == "warp" ? WeaveFace::kWarp : WeaveFace::kWeft;
  if (twill || notation.ends_with(" satin")) {
    if (const auto step = weave.optional_integer("step", 1, kMaxWeaveExtent - 1))
      choices.step = static_cast<int>(*step);
  }
  if (twill && weave.choice("direction", {"Z", "S"}, "Z") == "S")
    choices.direction = TwillDirection::kS;
  if (turns) choices.width = static_cast<int>(weave.integer("width", 2, kMaxWeaveExtent / 2));
  try {
    return parse_weave(notation, face, choices);
  } catch (const std::invalid_argument& error) {
    weave.fail("notation", error.what());
  }
}

DraftThreads threads_of_draft(const WifThreads& from) {
  DraftThreads threads;
  for (const auto& color : from.color) {
    std::array<float, 3>& linear = threads.color.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) linear[c] = static_cast<float>(linear_of_srgb(color[c]));
  }
  threads.spacing_mm = from.spacing_mm;
  threads.thickness_mm = from.thickness_mm;
  return threads;
}

std::uint32_t number_of(const std::uint8_t* rgb) {
  return std::uint32_t{rgb[0]} << 16 | std::uint32_t{rgb[1]} << 8 | rgb[2];
}

// "#rrggbb" as a number.
std::uint32_t parse_color(const std::string& text) {
  const auto bytes = bytes_of_hex(text);
  if (!bytes)
    throw std::invalid_argument(
        fmt::format("expected colours \"#rrggbb\", found \"{:.10}\"", text));
  return number_of(bytes->data());
}

std::set<std::uint32_t> parse_colors(const std::vector<std::string>& texts) {
  std::set<std::uint32_t> colors;
  for (const std::string& text : texts) colors.insert(parse_color(text));
  return colors;
}

}  // namespace

Weave weave_of_draft(const WifDraft& draft, const std::string& name) {
  static_assert(kMaxDraftThreads == kMaxWeaveExtent);
  Weave weave;
  weave.notation = name;
  weave.ends = draft.ends();
  weave.picks = draft.picks();
  weave.warp_up = draft.warp_up;
  weave.warp = threads_of_draft(draft.warp);
  weave.weft = threads_of_draft(draft.weft);
  weave.warnings = draft.warnings;
  find_face(weave);
  return weave;
}

Weave weave_of_paper(const RgbPicture& picture, const PaperColors& colors,
                     const std::string& name) {
  const std::set<std::uint32_t> warp = parse_colors(colors.warp);
  const std::set<std::uint32_t> weft = parse_colors(colors.weft);
  for (const std::uint32_t color : warp) {
    if (weft.contains(color))
      throw std::invalid_argument(fmt::format("#{:06x} is a colour of both, warp and weft", color));
  }
  std::set<std::uint32_t> absent = warp;
  absent.insert(weft.begin(), weft.end());
  Weave weave;
  weave.notation = name;
  weave.ends = picture.width;
  weave.picks = picture.height;
  weave.warp_up.reserve(picture.rgb.size() / 3);
  for (int row = picture.height; row-- > 0;) {
    for (int column = 0; column < picture.width; ++column) {
      const std::size_t at = 3 * (static_cast<std::size_t>(row) * picture.width + column);
      const std::uint32_t color = number_of(&picture.rgb[at]);
      absent.erase(color);
      bool up = warp.contains(color);
      if (warp.empty() && weft.empty()) {
        // Luma of ITU-R BT.601, in thousandths.
        up = 299 * picture.rgb[at] + 587 * picture.rgb[at + 1] + 114 * picture.rgb[at + 2] <
             500 * 255;
      } else if (warp.empty()) {
        up = !weft.contains(color);
      } else if (!up && !weft.empty() && !weft.contains(color)) {
        throw std::invalid_argument(
            fmt::format("the pixel in column {}, row {} from the top is #{:06x}: expected a colour "
                        "of warp_colors or weft_colors",
                        column + 1, row + 1, color));
      }
      weave.warp_up.push_back(up ? 1 : 0);
    }
  }
  if (!absent.empty())
    throw std::invalid_argument(fmt::format("#{:06x} is nowhere in the picture", *absent.begin()));
  find_face(weave);
  return weave;
}

Weave read_weave(const TomlTable& weave) {
  std::string source = "notation";
  int sources = 0;
  for (const char* key : {"notation", "matrix", "draft", "picture"}) {
    if (!weave.has(key)) continue;
    source = key;
    if (++sources > 1)
      weave.fail(key, "expected one of the keys notation, matrix, draft and picture");
  }
  if (source == "notation") return read_notation(weave);
  try {
    if (source == "matrix") return parse_weave_matrix(weave.string("matrix"));
    if (source == "draft") {
      const std::optional<bool> rising = weave.optional_boolean("rising_shed");
      const std::filesystem::path path = weave.content_file("draft");
      return weave_of_draft(read_wif(path, rising), path.filename().string());
    }
    const PaperColors colors = {weave.optional_strings("warp_colors", 1, kMaxPaperColors),
                                weave.optional_strings("weft_colors", 1, kMaxPaperColors)};
    const std::filesystem::path path = weave.content_file("picture");
    return weave_of_paper(read_png(path, kMaxWeaveExtent), colors, path.filename().string());
  } catch (const std::invalid_argument& error) {
    weave.fail(source, error.what());
  }
}

}  // namespace heddle
