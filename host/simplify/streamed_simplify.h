// Simplification of a mesh that is larger than memory: its chunks are reduced one by one, and what is left is simplified
// in memory.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"
#include "kiln/simplify.h"
#include "mesh/mesh_stream.h"

namespace kiln {

/// Share of its triangles that each chunk keeps, for a low poly of `faces` triangles: a quarter of the mesh, but at most
/// 4 million triangles in all, and never fewer than 8 per face of the low poly. It depends on the mesh and the number of
/// faces alone, not on the memory that is free, so that results are the same on every machine.
double reduced_share(const MeshStream& mesh, std::uint32_t faces);

/// Reduces a chunk by meshoptimizer to about `share` of its triangles. Vertices at equal positions become one. The
/// chunk's border stays, so that chunks still fit together; keeping it may need more triangles.
/// \param positions, triangles  [in, out] triangles are over the same vertices, of which some may have moved; none is
///                              degenerate
void reduce_chunk(std::vector<Vec3>& positions, std::vector<Triangle>& triangles, double share);

/// The least share of its triangles that a mesh keeps in one reduction by pieces. If less is kept, the triangles between
/// a piece's fixed border and its coarse interior are slivers that fold: of 100 million triangles reduced to 4 million at
/// once, the low poly had handles that HIGH lacks. Further reductions have other borders.
inline constexpr double kMinReducedShare = 0.2;

/// Reduces a mesh in memory as chunks are, in pieces whose borders differ from those of chunks. Colours stay; vertices
/// that are not used any more stay, too.
void reduce_pieces(Mesh& mesh, double share);

/// Replaces the figures of a report that compare a low poly with the reduced mesh by those that compare it with the mesh
/// itself: `input_faces`, and `error` and `mean_error` over as many samples as simplify() takes. If parts were dropped,
/// which errors leave out, the errors stay those from the reduced mesh.
/// \param low  the result of simplify() for the reduced mesh
void measure_deviation(const MeshStream& mesh, const Mesh& low, SimplifyReport& report);

}  // namespace kiln
