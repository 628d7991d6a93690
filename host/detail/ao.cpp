// Ambient occlusion of the high poly.
#include "detail/hemisphere_map.h"

namespace kiln {

MapRow ao_map() {
  MapRow row;
  row.info = {
      MapKind{"ao"},
      1,
      MapType::scalar,
      "ambient occlusion of the high poly by itself: 1 in the open, 0 where everything is hidden",
      0,
      1};
  row.info.options = "occlusion";
  row.info.other_names = "ambient_occlusion occlusion";
  row.follows_positions = row.reads_around = row.supports_streaming = true;
  row.make = [](const MapRequest& request) {
    return make_hemisphere_map(request, &Hemispheres::visibility);
  };
  return row;
}

}  // namespace kiln
