// Displacement: the vector from the low poly's point to the high poly's.
#include "detail/low_frames.h"
#include "detail/point_map.h"
#include "detail/value_ranges.h"

namespace kiln {
namespace {

class Displacement : public PointFunction {
 public:
  explicit Displacement(const MapRequest& request) : frames_(request) {}

  void operator()(const HighPoint& point, float* value) const override {
    const Vec3d components = frames_.transform_to_space(point, point.offset);
    value[0] = static_cast<float>(components.x);
    value[1] = static_cast<float>(components.y);
    value[2] = static_cast<float>(components.z);
  }

 private:
  LowFrames frames_;
};

}  // namespace

MapRow displacement_map() {
  MapRow row;
  row.info = {MapKind{"displacement"},
              3,
              MapType::vector,
              "vector from low poly to high poly, in the space of the normals, world units",
              0,
              0};
  row.follows_positions = true;
  row.supports_streaming = true;
  row.unit = "world units";
  row.range = range_of_reach_signed;
  row.make = [](const MapRequest& request) {
    return make_point_map(request, displacement_map().info,
                          std::unique_ptr<PointFunction>(std::make_unique<Displacement>(request)));
  };
  return row;
}

}  // namespace kiln
