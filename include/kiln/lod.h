#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/light_plan.h"
#include "kiln/mesh.h"
#include "kiln/source.h"

namespace KILN_PUBLIC kiln {

/// A chain of low polys, each for half the size on screen of the one before.
struct LodOptions {
  /// The error that every level is to reach, and what to bake. `screen` is the largest size at which the first
  /// level will be seen. The last one's, screen / 2^(levels - 1), must be 16 pixels or more.
  LightPlanOptions plan = {};
  std::uint32_t levels = 4;  ///< 2 to 8
  /// Each level may be off by so many times the one before, in its outlines and `plan.bounds`, too: 1 to 4. Of one error for all,
  /// fine detail may leave few levels: a map that shows it blurs no less from far away.
  double error_growth = 1;
  /// All levels have the first one's UV layout, and its maps serve all. Else each has its own. A map in tangent
  /// space turns with the normals of each level; one in object space does with fewer faces.
  bool share_uvs = false;
};

/// One mesh of a chain.
struct LodLevel {
  /// It takes over where the mesh is so many pixels wide, and serves down to the next level's size.
  std::uint32_t screen = 0;
  bool own_maps =
      true;  ///< It has maps of its own, or needs none; else the first level's serve it.
  /// The mesh and its maps; `chosen.measured` is the error at `screen`, `wanted` its bound. Where the first level's maps serve it,
  /// `trials` has the meshes that were looked at, and there is no `result`.
  LightBake light;
};

/// What bake_lods() made.
struct LodChain {
  std::vector<LodLevel> levels;   ///< By falling `screen` and bytes; may be fewer than asked for
  std::vector<Warning> warnings;  ///< "lod-left-out": a size for which none was made
  bool reached = false;           ///< All levels are within their bounds.
  bool cancelled = false;         ///< By BakeOptions::progress; then `levels` is not whole.
};

/// Plans a chain of low polys: bake_light() for `screen`, half of it, a quarter and so on. The error of each is that of
/// the one before times `error_growth`.
///
/// With shared UVs, the first level is planned so, with a map. The others are simplified from it,
/// with its seams and layout (SimplifyOptions::keep_uvs): few faces with which its map, rounded as
/// it is saved, stays within the error at their size. A level with more faces than the one before,
/// or over 90% of its bytes, is left out. There is a warning then, and the one before then serves
/// its size, too.
/// Lifetimes, threads, progress and determinism: as bake_light().
/// \throws as bake_light(); Error(usage) for levels, growth or screen out of range
LodChain bake_lods(const Source& source, const Mesh& high, const LodOptions& options);

}  // namespace kiln
