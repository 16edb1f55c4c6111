#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>
#include <set>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "formats/seal_json.h"
#include "pipeline/chart/chart.h"
#include "pipeline/chart/chart_page.h"
#include "pipeline/commands.h"
#include "pipeline/interrupt.h"
#include "pipeline/job.h"
#include "pipeline/picture_request.h"
#include "pipeline/sealed_json.h"
#include "pipeline/version.h"
#include "render/flip.h"
#include "render/render_output.h"
#include "render/tone_map.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A chart takes an hour, not a night, on two cores with pictures of this width.
constexpr int kDefaultWidth = 96;

// Shorter renderings are repeated, up to kRepeats times in all, and the shortest time counts:
// disturbances only make a measurement longer.
constexpr double kLongEnough = 1.0;  // s
constexpr int kRepeats = 3;

// Blocks of pixels for the intervals. There are enough of them that 1.96 standard errors are 95 %.
// They are no larger than the noise that neighbours share.
constexpr int kBlocks = 48;
constexpr int kLargestBlock = 8;

std::string processor_name() {
  std::ifstream stream("/proc/cpuinfo");
  for (std::string line; std::getline(stream, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

struct Picture {
  std::vector<Rgb> colors;
  std::vector<Rgb> half0;  // references only
  std::vector<Rgb> half1;
};

class ChartMaker {
 public:
  ChartMaker(const ChartOptions& options, StageContext& context, fs::path runs)
      : options_(&options),
        context_(&context),
        runs_(std::move(runs)),
        processor_(processor_name()) {
    make_folder(runs_);
    require_writable(runs_ / "picture.exr");  // before hours of work
    require_writable(options.output / "chart.csv");
    use_variant({});
    const SceneConfig& scene = job_->config();
    const ViewConfig& view = find_view(scene, options.view);
    base_ = job_->request(view);
    base_.crop = choose_frame(base_.camera);
    chart_.scene = scene.name;
    chart_.scene_file = options.scene.generic_string();
    chart_.view = view.name;
    chart_.width = base_.camera.width;
    chart_.height = base_.camera.height;
    chart_.crop = base_.crop;
    chart_.processor = processor_;
    chart_.threads = working_threads();
  }

  Chart make() {
    const std::vector<ChartRun> runs = chart_runs(
        job_->config(), base_, {.quick = options_->quick, .spp = options_->quick ? 4 : 64});
    for (const ReferenceKind kind : kReferenceKinds) make_reference(kind);
    const std::vector<std::string>& wanted = options_->methods;
    for (const ChartRun& run : runs) {
      const char* method = render_method_name(run.request.method);
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), method) == wanted.end())
        continue;
      stop_if_interrupted();
      chart_.rows.push_back(make_row(run));
      say(chart_.rows.back());
    }
    mark_fronts(chart_);
    return std::move(chart_);
  }

 private:
  /// The camera of the chart's pictures, and the part of its frame that they show.
  PixelRect choose_frame(CameraConfig& camera) const {
    const double aspect = static_cast<double>(camera.height) / camera.width;
    const auto height_of = [aspect](int width) {
      return std::max(1, static_cast<int>(std::lround(width * aspect)));
    };
    const auto width_of = [aspect](int height) {
      return std::max(1, static_cast<int>(std::lround(height / aspect)));
    };
    if (options_->width || options_->height) {
      const int width = options_->width.value_or(width_of(options_->height.value_or(0)));
      camera.height = options_->height.value_or(height_of(width));
      camera.width = width;
    } else if (options_->crop.empty() && camera.width > kDefaultWidth) {
      camera.height = height_of(kDefaultWidth);
      camera.width = kDefaultWidth;
    }
    const PixelRect crop = options_->crop.empty() ? PixelRect{0, 0, camera.width, camera.height}
                                                  : parse_crop(options_->crop, camera);
    if (crop.width * crop.height < 4)
      throw ConfigError("chart: expected a picture of at least 4 pixels");
    return crop;
  }

  void use_variant(const SceneVariant& variant) {
    if (job_ && variant == variant_) return;
    job_.reset();  // one at a time in memory
    job_ = std::make_unique<SceneJob>(options_->scene, *context_, variant);
    variant_ = variant;
  }

  fs::path file(const std::string& name) const { return runs_ / name; }
  static fs::path in_folder(const std::string& name) { return fs::path("runs") / name; }

  /// An earlier chart's record of a picture, if this chart may use it: same program, same machine.
  std::optional<Json> earlier_record(const std::string& key) const {
    const fs::path record_file = file(key + ".json");
    const bool may = options_->resume || made_.contains(key);
    if (!may || !fs::exists(record_file)) return {};
    try {
      Json record = read_sealed_json(record_file);
      const bool same_machine = record.at("threads") == working_threads() &&
                                record.at("processor") == processor_ &&
                                record.at("program_version") == kProgramVersion;
      if (!same_machine) return {};
      verify_seal(file(key + ".exr"), seal_of(record.at("picture")),
                  record_file.filename().string());
      return record;
    } catch (const FileError& error) {
      context_->console->warn(fmt::format("{}; rendered again", error.what()));
      return {};
    }
  }

  /// Renders a picture, or finds it; returns its record, which is written last.
  Json provide(const PictureRequest& request, const std::string& key, const std::string& title,
               bool repeat) {
    if (std::optional<Json> record = earlier_record(key)) return *record;
    WorkTime best;
    WorkTime spent;
    PictureResult picture;
    for (int n = 0; n < (repeat ? kRepeats : 1) && (n == 0 || spent.seconds < kLongEnough); ++n) {
      picture = job_->render(request, title, true);  // a chart drives methods past their limits
      if (n == 0 || picture.time.seconds < best.seconds) best = picture.time;
      spent = spent + picture.time;
    }
    write_png(file(key + ".png"), picture.image.width, picture.image.height,
              tone_map(layer_of(picture.image, "", key), {}));
    write_exr(file(key + ".exr"), picture.image);
    Json record = {{"key", key},
                   {"picture", json_of(seal_of_file(file(key + ".exr")))},
                   {"program_version", kProgramVersion},
                   {"processor", processor_},
                   {"threads", working_threads()},
                   {"render_seconds", best.seconds},
                   {"render_core_seconds", best.core_seconds},
                   {"report", picture_report(picture)}};
    write_sealed_json(file(key + ".json"), record);
    made_.insert(key);
    return record;
  }

  void make_reference(ReferenceKind kind) {
    ChartReference& reference = chart_.references[static_cast<std::size_t>(kind)];
    reference.request = base_;
    reference.request.method = RenderMethod::kPath;
    reference.request.spp = options_->reference_spp;
    reference.request.local = kind == ReferenceKind::kLocal;
    // Not the runs' own random numbers: errors would look smaller than they are.
    reference.request.seed = base_.seed + 1;
    reference.key = job_->picture_key(reference.request);
    const Json record = provide(reference.request, reference.key,
                                fmt::format("{} reference", reference_name(kind)), false);
    reference.seconds = record.at("render_seconds").get<double>();
    reference.core_seconds = record.at("render_core_seconds").get<double>();
    reference.picture = in_folder(reference.key + ".png");
    Picture& picture = expected_[static_cast<std::size_t>(kind)];
    const Image image = read_exr(file(reference.key + ".exr"));
    picture = {layer_of(image, "", reference.key), layer_of(image, "half0", reference.key),
               layer_of(image, "half1", reference.key)};
    reference.noise = reference_noise({picture.half0, picture.half1});
    reference.flip_between_halves =
        flip_error(picture.half0, picture.half1, chart_.crop.width, chart_.crop.height);
    context_->console->say(fmt::format(
        "{} reference: {} spp in {}, noise {:.2f} %", reference_name(kind), reference.request.spp,
        duration_text(reference.seconds), 100 * reference.noise.rms));
  }

  ChartRow make_row(const ChartRun& run) {
    ChartRow row;
    row.run = run;
    row.program_version = kProgramVersion;
    row.threads = working_threads();
    try {
      use_variant(run.variant);
      row.stages = job_->precompute_costs(run.request);
      add_precompute(row);
      row.key = job_->picture_key(run.request);
      const Json record =
          provide(run.request, row.key, fmt::format("{}, {}", run.method, run.label), true);
      row.render_seconds = record.at("render_seconds").get<double>();
      row.render_core_seconds = record.at("render_core_seconds").get<double>();
      row.picture = in_folder(row.key + ".png");
      const std::vector<Rgb> colors = layer_of(read_exr(file(row.key + ".exr")), "", row.key);
      for (const ReferenceKind kind : kReferenceKinds) compare(kind, colors, row);
    } catch (const Interrupted&) {
      throw;
    } catch (const std::bad_alloc&) {
      row.message = "memory ran out";
    } catch (const std::exception& error) {
      row.message = error.what();
    }
    return row;
  }

  static void add_precompute(ChartRow& row) {
    double seconds = 0;
    double core_seconds = 0;
    for (const StageCost& cost : row.stages) {
      if (cost.seconds < 0) return;
      seconds += cost.seconds;
      core_seconds += cost.core_seconds;
    }
    row.precompute_seconds = seconds;
    row.precompute_core_seconds = core_seconds;
  }

  void compare(ReferenceKind kind, const std::vector<Rgb>& colors, ChartRow& row) const {
    const auto k = static_cast<std::size_t>(kind);
    const Picture& expected = expected_[k];
    const int width = chart_.crop.width;
    const int height = chart_.crop.height;
    const int edge =
        std::clamp(static_cast<int>(std::sqrt(width * height / kBlocks)), 1, kLargestBlock);
    const auto is_finite = [](const Rgb& color) { return color.isFinite().all(); };
    if (!std::all_of(colors.begin(), colors.end(), is_finite))
      throw std::runtime_error("the picture holds NaN or infinity");
    row.error[k].estimate =
        estimate_error(colors, {expected.half0, expected.half1}, width, height, edge);
    row.error[k].flip = flip_error(colors, expected.colors, width, height);
    double mean = 0;
    for (const Rgb& color : expected.colors) mean += static_cast<double>(color.mean());
    mean /= static_cast<double>(expected.colors.size());
    const std::string name = fmt::format("{}-{}.png", row.key, reference_name(kind));
    write_png(file(name), width, height,
              difference_picture(colors, expected.colors, mean > 0 ? mean : 1));
    row.difference[k] = in_folder(name);
  }

  void say(const ChartRow& row) const {
    const std::string name = fmt::format("{}, {}", row.run.method, row.run.label);
    if (!row.done()) {
      context_->console->warn(fmt::format("{}: failed: {}", name, row.message));
      return;
    }
    if (!row.precompute_seconds) {
      context_->console->warn(fmt::format(
          "{}: the cache does not say how long its data took; total time left out", name));
    }
    const PictureErrorEstimate& estimate = row.error[0].estimate;
    context_->console->say(fmt::format("{}: {:.3g} s, relative RMSE {:.2f} % ({:.2f} to {:.2f})",
                                       name, row.render_seconds, 100 * estimate.relative_rmse,
                                       100 * estimate.rmse_low, 100 * estimate.rmse_high));
  }

  const ChartOptions* options_;
  StageContext* context_;
  fs::path runs_;
  std::string processor_;
  SceneVariant variant_;
  std::unique_ptr<SceneJob> job_;
  PictureRequest base_;
  Picture expected_[2];         // [ReferenceKind]
  std::set<std::string> made_;  // keys of pictures that this chart has made
  Chart chart_;
};

}  // namespace

int chart_command(const ChartOptions& options, const CommonOptions& common) {
  if (options.reference_spp % 2 != 0) {
    throw ConfigError("--reference-spp: expected an even number: a reference keeps two halves");
  }
  Job job(common);
  ChartMaker maker(options, job.context(), options.output / "runs");
  const Chart chart = maker.make();
  const auto write = [&](const char* name, const std::string& text) {
    write_file_atomically(options.output / name, text);
    job.add_artifact(options.output / name);
  };
  write("chart.csv", chart_csv(chart));
  write("chart.json", chart_json(chart).dump(2) + "\n");
  write("chart.svg", chart_svg(chart, ReferenceKind::kFull));
  write("chart-local.svg", chart_svg(chart, ReferenceKind::kLocal));
  write("index.html", chart_html(chart, options.output));
  job.finish();
  return std::any_of(chart.rows.begin(), chart.rows.end(),
                     [](const ChartRow& row) { return row.done(); })
             ? 0
             : 1;
}

}  // namespace heddle
