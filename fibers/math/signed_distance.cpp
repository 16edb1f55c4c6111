#include "fibers/math/signed_distance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace heddle {
namespace {

// Larger than any 1 - cos, small enough that adding one to it stays exact enough to compare.
constexpr float kFar = 16;

double squared_chord(double polar_a, double polar_b, double azimuth) {
  const double half_polar = std::sin(0.5 * (polar_a - polar_b));
  const double half_azimuth = std::sin(0.5 * azimuth);
  return 4 * (half_polar * half_polar +
              std::sin(polar_a) * std::sin(polar_b) * half_azimuth * half_azimuth);
}

// Distance on the circle, 0 .. pi.
double circular(double angle) {
  return std::abs(std::remainder(angle, 2 * kPi));
}

// acos(1 - h) for h in [0, 2], by Abramowitz and Stegun 4.4.46 (absolute error 2e-8, plus
// rounding). It is written out because the compiler then makes a vector loop of it.
inline float angle_of(float h) {
  const float x = std::abs(1 - h);
  float p = -0.0012624911F;
  p = p * x + 0.0066700901F;
  p = p * x - 0.0170881256F;
  p = p * x + 0.0308918810F;
  p = p * x - 0.0501743046F;
  p = p * x + 0.0889789874F;
  p = p * x - 0.2145988016F;
  p = p * x + 1.5707963050F;
  const float below = h <= 1 ? h : 2 - h;  // 1 - x without cancellation
  const float a = p * std::sqrt(std::max(below, 0.0F));
  return h <= 1 ? a : kPif - a;
}

}  // namespace

ExactSignedDistance::ExactSignedDistance(SphericalMap map) : map_(std::move(map)) {
  const LatLongGrid& grid = map_.grid();
  const int n = grid.resolution();
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const int previous = column == 0 ? n - 1 : column - 1;
      if (map_.open(row, column) != map_.open(row, previous)) {
        sides_.push_back({false, column * grid.column_step(), row * grid.row_step(),
                          (row + 1) * grid.row_step()});
      }
      if (row > 0 && map_.open(row, column) != map_.open(row - 1, column)) {
        sides_.push_back({true, row * grid.row_step(), column * grid.column_step(),
                          (column + 1) * grid.column_step()});
      }
    }
  }
}

double ExactSignedDistance::operator()(const Vec3d& direction) const {
  const LatLongGrid::Cell cell = map_.grid().cell_of(direction);
  const double sign = map_.open(cell.row, cell.column) ? 1 : -1;
  if (sides_.empty()) return sign * kPi;
  const double polar = std::atan2(std::hypot(direction.x(), direction.y()), direction.z());
  const double azimuth = std::atan2(direction.y(), direction.x());
  double nearest = std::numeric_limits<double>::infinity();
  for (const Side& side : sides_) {
    if (side.along_parallel) {
      // The nearer in azimuth, the nearer on the sphere.
      const double middle = 0.5 * (side.begin + side.end);
      const double outside =
          std::max(circular(azimuth - middle) - 0.5 * (side.end - side.begin), 0.0);
      nearest = std::min(nearest, squared_chord(polar, side.fixed, outside));
    } else {
      // The nearer to the foot of the perpendicular, the nearer on the sphere.
      const double between = azimuth - side.fixed;
      const double foot = std::atan2(std::sin(polar) * std::cos(between), std::cos(polar));
      const double nearer_end =
          circular(foot - side.begin) < circular(foot - side.end) ? side.begin : side.end;
      const double at = foot > side.begin && foot < side.end ? foot : nearer_end;
      nearest = std::min(nearest, squared_chord(polar, at, between));
    }
  }
  return sign * 2 * std::asin(std::min(1.0, 0.5 * std::sqrt(nearest)));
}

SignedDistanceTransform::SignedDistanceTransform(int resolution) : grid_(resolution) {
  const int n = resolution;
  auto one_minus_cos = [](double angle) {
    const double s = std::sin(0.5 * angle);
    return 2 * s * s;
  };
  // Meridian b lies (b - c - 1/2) columns from the centre of column c; it has a foot where that is
  // below a quarter turn.
  foot_offsets_ = (n + 1) / 4;
  for (int row = 0; row < n; ++row) {
    const double polar = (row + 0.5) * grid_.row_step();
    for (int parallel = 0; parallel <= n; ++parallel) {
      const double other = parallel * grid_.row_step();
      polar_.push_back(static_cast<float>(one_minus_cos(polar - other)));
      product_.push_back(static_cast<float>(std::sin(polar) * std::sin(other)));
    }
    for (int offset = 0; offset < foot_offsets_; ++offset) {
      const double between = (offset + 0.5) * grid_.column_step();
      const double foot = std::atan2(std::sin(polar) * std::cos(between), std::cos(polar));
      const double sine = std::sin(polar) * std::sin(between);
      foot_.push_back(static_cast<float>(sine * sine / (1 + std::sqrt(1 - sine * sine))));
      foot_row_.push_back(std::min(static_cast<int>(foot / grid_.row_step()), n - 1));
    }
  }
  for (int half_columns = 0; half_columns <= n; ++half_columns) {
    azimuth_.push_back(static_cast<float>(one_minus_cos(0.5 * half_columns * grid_.column_step())));
  }
}

namespace {

// The sides of cells along meridians that lie between open and closed.
struct MeridianSides {
  std::size_t padded;
  std::size_t margin;
  // [row][meridian] 0 where there is a side, otherwise kFar; each row goes on `margin` past both
  // ends, so that it need not wrap
  std::vector<float> side;
  std::vector<std::uint8_t> row_has_any;  // [row + 1]

  MeridianSides(const std::vector<std::uint8_t>& open, std::size_t n, std::size_t past_ends)
      : padded(n + 2 * past_ends + 1), margin(past_ends), side(n * padded), row_has_any(n + 2, 0) {
    for (std::size_t row = 0; row < n; ++row) {
      float* const sides = &side[row * padded];
      const std::uint8_t* const cells = &open[row * n];
      for (std::size_t b = 0; b < n; ++b) {
        const bool differ = cells[b] != cells[b == 0 ? n - 1 : b - 1];
        sides[margin + b] = differ ? 0 : kFar;
        row_has_any[row + 1] |= differ ? 1 : 0;
      }
      for (std::size_t b = 0; b < margin; ++b) sides[b] = sides[b + n];
      for (std::size_t b = 0; b <= margin; ++b) sides[n + margin + b] = sides[margin + b];
    }
  }

  /// The sides of a row from meridian 0 on; from -margin to n + margin.
  const float* in_row(std::size_t row) const { return &side[row * padded + margin]; }
};

// How far, in half columns, the nearest corner or parallel side is from each column's middle.
// corner: [meridian]; side: [column] whether it has a parallel side. Twice around either way.
void count_half_columns(const std::vector<std::uint8_t>& corner,
                        const std::vector<std::uint8_t>& side, std::vector<int>& half_columns) {
  const std::size_t n = corner.size();
  // Column c has meridian c at its beginning and c + 1 at its end.
  int since = 2 * static_cast<int>(n);
  for (std::size_t pass = 0; pass < 2; ++pass) {
    for (std::size_t c = 0; c < n; ++c) {
      since = corner[c] != 0 ? 1 : since + 2;
      half_columns[c] = since;
    }
  }
  since = 2 * static_cast<int>(n);
  for (std::size_t pass = 0; pass < 2; ++pass) {
    for (std::size_t c = n; c-- > 0;) {
      since = corner[c + 1 == n ? 0 : c + 1] != 0 ? 1 : since + 2;
      half_columns[c] = side[c] != 0 ? 0 : std::min(half_columns[c], since);
    }
  }
}

// The parallels that have a corner or a side.
struct ParallelCorners {
  std::vector<std::size_t> parallels;
  std::vector<float> nearest_azimuth;  // [parallel that has any][column] 1 - cos of the azimuth

  /// azimuth: [half columns] 1 - cos.
  ParallelCorners(const std::vector<std::uint8_t>& open, const MeridianSides& meridians,
                  std::size_t n, const std::vector<float>& azimuth) {
    std::vector<std::uint8_t> corner(n);
    std::vector<std::uint8_t> above(n);
    std::vector<int> half_columns(n);
    nearest_azimuth.reserve((n + 1) * n);
    for (std::size_t parallel = 0; parallel <= n; ++parallel) {
      const bool inner = parallel > 0 && parallel < n;
      bool any = meridians.row_has_any[parallel] != 0 || meridians.row_has_any[parallel + 1] != 0;
      for (std::size_t c = 0; c < n; ++c) {
        above[c] = inner ? open[parallel * n + c] ^ open[(parallel - 1) * n + c] : 0;
        any |= above[c] != 0;
      }
      if (!any) continue;
      for (std::size_t b = 0; b < n; ++b) {
        const std::size_t previous = b == 0 ? n - 1 : b - 1;
        bool is_corner = above[b] != 0 || above[previous] != 0;
        if (parallel > 0) is_corner |= meridians.in_row(parallel - 1)[b] == 0;
        if (parallel < n) is_corner |= meridians.in_row(parallel)[b] == 0;
        corner[b] = is_corner ? 1 : 0;
      }
      count_half_columns(corner, above, half_columns);
      parallels.push_back(parallel);
      for (std::size_t c = 0; c < n; ++c) {
        nearest_azimuth.push_back(
            azimuth[static_cast<std::size_t>(std::min(half_columns[c], static_cast<int>(n)))]);
      }
    }
  }
};

}  // namespace

void SignedDistanceTransform::operator()(const SphericalMap& map, float* distance) const {
  assert(map.resolution() == grid_.resolution());
  const int n = grid_.resolution();
  const auto un = static_cast<std::size_t>(n);
  std::vector<std::uint8_t> open(un * un);
  for (int row = 0, i = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column, ++i) open[i] = map.open(row, column) ? 1 : 0;
  }
  const MeridianSides meridians(open, un, static_cast<std::size_t>(foot_offsets_));
  const ParallelCorners corners(open, meridians, un, azimuth_);
  const std::vector<std::size_t>& parallels = corners.parallels;
  if (parallels.empty()) {
    std::fill(distance, distance + un * un, open[0] != 0 ? kPif : -kPif);
    return;
  }

  // To corners and parallel sides.
  std::fill(distance, distance + un * un, kFar);
  // Blocks of columns that keep all parallels in the first-level cache and one row's minimum in
  // registers.
  constexpr std::size_t kBlock = 32;
  for (std::size_t begin = 0; begin < un; begin += kBlock) {
    const std::size_t width = std::min(kBlock, un - begin);
    for (std::size_t row = 0; row < un; ++row) {
      float nearest[kBlock];
      std::fill(nearest, nearest + kBlock, kFar);
      for (std::size_t i = 0; i < parallels.size(); ++i) {
        const float polar = polar_[row * (un + 1) + parallels[i]];
        const float product = product_[row * (un + 1) + parallels[i]];
        const float* const azimuth = &corners.nearest_azimuth[i * un + begin];
        if (width == kBlock) {
          for (std::size_t c = 0; c < kBlock; ++c)
            nearest[c] = std::min(nearest[c], polar + product * azimuth[c]);
        } else {
          for (std::size_t c = 0; c < width; ++c)
            nearest[c] = std::min(nearest[c], polar + product * azimuth[c]);
        }
      }
      std::copy(nearest, nearest + width, distance + row * un + begin);
    }
  }

  // To feet on meridian sides.
  const std::size_t margin = meridians.margin;
  for (std::size_t row = 0; row < un; ++row) {
    float* const nearest = distance + row * un;
    for (std::size_t offset = 0; offset < margin; ++offset) {
      const float foot = foot_[row * margin + offset];
      const auto foot_row = static_cast<std::size_t>(foot_row_[row * margin + offset]);
      if (meridians.row_has_any[foot_row + 1] == 0) continue;
      // Meridians on either side of column c: c - offset and c + 1 + offset.
      const float* const left = meridians.in_row(foot_row) - offset;
      const float* const right = meridians.in_row(foot_row) + 1 + offset;
      for (std::size_t c = 0; c < un; ++c)
        nearest[c] = std::min(nearest[c], foot + std::min(left[c], right[c]));
    }
    const std::uint8_t* const cells = &open[row * un];
    for (std::size_t c = 0; c < un; ++c) {
      const float angle = angle_of(std::min(nearest[c], 2.0F));
      nearest[c] = cells[c] != 0 ? angle : -angle;
    }
  }
}

}  // namespace heddle
