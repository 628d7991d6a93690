// Axis-aligned bounding boxes.
#pragma once

#include <algorithm>
#include <limits>
#include <type_traits>

#include "mesh/vector.h"

namespace kiln {

/// The bounding box of the points that were added. It is empty at first. Points must not be NaN.
/// \tparam Vector  Vec3, or a GLM vector of two or three numbers
template <typename Vector>
struct Box {
  using Number = std::remove_cvref_t<decltype(Vector().x)>;

  Vector low = uniform_vector(std::numeric_limits<Number>::max());
  Vector high = uniform_vector(std::numeric_limits<Number>::lowest());

  void add(const Vector& p) {
    low = each(low, p, [](Number a, Number b) { return std::min(a, b); });
    high = each(high, p, [](Number a, Number b) { return std::max(a, b); });
  }
  void join(const Box& other) {
    low = each(low, other.low, [](Number a, Number b) { return std::min(a, b); });
    high = each(high, other.high, [](Number a, Number b) { return std::max(a, b); });
  }

  bool is_empty() const { return !(low.x <= high.x); }
  bool contains(const Box& other) const {
    return is_at_most(low, other.low) && is_at_most(other.high, high);
  }
  bool contains(const Vector& p) const { return is_at_most(low, p) && is_at_most(p, high); }
  /// True if the two boxes have at least one point in common.
  bool overlaps(const Box& other) const {
    return is_at_most(low, other.high) && is_at_most(other.low, high);
  }
  /// Centre of the box; the zero vector if it is empty.
  auto center() const { return (to_double(low) + to_double(high)) * 0.5; }
  /// Extents along the axes; negative if the box is empty.
  auto size() const { return to_double(high) - to_double(low); }
  /// Length of the diagonal; 0 if the box is empty.
  double diagonal() const { return is_empty() ? 0 : length(size()); }

 private:
  static constexpr bool kIsFlat = !requires(Vector v) { v.z; };

  static Vector uniform_vector(Number value) {
    if constexpr (kIsFlat) {
      return {value, value};
    } else {
      return {value, value, value};
    }
  }
  template <typename Function>
  static Vector each(const Vector& a, const Vector& b, const Function& function) {
    if constexpr (kIsFlat) {
      return {function(a.x, b.x), function(a.y, b.y)};
    } else {
      return {function(a.x, b.x), function(a.y, b.y), function(a.z, b.z)};
    }
  }
  /// True if no component of `a` exceeds the same component of `b`.
  static bool is_at_most(const Vector& a, const Vector& b) {
    if constexpr (kIsFlat) {
      return a.x <= b.x && a.y <= b.y;
    } else {
      return a.x <= b.x && a.y <= b.y && a.z <= b.z;
    }
  }
};

}  // namespace kiln
