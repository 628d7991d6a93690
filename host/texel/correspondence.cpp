#include "texel/correspondence.h"

namespace kiln {

Correspondence::Correspondence(cl::Context& context, std::uint32_t plane_capacity)
    : capacity(plane_capacity),
      triangle(context, plane_capacity),
      barycentric(context, std::size_t{2} * plane_capacity),
      distance(context, plane_capacity),
      status(context, plane_capacity) {}

}  // namespace kiln
