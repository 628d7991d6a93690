// Turns a profile around the Y axis into an evenly triangulated closed mesh.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kiln/mesh.h"
#include "noise.h"

namespace kiln::sample {

/// A smooth curve in the half plane (radius, height) by arc length.
class Profile {
 public:
  struct ProfileControl {
    double radius, height;
  };
  struct Sample {
    double radius, height;  ///< A point of the curve
    /// Radial and axial component of the unit normal, to the right of the curve's direction
    double normal_radius, normal_height;
  };

  /// A centripetal Catmull-Rom spline through the controls. The first and the last lie on the axis.
  explicit Profile(const std::vector<ProfileControl>& controls);

  double length() const { return arc_.back(); }
  Sample at(double arc) const;
  /// Arc length of the curve up to its control point `index`.
  double arc_of_control(std::size_t index) const { return control_arc_[index]; }

 private:
  std::vector<ProfileControl> points_;
  std::vector<double> arc_;
  std::vector<double> control_arc_;
};

/// A point of the smooth surface of revolution.
struct SurfacePoint {
  Point position, normal;
  double arc, angle, radius;
  double spacing;  ///< Edge length of the mesh; smaller details would alias.
};

/// Receives a mesh in pieces: all vertices, then all triangles.
class MeshPieceSink {
 public:
  virtual ~MeshPieceSink() = default;
  virtual void begin(std::uint64_t vertices, std::uint64_t triangles) = 0;
  virtual void add(std::span<const Vec3> positions) = 0;
  virtual void add(std::span<const Triangle> triangles) = 0;
};

/// Sweeps the profile into about `faces` near-equilateral triangles and moves each vertex to
/// `displace(place)`. Closed; counter-clockwise from outside for a profile that runs upwards.
Mesh sweep(const Profile& profile, std::uint64_t faces,
           const std::function<Point(const SurfacePoint&)>& displace);
/// sweep() for meshes larger than memory: passes the mesh to `sink` in pieces.
void sweep(const Profile& profile, std::uint64_t faces,
           const std::function<Point(const SurfacePoint&)>& displace, MeshPieceSink& sink);

}  // namespace kiln::sample
