// Thickness of the high poly under its surface.
#include "detail/hemisphere_map.h"

namespace kiln {

MapRow thickness_map() {
  MapRow row;
  row.info = {MapKind{"thickness"},
              1,
              MapType::scalar,
              "thickness of the high poly: the mean distance inward to its other side, as a share "
              "of the requested distance, at most 1",
              0,
              1};
  row.info.options = "occlusion.rays occlusion.distance";
  row.follows_positions = row.reads_around = row.supports_streaming = true;
  row.make = [](const MapRequest& request) {
    return make_hemisphere_map(request, &Hemispheres::thickness);
  };
  return row;
}

}  // namespace kiln
