// Vertex normals: face normals weighted by the angle at the corner.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"
#include "mesh/vector.h"

namespace kiln {

/// Unit normal and corner angles of a triangle; all zero if it is degenerate or not finite.
struct CornerWeights {
  Vec3d normal{};
  std::array<double, 3> angles{};
};
CornerWeights corner_weights(std::span<const Vec3> positions, const Triangle& triangle);

/// Computes the corner weights of a mesh's triangles. All triangles of a polygon have the polygon's normal, which is
/// the sum of their area vectors. At each corner of a polygon, the first triangle has the polygon's interior angle and
/// the others have 0, so that sums over triangles are sums over polygons. A polygon that visits a vertex twice, or has
/// no area, is treated as separate triangles.
/// \param polygons    see Mesh::polygons; if empty, each triangle is a polygon
/// \param begin, end  computes all triangles of the polygons whose first triangle is in this range
/// \param weights     [out] weights[i] belongs to triangle begin + i
void corner_weights(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                    std::span<const std::uint32_t> polygons, std::size_t begin, std::size_t end,
                    CornerWeights* weights);

/// Normalizes a sum of weighted normals; zero if they cancel out.
/// \param total  sum of the weights
Vec3 normalized_sum(const Vec3d& sum, double total);

/// True if a normal is finite and not zero.
bool is_usable_normal(const Vec3& normal);

/// Warns of triangles that have an area and a corner with an invalid normal.
/// \param warnings  [out] the warning is appended
void warn_of_normals(const Mesh& mesh, std::vector<Warning>& warnings);

/// Unit normals weighted by angle, one per vertex (Thürmer and Wüthrich 1998). Sums are computed in double precision in
/// triangle order, so that the result does not depend on threads. Degenerate and non-finite triangles do not count. A
/// vertex without other triangles gets (0, 0, 1).
/// \param polygons  see Mesh::polygons; their corners are weighted instead of those of triangles
std::vector<Vec3> vertex_normals(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles,
                                 std::span<const std::uint32_t> polygons = {});

/// Normals per corner: a pool of normals, and for each corner an index into it.
struct CornerNormals {
  std::vector<Vec3> normals;
  std::vector<Triangle> triangles;
};

/// The mesh's own corner normals, if it has any; invalid ones are replaced by computed ones. Otherwise vertex normals
/// weighted by angle, which vertices of equal position share.
/// \param frame_positions  the mesh's positions in the working frame
CornerNormals corner_normals(const Mesh& mesh, std::span<const Vec3> frame_positions);

// Steps of corner_normals(), which can be used for parts of a mesh:

/// Replaces zero normals of corners by the face's normal.
void use_faces_where_zero(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                          CornerNormals& corners);
/// Normalizes given normals, and replaces invalid ones by computed ones.
/// \param compute  returns vertex_normals(); called at most once
void use_given_normals(std::span<const Triangle> triangles, CornerNormals& corners,
                       const std::function<std::vector<Vec3>()>& compute);

/// One unit direction per vertex: the angle-weighted mean of all corner normals at the vertex's position. Vertices at
/// exactly the same position have the same direction, so rays along these directions leave no gaps at hard edges or
/// split vertices.
std::vector<Vec3> continuous_directions(std::span<const Vec3> positions,
                                        std::span<const Triangle> triangles,
                                        const CornerNormals& corners);

}  // namespace kiln
