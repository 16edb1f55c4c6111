#include "precompute/segment_cells.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <set>
#include <tuple>

namespace heddle {
namespace {

// Position and exposed side, both in mm.
using Feature = Eigen::Matrix<double, 6, 1>;

// Exposed sides at right angles count as much as segments this share of a cube's edge apart, times
// the square root of 2.
constexpr double kSideScale = 0.5;

// Added to each segment's openness: hidden segments are cut last, but are cut.
constexpr double kLeastWeight = 1e-3;

struct Node {
  std::uint32_t first, last;  // range of the permuted segments
  double spread;
  Feature across;  // direction of the largest spread
  Feature mean;
};

/// Cubes of about this edge that hold the midpoint of a segment.
std::size_t count_occupied_cubes(const Exemplar& exemplar, float edge_mm) {
  const auto cubes = [edge_mm](float length) {
    return std::max(1.0F, std::round(length / edge_mm));
  };
  const Vec3 size(exemplar.width_mm, exemplar.height_mm, exemplar.z_max - exemplar.z_min);
  const Vec3 scale(cubes(size.x()) / size.x(), cubes(size.y()) / size.y(),
                   cubes(size.z()) / size.z());
  std::set<std::array<int, 3>> occupied;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const Vec3 place =
        (exemplar.segment_midpoint(s) - Vec3(0, 0, exemplar.z_min)).cwiseProduct(scale);
    const Eigen::Vector3i cube = place.array().floor().cast<int>();
    occupied.insert({cube.x(), cube.y(), cube.z()});
  }
  return occupied.size();
}

}  // namespace

SegmentCells make_segment_cells(const Exemplar& exemplar, const SegmentOrigins& origins,
                                float edge_mm) {
  const std::size_t count = count_occupied_cubes(exemplar, edge_mm);
  const auto segments = static_cast<std::uint32_t>(exemplar.segment_count());
  std::vector<Feature> features(segments);
  for (std::uint32_t s = 0; s < segments; ++s) {
    const Vec3d middle = exemplar.segment_midpoint(s).cast<double>();
    const Vec3d side = (origins.position[s].cast<double>() - middle) /
                       exemplar.radius_mm[exemplar.segment_fiber[s]];
    features[s].head<3>() = middle;
    features[s].tail<3>() = kSideScale * static_cast<double>(edge_mm) * side;
  }
  std::vector<std::uint32_t> order(segments);
  std::iota(order.begin(), order.end(), 0U);

  const auto weight_of = [&](std::uint32_t s) {
    return static_cast<double>(origins.openness[s]) + kLeastWeight;
  };
  const auto make_node = [&](std::uint32_t first, std::uint32_t last) {
    Node node{first, last, 0, Feature::Zero(), Feature::Zero()};
    double total = 0;
    for (std::uint32_t k = first; k < last; ++k) {
      const double weight = weight_of(order[k]);
      total += weight;
      node.mean += weight * features[order[k]];
    }
    node.mean /= total;
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    for (std::uint32_t k = first; k < last; ++k) {
      const double weight = weight_of(order[k]);
      const Feature d = features[order[k]] - node.mean;
      covariance += weight * d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(covariance);
    node.across = solver.eigenvectors().col(5);
    node.spread = last - first > 1 ? covariance.trace() : -1;
    return node;
  };
  // Largest spread first; among equals the earlier range.
  const auto before = [](const Node& a, const Node& b) {
    return std::tie(a.spread, b.first) < std::tie(b.spread, a.first);
  };
  std::priority_queue<Node, std::vector<Node>, decltype(before)> nodes(before);
  nodes.push(make_node(0, segments));
  while (nodes.size() < count) {
    const Node node = nodes.top();
    if (node.spread <= 0) break;  // nothing left to cut
    nodes.pop();
    const auto begin = order.begin() + node.first;
    const auto end = order.begin() + node.last;
    auto middle = std::stable_partition(
        begin, end, [&](std::uint32_t s) { return node.across.dot(features[s] - node.mean) < 0; });
    // rounding left one side empty
    if (middle == begin || middle == end) middle = begin + (end - begin) / 2;
    const auto cut = static_cast<std::uint32_t>(middle - order.begin());
    nodes.push(make_node(node.first, cut));
    nodes.push(make_node(cut, node.last));
  }

  // Numbered along the tree, so that neighbours have near numbers.
  std::vector<Node> leaves;
  for (; !nodes.empty(); nodes.pop()) leaves.push_back(nodes.top());
  std::sort(leaves.begin(), leaves.end(),
            [](const Node& a, const Node& b) { return a.first < b.first; });
  SegmentCells cells;
  cells.cell_of_segment.resize(segments);
  for (const Node& leaf : leaves) {
    for (std::uint32_t k = leaf.first; k < leaf.last; ++k)
      cells.cell_of_segment[order[k]] = cells.count;
    ++cells.count;
  }
  return cells;
}

}  // namespace heddle
