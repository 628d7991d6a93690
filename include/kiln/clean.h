#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Repairs that clean_mesh() may make. Lengths are shares of the diagonal of the mesh's bounding box.
struct CleanOptions {
  /// Turns triangles round, and nothing else: triangles and vertices keep their numbers.
  bool windings_alone = false;
  /// Turn triangles that disagree. False: windings stay.
  bool orient = true;
  /// Vertices of open edges that are nearer to each other than this are welded, and open edges closed where vertices of
  /// others lie on them. Never over more than a quarter of the shortest edge there. 0: neither.
  double weld = 1e-5;
  /// Holes of at most 12 edges and this perimeter are filled where the surface goes on across them. 0: none.
  double max_hole = 0.02;
  /// Bodies of a smaller diagonal are floaters: they are left out. A body is what gaps below half of this share
  /// connect; the diagonal is here that of the largest body. 0: all stay.
  double floater = 0.01;
  /// Keep parts that no view from outside sees.
  bool keep_inner = false;
};

/// Number of repaired elements of a kind, and an example.
struct Cleaned {
  std::uint64_t count = 0;  ///< Number of elements
  Vec3 example = {};        ///< A place, as Mesh::positions; good where there are any
};

/// Repairs that clean_mesh() made.
struct CleanReport {
  Cleaned welded;      ///< Vertices that were moved to one nearby
  Cleaned junctions;   ///< Triangles that were cut where vertices lie on their open edges
  Cleaned degenerate;  ///< Triangles without area, left out
  Cleaned duplicates;  ///< Triangles that repeated another, left out
  Cleaned fins;        ///< Groups of faces that hung on an edge which two others share, left out
  Cleaned turned;      ///< Triangles that were turned round
  Cleaned inward;      ///< 1: views from outside see backs of faces almost alone; they were left so
  Cleaned holes;       ///< Holes that were filled
  Cleaned floaters;    ///< Bodies that were left out
  Cleaned inner;       ///< Parts that no view sees, left out
  /// True if, with CleanOptions::windings_alone, nothing had to be turned since every part is closed and faces outwards
  bool faces_outwards = false;
  double seconds = 0;             ///< That it took
  std::vector<Warning> warnings;  ///< One for each of these that is not 0
};

/// Repairs a mesh as generators and scanners leave it, before anything is made of it. A mesh that needs nothing of this
/// stays as it is to the bit: one whose edges have two triangles or one, which face alike and outwards, in one body.
///
/// In this order:
///   degenerate-triangles  left out
///   duplicate-triangles   the same corners in the same order: left out. Two-sided sheets stay
///   welded-vertices       vertices of open edges within `weld` get one position. Indices, UVs, normals and colours stay,
///                         so seams do, too
///   split-at-junctions    an open edge on which others end is cut there, so that both sides share their edges
///   dropped-fins          parts with open edges, smaller than `floater`, that hang on edges of three triangles; never more
///                         than a tenth of the area
///   turned-triangles      a part (what edges of two triangles connect) that disagrees is made to face where views from
///                         outside see it; where they see both sides alike, as agree_windings(). A part that agrees is
///                         turned where views see its back 8 times as much as its front
///   faces-inwards         where most of what views see are backs, as of a room, only triangles that face against their
///                         neighbours are turned
///   filled-holes          see CleanOptions::max_hole; with the UVs and normals of the corners around
///   dropped-floaters      see CleanOptions::floater; never more than a tenth of the area
///   dropped-inner         parts (what shared vertices connect) of which views see nothing, whether or not they look through
///                         backs of others
///
/// Views are orthographic pictures of 512 x 512 pixels from 32 directions; before a part is dropped, from
/// 64 more. Parts too small for pictures stay.
/// Time: nearly linear; about 1 s for a million triangles of several parts, less of one part. Deterministic on any number
/// of threads. Thread safety: may be called from several threads, for other meshes. A ProgressScope hears of it.
/// \param mesh  [in, out]
/// \throws Error(usage) for options out of range; Error(input) for a mesh that does not hold together, see validate()
CleanReport clean_mesh(Mesh& mesh, const CleanOptions& options = {});

}  // namespace kiln
