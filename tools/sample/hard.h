// Parts of hard-surface scenes: high polys with exact normals, low polys with UVs.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "kiln/mesh.h"
#include "noise.h"

namespace kiln::sample {

inline double length(const Point& p) { return std::sqrt(dot(p, p)); }
inline Point unit(const Point& p) { return (1 / length(p)) * p; }
inline Point crossed(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline Vec3 to_float(const Point& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

/// A part's coordinate frame in the scene: an origin, and right-handed axes of unit length.
struct PartFrame {
  Point origin{0, 0, 0};
  Point x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  Point at(const Point& local) const;
  Point direction(const Point& local) const;  ///< A direction of the part, in the scene's axes
  PartFrame translated(double along_x, double along_y, double along_z) const;
};

/// Makes a frame at `origin` with z along `axis` (of any length) and an arbitrary x perpendicular to it.
PartFrame frame_along(const Point& origin, const Point& axis);

/// A closed polygon in the plane, counter-clockwise: convex, or an L, all of which is visible from its inner corner.
using Outline = std::vector<std::array<double, 2>>;

/// Collects the dense parts of a high poly: closed shells with a normal at every corner that is exact up to rounding.
class HighPolyParts {
 public:
  explicit HighPolyParts(std::string name);

  /// A box with rounded edges. `radius` must be below half of the smallest half-size; each edge gets 2 * `steps` strips.
  void rounded_box(const PartFrame& part_frame, const Point& half, double radius, int steps = 4);
  /// One segment of a profile that is rotated around z: its two ends as (radius, height), each with its normal.
  struct ProfileSegment {
    std::array<double, 2> from, to, from_normal, to_normal;
  };
  void add_turned_profile(const PartFrame& part_frame, const std::vector<ProfileSegment>& profile,
                          int segments);
  /// A cylinder from z = 0 to `height` whose upper rim is rounded by `radius`.
  void disc(const PartFrame& part_frame, double radius, double height, double rounding,
            int segments = 48);
  /// A prism from z = 0 to `height` over a regular polygon with `sides` corners at `radius`. Its upper rim is chamfered.
  void prism(const PartFrame& part_frame, int sides, double radius, double height, double chamfer);
  /// A plate bent around z: angles from `angle` to `angle` + `span`, radii from `inner` to `outer`, z from -`half` to `half`.
  void bent_plate(const PartFrame& part_frame, double inner, double outer, double angle,
                  double span, double half, int segments);
  /// An outline in x and y, extruded over z from -`half` to `half`, with corners rounded by `radius`.
  /// All of the outline must be visible from `centre`, from which its caps are triangulated.
  void extrusion(const PartFrame& part_frame, const Outline& outline,
                 const std::array<double, 2>& centre, double half, double radius, int steps = 6);
  /// An open sheet z = height(x, y) over [-w, w] x [-h, h] that faces up.
  void open_sheet(const PartFrame& part_frame, double w, double h, int steps,
                  double (*height)(double x, double y));

  /// Starts a group for the following shapes.
  void group(std::string name);
  const Mesh& mesh() const { return mesh_; }

 private:
  std::uint32_t corner(const PartFrame& part_frame, const Point& local, const Point& normal);
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  Mesh mesh_;
};

/// Collects the parts of a low poly. Edges are hard where faces meet at an angle. Each face is one UV chart, and so is
/// a cylinder's side; all charts have one scale.
class LightParts {
 public:
  explicit LightParts(std::string name);

  void box(const PartFrame& part_frame, const Point& half);
  /// A cylinder from z = 0 to `height`. Its side is one smooth chart or, if `smooth` is false, flat faces with
  /// one chart each.
  void cylinder(const PartFrame& part_frame, int sides, double radius, double height, bool smooth);
  void extrusion(const PartFrame& part_frame, const Outline& outline,
                 const std::array<double, 2>& centre, double half);
  void card(const PartFrame& part_frame, double w, double h);
  /// Starts a group for the following shapes.
  void group(std::string name);

  /// Packs the charts into the unit square, `gap` apart, and returns the mesh.
  Mesh pack_charts_and_finish(double gap = 1.0 / 64);

 private:
  struct Chart {
    std::vector<std::uint32_t>
        corners;  ///< Vertices of the mesh; mesh_.positions and mesh_.uvs have the same indices
    double width = 0, height = 0;
  };
  std::uint32_t corner(Chart& chart, const PartFrame& part_frame, const Point& local,
                       const Point& normal, double u, double v);
  void face(const PartFrame& part_frame, const std::vector<Point>& polygon,
            const Point* centre = nullptr);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  Mesh mesh_;
  std::vector<Chart> charts_;
};

}  // namespace kiln::sample
