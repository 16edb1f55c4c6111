// What subdividing a mesh costs, and what it does to shells. Not a test: it prints a line per
// level. With -o it writes the last level as an OBJ file, an explicit mesh to compare pictures
// with:
//
//   heddle_subdivided_mesh MESH [--unit-mm U] [--uv-size-mm S] [--levels 0 1 2] [--thickness-mm T]
//     [--near] [-o FINE.obj]
//
// seconds: of reading and subdividing, of the shell, of the ray-tracing structure of its faces.
// RSS: peak of the process so far, so levels should rise.

#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "render/mesh_file.h"

namespace heddle {
namespace {

struct Setup {
  MeshFile mesh;
  double uv_size_mm = 300;
  std::vector<int> levels = {0, 1, 2, 3};
  double thickness_mm = 0.4;
  std::filesystem::path output;
};

/// Positions and UVs in the units that the input had.
void write_obj(const ClothMesh& mesh, const Setup& setup) {
  std::ofstream file(setup.output);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3d p = mesh.positions[v] / setup.mesh.mm_per_unit;
    const Vec3d& n = mesh.normals[v];
    const Eigen::Vector2d uv = mesh.fabric[v] / setup.uv_size_mm;
    file << fmt::format("v {:.9g} {:.9g} {:.9g}\nvt {:.9g} {:.9g}\nvn {:.9g} {:.9g} {:.9g}\n",
                        p.x(), p.y(), p.z(), uv.x(), uv.y(), n.x(), n.y(), n.z());
  }
  for (const auto& [a, b, c] : mesh.triangles)
    file << fmt::format("f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}\n", a + 1, b + 1, c + 1);
}

void measure(Setup& setup) {
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::time_point from) {
    return std::chrono::duration<double>(Clock::now() - from).count();
  };
  fmt::print(
      "level triangles  tetrahedra  flipped  degenerate  read s  shell s  trace s  RSS MB\n");
  for (const int level : setup.levels) {
    setup.mesh.subdivide = level;
    const Clock::time_point start = Clock::now();
    const ClothMesh mesh = read_cloth_mesh(setup.mesh, setup.uv_size_mm, {}, {});
    const double read = seconds(start);
    const Clock::time_point read_at = Clock::now();
    const Shell shell(mesh, -0.5 * setup.thickness_mm, 0.5 * setup.thickness_mm,
                      {.thin_tight_folds = level > 0});
    const double shelled = seconds(read_at);
    const Clock::time_point shelled_at = Clock::now();
    const TriangleScene scene({shell.boundary_mesh()});
    const double traced = seconds(shelled_at);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    fmt::print("{:5} {:9}  {:10}  {:7}  {:10}  {:6.2f}  {:7.2f}  {:7.2f}  {:6.0f}\n", level,
               mesh.triangles.size(), shell.tets().size(), shell.flipped_count(),
               shell.degenerate_count(), read, shelled, traced,
               static_cast<double>(usage.ru_maxrss) / 1000);
    if (!setup.output.empty() && level == setup.levels.back()) write_obj(mesh, setup);
  }
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  heddle::Setup setup;
  setup.mesh.mm_per_unit = 1000;
  CLI::App app{"What subdividing a mesh costs"};
  app.add_option("mesh", setup.mesh.path, "OBJ file with UVs")->required();
  app.add_option("--unit-mm", setup.mesh.mm_per_unit, "millimetres per unit");
  app.add_option("--uv-size-mm", setup.uv_size_mm, "millimetres per unit of UV");
  app.add_option("--levels", setup.levels, "levels of subdivision");
  app.add_option("--thickness-mm", setup.thickness_mm, "thickness of the shell");
  app.add_flag("--near", setup.mesh.near_vertices, "draw the surface to the vertices");
  app.add_option("-o", setup.output, "OBJ file of the last level");
  CLI11_PARSE(app, argc, argv);
  heddle::measure(setup);
  return 0;
}
