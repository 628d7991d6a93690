// The maps of visibility directions of the low poly's points, and of their deviation (Tarini,
// Cignoni, Scopigno 2003, section 3.3, equations 1 and 3, figure 4). The directions are those that
// the match used.
#include <algorithm>
#include <cmath>

#include "detail/point_map.h"

namespace kiln {
namespace {

MapRow visibility_row(std::string_view name, std::uint32_t channels, MapType type,
                      std::string_view contents, float low) {
  MapRow row;
  row.info = {MapKind{name}, channels, type, contents, low, 1};
  row.info.options = "match.visibility";
  // The map depends only on the match, and a session that bakes texels again because normals
  // changed does not know their visibility directions. This flag excludes the map from such
  // updates.
  row.follows_positions = true;
  return row;
}

}  // namespace

MapRow visibility_map() {
  MapRow row =
      visibility_row("visibility", 3, MapType::vector,
                     "visibility direction v: the mean of the directions from which the low poly's "
                     "point is visible, object space; its length measures their agreement",
                     -1);
  row.unit = "of a unit length";
  row.make = [](const MapRequest& request) {
    return make_point_map(request, visibility_map().info, [](const HighPoint& point, float* value) {
      value[0] = static_cast<float>(point.seen.x);
      value[1] = static_cast<float>(point.seen.y);
      value[2] = static_cast<float>(point.seen.z);
    });
  };
  return row;
}

MapRow deviation_map() {
  MapRow row = visibility_row(
      "deviation", 1, MapType::scalar,
      "standard deviation of the visibility directions, sqrt(1 - |v|^2): 0 where only one "
      "direction sees the point, 1 where the directions cancel out or none sees it",
      0);
  row.unit = "of a unit length";
  row.make = [](const MapRequest& request) {
    return make_point_map(request, deviation_map().info, [](const HighPoint& point, float* value) {
      const double squared_length = dot(point.seen, point.seen);
      value[0] = static_cast<float>(std::sqrt(std::max(0.0, 1 - squared_length)));
    });
  };
  return row;
}

}  // namespace kiln
