#include "texel/device_correspondence.h"

namespace kiln {

DeviceCorrespondence::DeviceCorrespondence(cl::Context& context, std::uint32_t plane_capacity,
                                           bool with_seen)
    : capacity(plane_capacity),
      triangle(context, plane_capacity),
      barycentric(context, std::size_t{2} * plane_capacity),
      distance(context, plane_capacity),
      status(context, plane_capacity),
      seen(with_seen ? cl::Array<float>(context, std::size_t{3} * plane_capacity)
                     : cl::Array<float>()) {}

}  // namespace kiln
