#include "kiln/mesh_view.h"

#include <string>

#include "base/parallel.h"
#include "kiln/validate.h"

namespace kiln {
namespace {

constexpr std::size_t kCopiesPerTask = std::size_t{1} << 15;

/// Calls put(i) for each element, in parallel.
template <typename Put>
void put_in_parallel(std::size_t count, const Put& put) {
  parallel_for(count, kCopiesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) put(i);
  });
}

void check_view(const MeshView& view) {
  const auto fail = [&](const std::string& problem) {
    throw Error(ErrorCode::input, "Mesh '" + std::string(view.name) + "' has " + problem,
                "mesh-size");
  };
  const std::size_t count = view.positions.size();
  const auto check_count = [&](std::size_t given, const char* what) {
    if (given == 0 || given == count) return;
    fail(std::to_string(count) + " positions but " + std::to_string(given) + " " + what +
         ": give one to each vertex, or none at all.");
  };
  check_count(view.normals.size(), "normals");
  check_count(view.uvs.size(), "uvs");
  check_count(view.tangents.size(), "tangents");
  check_count(view.colors.size(), "colors");
  if (count > 0xFFFFFFFFU) fail("more than 4294967295 positions: split it.");
  if (!view.indices.empty() && !view.indices_16.empty()) {
    fail("both indices and indices_16: give only one of them.");
  }
  const std::size_t corners = !view.indices.empty()      ? view.indices.size()
                              : !view.indices_16.empty() ? view.indices_16.size()
                                                         : count;
  if (corners % 3 != 0) {
    fail(std::to_string(corners) +
         " corners, which is not a multiple of 3: give three per triangle.");
  }
}

std::vector<Triangle> triangles_of(const MeshView& view) {
  const auto gather_triangles = [](std::size_t corners, const auto& index) {
    std::vector<Triangle> triangles(corners / 3);
    put_in_parallel(triangles.size(), [&](std::size_t t) {
      triangles[t] = {index(3 * t), index(3 * t + 1), index(3 * t + 2)};
    });
    return triangles;
  };
  if (!view.indices.empty()) {
    return gather_triangles(view.indices.size(), [&](std::size_t i) { return view.indices[i]; });
  }
  if (!view.indices_16.empty()) {
    return gather_triangles(view.indices_16.size(),
                            [&](std::size_t i) { return std::uint32_t{view.indices_16[i]}; });
  }
  return gather_triangles(view.positions.size(),
                          [](std::size_t i) { return static_cast<std::uint32_t>(i); });
}

void copy_tangents(const MeshView& view, Mesh& mesh) {
  if (view.tangents.empty()) return;
  mesh.tangents.resize(3 * mesh.triangles.size());
  put_in_parallel(mesh.triangles.size(), [&](std::size_t t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<float, 4> tangent = view.tangents[mesh.triangles[t][k]];
      mesh.tangents[3 * t + k] = {{tangent[0], tangent[1], tangent[2]}, tangent[3]};
    }
  });
}

}  // namespace

Mesh to_mesh(const MeshView& view) {
  check_view(view);
  Mesh mesh;
  mesh.name = view.name;
  mesh.origin = view.origin;
  mesh.positions.resize(view.positions.size());
  put_in_parallel(view.positions.size(), [&](std::size_t i) {
    const std::array<float, 3> p = view.positions[i];
    mesh.positions[i] = {p[0], p[1], p[2]};
  });
  mesh.triangles = triangles_of(view);
  if (!view.normals.empty()) {
    mesh.normals.resize(view.normals.size());
    put_in_parallel(view.normals.size(), [&](std::size_t i) {
      const std::array<float, 3> n = view.normals[i];
      mesh.normals[i] = {n[0], n[1], n[2]};
    });
    mesh.normal_triangles = mesh.triangles;
  }
  if (!view.uvs.empty()) {
    mesh.uvs.resize(view.uvs.size());
    put_in_parallel(view.uvs.size(), [&](std::size_t i) {
      const std::array<float, 2> uv = view.uvs[i];
      mesh.uvs[i] = {uv[0], view.flip_v ? 1 - uv[1] : uv[1]};
    });
    mesh.uv_triangles = mesh.triangles;
  }
  if (!view.colors.empty()) {
    mesh.colors.resize(view.colors.size());
    put_in_parallel(view.colors.size(), [&](std::size_t i) { mesh.colors[i] = view.colors[i]; });
  }
  validate(mesh);  // Checks all indices before they are used
  copy_tangents(view, mesh);
  return mesh;
}

}  // namespace kiln
