// Vertex normals in the field's way: corner normals weighted by the corner's angle.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"
#include "mesh/vector.h"

namespace kiln {

/// A triangle's unit normal and its corners' angles; all zero where it is degenerate or non-finite.
struct CornerWeights {
  Vec3d normal;
  std::array<double, 3> angles{};
};
CornerWeights corner_weights(std::span<const Vec3> positions, const Triangle& triangle);

/// The same for a mesh's triangles. Triangles of one polygon all have its normal (the sum of their
/// areas as vectors). At each of its corners the first has the angle between the polygon's sides,
/// the others 0: sums over triangles are then sums over polygons. A polygon that passes a vertex
/// twice, or has no area, counts as its triangles.
/// \param polygons    as Mesh::polygons; empty: each triangle is one
/// \param begin, end  polygons whose first triangle is among these are done, wholly
/// \param weights     [out] weights[i] is triangle begin + i's
void corner_weights(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                    std::span<const std::uint32_t> polygons, std::size_t begin, std::size_t end,
                    CornerWeights* weights);

/// A sum of weighted normals made unit; zero where they cancel out. \param total  the weights' sum
Vec3 normalized_sum(const Vec3d& sum, double total);

/// True if a normal has a direction.
bool is_usable_normal(const Vec3& normal);

/// Tells of triangles with an area that have a corner whose normal has no direction. \param warnings  [out]
void warn_of_normals(const Mesh& mesh, std::vector<Warning>& warnings);

/// Angle-weighted unit normals, one per vertex (Thürmer and Wüthrich 1998), summed in double
/// precision in triangle order. So the result does not depend on threads. Degenerate and non-finite
/// triangles add nothing; a vertex without any gets (0, 0, 1).
/// \param polygons  as Mesh::polygons, whose corners are weighted then
std::vector<Vec3> vertex_normals(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles,
                                 std::span<const std::uint32_t> polygons = {});

/// Normals per corner, as a pool and indices into it.
struct CornerNormals {
  std::vector<Vec3> normals;
  std::vector<Triangle> triangles;
};

/// The mesh's own corner normals where it has them (zero or non-finite ones replaced by computed
/// ones). Else angle-weighted vertex normals, shared by vertices of equal position.
/// \param frame_positions  the mesh's positions in the working frame
CornerNormals corner_normals(const Mesh& mesh, std::span<const Vec3> frame_positions);

/// One unit direction per vertex, equal for all vertices of exactly equal position: the
/// angle-weighted average of all corner normals there. Rays that leave along it leave no gaps at hard
/// edges or where the file has split vertices.
std::vector<Vec3> continuous_directions(std::span<const Vec3> positions,
                                        std::span<const Triangle> triangles,
                                        const CornerNormals& corners);

}  // namespace kiln
