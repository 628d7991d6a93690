// The map `provenance`: a colour for the method that found the high poly's point.
#include <algorithm>
#include <array>

#include "detail/point_map.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

using Colour = std::array<float, 3>;

Colour colour_of(const HighPoint& point) {
  if (!point.found) return {1, 0, 1};  // The colour that MissPolicy::mark uses
  switch (point.status) {
    case KILN_STATUS_OUTWARD:
      return {0, 1, 0};
    case KILN_STATUS_OUTERMOST:
      return {0.5F, 1, 0};
    case KILN_STATUS_INWARD:
      return {0, 0, 1};
    case KILN_STATUS_CAGE:
      return {1, 1, 0};
    case KILN_STATUS_VIEW:
      return {1, 0.5F, 0};
    case KILN_STATUS_CLOSEST:
      return {0, 1, 1};
    case KILN_STATUS_UV:
      return {0.5F, 0.5F, 0.5F};
    default:
      return {1, 1, 1};
  }
}

}  // namespace

MapRow provenance_map() {
  MapRow row;
  row.info = {MapKind{"provenance"},
              3,
              MapType::id,
              "method that found the point. Rays: green outward, lime outward past a nearer face, "
              "blue inward, yellow from a cage. Other matches: orange depth view, cyan nearest "
              "point, grey UV. Magenta: missed",
              0,
              1};
  // The map depends only on the match, and a session that bakes texels again because normals
  // changed does not know their status. This flag excludes the map from such updates.
  row.follows_positions = true;
  row.supports_streaming = true;
  row.make = [](const MapRequest& request) {
    return make_point_map(request, provenance_map().info, [](const HighPoint& point, float* value) {
      const Colour colour = colour_of(point);
      std::copy(colour.begin(), colour.end(), value);
    });
  };
  return row;
}

}  // namespace kiln
