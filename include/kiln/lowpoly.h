#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

struct SimplifyOptions {
  /// Target number of triangles. 0: as few as `max_error` allows ("model no more than the scene
  /// needs").
  std::uint32_t faces = 0;
  /// With faces = 0: bound of the geometric deviation, as a share of the bounding box's diagonal.
  double max_error = 0.002;
};

struct SimplifyReport {
  std::uint64_t input_faces = 0;
  std::uint64_t faces = 0;
  double error = 0;  ///< The simplifier's own estimate, as a share of the diagonal.
  double seconds = 0;
  std::vector<Warning> warnings;
};

/// Decimates by edge collapse with quadric errors. Degenerate and non-finite triangles, and
/// duplicates, are dropped from the result (and counted); exactly coincident vertices are welded first.
/// The result has smooth normals and no UVs, in the same place and units as the input (same origin).
/// \throws Error(usage), Error(input) where nothing usable is left.
Mesh simplify(const Mesh& high, const SimplifyOptions& options = {},
              SimplifyReport* report = nullptr);

struct UnwrapOptions {
  std::uint32_t size = 2048;  ///< Map size that the border is meant for, texels (the smaller side)
  std::uint32_t border_texels = 2;  ///< Empty texels around each patch, at least 1
};

struct UnwrapReport {
  std::uint64_t charts = 0;
  double coverage = 0;        ///< Share of the unit square that triangles cover
  double density_spread = 0;  ///< Standard deviation of log2(texel density) over the surface
  double seconds = 0;
  std::vector<Warning> warnings;
};

/// Gives a mesh UVs: triangles are paired along shared edges and packed as squares and rectangles
/// (Wang, Froehlich, Goebel, "Fast Normal Map Generation for Simplified Meshes", section 2), with
/// sizes by surface area so that texel density is even, and a border around each patch so that
/// filtering never bleeds. Every triangle of positive area gets at least one texel's worth of UV area.
Mesh unwrap(const Mesh& mesh, const UnwrapOptions& options = {}, UnwrapReport* report = nullptr);

}  // namespace kiln
