#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Repairs of clean_mesh(). Lengths are shares of the diagonal of the mesh's bounding box.
struct CleanOptions {
  /// Only reverse windings; triangles and vertices keep their indices.
  bool windings_alone = false;
  /// Reverse triangles whose winding opposes that of their neighbours.
  bool orient = true;
  /// Weld vertices of open edges that are closer than this, and close open edges on which vertices of other open edges
  /// lie. The distance is limited to a quarter of the shortest edge there. 0: off.
  double weld = 1e-5;
  /// Largest perimeter of small holes that are filled: holes of at most 12 edges across which the surface
  /// continues. 0: off.
  double max_hole = 0.02;
  /// Largest extent of holes of any number of edges that are filled: the diagonal of the rim's bounding box. Outlines
  /// of open sheets stay open. 0: off; infinity: all holes are filled, and only outlines of flat sheets stay open, for
  /// a watertight mesh.
  double fill_holes = 0;
  /// Drop floaters: bodies whose bounding box has a diagonal below this share of the largest body's diagonal. Pieces
  /// closer to each other than half of that length count as one body. 0: keep all.
  double floater = 0.01;
  /// Keep parts that no view from outside sees.
  bool keep_inner = false;
};

/// Number of repaired elements of a kind, and an example.
struct Cleaned {
  std::uint64_t count = 0;  ///< Number of elements
  /// Position of one such element, relative to Mesh::origin; valid if count > 0
  Vec3 example = {};
};

/// Repairs that clean_mesh() made.
struct CleanReport {
  Cleaned welded;      ///< Vertices that were moved to a nearby vertex
  Cleaned junctions;   ///< Triangles that were cut where vertices lie on their open edges
  Cleaned degenerate;  ///< Triangles without area, which were removed
  Cleaned duplicates;  ///< Triangles that repeat another one, which were removed
  /// Groups of faces attached to an edge that two other faces share; they were removed
  Cleaned fins;
  Cleaned turned;  ///< Triangles whose winding was reversed
  /// `count` is 1 if views from outside see almost only back faces, which are not repaired; else 0
  Cleaned inward;
  Cleaned holes;        ///< Holes that were filled by CleanOptions::max_hole
  Cleaned large_holes;  ///< Holes that were filled by CleanOptions::fill_holes
  /// Holes, included in large_holes, that were filled by a flat lid, since the surface around them
  /// ends at an angle to the lid
  std::uint64_t flat_holes = 0;
  /// Extent of the largest hole among large_holes, as a share of the diagonal
  double largest_hole = 0;
  Cleaned open_rims;   ///< With CleanOptions::fill_holes: rims of holes that were left open
  Cleaned open_edges;  ///< With CleanOptions::fill_holes: remaining edges of only one triangle
  Cleaned floaters;    ///< Small bodies that were removed, see CleanOptions::floater
  Cleaned inner;       ///< Parts that no view from outside sees; they were removed
  /// With CleanOptions::windings_alone: true if no triangle was reversed, because every part is closed and faces
  /// outwards
  bool faces_outwards = false;
  double seconds = 0;             ///< Duration
  std::vector<Warning> warnings;  ///< One warning for each count above that is not 0
};

/// Repairs typical faults of generated and scanned meshes, before any other step. A sound mesh is unchanged to the bit:
/// one body, whose edges have one or two triangles that face alike and outwards.
///
/// In this order:
///   degenerate-triangles  dropped
///   duplicate-triangles   dropped if they have the same corners in the same order. Two-sided sheets are kept
///   welded-vertices       vertices of open edges within `weld` get one position. Indices, UVs, normals and colours
///                         are kept, and so are seams
///   split-at-junctions    an open edge on which vertices of other open edges lie is split there, so that both sides
///                         share their edges
///   dropped-fins          parts with open edges, smaller than `floater`, that are attached to edges of three
///                         triangles; never more than a tenth of the area
///   turned-triangles      an inconsistent part (triangles connected by edges of two triangles) is made to face the
///                         views from outside that see it; if they see both sides equally, as in agree_windings(). A
///                         consistent part is reversed if views see its back 8 times as much as its front
///   faces-inwards         if views see mostly backs, as in a room, only triangles that face against their neighbours
///                         are reversed
///   filled-holes          see CleanOptions::max_hole; with the UVs and normals of the surrounding corners
///   filled-large-holes    see CleanOptions::fill_holes, also with `windings_alone`, after which triangles and vertices
///                         keep their indices. Where faces around a hole lie at less than 70 degrees to its plane, the
///                         patch continues the surface: it bends least, and meets it without a crease (a thin plate).
///                         Else it is a lid. Colours are interpolated from the rim, UVs and materials are those of the
///                         nearest part of the rim
///   open-holes            rims and edges that CleanOptions::fill_holes left open
///   dropped-floaters      see CleanOptions::floater; never more than a tenth of the area
///   dropped-inner         parts (triangles connected by shared vertices) that no view sees, whether or not the backs
///                         of other parts are treated as transparent
///
/// Views are orthographic pictures of 512 x 512 pixels from 32 directions; before a part is dropped, from 64 more.
/// Parts smaller than a pixel stay. Time: nearly linear; about 1 s for a million triangles of several parts, less of
/// one part. Deterministic on any number of threads. Thread safety: may be called from several threads, for different
/// meshes. Reports to a ProgressScope.
/// \param mesh  [in, out]
/// \throws Error(usage) for options out of range; Error(input) for an invalid mesh, see validate()
CleanReport clean_mesh(Mesh& mesh, const CleanOptions& options = {});

}  // namespace kiln
