// Fits the vertices of a low poly so that its faces, not only its corners, lie on the high poly.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "kiln/types.h"
#include "mesh/quadric.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"

namespace kiln {

/// Quadrics put each vertex at the intersection of the planes around it, so the faces between lie on one side of a
/// curved surface. The fit centres these faces: it matches samples of the high poly with their nearest points on the
/// low poly, then moves one vertex after another to minimize the squared distances along the high poly's normals
/// (Hoppe, DeRose, Duchamp, McDonald and Stuetzle 1993, "Mesh Optimization", section 4.1). Both steps are repeated for
/// a few rounds. Samples in curved areas have more weight (see quadric.h), except on height fields. Coordinates should
/// be of about unit size.
class SurfaceFit {
 public:
  /// Rounds a point to a position that the caller's mesh can store.
  using Snap = std::function<Vec3d(const Vec3d&)>;

  /// The spans must outlive this object.
  SurfaceFit(std::span<const Vec3> positions, std::span<const Triangle> triangles,
             bool height_field, Snap snap)
      : positions_(positions),
        triangles_(triangles),
        height_field_(height_field),
        snap_(std::move(snap)) {}

  /// Draws the samples for a low poly of `faces` triangles before run() is called, so that this can overlap other work.
  void prepare(std::size_t faces) { draw_samples(sample_count_for(faces, /*draft=*/false)); }

  /// Moves vertices of a low poly. Vertices on open edges, or on edges of more than two triangles, do not move. No
  /// triangle turns by a large angle, loses its area or (on a height field) faces down. Deterministic on any number of
  /// threads.
  /// \param draft  true: uses a quarter of the samples and half the rounds, for meshes that are only measured
  /// \param labels  label of each triangle; may be empty. Vertices on lines between labels only move along these
  /// \param planes  for each point, the quadric that attracts it; may be empty
  void run(std::vector<Vec3d>& points, const std::vector<Triangle>& low,
           std::span<const std::uint32_t> labels, std::span<const Quadric> planes,
           bool draft = false);

 private:
  /// A point of the high poly, and its match on the low poly.
  struct Sample {
    Vec3d point{}, normal{};
    /// The area that the sample represents, increased where the surface is curved; 0 if the sample has no match
    double weight = 0;
    std::uint32_t triangle = 0;
    std::array<double, 3> share{};  ///< Barycentric coordinates in the triangle
  };
  static std::size_t sample_count_for(std::size_t faces, bool draft);
  void draw_samples(std::size_t wanted);
  void set_weights();
  static Vec3d matched_position(const Sample& s, const std::vector<Vec3d>& points,
                                const std::vector<Triangle>& low);
  static double squared_distance_bound(const Sample& known, const Vec3d& point,
                                       const std::vector<Vec3d>& points,
                                       const std::vector<Triangle>& low);
  void match(const std::vector<std::uint8_t>& loose, const std::vector<Sample>& before,
             const std::vector<Vec3d>& points, const std::vector<Triangle>& low,
             std::vector<Sample>& found) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  bool height_field_;
  Snap snap_;
  std::vector<double> triangle_weights_;  ///< Weight of each triangle; empty until first use
  std::vector<Sample> samples_;
  std::size_t requested_samples_ = 0;  ///< Number of samples that was requested for samples_
};

}  // namespace kiln
