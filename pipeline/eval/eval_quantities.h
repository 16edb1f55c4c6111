#ifndef HEDDLE_PIPELINE_EVAL_EVAL_QUANTITIES_H_
#define HEDDLE_PIPELINE_EVAL_EVAL_QUANTITIES_H_
// The quantities that `heddle eval` knows: each reads its fields from the request and returns its
// value. A new one is declared here, defined in the file of its family and listed in the table of
// eval.cpp and in docs/eval.md.

#include <nlohmann/json_fwd.hpp>

#include "pipeline/eval/eval_request.h"

namespace heddle {

// eval_scattering.cpp
nlohmann::json eval_bcsdf(EvalObject& request);
nlohmann::json eval_bcsdf_albedo(EvalObject& request);
nlohmann::json eval_bcsdf_sh(EvalObject& request);
nlohmann::json eval_sg_scatter(EvalObject& request);

// eval_basis.cpp
nlohmann::json eval_sg_mass(EvalObject& request);
nlohmann::json eval_sg_product(EvalObject& request);
nlohmann::json eval_sg_zonal(EvalObject& request);
nlohmann::json eval_sh(EvalObject& request);
nlohmann::json eval_sh_rotate(EvalObject& request);

// eval_surface_microcylinder.cpp
nlohmann::json eval_microcylinder(EvalObject& request);
nlohmann::json eval_thread(EvalObject& request);

// eval_clipped_gaussians.cpp
nlohmann::json eval_clipped_gaussians(EvalObject& request);

// eval_visibility.cpp
nlohmann::json eval_visibility(EvalObject& request);

// eval_woven.cpp
nlohmann::json eval_woven_area(EvalObject& request);
nlohmann::json eval_woven_brdf(EvalObject& request);
nlohmann::json eval_woven_btf(EvalObject& request);
nlohmann::json eval_woven_yarns(EvalObject& request);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_EVAL_EVAL_QUANTITIES_H_
