#include "render/methods.h"

#include <array>

#include "fibers/baked/fabric_pack.h"
#include "render/fabric_shading.h"
#include "render/rivals/prt_scattering.h"
#include "render/rivals/tsai_shih_scattering.h"
#include "render/single_scattering.h"

namespace heddle {
namespace {

using Shading = std::unique_ptr<const FabricShading>;

/// Multiple scattering by the transfer. `model` makes single scattering from materials.
template <class Model>
Shading with_transfer(const ShadingInputs& inputs, const Model& model) {
  return std::make_unique<TransferShading>(
      inputs, model(std::span<const BcsdfTable>(inputs.pack->materials)),
      inputs.reflecting.empty() ? nullptr : model(inputs.reflecting));
}

Shading by_gaussians_and_distances(const ShadingInputs& inputs, SgMethod gamma) {
  return with_transfer(inputs, [&](std::span<const BcsdfTable> materials) {
    const FabricPack& pack = *inputs.pack;
    return std::make_unique<SingleScattering>(pack.ssdf ? &*pack.ssdf : nullptr,
                                              pack.sgs ? &*pack.sgs : nullptr, materials,
                                              inputs.blend, gamma);
  });
}

Shading shipped(const ShadingInputs& inputs) {
  return by_gaussians_and_distances(inputs, SgMethod::kDefault);
}

Shading printed(const ShadingInputs& inputs) {
  return by_gaussians_and_distances(inputs, SgMethod::kPrinted);
}

Shading prt(const ShadingInputs& inputs) {
  return with_transfer(inputs, [&](std::span<const BcsdfTable> materials) {
    return std::make_unique<PrtScattering>(*inputs.pack->ssdf, inputs.pack->light_from_both_sides,
                                           materials);
  });
}

template <int kTerms>
Shading tsai_shih(const ShadingInputs& inputs) {
  return with_transfer(inputs, [&](std::span<const BcsdfTable> materials) {
    return std::make_unique<TsaiShihScattering>(
        *inputs.pack->ssdf, inputs.pack->light_from_both_sides, materials, kTerms);
  });
}

Shading dual_scattering(const ShadingInputs& inputs) {
  return std::make_unique<DualScatteringShading>(inputs);
}

using enum RenderMethod;
using enum VisibilityData;

constexpr std::array<MethodRow, kRenderMethodCount> kRows = {{
    {.method = kExact,
     .name = "exact",
     .visibility = kByLight,
     .takes_transfer = true,
     .has_far_form = true,
     .make_shading = shipped},
    {.method = kVolume,
     .name = "volume",
     .marches_volume = true,
     .visibility = kByLight,
     .takes_transfer = true,
     .has_far_form = true,
     .make_shading = shipped},
    {.method = kPath, .name = "path", .traces_paths = true},
    {.method = kPath6, .name = "path-6", .traces_paths = true, .max_scatterings = 6},
    {.method = kPrinted,
     .name = "printed",
     .visibility = kByLight,
     .takes_transfer = true,
     .as_printed = true,
     .make_shading = printed},
    {.method = kPrt,
     .name = "prt",
     .visibility = kSignedDistance,
     .takes_transfer = true,
     .make_shading = prt},
    {.method = kTsaiShih16,
     .name = "tsai-shih-16",
     .visibility = kSignedDistance,
     .takes_transfer = true,
     .make_shading = tsai_shih<BcsdfFactors::kRecommendedTerms>},
    {.method = kTsaiShihFull,
     .name = "tsai-shih-full",
     .visibility = kSignedDistance,
     .takes_transfer = true,
     .make_shading = tsai_shih<BcsdfFactors::kAllTerms>},
    {.method = kDualScattering,
     .name = "dual-scattering",
     .tells_lobes = false,
     .draws_light = true,
     .make_shading = dual_scattering},
}};

/// Is every method's row there, at its place, with a name and one way to be rendered?
constexpr bool is_complete() {
  for (std::size_t k = 0; k < kRows.size(); ++k) {
    const MethodRow& row = kRows[k];
    if (row.method != static_cast<RenderMethod>(k) || row.name.empty()) return false;
    if (row.traces_paths != (row.make_shading == nullptr)) return false;
  }
  return true;
}
static_assert(is_complete(), "expected one row for each RenderMethod, in their order");

}  // namespace

const MethodRow& method_row(RenderMethod method) {
  return kRows[static_cast<std::size_t>(method)];
}

std::optional<RenderMethod> render_method_of(std::string_view name) {
  for (const MethodRow& row : kRows) {
    if (name == row.name) return row.method;
  }
  return {};
}

const char* render_method_name(RenderMethod method) {
  return method_row(method).name.data();
}

std::vector<std::string_view> render_method_names() {
  std::vector<std::string_view> names;
  for (const MethodRow& row : kRows) names.push_back(row.name);
  return names;
}

Needs needs_of(RenderMethod method, std::span<const Light> lights, const VisibilityBlend& blend) {
  const MethodRow& row = method_row(method);
  Needs needs;
  needs.transfer = row.takes_transfer;
  needs.volume = row.marches_volume;
  needs.ssdf = row.visibility == VisibilityData::kSignedDistance;
  if (row.visibility != VisibilityData::kByLight) return needs;
  for (const Light& light : lights) {
    if (light.is_delta()) {
      needs.ssdf = true;
    } else if (light.type != LightType::kSphericalGaussian) {
      needs.ssdf = needs.sgs = true;
    } else {
      needs.ssdf |= blend.uses_distance(light.sharpness);
      needs.sgs |= blend.uses_lobes(light.sharpness);
    }
  }
  return needs;
}

Needs needs_with_far_forms(Needs needs, RenderMethod method, bool in_pixels, int bounces) {
  if (!method_row(method).has_far_form) return needs;
  needs.far = in_pixels || bounces > 0;
  needs.ssdf |= bounces > 0;  // light between folds is a narrow Gaussian
  return needs;
}

}  // namespace heddle
