#include "mesh/low_surface.h"

#include <cmath>
#include <string>

#include "base/parallel.h"
#include "kiln/validate.h"
#include "mesh/normals.h"
#include "mesh/tangent.h"
#include "mesh/uv_copies.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

std::string quoted(const Mesh& mesh) { return "'" + mesh.name + "'"; }

void check_mesh(const Mesh& low) {
  validate(low);
  if (low.uvs.empty() || low.uv_triangles.empty()) {
    throw Error(
        ErrorCode::input,
        "Mesh " + quoted(low) +
            " has no UVs, so there is nowhere to bake to. Unwrap it in a modelling tool, or let "
            "Kiln do it: unwrap() gives this mesh UVs, and simplify() makes a light mesh to "
            "unwrap.");
  }
}

/// The cage must have the same triangles, and no vertex that is torn apart on it.
void check_cage(const Mesh& low, const Mesh& cage, std::span<const Vec3> cage_positions) {
  const std::string advice =
      " A cage is the light mesh with its vertices moved: copy the mesh, push it out, and export "
      "both "
      "with the same settings.";
  if (cage.triangles.size() != low.triangles.size()) {
    throw Error(ErrorCode::input, "The cage " + quoted(cage) + " has " +
                                      std::to_string(cage.triangles.size()) +
                                      " triangles and the light mesh " + quoted(low) + " has " +
                                      std::to_string(low.triangles.size()) + "." + advice);
  }
  validate(cage);
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::vector<std::uint32_t> partner(low.positions.size(), kNone);
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& known = partner[low.triangles[t][k]];
      const std::uint32_t now = cage.triangles[t][k];
      if (known == kNone) known = now;
      if (known == now || cage_positions[known] == cage_positions[now]) continue;
      if (!is_finite(cage_positions[known]) || !is_finite(cage_positions[now])) continue;
      throw Error(
          ErrorCode::input,
          "The cage " + quoted(cage) + " does not match the light mesh " + quoted(low) +
              ": corner " + std::to_string(k) + " of triangle " + std::to_string(t) +
              " is vertex " + std::to_string(low.triangles[t][k]) +
              " of the light mesh, which lies elsewhere on the cage in an earlier triangle." +
              advice);
    }
  }
}

bool has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return false;
  const Vec3d normal = cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a));
  const double size = length(normal);
  return size > 0 && std::isfinite(size);
}

/// The caller's own tangent, where it has a direction.
void take_tangent(const Tangent& given, LowSurface::Corner& corner) {
  const double size = length(Vec3d(given.direction));
  if (!(size > 0) || !std::isfinite(size)) return;
  corner.tangent = to_float(Vec3d(given.direction) * (1 / size));
  corner.sign = given.sign < 0 ? -1.0F : 1.0F;
}

bool has_uv_area(const std::array<LowSurface::Corner, 3>& corners) {
  const auto& [a, b, c] = corners;
  const double area = (double{b.uv.x} - a.uv.x) * (double{c.uv.y} - a.uv.y) -
                      (double{b.uv.y} - a.uv.y) * (double{c.uv.x} - a.uv.x);
  return std::isfinite(area) && area != 0;
}

}  // namespace

LowSurface LowSurface::of(const Mesh& low, const Frame& frame, const Mesh* cage, UvCopies copies) {
  check_mesh(low);
  const std::vector<Vec3> positions = frame.to_frame(low);
  const CornerNormals normals = corner_normals(low, positions);
  std::vector<Vec3> directions;
  std::vector<Vec3> cage_positions;
  if (cage != nullptr) {
    cage_positions = frame.to_frame(*cage);
    check_cage(low, *cage, cage_positions);
  } else {
    directions = continuous_directions(positions, low.triangles, normals);
  }

  const std::size_t count = low.triangles.size();
  LowSurface surface;
  surface.has_cage_mesh = cage != nullptr;
  surface.triangles.resize(count);
  surface.usable.resize(count);
  std::vector<Vec3> corner_position(3 * count);
  std::vector<Vec3> corner_normal(3 * count);
  std::vector<Vec2> corner_uv(3 * count);
  parallel_for(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      bool finite = true;
      for (std::size_t k = 0; k < 3; ++k) {
        Corner& corner = surface.triangles[t][k];
        const std::uint32_t vertex = low.triangles[t][k];
        corner.position = positions[vertex];
        corner.normal = normals.normals[normals.triangles[t][k]];
        corner.uv = low.uvs[low.uv_triangles[t][k]];
        if (!low.colors.empty()) {
          corner.straight = static_cast<float>(low.colors[vertex][0]) / 255.0F;
        }
        if (cage != nullptr) {
          corner.direction =
              to_float(Vec3d(cage_positions[cage->triangles[t][k]]) - Vec3d(corner.position));
        } else {
          // The sides of a card without thickness have no direction in common: each takes its own.
          corner.direction = directions[vertex] == Vec3{} ? corner.normal : directions[vertex];
        }
        finite = finite && is_finite(corner.direction);
        corner_position[3 * t + k] = corner.position;
        corner_normal[3 * t + k] = corner.normal;
        corner_uv[3 * t + k] = corner.uv;
      }
      const auto& [a, b, c] = surface.triangles[t];
      surface.usable[t] = finite && has_area(a.position, b.position, c.position) ? 1 : 0;
    }
  });

  bool any_usable = false;
  bool any_mapped = false;
  for (std::size_t t = 0; t < count; ++t) {
    if (surface.usable[t] == 0) continue;
    any_usable = true;
    any_mapped = any_mapped || has_uv_area(surface.triangles[t]);
  }
  if (!any_usable) {
    throw Error(ErrorCode::input, "Mesh " + quoted(low) +
                                      " has no triangle with finite, distinct " +
                                      "corners among its " + std::to_string(count) +
                                      ": check the file's coordinates" +
                                      (cage != nullptr ? " and the cage's." : "."));
  }
  if (!any_mapped) {
    throw Error(
        ErrorCode::input,
        "All UVs of mesh " + quoted(low) +
            " are degenerate (no triangle has an area in UV space), so there is nowhere to "
            "bake to. Unwrap it in a modelling tool, or let Kiln do it: unwrap() gives this "
            "mesh UVs, and simplify() makes a light mesh to unwrap.");
  }

  const std::vector<CornerTangent> tangents =
      mikk_tangents(corner_position, corner_normal, corner_uv);
  parallel_for(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        Corner& corner = surface.triangles[t][k];
        corner.tangent = tangents[3 * t + k].tangent;
        corner.sign = tangents[3 * t + k].sign;
        if (!low.tangents.empty()) take_tangent(low.tangents[3 * t + k], corner);
      }
    }
  });
  find_uv_copies(low, copies, surface);
  return surface;
}

}  // namespace kiln
