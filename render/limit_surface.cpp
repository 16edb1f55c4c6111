#include "render/limit_surface.h"

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/bfr/tessellation.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <array>
#include <memory>
#include <unordered_map>
#include <utility>

#include "formats/input_error.h"

namespace heddle {
namespace {

namespace Bfr = OpenSubdiv::Bfr;
namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

std::uint64_t pair_key(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint64_t>(a) << 32U | b;
}

Sdc::SchemeType scheme_of(const ControlMesh& mesh) {
  const bool all_triangles = std::all_of(mesh.face_corners.begin(), mesh.face_corners.end(),
                                         [](std::uint32_t corners) { return corners == 3; });
  return all_triangles ? Sdc::SCHEME_LOOP : Sdc::SCHEME_CATMARK;
}

bool is_shown(const ControlMesh& mesh, std::size_t face) {
  return mesh.is_shown.empty() || mesh.is_shown[face] != 0;
}

std::unique_ptr<Far::TopologyRefiner> refiner_of(const ControlMesh& mesh, const std::string& name) {
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(mesh.sharp_corners
                                          ? Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER
                                          : Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  options.SetFVarLinearInterpolation(mesh.sharp_corners ? Sdc::Options::FVAR_LINEAR_CORNERS_PLUS1
                                                        : Sdc::Options::FVAR_LINEAR_NONE);
  std::vector<int> corners(mesh.face_corners.begin(), mesh.face_corners.end());
  std::vector<int> values(mesh.values.begin(), mesh.values.end());
  std::vector<int> vertices;
  for (const std::uint32_t value : mesh.values)
    vertices.push_back(static_cast<int>(mesh.value_owner[value]));
  std::vector<int> edges;
  std::vector<float> edge_sharpness;
  for (const ControlMesh::SharpEdge& edge : mesh.sharp_edges) {
    edges.push_back(static_cast<int>(edge.a));
    edges.push_back(static_cast<int>(edge.b));
    edge_sharpness.push_back(edge.sharpness);
  }
  std::vector<int> points;
  std::vector<float> point_sharpness;
  for (const ControlMesh::SharpVertex& point : mesh.sharp_vertices) {
    points.push_back(static_cast<int>(point.vertex));
    point_sharpness.push_back(point.sharpness);
  }
  Far::TopologyDescriptor::FVarChannel fabric;
  fabric.numValues = static_cast<int>(mesh.fabric.size());
  fabric.valueIndices = values.data();
  Far::TopologyDescriptor topology;
  topology.numVertices = static_cast<int>(mesh.positions.size());
  topology.numFaces = static_cast<int>(corners.size());
  topology.numVertsPerFace = corners.data();
  topology.vertIndicesPerFace = vertices.data();
  topology.numCreases = static_cast<int>(edge_sharpness.size());
  topology.creaseVertexIndexPairs = edges.data();
  topology.creaseWeights = edge_sharpness.data();
  topology.numCorners = static_cast<int>(points.size());
  topology.cornerVertexIndices = points.data();
  topology.cornerWeights = point_sharpness.data();
  topology.numFVarChannels = 1;
  topology.fvarChannels = &fabric;
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(topology, Factory::Options(scheme_of(mesh), options)));
  if (!refiner) {
    throw FileError(name + ": a mesh that cannot be subdivided: a face or a vertex has more than " +
                    std::to_string(Far::VALENCE_LIMIT) + " edges");
  }
  return refiner;
}

/// The pieces of each edge, by its vertices, the lower one first.
std::unordered_map<std::uint64_t, int> edge_pieces(const ControlMesh& mesh,
                                                   const EdgePieces& pieces) {
  std::unordered_map<std::uint64_t, int> result;
  std::size_t first = 0;
  for (std::size_t face = 0; face < mesh.face_corners.size(); ++face) {
    const std::uint32_t corners = mesh.face_corners[face];
    for (std::uint32_t k = 0; k < corners && is_shown(mesh, face); ++k) {
      const auto [low, high] =
          std::minmax({mesh.value_owner[mesh.values[first + k]],
                       mesh.value_owner[mesh.values[first + (k + 1) % corners]]});
      const auto [place, is_new] = result.try_emplace(pair_key(low, high), 0);
      if (is_new) place->second = pieces(mesh.positions[low], mesh.positions[high]);
    }
    first += corners;
  }
  return result;
}

/// Cuts the faces one after the other.
class Cutter {
 public:
  Cutter(const ControlMesh& mesh, const EdgePieces& pieces)
      : mesh_(mesh), scheme_(scheme_of(mesh)), pieces_(edge_pieces(mesh, pieces)) {}

  template <class Visit>
  void for_each_face(Visit&& visit) {
    std::size_t first = 0;
    for (std::size_t face = 0; face < mesh_.face_corners.size(); ++face) {
      const std::uint32_t corners = mesh_.face_corners[face];
      if (is_shown(mesh_, face)) {
        values_.assign(mesh_.values.begin() + static_cast<std::ptrdiff_t>(first),
                       mesh_.values.begin() + static_cast<std::ptrdiff_t>(first + corners));
        visit(face, tessellation());
      }
      first += corners;
    }
  }

  ClothMesh cut(const std::string& name) {
    evaluate_faces(name);
    finish();
    return std::move(result_);
  }

  /// Adds to vertices and values of `mesh` by how much the surface misses those of `target`.
  void add_misses(const ControlMesh& target, ControlMesh& mesh, const std::string& name) {
    evaluate_faces(name);
    for (std::size_t value = 0; value < mesh.fabric.size(); ++value) {
      if (points_[mesh.value_owner[value]].is_placed)
        mesh.fabric[value] += target.fabric[value] - result_.fabric[value];
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      if (points_[v].is_placed) mesh.positions[v] += target.positions[v] - points_[v].position;
    }
  }

 private:
  void evaluate_faces(const std::string& name) {
    const std::unique_ptr<Far::TopologyRefiner> refiner = refiner_of(mesh_, name);
    const Bfr::RefinerSurfaceFactory<> factory(*refiner);
    points_.assign(mesh_.positions.size(), {});
    result_.fabric.assign(mesh_.fabric.size(), Eigen::Vector2d::Zero());
    point_of_ = mesh_.value_owner;
    for_each_face([&](std::size_t face, const Bfr::Tessellation& cuts) {
      if (!factory.InitSurfaces(static_cast<int>(face), &surface_, &fabric_, nullptr, 1))
        throw FileError(name + ": OpenSubdiv finds no surface of face " + std::to_string(face + 1));
      evaluate(cuts);
      add_face(cuts);
    });
  }

  struct Point {
    Vec3d position = Vec3d::Zero();
    Vec3d normal = Vec3d::Zero();  // sum over faces
    bool is_placed = false;
  };

  std::uint32_t vertex(std::size_t corner) const {
    return mesh_.value_owner[values_[corner % values_.size()]];
  }
  int pieces_of(std::size_t corner) const {
    const auto [low, high] = std::minmax({vertex(corner), vertex(corner + 1)});
    return pieces_.at(pair_key(low, high));
  }

  Bfr::Tessellation tessellation() const {
    std::vector<int> rates;
    for (std::size_t k = 0; k < values_.size(); ++k) rates.push_back(pieces_of(k));
    return Bfr::Tessellation(Bfr::Parameterization(scheme_, static_cast<int>(rates.size())),
                             static_cast<int>(rates.size()), rates.data());
  }

  /// Limit points, normals and fabric coordinates at all places of the face.
  void evaluate(const Bfr::Tessellation& cuts) {
    const auto count = static_cast<std::size_t>(cuts.GetNumCoords());
    uv_.resize(2 * count);
    cuts.GetCoords(uv_.data());
    patch_.resize(3 * static_cast<std::size_t>(surface_.GetNumPatchPoints()));
    surface_.PreparePatchPoints(mesh_.positions.data()->data(), 3, patch_.data(), 3);
    fabric_patch_.resize(2 * static_cast<std::size_t>(fabric_.GetNumPatchPoints()));
    fabric_.PreparePatchPoints(mesh_.fabric.data()->data(), 2, fabric_patch_.data(), 2);
    here_.resize(count);
    fabric_here_.resize(count);
    for (std::size_t k = 0; k < count; ++k) {
      Vec3d du;
      Vec3d dv;
      surface_.Evaluate(&uv_[2 * k], patch_.data(), 3, here_[k].position.data(), du.data(),
                        dv.data());
      const Vec3d normal = du.cross(dv);
      // At a corner that is rounded off both derivatives run along the rim.
      const bool is_flat_corner = normal.norm() <= 1e-7 * du.norm() * dv.norm();
      here_[k].normal = is_flat_corner ? Vec3d(0, 0, 0) : Vec3d(normal.normalized());
      fabric_.Evaluate(&uv_[2 * k], fabric_patch_.data(), 2, fabric_here_[k].data());
    }
  }

  void place(std::uint32_t out, std::size_t here) {
    Point& point = points_[point_of_[out]];
    if (!point.is_placed) point.position = here_[here].position;
    point.is_placed = true;
    point.normal += here_[here].normal;
    result_.fabric[out] = fabric_here_[here];
  }

  std::uint32_t new_vertex(std::uint32_t point) {
    point_of_.push_back(point);
    result_.fabric.emplace_back(0, 0);
    return static_cast<std::uint32_t>(point_of_.size() - 1);
  }
  std::uint32_t new_point() {
    points_.emplace_back();
    return static_cast<std::uint32_t>(points_.size() - 1);
  }

  /// First of the vertices inside an edge, in the sense from its lower vertex to the higher one.
  std::uint32_t edge_vertices(std::uint32_t low_value, std::uint32_t high_value, int count) {
    const auto [place, is_new] = edge_vertex_.try_emplace(pair_key(low_value, high_value), 0);
    if (!is_new) return place->second;
    const std::uint64_t edge =
        pair_key(mesh_.value_owner[low_value], mesh_.value_owner[high_value]);
    const auto [points, are_new] = edge_point_.try_emplace(edge, 0);
    for (int k = 0; k < count; ++k) {
      const std::uint32_t point =
          are_new ? new_point() : points->second + static_cast<std::uint32_t>(k);
      if (are_new && k == 0) points->second = point;
      const std::uint32_t vertex = new_vertex(point);
      if (k == 0) place->second = vertex;
    }
    return place->second;
  }

  void add_face(const Bfr::Tessellation& cuts) {
    std::vector<int> out;  // [place of the face]
    for (std::size_t corner = 0; corner < values_.size(); ++corner) {
      const std::uint32_t from = values_[corner];
      const std::uint32_t to = values_[(corner + 1) % values_.size()];
      out.push_back(static_cast<int>(from));
      const int inside = pieces_of(corner) - 1;
      const bool is_forward = vertex(corner) < vertex(corner + 1);
      const std::uint32_t first =
          is_forward ? edge_vertices(from, to, inside) : edge_vertices(to, from, inside);
      for (int k = 0; k < inside; ++k)
        out.push_back(static_cast<int>(first) + (is_forward ? k : inside - 1 - k));
    }
    for (int k = 0; k < cuts.GetNumInteriorCoords(); ++k)
      out.push_back(static_cast<int>(new_vertex(new_point())));
    for (std::size_t k = 0; k < out.size(); ++k) place(static_cast<std::uint32_t>(out[k]), k);
    facets_.resize(3 * static_cast<std::size_t>(cuts.GetNumFacets()));
    cuts.GetFacets(facets_.data());
    for (std::size_t k = 0; k < facets_.size(); k += 3) {
      std::array<std::uint32_t, 3> triangle;
      for (std::size_t c = 0; c < 3; ++c)
        triangle[c] = static_cast<std::uint32_t>(out[static_cast<std::size_t>(facets_[k + c])]);
      result_.triangles.push_back(triangle);
    }
  }

  /// Normals of length 1, and only what the triangles use.
  void finish() {
    const auto position = [&](std::uint32_t v) { return points_[point_of_[v]].position; };
    std::vector<Vec3d> of_triangles(points_.size(), Vec3d::Zero());
    for (const auto& [a, b, c] : result_.triangles) {
      const Vec3d area = (position(b) - position(a)).cross(position(c) - position(a));
      for (const std::uint32_t v : {a, b, c}) of_triangles[point_of_[v]] += area;
    }
    for (std::size_t v = 0; v < point_of_.size(); ++v) {
      const Point& point = points_[point_of_[v]];
      // Opposite sides of a sharp edge may cancel; a point without derivatives has no sum.
      const Vec3d& sum = point.normal.norm() > 1e-6 ? point.normal : of_triangles[point_of_[v]];
      const Vec3d normal = sum.norm() > 0 ? Vec3d(sum.normalized()) : Vec3d(0, 0, 1);
      result_.positions.push_back(point.position);
      result_.normals.push_back(mesh_.normals_against_winding ? Vec3d(-normal) : normal);
    }
    result_ = without_unused_vertices(std::move(result_));
  }

  const ControlMesh& mesh_;
  Sdc::SchemeType scheme_;
  std::unordered_map<std::uint64_t, int> pieces_;
  std::vector<std::uint32_t> values_;  // [corner] of the face at hand
  Bfr::Surface<double> surface_;
  Bfr::Surface<double> fabric_;
  std::vector<double> uv_, patch_, fabric_patch_;
  std::vector<Point> here_;
  std::vector<Eigen::Vector2d> fabric_here_;
  std::vector<int> facets_;

  std::vector<Point> points_;            // one for each place in space
  std::vector<std::uint32_t> point_of_;  // [vertex of the result]; the first ones are the values
  std::unordered_map<std::uint64_t, std::uint32_t> edge_point_;   // by vertices
  std::unordered_map<std::uint64_t, std::uint32_t> edge_vertex_;  // by values
  ClothMesh result_;
};

}  // namespace

ControlMesh drawn_to_vertices(ControlMesh mesh, int rounds, const std::string& name) {
  const std::vector<std::uint8_t> is_shown = std::exchange(mesh.is_shown, {});
  const ControlMesh target = mesh;
  for (int round = 0; round < rounds; ++round) {
    const ControlMesh now = mesh;
    Cutter(now, [](const Vec3d&, const Vec3d&) { return 1; }).add_misses(target, mesh, name);
  }
  mesh.is_shown = is_shown;
  return mesh;
}

std::size_t limit_triangles(const ControlMesh& mesh, const EdgePieces& pieces) {
  std::size_t count = 0;
  Cutter(mesh, pieces).for_each_face([&](std::size_t, const Bfr::Tessellation& cuts) {
    count += static_cast<std::size_t>(cuts.GetNumFacets());
  });
  return count;
}

ClothMesh limit_surface(const ControlMesh& mesh, const EdgePieces& pieces,
                        const std::string& name) {
  return Cutter(mesh, pieces).cut(name);
}

}  // namespace heddle
