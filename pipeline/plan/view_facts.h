#ifndef HEDDLE_PIPELINE_PLAN_VIEW_FACTS_H_
#define HEDDLE_PIPELINE_PLAN_VIEW_FACTS_H_
// What the first pilot shows of a view: which cloth covers how much of it, how wide its pixels are
// there, which light falls on it and from which side, and how much of what surrounds it is cloth.
// Tested in tests/pipeline/end_to_end_test.cpp.

#include <vector>

#include "pipeline/plan/pilot.h"
#include "render/cloth_scene.h"
#include "render/lights.h"

namespace heddle {

/// One light on one cloth.
struct LightShare {
  double sharpness = 0;
  double weight = 0;  // of all the light that the cloth receives
  double cosine = 0;  // to the cloth's normal, mean over what is seen
};

/// Light on one pixel's cloth, by the side that it falls on; in the units of the lights.
struct PixelLight {
  struct OnSide {
    double seen = 0;    // on the side that the pixel sees
    double across = 0;  // on the other
    double shown(double through) const { return seen + through * across; }
  };
  OnSide face;
  OnSide back;
};

/// What a view sees of one cloth of its scene. Cloth of surface models is not looked at.
struct SeenCloth {
  double share = 0;                      // of the view's pixels
  double light_share = 0;                // of the picture's light
  double footprint_mm = 0;               // of a pixel on the cloth, geometric mean
  double enclosure_square = 0;           // mean over its pixels (pipeline/accuracy/enclosure.h)
  std::vector<LightShare> lights;        // [light]
  std::vector<PixelLight> pixel_lights;  // [pixel of the pilot on it]

  /// The mean over the picture of the cloth's squared light, relative to the squared mean of the
  /// picture: what a squared error relative to the cloth's own light counts with.
  double square_weight() const { return light_share * light_share / share; }
};

struct ViewFacts {
  // of the scene, environments as Gaussians, near lights as what stands for them in the middle of
  // the cloth that is seen
  std::vector<Light> lights;
  std::vector<SeenCloth> cloths;   // [cloth of the scene]
  bool sends_light_about = false;  // light that has left a cloth can meet cloth again
};

ViewFacts look_at_view(PilotRenderer& renderer, const Pilot& paths);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_VIEW_FACTS_H_
