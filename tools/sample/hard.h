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

/// A part's frame in the scene: right-handed axes of unit length.
struct Stand {
  Point origin{0, 0, 0};
  Point x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  Point at(const Point& local) const;
  Point turned(const Point& local) const;  ///< A direction
  Stand moved(double along_x, double along_y, double along_z) const;
};

/// At `origin` with z along `axis` (any length); x is across it.
Stand stand_along(const Point& origin, const Point& axis);

/// A closed polygon in the plane, counter-clockwise, convex or an L whose inner corner sees all of it.
using Outline = std::vector<std::array<double, 2>>;

/// Collects dense parts: closed shells with a separate normal at every corner, exact to rounding.
class HighPolyParts {
 public:
  explicit HighPolyParts(std::string name);

  /// A box with edges rounded by `radius`, below half of the least half-size, in `steps` steps a half.
  void rounded_box(const Stand& stand, const Point& half, double radius, int steps = 4);
  /// One segment of a profile turned around z: from and to (radius, height), with their normals.
  struct Turned {
    std::array<double, 2> from, to, from_normal, to_normal;
  };
  void turned(const Stand& stand, const std::vector<Turned>& profile, int segments);
  /// A cylinder from z = 0 to `height` whose upper rim is rounded by `radius`.
  void disc(const Stand& stand, double radius, double height, double rounding, int segments = 48);
  /// A prism over a regular polygon of `sides` corners at `radius`, z = 0 to `height`, upper rim chamfered.
  void prism(const Stand& stand, int sides, double radius, double height, double chamfer);
  /// A plate bent around z: from `angle` on over `span`, radius `inner` to `outer`, z -`half` to `half`.
  void bent_plate(const Stand& stand, double inner, double outer, double angle, double span,
                  double half, int segments);
  /// An outline in x and y over z from -`half` to `half`, its corners rounded by `radius`. Seen from
  /// `centre`, which sees all of it.
  void extrusion(const Stand& stand, const Outline& outline, const std::array<double, 2>& centre,
                 double half, double radius, int steps = 6);
  /// A sheet z = height(x, y) over [-w, w] x [-h, h], open, facing up.
  void sheet(const Stand& stand, double w, double h, int steps,
             double (*height)(double x, double y));

  /// Starts a group for the following shapes.
  void group(std::string name);
  const Mesh& mesh() const { return mesh_; }

 private:
  std::uint32_t corner(const Stand& stand, const Point& local, const Point& normal);
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  Mesh mesh_;
};

/// Collects light parts: hard edges where faces meet at an angle, a chart a face (a cylinder's side is one),
/// all at one scale.
class LightParts {
 public:
  explicit LightParts(std::string name);

  void box(const Stand& stand, const Point& half);
  /// z = 0 to `height`; its side shaded smooth or, a chart a face, flat.
  void cylinder(const Stand& stand, int sides, double radius, double height, bool smooth);
  void extrusion(const Stand& stand, const Outline& outline, const std::array<double, 2>& centre,
                 double half);
  void card(const Stand& stand, double w, double h);
  /// Starts a group for the following shapes.
  void group(std::string name);

  /// Packs the charts into the unit square, `gap` apart, and returns the mesh.
  Mesh finish(double gap = 1.0 / 64);

 private:
  struct Chart {
    std::vector<std::uint32_t> corners;  ///< Of the mesh; positions and UVs are parallel
    double width = 0, height = 0;
  };
  std::uint32_t corner(Chart& chart, const Stand& stand, const Point& local, const Point& normal,
                       double u, double v);
  void face(const Stand& stand, const std::vector<Point>& polygon, const Point* centre = nullptr);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  Mesh mesh_;
  std::vector<Chart> charts_;
};

}  // namespace kiln::sample
