// Maps whose values are a function of one point of the high poly. Such a map supplies only that function.
#pragma once

#include <array>

#include "detail/registry.h"
#include "mesh/vector.h"

namespace kiln {

/// Working memory that a function reuses between points. Each thread has its own. Its contents do
/// not affect values.
struct PointScratch {
  PointScratch() = default;
  PointScratch(const PointScratch&) = delete;
  PointScratch& operator=(const PointScratch&) = delete;
  virtual ~PointScratch() = default;
};

/// A point of the high poly. If the match missed, most members describe the low poly's point
/// instead (Wang et al., section 2).
struct HighPoint {
  bool found = true;
  std::uint32_t triangle = 0;  ///< Triangle of the high poly; KILN_NO_TRIANGLE for a miss
  float u = 0, v = 0;          ///< Barycentric weights of corners 1 and 2 of `triangle`
  /// Distance along the match's direction in world units, positive outward; 0 for a miss
  double distance = 0;
  Vec3d position{};  ///< Position of the point in world units
  Vec3d normal{};    ///< Interpolated unit normal
  /// The method that found the point, or a miss, as kiln_sample_status
  std::uint8_t status = 0;
  std::uint32_t low_triangle = 0;  ///< Triangle of the low poly that contains its point
  float low_u = 0, low_v = 0;      ///< Barycentric weights of corners 1 and 2 of `low_triangle`
  /// Vector from the low poly's point to this point, in world units
  Vec3d offset{};
  /// True if uv and uv_sides are set: they were requested, and the high poly has UVs
  bool has_uv = false;
  std::array<double, 2> uv;  ///< UV of the high poly's point
  /// Edges of the sample's square footprint, rightwards and downwards in the map. They are
  /// projected along the low poly's normal onto the high poly's triangle, and given in UVs.
  std::array<std::array<double, 2>, 2> uv_sides;
  /// The same edges, as changes of the barycentric weights of corners 1 and 2. From these the edges
  /// in any UV set can be computed. Only set if requested.
  std::array<std::array<double, 2>, 2> weight_sides;
  PointScratch* scratch = nullptr;  ///< Working memory of the calling thread
  /// Mean direction from which the low poly's point is visible; zero if it is unknown or the point
  /// is hidden
  Vec3d seen{};
};

/// Members of a HighPoint that a function uses; the others are not computed.
struct PointNeeds {
  bool position = true;
  bool normal = true;
  bool uv = false;            ///< The function reads HighPoint::uv and uv_sides
  bool weight_sides = false;  ///< Requires uv
  bool offset = true;         ///< Implies `position`
  bool distance = true;
};

/// A function that computes a map's value at a point.
/// \param value  as many numbers as the map has channels
class PointFunction {
 public:
  virtual ~PointFunction() = default;
  virtual PointNeeds needs() const { return {}; }
  /// True if each value has a fourth number, which is its weight (above 0) in the average of a
  /// texel's samples. Only for maps of up to three channels.
  virtual bool has_weights() const { return false; }
  /// Called before each band, on one thread.
  /// \param source_version  differs from the last call if the high poly changed
  virtual void prepare(std::uint64_t source_version) { static_cast<void>(source_version); }
  virtual void operator()(const HighPoint& point, float* value) const = 0;
  virtual std::unique_ptr<PointScratch> scratch() const { return nullptr; }
  /// Called after the last band to add statistics and warnings.
  virtual void report(BakedMap& map, std::vector<Warning>& warnings) const {
    static_cast<void>(map), static_cast<void>(warnings);
  }
};

/// Makes a map from a function: collects the points of all samples on the host's threads, calls the
/// function for each, and averages the samples of each texel. For MapType::id, a texel gets the
/// most frequent of its samples' values, or the first of several equally frequent ones.
std::unique_ptr<MapMaker> make_point_map(const MapRequest& request, const MapInfo& info,
                                         std::unique_ptr<PointFunction> function);

/// Makes a map from any callable without state.
template <typename Function>
std::unique_ptr<MapMaker> make_point_map(const MapRequest& request, const MapInfo& info,
                                         Function function, PointNeeds needed = {}) {
  struct CallableFunction : PointFunction {
    CallableFunction(Function called, PointNeeds needs) : call(std::move(called)), needs_(needs) {}
    PointNeeds needs() const override { return needs_; }
    void operator()(const HighPoint& point, float* value) const override { call(point, value); }
    Function call;
    PointNeeds needs_;
  };
  return make_point_map(
      request, info,
      std::unique_ptr<PointFunction>(new CallableFunction(std::move(function), needed)));
}

}  // namespace kiln
