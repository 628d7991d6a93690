// Maps whose values are a function of one point of the high poly: all that such a map has to say is that
// function.
#pragma once

#include <array>

#include "detail/registry.h"
#include "mesh/vector.h"

namespace kiln {

/// Memory that a function uses again from point to point, one a thread. No value depends on it.
struct PointScratch {
  PointScratch() = default;
  PointScratch(const PointScratch&) = delete;
  PointScratch& operator=(const PointScratch&) = delete;
  virtual ~PointScratch() = default;
};

/// A point of the high poly, as a map sees it; or, where nothing was found, the point of the low poly that
/// stands in for it (Wang et al., section 2).
struct HighPoint {
  bool found = true;
  std::uint32_t triangle =
      0;               ///< Triangle of the high poly; KILN_NO_TRIANGLE where nothing was found
  float u = 0, v = 0;  ///< Weights of its corners 1 and 2
  double distance =
      0;  ///< Along the match's direction, world units, outward positive; 0 where not found
  Vec3d position;                  ///< World units
  Vec3d normal;                    ///< Unit, interpolated
  std::uint8_t status = 0;         ///< kiln_sample_status: what found it, or that nothing did
  std::uint32_t low_triangle = 0;  ///< The low poly's point
  float low_u = 0, low_v = 0;      ///< Weights of its corners 1 and 2
  Vec3d offset;                    ///< From the low poly's point to this one, world units
  bool has_uv =
      false;  ///< The two below are known: they were asked for, and the high poly has them
  std::array<double, 2> uv;  ///< The high poly's there
  /// Sides of the sample's share of its texel (rightwards, downwards), in UVs of the high poly's
  /// triangle: carried there along the low poly's normal.
  std::array<std::array<double, 2>, 2> uv_sides;
  /// The same sides in weights of the triangle's corners 1 and 2, for other sets of UVs; where they were asked for.
  std::array<std::array<double, 2>, 2> weight_sides;
  PointScratch* scratch = nullptr;  ///< The result of the function's scratch()
  Vec3d
      seen;  ///< Mean of the directions that see the low poly's point; 0 where not known, or none does
};

/// Members of a HighPoint that a function reads; the others are not worked out.
struct PointNeeds {
  bool position = true;
  bool normal = true;
  bool uv = false;            ///< uv and uv_sides
  bool weight_sides = false;  ///< With uv alone
  bool offset = true;         ///< With the position alone
  bool distance = true;
};

/// Function that gives a map's value at a point. \param value  as many as the map has channels
class PointFunction {
 public:
  virtual ~PointFunction() = default;
  virtual PointNeeds needs() const { return {}; }
  /// Before each band, on one thread. \param source_version  another one where the high poly changed
  virtual void prepare(std::uint64_t source_version) { static_cast<void>(source_version); }
  virtual void operator()(const HighPoint& point, float* value) const = 0;
  virtual std::unique_ptr<PointScratch> scratch() const { return nullptr; }
  /// Adds facts and warnings at the end, beside the texels.
  virtual void report(BakedMap& map, std::vector<Warning>& warnings) const {
    static_cast<void>(map), static_cast<void>(warnings);
  }
};

/// From a function to a map: gathers points on the host's threads, calls it for each sample, and averages a
/// texel's samples; of MapType::id the value that most of a texel's samples have, the first of equals.
std::unique_ptr<MapMaker> make_point_map(const MapRequest& request, const MapInfo& info,
                                         std::unique_ptr<PointFunction> function);

/// The same from anything that can be called, for functions that keep nothing.
template <typename Function>
std::unique_ptr<MapMaker> make_point_map(const MapRequest& request, const MapInfo& info,
                                         Function function, PointNeeds needed = {}) {
  struct Called : PointFunction {
    Called(Function called, PointNeeds needs) : call(std::move(called)), wanted(needs) {}
    PointNeeds needs() const override { return wanted; }
    void operator()(const HighPoint& point, float* value) const override { call(point, value); }
    Function call;
    PointNeeds wanted;
  };
  return make_point_map(request, info,
                        std::unique_ptr<PointFunction>(new Called(std::move(function), needed)));
}

}  // namespace kiln
