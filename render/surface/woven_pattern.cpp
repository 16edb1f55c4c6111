#include "render/surface/woven_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "fibers/cloth/weave_config.h"
#include "fibers/math/wrapped.h"
#include "formats/memory_need.h"

namespace heddle {
namespace {

std::vector<double> edges_of(const std::vector<double>& widths) {
  std::vector<double> edges = {0.0};
  for (const double width : widths) edges.push_back(edges.back() + width);
  return edges;
}

// The interval of `edges` that holds a coordinate of [0, edges.back()).
int interval(const std::vector<double>& edges, double coordinate) {
  const auto above = std::upper_bound(edges.begin(), edges.end(), coordinate);
  return std::clamp(static_cast<int>(above - edges.begin()) - 1, 0,
                    static_cast<int>(edges.size()) - 2);
}

// Crossings along one axis of the endless cloth, counted through all repeats.
struct CrossingRange {
  std::int64_t first;
  std::int64_t last;
  std::int64_t count() const { return last - first + 1; }
};

// Those that share length with [min, max], and perhaps one more at either end.
CrossingRange crossings_within(const std::vector<double>& edges, double min, double max) {
  const auto count = static_cast<std::int64_t>(edges.size()) - 1;
  const auto crossing = [&](double coordinate) {
    const double repeat = std::floor(coordinate / edges.back());
    return static_cast<std::int64_t>(repeat) * count +
           interval(edges, coordinate - repeat * edges.back());
  };
  return {crossing(min) - 1, crossing(max) + 1};
}

struct CrossingPlace {
  std::int64_t repeat;
  std::size_t index;  // within the repeat
};

CrossingPlace place_of(std::int64_t crossing, std::size_t count) {
  const auto n = static_cast<std::int64_t>(count);
  const std::int64_t repeat = crossing >= 0 ? crossing / n : (crossing - n + 1) / n;
  return {repeat, static_cast<std::size_t>(crossing - repeat * n)};
}

// Looking up a crossing takes as long as trying this many floats.
constexpr double kFewCrossings = 0.25;

std::vector<double> read_widths(const TomlTable& section, const char* key, int yarns) {
  const std::vector<double> cycle =
      section.numbers(key, {.min = 0.01, .max = 100}, 1, kMaxWeaveExtent);
  if (yarns % static_cast<int>(cycle.size()) != 0) {
    section.fail(
        key, fmt::format("expected a list whose length divides the {} yarns of the repeat", yarns));
  }
  std::vector<double> widths;
  for (int i = 0; i < yarns; ++i)
    widths.push_back(cycle[static_cast<std::size_t>(i) % cycle.size()]);
  return widths;
}

}  // namespace

WovenPattern::WovenPattern(const Weave& weave, const std::vector<double>& end_widths,
                           const std::vector<double>& pick_widths)
    : x_(edges_of(end_widths)), y_(edges_of(pick_widths)) {
  const auto crossings =
      static_cast<std::uint64_t>(weave.ends) * static_cast<std::uint64_t>(weave.picks);
  // A list that grows holds its old items as well while it moves.
  require_memory(crossings * (sizeof(int) + 3 * sizeof(WovenFloat)),
                 fmt::format("a surface of {} x {} crossings", weave.ends, weave.picks));
  repeat_ = {x_.back(), y_.back()};
  float_at_.assign(static_cast<std::size_t>(weave.ends) * static_cast<std::size_t>(weave.picks),
                   -1);
  const auto length_of = [](const std::vector<double>& edges, int i) {
    return edges[static_cast<std::size_t>(i) + 1] - edges[static_cast<std::size_t>(i)];
  };
  // Segments of one system: along `step` crossings of yarn after yarn.
  const auto add_system = [&](YarnSystem system) {
    const bool warp = system == YarnSystem::kWarp;
    const int yarns = warp ? weave.ends : weave.picks;
    const int crossings = warp ? weave.picks : weave.ends;
    const auto is_up = [&](int yarn, int crossing) {
      return warp ? weave.is_warp_up(yarn, crossing) : !weave.is_warp_up(crossing, yarn);
    };
    for (int yarn = 0; yarn < yarns; ++yarn) {
      for (int first = 0; first < crossings; ++first) {
        if (!is_up(yarn, first) || is_up(yarn, first - 1)) continue;
        double length = 0.0;
        for (int at = first; is_up(yarn, at); ++at) {
          const int crossing = wrapped(at, crossings);
          length += length_of(warp ? y_ : x_, crossing);
          float_at_[static_cast<std::size_t>(warp ? crossing * weave.ends + yarn
                                                  : yarn * weave.ends + crossing)] =
              static_cast<int>(floats_.size());
        }
        const double across = length_of(warp ? x_ : y_, yarn);
        WovenFloat segment;
        segment.system = system;
        segment.yarn = yarn;
        segment.size = warp ? Vec2d(across, length) : Vec2d(length, across);
        segment.corner =
            warp ? Vec2d(x_[static_cast<std::size_t>(yarn)], y_[static_cast<std::size_t>(first)])
                 : Vec2d(x_[static_cast<std::size_t>(first)], y_[static_cast<std::size_t>(yarn)]);
        floats_.push_back(segment);
      }
    }
  };
  add_system(YarnSystem::kWarp);
  add_system(YarnSystem::kWeft);
  if (std::count(float_at_.begin(), float_at_.end(), -1) > 0) {
    throw std::invalid_argument("expected a weave whose yarns all go under somewhere");
  }

  largest_ = Vec2d::Zero();
  const double repeat_area = repeat_.prod();
  for (WovenFloat& segment : floats_) {
    largest_ = largest_.cwiseMax(segment.size);
    // Sums of the same widths in another order differ in their last digits.
    const auto kind = std::find_if(kinds_.begin(), kinds_.end(), [&](const FloatKind& k) {
      return k.system == segment.system && (k.size - segment.size).norm() < 1e-9 * k.size.norm();
    });
    segment.kind = static_cast<int>(kind - kinds_.begin());
    if (kind == kinds_.end()) kinds_.push_back({segment.system, segment.size, 0.0});
    kinds_[static_cast<std::size_t>(segment.kind)].share += segment.size.prod() / repeat_area;
  }
}

double WovenPattern::coverage(YarnSystem system) const {
  double share = 0.0;
  for (const FloatKind& kind : kinds_) share += kind.system == system ? kind.share : 0.0;
  return share;
}

PlacedFloat WovenPattern::locate(const Vec2d& position) const {
  const Vec2d repeat(std::floor(position.x() / repeat_.x()),
                     std::floor(position.y() / repeat_.y()));
  const Vec2d inside = position - repeat.cwiseProduct(repeat_);
  const auto ends = x_.size() - 1;
  const auto at = static_cast<std::size_t>(interval(y_, inside.y())) * ends +
                  static_cast<std::size_t>(interval(x_, inside.x()));
  const WovenFloat& segment = floats_[static_cast<std::size_t>(float_at_[at])];
  PlacedFloat placed;
  placed.segment = &segment;
  // A segment that reaches over the repeat's edge began in the repeat before.
  placed.repeat_x =
      static_cast<std::int64_t>(repeat.x()) - (inside.x() < segment.corner.x() ? 1 : 0);
  placed.repeat_y =
      static_cast<std::int64_t>(repeat.y()) - (inside.y() < segment.corner.y() ? 1 : 0);
  placed.corner = segment.corner + Vec2d(static_cast<double>(placed.repeat_x) * repeat_.x(),
                                         static_cast<double>(placed.repeat_y) * repeat_.y());
  return placed;
}

void WovenPattern::visit(
    const Rectangle& rectangle,
    const std::function<void(const PlacedFloat&, const Rectangle&)>& visitor) const {
  const auto repeat_of = [this](double coordinate, int axis) {
    return static_cast<std::int64_t>(std::floor(coordinate / repeat_[axis]));
  };
  const auto visit_float = [&](std::int64_t j, std::int64_t i, const WovenFloat& segment) {
    const Vec2d origin(static_cast<double>(i) * repeat_.x(), static_cast<double>(j) * repeat_.y());
    const Vec2d corner = origin + segment.corner;
    const Rectangle clip = {(rectangle.min - corner).cwiseMax(0.0),
                            (rectangle.max - corner).cwiseMin(segment.size)};
    if ((clip.min.array() >= clip.max.array()).any()) return;
    visitor({&segment, i, j, corner}, clip);
  };
  const CrossingRange x = crossings_within(x_, rectangle.min.x(), rectangle.max.x());
  const CrossingRange y = crossings_within(y_, rectangle.min.y(), rectangle.max.y());
  // Few crossings of a large repeat: only the floats that lie on them, in the order of the loop
  // below.
  if (static_cast<double>(x.count()) * static_cast<double>(y.count()) <
      kFewCrossings * static_cast<double>(floats_.size())) {
    std::vector<std::array<std::int64_t, 3>> found;  // repeat along y, along x, float
    for (std::int64_t pick = y.first; pick <= y.last; ++pick) {
      for (std::int64_t end = x.first; end <= x.last; ++end) {
        const CrossingPlace along_x = place_of(end, x_.size() - 1);
        const CrossingPlace along_y = place_of(pick, y_.size() - 1);
        const int id = float_at_[along_y.index * (x_.size() - 1) + along_x.index];
        const WovenFloat& segment = floats_[static_cast<std::size_t>(id)];
        // A segment that reaches over the repeat's edge began in the repeat before.
        found.push_back({along_y.repeat - (y_[along_y.index] < segment.corner.y() ? 1 : 0),
                         along_x.repeat - (x_[along_x.index] < segment.corner.x() ? 1 : 0), id});
      }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    for (const auto& [j, i, id] : found) visit_float(j, i, floats_[static_cast<std::size_t>(id)]);
    return;
  }
  for (std::int64_t j = repeat_of(rectangle.min.y() - largest_.y(), 1);
       j <= repeat_of(rectangle.max.y(), 1); ++j) {
    for (std::int64_t i = repeat_of(rectangle.min.x() - largest_.x(), 0);
         i <= repeat_of(rectangle.max.x(), 0); ++i) {
      for (const WovenFloat& segment : floats_) visit_float(j, i, segment);
    }
  }
}

void WovenPattern::visit_footprint(const Vec2d& position, double footprint,
                                   const std::function<void(const FootprintPart&)>& visitor) const {
  if (footprint < kPointFootprint * repeat_.minCoeff()) {
    const PlacedFloat placed = locate(position);
    const Vec2d local = position - placed.corner;
    visitor({placed.segment->kind, &placed, {local, local}, true, 1.0});
    return;
  }
  const double t = std::clamp(footprint / repeat_.maxCoeff() - 1.0, 0.0, 1.0);
  const double whole = t * t * (3.0 - 2.0 * t);
  if (whole < 1.0) {
    const Vec2d half_side = Vec2d::Constant(0.5 * footprint);
    const double scale = (1.0 - whole) / (footprint * footprint);
    visit({position - half_side, position + half_side},
          [&](const PlacedFloat& placed, const Rectangle& part) {
            visitor({placed.segment->kind, &placed, part, false, part.area() * scale});
          });
  }
  if (whole > 0.0) {
    for (std::size_t kind = 0; kind < kinds_.size(); ++kind) {
      visitor({static_cast<int>(kind),
               nullptr,
               {Vec2d::Zero(), kinds_[kind].size},
               false,
               whole * kinds_[kind].share});
    }
  }
}

WovenPattern read_woven_pattern(const TomlTable& section) {
  const Weave weave = read_weave(section);
  const std::vector<double> end_widths = read_widths(section, "end_widths", weave.ends);
  const std::vector<double> pick_widths = read_widths(section, "pick_widths", weave.picks);
  try {
    return {weave, end_widths, pick_widths};
  } catch (const std::invalid_argument& error) {
    for (const char* key : {"matrix", "draft", "picture"}) {
      if (section.has(key)) section.fail(key, error.what());
    }
    section.fail("notation", error.what());
  }
}

Rgbd read_yarn_color(const TomlTable& yarn, const char* key, double max) {
  const std::array<double, 3> rgb = yarn.number3(key, {.min = 0, .max = max});
  return {rgb[0], rgb[1], rgb[2]};
}

}  // namespace heddle
