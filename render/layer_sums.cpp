#include "render/layer_sums.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace heddle {
namespace {

constexpr float kLargestHalf = 65504;
// Of the distance of halves: a sum so close to the middle between two may round to either.
constexpr double kNearTie = 0.49;
// Of the same: what a part is moved by to leave such a place.
constexpr double kStep = 0.02;
constexpr int kLeastExponent = -14;  // of normal halves

/// Distance of halves of that size.
double last_digit(double value) {
  int exponent = kLeastExponent;
  if (value != 0) std::frexp(value, &exponent);  // value = f 2^exponent, f in [0.5, 1)
  return std::ldexp(1.0, std::max(exponent - 1, kLeastExponent) - 10);
}

/// Without error: halves are multiples of 2^-24 below 2^16.
double exact_sum(std::span<const float> parts) {
  return std::accumulate(parts.begin(), parts.end(), 0.0,
                         [](double sum, float part) { return sum + static_cast<double>(part); });
}

/// Rounded once.
float half_of(double value) {
  const double digit = last_digit(value);
  const double rounded = digit * std::nearbyint(value / digit);
  return std::clamp(static_cast<float>(rounded), -kLargestHalf, kLargestHalf);
}

/// The smaller of the distances to a half's neighbours.
double nearest_neighbour(float whole) {
  return last_digit(static_cast<double>(whole) * (1 - 0x1p-12));
}

/// Moves parts, not the first `fixed`, until they add up to the whole. Returns whether they do.
bool settle(float whole, std::span<float> parts, std::size_t fixed) {
  if (add_up(parts, whole)) return true;
  std::vector<std::size_t> order(parts.size() - fixed);  // by falling size
  std::iota(order.begin(), order.end(), fixed);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(parts[a]) > std::abs(parts[b]);
  });
  const auto missing = [&] { return static_cast<double>(whole) - exact_sum(parts); };
  const auto take_remainder = [&](float& part) {
    part = half_of(static_cast<double>(part) + missing());
  };
  take_remainder(parts[order.front()]);
  for (auto k = order.rbegin(); k != order.rend() && !add_up(parts, whole); ++k) {
    const auto part = static_cast<double>(parts[*k]);
    const double step = std::max(last_digit(part), kStep * nearest_neighbour(whole));
    if (std::abs(missing()) < 2 * nearest_neighbour(whole))
      parts[*k] = half_of(part + std::copysign(step, missing()));
  }
  for (auto k = order.begin(); k != order.end() && !add_up(parts, whole); ++k)
    take_remainder(parts[*k]);
  return add_up(parts, whole);
}

float rounded_to(double digit, float value) {
  return half_of(digit * std::nearbyint(static_cast<double>(value) / digit));
}

}  // namespace

float rounded_to_half(float value) {
  return half_of(static_cast<double>(value));
}

bool add_up(std::span<const float> parts, float whole) {
  return std::abs(exact_sum(parts) - static_cast<double>(whole)) <=
         kNearTie * nearest_neighbour(whole);
}

void round_to_add_up(float& whole, std::span<const std::span<float>> sets) {
  double largest = 0;
  std::vector<std::vector<float>> before;
  const float exact_whole = whole;
  whole = rounded_to_half(whole);
  bool hold = true;
  for (const std::span<float> set : sets) {
    before.emplace_back(set.begin(), set.end());
    for (float& part : set) {
      largest = std::max(largest, std::abs(static_cast<double>(part)));
      part = rounded_to_half(part);
    }
    hold = settle(whole, set, 1) && hold;
  }
  if (hold) return;
  // One digit for all, with a bit to spare: a remainder may carry a part over a power of two.
  const double digit = 2 * last_digit(largest);
  whole = rounded_to(digit, exact_whole);
  for (std::size_t k = 0; k < sets.size(); ++k) {
    std::transform(before[k].begin(), before[k].end(), sets[k].begin(),
                   [&](float part) { return rounded_to(digit, part); });
    settle(whole, sets[k], 1);
  }
}

void round_parts(float whole, std::span<float> parts) {
  for (float& part : parts) part = rounded_to_half(part);
  if (settle(whole, parts, 0)) return;
  // Parts of both signs, much larger than the whole, are too coarse for it.
  for (float& part : parts) part = std::clamp(part, std::min(0.0F, whole), std::max(0.0F, whole));
  settle(whole, parts, 0);
}

}  // namespace heddle
