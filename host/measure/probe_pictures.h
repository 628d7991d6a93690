// Pictures of a mesh from many sides, by rays or drawing, pixel by pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "accel/ray.h"
#include "kiln/image.h"
#include "kiln/measure.h"
#include "mesh/vector.h"
#include "render/camera.h"
#include "source/high_poly.h"

namespace kiln {

/// A camera in the high poly's frame.
struct Picture {
  Vec3d right, up, toward;
  Vec3d middle;
  double half_side = 0;
  std::uint32_t pixels = 0;     ///< A side
  std::uint32_t subpixels = 1;  ///< Points a side of each pixel
  double footprint = 0;         ///< Side of the square that a pixel's points spread over

  Picture(const Camera& camera, const Frame& frame, std::uint32_t size);

  /// Points of one picture.
  std::uint32_t points() const { return pixels * pixels * subpixels * subpixels; }
  /// In the plane through `middle`. Pixels follow each other by tiles, so that rays that are neighbours in
  /// memory are neighbours in the picture; the points of a pixel follow each other.
  Vec3d point(std::uint32_t index) const;
  kiln_view view(std::uint32_t first) const;
};

/// The nearest triangle at every point of all pictures.
struct PictureHits {
  std::vector<std::uint32_t> triangle;
  std::vector<float> barycentric;  ///< 2 planes; empty where the mesh was drawn
};

/// Grid of points in pictures.
struct PictureGrid {
  std::uint32_t pixels =
      kPictureTile;  ///< Looked at, a side of each picture; a multiple of kPictureTile
  /// Pixels a side of the picture as it is seen: each pixel looked at is as large as one of these, and its
  /// points spread over it. 0: a pixel is one point.
  std::uint32_t screen = 0;
  static constexpr std::uint32_t kPictureTile = 8;
};

/// Points a side of a pixel with PictureGrid::screen.
inline constexpr std::uint32_t kScreenSubpixels = 3;

/// Pixels looked at of pictures of a size on screen, a side.
inline constexpr std::uint32_t kScreenPixels = 24;
/// Distance from the middle at which rays to the high poly start: it lies within a radius of 1.
inline constexpr double kDenseStart = 1.5;

/// Pictures that the high poly fills.
std::vector<Picture> pictures_of(const Source::Impl& source, const std::vector<ViewAngles>& views,
                                 const PictureGrid& grid);

/// \param start  how far from the middle rays start
PictureHits hits_by_rays(cl::Context& context, const RayCaster& rays,
                         const std::vector<Picture>& pictures, double start);

/// The same of the high poly, drawn; of pictures whose pixels are points.
/// \param needed  which pictures; the others stay empty
PictureHits hits_by_raster(const Source::Impl& source, const std::vector<Picture>& pictures,
                           const std::vector<bool>& needed);

/// The high poly's shading normal where a pixel's ray meets a triangle, turned to the viewer.
Vec3d dense_normal(const Source::Impl& source, const std::vector<std::uint32_t>& normal_indices,
                   const std::vector<float>& normals, const Picture& picture, const Vec3d& pixel,
                   std::uint32_t triangle);

}  // namespace kiln
