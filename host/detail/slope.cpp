// Slope of the high poly.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "detail/point_map.h"

namespace kiln {

MapRow slope_map() {
  MapRow row;
  row.info = {MapKind{"slope"},
              1,
              MapType::scalar,
              "angle between the high poly's normal and +Y, degrees, 0 to 180",
              0,
              180};
  row.unit = "degrees";
  row.supports_streaming = true;
  row.make = [](const MapRequest& request) {
    return make_point_map(request, slope_map().info, [](const HighPoint& point, float* value) {
      const double cosine = std::clamp(point.normal.y, -1.0, 1.0);
      value[0] = static_cast<float>(std::acos(cosine) * 180 / std::numbers::pi);
    });
  };
  return row;
}

}  // namespace kiln
