#include <algorithm>
#include <string>

#include "formats/input_error.h"
#include "pipeline/eval/eval_quantities.h"
#include "render/surface/microcylinder.h"
#include "render/surface/surface_presets.h"

namespace heddle {
namespace {

/// The same value in TOML, which writes strings, numbers and arrays as JSON does.
std::string toml_value(const nlohmann::json& value, const EvalObject& request) {
  if (value.is_null()) request.fail("fabric", "holds a null");
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (const auto& [key, item] : value.items()) {
    if (!text.empty()) text += ", ";
    if (value.is_object()) text += nlohmann::json(key).dump() + " = ";
    text += toml_value(item, request);
  }
  return value.is_object() ? "{" + text + "}" : "[" + text + "]";
}

TomlTable read_fabric(EvalObject& request) {
  const nlohmann::json& value = request.value("fabric");
  if (value.is_string()) {
    const std::vector<std::string> known = surface_preset_names("microcylinder");
    if (std::find(known.begin(), known.end(), value.get<std::string>()) == known.end()) {
      std::string list;
      for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
      request.fail("fabric", "no microcylinder fabric called \"" + value.get<std::string>() +
                                 "\"; known: " + list);
    }
    return surface_preset(value.get<std::string>());
  }
  if (!value.is_object()) request.fail("fabric", "expected a name or an object");
  std::string text;
  for (const auto& [key, item] : value.items()) {
    text += nlohmann::json(key).dump() + " = " + toml_value(item, request) + "\n";
  }
  return TomlTable::parse(text, "fabric");
}

Rgbd read_albedo(EvalObject& thread) {
  const std::vector<double> albedo = thread.numbers("albedo", 3);
  for (const double channel : albedo) {
    if (!(channel >= 0 && channel <= 1)) thread.fail("albedo", "must lie between 0 and 1");
  }
  return {albedo[0], albedo[1], albedo[2]};
}

nlohmann::json list_of(const Rgbd& value) {
  return {value[0], value[1], value[2]};
}

}  // namespace

nlohmann::json eval_thread(EvalObject& request) {
  EvalObject thread = request.object("thread");
  ThreadParameters parameters;
  parameters.ior = thread.number("ior", 1, 4);
  parameters.albedo = read_albedo(thread);
  parameters.kd = thread.number("kd", 0, 1);
  parameters.gamma_s = radians(thread.number("gamma_s_deg", 0.1, 180));
  parameters.gamma_v = radians(thread.number("gamma_v_deg", 0.1, 180));
  thread.finish();
  const double theta_i = request.inclination("theta_i_deg");
  const double phi_i = radians(request.number("phi_i_deg"));
  const double theta_o = request.inclination("theta_o_deg");
  const double phi_o = radians(request.number("phi_o_deg"));
  request.finish();
  return list_of(ThreadScattering(parameters, {}).value(theta_i, phi_i, theta_o, phi_o));
}

nlohmann::json eval_microcylinder(EvalObject& request) {
  const Vec3d wi = request.direction("wi");
  const Vec3d wo = request.direction("wo");
  request.value("fabric");
  request.finish();
  try {
    const TomlTable document = read_fabric(request);
    if (document.has("model")) document.choice("model", {"microcylinder"});
    const MicrocylinderFabric fabric = read_microcylinder_fabric(document);
    document.finish();
    const Microcylinder model(fabric);
    return list_of(model.published(wi, wo, 2) * model.energy_scale(wi));
  } catch (const ConfigError& error) {
    const std::string message = error.what();
    request.fail("fabric", message.substr(0, message.find('\n')));  // without the excerpt
  }
}

}  // namespace heddle
