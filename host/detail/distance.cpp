// Unsigned distance between the points of the high poly and the low poly.
#include "detail/point_map.h"
#include "detail/value_ranges.h"

namespace kiln {

MapRow distance_map() {
  MapRow row;
  row.info = {MapKind{"distance"},
              1,
              MapType::scalar,
              "distance from low poly to high poly, without a sign, world units",
              0,
              0};
  row.follows_positions = true;
  row.supports_streaming = true;
  row.unit = "world units";
  row.range = range_of_reach;
  row.make = [](const MapRequest& request) {
    return make_point_map(
        request, distance_map().info,
        [](const HighPoint& point, float* value) {
          value[0] = static_cast<float>(length(point.offset));
        },
        PointNeeds{.normal = false, .distance = false});
  };
  return row;
}

}  // namespace kiln
