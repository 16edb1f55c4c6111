#include "render/far_form.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

// Below this share of its largest value a Gaussian's tail is left out of a mean.
constexpr float kTail = 1e-3F;

/// Of the light of a Gaussian to its axis.
float mean_cosine(float sharpness) {
  if (sharpness < 0.01F) return sharpness / 3;
  return 1 / std::tanh(sharpness) - 1 / sharpness;
}

}  // namespace

float FarLadder::sharpness_of(std::size_t width) const {
  if (width + 1 == kWidths) return 0;
  const float edge = table_->grid().cell_edge();
  return 1 / std::ldexp(edge * edge, static_cast<int>(width));
}

const FarLadder::Means& FarLadder::at(std::size_t width) const {
  Late& late = means_[width];
  std::call_once(late.once, [&] { late.means = mean_over(width); });
  return late.means;
}

FarLadder::Means FarLadder::mean_over(std::size_t width) const {
  const DirectionGrid from = table_->grid();
  // As coarse as the width allows; the last one is light from everywhere.
  const double finest = table_->resolution * std::pow(2.0, -0.25 * static_cast<double>(width));
  Means means;
  means.grid = DirectionGrid(std::max(16, static_cast<int>(std::lround(finest))));
  const float sharpness = sharpness_of(width);
  struct Tap {
    std::uint32_t light;
    float weight;
  };
  std::vector<Vec3> directions;
  for (std::uint32_t l = 0; l < from.count(); ++l) directions.push_back(from.direction(l));
  std::vector<Tap> taps;
  std::vector<std::size_t> first = {0};  // [axis]
  for (std::uint32_t axis = 0; axis < means.grid.count(); ++axis) {
    const Vec3 middle = means.grid.direction(axis);
    float all = 0;
    for (std::uint32_t l = 0; l < from.count(); ++l) {
      const float weight = std::exp(sharpness * (directions[l].dot(middle) - 1));
      if (weight < kTail) continue;
      all += weight;
      if (l < table_->light_count()) taps.push_back({l, weight});
    }
    for (std::size_t k = first.back(); k < taps.size(); ++k) taps[k].weight /= all;
    first.push_back(taps.size());
  }
  const std::size_t lights = table_->light_count();
  const std::size_t axes = means.grid.count();
  means.values.resize(table_->view_count() * axes * 3);
  tbb::parallel_for(
      std::size_t{0}, static_cast<std::size_t>(table_->view_count()), [&](std::size_t view) {
        std::vector<Eigen::Array4f> row(lights);
        for (std::size_t l = 0; l < lights; ++l) {
          const Half* const rgb = &(*values_)[(view * lights + l) * 3];
          row[l] = {float_from_half(rgb[0]), float_from_half(rgb[1]), float_from_half(rgb[2]), 0};
        }
        for (std::size_t axis = 0; axis < axes; ++axis) {
          Eigen::Array4f sum = Eigen::Array4f::Zero();
          for (std::size_t k = first[axis]; k < first[axis + 1]; ++k)
            sum += taps[k].weight * row[taps[k].light];
          for (int c = 0; c < 3; ++c) {
            means.values[(view * axes + axis) * 3 + static_cast<std::size_t>(c)] =
                half_from_float(sum[c]);
          }
        }
      });
  return means;
}

namespace {

/// Interpolated between views and lights; values: [view][lights][rgb].
Rgb between(const std::vector<Half>& values, std::size_t lights, const DirectionGrid::Place& view,
            const DirectionGrid::Place& light) {
  Rgb sum = Rgb::Zero();
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t l = 0; l < 4; ++l) {
      const Half* const rgb = &values[(view.cells[v] * lights + light.cells[l]) * 3];
      sum += view.shares[v] * light.shares[l] *
             Rgb(float_from_half(rgb[0]), float_from_half(rgb[1]), float_from_half(rgb[2]));
    }
  }
  return sum;
}

}  // namespace

Rgb FarLadder::directional(const DirectionGrid::Place& view, const Vec3& axis) const {
  if (!table_->both_sides && !(axis.z() > 0)) return Rgb::Zero();
  return between(*values_, table_->light_count(), view, table_->grid().place(axis));
}

Rgb FarLadder::wide(std::size_t width, const DirectionGrid::Place& view, const Vec3& axis) const {
  const Means& means = at(width);
  return between(means.values, means.grid.count(), view, means.grid.place(axis));
}

Rgb FarLadder::radiance(const DirectionGrid::Place& view, const Vec3& axis,
                        std::optional<float> sharpness) const {
  if (!sharpness) return directional(view, axis);
  // What the table's own blur and interpolation do is done.
  const float edge = table_->grid().cell_edge();
  const float variance = 1 / std::max(*sharpness, 1e-6F) - table_->light_variance - edge * edge / 6;
  if (!(variance > 0)) return directional(view, axis);
  const float cosine = mean_cosine(1 / variance);
  float narrow = 1;  // mean cosine to the axis of the narrower of two, and of the wider one
  for (std::size_t width = 0; width < kWidths; ++width) {
    const float wider = mean_cosine(sharpness_of(width));
    if (cosine >= wider) {
      const float share = (cosine - wider) / (narrow - wider);
      const Rgb narrower = width == 0 ? directional(view, axis) : wide(width - 1, view, axis);
      return share * narrower + (1 - share) * wide(width, view, axis);
    }
    narrow = wider;
  }
  return wide(kWidths - 1, view, axis);
}

FarForm::FarForm(const FarTable& table) : table_(&table), single_(table, table.single) {
  if (table.has_cones()) cones_.emplace(table, table.cones);
}

FarForm::View FarForm::view(const Vec3& wo) const {
  View view;
  view.place = table_->grid().place(wo);
  const auto values = static_cast<std::size_t>(3 * table_->coefficients());
  const auto row_of = [&](const std::vector<float>& rows, float* result) {
    std::fill_n(result, values, 0.0F);
    for (std::size_t i = 0; i < 4; ++i) {
      const float* const row = &rows[view.place.cells[i] * values];
      for (std::size_t k = 0; k < values; ++k) result[k] += view.place.shares[i] * row[k];
    }
  };
  row_of(table_->multiple, view.multiple.data());
  if (cones_) row_of(table_->on_cones, view.on_cones.data());
  return view;
}

Rgb FarForm::single(const View& view, const Vec3& axis, std::optional<float> sharpness) const {
  return single_.radiance(view.place, axis, sharpness);
}

Rgb FarForm::multiple(const View& view, const Vec3& axis, std::optional<float> sharpness,
                      const float* c_light) const {
  using Projection = MultipleScattering::LightShape::Projection;
  const float share =
      cones_ ? MultipleScattering::LightShape::on_cones_of(sharpness, Projection::kDual).share : 0;
  Rgb sum = Rgb::Zero();
  for (int j = 0; j < table_->coefficients(); ++j) {
    for (int c = 0; c < 3; ++c) {
      const auto at = static_cast<std::size_t>(3 * j + c);
      float row = view.multiple[at];
      if (share > 0) row -= share * view.on_cones[at];
      sum[c] += row * c_light[j];
    }
  }
  if (share > 0) sum += share * cones_->radiance(view.place, axis, sharpness);
  return sum;
}

}  // namespace heddle
