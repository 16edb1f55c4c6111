#include "precompute/far_bake.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "fibers/baked/cone_scattering.h"
#include "fibers/math/light_dual.h"
#include "fibers/math/random.h"
#include "fibers/math/sh_rotation.h"
#include "fibers/math/spherical_harmonics.h"
#include "fibers/scattering/wo_space.h"

namespace heddle {
namespace {

using FarLanes = BcsdfTable::Lanes;
constexpr int kFarLanes = FarLanes::SizeAtCompileTime;
constexpr std::uint32_t kFarNone = 0xffffffffU;
// Edge of a sort of tangents, in deviations of the narrowest lobe with the light's blur.
constexpr float kSortEdge = 0.8F;
// Deviation of the blur in the light's direction, in edges of a cell of the grid.
constexpr float kLightBlur = 0.5F;
// Views whose progress is told together.
constexpr std::uint32_t kViewsPerReport = 64;

/// What one view's rays meet.
struct ViewHits {
  std::vector<std::uint32_t> segments;
  float height = 0;  // mean z, mm
};

/// Rays of one view, one in each cell of a grid over the tile.
struct RayGrid {
  int columns;
  int rows;

  RayGrid(const Exemplar& exemplar, int rays) {
    const double aspect = static_cast<double>(exemplar.width_mm) / exemplar.height_mm;
    columns = std::clamp(static_cast<int>(std::lround(std::sqrt(rays * aspect))), 1, rays);
    rows = std::max(1, rays / columns);
  }
};

ViewHits trace_view(const TileScene& scene, const Vec3& wo, std::uint32_t view,
                    const FarSettings& settings) {
  const Exemplar& exemplar = scene.exemplar();
  const auto [columns, rows] = RayGrid(exemplar, settings.rays);
  // Rays start over the highest fiber, on the side of the eye.
  const float start = wo.z() > 0 ? exemplar.z_max : exemplar.z_min;
  RandomStream random(settings.seed, RandomStage::kFar, view, 0);
  ViewHits hits;
  double height = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float x = exemplar.width_mm * (static_cast<float>(column) + random.uniform()) /
                      static_cast<float>(columns);
      const float y = exemplar.height_mm * (static_cast<float>(row) + random.uniform()) /
                      static_cast<float>(rows);
      const Vec3 origin = Vec3(x, y, start) + 1e-3F * wo;
      const std::optional<FiberHit> hit = scene.intersect({origin, -wo}, kNoFiber);
      if (!hit) continue;
      hits.segments.push_back(hit->segment);
      height += origin.z() - hit->t * wo.z();
    }
  }
  if (!hits.segments.empty())
    hits.height = static_cast<float>(height / static_cast<double>(hits.segments.size()));
  return hits;
}

/// Segments whose fibers scatter alike: equal materials, and tangents close to each other.
struct Sorts {
  std::vector<std::uint32_t> of_segment;  // kFarNone where no ray sees it
  std::vector<Vec3> tangent;              // [sort] unit mean
  std::vector<std::uint16_t> material;    // [sort]
};

Sorts make_sorts(const Exemplar& exemplar, const std::vector<std::uint8_t>& is_seen, float edge) {
  Sorts sorts;
  sorts.of_segment.assign(exemplar.segment_count(), kFarNone);
  std::map<std::array<int, 4>, std::uint32_t> sort_of;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    if (is_seen[s] == 0) continue;
    Vec3 tangent = exemplar.segment_tangent(s);
    // A fiber has no sense of direction.
    if (tangent.x() + tangent.y() < 0) tangent = -tangent;
    const std::uint16_t material = exemplar.segment_material(s);
    const auto step = [&](float x) { return static_cast<int>(std::floor(x / edge)); };
    const auto [place, is_new] =
        sort_of.try_emplace({material, step(tangent.x()), step(tangent.y()), step(tangent.z())},
                            static_cast<std::uint32_t>(sorts.tangent.size()));
    if (is_new) {
      sorts.tangent.emplace_back(Vec3::Zero());
      sorts.material.push_back(material);
    }
    sorts.of_segment[s] = place->second;
    sorts.tangent[place->second] += tangent;
  }
  for (Vec3& tangent : sorts.tangent) tangent.normalize();
  return sorts;
}

/// Bakes the rows of single views.
class FarBaker {
 public:
  FarBaker(const FarInputs& inputs, const FarSettings& settings, FarTable& table)
      : inputs_(&inputs),
        settings_(&settings),
        table_(&table),
        grid_(table.grid()),
        lights_(table.light_count()) {
    assert(lights_ % kFarLanes == 0 && "expected a grid whose edge is a multiple of 4");
    for (std::uint32_t l = 0; l < lights_; ++l) {
      light_.push_back(grid_.direction(l));
      for (std::size_t c = 0; c < 3; ++c)
        light_axes_[c].push_back(light_[l][static_cast<Eigen::Index>(c)]);
    }
    const auto n = static_cast<std::size_t>(table.coefficients());
    projected_.resize(lights_ * n);
    for (std::uint32_t l = 0; l < lights_; ++l) {
      direction_moments(table.order, table.both_sides, light_[l], &projected_[l * n]);
      LightDual::of(table.order, table.both_sides).apply(&projected_[l * n]);
    }
  }

  /// Rays of all views first: they say which segments are seen at all.
  void trace(const std::function<void(double)>& progress) {
    const Exemplar& exemplar = inputs_->scene->exemplar();
    hits_.resize(table_->view_count());
    for_views(progress, [&](std::uint32_t view) {
      hits_[view] = trace_view(*inputs_->scene, grid_.direction(view), view, *settings_);
    });
    std::vector<std::uint8_t> is_seen(exemplar.segment_count(), 0);
    const RayGrid rays(exemplar, settings_->rays);
    const float all_rays = static_cast<float>(rays.columns) * static_cast<float>(rays.rows);
    for (std::uint32_t view = 0; view < hits_.size(); ++view) {
      for (const std::uint32_t segment : hits_[view].segments) is_seen[segment] = 1;
      table_->coverage[view] = static_cast<float>(hits_[view].segments.size()) / all_rays;
      table_->height[view] = hits_[view].height;
    }
    sorts_ = make_sorts(exemplar, is_seen, kSortEdge * narrowest_lobe());
    sample_visibility(is_seen);
    inclinations();
  }

  void shade(const std::function<void(double)>& progress) {
    for_views(progress, [&](std::uint32_t view) {
      if (!hits_[view].segments.empty()) shade_view(view, scratch_.local());
    });
  }

 private:
  /// Sums over the hits of one view.
  struct Scratch {
    std::vector<std::uint32_t> sort_slot;  // [sort]
    std::vector<std::uint32_t> cell_slot;  // [cell]
    std::vector<std::uint32_t> sorts;      // [slot]
    std::vector<std::uint32_t> cells;      // [slot]
    std::vector<float> visible;            // [slot of a sort][light]
    std::vector<float> response;           // [slot of a sort][coefficient][rgb]
    std::vector<float> wanted;             // [slot of a cell][coefficient][rgb]
  };

  template <class Work>
  void for_views(const std::function<void(double)>& progress, Work&& work) const {
    const std::uint32_t views = table_->view_count();
    for (std::uint32_t first = 0; first < views; first += kViewsPerReport) {
      progress(static_cast<double>(first) / views);
      tbb::parallel_for(first, std::min(views, first + kViewsPerReport), work);
    }
  }

  float narrowest_lobe() const {
    double beta = 1;
    for (const BcsdfTable& bcsdf : inputs_->materials) {
      if (!bcsdf.fiber().isotropic_white)
        beta = std::min({beta, bcsdf.fiber().beta_r, bcsdf.fiber().beta_tt});
    }
    return std::sqrt(static_cast<float>(beta * beta) + table_->light_variance);
  }

  /// visible_[segment seen][light], 255 where open; edges are as wide as a cell.
  void sample_visibility(const std::vector<std::uint8_t>& is_seen) {
    map_of_segment_.assign(is_seen.size(), kFarNone);
    std::vector<std::uint32_t> seen;
    for (std::uint32_t s = 0; s < is_seen.size(); ++s) {
      if (is_seen[s] == 0) continue;
      map_of_segment_[s] = static_cast<std::uint32_t>(seen.size());
      seen.push_back(s);
    }
    visible_.resize(seen.size() * lights_);
    const float edge = grid_.cell_edge();
    tbb::parallel_for(std::size_t{0}, seen.size(), [&](std::size_t k) {
      for (std::uint32_t l = 0; l < lights_; ++l) {
        const float distance = inputs_->ssdf->signed_distance(seen[k], light_[l]);
        const float share = std::clamp(0.5F + distance / edge, 0.0F, 1.0F);
        visible_[k * lights_ + l] = static_cast<std::uint8_t>(std::lround(255 * share));
      }
    });
  }

  /// Inclinations of the lights to the tangents of every sort.
  void inclinations() {
    theta_.resize(sorts_.tangent.size() * lights_);
    tbb::parallel_for(std::size_t{0}, sorts_.tangent.size(), [&](std::size_t sort) {
      for (std::uint32_t l = 0; l < lights_; ++l) {
        theta_[sort * lights_ + l] =
            std::asin(std::clamp(light_[l].dot(sorts_.tangent[sort]), -1.0F, 1.0F));
      }
    });
  }

  static FarLanes lanes_at(const std::vector<float>& values, std::size_t first) {
    return Eigen::Map<const FarLanes>(values.data() + first);
  }
  /// Cosines between a direction and the lights from l on.
  FarLanes cosines(std::uint32_t l, const Vec3& direction) const {
    return lanes_at(light_axes_[0], l) * direction.x() +
           lanes_at(light_axes_[1], l) * direction.y() +
           lanes_at(light_axes_[2], l) * direction.z();
  }

  void gather(std::uint32_t view, Scratch& own) const {
    const auto values = static_cast<std::size_t>(3 * table_->coefficients());
    const Vec3 wo = grid_.direction(view);
    own.sort_slot.resize(sorts_.tangent.size(), kFarNone);
    own.cell_slot.resize(inputs_->transfer->cell_count(), kFarNone);
    own.sorts.clear();
    own.cells.clear();
    own.visible.clear();
    own.response.clear();
    own.wanted.clear();
    for (const std::uint32_t segment : hits_[view].segments) {
      const std::uint32_t sort = sorts_.of_segment[segment];
      std::uint32_t& slot = own.sort_slot[sort];
      if (slot == kFarNone) {
        slot = static_cast<std::uint32_t>(own.sorts.size());
        own.sorts.push_back(sort);
        own.visible.resize(own.visible.size() + lights_, 0.0F);
        own.response.resize(own.response.size() + values);
        response_of(sort, wo, &own.response[slot * values]);
      }
      float* const sum = &own.visible[static_cast<std::size_t>(slot) * lights_];
      const std::uint8_t* const map =
          &visible_[static_cast<std::size_t>(map_of_segment_[segment]) * lights_];
      for (std::uint32_t l = 0; l < lights_; ++l) sum[l] += static_cast<float>(map[l]);
      const std::uint32_t cell = inputs_->transfer->cell_of_segment[segment];
      std::uint32_t& cell_slot = own.cell_slot[cell];
      if (cell_slot == kFarNone) {
        cell_slot = static_cast<std::uint32_t>(own.cells.size());
        own.cells.push_back(cell);
        own.wanted.resize(own.wanted.size() + values, 0.0F);
      }
      const float* const response = &own.response[slot * values];
      float* const wanted = &own.wanted[cell_slot * values];
      for (std::size_t k = 0; k < values; ++k) wanted[k] += response[k];
    }
    for (const std::uint32_t sort : own.sorts) own.sort_slot[sort] = kFarNone;
    for (const std::uint32_t cell : own.cells) own.cell_slot[cell] = kFarNone;
  }

  /// The fiber's response to an incoming field in fabric space: [coefficient][rgb].
  void response_of(std::uint32_t sort, const Vec3& wo, float* response) const {
    const Vec3& tangent = sorts_.tangent[sort];
    inputs_->materials[sorts_.material[sort]].sh_coefficients(
        std::asin(std::clamp(wo.dot(tangent), -1.0F, 1.0F)), table_->order, response);
    const Mat3 back = wo_space(tangent, wo).transpose();
    ShRotation(table_->order, back.cast<double>()).rotate<3>(response, response);
  }

  void shade_view(std::uint32_t view, Scratch& own) const {
    gather(view, own);
    single(view, own);
    const auto values = static_cast<std::size_t>(3 * table_->coefficients());
    multiple(view, own, inputs_->transfer->matrices, &table_->multiple[view * values]);
    if (!inputs_->transfer->cones) return;
    multiple(view, own, inputs_->transfer->cones->harmonics, &table_->on_cones[view * values]);
    cones(view);
  }

  void single(std::uint32_t view, const Scratch& own) const {
    const Vec3 wo = grid_.direction(view);
    const float share = 1 / (255 * static_cast<float>(hits_[view].segments.size()));
    std::vector<float> sum(static_cast<std::size_t>(lights_) * 3, 0.0F);
    for (std::size_t slot = 0; slot < own.sorts.size(); ++slot) {
      const std::uint32_t sort = own.sorts[slot];
      const BcsdfTable& bcsdf = inputs_->materials[sorts_.material[sort]];
      const float sin_o = std::clamp(wo.dot(sorts_.tangent[sort]), -1.0F, 1.0F);
      const float cos_o = std::sqrt(1 - sin_o * sin_o);
      const float theta_o = std::asin(sin_o);
      for (std::uint32_t l = 0; l < lights_; l += kFarLanes) {
        const FarLanes visible = lanes_at(own.visible, slot * lights_ + l);
        if (!(visible > 0).any()) continue;
        const FarLanes theta_i = lanes_at(theta_, static_cast<std::size_t>(sort) * lights_ + l);
        const FarLanes sin_i = cosines(l, sorts_.tangent[sort]);
        const FarLanes across = (1 - sin_i.square()).max(1e-12F).sqrt() * std::max(cos_o, 1e-6F);
        const FarLanes cos_turn = ((cosines(l, wo) - sin_i * sin_o) / across).max(-1.0F).min(1.0F);
        const BcsdfTable::RgbLanes light =
            bcsdf.blurred_response(theta_i, cos_turn, theta_o, table_->light_variance);
        for (std::size_t c = 0; c < 3; ++c) {
          Eigen::Map<FarLanes>(&sum[c * lights_ + l]) +=
              share * visible * light.col(static_cast<Eigen::Index>(c));
        }
      }
    }
    store(sum, view, table_->single);
  }

  /// result [coefficient of the light][rgb], by matrices [cell][j0][j1][rgb].
  void multiple(std::uint32_t view, const Scratch& own, const std::vector<float>& matrices,
                float* result) const {
    const auto n = static_cast<std::size_t>(table_->coefficients());
    std::vector<double> sum(3 * n, 0.0);
    for (std::size_t slot = 0; slot < own.cells.size(); ++slot) {
      const float* matrix = matrices.data() + own.cells[slot] * n * n * 3;
      const float* const wanted = &own.wanted[slot * n * 3];
      for (std::size_t j0 = 0; j0 < n; ++j0, matrix += 3 * n) {
        std::array<float, 3> row{};
        for (std::size_t k = 0; k < 3 * n; k += 3) {
          for (std::size_t c = 0; c < 3; ++c) row[c] += matrix[k + c] * wanted[k + c];
        }
        for (std::size_t c = 0; c < 3; ++c) sum[3 * j0 + c] += row[c];
      }
    }
    const double share = 1 / static_cast<double>(hits_[view].segments.size());
    for (std::size_t k = 0; k < sum.size(); ++k) result[k] = static_cast<float>(share * sum[k]);
  }

  void cones(std::uint32_t view) const {
    const Exemplar& exemplar = inputs_->scene->exemplar();
    const std::vector<std::uint32_t>& segments = hits_[view].segments;
    const std::size_t count =
        std::min(segments.size(), static_cast<std::size_t>(settings_->cone_hits));
    RandomStream random(settings_->seed, RandomStage::kFar, view, 1);
    std::vector<float> sum(static_cast<std::size_t>(lights_) * 3, 0.0F);
    for (std::size_t k = 0; k < count; ++k) {
      // One of each stratum of hits, which lie in the order of their rays.
      const double place = (static_cast<double>(k) + random.uniform_double()) /
                           static_cast<double>(count) * static_cast<double>(segments.size());
      const std::uint32_t segment =
          segments[std::min(segments.size() - 1, static_cast<std::size_t>(place))];
      add_cones_of({inputs_->bundle_tangent[segment], exemplar.segment_tangent(segment),
                    grid_.direction(view)},
                   segment, 1 / static_cast<float>(count), sum);
    }
    store(sum, view, table_->cones);
  }

  /// Of one hit, `share` of the view. The response depends on the light's inclination to the bundle
  /// alone, so it is tabulated by that.
  void add_cones_of(const ConeView& at, std::uint32_t segment, float share,
                    std::vector<float>& sum) const {
    constexpr int kInclinations = 91;
    constexpr int kValues = static_cast<int>(std::tuple_size_v<ConeResponse>);
    const BcsdfTable& bcsdf =
        inputs_->materials[inputs_->scene->exemplar().segment_material(segment)];
    using Table = Eigen::Array<float, kInclinations, kValues, Eigen::RowMajor>;
    Table table;
    for (int row = 0; row < kInclinations; ++row) {
      const float theta = kPif * (static_cast<float>(row) / (kInclinations - 1) - 0.5F);
      const ConeResponse response = cone_response(theta, table_->light_variance, at, bcsdf);
      table.row(row) = Eigen::Map<const Eigen::Array<float, 1, kValues>>(response.data());
    }
    const int n = table_->coefficients();
    using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Matrix> projected(projected_.data(), lights_, n);
    const std::size_t cell = inputs_->transfer->cell_of_segment[segment];
    constexpr int kOfWidth = 3 * ConeTransfer::kAzimuths;
    Matrix arriving(lights_, kValues);  // [light][width][azimuth][rgb]
    for (int width = 0; width < ConeTransfer::kWidths; ++width) {
      const Eigen::Map<const Matrix> moments(
          inputs_->transfer->cones->moments.data() +
              (cell * ConeTransfer::kWidths + static_cast<std::size_t>(width)) *
                  static_cast<std::size_t>(n * kOfWidth),
          n, kOfWidth);
      arriving.middleCols(width * kOfWidth, kOfWidth).noalias() = projected * moments;
    }
    for (std::uint32_t l = 0; l < lights_; ++l) {
      const float theta = std::asin(std::clamp(light_[l].dot(at.bundle_tangent), -1.0F, 1.0F));
      const float place = (theta / kPif + 0.5F) * (kInclinations - 1);
      const int row = std::clamp(static_cast<int>(place), 0, kInclinations - 2);
      const float part = place - static_cast<float>(row);
      const Eigen::Array<float, 1, kValues> scattered =
          ((1 - part) * table.row(row) + part * table.row(row + 1)) * arriving.row(l).array();
      for (int c = 0; c < 3; ++c) {
        float all = 0;
        for (int k = c; k < kValues; k += 3) all += scattered[k];
        sum[static_cast<std::size_t>(c) * lights_ + l] += share * all;
      }
    }
  }

  /// planes: [rgb][light].
  void store(const std::vector<float>& planes, std::uint32_t view, std::vector<Half>& table) const {
    constexpr float kLargest = 65504;
    for (std::size_t l = 0; l < lights_; ++l) {
      for (std::size_t c = 0; c < 3; ++c) {
        table[(view * lights_ + l) * 3 + c] =
            half_from_float(std::clamp(planes[c * lights_ + l], -kLargest, kLargest));
      }
    }
  }

  const FarInputs* inputs_;
  const FarSettings* settings_;
  FarTable* table_;
  DirectionGrid grid_;
  std::uint32_t lights_;
  std::vector<Vec3> light_;                       // [light]
  std::array<std::vector<float>, 3> light_axes_;  // the same, [axis][light]
  std::vector<float> projected_;                  // [light][coefficient] c_light
  std::vector<ViewHits> hits_;                    // [view]
  Sorts sorts_;
  std::vector<std::uint32_t> map_of_segment_;  // kFarNone where it is not seen
  std::vector<std::uint8_t> visible_;
  std::vector<float> theta_;  // [sort][light]
  mutable tbb::enumerable_thread_specific<Scratch> scratch_;
};

}  // namespace

FarTable bake_far(const FarInputs& inputs, const FarSettings& settings,
                  const std::function<void(double)>& progress) {
  FarTable table;
  table.resolution = settings.resolution;
  table.both_sides = inputs.transfer->both_sides;
  table.order = inputs.transfer->order;
  table.repeat_mm = static_cast<float>(inputs.repeat_mm);
  const float blur = kLightBlur * table.grid().cell_edge();
  table.light_variance = blur * blur;
  const std::size_t views = table.view_count();
  const std::size_t rgb = 3 * views;
  table.coverage.resize(views);
  table.height.resize(views);
  table.single.resize(rgb * table.light_count());
  table.multiple.resize(rgb * static_cast<std::size_t>(table.coefficients()));
  if (inputs.transfer->cones) {
    table.on_cones.resize(table.multiple.size());
    table.cones.resize(table.single.size());
  }
  FarBaker baker(inputs, settings, table);
  baker.trace([&](double share) { progress(0.4 * share); });
  baker.shade([&](double share) { progress(0.4 + 0.6 * share); });
  return table;
}

std::uint64_t far_bake_bytes(std::uint64_t segments, bool both_sides, const FarSettings& settings) {
  const DirectionGrid grid(settings.resolution);
  const std::uint64_t lights = both_sides ? grid.count() : grid.per_side();
  return segments * lights +
         grid.count() * (6 * lights + 4 * static_cast<std::uint64_t>(settings.rays));
}

}  // namespace heddle
