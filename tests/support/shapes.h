// Generates meshes by formula, for tests and benchmarks. All meshes have faces that wind counter-clockwise seen from
// outside, +Y up, the origin at their centre, and `name` set. UVs are never mirrored: the directions of growing u and v
// and the outward normal form a right-handed frame.
#pragma once

#include <cstdint>

#include "kiln/mesh.h"

namespace kiln::test {

struct Vec3d {
  double x = 0, y = 0, z = 0;
};

/// A regular tetrahedron inscribed in the unit sphere: 4 triangles, no UVs, no normals.
Mesh tetrahedron();

/// A cube with edges of length `side`: 8 positions, 12 triangles, six split normals. The UVs of each face lie in their
/// own cell of a 3 by 2 grid, within a margin of `border` UV units.
Mesh cube(double side = 1, double border = 0.01);

/// A rectangle in the plane z = 0 that faces +Z, with nx by ny cells of two triangles. UVs cover [0, 1]^2 with u along
/// +X and v along +Y; one normal.
Mesh plane(std::uint32_t nx, std::uint32_t ny, double width = 1, double height = 1);

/// An icosahedron that is subdivided `levels` times: 20 * 4^levels triangles, 10 * 4^levels + 2 vertices, closed, no
/// UVs, no normals. levels <= 9.
Mesh icosphere(std::uint32_t levels, double radius = 1);

/// A latitude-longitude sphere with exact normals and UVs (u: longitude eastwards, v: latitude, 0 at the south pole).
/// Each pole is one position. Only UVs are split at the seam and the poles, so the mesh is closed. 2 * slices * (stacks
/// - 1) triangles; slices >= 3, stacks >= 2.
Mesh uv_sphere(std::uint32_t slices, std::uint32_t stacks, double radius = 1);

/// A torus around the Y axis with exact normals and UVs (u: around the axis, v: around the tube, 0 at the outer
/// equator). Only UVs are split at the two seams, so the mesh is closed. 2 * slices * rings triangles; both >= 3.
Mesh torus(std::uint32_t slices, std::uint32_t rings, double major_radius = 1,
           double minor_radius = 0.35);

/// Unconnected triangles with corners in [-1, 1]^3 and edges of about `size`; no UVs, no normals. One seed gives the
/// same bytes on all platforms.
Mesh random_soup(std::uint32_t count, std::uint64_t seed, double size = 0.1);

/// The unit sphere with waves: its radius is r(d) = 1 + sum of three plane waves a sin(k . d + phase) of the direction
/// d, with amplitudes 0.020, 0.012, 0.008 and |k| = 7.9, 11.0, 14.9 radians per radius (wavelengths 0.80, 0.57, 0.42).
/// The height stays within +-0.04, and the normal within 23 degrees of the radial direction.
struct BumpySphere {
  static constexpr double kAmplitude = 0.04;

  /// Distance from the centre to the surface in a direction. \param direction  unit length
  static double radius(const Vec3d& direction);

  /// Unit outward normal of the exact surface at the point where the ray from the centre through `point` meets it.
  /// \param point  any point except the centre
  static Vec3d exact_normal(const Vec3d& point);

  /// A closed mesh with vertices on the exact surface and triangles of about equal size: 8 n^2 triangles, the nearest
  /// such number to `faces` (at least 8). No UVs. Ten million triangles take about a second.
  /// \param with_normals  true: vertices get the exact normals
  static Mesh dense(std::uint64_t faces, bool with_normals = false);

  /// The smooth unit sphere, as uv_sphere(slices, stacks).
  static Mesh light(std::uint32_t slices = 48, std::uint32_t stacks = 24);
};

/// The torus(., ., 1, 0.35) with waves: displaced along its normal by h(u, v) = 0.015 sin(9 u) cos(3 v) + 0.010 sin(14
/// u + 4 v), with u around the axis and v around the tube (wavelengths of 0.3 to 0.9 on the surface). The height stays
/// within +-0.025, and the normal within 35 degrees of the smooth torus's.
struct BumpyTorus {
  static constexpr double kAmplitude = 0.025;
  static constexpr double kMajorRadius = 1;
  static constexpr double kMinorRadius = 0.35;

  /// Height above the smooth torus in world units. \param u,v  angles in radians
  static double height(double u, double v);

  /// Unit outward normal of the exact surface at the two angles of `point`, that is, where the ray from the tube's
  /// centre line through `point` meets it.
  /// \param point  not on the axis or the centre line
  static Vec3d exact_normal(const Vec3d& point);

  /// A closed mesh with vertices on the exact surface: 2 * 3n * n triangles, the nearest such number to `faces` (at
  /// least 54). No UVs.
  /// \param with_normals  true: vertices get the exact normals
  static Mesh dense(std::uint64_t faces, bool with_normals = false);

  /// The smooth torus, with UVs.
  static Mesh light(std::uint32_t slices = 72, std::uint32_t rings = 24);
};

}  // namespace kiln::test
