#ifndef HEDDLE_PIPELINE_CONTACT_SHEET_H_
#define HEDDLE_PIPELINE_CONTACT_SHEET_H_
// The frames of a sequence side by side in one small picture, each with its number. Tested in
// tests/pipeline/sequence_test.cpp.

#include <filesystem>
#include <vector>

#include "formats/image_file.h"

namespace heddle {

struct SheetFrame {
  int frame;
  std::filesystem::path png;
};

/// At most so many frames are shown, evenly chosen, the first and the last among them.
inline constexpr int kMostSheetFrames = 64;
/// Pixels along the longer side of a frame there; smaller frames keep their size.
inline constexpr int kSheetFrameEdge = 256;

/// Row by row, as many columns as rows or one more. Frames are reduced by whole pixels' means of
/// the screen's values. Errors: FileError.
RgbPicture contact_sheet(const std::vector<SheetFrame>& frames);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CONTACT_SHEET_H_
