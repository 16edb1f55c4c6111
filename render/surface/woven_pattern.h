#ifndef HEDDLE_RENDER_SURFACE_WOVEN_PATTERN_H_
#define HEDDLE_RENDER_SURFACE_WOVEN_PATTERN_H_
// The face of a woven cloth as rectangles. Crossings that follow each other along an end with the
// warp on top make one visible segment. So do those along a pick with the weft on top.
//
// x runs along the weft (across the ends), y along the warp (across the picks). The repeat is [0,
// width) x [0, height), periodic. Ends and picks have widths of their own, so the segments need not
// be square. Lengths are in the units of the config. Tested in
// tests/render/surface/woven_pattern_test.cpp.

#include <cstdint>
#include <functional>
#include <vector>

#include "fibers/cloth/weave.h"
#include "formats/toml_table.h"
#include "render/surface/woven_segment.h"

namespace heddle {

/// One visible segment of the repeat.
struct WovenFloat {
  YarnSystem system;
  Vec2d corner;  // lower left, inside the repeat; the segment may reach beyond it
  Vec2d size;
  int kind = 0;  // index into kinds()
  int yarn;      // end or pick
};

/// Segments of one system and size look alike.
struct FloatKind {
  YarnSystem system;
  Vec2d size;
  double share;  // of the cloth's area; all kinds together: 1
};

/// A segment of the endless cloth.
struct PlacedFloat {
  const WovenFloat* segment;
  std::int64_t repeat_x;  // which repeat its corner lies in
  std::int64_t repeat_y;
  Vec2d corner;  // on the cloth
};

/// What a sample of a picture sees of one segment, or of all segments of a kind together.
struct FootprintPart {
  int kind;
  const PlacedFloat* placed;  // null: the kind as a whole
  Rectangle part;             // in the segment's frame; where is_point, min is the point
  bool is_point;
  double share;  // of the footprint; all parts together: 1
};

class WovenPattern {
 public:
  /// [end] and [pick] widths. Throws std::invalid_argument where a yarn never goes under: its
  /// segment would have no end.
  WovenPattern(const Weave& weave, const std::vector<double>& end_widths,
               const std::vector<double>& pick_widths);

  const Vec2d& repeat() const { return repeat_; }
  const std::vector<WovenFloat>& floats() const { return floats_; }
  const std::vector<FloatKind>& kinds() const { return kinds_; }
  /// Share of the cloth's area that the system covers.
  double coverage(YarnSystem system) const;

  /// The segment that holds a point.
  PlacedFloat locate(const Vec2d& position) const;

  /// Every segment that shares area with the rectangle, in a fixed order, with that area in the
  /// frame of the segment.
  void visit(const Rectangle& rectangle,
             const std::function<void(const PlacedFloat&, const Rectangle&)>& visitor) const;

  /// What a footprint sees: the axis-parallel square about the position whose side is the
  /// footprint. Below kPointFootprint it is a point. From one to two repeats (the longer side of
  /// the repeat) it blends into the cloth as a whole, and from there on it is the whole. So at
  /// every footprint the mean over a repeat of what is seen is the cloth.
  void visit_footprint(const Vec2d& position, double footprint,
                       const std::function<void(const FootprintPart&)>& visitor) const;

  static constexpr double kPointFootprint = 1e-4;  // of the repeat's shorter side

 private:
  Vec2d repeat_;
  Vec2d largest_;              // sides of the largest segment
  std::vector<double> x_;      // [end + 1] left edges
  std::vector<double> y_;      // [pick + 1] lower edges
  std::vector<int> float_at_;  // [pick][end]
  std::vector<WovenFloat> floats_;
  std::vector<FloatKind> kinds_;
};

/// The section [weave] of a woven surface: the weave as in fabrics (fibers/cloth/weave_config.h),
/// and the widths. Errors: ConfigError; FileError of a draft or a picture.
WovenPattern read_woven_pattern(const TomlTable& section);

/// A colour of a yarn: three numbers from 0 to `max`.
Rgbd read_yarn_color(const TomlTable& yarn, const char* key, double max);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_WOVEN_PATTERN_H_
