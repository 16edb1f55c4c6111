#include "fibers/cloth/curve_exemplar.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "fibers/cloth/exemplar.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

// Pieces between two control points, at most.
constexpr int kMostPieces = 256;

// Shorter pieces at the border, in target lengths of a segment, are cut away whole.
constexpr double kShortestPiece = 2;

// Ends of periodic curves may be off by this share of the tile.
constexpr double kPeriodTolerance = 1e-4;

// Right-handed: the axis that follows the normal in the order x, y, z becomes x.
Vec3d to_cloth(const CurvePoint& point, UpAxis normal, double unit_mm) {
  const Vec3d p = unit_mm * Vec3d(point[0], point[1], point[2]);
  if (normal == UpAxis::kX) return {p.y(), p.z(), p.x()};
  if (normal == UpAxis::kY) return {p.z(), p.x(), p.y()};
  return p;
}

double polyline_length(const std::vector<Vec3d>& points) {
  double length = 0;
  for (std::size_t k = 1; k < points.size(); ++k) length += (points[k] - points[k - 1]).norm();
  return length;
}

// The part of a to b inside the rectangle, as shares of it.
std::optional<std::pair<double, double>> part_inside(const Vec3d& a, const Vec3d& b,
                                                     const std::array<double, 2>& size) {
  double from = 0;
  double to = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double d = b[axis] - a[axis];
    const double high = size[static_cast<std::size_t>(axis)];
    if (d == 0) {
      if (a[axis] < 0 || a[axis] >= high) return {};
      continue;
    }
    const double t0 = -a[axis] / d;
    const double t1 = (high - a[axis]) / d;
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  if (from >= to) return {};
  return std::pair(from, to);
}

// Appends a point unless it is where the last one is.
void append_point(std::vector<Vec3d>& points, const Vec3d& point, double least_mm) {
  if (points.empty() || (point - points.back()).norm() > least_mm) points.push_back(point);
}

class CurveTiler {
 public:
  CurveTiler(const CurvesConfig& config, double segment_mm)
      : config_(config), segment_mm_(segment_mm), curves_(read_curves(config.file)) {}

  std::vector<TileCurve> all() {
    for (std::size_t c = 0; c < curves_.curve_count(); ++c) {
      if (config_.periodic) {
        add_periodic(c);
      } else {
        add_cut(c);
      }
    }
    if (config_.thickness != CurveThickness::kNone && curves_.thickness.empty())
      throw FileError(config_.file.string() + ": it has no thicknesses; take that of the fiber");
    if (tile_.empty()) {
      throw FileError(fmt::format(
          "{}: none of {} curves reaches into the rectangle of {:g} x {:g} mm at ({:g}, {:g}) mm; "
          "with unit_mm = {:g} they lie in x {:g} .. {:g} mm, y {:g} .. {:g} mm",
          config_.file.string(), curves_.curve_count(), config_.size_mm[0], config_.size_mm[1],
          config_.from_mm[0], config_.from_mm[1], config_.unit_mm, low_.x() + config_.from_mm[0],
          high_.x() + config_.from_mm[0], low_.y() + config_.from_mm[1],
          high_.y() + config_.from_mm[1]));
    }
    centre_heights();
    return std::move(tile_);
  }

  CurveCut cut;

 private:
  // Relative to the rectangle's corner.
  std::vector<Vec3d> points_of(std::size_t c) {
    const auto control = curves_.curve(c);
    double longest = 0;
    for (std::size_t k = 1; k < control.size(); ++k) {
      longest = std::max(longest, (to_cloth(control[k], config_.normal, config_.unit_mm) -
                                   to_cloth(control[k - 1], config_.normal, config_.unit_mm))
                                      .norm());
    }
    const int pieces = curves_.kind == CurveKind::kPolyline
                           ? 1
                           : static_cast<int>(std::clamp(std::ceil(longest / segment_mm_), 1.0,
                                                         static_cast<double>(kMostPieces)));
    const Vec3d corner(config_.from_mm[0], config_.from_mm[1], 0);
    std::vector<Vec3d> points;
    for (const CurvePoint& point : sample_curve(curves_, c, pieces)) {
      append_point(points, to_cloth(point, config_.normal, config_.unit_mm) - corner,
                   1e-3 * segment_mm_);
      low_ = low_.cwiseMin(points.back());
      high_ = high_.cwiseMax(points.back());
    }
    return points;
  }

  double thickness_of(std::size_t c) const {
    if (curves_.thickness.empty()) return 0;
    double sum = 0;
    for (std::uint64_t p = curves_.first_point[c]; p < curves_.first_point[c + 1]; ++p)
      sum += static_cast<double>(curves_.thickness[p]);
    return sum / static_cast<double>(curves_.first_point[c + 1] - curves_.first_point[c]);
  }

  void add_periodic(std::size_t c) {
    std::vector<Vec3d> points = points_of(c);
    const Vec3d size(config_.size_mm[0], config_.size_mm[1], 0);
    const Vec3d period = points.back() - points.front();
    for (const Vec3d& whole : {Vec3d(size.x(), 0, 0), Vec3d(0, size.y(), 0)}) {
      const double sign = period.dot(whole) > 0 ? 1 : -1;
      if (points.size() < 3 || (period - sign * whole).norm() > kPeriodTolerance * size.norm())
        continue;
      points.back() = points.front() + sign * whole;
      const double length = polyline_length(points);
      cut.whole_mm += length;
      cut.kept_mm += length;
      tile_.push_back({c, std::move(points), false, thickness_of(c)});
      return;
    }
    throw FileError(fmt::format(
        "{}: curve {} goes on by ({:g}, {:g}, {:g}) mm, not by one period of the {:g} x {:g} mm "
        "tile "
        "along x or y: the set is not periodic with it",
        config_.file.string(), c, period.x(), period.y(), period.z(), size.x(), size.y()));
  }

  void add_cut(std::size_t c) {
    const std::vector<Vec3d> points = points_of(c);
    if (points.size() < 2) return;
    std::vector<std::vector<Vec3d>> pieces(1);
    bool starts_inside = false;
    bool ends_inside = false;
    for (std::size_t k = 1; k < points.size(); ++k) {
      const auto inside = part_inside(points[k - 1], points[k], config_.size_mm);
      if (!inside) {
        if (!pieces.back().empty()) pieces.emplace_back();
        continue;
      }
      const Vec3d step = points[k] - points[k - 1];
      if (inside->first > 0 && !pieces.back().empty()) pieces.emplace_back();
      starts_inside = starts_inside || (k == 1 && inside->first == 0);
      ends_inside = k + 1 == points.size() && inside->second == 1;
      append_point(pieces.back(), points[k - 1] + inside->first * step, 1e-3 * segment_mm_);
      append_point(pieces.back(), points[k - 1] + inside->second * step, 1e-3 * segment_mm_);
      if (inside->second < 1) pieces.emplace_back();
    }
    if (pieces.back().empty()) pieces.pop_back();
    if (pieces.empty()) return;
    cut.whole_mm += polyline_length(points);
    std::size_t inner_ends = (starts_inside ? 1 : 0) + (ends_inside ? 1 : 0);
    // The last piece of a closed curve goes on with its first.
    if (curves_.closed[c] && starts_inside && ends_inside && pieces.size() > 1) {
      std::vector<Vec3d>& last = pieces.back();
      last.insert(last.end(), pieces.front().begin() + 1, pieces.front().end());
      pieces.front() = std::move(last);
      pieces.pop_back();
      inner_ends = 0;
    }
    cut.ends += 2 * pieces.size() - inner_ends;
    for (std::vector<Vec3d>& piece : pieces) {
      const double length = polyline_length(piece);
      if (length < kShortestPiece * segment_mm_ || piece.size() < 2) continue;
      if (piece.size() == 2) piece.insert(piece.begin() + 1, 0.5 * (piece[0] + piece[1]));
      cut.kept_mm += length;
      tile_.push_back({c, std::move(piece), true, thickness_of(c)});
    }
  }

  void centre_heights() {
    double low = tile_[0].points[0].z();
    double high = low;
    for (const TileCurve& curve : tile_) {
      for (const Vec3d& point : curve.points) {
        low = std::min(low, point.z());
        high = std::max(high, point.z());
      }
    }
    for (TileCurve& curve : tile_) {
      for (Vec3d& point : curve.points) point.z() -= 0.5 * (low + high);
    }
  }

  const CurvesConfig& config_;
  double segment_mm_;
  CurveSet curves_;
  std::vector<TileCurve> tile_;
  Vec3d low_ = Vec3d::Constant(1e30);
  Vec3d high_ = Vec3d::Constant(-1e30);
};

}  // namespace

double length_of(const TileCurve& curve) {
  return polyline_length(curve.points);
}

double CurvesConfig::radius_mm(const TileCurve& curve, double own) const {
  if (thickness == CurveThickness::kNone) return own;
  return (thickness == CurveThickness::kDiameter ? 0.5 : 1) * unit_mm * curve.thickness;
}

CurvesConfig read_curves_config(const TomlTable& table) {
  CurvesConfig config;
  config.file = table.content_file("file");
  config.unit_mm = table.number("unit_mm", {.min = 1e-6, .max = 1e6});
  const std::string normal = table.choice("normal", {"x", "y", "z"});
  config.normal = normal == "x" ? UpAxis::kX : normal == "y" ? UpAxis::kY : UpAxis::kZ;
  config.from_mm = table.number2("from_mm", {.min = -1e6, .max = 1e6});
  config.size_mm = table.number2("size_mm", {.min = 1e-3, .max = kMaxTileMm});
  config.periodic = table.boolean("periodic", false);
  config.as_yarns = table.choice("as", {"yarns", "fibers"}) == "yarns";
  if (!config.as_yarns) {
    const std::string thickness =
        table.choice("thickness", {"fiber", "radius", "diameter"}, "fiber");
    config.thickness = thickness == "radius"     ? CurveThickness::kRadius
                       : thickness == "diameter" ? CurveThickness::kDiameter
                                                 : CurveThickness::kNone;
  }
  return config;
}

std::vector<TileCurve> curves_on_tile(const CurvesConfig& config, double segment_mm,
                                      CurveCut* cut) {
  CurveTiler tiler(config, segment_mm);
  std::vector<TileCurve> tile = tiler.all();
  if (cut != nullptr) *cut = tiler.cut;
  return tile;
}

}  // namespace heddle
