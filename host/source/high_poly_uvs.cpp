#include "source/high_poly_uvs.h"

#include <string>

#include "base/counted.h"

namespace kiln {

bool has_uvs(const Source::Impl& source) {
  if (source.uvs.empty() || source.uv_triangles.empty()) return false;
  if (source.uv_triangles.size() != source.triangles.size()) {
    throw Error(ErrorCode::input,
                "The high poly has " + std::to_string(source.triangles.size()) + " triangles but " +
                    std::to_string(source.uv_triangles.size()) +
                    " triples of UV indices: give one to each triangle, or none at all.");
  }
  for (std::size_t t = 0; t < source.uv_triangles.size(); ++t) {
    for (const std::uint32_t index : source.uv_triangles[t]) {
      if (index < source.uvs.size()) continue;
      throw Error(ErrorCode::input, "Triangle " + std::to_string(t) + " of the high poly uses UV " +
                                        std::to_string(index) + ", but " +
                                        there_are_only(source.uvs.size()) +
                                        ": the mesh is corrupt, export it again.");
    }
  }
  return true;
}

}  // namespace kiln
