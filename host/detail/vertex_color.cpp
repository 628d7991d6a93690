// Colours of the high poly's vertices.
#include "base/srgb.h"
#include "detail/point_map.h"
#include "detail/vertex_colors.h"

namespace kiln {

void check_vertex_colors(const Source::Impl& source, const char* map, const char* remedy) {
  if (!source.colors.empty() && source.colors.size() == source.positions.size()) return;
  throw Error(ErrorCode::input, std::string("The high poly has no colours at its vertices, which "
                                            "the map ") +
                                    map + " holds: " + remedy);
}

void read_vertex_color(const Source::Impl& source, const HighPoint& point, float* value) {
  const std::array<float, 256>& linear = linear_values_of_bytes();
  const Triangle& corners = source.triangles[point.triangle];
  const double weights[3] = {1.0 - point.u - point.v, point.u, point.v};
  double sum[4] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::array<std::uint8_t, 4>& color = source.colors[corners[k]];
    for (std::size_t c = 0; c < 3; ++c) sum[c] += double{linear[color[c]]} * weights[k];
    sum[3] += color[3] / 255.0 * weights[k];
  }
  for (std::size_t c = 0; c < 4; ++c) value[c] = static_cast<float>(sum[c]);
}

MapRow vertex_color_map() {
  MapRow row;
  row.info = {MapKind{"vertex_color"},
              3,
              MapType::color,
              "colour of the high poly's vertices, interpolated in linear light",
              0,
              1};
  row.info.missed = MissedTexels::neighbours;
  row.supports_streaming = true;
  row.make = [](const MapRequest& request) {
    const Source::Impl& source = request.source;
    check_vertex_colors(source, "vertex_color",
                        "give a PLY or OBJ that has them, or leave the map out.");
    return make_point_map(request, vertex_color_map().info,
                          [&source](const HighPoint& point, float* value) {
                            if (!point.found) return;
                            float color[4];
                            read_vertex_color(source, point, color);
                            std::copy_n(color, 3, value);
                          });
  };
  return row;
}

}  // namespace kiln
