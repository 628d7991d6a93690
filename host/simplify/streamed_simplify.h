// Simplification of a mesh that is larger than memory. Its chunks are reduced one by one, and the rest is simplified in
// memory.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"
#include "kiln/simplify.h"
#include "mesh/mesh_stream.h"

namespace kiln {

/// The share of its triangles that each chunk keeps, for a low poly of `faces` triangles: a quarter of the mesh, but at
/// most 4 million triangles in all, and at least 8 per face of the low poly. The share depends on the mesh and the
/// number of faces alone, not on free memory, so that results are the same on every machine.
double reduced_share(const MeshStream& mesh, std::uint32_t faces);

/// Reduces a chunk to about `share` of its triangles by meshoptimizer. Vertices at equal positions become one. The
/// border of the chunk does not change, so that chunks still fit together; this may need more triangles.
/// \param positions, triangles  [in, out] on return, triangles are over the same vertices, some of which may have
///   moved; none is degenerate
void reduce_chunk(std::vector<Vec3>& positions, std::vector<Triangle>& triangles, double share);

/// The smallest share of its triangles that a mesh may keep in one reduction by pieces. With a smaller share, the
/// triangles between a piece's fixed border and its coarse interior would be slivers that fold: when a high poly of 100
/// million triangles was reduced to 4 million at once, the low poly had handles that the high poly lacks. Instead,
/// several reductions follow each other, each with other borders.
inline constexpr double kMinReducedShare = 0.2;

/// Reduces a mesh in memory in the way chunks are reduced, in pieces whose borders differ from those of the chunks.
/// Colours are kept, and so are vertices that are no longer used.
void reduce_pieces(Mesh& mesh, double share);

/// simplify() of the reduced mesh, with a report that compares the result with the mesh itself: `input_faces`, and
/// `error` and `mean_error` over as many samples as simplify() takes. If parts were dropped, which errors leave out,
/// the errors are those of the reduced mesh; so is `back_error` always.
///
/// With a bound of the error, the sum of two errors has to keep it: that of the reduction and that of simplify(). The
/// second gets what the first leaves. As samples alone are measured, the sum may exceed the bound; then the reduced mesh
/// is simplified again with a tighter bound. The mesh's file is read once, for the samples.
/// \throws Error(usage) if the reduction leaves less than a tenth of the bound
Mesh simplify_reduced(const MeshStream& mesh, const Mesh& reduced, const SimplifyOptions& options,
                      SimplifyReport& report);

}  // namespace kiln
