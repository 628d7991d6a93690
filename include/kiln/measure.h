#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/image_data.h"
#include "kiln/mesh.h"
#include "kiln/render.h"

namespace KILN_PUBLIC kiln {

/// Error of rendered normals, compared with those of a reference mesh, over the pixels that both
/// meshes cover.
///
/// There are two units: angles in degrees, with exact percentiles by nearest rank; and the length of
/// the 8-bit difference, the unit of Wang, Froehlich and Goebel 2003 ("Fast Normal Map Generation for
/// Simplified Meshes", section 5). Each component n of a unit normal is stored as the integer q =
/// floor(255 (n/2 + 1/2) + 1/2), 0 to 255. The difference of two normals is sqrt(dqx^2 + dqy^2 +
/// dqz^2). Normals an angle a apart differ by about 255 sin(a/2): by 2.2 for one
/// degree, by 255 for opposite normals.
struct NormalError {
  /// The thresholds of `above_8bit`, in the unit of `mean_8bit`.
  static constexpr std::array<double, 5> kThresholds8Bit = {4, 8, 16, 32, 64};

  std::uint64_t pixels = 0;  ///< Number of compared pixels: those that both meshes cover
  /// Pixels that only one of the two meshes covers; they are not compared
  std::uint64_t one_sided = 0;
  double mean_degrees = 0;    ///< Mean angle over the compared pixels
  double rms_degrees = 0;     ///< Root mean square of the error
  double median_degrees = 0;  ///< Angle that half of the pixels do not exceed
  double p95_degrees = 0;     ///< Angle that 95% of the pixels do not exceed
  double p99_degrees = 0;     ///< Angle that 99% of the pixels do not exceed
  double max_degrees = 0;     ///< Largest angle
  /// Mean over the compared pixels of the length of the 8-bit difference, described above
  double mean_8bit = 0;
  std::array<double, 5> above_8bit{};  ///< Share of pixels above each threshold, 0 to 1
  /// Standard error of `mean_degrees` due to the limited number of directions and pixels, from the spread
  /// of the pictures' means: 0 for a single picture.
  double standard_error_degrees = 0;
  /// Difference between the silhouettes of the two meshes, 0 to 1: the share of the pixels covered
  /// by either mesh that only one mesh covers. Counted in samples if pixels have several.
  double one_sided_share = 0;
};

/// Accumulates the differences between pairs of pictures of normals: a reference picture and another one.
/// Stores no pictures, but 8 bytes per compared pixel. Thread safety: one thread at a time for each object.
class NormalComparison {
 public:
  /// Adds a pair of pictures of the same size, which hold normals as n/2 + 1/2 in the first three
  /// channels, and exactly 0 in all three for background (RenderOptions::show_normals). Angles are
  /// computed like those of compare_images().
  /// \throws Error(input) if sizes differ, pixels are missing, or channels are fewer than 3
  void add(const Image& reference, const Image& other);

  /// Error over all pairs; 0 if no pixel was compared. Does not depend on the number of threads.
  NormalError error() const;

 private:
  std::vector<double> angles_;
  std::uint64_t one_sided_ = 0;
  double sum_degrees_ = 0, sum_squares_ = 0, sum_8bit_ = 0;
  /// Number of compared pixels, and the sum of their angles, for each pair of pictures.
  std::vector<std::pair<double, double>> pictures_;
  std::array<std::uint64_t, NormalError::kThresholds8Bit.size()> above_{};
};

/// One pair of pictures: NormalComparison with a single add().
NormalError compare_normals(const Image& reference, const Image& other);

/// The angle between the normals at each pixel, degrees, one channel; -1 where neither picture shows a
/// mesh, -2 where only one does. Requirements on the pictures, and errors, are those of
/// NormalComparison::add.
Image normal_angles(const Image& reference, const Image& other);

/// Distances of matched points from the low poly.
struct DistanceError {
  std::uint64_t samples = 0;  ///< Samples with a matched point
  std::uint64_t missed = 0;   ///< Samples without a matched point
  double mean = 0;            ///< Mean absolute distance, world units
  double p95 = 0;             ///< 95th percentile of the distances, by nearest rank
  double max = 0;             ///< Largest distance; never above the match's max_distance
};
/// Statistics of the distances in a match, without any mesh. Thread safety of all functions here:
/// may be called from several threads; no argument is kept.
DistanceError match_distance(const Match& match);

/// Direction from which a picture is rendered, as in RenderOptions (+Y up).
struct ViewAngles {
  double azimuth_degrees = 0;    ///< Angle around the up axis, as RenderOptions::azimuth_degrees
  double elevation_degrees = 0;  ///< Angle above the horizon, -90 to 90
};

/// The angles of a view from a direction, with +Y up.
/// \param toward  from the scene to the viewer, of any length above 0
ViewAngles view_angles(const Vec3& toward);

/// The directions used for ViewOptions::count, unit length: evenly spread over the sphere.
std::vector<Vec3> spread_views(std::uint32_t count);

/// Directions for measuring that keep at least `least_degrees` from each of `used`: spread_views(count), rotated as
/// a whole by the first of a fixed series of rotations that achieves this.
/// \param used  unit directions; may be empty
/// \throws Error(usage) if none of 4,096 rotations achieves it
std::vector<Vec3> held_out_views(std::uint32_t count, std::span<const Vec3> used,
                                 double least_degrees = 2);

/// The smallest angle between a direction of one set and one of the other, degrees; 180 if one is empty.
double least_angle_degrees(std::span<const Vec3> a, std::span<const Vec3> b);

/// Pictures of the world-space normals of a reference mesh, with which other meshes are compared in the same
/// views, size and frame, with one sample per pixel. Memory: 12 bytes per pixel and view. Immutable; several
/// threads may compare at once.
class NormalReference {
 public:
  /// \param reference  rendered in the constructor, without its map if it has one; not kept
  /// \param frame  the reference's mesh, to which all pictures are fitted; must outlive this
  /// \param size  pixels a side
  NormalReference(const Scene& reference, const Mesh& frame, std::vector<ViewAngles> views,
                  std::uint32_t size = 512, bool z_up = false);

  /// Error over the pixels of all views.
  NormalError compare(const Scene& other, bool ignore_map = false) const;

 private:
  Image draw(const Scene& scene, const ViewAngles& view, bool ignore_map) const;

  const Mesh* frame_;
  std::vector<ViewAngles> views_;
  std::uint32_t size_;
  bool z_up_;
  std::vector<Image> pictures_;
};

/// Pictures of a high poly at a size on screen, for comparison with low polys as in LowPolyPlanOptions::screen:
/// mean normals of pixels. Their directions differ from those that plans use. Thread safety: one thread at a
/// time.
class ScreenPictures {
 public:
  /// \param source  must outlive this
  /// \param screen  pixels that the high poly covers, the longer of width and height, 16 to 16384
  /// \param views   directions, 1 or more
  /// \throws Error(usage) for numbers out of range
  ScreenPictures(const Source& source, std::uint32_t screen, std::size_t views = 30);
  ~ScreenPictures();
  ScreenPictures(const ScreenPictures&) = delete;
  ScreenPictures& operator=(const ScreenPictures&) = delete;

  /// Mean angle between the normals of a low poly, without a map, and those of the high poly, degrees.
  double degrees(const Mesh& low) const;
  /// Mean angle between the normals that a low poly shows with a normal map (n/2 + 1/2) and those of the
  /// high poly, degrees.
  /// \param baked  the options that it was baked with
  double degrees(const Mesh& low, const Image& map, const BakeOptions& baked) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Error of a mesh's depth in pictures, compared with the depth of a reference mesh, over the
/// pixels that both meshes cover: the distance error of Wang, Froehlich and Goebel 2003 ("Fast
/// Normal Map Generation for Simplified Meshes", section 5, figure 3b). Normalised screen units: 1
/// is the diagonal of the reference's bounding box. This is the range of a [0, 1] depth buffer
/// whose planes enclose that box in any orientation.
struct DepthError {
  std::uint64_t pixels = 0;  ///< Number of compared pixels: those that both meshes cover
  /// Pixels that only one of the two meshes covers; they are not compared
  std::uint64_t one_sided = 0;
  double mean = 0;  ///< Mean absolute difference
  double rms = 0;   ///< Root mean square of the error
  double max = 0;   ///< Largest difference
};

/// Pictures of the depth of a reference mesh, with which other meshes are compared in the same views, size
/// and frame, with one sample per pixel. Memory: 4 bytes per pixel and view. Immutable; several threads may
/// compare at once.
class DepthReference {
 public:
  /// \param reference  rendered in the constructor, not kept
  /// \param frame  the reference's mesh, to which all pictures are fitted; must outlive this
  /// \param size   pixels a side
  /// \throws as Scene::draw
  DepthReference(const Scene& reference, const Mesh& frame, std::vector<ViewAngles> views,
                 std::uint32_t size = 512, bool z_up = false);

  /// Error over the pixels of all views. Does not depend on the number of threads.
  DepthError compare(const Scene& other) const;

 private:
  Image draw(const Scene& scene, const ViewAngles& view) const;

  const Mesh* frame_;
  std::vector<ViewAngles> views_;
  std::uint32_t size_;
  bool z_up_;
  double unit_ = 1;  ///< World units per normalised screen unit
  std::vector<Image> pictures_;
};

}  // namespace kiln
