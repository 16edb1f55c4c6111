#include "pipeline/accuracy/measure_accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "fibers/tracing/tile_scene.h"
#include "pipeline/accuracy/enclosure.h"
#include "pipeline/work_time.h"
#include "render/cloth_scene.h"
#include "render/path_tracer.h"
#include "render/precomputed_renderer.h"

namespace heddle {
namespace {

constexpr int kLevels = 6;  // footprints of 1, 2, .. 2^(kLevels - 1) pixels

/// Sums over the pixels of a picture, at one footprint.
struct Sums {
  double bias = 0;          // of d0 d1
  double bias_squares = 0;  // of (d0 d1)^2
  double change = 0;        // of e0 e1, e: difference to the setting that this one is a change of
  double variance = 0;      // of one sample
  double count = 0;         // pixels
  Rgbd picture = Rgbd::Zero();
  Rgbd reference = Rgbd::Zero();
};

/// The halves of a picture, averaged over squares of pixels step by step.
struct Halves {
  int edge;
  std::vector<Rgbd> half0;  // [pixel]
  std::vector<Rgbd> half1;

  explicit Halves(const FrameBuffers& frame) : edge(frame.width) {
    for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
      half0.push_back(frame.half0[k].cast<double>());
      half1.push_back(frame.half1[k].cast<double>());
    }
  }
  void halve() {
    const auto average = [this](std::vector<Rgbd>& values) {
      std::vector<Rgbd> half;
      for (int y = 0; y < edge; y += 2) {
        for (int x = 0; x < edge; x += 2) {
          const auto at = [&](int i, int j) {
            return values[static_cast<std::size_t>((y + j) * edge + x + i)];
          };
          half.push_back(0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)));
        }
      }
      values = std::move(half);
    };
    average(half0);
    average(half1);
    edge /= 2;
  }
  double product() const {
    double sum = 0;
    for (std::size_t k = 0; k < half0.size(); ++k) sum += (half0[k] * half1[k]).mean();
    return sum / static_cast<double>(half0.size());
  }
};

/// [level], each of pixels twice as wide.
std::vector<Sums> compare(const FrameBuffers& frame, const FrameBuffers& reference,
                          const FrameBuffers& unchanged, int level_count) {
  Halves f(frame);
  Halves r(reference);
  Halves u(unchanged);
  double variance = 0;
  for (const Rgb& value : frame.variance) variance += frame.spp * static_cast<double>(value.mean());
  variance /= static_cast<double>(frame.pixel_count());
  const double finest = f.product();
  std::vector<Sums> levels;
  for (int level = 0; level < level_count; ++level) {
    Sums sums;
    sums.count = static_cast<double>(f.half0.size());
    for (std::size_t k = 0; k < f.half0.size(); ++k) {
      const double product = ((f.half0[k] - r.half0[k]) * (f.half1[k] - r.half1[k])).mean();
      sums.bias += product;
      sums.bias_squares += product * product;
      sums.change += ((f.half0[k] - u.half0[k]) * (f.half1[k] - u.half1[k])).mean();
      sums.picture += 0.5 * (f.half0[k] + f.half1[k]);
      sums.reference += 0.5 * (r.half0[k] + r.half1[k]);
    }
    // A wide pixel's samples also differ by what narrow ones inside it show.
    sums.variance = sums.count * (variance + std::max(0.0, finest - f.product()));
    levels.push_back(sums);
    if (level + 1 < level_count) {
      f.halve();
      r.halve();
      u.halve();
    }
  }
  return levels;
}

/// Mean over the pixels; cloth fills the picture.
double mean_square_enclosure(const Camera& camera, const ClothScene& scene) {
  double sum = 0;
  double count = 0;
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      const EyeRay ray = camera.ray(x + 0.5, y + 0.5);
      const std::optional<ShellHit> hit = scene.first_fiber({ray.origin, ray.direction});
      if (!hit) continue;
      const double share = enclosure(scene, *hit, ray.direction);
      sum += share * share;
      count += 1;
    }
  }
  return count > 0 ? sum / count : 0;
}

/// A picture of a view under lights, and what it took.
struct TimedFrame {
  FrameBuffers frame;
  double setup_seconds = 0;
  double seconds = 0;
};
using RenderSwatch = std::function<TimedFrame(const Camera&, const std::vector<Light>&, bool bent)>;

class TableMaker {
 public:
  TableMaker(const Swatch& swatch, std::size_t settings, const AccuracyProgress& progress)
      : swatch_(&swatch), progress_(&progress), steps_(settings) {
    table_.threads = working_threads();
    for (const double sharpness : kSharpnesses) table_.sharpness.push_back(sharpness);
    for (std::size_t height = 0; height < kHeights; ++height) {
      table_.light_cosine.push_back(
          mean_cosine(std::span(kPairs).subspan(height * kPairsOfHeight, kPairsOfHeight)));
    }
    table_.bent_footprint_mm = kBentSeen / swatch.effort().bent_pixels;
    table_.bent_light_cosine = mean_cosine(kBentPairs);
    for (int level = 0; level < kLevels; ++level)
      table_.footprint_mm.push_back(std::ldexp(swatch.pixel_mm(), level));
  }

  /// The first setting, "path", is the reference of all. `change_of`: the setting, added before,
  /// that this one is a change of, or none.
  void add(const std::string& name, const RenderSwatch& render, const std::string& change_of = "") {
    SettingAccuracy setting;
    setting.name = name;
    double samples = 0;
    std::size_t pictures = 0;
    std::vector<FrameBuffers>& own = frames_[name];
    const std::vector<FrameBuffers>& unchanged = change_of.empty() ? own : frames_.at(change_of);
    const auto compare_with = [&](std::size_t picture, const Camera& camera, const Light& light,
                                  bool bent, int levels) {
      (*progress_)((static_cast<double>(done_) + static_cast<double>(pictures) / kShots) /
                   static_cast<double>(steps_));
      const TimedFrame timed = render(camera, {light}, bent);
      own.push_back(timed.frame);
      setting.setup_seconds += timed.setup_seconds;
      setting.seconds_per_sample += timed.seconds;
      samples += static_cast<double>(timed.frame.pixel_count()) * timed.frame.spp;
      ++pictures;
      return compare(timed.frame, reference()[picture], unchanged[picture], levels);
    };
    std::size_t picture = 0;
    for (const double sharpness : kSharpnesses) {
      std::vector<std::vector<Sums>> levels(kLevels);  // [level][pair]
      for (std::size_t pair = 0; pair < std::size(kPairs); ++pair) {
        const std::vector<Sums> sums = compare_with(
            picture++, swatch_->camera(pair), light_of(sharpness, kPairs[pair]), false, kLevels);
        for (std::size_t level = 0; level < kLevels; ++level) levels[level].push_back(sums[level]);
      }
      for (const std::vector<Sums>& of_pairs : levels) {
        for (std::size_t height = 0; height < kHeights; ++height) {
          setting.entries.push_back(
              accuracy_of(std::span(of_pairs).subspan(height * kPairsOfHeight, kPairsOfHeight)));
        }
      }
      std::vector<Sums> bent;
      for (std::size_t pair = 0; pair < std::size(kBentPairs); ++pair, ++picture) {
        const Camera camera = Swatch::bent_camera(pair, swatch_->effort().bent_pixels);
        bent.push_back(
            compare_with(picture, camera, light_of(sharpness, kBentPairs[pair]), true, 1)[0]);
      }
      setting.bent.push_back(accuracy_of(bent));
    }
    setting.setup_seconds /= static_cast<double>(pictures);
    setting.seconds_per_sample /= samples;
    table_.settings.push_back(std::move(setting));
    ++done_;
  }

  /// Light from fold to fold, which the reference lacks: `render` does not. After the reference.
  void add_between(const RenderSwatch& render) {
    std::size_t picture = 0;
    for (const double sharpness : kSharpnesses) {
      picture += std::size(kPairs);
      std::vector<Sums> bent;
      for (std::size_t pair = 0; pair < std::size(kBentPairs); ++pair, ++picture) {
        const FrameBuffers all = render(Swatch::bent_camera(pair, swatch_->effort().bent_pixels),
                                        {light_of(sharpness, kBentPairs[pair])}, true)
                                     .frame;
        bent.push_back(compare(reference()[picture], all, all, 1)[0]);
      }
      table_.bent_between.push_back(accuracy_of(bent).bias_square);
    }
    double sum = 0;
    for (std::size_t pair = 0; pair < std::size(kBentPairs); ++pair) {
      sum += mean_square_enclosure(Swatch::bent_camera(pair, swatch_->effort().bent_pixels),
                                   swatch_->scene(true));
    }
    table_.bent_enclosure_square = sum / static_cast<double>(std::size(kBentPairs));
  }

  /// Colour of the cloth, and what shines through it: directional light from the face, and from
  /// behind. After the reference.
  void add_through(const RenderSwatch& render) {
    Rgbd front = Rgbd::Zero();
    Rgbd behind = Rgbd::Zero();
    const std::size_t first = reference().size() - std::size(kPairs) - std::size(kBentPairs);
    for (std::size_t pair = 0; pair < std::size(kPairs); ++pair) {
      const Light light = light_of(kDirectionalSharpness, from_behind(kPairs[pair]));
      front += sum_of(reference()[first + pair]);
      behind += sum_of(render(swatch_->camera(pair), {light}, false).frame);
    }
    if (!(front.mean() > 0)) return;  // black cloth
    table_.color = front / front.mean();
    table_.through = behind.mean() / front.mean();
  }

  AccuracyTable take() { return std::move(table_); }

 private:
  static constexpr double kShots =
      static_cast<double>(std::size(kSharpnesses) * (std::size(kPairs) + std::size(kBentPairs)));

  const std::vector<FrameBuffers>& reference() const { return frames_.at("path"); }

  static Rgbd sum_of(const FrameBuffers& frame) {
    Rgbd sum = Rgbd::Zero();
    for (const Rgb& value : frame.beauty) sum += value.cast<double>();
    return sum;
  }

  /// Mean over pairs of view and light of what is relative to each one's own mean radiance: a scene
  /// shows one or few of them. What another pair may show differs from the mean by as much as these
  /// do from each other.
  static Accuracy accuracy_of(std::span<const Sums> pairs) {
    const auto n = static_cast<double>(pairs.size());
    Accuracy result{0, 0, 0, 0, Rgbd::Zero()};
    Rgbd picture = Rgbd::Zero();
    Rgbd reference = Rgbd::Zero();
    double squares = 0;
    double noise = 0;
    for (const Sums& sums : pairs) {
      const double mean = sums.reference.mean() / sums.count;
      const double scale = mean > 0 ? 1 / (sums.count * mean * mean) : 0;
      result.bias_square += sums.bias * scale / n;
      result.noise_square += sums.variance * scale / n;
      result.change_square += sums.change * scale / n;
      squares += sums.bias * scale * sums.bias * scale / n;
      noise +=
          scale * scale * std::max(0.0, sums.bias_squares - sums.bias * sums.bias / sums.count);
      picture += sums.picture;
      reference += sums.reference;
    }
    const double spread =
        std::max(0.0, squares - result.bias_square * result.bias_square) * n / (n - 1);
    result.bias_square_error = std::sqrt(std::max(spread * (1 + 1 / n), noise / (n * n)));
    result.color_ratio = (reference > 0).select(picture / reference, 1.0);
    return result;
  }

  const Swatch* swatch_;
  const AccuracyProgress* progress_;
  std::size_t steps_;
  std::size_t done_ = 0;
  // of settings: [light][pair, bent pair]
  std::map<std::string, std::vector<FrameBuffers>> frames_;
  AccuracyTable table_;
};

const RenderProgress kSilent = [](double) {};

/// `local`: without light from fold to fold, which the precomputed methods do not claim to compute.
RenderSwatch paths(const Swatch& swatch, int flat_samples, int max_scatterings, bool local = true) {
  return [&swatch, flat_samples, max_scatterings, local](
             const Camera& camera, const std::vector<Light>& lights, bool bent) {
    const int samples = flat_samples * (bent ? swatch.effort().bent_factor : 1);
    PathTracerSettings settings;
    settings.seed = swatch.seed();
    settings.local = bent && local;
    if (max_scatterings > 0) settings.limits.max_scatterings = max_scatterings;
    TimedFrame timed;
    const Stopwatch setup;
    const std::vector<BcsdfTable> materials = scene_materials(swatch.scene(bent));
    const PathTracer tracer(swatch.scene(bent), materials, lights, Rgb(0, 0, 0), settings);
    timed.setup_seconds = setup.elapsed().seconds;
    const Stopwatch watch;
    timed.frame =
        trace_picture(tracer, camera, camera.full_frame(), settings.seed, {samples, {}}, kSilent);
    timed.seconds = watch.elapsed().seconds;
    return timed;
  };
}

RenderSwatch precomputed(const Swatch& swatch, const FabricPack& pack,
                         const PrecomputedSettings& settings) {
  return [&swatch, &pack, settings](const Camera& camera, const std::vector<Light>& lights,
                                    bool bent) {
    TimedFrame timed;
    const FabricPack* packs[] = {&pack};
    const Stopwatch setup;
    const PrecomputedRenderer renderer(swatch.scene(bent), packs, lights, Rgb(0, 0, 0), settings);
    timed.setup_seconds = setup.elapsed().seconds;
    const Stopwatch watch;
    timed.frame = shade_picture(
        renderer, camera, camera.full_frame(),
        swatch.effort().method_samples * (bent ? swatch.effort().bent_factor : 1), kSilent);
    timed.seconds = watch.elapsed().seconds;
    return timed;
  };
}

}  // namespace

std::string order_setting(int order) {
  return fmt::format("order {}", order);
}
std::string cells_setting(double factor) {
  return fmt::format("cells x {:g}", factor);
}
std::string voxels_setting(double factor) {
  return fmt::format("voxels x {:g}", factor);
}
std::string surface_setting(const std::string& surface) {
  return "surface " + surface;
}

AccuracyTable measure_accuracy(AccuracyData& data, std::uint64_t seed,
                               const AccuracyProgress& progress, const AccuracyEffort& effort) {
  FabricPack& pack = data.pack;
  Swatch swatch(pack.exemplar, seed, effort);
  swatch.use_fibers(std::make_shared<const TileScene>(pack.exemplar));
  const int order = pack.transfer->order;
  const auto lower_orders = std::count_if(std::begin(kOtherOrders), std::end(kOtherOrders),
                                          [&](int other) { return other < order; });
  TableMaker maker(
      swatch, 7 + static_cast<std::size_t>(lower_orders) + data.cells.size() + data.voxels.size(),
      progress);
  PrecomputedSettings usual;
  usual.seed = seed;
  const auto with = [&](auto&& change) {
    PrecomputedSettings settings = usual;
    change(settings);
    return precomputed(swatch, pack, settings);
  };
  maker.add("path", paths(swatch, effort.path_samples, 0));
  maker.add_through(paths(swatch, effort.path_samples, 0));
  maker.add_between(paths(swatch, effort.path_samples, 0, false));
  maker.add("path-6", paths(swatch, effort.method_samples, 6));
  maker.add("dual-scattering",
            with([](auto& settings) { settings.method = RenderMethod::kDualScattering; }));
  maker.add("exact", precomputed(swatch, pack, usual));
  maker.add("volume", with([](auto& settings) { settings.method = RenderMethod::kVolume; }),
            "exact");
  maker.add(kDistanceSetting, with([](auto& settings) { settings.blend = kSignedDistanceOnly; }),
            "exact");
  maker.add(kGaussiansSetting, with([](auto& settings) { settings.blend = kLobesOnly; }), "exact");
  // Settings of the data: the other data take the place of the pack's while a setting is measured.
  const Transfer own = *pack.transfer;
  for (const int other : kOtherOrders) {
    if (other >= order) continue;
    pack.transfer = cut_to_order(own, other);
    maker.add(order_setting(other), precomputed(swatch, pack, usual), "exact");
  }
  for (auto& [factor, transfer] : data.cells) {
    pack.transfer = transfer;
    maker.add(cells_setting(factor), precomputed(swatch, pack, usual), "exact");
  }
  pack.transfer = own;
  for (auto& [factor, volume] : data.voxels) {
    std::swap(*pack.volume, volume);
    maker.add(voxels_setting(factor),
              with([](auto& settings) { settings.method = RenderMethod::kVolume; }), "volume");
    std::swap(*pack.volume, volume);
  }
  return maker.take();
}

AccuracyTable measure_surface_accuracy(const Exemplar& exemplar, const SurfaceFabric& surface,
                                       std::uint64_t seed, const AccuracyProgress& progress,
                                       const AccuracyEffort& effort) {
  Swatch swatch(exemplar, seed, effort);
  TableMaker maker(swatch, 2, progress);
  swatch.use_fibers(std::make_shared<const TileScene>(exemplar));
  maker.add("path", paths(swatch, effort.path_samples, 0));
  swatch.use_surface(surface);
  maker.add(surface_setting(surface.name), paths(swatch, effort.method_samples, 0));
  return maker.take();
}

}  // namespace heddle
