// Converts meshes of OpenMesh (https://www.graphics.rwth-aachen.de/software/openmesh) to meshes of Kiln and back.
// Templates over any TriMesh_ArrayKernelT and PolyMesh_ArrayKernelT: Kiln itself does not link OpenMesh. Programs
// that include this header must link OpenMesh, which the CMake target kiln::kiln_openmesh does.
#pragma once

#include <OpenMesh/Core/System/omstream.hh>
#include <OpenMesh/Core/Utils/vector_traits.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"
#include "kiln/polygon.h"
#include "kiln/types.h"

namespace kiln {
namespace openmesh_detail {

/// Converts a colour channel to a byte: bytes are kept, fractions in [0, 1] are scaled.
template <typename Channel>
std::uint8_t to_byte(Channel value) {
  if constexpr (std::is_floating_point_v<Channel>) {
    const double clamped = value > 0 ? std::min(static_cast<double>(value), 1.0) : 0.0;
    return static_cast<std::uint8_t>(std::lround(255 * clamped));
  } else {
    return static_cast<std::uint8_t>(std::clamp<long long>(value, 0, 255));
  }
}

template <typename Channel>
Channel from_byte(std::uint8_t value) {
  if constexpr (std::is_floating_point_v<Channel>) {
    return static_cast<Channel>(value) / Channel{255};
  } else {
    return static_cast<Channel>(value);
  }
}

/// Origin for positions in single precision: the centre of the bounding box of all finite points if it is
/// farther than kFar diagonals from 0, else 0.
inline std::array<double, 3> origin_of(std::span<const std::array<double, 3>> points) {
  // A mesh farther than this from the world's origin, in diagonals of its bounding box, gets a Mesh::origin. Readers of
  // files use the same threshold
  constexpr double kFar = 16;
  std::array<double, 3> low, high, middle{};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const std::array<double, 3>& p : points) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  if (!(low[0] <= high[0])) return {};
  for (std::size_t k = 0; k < 3; ++k) middle[k] = low[k] + (high[k] - low[k]) / 2;
  const double diagonal = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  const double away = std::hypot(middle[0], middle[1], middle[2]);
  return away > kFar * diagonal ? middle : std::array<double, 3>{};
}

/// Suppresses OpenMesh's own messages about refused faces: to_openmesh() throws instead.
class QuietErrors {
 public:
  QuietErrors() : enabled_(omerr().is_enabled()) { omerr().disable(); }
  ~QuietErrors() {
    if (enabled_) omerr().enable();
  }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

 private:
  bool enabled_;
};

/// Returns the corners of the border of a polygon that was cut into triangles, in order, as corner indices (3 *
/// triangle + corner within it). Empty if the border is not a single loop.
inline std::vector<std::size_t> polygon_corners(const Mesh& mesh, std::size_t first,
                                                std::size_t end) {
  struct Side {
    std::uint32_t from, to;
    std::size_t corner;  ///< Corner at the start of the edge
  };
  std::vector<Side> border;
  for (std::size_t t = first; t < end; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Side side{mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3], 3 * t + k};
      const auto inner = std::find_if(border.begin(), border.end(), [&](const Side& other) {
        return other.from == side.to && other.to == side.from;
      });
      if (inner != border.end()) {
        border.erase(inner);
      } else {
        border.push_back(side);
      }
    }
  }
  std::vector<std::size_t> corners;
  if (border.size() != end - first + 2) return corners;
  std::uint32_t at = mesh.triangles[first][0];
  if (std::none_of(border.begin(), border.end(), [&](const Side& s) { return s.from == at; })) {
    at = border.front().from;
  }
  while (!border.empty()) {
    const auto next = std::find_if(border.begin(), border.end(),
                                   [&](const Side& side) { return side.from == at; });
    if (next == border.end()) return {};
    corners.push_back(next->corner);
    at = next->to;
    border.erase(next);
  }
  return corners;
}

}  // namespace openmesh_detail

/// Makes a mesh of Kiln from a mesh of OpenMesh: TriMesh_ArrayKernelT or PolyMesh_ArrayKernelT with any traits. Deleted
/// vertices and faces are left out; the others keep their order. Polygons are triangulated by a rule; Mesh::polygons
/// groups their triangles. Properties are read if the mesh has them: texture coordinates of halfedges
/// (`halfedge_texcoords2D`, on the halfedge that points to the corner), else of vertices; normals of halfedges, else of
/// vertices (zero or missing normals are computed when needed); colours of vertices, of 3 or 4 bytes or fractions.
/// Points of double precision far from the origin get a Mesh::origin.
/// \param mesh  not changed, and not kept
/// \throws Error(input), id `mesh-size`, for more vertices than 32-bit indices can address
template <typename OpenMeshT>
Mesh from_openmesh(const OpenMeshT& mesh, std::string name = "mesh",
                   Triangulation rule = Triangulation::automatic) {
  using Color = typename OpenMeshT::Color;
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  constexpr std::size_t kChannels = OpenMesh::vector_traits<Color>::size_;
  if (mesh.n_vertices() >= kNone) {
    throw Error(ErrorCode::input, "Mesh '" + name + "' has " + std::to_string(mesh.n_vertices()) +
                                      " vertices, and at most 4294967294 can be used.");
  }
  Mesh result;
  result.name = std::move(name);
  const bool has_colors = mesh.has_vertex_colors();
  const bool corner_uvs = mesh.has_halfedge_texcoords2D();
  const bool vertex_uvs = !corner_uvs && mesh.has_vertex_texcoords2D();
  const bool corner_normals = mesh.has_halfedge_normals();
  const bool vertex_normals = !corner_normals && mesh.has_vertex_normals();
  const bool has_status = mesh.has_vertex_status();
  std::vector<std::uint32_t> number(mesh.n_vertices(), kNone);
  std::vector<std::array<double, 3>> points;
  points.reserve(mesh.n_vertices());
  for (std::size_t i = 0; i < mesh.n_vertices(); ++i) {
    const typename OpenMeshT::VertexHandle v(static_cast<int>(i));
    if (has_status && mesh.status(v).deleted()) continue;
    number[i] = static_cast<std::uint32_t>(points.size());
    const auto& p = mesh.point(v);
    points.push_back(
        {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    if (vertex_uvs) {
      const auto& uv = mesh.texcoord2D(v);
      result.uvs.push_back({static_cast<float>(uv[0]), static_cast<float>(uv[1])});
    }
    if (vertex_normals) {
      const auto& n = mesh.normal(v);
      result.normals.push_back(
          {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
    }
    if (has_colors) {
      const Color& color = mesh.color(v);
      std::array<std::uint8_t, 4> rgba{255, 255, 255, 255};
      for (std::size_t c = 0; c < std::min<std::size_t>(kChannels, 4); ++c) {
        rgba[c] = openmesh_detail::to_byte(color[c]);
      }
      result.colors.push_back(rgba);
    }
  }
  result.origin = openmesh_detail::origin_of(points);
  result.positions.reserve(points.size());
  for (const std::array<double, 3>& p : points) {
    result.positions.push_back({static_cast<float>(p[0] - result.origin[0]),
                                static_cast<float>(p[1] - result.origin[1]),
                                static_cast<float>(p[2] - result.origin[2])});
  }

  const bool faces_have_status = mesh.has_face_status();
  std::vector<std::uint32_t> vertices;
  std::vector<std::array<double, 3>> corners;
  std::uint32_t polygon = 0;
  bool any_polygon = false;
  for (std::size_t f = 0; f < mesh.n_faces(); ++f) {
    const typename OpenMeshT::FaceHandle face(static_cast<int>(f));
    if (faces_have_status && mesh.status(face).deleted()) continue;
    vertices.clear();
    corners.clear();
    const auto first_uv = static_cast<std::uint32_t>(result.uvs.size());
    const auto first_normal = static_cast<std::uint32_t>(result.normals.size());
    for (auto h = mesh.cfh_begin(face), end = mesh.cfh_end(face); h != end; ++h) {
      const auto v = mesh.to_vertex_handle(*h);
      vertices.push_back(number[static_cast<std::size_t>(v.idx())]);
      corners.push_back(points[vertices.back()]);
      if (corner_uvs) {
        const auto& uv = mesh.texcoord2D(*h);
        result.uvs.push_back({static_cast<float>(uv[0]), static_cast<float>(uv[1])});
      }
      if (corner_normals) {
        const auto& n = mesh.normal(*h);
        result.normals.push_back(
            {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
      }
    }
    for (const Triangle& t : triangulate_polygon(corners, rule)) {
      result.triangles.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
      if (corner_uvs) {
        result.uv_triangles.push_back({first_uv + t[0], first_uv + t[1], first_uv + t[2]});
      }
      if (corner_normals) {
        result.normal_triangles.push_back(
            {first_normal + t[0], first_normal + t[1], first_normal + t[2]});
      }
      result.polygons.push_back(polygon);
    }
    any_polygon = any_polygon || corners.size() > 3;
    ++polygon;
  }
  if (!any_polygon) result.polygons.clear();
  if (vertex_uvs) result.uv_triangles = result.triangles;
  if (vertex_normals) result.normal_triangles = result.triangles;
  for (Vec3& n : result.normals) {  // unit length, or zero where normals are computed when needed
    const float length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
    n = length > 0 && std::isfinite(length) ? Vec3{n.x / length, n.y / length, n.z / length}
                                            : Vec3{0, 0, 0};
  }
  return result;
}

/// Makes a mesh of OpenMesh from a mesh of Kiln. Vertices and faces keep their order. A polygon mesh type gets the
/// polygons of Mesh::polygons, a triangle mesh type gets triangles. UVs become texture coordinates of halfedges,
/// normals become normals of halfedges, colours become colours of vertices; the properties are requested if the mesh
/// has the attribute. Positions are Mesh::origin + positions, in the precision of the type.
/// \throws Error(input) for faces that half-edges cannot represent: an edge of more than two faces or of two with
///         opposite winding, a vertex at which surfaces meet in a point only, a face that repeats a vertex. The
///         message names the triangle; clean_mesh() repairs windings, and separate vertices resolve the others
template <typename OpenMeshT>
OpenMeshT to_openmesh(const Mesh& mesh) {
  using Point = typename OpenMeshT::Point;
  using Normal = typename OpenMeshT::Normal;
  using Color = typename OpenMeshT::Color;
  using Uv = typename OpenMeshT::TexCoord2D;
  using Scalar = typename OpenMesh::vector_traits<Point>::value_type;
  using NormalScalar = typename OpenMesh::vector_traits<Normal>::value_type;
  using UvScalar = typename OpenMesh::vector_traits<Uv>::value_type;
  using Channel = typename OpenMesh::vector_traits<Color>::value_type;
  constexpr std::size_t kChannels = OpenMesh::vector_traits<Color>::size_;
  OpenMeshT result;
  const bool has_uvs = !mesh.uv_triangles.empty();
  const bool has_normals = !mesh.normal_triangles.empty();
  if (has_uvs) result.request_halfedge_texcoords2D();
  if (has_normals) result.request_halfedge_normals();
  if (!mesh.colors.empty()) result.request_vertex_colors();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3& p = mesh.positions[i];
    const auto vertex = result.add_vertex(Point(static_cast<Scalar>(mesh.origin[0] + double{p.x}),
                                                static_cast<Scalar>(mesh.origin[1] + double{p.y}),
                                                static_cast<Scalar>(mesh.origin[2] + double{p.z})));
    if (mesh.colors.empty()) continue;
    Color color;
    for (std::size_t c = 0; c < std::min<std::size_t>(kChannels, 4); ++c) {
      color[c] = openmesh_detail::from_byte<Channel>(mesh.colors[i][c]);
    }
    result.set_color(vertex, color);
  }
  const openmesh_detail::QuietErrors quiet;
  for (std::size_t first = 0, end = 0; first < mesh.triangles.size(); first = end) {
    end = first + 1;
    std::vector<std::size_t> corners;
    if constexpr (!OpenMeshT::is_trimesh()) {
      if (!mesh.polygons.empty()) {
        while (end < mesh.triangles.size() && mesh.polygons[end] == mesh.polygons[first]) ++end;
        corners = openmesh_detail::polygon_corners(mesh, first, end);
      }
    }
    // a triangle, or a polygon whose border is not a single loop, which is added as triangles
    if (corners.empty()) {
      end = first + 1;
      corners = {3 * first, 3 * first + 1, 3 * first + 2};
    }
    std::vector<typename OpenMeshT::VertexHandle> vertices;
    for (const std::size_t c : corners) {
      vertices.emplace_back(static_cast<int>(mesh.triangles[c / 3][c % 3]));
    }
    bool twice = false;  // OpenMesh itself does not detect faces that repeat a vertex
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) twice = twice || vertices[i] == vertices[j];
    }
    typename OpenMeshT::FaceHandle face;
    if (!twice) face = result.add_face(vertices);
    if (!face.is_valid()) {
      throw Error(ErrorCode::input,
                  "Mesh '" + mesh.name + "': triangle " + std::to_string(first) +
                      (twice ? " has a vertex twice" : " meets others at an edge or a vertex") +
                      " in a way that half-edges cannot hold. Mend its winding with clean_mesh(), "
                      "or give the surfaces that meet there vertices of their own.");
    }
    for (auto h = result.fh_begin(face), last = result.fh_end(face); h != last; ++h) {
      const auto vertex = result.to_vertex_handle(*h);
      for (const std::size_t c : corners) {
        if (static_cast<int>(mesh.triangles[c / 3][c % 3]) != vertex.idx()) continue;
        if (has_uvs) {
          const Vec2& uv = mesh.uvs[mesh.uv_triangles[c / 3][c % 3]];
          result.set_texcoord2D(*h, Uv(static_cast<UvScalar>(uv.x), static_cast<UvScalar>(uv.y)));
        }
        if (has_normals) {
          const Vec3& n = mesh.normals[mesh.normal_triangles[c / 3][c % 3]];
          result.set_normal(*h,
                            Normal(static_cast<NormalScalar>(n.x), static_cast<NormalScalar>(n.y),
                                   static_cast<NormalScalar>(n.z)));
        }
      }
    }
  }
  return result;
}

}  // namespace kiln
