// The high poly's edges.
#include <algorithm>
#include <cmath>

#include "detail/point_map.h"

namespace kiln {
namespace {

/// Draws the edges of the high poly. The value is 1 on an edge and falls to 0 at a distance of one
/// texel, so a line has the same brightness wherever it lies between texel centres. The length of a
/// texel is an average for each triangle of the low poly: the square root of (area of the triangle
/// / area of its UV triangle in texels).
class Wireframe : public PointFunction {
 public:
  explicit Wireframe(const MapRequest& request) : source_(request.source) {
    const double texels = double{1} * request.options.width * request.options.height;
    for (const auto& [a, b, c] : request.surface.triangles) {
      const Vec3d first = to_double(a.position);
      const double area =
          length(cross(to_double(b.position) - first, to_double(c.position) - first));
      const double covered = std::abs((double{b.uv.x} - a.uv.x) * (double{c.uv.y} - a.uv.y) -
                                      (double{c.uv.x} - a.uv.x) * (double{b.uv.y} - a.uv.y)) *
                             texels;
      texel_lengths_.push_back(covered > 0 ? std::sqrt(area / covered) : 0);
    }
  }

  void operator()(const HighPoint& point, float* value) const override {
    if (!point.found) return;  // A missed sample keeps the value 0
    const Triangle& corners = source_.triangles[point.triangle];
    const Vec3d p[3] = {to_double(source_.positions[corners[0]]),
                        to_double(source_.positions[corners[1]]),
                        to_double(source_.positions[corners[2]])};
    const double weights[3] = {1.0 - point.u - point.v, point.u, point.v};
    const double doubled_area = length(cross(p[1] - p[0], p[2] - p[0]));
    // The distance to the nearest edge equals that to the nearest of the three lines through the
    // edges: the perpendicular to this line cannot leave the triangle, since it would have to cross
    // a nearer line first.
    double nearest_edge_distance = 1;  // Greater than any distance in the frame
    for (std::size_t k = 0; k < 3; ++k) {
      const double edge = length(p[(k + 2) % 3] - p[(k + 1) % 3]);
      if (edge > 0)
        nearest_edge_distance =
            std::min(nearest_edge_distance, std::max(0.0, weights[k]) * doubled_area / edge);
    }
    const double texel_length = texel_lengths_[point.low_triangle];
    if (nearest_edge_distance < texel_length)
      value[0] = static_cast<float>(1 - nearest_edge_distance / texel_length);
  }

 private:
  const Source::Impl& source_;
  // length of a texel in frame units, for each triangle of the low poly
  std::vector<double> texel_lengths_;
};

}  // namespace

MapRow wireframe_map() {
  MapRow row;
  row.info = {MapKind{"wireframe"},
              1,
              MapType::scalar,
              "edges of the high poly: 1 on an edge, 0 from a distance of one texel on",
              0,
              1};
  row.info.other_names = "wireframe_and_ray_fails";
  row.follows_positions = row.depends_on_texel_size = row.supports_streaming = true;
  row.make = [](const MapRequest& request) {
    return make_point_map(request, wireframe_map().info,
                          std::unique_ptr<PointFunction>(std::make_unique<Wireframe>(request)));
  };
  return row;
}

}  // namespace kiln
