// Model of the error that the texels of a map add to the error of a mesh.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <vector>

namespace kiln {

/// Errors of a mesh: mean angles of rendered normals in degrees, and the mismatch of its outlines.
struct LevelErrors {
  double without_map = 0;  ///< Error of the mesh's own normals
  /// Error with a map of infinite resolution, called the limit f in README.md
  double infinite_map = 0;
  double silhouette_mismatch =
      0;  ///< Share of the pixels that only one of the meshes covers; see NormalError::one_sided_share
};

/// The error of a mesh with a map whose side has s texels: e(s) = infinite_map + d / (1 + d h(s)), where d =
/// without_map - infinite_map. A tiny map reproduces none of the detail d, a large map all of it. The sharpness h
/// comes from the measured maps of the mesh with the nearest face count. TexelError in match_plan.cpp is the same
/// model for one mesh and two maps.
class ErrorModel {
 public:
  /// Calibrates the model by a measured map.
  /// \param has_own_charts  true if the charts are laid out for this size; false for a mip level of a larger map, whose
  /// error is used until a map of this size is measured
  void add_measurement(double faces, const LevelErrors& level, std::uint32_t size, double error,
                       bool has_own_charts) {
    std::vector<Sharpness>& known = known_[size];
    if (!has_own_charts && !known.empty() && known.front().has_own_charts) return;
    if (has_own_charts)
      std::erase_if(known, [](const Sharpness& other) { return !other.has_own_charts; });
    const double excess_error = std::max(error - level.infinite_map,
                                         kMinRelativeError * level.infinite_map + kMinErrorDegrees);
    known.push_back(
        {faces, std::max(1 / excess_error - 1 / detail(level), kMinRelativeError / detail(level)),
         has_own_charts});
  }

  /// Predicts the error of a mesh with a map of a given size. \param level  errors of the mesh, from
  /// LevelEvaluator::at() with mapped = true
  double expected(double faces, const LevelErrors& level, std::uint32_t size) const {
    return level.infinite_map + detail(level) / (1 + detail(level) * sharpness(faces, size));
  }

 private:
  struct Sharpness {
    double faces = 0, value = 0;
    bool has_own_charts = false;
  };
  /// Differences to the limit, or to the error without a map, are at least kMinRelativeError of these errors.
  /// kMinErrorDegrees avoids divisions by 0. Sharpness is proportional to the face count to the power of
  /// -kSharpnessExponent.
  static constexpr double kMinRelativeError = 0.01, kMinErrorDegrees = 1e-9,
                          kSharpnessExponent = 0.15;

  static double detail(const LevelErrors& level) {
    return std::max(level.without_map - level.infinite_map, kMinErrorDegrees);
  }

  /// The finer a mesh is, the finer is the detail that it leaves to the map, so its sharpness h at a given map size
  /// decreases as its face count increases. Measured exponents were 0.15 to 0.6; kSharpnessExponent is the smallest,
  /// since a finer mesh whose error is overestimated is never built, while an underestimate is corrected once the
  /// mesh is measured.
  static double nearest(const std::vector<Sharpness>& known, double faces) {
    const auto log_distance = [faces](const Sharpness& s) {
      return std::abs(std::log(s.faces / faces));
    };
    const auto nearest_entry = std::min_element(
        known.rbegin(), known.rend(),
        [&](const Sharpness& a, const Sharpness& b) { return log_distance(a) < log_distance(b); });
    return nearest_entry->value * std::pow(nearest_entry->faces / faces, kSharpnessExponent);
  }

  /// Sharpness at a size. Beyond the largest measured size it is extrapolated along the last two, with an exponent of
  /// 1 to 2: the error of smooth detail falls with the square of the size, the error of edges, which are blurred by a
  /// texel's width, with the size itself.
  double sharpness(double faces, std::uint32_t size) const {
    if (known_.empty()) return 0;
    const auto nearest_entry = known_.lower_bound(size);
    if (nearest_entry != known_.end()) return nearest(nearest_entry->second, faces);
    const auto last = std::prev(known_.end()),
               other = last == known_.begin() ? last : std::prev(last);
    const double value = nearest(last->second, faces);
    const double slope = std::log(value / nearest(other->second, faces)) /
                         std::log(1.0 * last->first / other->first);
    return value *
           std::pow(1.0 * size / last->first, last == other ? 1 : std::clamp(slope, 1.0, 2.0));
  }

  std::map<std::uint32_t, std::vector<Sharpness>> known_;  ///< Measured sharpness by map size
};

}  // namespace kiln
