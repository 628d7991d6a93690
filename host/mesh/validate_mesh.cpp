// Checks the invariants of meshes that all other code relies on.
#include <atomic>
#include <cmath>
#include <string>

#include "base/counted.h"
#include "base/parallel.h"
#include "kiln/validate.h"

namespace kiln {
namespace {

constexpr std::size_t kChecksPerTask = std::size_t{1} << 16;

[[noreturn]] void fail(const Mesh& mesh, const std::string& problem, const char* id) {
  throw Error(ErrorCode::input, "Mesh '" + mesh.name + "' " + problem, id);
}

/// The first index for which `good` is false; `count` if there is none.
template <typename Good>
std::size_t find_first_bad(std::size_t count, const Good& good) {
  std::atomic<std::size_t> first_failing{count};
  parallel_for(count, kChecksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (good(i)) continue;
      std::size_t seen = first_failing;
      while (i < seen && !first_failing.compare_exchange_weak(seen, i)) {
      }
      return;
    }
  });
  return first_failing;
}

void check_indices(const Mesh& mesh, const std::vector<Triangle>& list, std::size_t pool,
                   const char* what) {
  const std::size_t bad = find_first_bad(list.size(), [&](std::size_t t) {
    return list[t][0] < pool && list[t][1] < pool && list[t][2] < pool;
  });
  if (bad == list.size()) return;
  std::size_t corner = 0;
  while (list[bad][corner] < pool) ++corner;
  throw Error(ErrorCode::input,
              "Triangle " + std::to_string(bad) + " of mesh '" + mesh.name + "' uses " + what +
                  " " + std::to_string(list[bad][corner]) + ", but " + there_are_only(pool) +
                  ": the mesh is corrupt, export it again.",
              "mesh-index");
}

/// Checks that an attribute has one entry per triangle, or none at all.
void check_parallel(const Mesh& mesh, std::size_t count, const char* what) {
  if (count == 0 || count == mesh.triangles.size()) return;
  fail(mesh,
       "has " + std::to_string(mesh.triangles.size()) + " triangles but " + std::to_string(count) +
           " " + what + ": give one to each triangle, or none at all.",
       "mesh-size");
}

/// Checks the indices of names that triangles have.
void check_names(const Mesh& mesh, const std::vector<std::uint32_t>& of_triangles,
                 const std::vector<std::string>& names, const std::string& what) {
  check_parallel(mesh, of_triangles.size(), (what + "s").c_str());
  const std::size_t bad = find_first_bad(
      of_triangles.size(), [&](std::size_t t) { return of_triangles[t] < names.size(); });
  if (bad == of_triangles.size()) return;
  fail(mesh,
       "has triangle " + std::to_string(bad) + " in " + what + " " +
           std::to_string(of_triangles[bad]) + ", but only " + std::to_string(names.size()) + " " +
           what + "_names.",
       "mesh-group");
}

void check_polygons(const Mesh& mesh) {
  const std::vector<std::uint32_t>& polygons = mesh.polygons;
  check_parallel(mesh, polygons.size(), "polygons");
  const std::size_t bad = find_first_bad(polygons.size(), [&](std::size_t t) {
    const std::uint32_t last = t == 0 ? 0 : polygons[t - 1];
    return polygons[t] == last || (t != 0 && polygons[t] == last + 1);
  });
  if (bad == polygons.size()) return;
  fail(mesh,
       "has polygon " + std::to_string(polygons[bad]) + " at triangle " + std::to_string(bad) +
           ": polygon indices must start at 0, increase, and be contiguous.",
       "mesh-polygon");
}

}  // namespace

void validate(const Mesh& mesh) {
  for (const double coordinate : mesh.origin) {
    if (!std::isfinite(coordinate)) fail(mesh, "has an origin that is not finite.", "mesh-origin");
  }
  check_indices(mesh, mesh.triangles, mesh.positions.size(), "position");
  check_parallel(mesh, mesh.uv_triangles.size(), "triples of UV indices");
  check_indices(mesh, mesh.uv_triangles, mesh.uvs.size(), "UV");
  check_parallel(mesh, mesh.normal_triangles.size(), "triples of normal indices");
  check_indices(mesh, mesh.normal_triangles, mesh.normals.size(), "normal");
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size()) {
    fail(mesh,
         "has " + std::to_string(mesh.positions.size()) + " positions but " +
             std::to_string(mesh.colors.size()) +
             " colors: give one to each position, or none at all.",
         "mesh-size");
  }
  if (!mesh.tangents.empty() && mesh.tangents.size() != 3 * mesh.triangles.size()) {
    fail(mesh,
         "has " + std::to_string(mesh.triangles.size()) + " triangles but " +
             std::to_string(mesh.tangents.size()) +
             " tangents: give one to each corner, or none at all.",
         "mesh-size");
  }
  check_names(mesh, mesh.groups, mesh.group_names, "group");
  check_names(mesh, mesh.objects, mesh.object_names, "object");
  check_names(mesh, mesh.materials, mesh.material_names, "material");
  check_polygons(mesh);
}

}  // namespace kiln
