#ifndef HEDDLE_RENDER_LAYER_SUMS_H_
#define HEDDLE_RENDER_LAYER_SUMS_H_
// Rounds layers to half precision so that sums of layers still hold: parts, added up in floats and
// rounded to half, give the very bits of the whole. Layers rounded one by one miss that by a last
// digit in many pixels. Tested in tests/render/layer_sums_test.cpp.

#include <span>
#include <vector>

namespace heddle {

/// The nearest half, ties to even, within the largest finite ones.
float rounded_to_half(float value);

/// Does the sum of halves, rounded to half, equal `whole`? And so clearly that rounding of the sum
/// itself, to float and in any order, does not matter.
bool add_up(std::span<const float> parts, float whole);

/// One value of a picture and the sets of parts that each add up to it. The first part of a set is
/// left as it is (the background). The remainder of rounding goes to the largest other one; where
/// that ends in a tie, or is not fine enough beside a negative part, to the next ones too. Where
/// parts nearly cancel each other, all are rounded to the coarser digits of the largest instead.
void round_to_add_up(float& whole, std::span<const std::span<float>> sets);

/// The same for parts of a value that is rounded already and stays. Where parts nearly cancel each
/// other, they are cut to between 0 and the whole.
void round_parts(float whole, std::span<float> parts);

}  // namespace heddle

#endif  // HEDDLE_RENDER_LAYER_SUMS_H_
