// Height of the high poly above the low poly, negative below.
#include "detail/point_map.h"
#include "detail/value_ranges.h"

namespace kiln {

MapRow height_map() {
  MapRow row;
  row.info = {MapKind{"height"},
              1,
              MapType::signed_scalar,
              "signed distance from low poly to high poly along the match's direction, world units",
              0,
              0};
  row.info.other_names = "bump";
  row.follows_positions = true;
  row.supports_streaming = true;
  row.unit = "world units";
  row.range = range_of_reach_signed;
  row.make = [](const MapRequest& request) {
    return make_point_map(
        request, height_map().info,
        [](const HighPoint& point, float* value) { value[0] = static_cast<float>(point.distance); },
        PointNeeds{.position = false, .normal = false});
  };
  return row;
}

}  // namespace kiln
