#ifndef HEDDLE_PIPELINE_ACCURACY_ENCLOSURE_H_
#define HEDDLE_PIPELINE_ACCURACY_ENCLOSURE_H_
// How much of what surrounds a place on cloth is cloth again: the share of a cosine-weighted
// hemisphere, over the side that is seen, that shells and meshes cover. Light from there is what
// methods lack that end it where it leaves a cloth; that light goes with the share, its square with
// the share's. Geometry alone: a few rays tell it where as many paths would say nothing. Tested in
// tests/pipeline/accuracy_test.cpp.

#include "render/cloth_scene.h"

namespace heddle {

/// At the cloth's surface over a hit seen along `direction`; 0 .. 1. Rays are always the same 24.
double enclosure(const ClothScene& scene, const ShellHit& hit, const Vec3& direction);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_ACCURACY_ENCLOSURE_H_
