// Share of a light's disc that is visible past the high poly.
#include "detail/hemisphere_map.h"

namespace kiln {

MapRow shadow_map() {
  MapRow row;
  row.info = {MapKind{"shadow"},
              1,
              MapType::scalar,
              "share of a light's disc that a point of the high poly sees: 0 in shadow, and where "
              "the surface faces away from the light",
              0,
              1};
  row.info.options =
      "light occlusion.rays occlusion.distance occlusion.back_faces occlusion.by_high "
      "occlusion.by_low occlusion.by_others occlusion.own_part";
  row.follows_positions = row.reads_around = row.supports_streaming = true;
  row.make = [](const MapRequest& request) {
    return make_hemisphere_map(request, &Hemispheres::shadow);
  };
  return row;
}

}  // namespace kiln
