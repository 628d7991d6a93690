// The high poly's own UVs.
#include "detail/point_map.h"
#include "mesh/uv_grid.h"
#include "source/high_poly_uvs.h"

namespace kiln {

MapRow uv_map() {
  MapRow row;
  row.info = {MapKind{"uv"}, 3, MapType::vector, "UV of the high poly: u, v, 0", 0, 1};
  row.unit = "of the layout";
  row.make = [](const MapRequest& request) {
    const Source::Impl& source = request.source;
    if (!has_uvs(source)) {
      throw Error(ErrorCode::input,
                  "The high poly has no UVs, which the map uv holds: give it a layout, or leave "
                  "the map out.");
    }
    return make_point_map(request, uv_map().info, [&source](const HighPoint& point, float* value) {
      if (!point.found) return;  // A missed sample keeps the value 0
      const Triangle& corners = source.uv_triangles[point.triangle];
      const double weights[3] = {1.0 - point.u - point.v, point.u, point.v};
      double u = 0, v = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2& uv = source.uvs[corners[k]];
        if (!is_finite(uv)) return;  // A point on a triangle without UVs keeps the value 0
        u += uv.x * weights[k];
        v += uv.y * weights[k];
      }
      value[0] = static_cast<float>(u);
      value[1] = static_cast<float>(v);
    });
  };
  return row;
}

}  // namespace kiln
