#include "tests/fuzz/targets.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "formats/curve_file.h"
#include "formats/image_file.h"
#include "formats/input_error.h"
#include "formats/utf8_text.h"
#include "formats/wif_file.h"

namespace heddle::fuzz {
namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

template <class Read>
void run(Read&& read) {
  try {
    read();
  } catch (const FileError& error) {
    // Messages stay short and printable, whatever the file holds.
    require(std::string_view(error.what()).size() < 1000);
    require(is_utf8(error.what()));
  }
}

void check_curves(const CurveSet& curves) {
  require(curves.curve_count() > 0);
  require(curves.first_point.size() == curves.curve_count() + 1);
  require(curves.first_point.back() == curves.points.size());
  require(curves.thickness.empty() || curves.thickness.size() == curves.points.size());
  require(is_utf8(curves.info));
  for (std::size_t c = 0; c < curves.curve_count(); ++c) {
    require(curves.curve(c).size() >= 2);
    sample_curve(curves, c, 2);
  }
  for (const CurvePoint& point : curves.points) {
    for (const float value : point) require(std::isfinite(value));
  }
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

void wif(std::span<const std::byte> bytes) {
  run([&] {
    const WifDraft draft = parse_wif(text_of(bytes), "draft.wif");
    const auto ends = static_cast<std::size_t>(draft.ends());
    const auto picks = static_cast<std::size_t>(draft.picks());
    require(ends > 0 && picks > 0 && draft.warp_up.size() == ends * picks);
    require(draft.warp.color.empty() || draft.warp.color.size() == ends);
    require(draft.weft.color.empty() || draft.weft.color.size() == picks);
    require(draft.warp.spacing_mm.empty() || draft.warp.spacing_mm.size() == ends);
    require(draft.weft.thickness_mm.empty() || draft.weft.thickness_mm.size() == picks);
    require(is_utf8(draft.title));
    for (const std::string& warning : draft.warnings) require(is_utf8(warning));
    // The other shed gives the other face.
    const WifDraft other = parse_wif(text_of(bytes), "draft.wif", !draft.rising_shed);
    require(std::equal(draft.warp_up.begin(), draft.warp_up.end(), other.warp_up.begin(),
                       [](std::uint8_t a, std::uint8_t b) { return a + b == 1; }));
  });
}

void paper(std::span<const std::byte> bytes) {
  run([&] {
    const RgbPicture picture = parse_png(bytes, "paper.png", 256);
    require(picture.width > 0 && picture.width <= 256 && picture.height > 0);
    require(picture.rgb.size() == 3 * static_cast<std::size_t>(picture.width) * picture.height);
  });
}

void bcc(std::span<const std::byte> bytes) {
  run([&] { check_curves(parse_bcc(bytes, "curves.bcc")); });
}

void hair(std::span<const std::byte> bytes) {
  run([&] { check_curves(parse_hair(bytes, "curves.hair")); });
}

void obj_lines(std::span<const std::byte> bytes) {
  run([&] { check_curves(parse_obj_lines(text_of(bytes), "curves.obj")); });
}

}  // namespace heddle::fuzz
