// The interactive microcylinder (render/surface/interactive_microcylinder.h) against its ray-traced
// reference on a drape.
//
//   heddle_interactive_microcylinder CLOTH.obj [--fabric NAME] [--environment MAP.hdr] [--lights
//     10] [--out PREFIX]
//
// Prints what the precomputation costs and weighs, the error at visible vertices of the method as
// printed and of ours, the directions per light with which ray tracing has the same error, and
// frames per second at 640 x 480 of both: all vertices that face the camera are shaded and
// interpolated over their triangles. The mesh is in metres and needs UVs and normals. Then figure 8
// of Iwasaki et al. 2014: the shadow of a handle and a spout on a plane under an anisotropic light,
// by the line through the nearest border, by an isotropic Gaussian of the same area, and ray
// traced. --out writes pictures of both.

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "fibers/math/sampling.h"
#include "formats/image_file.h"
#include "formats/input_error.h"
#include "formats/obj_mesh.h"
#include "render/camera.h"
#include "render/environment_sgs.h"
#include "render/surface/interactive_microcylinder.h"
#include "render/surface/surface_presets.h"
#include "render/triangle_scene.h"

namespace heddle {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Options {
  std::string mesh;
  std::string fabric = "linen-plain";
  std::string environment;
  std::string out;
  int lights = 10;
  int strata = 40;
};

struct Cloth {
  TriangleMesh mesh;         // mm
  std::vector<Mat3> frames;  // [vertex] thread 1 along u, thread 2, normal
};

Cloth read_cloth(const std::string& path) {
  const ObjMesh obj = read_obj(path);
  if (obj.uvs.empty() || obj.normals.empty())
    throw FileError(path + ": the mesh needs UVs and normals");
  Cloth cloth;
  for (const auto& p : obj.positions)
    cloth.mesh.positions.push_back(1000.0F * Vec3(p[0], p[1], p[2]));
  cloth.mesh.triangles = obj.triangles;
  std::vector<Vec3> along_u(obj.positions.size(), Vec3::Zero());
  for (const auto& t : obj.triangles) {
    const Vec3 a = cloth.mesh.positions[t[1]] - cloth.mesh.positions[t[0]];
    const Vec3 b = cloth.mesh.positions[t[2]] - cloth.mesh.positions[t[0]];
    const float du_a = obj.uvs[t[1]][0] - obj.uvs[t[0]][0];
    const float dv_a = obj.uvs[t[1]][1] - obj.uvs[t[0]][1];
    const float du_b = obj.uvs[t[2]][0] - obj.uvs[t[0]][0];
    const float dv_b = obj.uvs[t[2]][1] - obj.uvs[t[0]][1];
    const float determinant = du_a * dv_b - du_b * dv_a;
    const Vec3 u = (determinant > 0 ? 1.0F : -1.0F) * (dv_b * a - dv_a * b);
    for (const std::uint32_t v : t) along_u[v] += u;
  }
  for (std::size_t v = 0; v < obj.positions.size(); ++v) {
    const Vec3 normal(obj.normals[v][0], obj.normals[v][1], obj.normals[v][2]);
    Mat3 frame;
    frame.col(0) = (along_u[v] - normal * normal.dot(along_u[v])).normalized();
    frame.col(2) = normal;
    frame.col(1) = normal.cross(Vec3(frame.col(0)));
    cloth.frames.push_back(frame);
  }
  return cloth;
}

// Projected vertices and a depth buffer: colours of vertices interpolated over front faces.
class Rasterizer {
 public:
  static constexpr int kWidth = 640;
  static constexpr int kHeight = 480;

  explicit Rasterizer(const Cloth& cloth, const Vec3d& eye, const Vec3d& target)
      : cloth_(cloth), eye_(eye) {
    const Vec3d forward = (target - eye).normalized();
    const Vec3d right = forward.cross(Vec3d(0, 0, 1)).normalized();
    const Vec3d up = right.cross(forward);
    const double focal = kHeight / (2 * std::tan(radians(17)));
    for (const Vec3& p : cloth.mesh.positions) {
      const Vec3d d = p.cast<double>() - eye;
      const double depth = d.dot(forward);
      projected_.emplace_back(kWidth / 2.0 + focal * d.dot(right) / depth,
                              kHeight / 2.0 - focal * d.dot(up) / depth, depth);
    }
  }

  Vec3d to_eye(std::uint32_t vertex) const {
    return (eye_ - cloth_.mesh.positions[vertex].cast<double>()).normalized();
  }

  std::vector<Rgb> draw(const std::vector<Rgbd>& colours) const {
    std::vector<Rgb> pixels(kWidth * kHeight, Rgb::Zero());
    std::vector<double> depths(pixels.size(), 1e30);
    for (const auto& t : cloth_.mesh.triangles) {
      const Vec3d& a = projected_[t[0]];
      const Vec3d& b = projected_[t[1]];
      const Vec3d& c = projected_[t[2]];
      const double area = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
      const int x0 = std::max(0, static_cast<int>(std::floor(std::min({a.x(), b.x(), c.x()}))));
      const int x1 =
          std::min(kWidth - 1, static_cast<int>(std::ceil(std::max({a.x(), b.x(), c.x()}))));
      const int y0 = std::max(0, static_cast<int>(std::floor(std::min({a.y(), b.y(), c.y()}))));
      const int y1 =
          std::min(kHeight - 1, static_cast<int>(std::ceil(std::max({a.y(), b.y(), c.y()}))));
      if (area == 0) continue;
      for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
          const double px = x + 0.5;
          const double py = y + 0.5;
          const double wb = ((px - a.x()) * (c - a).y() - (py - a.y()) * (c - a).x()) / area;
          const double wc = ((b - a).x() * (py - a.y()) - (b - a).y() * (px - a.x())) / area;
          const double wa = 1 - wb - wc;
          if (wa < 0 || wb < 0 || wc < 0) continue;
          const double depth = wa * a.z() + wb * b.z() + wc * c.z();
          const std::size_t at = static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
          if (depth >= depths[at]) continue;
          depths[at] = depth;
          pixels[at] = (wa * colours[t[0]] + wb * colours[t[1]] + wc * colours[t[2]]).cast<float>();
        }
      }
    }
    return pixels;
  }

 private:
  const Cloth& cloth_;
  Vec3d eye_;
  std::vector<Vec3d> projected_;  // x, y in pixels, depth in mm
};

void write_picture(const std::string& path, int width, int height, const std::vector<Rgb>& pixels,
                   float scale) {
  std::vector<std::uint8_t> bytes;
  for (const Rgb& pixel : pixels) {
    for (int c = 0; c < 3; ++c) {
      const float value = std::pow(std::clamp(pixel[c] * scale, 0.0F, 1.0F), 1 / 2.2F);
      bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * value)));
    }
  }
  write_png(path, width, height, bytes);
}

std::vector<Light> default_lights(int count) {
  std::vector<Light> lights;
  for (int k = 0; k < count; ++k) {
    RandomStream random(1, RandomStage::kBench, 0, static_cast<std::uint64_t>(k));
    const Vec3 axis = sample_hemisphere(Vec3(0, 0, 1), random);
    const float sharpness = 4 * std::exp2(8 * random.uniform());
    lights.push_back(
        {LightType::kSphericalGaussian, axis, sharpness, Rgb::Constant(2 * random.uniform())});
  }
  return lights;
}

double rms(const std::vector<Rgbd>& values, const std::vector<Rgbd>& reference) {
  double error = 0;
  double norm = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    error += (values[k] - reference[k]).square().sum();
    norm += reference[k].square().sum();
  }
  return std::sqrt(error / norm);
}

void compare_drape(const Options& options) {
  const Cloth cloth = read_cloth(options.mesh);
  const TriangleScene scene({cloth.mesh});
  const TomlTable document = surface_preset(options.fabric);
  document.string("model");
  const MicrocylinderFabric fabric = read_microcylinder_fabric(document);
  std::vector<Light> lights = default_lights(options.lights);
  if (!options.environment.empty()) {
    const Clock::time_point start = Clock::now();
    const EnvironmentSgs fit =
        fit_environment_sgs(EnvironmentMap::read(options.environment), options.lights);
    fmt::print("environment: {} Gaussians, relative error {:.4f}, {:.2f} s\n", options.lights,
               fit.relative_error, seconds_since(start));
    lights = fit.lights;
  }

  // A vertex looks from a little above the cloth.
  const auto visible_from = [&](std::uint32_t vertex, const Vec3& direction) {
    const Vec3 origin = cloth.mesh.positions[vertex] + 0.3F * Vec3(cloth.frames[vertex].col(2));
    return !scene.occluded(origin, direction);
  };
  Clock::time_point start = Clock::now();
  const DistanceMaps maps(cloth.frames, visible_from, {});
  fmt::print("distance maps: {} vertices, {:.2f} s, {:.2f} MB, compression error {:.2f} degrees\n",
             cloth.frames.size(), seconds_since(start), static_cast<double>(maps.bytes()) / 1e6,
             degrees(maps.compression_error()));

  Vec3d middle = Vec3d::Zero();
  for (const Vec3& p : cloth.mesh.positions)
    middle += p.cast<double>() / static_cast<double>(cloth.frames.size());
  const Rasterizer rasterizer(cloth, middle + Vec3d(260, -340, 190), middle);
  std::vector<std::uint32_t> facing;
  for (std::uint32_t v = 0; v < cloth.frames.size(); ++v) {
    if (rasterizer.to_eye(v).dot(cloth.frames[v].col(2).cast<double>()) > 0.02) facing.push_back(v);
  }

  // The reference at a part of the vertices, and ray tracing with fewer directions beside it.
  std::vector<std::uint32_t> probes;
  for (std::size_t k = 0; k < facing.size(); k += 16) probes.push_back(facing[k]);
  InteractiveSettings settings;
  const InteractiveMicrocylinder model(fabric, settings);
  const auto traced_at = [&](std::uint32_t v, int strata) {
    return ray_traced_radiance(
        [&](const Vec3d& wi, const Vec3d& wo) { return model.reflected(wi, wo); },
        cloth.frames[v].cast<double>(), rasterizer.to_eye(v), lights,
        [&](const Vec3& direction) { return visible_from(v, direction); }, strata);
  };
  const auto traced = [&](int strata) {
    std::vector<Rgbd> result(probes.size());
    tbb::parallel_for(std::size_t{0}, probes.size(),
                      [&](std::size_t k) { result[k] = traced_at(probes[k], strata); });
    return result;
  };
  const std::vector<Rgbd> reference = traced(options.strata);

  double error_of_ours = 0;
  enum class Form { kPrinted, kInDouble, kOurs };
  for (const Form form : {Form::kPrinted, Form::kInDouble, Form::kOurs}) {
    settings.printed = form == Form::kPrinted;
    start = Clock::now();
    const InteractiveMicrocylinder interactive(fabric, settings);
    const double build = seconds_since(start);
    const auto shaded_at = [&](std::uint32_t v) {
      const auto shade = form == Form::kOurs ? &InteractiveMicrocylinder::shade
                                             : &InteractiveMicrocylinder::shade_in_double;
      return (interactive.*shade)(cloth.frames[v].cast<double>(), rasterizer.to_eye(v), lights,
                                  {&maps, maps.coefficients(v)});
    };
    std::vector<Rgbd> at_probes;
    for (const std::uint32_t v : probes) at_probes.push_back(shaded_at(v));
    std::vector<Rgbd> colours(cloth.frames.size(), Rgbd::Zero());
    std::vector<Rgb> pixels;
    constexpr int kFrames = 3;
    start = Clock::now();
    for (int frame = 0; frame < kFrames; ++frame) {
      tbb::parallel_for(std::size_t{0}, facing.size(),
                        [&](std::size_t k) { colours[facing[k]] = shaded_at(facing[k]); });
      pixels = rasterizer.draw(colours);
    }
    const double per_frame = seconds_since(start) / kFrames;
    const double error = rms(at_probes, reference);
    fmt::print(
        "{}: {} tangents, tables {:.2f} s, {:.2f} MB; error {:.4f}; {:.2f} frames/s ({} vertices, "
        "{} lights)\n",
        form == Form::kPrinted ? "as printed"
                               : (form == Form::kInDouble ? "ours, in double" : "ours"),
        interactive.tangents().size(), build,
        static_cast<double>(interactive.table().bytes()) / 1e6, error, 1 / per_frame, facing.size(),
        lights.size());
    if (form == Form::kOurs) {
      error_of_ours = error;
      if (!options.out.empty()) {
        float brightest = 0;
        for (const Rgb& pixel : pixels) brightest = std::max(brightest, pixel.maxCoeff());
        write_picture(options.out + "-ours.png", Rasterizer::kWidth, Rasterizer::kHeight, pixels,
                      1.2F / brightest);
        std::vector<Rgbd> truth(cloth.frames.size(), Rgbd::Zero());
        tbb::parallel_for(std::size_t{0}, facing.size(),
                          [&](std::size_t k) { truth[facing[k]] = traced_at(facing[k], 8); });
        write_picture(options.out + "-traced.png", Rasterizer::kWidth, Rasterizer::kHeight,
                      rasterizer.draw(truth), 1.2F / brightest);
      }
    }
  }
  for (const int strata : {1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20}) {
    start = Clock::now();
    const std::vector<Rgbd> result = traced(strata);
    const double per_frame = seconds_since(start) * static_cast<double>(facing.size()) /
                             static_cast<double>(probes.size());
    const double error = rms(result, reference);
    fmt::print("ray traced, {:2} x {:2} directions per light: error {:.4f}; {:.3f} frames/s\n",
               strata, strata, error, 1 / per_frame);
    if (error < error_of_ours) break;
  }
}

// exp(-lambda (w.x)^2 - mu (w.y)^2) max(w.z, 0) about a steep axis z, over a plane under a ball
// with a ring and a cone.
struct AnisotropicLight {
  Vec3d x, y, z;
  double lambda, mu;
};

TriangleMesh handle_and_spout() {
  TriangleMesh mesh;
  const auto grid = [&](int rows, int columns, auto&& position) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int r = 0; r <= rows; ++r) {
      for (int c = 0; c <= columns; ++c) {
        mesh.positions.push_back(position(static_cast<float>(r) / static_cast<float>(rows),
                                          static_cast<float>(c) / static_cast<float>(columns)));
      }
    }
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        const std::uint32_t at = first + static_cast<std::uint32_t>(r * (columns + 1) + c);
        const auto below = at + static_cast<std::uint32_t>(columns) + 1;
        mesh.triangles.push_back({at, at + 1, below});
        mesh.triangles.push_back({at + 1, below + 1, below});
      }
    }
  };
  constexpr float kTurn = 2 * kPif;
  grid(24, 48, [](float u, float v) {  // the body
    const float radius = 11 * std::sin(kPif * u);
    return Vec3(radius * std::cos(kTurn * v), radius * std::sin(kTurn * v),
                12 + 11 * std::cos(kPif * u));
  });
  grid(48, 12, [](float u, float v) {  // an upright ring
    const float radius = 8 + 1.2F * std::cos(kTurn * v);
    return Vec3(-14 + radius * std::cos(kTurn * u), 1.2F * std::sin(kTurn * v),
                12 + radius * std::sin(kTurn * u));
  });
  grid(16, 12, [](float u, float v) {  // a leaning cone
    const float radius = 2.5F - 2 * u;
    return Vec3(8 + 16 * u + radius * std::cos(kTurn * v), radius * std::sin(kTurn * v),
                2 + 18 * u);
  });
  return mesh;
}

void compare_anisotropic(const Options& options) {
  const TriangleScene scene({handle_and_spout()});
  constexpr int kSide = 72;
  std::vector<Vec3> points;
  std::vector<Mat3> frames;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      points.emplace_back(static_cast<float>(column) + 0.5F - kSide / 2,
                          kSide / 2 - 0.5F - static_cast<float>(row), 0);
      frames.push_back(Mat3::Identity());
    }
  }
  DistanceMapSettings map_settings;
  map_settings.resolution = 128;
  const DistanceMaps maps(
      frames,
      [&](std::uint32_t v, const Vec3& direction) { return !scene.occluded(points[v], direction); },
      map_settings);
  fmt::print(
      "\nanisotropic light (figure 8): shadow of a ball, a ring and a cone, {} terms, compression "
      "error {:.2f} "
      "degrees\n",
      map_settings.terms, degrees(maps.compression_error()));
  std::vector<Rgb> montage(static_cast<std::size_t>(3 * kSide * 2 * kSide), Rgb::Zero());
  for (int turn = 0; turn < 2; ++turn) {
    AnisotropicLight light;
    light.z = Vec3d(0.2, -0.45, 1).normalized();
    light.x = (Vec3d(1, 0, 0) - light.z * light.z.x()).normalized();
    light.y = light.z.cross(light.x);
    light.lambda = turn == 0 ? 10 : 1000;
    light.mu = turn == 0 ? 1000 : 10;
    // In angles about the axis: widths as in exp(-x^2 / s^2).
    const double width_x = 1 / std::sqrt(light.lambda);
    const double width_y = 1 / std::sqrt(light.mu);
    const double isotropic = 1 / std::pow(light.lambda * light.mu, 0.25);
    std::vector<std::array<double, 3>> shadow(points.size());  // ray traced, line, isotropic
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t k) {
      constexpr int kRays = 48;
      double seen = 0;
      double whole = 0;
      for (int i = 0; i < kRays; ++i) {
        for (int j = 0; j < kRays; ++j) {
          const double a = 3 * width_x * (2 * (i + 0.5) / kRays - 1);
          const double b = 3 * width_y * (2 * (j + 0.5) / kRays - 1);
          if (a * a + b * b >= 1) continue;
          const double c = std::sqrt(1 - a * a - b * b);
          const Vec3d w = a * light.x + b * light.y + c * light.z;
          if (w.z() <= 0) continue;
          // max(w.z, 0) of the light cancels 1 / (w.z) of the solid angle.
          const double value = std::exp(-light.lambda * a * a - light.mu * b * b);
          whole += value;
          if (!scene.occluded(points[k], w.cast<float>())) seen += value;
        }
      }
      const SignedDistance at =
          maps.evaluate(maps.coefficients(static_cast<std::uint32_t>(k)), light.z);
      const VisibilityLine line = visibility_line(at, 1, light.x, light.y);
      shadow[k] = {seen / whole, visible_share(width_x, width_y, line),
                   0.5 * (1 + std::erf(at.distance / isotropic))};
    });
    double line_error = 0;
    double isotropic_error = 0;
    for (std::size_t k = 0; k < shadow.size(); ++k) {
      line_error += std::pow(shadow[k][1] - shadow[k][0], 2);
      isotropic_error += std::pow(shadow[k][2] - shadow[k][0], 2);
      for (std::size_t m = 0; m < 3; ++m) {
        const std::size_t row = static_cast<std::size_t>(turn) * kSide + k / kSide;
        montage[(row * 3 + m) * kSide + k % kSide] =
            Rgb::Constant(static_cast<float>(shadow[k][m]));
      }
    }
    const auto count = static_cast<double>(shadow.size());
    fmt::print(
        "  (lambda, mu) = ({}, {}): RMS error of the visible share: line {:.4f}, isotropic "
        "{:.4f}\n",
        light.lambda, light.mu, std::sqrt(line_error / count), std::sqrt(isotropic_error / count));
  }
  if (!options.out.empty())
    write_picture(options.out + "-anisotropic.png", 3 * kSide, 2 * kSide, montage, 1);
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  heddle::Options options;
  CLI::App app("The interactive microcylinder against ray tracing.");
  app.add_option("cloth", options.mesh, "drape, OBJ in metres with UVs and normals")->required();
  app.add_option("--fabric", options.fabric, "a microcylinder preset");
  app.add_option("--environment", options.environment, "lat-long map; else a fixed set of lights");
  app.add_option("--lights", options.lights, "spherical Gaussians")->check(CLI::Range(1, 200));
  app.add_option("--strata", options.strata, "of the reference: directions per light and axis")
      ->check(CLI::Range(8, 200));
  app.add_option("--out", options.out, "prefix of PNG files");
  CLI11_PARSE(app, argc, argv);
  try {
    heddle::compare_drape(options);
    heddle::compare_anisotropic(options);
  } catch (const heddle::ConfigError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
