#include "pipeline/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace heddle {
namespace {

constexpr int kGap = 4;  // pixels between frames, and about them
constexpr int kDot = 2;  // pixels along a dot of a digit
constexpr std::uint8_t kSheetPaper = 24;
constexpr std::uint8_t kInk = 235;

// Digits of 3 x 5 dots, rows from the top, three bits a row.
constexpr std::array<std::array<unsigned, 5>, 10> kDigits = {{{7, 5, 5, 5, 7},
                                                              {2, 6, 2, 2, 7},
                                                              {7, 1, 7, 4, 7},
                                                              {7, 1, 7, 1, 7},
                                                              {5, 5, 7, 1, 1},
                                                              {7, 4, 7, 1, 7},
                                                              {7, 4, 7, 5, 7},
                                                              {7, 1, 1, 2, 2},
                                                              {7, 5, 7, 5, 7},
                                                              {7, 5, 7, 1, 7}}};
constexpr int kLabelHeight = (5 + 2) * kDot;

void set_pixel(RgbPicture& picture, int x, int y, std::uint8_t value) {
  if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) return;
  for (int c = 0; c < 3; ++c)
    picture.rgb[static_cast<std::size_t>(3 * (y * picture.width + x) + c)] = value;
}

void draw_number(RgbPicture& picture, int left, int top, int number) {
  for (const char digit : std::to_string(number)) {
    for (int row = 0; row < 5 * kDot; ++row) {
      const unsigned bits =
          kDigits[static_cast<std::size_t>(digit - '0')][static_cast<std::size_t>(row / kDot)];
      for (int column = 0; column < 3 * kDot; ++column) {
        if ((bits >> (2 - column / kDot) & 1U) != 0)
          set_pixel(picture, left + column, top + row, kInk);
      }
    }
    left += 4 * kDot;
  }
}

/// Means of squares of `factor` pixels; what is left at the right and below is dropped.
RgbPicture reduced(const RgbPicture& picture, int factor) {
  RgbPicture small{picture.width / factor, picture.height / factor, {}};
  small.rgb.reserve(static_cast<std::size_t>(3 * small.width * small.height));
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int k = 0; k < factor * factor; ++k) {
          const int at = (y * factor + k / factor) * picture.width + x * factor + k % factor;
          sum += picture.rgb[static_cast<std::size_t>(3 * at + c)];
        }
        const int count = factor * factor;
        small.rgb.push_back(static_cast<std::uint8_t>((sum + count / 2) / count));
      }
    }
  }
  return small;
}

std::vector<SheetFrame> chosen(const std::vector<SheetFrame>& frames) {
  const auto count = static_cast<int>(frames.size());
  if (count <= kMostSheetFrames) return frames;
  std::vector<SheetFrame> some;
  for (int k = 0; k < kMostSheetFrames; ++k) {
    some.push_back(
        frames[static_cast<std::size_t>(k) * (frames.size() - 1) / (kMostSheetFrames - 1)]);
  }
  return some;
}

}  // namespace

RgbPicture contact_sheet(const std::vector<SheetFrame>& frames) {
  const std::vector<SheetFrame> shown = chosen(frames);
  const auto count = static_cast<int>(shown.size());
  const int columns = static_cast<int>(std::ceil(std::sqrt(count)));
  const int rows = (count + columns - 1) / columns;
  RgbPicture sheet;
  int width = 0;  // of a cell
  int height = 0;
  for (int k = 0; k < count; ++k) {
    const SheetFrame& frame = shown[static_cast<std::size_t>(k)];
    const RgbPicture full = read_png(frame.png, kMaxExtent);
    const int longer = std::max(full.width, full.height);
    const int factor = std::min((longer + kSheetFrameEdge - 1) / kSheetFrameEdge,
                                std::min(full.width, full.height));
    const RgbPicture small = reduced(full, factor);
    if (k == 0) {
      width = small.width + kGap;
      height = small.height + kGap + kLabelHeight;
      sheet = {columns * width + kGap, rows * height + kGap, {}};
      sheet.rgb.assign(static_cast<std::size_t>(3 * sheet.width * sheet.height), kSheetPaper);
    }
    const int left = kGap + k % columns * width;
    const int top = kGap + k / columns * height;
    for (int y = 0; y < std::min(small.height, height - kGap - kLabelHeight); ++y) {
      const auto row = small.rgb.begin() + static_cast<std::ptrdiff_t>(3) * y * small.width;
      std::copy(
          row, row + static_cast<std::ptrdiff_t>(3) * std::min(small.width, width - kGap),
          sheet.rgb.begin() + static_cast<std::ptrdiff_t>(3) * ((top + y) * sheet.width + left));
    }
    draw_number(sheet, left, top + height - kGap - kLabelHeight + kDot, frame.frame);
  }
  return sheet;
}

}  // namespace heddle
