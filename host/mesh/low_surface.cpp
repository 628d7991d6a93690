#include "mesh/low_surface.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/formatted.h"
#include "base/option.h"
#include "base/parallel.h"
#include "kiln/texture_sets.h"
#include "kiln/validate.h"
#include "mesh/normals.h"
#include "mesh/tangent.h"
#include "mesh/usable.h"
#include "mesh/uv_copies.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr Vec2 kNoUv = {kNaN, kNaN};

std::string quoted(const Mesh& mesh) { return "'" + mesh.name + "'"; }

/// Sets the ray direction and the distances of a corner from a cage.
void apply_cage(const CageCorners& cage, std::size_t index, LowSurface::Corner& corner) {
  const Vec3d offset = to_double(cage.outer_corners[index]) - to_double(corner.position);
  if (cage.kind == CageKind::offsets) {
    corner.direction = to_float(offset);
    return;
  }
  const double outward = length(offset);
  corner.outward = static_cast<float>(outward);
  // Where the shell coincides with the mesh, the corner keeps its direction.
  if (outward > 0) corner.direction = to_float(offset * (1 / outward));
  const Vec3d in = to_double(corner.position) - to_double(cage.inner_corners[index]);
  corner.inward = static_cast<float>(dot(in, to_double(corner.direction)));
}

/// Default length of rays that start on a cage: twice the largest distance to the cage, or between the two shells,
/// because rays between vertices may be more oblique than the offsets at the vertices.
double longest_ray(const LowSurface& surface) {
  double longest_outward = 0, longest_inward = 0;
  for (const std::size_t i : surface.usable_triangles()) {
    for (const LowSurface::Corner& corner : surface.triangles[i]) {
      const bool has_offsets = surface.cage_kind == CageKind::offsets;
      longest_outward = std::max(
          longest_outward, has_offsets ? length(to_double(corner.direction)) : corner.outward);
      longest_inward = std::max(longest_inward, has_offsets ? 0.0 : double{corner.inward});
    }
  }
  return 2 * (longest_outward + longest_inward);
}

bool has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return false;
  const Vec3d normal = cross(to_double(b) - to_double(a), to_double(c) - to_double(a));
  const double size = length(normal);
  return size > 0 && std::isfinite(size);
}

/// Uses a tangent that the caller has given. Returns false if the tangent has length 0 or is not finite.
bool use_given_tangent(const Tangent& given, Vec3& direction, float& sign) {
  const double size = length(to_double(given.direction));
  if (!(size > 0 && std::isfinite(size))) return false;
  direction = to_float(to_double(given.direction) * (1 / size));
  sign = given.sign < 0 ? -1.0F : 1.0F;
  return true;
}

/// The caller's tangents. Missing ones are replaced by those of MikkTSpace.
/// \param at  function that returns position and normal of a corner
template <typename At>
std::vector<Tangent> corner_tangents(const Mesh& low, const At& at) {
  const std::size_t count = low.triangles.size();
  std::vector<Tangent> result(3 * count);
  const auto take_given = [&] {
    bool are_all_given = !low.tangents.empty();
    for (std::size_t i = 0; i < low.tangents.size(); ++i) {
      are_all_given =
          use_given_tangent(low.tangents[i], result[i].direction, result[i].sign) && are_all_given;
    }
    return are_all_given;
  };
  if (take_given()) return result;
  std::vector<Vec3> positions(3 * count), normals(3 * count);
  std::vector<Vec2> uvs(3 * count);
  parallel_for(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [position, normal] = at(t, k);
        positions[3 * t + k] = position;
        normals[3 * t + k] = normal;
        uvs[3 * t + k] = low.uvs[low.uv_triangles[t][k]];
      }
    }
  });
  const std::vector<CornerTangent> tangents = mikk_tangents(positions, normals, uvs);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = {tangents[i].tangent, tangents[i].sign};
  }
  take_given();
  return result;
}

bool has_uv_area(const std::array<LowSurface::Corner, 3>& corners) {
  const auto& [a, b, c] = corners;
  const double area = (double{b.uv.x} - a.uv.x) * (double{c.uv.y} - a.uv.y) -
                      (double{b.uv.y} - a.uv.y) * (double{c.uv.x} - a.uv.x);
  return std::isfinite(area) && area != 0;
}

}  // namespace

std::vector<float> LowSurface::shell(bool inner_corners) const {
  std::vector<float> shell_values(6 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (usable[t] == 0) continue;
    const auto& [a, b, c] = triangles[t];
    Vec3d normal = cross(to_double(b.position) - to_double(a.position),
                         to_double(c.position) - to_double(a.position));
    normal = normal * (1 / length(normal));
    const Vec3 unit = to_float(normal);
    shell_values[6 * t] = unit.x;
    shell_values[6 * t + 1] = unit.y;
    shell_values[6 * t + 2] = unit.z;
    for (std::size_t k = 0; k < 3; ++k) {
      const Corner& corner = triangles[t][k];
      const double shell_distance = inner_corners ? corner.inward : corner.outward;
      shell_values[6 * t + 3 + k] =
          static_cast<float>(shell_distance * dot(to_double(corner.direction), normal));
    }
  }
  return shell_values;
}

void LowSurface::check(const Mesh& low) {
  validate(low);
  if (low.uvs.empty() || low.uv_triangles.empty()) {
    throw Error(
        ErrorCode::input,
        "Mesh " + quoted(low) +
            " has no UVs, so there is nowhere to bake to. Unwrap it in a modelling tool, or let "
            "Kiln do it: " +
            option("unwrap()") + " gives this mesh UVs, and " + option("simplify()") +
            " makes a low poly to "
            "unwrap.");
  }
}

LowSurface LowSurface::of(const Mesh& low, const Frame& frame, const Mesh* cage, UvCopies copies) {
  check(low);
  LowSurface surface = without_uvs(low, frame, cage);
  surface.lay_out(low, find_with_uvs(low));
  find_uv_copies(low, copies, surface);
  return surface;
}

LowSurface LowSurface::without_uvs(const Mesh& low, const Frame& frame, const Mesh* cage) {
  const std::vector<Vec3> positions = frame.to_frame(low);
  const CornerNormals normals = corner_normals(low, positions);
  CageCorners corners;
  if (cage != nullptr) corners = read_cage(low, *cage, frame);
  std::vector<Vec3> continuous_vertex_directions;
  if (cage == nullptr || corners.kind != CageKind::offsets) {
    continuous_vertex_directions = continuous_directions(positions, low.triangles, normals);
  }

  const std::size_t count = low.triangles.size();
  LowSurface surface;
  surface.has_cage_mesh = cage != nullptr;
  surface.cage_kind = corners.kind;
  surface.cage_hull = corners.hull;
  surface.triangles.resize(count);
  surface.usable.resize(count);
  parallel_for(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      bool is_finite_triangle = true;
      for (std::size_t k = 0; k < 3; ++k) {
        Corner& corner = surface.triangles[t][k];
        const std::uint32_t vertex = low.triangles[t][k];
        corner.position = positions[vertex];
        corner.normal = normals.normals[normals.triangles[t][k]];
        corner.uv = kNoUv;
        if (!low.colors.empty()) {
          corner.straight = static_cast<float>(low.colors[vertex][0]) / 255.0F;
        }
        if (!continuous_vertex_directions.empty()) {
          // On a card without thickness, the opposite normals of both sides cancel out. Each side then uses its own
          // normal.
          corner.direction = continuous_vertex_directions[vertex] == Vec3{}
                                 ? corner.normal
                                 : continuous_vertex_directions[vertex];
        }
        if (!corners.outer_corners.empty()) apply_cage(corners, 3 * t + k, corner);
        is_finite_triangle =
            is_finite_triangle && is_finite(corner.direction) && std::isfinite(corner.inward);
      }
      const auto& [a, b, c] = surface.triangles[t];
      surface.usable[t] =
          is_finite_triangle && has_area(a.position, b.position, c.position) ? 1 : 0;
    }
  });

  const bool any_usable = std::any_of(surface.usable.begin(), surface.usable.end(),
                                      [](std::uint8_t one) { return one != 0; });
  if (!any_usable && count_without_area(low.positions, low.triangles) < count) {
    const std::string text = formatted("%.3g", frame.diagonal);
    throw Error(ErrorCode::input,
                "Mesh " + quoted(low) +
                    " is so small relative to the high poly, whose diagonal is " + text +
                    ", that rounding leaves it no area: check the high poly for outlying vertices, "
                    "and the units of both meshes.");
  }
  if (!any_usable) {
    throw Error(ErrorCode::input, "Mesh " + quoted(low) +
                                      " has no triangle with finite, distinct " +
                                      "corners among its " + std::to_string(count) +
                                      ": check the file's coordinates" +
                                      (cage != nullptr ? " and the cage's." : "."));
  }
  if (cage != nullptr && corners.hull == nullptr) surface.cage_length = longest_ray(surface);
  return surface;
}

std::vector<std::uint32_t> LowSurface::find_with_uvs(const Mesh& low) {
  std::vector<std::uint32_t> result;
  for (std::uint32_t t = 0; t < low.uv_triangles.size(); ++t) {
    const Triangle& corners = low.uv_triangles[t];
    if (std::all_of(corners.begin(), corners.end(), [&](const std::uint32_t corner) {
          return std::isfinite(low.uvs[corner].x) && std::isfinite(low.uvs[corner].y);
        })) {
      result.push_back(t);
    }
  }
  return result;
}

void LowSurface::lay_out(const Mesh& low, std::vector<std::uint32_t> laid_out) {
  for (const std::uint32_t t : with_uvs) {
    for (Corner& corner : triangles[t]) corner.uv = kNoUv;
  }
  with_uvs = std::move(laid_out);
  std::atomic<bool> all_given = !low.tangents.empty();
  parallel_for(with_uvs.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    bool are_all_given = !low.tangents.empty();
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t t = with_uvs[i];
      for (std::size_t k = 0; k < 3; ++k) {
        Corner& corner = triangles[t][k];
        corner.uv = low.uvs[low.uv_triangles[t][k]];
        are_all_given = are_all_given &&
                        use_given_tangent(low.tangents[3 * t + k], corner.tangent, corner.sign);
      }
    }
    if (!are_all_given) all_given = false;
  });
  const bool any_mapped = std::any_of(with_uvs.begin(), with_uvs.end(), [&](const std::uint32_t t) {
    return usable[t] != 0 && has_uv_area(triangles[t]);
  });
  if (!any_mapped) {
    throw Error(ErrorCode::input,
                "All UVs of mesh " + quoted(low) +
                    " are degenerate (no triangle has an area in UV space), so there is nowhere to "
                    "bake to. Unwrap it in a modelling tool, or let Kiln do it: " +
                    option("unwrap()") +
                    " gives this "
                    "mesh UVs, and " +
                    option("simplify()") + " makes a low poly to unwrap.");
  }

  copy_of.clear();
  if (all_given) return;
  const std::vector<Tangent> tangents = corner_tangents(low, [&](std::size_t t, std::size_t k) {
    return std::pair(triangles[t][k].position, triangles[t][k].normal);
  });
  for (std::size_t i = 0; i < tangents.size(); ++i) {
    triangles[i / 3][i % 3].tangent = tangents[i].direction;
    triangles[i / 3][i % 3].sign = tangents[i].sign;
  }
}

std::vector<Tangent> tangents_of(const Mesh& low) {
  LowSurface::check(low);
  const std::vector<Vec3> positions = Frame::of(low).to_frame(low);
  const CornerNormals normals = corner_normals(low, positions);
  return corner_tangents(low, [&](std::size_t t, std::size_t k) {
    return std::pair(positions[low.triangles[t][k]], normals.normals[normals.triangles[t][k]]);
  });
}

}  // namespace kiln
