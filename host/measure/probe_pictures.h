// Pictures of a mesh from many sides, by ray casting or rasterization. A picture is a list of
// points.
#pragma once

#include <cstdint>
#include <vector>

#include "accel/ray.h"
#include "kiln/measure.h"
#include "mesh/vector.h"
#include "render/camera.h"
#include "source/high_poly.h"

namespace kiln {

/// A camera in the high poly's frame.
struct Picture {
  Vec3d right{}, up{}, toward{};
  Vec3d center{};
  double half_side = 0;
  std::uint32_t pixels = 0;     ///< Side of the picture in pixels
  std::uint32_t subpixels = 1;  ///< Number of points along a pixel's side
  double pixel_footprint = 0;   ///< Side of the square over which the points of a pixel are spread

  Picture(const Camera& camera, const Frame& frame, std::uint32_t size);

  /// Number of points in a picture.
  std::uint32_t points() const { return pixels * pixels * subpixels * subpixels; }
  /// Position of a point in the picture's plane through the mesh's centre. Pixels are ordered by tiles, so that rays
  /// adjacent in memory are close in the picture; the points of a pixel are consecutive.
  Vec3d point(std::uint32_t index) const;
  kiln_view view(std::uint32_t first) const;
};

/// The nearest triangle at every point of all pictures.
struct PictureHits {
  std::vector<std::uint32_t> triangle;
  std::vector<float>
      barycentric;  ///< Two arrays, one per coordinate; empty if the mesh was rasterized
};

/// Grid of the points at which pictures are sampled.
struct PictureGrid {
  /// Number of sampled pixels along a picture's side; a multiple of kPictureTile
  std::uint32_t pixels = kPictureTile;
  /// Side in pixels of the picture as shown on screen. A sampled pixel then has the size of a pixel on screen, and its
  /// points cover it. If 0, each sampled pixel is a single point.
  std::uint32_t pixels_on_screen = 0;
  static constexpr std::uint32_t kPictureTile = 8;
};

/// Number of points along a pixel's side if PictureGrid::pixels_on_screen is set.
inline constexpr std::uint32_t kScreenSubpixels = 3;

/// Number of sampled pixels along each side of a picture, if the user gave the mesh's size on screen.
inline constexpr std::uint32_t kScreenPixels = 24;
/// Distance from the centre at which rays to the high poly start; the mesh lies within a radius of 1.
inline constexpr double kHighPolyRayStart = 1.5;

/// Makes the pictures. The high poly fills each of them from side to side.
std::vector<Picture> make_pictures(const Source::Impl& source, const std::vector<ViewAngles>& views,
                                   const PictureGrid& grid);

/// \param start  distance of rays' origins from the centre
PictureHits cast_hits(cl::Context& context, const RayCaster& rays,
                      const std::vector<Picture>& pictures, double start);

/// Computes the hits of the high poly by rasterization, for pictures whose pixels are single points.
/// \param needed  true for each picture that is rasterized; the others remain empty
PictureHits rasterize_hits(const Source::Impl& source, const std::vector<Picture>& pictures,
                           const std::vector<bool>& needed);

/// The high poly's shading normal where a pixel's ray hits a triangle, flipped towards the viewer.
Vec3d high_poly_normal(const Source::Impl& source, const std::vector<std::uint32_t>& normal_indices,
                       const std::vector<float>& normals, const Picture& picture,
                       const Vec3d& pixel, std::uint32_t triangle);

}  // namespace kiln
