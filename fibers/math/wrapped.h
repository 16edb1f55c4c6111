#ifndef HEDDLE_FIBERS_MATH_WRAPPED_H_
#define HEDDLE_FIBERS_MATH_WRAPPED_H_
// Indices on periodic lines. Tested through all who repeat a tile.

namespace heddle {

/// `index` in 0 .. count - 1, count above 0: C++'s remainder of a negative index is negative.
template <class Integer>
constexpr Integer wrapped(Integer index, Integer count) {
  const Integer rest = index % count;
  return rest < 0 ? rest + count : rest;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_WRAPPED_H_
