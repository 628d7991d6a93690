// Where the point of the high poly lies.
#include "detail/point_map.h"
#include "detail/value_ranges.h"

namespace kiln {

MapRow position_map() {
  MapRow row;
  row.info = {MapKind{"position"},
              3,
              MapType::vector,
              "point of the high poly in object space, world units",
              0,
              0};
  row.follows_positions = true;
  row.unit = "world units";
  row.range = range_of_bounds;
  row.make = [](const MapRequest& request) {
    return make_point_map(
        request, position_map().info,
        [](const DensePoint& point, float* value) {
          value[0] = static_cast<float>(point.position.x);
          value[1] = static_cast<float>(point.position.y);
          value[2] = static_cast<float>(point.position.z);
        },
        PointNeeds{.normal = false, .offset = false, .distance = false});
  };
  return row;
}

}  // namespace kiln
