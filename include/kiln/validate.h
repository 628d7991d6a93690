/// \file
/// Checks of input that the library makes in every build before it works with it: bake(), Source and all
/// other functions with a mesh, options or a match call these. Call them directly to find mistakes early.
#pragma once

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Checks that a mesh is consistent. Imperfect coordinates (degenerate triangles, NaN) are allowed: they are
/// skipped, and counted in warnings.
///
/// \throws Error(input) that names the mesh, the element and the value, with these ids:
///   mesh-index    a corner of triangles, uv_triangles or normal_triangles beyond its pool
///   mesh-size     uv_triangles, normal_triangles, groups, objects, materials or polygons without one entry per
///                 triangle; colors without one entry per vertex; tangents without three per triangle
///   mesh-origin   an origin that is not finite
///   mesh-group    an index of a group, object or material beyond the list of names
///   mesh-polygon  polygon numbers that do not ascend from 0 in steps of 1
/// Cost: linear; 1 ms of CPU time a million triangles with UVs; 2.5 ms with normals, groups, objects and
/// materials, too (AMD EPYC). It runs over thread_limit() threads. Thread safety: may be called from several
/// threads.
void validate(const Mesh& mesh);

/// Checks that options are in range and do not contradict each other, without looking at the meshes. A
/// saved match is not checked.
///
/// \throws Error(usage) that names the parameter, its value and the range; ids: `option-range` for numbers;
///         `option-enum` for a value that an enumeration does not have; `option-name` for a map or match
///         that does not exist; `option-contradiction` for parameters that exclude each other
/// Cost: below a microsecond. Thread safety: may be called from several threads.
void validate(const BakeOptions& options);

/// Checks that a match is consistent: all arrays have width * height elements, and each sample is valid.
///
/// \throws Error(input) that names the sample and the value, with these ids:
///   match-size      width, height or samples out of range, or an array whose length does not fit these
///   match-status    no SampleStatus
///   match-triangle  a triangle beyond source_triangles, for a sample that was found
///   match-weight    u, v or 1 - u - v that is NaN or more than 0.001 out of [0, 1]
///   match-distance  not finite
/// Cost: linear; 2 ms of CPU time a million samples (AMD EPYC), over thread_limit() threads. Thread safety: may be
/// called from several threads.
void validate(const Match& match);

}  // namespace kiln
