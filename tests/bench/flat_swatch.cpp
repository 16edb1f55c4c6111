// How far the precomputed methods are from path tracing on a flat, endless cloth: 41 views x 12
// directional lights, as in Figure 13 of Khungurn 2017. Not a test: it prints, and writes
// PREFIX.csv (every value) and PREFIX.svg (curves).
//
//   heddle_flat_swatch PACK [--printed PACK] [--paths N] [--floor-paths K] [--sharpness L]
//     [--no-rivals] [--seed S] [--out PREFIX]
//
// Views: theta_o = -80, -76, .. 80 degrees in the xz plane. Lights: theta = 10, 30, 50, 70 degrees
// at azimuths 0, 60, 135 degrees from +x, irradiance 1 across the light's axis; with --sharpness
// spherical Gaussians about the same axes, for which the reference draws one direction per eye ray,
// and of which only what lies above the horizon shines. Values: radiance averaged over the tile,
// rgb. One walk of the reference serves all lights: next-event estimation of each at every vertex.
// The methods shade the same eye rays:
//   exact     eye rays against the fibers, single scattering by SSDF sign, multiple scattering by
//             the cells' transfer
//   volume    the same with eye rays through the id volume
//   origin    exact, with the visibility of single scattering from a shadow ray at the segment's
//             origin: what the SSDF encodes
//   floor     exact, with the single scattering of the reference, and multiple scattering by the
//             transfer to the hit point itself, to the same SH order: what the truncation alone
//             costs. K paths from the hit point per eye ray, each 4 pi * throughput * K(w0 . light)
//             * sum over j of Y_j(w1) c_S[j], K(w0) = sum of Y_j(w0) c_light[j] with the light
//             projected as by the renderer (MultipleScattering::LightShape); directional lights
//             only.
//   path-6, prt, tsai-shih-16, tsai-shih-full, dual-scattering, and printed where its pack is
//     named: as `heddle render` names
//             them (docs/rivals.md); tsai-shih-plain is tsai-shih-16 by the plain matrix
//               (render/rivals/bcsdf_factors.h). A pack for `printed` comes from a render with that
//               method.
//
// Error: sqrt(mean of (F1 - R1)(F2 - R2)) / mean R, where 1 and 2 are two independent halves of all
// samples, so that neither the reference's noise nor the methods' own counts. A method shares eye
// rays with the half of the reference it is compared with, which takes out the noise that they have
// in common.

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "fibers/baked/id_bricks.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/scattering/wo_space.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/segment_origins.h"
#include "fibers/tracing/tile_trace.h"
#include "formats/input_error.h"
#include "render/multiple_scattering.h"
#include "render/rivals/dual_scattering.h"
#include "render/rivals/prt_scattering.h"
#include "render/rivals/tsai_shih_scattering.h"
#include "render/single_scattering.h"
#include "tests/bench/flat_pairs.h"

namespace heddle {
namespace {

enum Method {
  kReference,
  kExact,
  kVolume,
  kOrigin,
  kFloor,
  kPath6,
  kPrinted,
  kPrt,
  kTsaiShih16,
  kTsaiShihPlain,
  kTsaiShihFull,
  kDualScattering,
  kMethods
};
constexpr std::array<const char*, kMethods> kMethodNames = {
    "reference", "exact", "volume",       "origin",          "floor",          "path-6",
    "printed",   "prt",   "tsai-shih-16", "tsai-shih-plain", "tsai-shih-full", "dual-scattering"};
enum Part { kSingle, kMultiple, kTotal, kParts };
constexpr std::array<const char*, kParts> kPartNames = {"single", "multiple", "total"};

using Values = std::array<Rgbd, kLights>;  // [light]
// [method][single, multiple][light]
using MethodValues = std::array<std::array<Values, 2>, kMethods>;
using Half = std::vector<MethodValues>;  // [view]

struct Options {
  std::string pack;
  std::string printed;             // the pack of `printed`; that method is left out where empty
  std::optional<float> sharpness;  // of the lights; directional where absent
  bool rivals = true;
  int paths = 4096;
  int floor_paths = 4;
  std::uint64_t seed = 1;
  std::string prefix = "flat_swatch";
};

class Swatch {
 public:
  using LightShape = MultipleScattering::LightShape;

  Swatch(const FabricPack& pack, const FabricPack* printed, const Options& options)
      : pack_(pack),
        printed_(printed),
        options_(options),
        scene_(pack.exemplar),
        trace_(scene_),
        origins_(find_segment_origins(scene_, pack.light_from_both_sides, OriginChoice::kExposed,
                                      options.seed)),
        bricks_(*pack.volume),
        single_(&*pack.ssdf, pack.sgs ? &*pack.sgs : nullptr, pack.materials),
        multiple_(*pack.transfer, pack.materials, pack.bundle_tangent),
        shape_(options.sharpness),
        printed_shape_(options.sharpness, LightShape::Projection::kPrinted),
        prt_(*pack.ssdf, pack.light_from_both_sides, pack.materials),
        tsai_shih_16_(*pack.ssdf, pack.light_from_both_sides, pack.materials,
                      BcsdfFactors::kRecommendedTerms),
        tsai_shih_plain_(*pack.ssdf, pack.light_from_both_sides, pack.materials,
                         BcsdfFactors::kRecommendedTerms, BcsdfFactors::Matrix::kPlain),
        tsai_shih_full_(*pack.ssdf, pack.light_from_both_sides, pack.materials,
                        BcsdfFactors::kAllTerms),
        dual_(scene_, pack.materials),
        strata_(std::max(1, static_cast<int>(std::lround(std::sqrt(options.paths / 2.0))))) {
    for (int l = 0; l < kLights; ++l) {
      lights_[l] = direction_of(light_theta(l), light_azimuth(l));
      MultipleScattering::LightShape(std::nullopt)
          .project(pack.transfer->order, pack.transfer->both_sides, lights_[l],
                   projected_[l].data());
    }
    if (printed != nullptr) {
      printed_single_.emplace(&*printed->ssdf, printed->sgs ? &*printed->sgs : nullptr,
                              printed->materials, kPrintedBlend, SgMethod::kPrinted);
      printed_multiple_.emplace(*printed->transfer, printed->materials);
    }
  }

  bool has(int method) const {
    if (!options_.rivals && method >= kPath6) return false;
    if (method == kFloor) return !options_.sharpness;
    return method != kPrinted || printed_ != nullptr;
  }

  /// Mean values of one view over half of the eye rays.
  MethodValues measure(int view, int half) const {
    MethodValues sum;
    for (auto& method : sum) {
      for (auto& part : method) part.fill(Rgbd::Zero());
    }
    const Vec3 wo = direction_of(view_degrees(view), 0);
    const Exemplar& exemplar = pack_.exemplar;
    const double scale = 1.0 / (strata_ * strata_);
    for (int i = 0; i < strata_ * strata_; ++i) {
      RandomStream random(options_.seed, RandomStage::kBench,
                          static_cast<std::uint64_t>(2 * view + half), i);
      // A point on the plane that touches the cloth from above, one per stratum of the tile.
      const float x =
          (static_cast<float>(i % strata_) + random.uniform()) / static_cast<float>(strata_);
      const float y =
          (static_cast<float>(i / strata_) + random.uniform()) / static_cast<float>(strata_);
      const Vec3 origin(x * exemplar.width_mm, y * exemplar.height_mm, exemplar.z_max);
      if (const auto vertex = trace_.first(origin, -wo)) {
        std::array<Vec3, kLights> towards = lights_;
        if (options_.sharpness) {
          for (Vec3& light : towards)
            light = sample_spherical_gaussian(light, *options_.sharpness, random);
        }
        add_reference(*vertex, wo, towards, random, scale, sum);
        add_precomputed(vertex->segment, vertex->tangent, wo, scale, sum[kExact]);
        add_origin_single(*vertex, wo, towards, scale, sum[kOrigin][kSingle]);
        for (int k = 0; k < options_.floor_paths && has(kFloor); ++k) {
          add_floor_multiple(*vertex, wo, random, scale / options_.floor_paths,
                             sum[kFloor][kMultiple]);
        }
        if (options_.rivals) add_rivals(*vertex, wo, towards, scale, sum);
      }
      if (const auto hit = bricks_.first_hit({origin, -wo})) {
        add_precomputed(hit->segment, exemplar.segment_tangent(hit->segment), wo, scale,
                        sum[kVolume]);
      }
    }
    sum[kOrigin][kMultiple] = sum[kExact][kMultiple];
    sum[kFloor][kSingle] = sum[kReference][kSingle];
    sum[kPath6][kSingle] = sum[kReference][kSingle];
    for (const Method method : {kPrt, kTsaiShih16, kTsaiShihPlain, kTsaiShihFull})
      sum[method][kMultiple] = sum[kExact][kMultiple];
    return sum;
  }

 private:
  void add_reference(const TileTrace::Vertex& hit, const Vec3& wo,
                     const std::array<Vec3, kLights>& lights, RandomStream& random, double scale,
                     MethodValues& sum) const {
    auto& parts = sum[kReference];
    walk_path(trace_, std::span<const BcsdfTable>(pack_.materials), hit, wo, Rgb(1, 1, 1), random,
              WalkLimits{},
              [&](const TileTrace::Vertex& vertex, const Mat3& frame, const Vec3& out,
                  const Rgb& throughput, int n) {
                const Vec3 local_out = frame.transpose() * out;
                for (int l = 0; l < kLights; ++l) {
                  if (!shines(lights[l]) || !trace_.escapes(vertex, lights[l])) continue;
                  const Rgb value =
                      throughput *
                      scattered(vertex.material, frame.transpose() * lights[l], local_out);
                  parts[n == 1 ? kSingle : kMultiple][l] += scale * value.cast<double>();
                  if (n > 1 && n <= 6) sum[kPath6][kMultiple][l] += scale * value.cast<double>();
                }
                return true;
              });
  }

  bool shines(const Vec3& light) const { return pack_.light_from_both_sides || light.z() > 0; }

  Rgb single_of(const SingleScatteringModel& model, const ShadingPoint& point, int l) const {
    const DirectionPair axis = {lights_[l], lights_[l]};
    return options_.sharpness ? model.spherical_gaussian(point, axis, *options_.sharpness)
                              : model.directional(point, axis);
  }

  void add_rivals(const TileTrace::Vertex& hit, const Vec3& wo,
                  const std::array<Vec3, kLights>& towards, double scale, MethodValues& sum) const {
    ShadingPoint point = {hit.segment,
                          pack_.transfer->cell_of_segment[hit.segment],
                          hit.material,
                          {hit.tangent, hit.tangent},
                          {wo, wo}};
    for (int l = 0; l < kLights; ++l) {
      sum[kPrt][kSingle][l] += scale * single_of(prt_, point, l).cast<double>();
      sum[kTsaiShih16][kSingle][l] += scale * single_of(tsai_shih_16_, point, l).cast<double>();
      sum[kTsaiShihPlain][kSingle][l] +=
          scale * single_of(tsai_shih_plain_, point, l).cast<double>();
      sum[kTsaiShihFull][kSingle][l] += scale * single_of(tsai_shih_full_, point, l).cast<double>();
      if (shines(towards[l])) {
        const DualScattering::Parts parts =
            dual_.directional(point, hit.position, {towards[l], towards[l]});
        sum[kDualScattering][kSingle][l] += scale * parts.single.cast<double>();
        sum[kDualScattering][kMultiple][l] += scale * parts.multiple.cast<double>();
      }
    }
    if (printed_ == nullptr) return;
    point.cell = printed_->transfer->cell_of_segment[hit.segment];
    for (int l = 0; l < kLights; ++l) {
      sum[kPrinted][kSingle][l] += scale * single_of(*printed_single_, point, l).cast<double>();
      sum[kPrinted][kMultiple][l] += scale * printed_multiple_
                                                 ->radiance(printed_shape_, lights_[l], hit.segment,
                                                            point.material, hit.tangent, wo)
                                                 .cast<double>();
    }
  }

  Rgb scattered(std::uint16_t material, const Vec3& wi, const Vec3& wo) const {
    return std::sqrt(std::max(0.0F, 1 - wi.x() * wi.x())) *
           pack_.materials[material].evaluate(wi, wo);
  }

  void add_precomputed(std::uint32_t segment, const Vec3& tangent, const Vec3& wo, double scale,
                       std::array<Values, 2>& parts) const {
    const ShadingPoint point = {segment,
                                pack_.transfer->cell_of_segment[segment],
                                pack_.exemplar.segment_material(segment),
                                {tangent, tangent},
                                {wo, wo}};
    for (int l = 0; l < kLights; ++l) {
      parts[kSingle][l] += scale * single_of(single_, point, l).cast<double>();
      parts[kMultiple][l] +=
          scale * multiple_.radiance(shape_, lights_[l], segment, point.material, tangent, wo)
                      .cast<double>();
    }
  }

  void add_origin_single(const TileTrace::Vertex& hit, const Vec3& wo,
                         const std::array<Vec3, kLights>& lights, double scale, Values& sum) const {
    const TileTrace::Vertex origin = trace_.at(origins_.position[hit.segment], hit.segment);
    const Mat3 frame = frame_about(hit.tangent);
    for (int l = 0; l < kLights; ++l) {
      if (!shines(lights[l]) || !trace_.escapes(origin, lights[l])) continue;
      sum[l] +=
          scale * scattered(hit.material, frame.transpose() * lights[l], frame.transpose() * wo)
                      .cast<double>();
    }
  }

  void add_floor_multiple(const TileTrace::Vertex& hit, const Vec3& wo, RandomStream& random,
                          double scale, Values& sum) const {
    const Vec3 towards = sample_sphere(random);
    const auto first = trace_.next(hit, towards);
    if (!first) return;
    const auto escape =
        walk_path(trace_, std::span<const BcsdfTable>(pack_.materials), *first, -towards,
                  Rgb(1, 1, 1), random, WalkLimits{},
                  [](const auto&, const Mat3&, const Vec3&, const Rgb&, int) { return true; });
    if (!escape || (!pack_.transfer->both_sides && !(escape->direction.z() > 0))) return;
    const int order = pack_.transfer->order;
    const Vec3 local = wo_space(hit.tangent, wo) * towards;
    std::array<float, sh_count(kMaxShOrder)> harmonics;
    evaluate_sh(order, local, harmonics.data());
    IncomingField response;
    pack_.materials[hit.material].sh_coefficients(
        std::asin(std::clamp(wo.dot(hit.tangent), -1.0F, 1.0F)), order, response.data());
    Rgbd seen = Rgbd::Zero();
    for (int j = 0; j < sh_count(order); ++j) {
      for (int c = 0; c < 3; ++c)
        seen[c] += static_cast<double>(harmonics[j]) * response[3 * j + c];
    }
    const Rgbd carried = 4 * kPi * scale * escape->throughput.cast<double>() * seen;
    std::array<float, sh_count(kMaxShOrder)> light_harmonics;
    evaluate_sh(order, escape->direction, light_harmonics.data());
    for (int l = 0; l < kLights; ++l) {
      double kernel = 0;
      for (int j = 0; j < sh_count(order); ++j)
        kernel += static_cast<double>(light_harmonics[j]) * projected_[l][j];
      sum[l] += kernel * carried;
    }
  }

  const FabricPack& pack_;
  const FabricPack* printed_;
  const Options& options_;
  TileScene scene_;
  TileTrace trace_;
  SegmentOrigins origins_;
  IdBricks bricks_;
  SingleScattering single_;
  MultipleScattering multiple_;
  LightShape shape_;
  LightShape printed_shape_;
  PrtScattering prt_;
  TsaiShihScattering tsai_shih_16_;
  TsaiShihScattering tsai_shih_plain_;
  TsaiShihScattering tsai_shih_full_;
  DualScattering dual_;
  std::optional<SingleScattering> printed_single_;
  std::optional<MultipleScattering> printed_multiple_;
  std::array<Vec3, kLights> lights_;
  std::array<std::array<float, sh_count(kMaxShOrder)>, kLights> projected_;  // [light][j] c_light
  int strata_;  // per side of the tile, of each half
};

double value(const MethodValues& values, int method, int part, int light, int channel) {
  const auto& parts = values[static_cast<std::size_t>(method)];
  if (part < kTotal) return parts[static_cast<std::size_t>(part)][light][channel];
  return parts[kSingle][light][channel] + parts[kMultiple][light][channel];
}

/// Sum over all pairs (and all channels, where channel < 0) of `term(view, light, channel)`, over
/// their number.
template <class Term>
double mean_over(int channel, Term&& term) {
  double sum = 0;
  const int first = channel < 0 ? 0 : channel;
  const int last = channel < 0 ? 2 : channel;
  for (int v = 0; v < kViews; ++v) {
    for (int l = 0; l < kLights; ++l) {
      for (int c = first; c <= last; ++c) sum += term(v, l, c);
    }
  }
  return sum / (kViews * kLights * (last - first + 1));
}

struct Comparison {
  double reference;  // mean
  double mean;       // of the method
  double rmse;       // absolute
};

Comparison compare(const std::array<Half, 2>& halves, int method, int part, int channel) {
  const auto both = [&](int m, int v, int l, int c) {
    return 0.5 * (value(halves[0][v], m, part, l, c) + value(halves[1][v], m, part, l, c));
  };
  const double squared = mean_over(channel, [&](int v, int l, int c) {
    double product = 1;
    for (const Half& half : halves)
      product *= value(half[v], method, part, l, c) - value(half[v], kReference, part, l, c);
    return product;
  });
  return {mean_over(channel, [&](int v, int l, int c) { return both(kReference, v, l, c); }),
          mean_over(channel, [&](int v, int l, int c) { return both(method, v, l, c); }),
          std::sqrt(std::max(0.0, squared))};
}

void print_report(const FabricPack& pack, const Swatch& swatch, const Options& options,
                  const std::array<Half, 2>& halves) {
  const double noise = std::sqrt(mean_over(-1, [&](int v, int l, int c) {
    const double d = value(halves[0][v], kReference, kTotal, l, c) -
                     value(halves[1][v], kReference, kTotal, l, c);
    return 0.25 * d * d;
  }));
  const double total = compare(halves, kReference, kTotal, -1).reference;
  fmt::print("{}: {} segments, SH order {}, {} cells; {} views x {} lights, {} eye rays per view\n",
             pack.name, pack.exemplar.segment_count(), pack.transfer->order,
             pack.transfer->cell_count(), kViews, kLights, options.paths);
  fmt::print("mean reference radiance {:.5f}; its standard error, rms over values: {:.2f} %\n\n",
             total, 100 * noise / total);
  fmt::print("{:<16}{:<10}{:>12}{:>14}{:>16}{:>26}\n", "method", "part", "mean ratio",
             "RMSE of part", "RMSE of total", "RMSE of part, r / g / b");
  for (int m = kExact; m < kMethods; ++m) {
    if (!swatch.has(m)) continue;
    for (int p = 0; p < kParts; ++p) {
      const bool multiple_of_exact =
          m == kOrigin || m == kPrt || (m >= kTsaiShih16 && m <= kTsaiShihFull);
      const bool single_of_reference = m == kFloor || m == kPath6;
      if ((multiple_of_exact && p == kMultiple) || (single_of_reference && p == kSingle)) continue;
      const Comparison all = compare(halves, m, p, -1);
      fmt::print("{:<16}{:<10}{:>12.4f}{:>12.2f} %{:>14.2f} %    ", kMethodNames[m], kPartNames[p],
                 all.mean / all.reference, 100 * all.rmse / all.reference, 100 * all.rmse / total);
      for (int c = 0; c < 3; ++c) {
        const Comparison one = compare(halves, m, p, c);
        fmt::print("{:>7.2f}", 100 * one.rmse / one.reference);
      }
      fmt::print(" %\n");
    }
  }
}

void write_csv(const std::string& path, const Swatch& swatch, const std::array<Half, 2>& halves) {
  std::ofstream file(path);
  file << "view_deg,light_theta_deg,light_azimuth_deg,method,part,half,r,g,b\n";
  for (int v = 0; v < kViews; ++v) {
    for (int l = 0; l < kLights; ++l) {
      for (int m = 0; m < kMethods; ++m) {
        if (!swatch.has(m)) continue;
        for (int p = 0; p < kTotal; ++p) {
          for (int h = 0; h < 2; ++h) {
            file << fmt::format("{},{},{},{},{},{},{:.7g},{:.7g},{:.7g}\n", view_degrees(v),
                                light_theta(l), light_azimuth(l), kMethodNames[m], kPartNames[p], h,
                                value(halves[h][v], m, p, l, 0), value(halves[h][v], m, p, l, 1),
                                value(halves[h][v], m, p, l, 2));
          }
        }
      }
    }
  }
  if (!file.flush()) throw FileError("cannot write " + path);
}

/// One panel per light: mean of the channels over theta_o, total and single scattering.
void write_svg(const std::string& path, const std::string& title,
               const std::array<Half, 2>& halves) {
  constexpr int kPanelWidth = 320;
  constexpr int kPanelHeight = 220;
  constexpr int kMargin = 40;
  constexpr int kColumns = 3;
  struct Curve {
    Method method;
    const char* colour;
  };
  constexpr std::array<Curve, 6> kCurves = {{{kReference, "#000000"},
                                             {kExact, "#d62728"},
                                             {kVolume, "#1f77b4"},
                                             {kPrt, "#2ca02c"},
                                             {kTsaiShih16, "#9467bd"},
                                             {kDualScattering, "#ff7f0e"}}};
  const auto grey = [&](int m, int p, int v, int l) {
    double sum = 0;
    for (const Half& half : halves) {
      for (int c = 0; c < 3; ++c) sum += value(half[v], m, p, l, c) / 6;
    }
    return sum;
  };
  double top = 0;
  for (int v = 0; v < kViews; ++v) {
    for (int l = 0; l < kLights; ++l) {
      for (const Curve& curve : kCurves) top = std::max(top, grey(curve.method, kTotal, v, l));
    }
  }
  std::ofstream file(path);
  file << fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" "
      "font-family=\"sans-serif\" "
      "font-size=\"11\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
      "<text x=\"{}\" y=\"16\" font-size=\"14\">{}: radiance over view angle; solid: total, "
      "dashed: single "
      "scattering</text>\n",
      kColumns * kPanelWidth + kMargin, kLights / kColumns * kPanelHeight + 3 * kMargin / 2,
      kMargin, title);
  double x = kMargin;
  for (const Curve& curve : kCurves) {
    file << fmt::format("<text x=\"{}\" y=\"32\" fill=\"{}\">{}</text>\n", x, curve.colour,
                        kMethodNames[curve.method]);
    x += 110;
  }
  for (int l = 0; l < kLights; ++l) {
    const double left = kMargin + l % kColumns * kPanelWidth;
    const double bottom = kMargin + (l / kColumns + 1) * kPanelHeight - 24;
    const double width = kPanelWidth - kMargin;
    const double height = kPanelHeight - 44;
    file << fmt::format(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#999999\"/>\n"
        "<text x=\"{}\" y=\"{}\">light {:.0f} deg, azimuth {:.0f} deg</text>\n"
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{:.2g}</text><text x=\"{}\" y=\"{}\" "
        "text-anchor=\"end\">0</text>\n"
        "<text x=\"{}\" y=\"{}\">-80</text><text x=\"{}\" y=\"{}\" text-anchor=\"end\">80</text>\n",
        left, bottom - height, width, height, left + 6, bottom - height + 13, light_theta(l),
        light_azimuth(l), left - 3, bottom - height + 9, top, left - 3, bottom, left, bottom + 12,
        left + width, bottom + 12);
    for (const Curve& curve : kCurves) {
      for (const Part part : {kTotal, kSingle}) {
        file << fmt::format(
            "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\"{} points=\"", curve.colour,
            part == kSingle ? " stroke-dasharray=\"4 3\"" : "");
        for (int v = 0; v < kViews; ++v) {
          file << fmt::format("{:.1f},{:.1f} ", left + width * v / (kViews - 1),
                              bottom - height * grey(curve.method, part, v, l) / top);
        }
        file << "\"/>\n";
      }
    }
  }
  file << "</svg>\n";
  if (!file.flush()) throw FileError("cannot write " + path);
}

void run(const Options& options) {
  const FabricPack pack = load_pack(options.pack);
  if (!pack.ssdf || !pack.transfer || !pack.volume) {
    throw FileError(options.pack + ": the pack needs an SSDF, a transfer and a volume");
  }
  std::optional<FabricPack> printed;
  if (!options.printed.empty()) {
    printed = load_pack(options.printed);
    if (!printed->ssdf || !printed->transfer)
      throw FileError(options.printed + ": needs an SSDF and a transfer");
  }
  const bool soft = options.sharpness && *options.sharpness < VisibilityBlend{}.to;
  if (soft && (!pack.sgs || (printed && !printed->sgs)))
    throw FileError("a pack lacks sums of Gaussians");
  const Swatch swatch(pack, printed ? &*printed : nullptr, options);
  std::array<Half, 2> halves = {Half(kViews), Half(kViews)};
  tbb::parallel_for(0, 2 * kViews, [&](int i) {
    halves[static_cast<std::size_t>(i % 2)][i / 2] = swatch.measure(i / 2, i % 2);
  });
  print_report(pack, swatch, options, halves);
  write_csv(options.prefix + ".csv", swatch, halves);
  write_svg(options.prefix + ".svg", pack.name, halves);
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  heddle::Options options;
  CLI::App app("Radiance of a flat swatch: precomputed methods against path tracing.");
  app.add_option("pack", options.pack, "fabric pack with SSDF, transfer and volume")->required();
  app.add_option("--printed", options.printed,
                 "pack of the same fabric, baked for the method `printed`");
  app.add_option("--sharpness", options.sharpness,
                 "spherical Gaussians in place of directional lights")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("!--no-rivals", options.rivals, "exact, volume, origin and floor only");
  app.add_option("--paths", options.paths, "eye rays per view, both halves together")
      ->check(CLI::Range(2, 100'000'000));
  app.add_option("--floor-paths", options.floor_paths, "paths for the floor, per eye ray")
      ->check(CLI::Range(1, 1000));
  app.add_option("--seed", options.seed, "seed");
  app.add_option("--out", options.prefix, "prefix of the .csv and .svg files");
  CLI11_PARSE(app, argc, argv);
  try {
    heddle::run(options);
  } catch (const heddle::ConfigError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
