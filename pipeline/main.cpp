// The program `heddle`: its subcommands, their options, and what an error becomes (message on
// standard error, exit status).

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "formats/input_error.h"
#include "formats/memory_need.h"
#include "pipeline/cache.h"
#include "pipeline/commands.h"
#include "pipeline/eval/eval.h"
#include "pipeline/interrupt.h"
#include "pipeline/version.h"
#include "render/scene_config.h"

namespace heddle {
namespace {

std::vector<std::string> method_names() {
  const std::vector<std::string_view> names = render_method_names();
  return {names.begin(), names.end()};
}

constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

/// "i/n", counted from 1.
Shard parse_shard(const std::string& text) {
  Shard shard;
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) {
    const char* middle = text.data() + slash;
    const char* end = text.data() + text.size();
    const auto index = std::from_chars(text.data(), middle, shard.index);
    const auto count = std::from_chars(middle + 1, end, shard.count);
    if (index.ec == std::errc{} && index.ptr == middle && count.ec == std::errc{} &&
        count.ptr == end && shard.index >= 1 && shard.index <= shard.count) {
      --shard.index;
      return shard;
    }
  }
  throw ConfigError("--shard: expected i/n with 1 <= i <= n, for example 1/4; got \"" + text +
                    "\"");
}

/// The options of all subcommands; each subcommand offers those that mean something to it.
struct Options {
  CommonOptions common;
  int threads = 0;
  StageOptions stage;
  std::string shard;
  std::filesystem::path path;
  RenderOptions render;
  RelightOptions relight;
  CompareOptions compare;
  ChartOptions chart;
  RunOptions run;
  SwatchOptions swatch;
  CatalogueOptions catalogue;
  ExportOptions exported;
  PlanOptions plan;
};

void add_common(CLI::App& command, Options& options) {
  command.add_option("-j,--threads,--nthreads", options.threads, "Threads; all cores by default")
      ->check(CLI::Range(1, 4096));
  command.add_flag("-q,--quiet", options.common.quiet, "No messages but warnings and errors");
  command.add_flag("--json", options.common.json, "A report for programs on standard output");
}

void add_building(CLI::App& command, Options& options) {
  add_common(command, options);
  command.add_option("--cache", options.common.cache,
                     "Folder of the artifacts; by default $HEDDLE_CACHE, else out/cache");
}

/// Of commands that work on a fabric.
void add_fabric_seed(CLI::App& command, Options& options) {
  command.add_option("--seed", options.common.fabric_seed,
                     "In place of the fabric's seed, which draws its fibers");
}

/// Of commands that make pictures of a scene.
void add_picture_seed(CLI::App& command, Options& options) {
  command.add_option("--seed", options.common.picture_seed,
                     "In place of the scene's seed, which draws the noise of its pictures; fabrics "
                     "keep their own seeds");
}

void add_order(CLI::App& command, std::optional<int>& order) {
  command.add_option("--order", order, "Highest SH band of the transfer, in place of the fabric's")
      ->check(CLI::Range(0, 5));
}

template <class Tolerance>
CLI::Option* add_tolerance(CLI::App& command, int& pictures, const std::string& help,
                           Tolerance& tolerance) {
  command
      .add_option(
          "--pictures", pictures,
          "With --tolerance: how many pictures share the data, such as the frames of a shot; "
          "1 by default")
      ->check(CLI::Range(1, 1 << 20));
  return command.add_option("--tolerance", tolerance, help)->check(CLI::Range(1e-6, 100.0));
}

void add_stage_command(CLI::App& app, Options& options, const std::string& name,
                       const std::string& help, StageTarget target, bool with_shard) {
  CLI::App* command = app.add_subcommand(name, help);
  add_building(*command, options);
  add_fabric_seed(*command, options);
  command->add_option("FABRIC.toml", options.stage.fabric, "Fabric config")->required();
  if (target == StageTarget::kTransfer || target == StageTarget::kFar ||
      target == StageTarget::kPack)
    add_order(*command, options.stage.order);
  if (target == StageTarget::kPack) {
    command->add_option("-o,--output,--outfile", options.stage.output,
                        "Folder for a copy of the pack outside the cache");
    command->add_flag("--dry-run", options.stage.dry_run,
                      "Only say what is missing, and what memory and time it would take");
  }
  if (target == StageTarget::kSynth) {
    command->add_option("--preview", options.stage.preview,
                        "A shaded picture of the tile, a .png: quick, without scattered light");
  }
  if (with_shard) {
    command->add_option(
        "--shard", options.shard,
        "i/n: compute only every n-th chunk, leave it in the cache, publish nothing");
  }
  command->callback([&options, target] { options.stage.target = target; });
}

/// What a signal leaves of a command's work, as a sentence for users.
const char* kept_after_signal(const std::string& command) {
  constexpr char kStages[] =
      "finished stages and chunks are kept in the cache, and the same command goes on from them";
  constexpr char kMeasurement[] =
      "the measurement is lost; finished stages and chunks are kept in the cache";
  constexpr char kNothing[] = "nothing was written";
  static const std::map<std::string, const char*> kept = {
      {"accuracy", kMeasurement},
      {"chart",
       "finished pictures are kept in the chart's folder runs, and the same command with --resume "
       "goes on from them; finished stages and chunks are kept in the cache"},
      {"catalogue", "finished pictures are kept in the folder; fibers are kept in the cache"},
      {"check", kNothing},
      {"compare", kNothing},
      {"eval", "the answers printed so far are complete"},
      {"export", kNothing},
      {"far", kStages},
      {"info", kNothing},
      {"pack", kStages},
      {"plan", kMeasurement},
      {"precompute", kStages},
      {"relight", "the picture is lost; what it comes from is kept"},
      {"render",
       "the picture is lost; finished stages and chunks of its fabrics are kept in the cache"},
      {"run",
       "finished pictures, stages and chunks are kept in the cache, and the same command goes on "
       "from them; a picture that was being rendered is lost"},
      {"render --frames",
       "finished frames are kept, and the same command with --resume goes on from them; finished "
       "stages and chunks of its fabrics are kept in the cache"},
      {"swatch", "the picture is lost; the fibers are kept in the cache"},
      {"synth", kStages},
      {"transfer", kStages},
      {"visibility", kStages},
  };
  return kept.at(command);
}

void add_view(CLI::App& command, std::string& view) {
  command.add_option("--view", view,
                     "Name of one of the scene's [[view]] tables; its [camera] by default");
}

/// crop: x0, y0, x1, y1.
void add_crop(CLI::App& command, std::vector<int>& crop) {
  command.add_option("--crop,--cropwindow", crop, "x0,y0,x1,y1 in pixels, x1 and y1 excluded")
      ->delimiter(',')
      ->expected(4);
}

/// What each command does, by its name.
using Actions = std::map<std::string, std::function<int()>>;

void add_run(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* run = app.add_subcommand(
      "run", "Build everything that a scene lacks, then render its pictures: the main job");
  add_building(*run, options);
  add_picture_seed(*run, options);
  run->add_option("SCENE.toml", options.run.scene, "Scene config")->required();
  run->add_option("-o,--output,--outfile", options.run.output,
                  "Folder of the pictures; out/NAME by default");
  add_order(*run, options.run.order);
  actions["run"] = [&options] { return run_command(options.run, options.common); };
}

/// One command for each stage, and for all up to the pack.
void add_stages(CLI::App& app, Options& options, Actions& actions) {
  add_stage_command(app, options, "precompute", "All stages of a fabric up to its pack",
                    StageTarget::kPack, false);
  add_stage_command(app, options, "synth", "Fibers of a fabric", StageTarget::kSynth, false);
  add_stage_command(app, options, "visibility", "Visibility of every segment",
                    StageTarget::kVisibility, true);
  add_stage_command(app, options, "transfer", "Indirect light transfer of every cell",
                    StageTarget::kTransfer, true);
  add_stage_command(app, options, "far", "The fabric as seen from afar", StageTarget::kFar, false);
  add_stage_command(app, options, "pack", "The folder that a renderer opens", StageTarget::kPack,
                    false);
  add_stage_command(app, options, "accuracy",
                    "Errors and times of the methods on a fabric: the table behind plans",
                    StageTarget::kAccuracy, false);
  for (const char* name :
       {"precompute", "synth", "visibility", "transfer", "far", "pack", "accuracy"}) {
    actions[name] = [&options] {
      if (!options.shard.empty()) options.stage.shard = parse_shard(options.shard);
      return stage_command(options.stage, options.common);
    };
  }
}

/// Of commands that draw fabrics without a scene.
void add_picture_size(CLI::App& command, int& pixels, int& spp) {
  command
      .add_option("--pixels", pixels,
                  "Along each side of a picture; " + std::to_string(pixels) + " by default")
      ->check(CLI::Range(1, 4096));
  command.add_option("--spp", spp, "Samples per pixel; " + std::to_string(spp) + " by default")
      ->check(CLI::Range(2, 1 << 20));
}

void add_swatch(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* swatch =
      app.add_subcommand("swatch", "A path-traced picture of a fabric, no scene needed");
  SwatchOptions& asked = options.swatch;
  add_building(*swatch, options);
  add_fabric_seed(*swatch, options);
  swatch->add_option("FABRIC.toml", asked.fabric, "Fabric config")->required();
  swatch->add_option("-o,--output,--outfile", asked.output, "The .png")->required();
  swatch->add_option("--width-mm", asked.width_mm, "Cloth across the picture; 4 by default")
      ->check(CLI::Range(0.01, 1000.0));
  add_picture_size(*swatch, asked.pixels, asked.spp);
  actions["swatch"] = [&options] { return swatch_command(options.swatch, options.common); };
}

void add_catalogue(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* catalogue =
      app.add_subcommand("catalogue", "A page of fabrics: pictures near and far, and figures");
  CatalogueOptions& asked = options.catalogue;
  add_building(*catalogue, options);
  catalogue->add_option("FABRIC.toml", asked.fabrics, "Fabric configs")->required();
  catalogue->add_option("-o,--output,--outfile", asked.output, "Folder of the page")->required();
  add_picture_size(*catalogue, asked.pixels, asked.spp);
  actions["catalogue"] = [&options] {
    return catalogue_command(options.catalogue, options.common);
  };
}

void add_render(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* render = app.add_subcommand("render", "One picture of a scene, or one per frame");
  RenderOptions& picture = options.render;
  add_building(*render, options);
  add_picture_seed(*render, options);
  render->add_option("SCENE.toml", picture.scene, "Scene config")->required();
  render
      ->add_option("-o,--output,--outfile", picture.output,
                   "The .exr file; a .png and a .json go beside it")
      ->required();
  add_view(*render, picture.view);
  render->add_option("--frames", picture.frames,
                     "first-last: one picture per frame, with its number in place of the #### of "
                     "the output's name, and a contact sheet");
  render->add_flag("--resume", picture.resume,
                   "With --frames: keep frames that are finished and would come out the same");
  render->add_option("--method", picture.method, "In place of the scene's")
      ->check(CLI::IsMember(method_names()));
  render->add_option("--spp", picture.spp, "Samples per pixel, in place of the scene's")
      ->check(CLI::Range(1, 1 << 24));
  render->add_option("--seconds", picture.seconds, "Path tracer: render for this many seconds")
      ->check(CLI::PositiveNumber);
  render
      ->add_option("--noise", picture.noise,
                   "Samples are added until the noise of every 16 x 16 pixels, relative to their "
                   "mean, is so low: 0.05 is 5 %")
      ->check(CLI::Range(1e-4, 10.0));
  add_crop(*render, picture.crop);
  render->add_flag("--local", picture.local, "Path tracer: paths that leave the cloth's shell end");
  render
      ->add_option("--bounces", picture.bounces,
                   "Path tracer: most scattering events; no limit by default")
      ->check(CLI::Range(1, 4096));
  render->add_option("--estimator", picture.estimator, "Path tracer: how lights are sampled")
      ->check(CLI::IsMember({"mis", "light", "bcsdf"}));
  render
      ->add_option("--keep", picture.keep,
                   "Also writes a .gbuffer beside the picture, which `relight` takes: rays, what "
                   "the eye rays see; or light, that and the light of each group")
      ->check(CLI::IsMember({"rays", "light"}));
  add_order(*render, picture.order);
  add_tolerance(
      *render, picture.pictures,
      "Largest relative RMSE per pixel, noise included; a plan chooses method, samples and data",
      picture.tolerance);
  actions["render"] = [&options] { return render_command(options.render, options.common); };
}

void add_relight(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* relight = app.add_subcommand(
      "relight", "A picture that was rendered with --keep, under other lights: no eye rays");
  add_building(*relight, options);
  relight->add_option("KEPT.gbuffer", options.relight.kept, "Written by render --keep")->required();
  relight
      ->add_option("SCENE.toml", options.relight.scene,
                   "Scene config that differs in its lights only")
      ->required();
  relight
      ->add_option("-o,--output,--outfile", options.relight.output,
                   "The .exr file; a .png and a .json go beside it")
      ->required();
  actions["relight"] = [&options] { return relight_command(options.relight, options.common); };
}

void add_eval(CLI::App& app, Actions& actions) {
  CLI::App* evaluate = app.add_subcommand(
      "eval", "JSON lines in, JSON lines out: any scattering model or basis function");
  evaluate->footer("Quantities and their fields: docs/eval.md");
  actions["eval"] = [] { return run_eval(std::cin, std::cout); };
}

void add_compare(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* compare =
      app.add_subcommand("compare", "Error metrics of picture A against the reference B");
  CompareOptions& pair = options.compare;
  add_common(*compare, options);
  compare->add_option("A.exr", pair.a, "Picture")->required();
  compare->add_option("B.exr", pair.b, "Reference")->required();
  compare->add_option("-o,--output,--outfile", pair.output,
                      "Difference picture: an .exr, and a .png beside it");
  compare->add_option("--layer", pair.layer,
                      "Layer to compare, such as single; the beauty by default");
  compare
      ->add_option("--max-rmse", pair.max_rmse, "Exit with status 1 if the relative RMSE is larger")
      ->check(CLI::NonNegativeNumber);
  compare
      ->add_option("--max-mean", pair.max_mean,
                   "Exit with status 1 if the mean colour is off by a larger share")
      ->check(CLI::NonNegativeNumber);
  actions["compare"] = [&options] { return compare_command(options.compare, options.common); };
}

void add_plan(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* plan =
      app.add_subcommand("plan", "The cheapest way to a picture that is good enough, and why");
  add_building(*plan, options);
  add_picture_seed(*plan, options);
  plan->add_option("SCENE.toml", options.plan.scene, "Scene config")->required();
  add_tolerance(*plan, options.plan.pictures,
                "Largest relative RMSE per pixel, noise included: 0.05 is 5 %",
                options.plan.tolerance)
      ->required();
  add_view(*plan, options.plan.view);
  add_crop(*plan, options.plan.crop);
  actions["plan"] = [&options] { return plan_command(options.plan, options.common); };
}

void add_chart(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* chart =
      app.add_subcommand("chart", "Speed against accuracy, over the methods and their settings");
  ChartOptions& asked = options.chart;
  add_building(*chart, options);
  add_picture_seed(*chart, options);
  chart->add_option("SCENE.toml", asked.scene, "Scene config")->required();
  chart->add_option("-o,--output,--outfile", asked.output, "Folder of the chart")->required();
  add_view(*chart, asked.view);
  chart
      ->add_option("--width", asked.width,
                   "Pixels; 96 if neither width nor height nor crop is given")
      ->check(CLI::Range(1, 16384));
  chart->add_option("--height", asked.height, "Pixels; by default from the view's shape")
      ->check(CLI::Range(1, 16384));
  add_crop(*chart, asked.crop);
  chart
      ->add_option("--reference-spp", asked.reference_spp,
                   "Samples per pixel of the two references, by default 1024")
      ->check(CLI::Range(2, 1 << 24));
  chart
      ->add_option("--methods", asked.methods,
                   "Only runs of these methods, separated by commas; all by default")
      ->delimiter(',')
      ->check(CLI::IsMember(method_names()));
  chart->add_flag("--quick", asked.quick,
                  "Few settings per method: for a first look, or to check that everything works");
  chart->add_flag("--resume", asked.resume,
                  "Keep what an earlier chart in the same folder has rendered and timed");
  actions["chart"] = [&options] { return chart_command(options.chart, options.common); };
}

void add_info(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* info =
      app.add_subcommand("info", "What a file holds: any of ours, or any that we read");
  add_common(*info, options);
  add_fabric_seed(*info, options);
  info->add_option(
          "PATH", options.path,
          "Fabric or scene .toml, pack, draft .wif, curves .bcc, .hair and .obj, .safetensors, "
          ".vdb, .exr, .hdr, .png, .obj, .gbuffer, or one of our .json files")
      ->required();
  actions["info"] = [&options] { return info_command(options.path, options.common); };
}

void add_export(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* command = app.add_subcommand(
      "export", "For other programs: the fibers of a tile as curves, or a material with its maps");
  add_common(*command, options);
  add_fabric_seed(*command, options);
  command
      ->add_option("INPUT", options.exported.input,
                   "Fabric .toml, its fibers .safetensors, or a pack")
      ->required();
  command
      ->add_option("-o,--output,--outfile", options.exported.output,
                   "File .hair, .bcc or .obj (lines); or a folder, for maps with a MaterialX and a "
                   "glTF material")
      ->required();
  command
      ->add_option("--pixels", options.exported.pixels,
                   "Of maps: texels along their longer side; 512 by default")
      ->check(CLI::Range(1, 4096));
  command->add_option("--spp", options.exported.spp, "Of maps: rays per texel; 64 by default")
      ->check(CLI::Range(2, 1 << 20));
  actions["export"] = [&options] { return export_command(options.exported, options.common); };
}

void add_check(CLI::App& app, Options& options, Actions& actions) {
  CLI::App* check =
      app.add_subcommand("check", "Checksums, versions, finite values and ranges of a pack");
  add_common(*check, options);
  check->add_option("PACK", options.path, "Folder with a manifest.json")->required();
  actions["check"] = [&options] { return check_command(options.path, options.common); };
}

/// Declares all subcommands.
Actions add_commands(CLI::App& app, Options& options) {
  Actions actions;
  add_run(app, options, actions);
  add_stages(app, options, actions);
  add_swatch(app, options, actions);
  add_catalogue(app, options, actions);
  add_render(app, options, actions);
  add_relight(app, options, actions);
  add_eval(app, actions);
  add_compare(app, options, actions);
  add_plan(app, options, actions);
  add_chart(app, options, actions);
  add_export(app, options, actions);
  add_info(app, options, actions);
  add_check(app, options, actions);
  return actions;
}

int main_program(int argc, char** argv) {
  CLI::App app{"Heddle: from a fabric description to pictures of cloth, down to single fibers"};
  app.set_version_flag("--version", std::string("heddle ") + kProgramVersion);
  app.require_subcommand(1);
  Options options;
  const Actions actions = add_commands(app, options);
  if (argc > 1 && argv[1][0] != '-' && !actions.contains(argv[1])) {
    std::string known;
    for (const auto& [name, action] : actions) known += " " + name;
    throw ConfigError(std::string("no subcommand ") + argv[1] + "; there are" + known);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::cerr << "heddle: " << error.what() << "\nRun with --help for the options.\n";
    return kWrongUsage;
  }
  if (options.common.cache.empty()) options.common.cache = default_cache_folder();
  std::unique_ptr<tbb::global_control> limit;
  if (options.threads > 0) {
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(options.threads));
  }
  const std::string command = app.get_subcommands().front()->get_name();
  const bool is_sequence = command == "render" && !options.render.frames.empty();
  watch_for_signals(kept_after_signal(is_sequence ? "render --frames" : command));
  const int status = actions.at(command)();
  std::cout.flush();
  if (!std::cout) throw FileError("standard output: cannot be written");
  return status;
}

struct ProgramEnd {
  int status;
  std::string message;  // empty where all is well
};

ProgramEnd run_program(int argc, char** argv) {
  try {
    return {main_program(argc, argv), ""};
  } catch (const Interrupted& interrupted) {
    return {interrupted.exit_status(), interrupted.what()};
  } catch (const ConfigError& error) {
    return {kWrongUsage, error.what()};
  } catch (const std::bad_alloc&) {
    return {kFailed, "memory ran out, " + memory_text(available_memory()) +
                         " are available now: a smaller picture or crop, fewer repeats of the "
                         "weave or fewer fibers need less"};
  } catch (const std::exception& error) {
    return {kFailed, error.what()};
  }
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  const heddle::ProgramEnd end = heddle::run_program(argc, argv);
  heddle::claim_end_of_process();
  if (!end.message.empty()) std::cerr << "heddle: " << end.message << '\n';
  return end.status;
}
