// Vertices of a low poly moved so that its faces, not only its corners, lie on the high poly.
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

/// Quadrics put each vertex where the planes around it meet; between vertices, a bent surface is then missed on
/// one side. This evens it out: samples of the high poly are matched with their nearest points of the low poly.
/// Samples of curved places weigh more (quadric.h), but on height fields.
/// Vertices move, one after another, to where the squared distances along the high poly's normals are least (Hoppe,
/// DeRose, Duchamp, McDonald and Stuetzle 1993, "Mesh Optimization", section 4.1). A few rounds, each matched anew. Coordinates of about unit size.
class SurfaceFit {
 public:
  /// To where the mesh's numbers can hold a point.
  using Snap = std::function<Vec3d(const Vec3d&)>;

  /// Spans must outlive this.
  SurfaceFit(std::span<const Vec3> positions, std::span<const Triangle> triangles,
             bool height_field, Snap snap)
      : positions_(positions),
        triangles_(triangles),
        height_field_(height_field),
        snap_(std::move(snap)) {}

  /// Takes the samples for a low poly of so many faces: run() does not have to, if it gets that.
  void prepare(std::size_t faces) { take_samples(wanted_for(faces, /*rough=*/false)); }

  /// Moves vertices of a low poly. Those on open edges, or where more than two triangles meet at an edge, stay.
  /// No triangle turns far, loses its area or, of a height field, faces down. Does not depend on threads.
  /// \param rough  with a quarter of the samples and half the rounds, for meshes that are only looked at
  /// \param labels  by triangle: along lines between labels, vertices move along these; empty: none
  /// \param planes  by point, those that it stands for and is held by; empty: none
  void run(std::vector<Vec3d>& points, const std::vector<Triangle>& low,
           std::span<const std::uint32_t> labels, std::span<const Quadric> planes,
           bool rough = false);

 private:
  /// A point of the high poly, and where it was matched.
  struct Sample {
    Vec3d point, normal;
    double weight = 0;  ///< Its area, more where it is bent; 0: matched with nothing.
    std::uint32_t triangle = 0;
    std::array<double, 3> share{};  ///< Barycentric weights of the triangle's corners.
  };
  static std::size_t wanted_for(std::size_t faces, bool rough);
  void take_samples(std::size_t wanted);
  void weigh();
  static Vec3d place_of(const Sample& s, const std::vector<Vec3d>& points,
                        const std::vector<Triangle>& low);
  static double surely_within(const Sample& known, const Vec3d& point,
                              const std::vector<Vec3d>& points, const std::vector<Triangle>& low);
  void match(const std::vector<std::uint8_t>& loose, const std::vector<Sample>& before,
             const std::vector<Vec3d>& points, const std::vector<Triangle>& low,
             std::vector<Sample>& found) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  bool height_field_;
  Snap snap_;
  std::vector<double> share_;  ///< Share of the samples, by triangle; empty until it is needed.
  std::vector<Sample> samples_;
  std::size_t wanted_ = 0;  ///< For which samples_ were taken.
};

}  // namespace kiln
