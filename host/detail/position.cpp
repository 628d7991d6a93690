// The map `position`: position of the high poly's point.
#include "detail/point_map.h"
#include "detail/value_ranges.h"

namespace kiln {

MapRow position_map() {
  MapRow row;
  row.info = {MapKind{"position"},
              3,
              MapType::vector,
              "point of the high poly in object space, from the map's origin, world units",
              0,
              0};
  row.info.options = "encoding.origin";
  row.follows_positions = true;
  row.supports_streaming = true;
  row.unit = "world units";
  row.range = range_of_bounds;
  row.make = [](const MapRequest& request) {
    const std::array<double, 3> origin = map_origin(request.options, request.source.frame);
    return make_point_map(
        request, position_map().info,
        [origin](const HighPoint& point, float* value) {
          value[0] = static_cast<float>(point.position.x - origin[0]);
          value[1] = static_cast<float>(point.position.y - origin[1]);
          value[2] = static_cast<float>(point.position.z - origin[2]);
        },
        PointNeeds{.normal = false, .offset = false, .distance = false});
  };
  return row;
}

}  // namespace kiln
