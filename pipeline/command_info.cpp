#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "fibers/baked/fabric_pack.h"
#include "formats/atomic_file.h"
#include "formats/chunk_file.h"
#include "formats/curve_file.h"
#include "formats/file_ending.h"
#include "formats/hdr_file.h"
#include "formats/id_volume_file.h"
#include "formats/image_file.h"
#include "formats/input_error.h"
#include "formats/obj_mesh.h"
#include "formats/tensor_file.h"
#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/commands.h"
#include "pipeline/draft_report.h"
#include "pipeline/fabric_report.h"
#include "pipeline/json_file.h"
#include "pipeline/kept_picture.h"
#include "pipeline/stages.h"
#include "render/kept_samples.h"
#include "render/render_output.h"
#include "render/scene_config.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Report = nlohmann::ordered_json;

Report describe_surface_fabric(const TomlTable& document) {
  read_surface_model(document);  // says what is wrong with it
  return {{"kind", "surface fabric config"}, {"model", document.string("model")}};
}

Report describe_scene(const TomlTable& document) {
  const SceneConfig scene = read_scene_config(document);
  Report report = {{"kind", "scene config"}, {"name", scene.name}};
  for (const ViewConfig& view : scene.views) {
    report["view." + (view.name.empty() ? std::string("camera") : view.name)] =
        fmt::format("{} x {} pixels, {} samples per pixel{}", view.camera.width, view.camera.height,
                    view.spp, view.reference ? ", with a path-traced reference" : "");
  }
  report["method"] = render_method_name(scene.method);
  report["lights"] = scene.lights.size();
  Report fabrics = Report::array();
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    const ClothConfig& cloth = scene.cloths[k];
    if (cloth.surface) fabrics.push_back(cloth.surface->name);
    for (const fs::path& file : fabric_files(cloth)) fabrics.push_back(file.string());
    if (cloth.pattern) {
      report[fmt::format("cloth {} pattern", k + 1)] = fmt::format(
          "{} x {} blocks of {} fabrics: {}", cloth.pattern->columns, cloth.pattern->rows,
          cloth.pattern->fabrics.size(), cloth.pattern->picture.string());
    }
  }
  report["fabrics"] = fabrics;
  return report;
}

const char* type_name(TensorType type) {
  switch (type) {
    case TensorType::kU8:
      return "U8";
    case TensorType::kU16:
      return "U16";
    case TensorType::kU32:
      return "U32";
    case TensorType::kU64:
      return "U64";
    case TensorType::kI32:
      return "I32";
    case TensorType::kF16:
      return "F16";
    case TensorType::kF32:
      return "F32";
    case TensorType::kF64:
      return "F64";
  }
  return "";
}

Report describe_tensors(const fs::path& path, const CommonOptions& common) {
  const TensorFile file = TensorFile::read(path);
  Report report = {{"kind", "tensor file"}};
  for (const auto& [key, value] : file.metadata()) report["metadata." + key] = value;
  for (const auto& [name, entry] : file.entries()) {
    report["tensor." + name] =
        fmt::format("{} [{}]", type_name(entry.type), fmt::join(entry.shape, "]["));
  }
  const auto kind = file.metadata().find("kind");
  if (kind != file.metadata().end() && kind->second == "fibers") {
    describe_exemplar(TileScene(read_exemplar(path)), common.fabric_seed.value_or(1), report);
  }
  return report;
}

/// Bytes of a pack's tensor file, less those of the tensors that all segments share.
std::uint64_t bytes_without_basis(const fs::path& path) {
  std::uint64_t bytes = fs::file_size(path);
  const TensorFile file = TensorFile::read(path);
  for (const auto& [name, entry] : file.entries()) {
    if (name == "mean" || name == "basis" || name == "axes") bytes -= entry.size;
  }
  return bytes;
}

Report describe_pack(const fs::path& folder) {
  const PackManifest manifest = read_verified_manifest(folder);
  Report report = {{"kind", "pack"}, {"name", manifest.name}, {"key", manifest.key}};
  report["program_version"] = manifest.program_version;
  report["light_from"] = manifest.light_from_both_sides ? "both" : "face";
  for (const auto& [name, file] : manifest.files)
    report["file." + name] = fmt::format("{} bytes, checksum holds", file.bytes);
  const FabricPack pack = load_pack(folder);
  describe_exemplar(TileScene(pack.exemplar), 1, report);
  std::uint64_t segment_bytes = 0;
  for (const char* name : {"fibers.safetensors", "ssdf.safetensors", "sg.safetensors"}) {
    if (manifest.files.contains(name)) segment_bytes += bytes_without_basis(folder / name);
  }
  report["bytes_per_segment"] = rounded(static_cast<double>(segment_bytes) /
                                        static_cast<double>(pack.exemplar.segment_count()));
  if (pack.transfer) {
    report["transfer_order"] = pack.transfer->order;
    report["cells"] = pack.transfer->cell_count();
    report["bytes_per_cell"] =
        rounded(static_cast<double>(manifest.files.at("transfer.safetensors").bytes) /
                static_cast<double>(pack.transfer->cell_count()));
  }
  return report;
}

void describe_volume(const IdVolume& volume, Report& report) {
  const auto filled =
      std::count_if(volume.ids.begin(), volume.ids.end(), [](std::int32_t id) { return id >= 0; });
  report["kind"] = "segment-id volume";
  report["voxels"] = fmt::format("{} x {} x {}", volume.size[0], volume.size[1], volume.size[2]);
  report["voxel_um"] = {rounded(1e3 * volume.voxel_mm[0]), rounded(1e3 * volume.voxel_mm[1]),
                        rounded(1e3 * volume.voxel_mm[2])};
  report["origin_mm"] = {rounded(volume.origin_mm[0]), rounded(volume.origin_mm[1]),
                         rounded(volume.origin_mm[2])};
  report["filled_share"] =
      rounded(static_cast<double>(filled) /
              static_cast<double>(std::max<std::size_t>(volume.ids.size(), 1)));
}

Report describe_vdb(const fs::path& path) {
  Report report;
  describe_volume(read_id_volume(path), report);
  report["checksum"] = "holds";
  return report;
}

Report describe_image(const Image& image) {
  Report report = {{"kind", "picture"}, {"resolution_px", {image.width, image.height}}};
  for (const auto& [key, value] : image.metadata) {
    // Names of a matte may be thousands.
    report["metadata." + key] =
        key.ends_with("/manifest") && value.size() > 200
            ? fmt::format("{} names", std::count(value.begin(), value.end(), ':'))
            : value;
  }
  const bool is_ours = image.metadata.contains("heddle.method");
  for (const auto& [name, channel] : image.channels) {
    const std::string meaning = is_ours ? channel_note(name) : "";
    const std::string note = meaning.empty() ? "" : "  (" + meaning + ")";
    if (channel.type == ChannelType::kUint) {
      report["channel." + name] = "UINT" + note;
      continue;
    }
    double sum = 0;
    float low = std::numeric_limits<float>::infinity();
    float high = -low;
    std::size_t not_finite = 0;
    for (const float value : channel.values) {
      if (!std::isfinite(value)) {
        ++not_finite;
        continue;
      }
      sum += value;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    const double count = static_cast<double>(channel.values.size() - not_finite);
    report["channel." + name] = fmt::format(
        "{}  mean {:.6g}  min {:.6g}  max {:.6g}{}{}",
        channel.type == ChannelType::kHalf ? "HALF" : "FLOAT", sum / std::max(count, 1.0), low,
        high, not_finite > 0 ? fmt::format("  {} values not finite", not_finite) : "", note);
  }
  return report;
}

Report describe_png(const fs::path& path) {
  const PngHeader header = read_png_header(path);
  Report report = {{"kind", "picture for the screen"},
                   {"resolution_px", {header.width, header.height}},
                   {"channels", header.channels}};
  for (const auto& [keyword, text] : read_png_text(path)) report["text." + keyword] = text;
  return report;
}

Report describe_chart(const nlohmann::json& chart) {
  Report report = {
      {"kind", "chart"},
      {"scene", chart.at("scene").at("name")},
      {"view", chart.at("scene").at("view")},
      {"resolution_px", {chart.at("picture").at("width"), chart.at("picture").at("height")}},
      {"program_version", chart.at("program_version")}};
  for (const nlohmann::json& row : chart.at("rows")) {
    const std::string name =
        "run." + row.at("method").get<std::string>() + ", " + row.at("label").get<std::string>();
    if (row.at("status") != "done") {
      report[name] = "failed: " + row.at("message").get<std::string>();
      continue;
    }
    report[name] = fmt::format("{:.3g} % in {:.3g} s of rendering",
                               100 * row.at("error").at("full").at("relative_rmse").get<double>(),
                               row.at("render_seconds").get<double>());
  }
  return report;
}

/// An object of ours whose entries say enough by themselves: the report of a picture, of a plan, of
/// an export, or the record of an artifact.
Report describe_entries(const char* kind, const nlohmann::json& object) {
  Report report = {{"kind", kind}};
  for (const auto& [name, value] : object.items()) report[name] = value;
  return report;
}

/// Errors: FileError for JSON that none of our commands writes.
Report describe_json(const fs::path& path) {
  const nlohmann::json json = read_json(path);
  try {
    if (json.is_object()) {
      const std::string format = json.value("format", "");
      if (format == "heddle chart") return describe_chart(json);
      if (format == "heddle plan") return describe_entries("plan", json);
      if (format == "heddle stand-in") return describe_entries("stand-in", json);
      if (json.contains("heddle.method")) return describe_entries("report of a picture", json);
      if (json.contains("seal")) return describe_entries("record of an artifact", json);
    }
  } catch (const nlohmann::json::exception& error) {
    throw FileError(fmt::format("{}: {}", path.string(), error.what()));
  }
  throw FileError(
      path.string() +
      ": expected a chart, the report of a picture, of a plan or of an export, an accuracy table, "
      "the record of an artifact, or a pack's manifest");
}

void add_box(const std::vector<std::array<float, 3>>& points, Report& report) {
  std::array<float, 3> low{};
  std::array<float, 3> high{};
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float x = points[p][axis];
      low[axis] = p == 0 ? x : std::min(low[axis], x);
      high[axis] = p == 0 ? x : std::max(high[axis], x);
    }
  }
  report["box_min"] = {rounded(low[0]), rounded(low[1]), rounded(low[2])};
  report["box_max"] = {rounded(high[0]), rounded(high[1]), rounded(high[2])};
}

Report describe_curves(const fs::path& path) {
  const CurveSet curves = read_curves(path);
  const char* kinds[] = {"polylines", "uniform Catmull-Rom splines", "cubic B-splines",
                         "cubic Bezier curves"};
  Report report = {{"kind", "curves"}, {"of_kind", kinds[static_cast<int>(curves.kind)]}};
  report["curves"] = curves.curve_count();
  report["closed"] = std::count(curves.closed.begin(), curves.closed.end(), true);
  report["points"] = curves.points.size();
  if (curves.up != UpAxis::kUnknown)
    report["up"] = std::string(1, "xyz"[static_cast<int>(curves.up)]);
  if (!curves.thickness.empty()) {
    const auto [thin, thick] =
        std::minmax_element(curves.thickness.begin(), curves.thickness.end());
    report["thickness"] = {rounded(*thin), rounded(*thick)};
  }
  if (!curves.info.empty()) report["info"] = curves.info;
  add_box(curves.points, report);
  return report;
}

/// The mesh of a Wavefront file, or the lines of one that has no mesh.
Report describe_obj(const fs::path& path) {
  ObjMesh mesh;
  try {
    mesh = read_obj(path);
  } catch (const FileError& no_mesh) {
    try {
      return describe_curves(path);
    } catch (const FileError&) {
      throw no_mesh;
    }
  }
  Report report = {
      {"kind", "mesh"}, {"vertices", mesh.positions.size()}, {"triangles", mesh.triangles.size()}};
  report["polygons"] = mesh.face_corners.size();
  if (const std::vector<std::string> groups = group_names(mesh); !groups.empty())
    report["groups"] = groups;
  report["has_uv"] = !mesh.uvs.empty();
  report["has_normals"] = !mesh.normals.empty();
  add_box(mesh.positions, report);
  return report;
}

Report describe_kept(const fs::path& path) {
  const ChunkFile file(path, kKeptMark, kKeptKind);
  const KeptPicture kept = read_kept(file);
  return {{"kind", "G-buffer"},
          {"scene", kept.scene},
          {"view", kept.view},
          {"method", render_method_name(kept.method)},
          {"crop",
           {kept.crop.x0, kept.crop.y0, kept.crop.x0 + kept.crop.width,
            kept.crop.y0 + kept.crop.height}},
          {"spp", kept.spp},
          {"seed", kept.seed},
          {"holds", kept.has_light ? "rays and light" : "rays"},
          {"light_groups", kept.groups.size()},
          {"bytes_per_sample",
           rounded(static_cast<double>(file.bytes()) /
                   (static_cast<double>(kept.crop.width) * kept.crop.height * kept.spp))}};
}

Report describe(const fs::path& path, const CommonOptions& common) {
  if (!fs::exists(path)) throw FileError(path.string() + ": no such file or folder");
  if (fs::is_directory(path) || path.filename() == kManifestName) {
    return describe_pack(fs::is_directory(path) ? path : path.parent_path());
  }
  const std::string ending = lower_case_ending(path);
  if (ending == ".toml") {
    const TomlTable document = TomlTable::load(path);
    if (document.has("model")) return describe_surface_fabric(document);
    return document.has("fiber") ? fabric_report(read_fabric_document(path, common.fabric_seed))
                                 : describe_scene(document);
  }
  if (ending == ".safetensors") return describe_tensors(path, common);
  if (ending == ".vdb") return describe_vdb(path);
  if (ending == ".exr") return describe_image(read_exr(path));
  if (ending == ".hdr" || ending == ".pic") return describe_image(read_hdr(path));
  if (ending == ".png") return describe_png(path);
  if (ending == ".obj") return describe_obj(path);
  if (ending == ".bcc" || ending == ".hair") return describe_curves(path);
  if (ending == ".wif") return describe_draft(path);
  if (ending == ".json") return describe_json(path);
  if (ending == ".gbuffer") return describe_kept(path);
  throw FileError(
      path.string() +
      ": expected a pack, or a file that ends in .toml, .wif, .bcc, .hair, .safetensors, .vdb, "
      ".exr, .hdr, .pic, .png, .obj, .gbuffer or .json");
}

bool is_accuracy_table(const fs::path& path) {
  if (lower_case_ending(path) != ".json" || path.filename() == kManifestName || !fs::exists(path))
    return false;
  const nlohmann::json json = read_json(path);
  return json.is_object() && json.value("format", nlohmann::json()) == "heddle accuracy";
}

void print_text(const Report& report) {
  for (const auto& [key, value] : report.items()) {
    std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (value.is_array() && !value.empty() && value[0].is_number()) {
      text.clear();
      for (const auto& number : value) text += (text.empty() ? "" : " x ") + number.dump();
    }
    if (key == "drawing" || key == "warnings") {  // one below the other
      if (value.empty()) continue;
      text.clear();
      for (const auto& line : value)
        text += (text.empty() ? "" : "\n" + std::string(27, ' ')) + line.get<std::string>();
    }
    std::cout << fmt::format("{:<26} {}\n", key, text);
  }
}

}  // namespace

int info_command(const fs::path& path, const CommonOptions& common) {
  if (is_accuracy_table(path)) {
    const AccuracyTable table = read_accuracy(path);
    std::cout << (common.json ? accuracy_json(table).dump(2) + "\n" : accuracy_text(table));
    return 0;
  }
  const Report report = describe(path, common);
  if (common.json) {
    std::cout << report.dump(2) << '\n';
  } else {
    print_text(report);
  }
  return 0;
}

}  // namespace heddle
