#include "clean/outside_views.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <utility>

#include "base/parallel.h"
#include "clean/triangle_list.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Number of subpixel steps per pixel. With integer coordinates, there are no gaps between triangles that share an
/// edge.
constexpr std::int32_t kSubpixelSteps = 256;
/// Depths count as equal if they differ by less than this share of the radius.
constexpr float kDepthTolerance = 1e-6F;
/// Number of triangles in a block.
constexpr std::uint32_t kTrianglesPerBlock = 32;
/// How many times triangles may cover a picture, on average over its pixels. If they cover it more often, pictures are
/// made smaller, so that the time is linear in the number of triangles. Closed bodies cover a picture one to ten times.
/// kMinPictureSide is only reached by meshes that overlap themselves tens of thousands of times.
constexpr double kMaxMeanCover = 32;
constexpr std::uint32_t kMinPictureSide = 16;
/// Side of a tile in pixels, a power of two.
constexpr std::int32_t kTileSide = 4;
constexpr float kFarDepth = 1e30F;
constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();

struct Ball {
  Vec3d centre{};
  double radius = 0;
};

/// Bounding box of several triangles, which are tested for occlusion together.
struct TriangleBlock {
  Vec3d centre{}, half{};
};

Ball ball_around(const Mesh& mesh, std::span<const Triangle> triangles) {
  Box<Vec3d> box;
  for (const Triangle& t : triangles) add_triangle(box, mesh, t);
  return {box.center(), 0.5 * box.diagonal()};
}

/// Side of pictures in pixels, limited by the mesh's area. Over all directions, the mean projected area of a triangle
/// is half of its area (Cauchy).
std::uint32_t picture_side(const Mesh& mesh, const Ball& ball, std::uint32_t pixels) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) area += area_of(mesh, t);
  const double cover = area / 2 / (4 * ball.radius * ball.radius);
  if (cover <= kMaxMeanCover) return pixels;
  return std::max(kMinPictureSide,
                  static_cast<std::uint32_t>(pixels * std::sqrt(kMaxMeanCover / cover)));
}

/// Direction i of `count` directions on a spiral around the sphere.
Vec3d spiral_direction(std::uint32_t i, std::uint32_t count) {
  const double z = 1 - (2.0 * i + 1) / count;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// A projected vertex.
struct PicturePoint {
  std::int32_t x, y;
  float depth;  ///< Larger values are nearer to the viewer
};

class Picture {
 public:
  Picture(const Mesh& mesh, std::span<const Triangle> triangles, const Ball& ball,
          const Vec3d& toward, const OutsideViews& views)
      : triangles_(triangles),
        views_(views),
        bounding_ball_(ball),
        view_direction_(toward),
        pixels_(std::size_t{views.pixels} * views.pixels) {
    const Vec3d other = std::abs(toward.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
    right_ = cross(other, toward);
    right_ = right_ * (1 / length(right_));
    up_ = cross(toward, right_);
    scale_ = 0.5 * views.pixels * kSubpixelSteps / ball.radius;
    points_.resize(mesh.positions.size());
    std::transform(mesh.positions.begin(), mesh.positions.end(), points_.begin(),
                   [&](const Vec3& v) { return picture_point_of(to_double(v)); });
  }

  /// Draws a triangle.
  /// \returns the number of pixels it covers
  std::uint32_t draw(std::uint32_t t) {
    return each_pixel(t, [&](Pixel& at, float depth, std::uint32_t id) {
      if (depth < at.depth - kDepthTolerance) return;
      if (depth <= at.depth + kDepthTolerance && !(is_front(id) && !is_front(at.id))) return;
      at = {depth, id};
    });
  }
  struct Pixel {
    float depth = -kFarDepth;
    /// Twice the index of the visible triangle, plus 1 if its back is visible; or kNoTriangle.
    std::uint32_t id = kNoTriangle;
  };
  const std::vector<Pixel>& pixels() const { return pixels_; }

  /// Ends drawing: builds the tiles, by which may_occlude() tests whether triangles may still hide
  /// others.
  void end_drawing() {
    tiles_per_side_ = (views_.pixels + kTileSide - 1) / kTileSide;
    tiles_.resize(std::size_t{tiles_per_side_} * tiles_per_side_);
    for (std::uint32_t i = 0; i < pixels_.size(); ++i) {
      Pixel& at = pixels_[i];
      if (at.id == kNoTriangle) {
        at.depth = kFarDepth;
        continue;
      }
      Tile& tile = tile_at(i % views_.pixels, i / views_.pixels);
      tile.smallest_depth = std::min(tile.smallest_depth, at.depth);
      ++tile.shown_pixels;
    }
  }
  /// Clears the pixels that this triangle would have covered if all triangles had been drawn in order.
  void hide(std::uint32_t t) {
    each_pixel(t, [&](Pixel& at, float depth, std::uint32_t id) {
      if (depth < at.depth - kDepthTolerance) return;
      if (depth <= at.depth + kDepthTolerance) {
        const bool is_first = id < at.id;
        if (is_front(id) == is_front(at.id) ? !is_first : !is_front(id)) return;
      }
      at = {kFarDepth, kNoTriangle};
      const auto i = static_cast<std::uint32_t>(&at - pixels_.data());
      Tile& tile = tile_at(i % views_.pixels, i / views_.pixels);
      if (--tile.shown_pixels == 0) tile.smallest_depth = kFarDepth;
    });
  }
  /// False if certainly no triangle of a block can occlude anything.
  bool may_occlude(const TriangleBlock& block) const {
    const PicturePoint centre = picture_point_of(block.centre);
    const auto reach = [&](const Vec3d& axis) {
      return std::abs(axis.x) * block.half.x + std::abs(axis.y) * block.half.y +
             std::abs(axis.z) * block.half.z;
    };
    const auto steps = [&](const Vec3d& axis) {
      return static_cast<std::int32_t>(reach(axis) * scale_) + 2;
    };
    const PixelExtent extent = extent_of(centre.x - steps(right_), centre.x + steps(right_),
                                         centre.y - steps(up_), centre.y + steps(up_));
    // No depth in the block exceeds this bound, which includes rounding.
    const float top = centre.depth +
                      static_cast<float>(reach(view_direction_) / bounding_ball_.radius) +
                      kDepthTolerance;
    for (std::int32_t y = extent.y0; y <= extent.y1; y = (y | (kTileSide - 1)) + 1) {
      if (may_occlude(extent, y, top)) return true;
    }
    return false;
  }

 private:
  /// The range of pixels whose centres lie in a box.
  struct PixelExtent {
    std::int32_t x0, x1, y0, y1;
  };
  PixelExtent extent_of(std::int32_t left, std::int32_t right, std::int32_t low,
                        std::int32_t high) const {
    const auto first_centre = [](std::int32_t x) {
      return std::max((x + kSubpixelSteps / 2 - 1) / kSubpixelSteps, 0);
    };
    const auto last_centre = [&](std::int32_t x) {
      return std::min((x + kSubpixelSteps / 2) / kSubpixelSteps,
                      static_cast<std::int32_t>(views_.pixels)) -
             1;
    };
    return {first_centre(left), last_centre(right), first_centre(low), last_centre(high)};
  }
  PicturePoint picture_point_of(const Vec3d& point) const {
    const Vec3d p = point - bounding_ball_.centre;
    const auto place = [&](const Vec3d& axis) {
      // With this order of arguments, NaN becomes 0.
      const double steps = std::max(0.0, (dot(p, axis) + bounding_ball_.radius) * scale_);
      return static_cast<std::int32_t>(std::min(steps, 1e8));
    };
    return {place(right_), place(up_),
            static_cast<float>(dot(p, view_direction_) / bounding_ball_.radius)};
  }
  static bool is_front(std::uint32_t id) { return (id & 1) == 0; }
  /// A square of pixels. A triangle behind all of its pixels is rejected without testing each pixel.
  struct Tile {
    /// Smallest depth of a visible pixel; nothing farther away is visible
    float smallest_depth = kFarDepth;
    std::uint32_t shown_pixels = 0;  ///< Number of pixels that show a triangle
  };
  Tile& tile_at(std::uint32_t x, std::uint32_t y) {
    return tiles_[std::size_t{y / kTileSide} * tiles_per_side_ + x / kTileSide];
  }
  /// False if no tile in this row of tiles has a pixel that a triangle with a depth of at most `top` can occlude.
  bool may_occlude(const PixelExtent& extent, std::int32_t y, float top) const {
    const Tile* const row = &tiles_[static_cast<std::size_t>(y / kTileSide) * tiles_per_side_];
    for (std::int32_t x = extent.x0 / kTileSide; x <= extent.x1 / kTileSide; ++x) {
      if (!(top < row[x].smallest_depth - kDepthTolerance)) return true;
    }
    return false;
  }

  /// Rasterizes a triangle.
  /// \param body  called for each covered pixel, with the triangle's depth and the pixel's content
  /// \returns the number of covered pixels
  template <class Body>
  std::uint32_t each_pixel(std::uint32_t t, const Body& body) {
    const Triangle& v = triangles_[t];
    std::array<const PicturePoint*, 3> p{&points_[v[0]], &points_[v[1]], &points_[v[2]]};
    // std::min() of a list would branch, unpredictably.
    const auto least = [](std::int32_t a, std::int32_t b, std::int32_t c) {
      return std::min(std::min(a, b), c);
    };
    const auto most = [](std::int32_t a, std::int32_t b, std::int32_t c) {
      return std::max(std::max(a, b), c);
    };
    const PixelExtent extent =
        extent_of(least(p[0]->x, p[1]->x, p[2]->x), most(p[0]->x, p[1]->x, p[2]->x),
                  least(p[0]->y, p[1]->y, p[2]->y), most(p[0]->y, p[1]->y, p[2]->y));
    if (extent.x0 > extent.x1 || extent.y0 > extent.y1) return 0;
    const auto turn = [](const PicturePoint& a, const PicturePoint& b, std::int64_t x,
                         std::int64_t y) {
      return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    };
    std::int64_t area = turn(*p[0], *p[1], p[2]->x, p[2]->y);
    const bool back = area < 0;
    if (area == 0 || (back && !views_.backs)) return 0;
    if (back) {
      std::swap(p[1], p[2]);
      area = -area;
    }
    const float top = std::max({p[0]->depth, p[1]->depth, p[2]->depth});
    const std::int64_t step0 = kSubpixelSteps * (p[1]->y - p[2]->y),
                       step1 = kSubpixelSteps * (p[2]->y - p[0]->y);
    std::uint32_t count = 0;
    for (std::int32_t py = extent.y0; py <= extent.y1; ++py) {
      if (!tiles_.empty() && (py == extent.y0 || py % kTileSide == 0) &&
          !may_occlude(extent, py, top)) {
        py |= kTileSide - 1;
        continue;
      }
      Pixel* const row = &pixels_[static_cast<std::size_t>(py) * views_.pixels];
      const std::int64_t x = extent.x0 * kSubpixelSteps + kSubpixelSteps / 2,
                         y = py * kSubpixelSteps + kSubpixelSteps / 2;
      std::int64_t w0 = turn(*p[1], *p[2], x, y), w1 = turn(*p[2], *p[0], x, y);
      for (std::int32_t px = extent.x0; px <= extent.x1; ++px, w0 += step0, w1 += step1) {
        const std::int64_t w2 = area - w0 - w1;
        // Coverage is unpredictable, so it is tested by a single branch.
        if ((w0 | w1 | w2) < 0) continue;
        ++count;
        if (top < row[px].depth - kDepthTolerance) continue;
        // Integers below 2^53 are exact in double precision, so only the resulting depth is rounded.
        const auto of = [](std::int64_t w, const PicturePoint& dot) {
          return static_cast<double>(w) * dot.depth;
        };
        const auto depth = static_cast<float>((of(w0, *p[0]) + of(w1, *p[1]) + of(w2, *p[2])) /
                                              static_cast<double>(area));
        body(row[px], depth, 2 * t + (back ? 1 : 0));
      }
    }
    return count;
  }

  std::span<const Triangle> triangles_;
  const OutsideViews& views_;
  Ball bounding_ball_;
  Vec3d view_direction_{}, right_{}, up_{};
  double scale_ = 0;  ///< Number of subpixel steps per world unit
  std::vector<PicturePoint> points_;
  std::vector<Pixel> pixels_;
  std::vector<Tile> tiles_;  ///< Empty while drawing
  std::uint32_t tiles_per_side_ = 0;
};

/// For each triangle, the first triangle that has the same corners in the same order, and covers the same pixels.
std::vector<std::uint32_t> first_repetitions(const Mesh& mesh) {
  const std::vector<std::uint32_t> place = weld_vertices(mesh.positions);
  const VertexLists lists(
      mesh.positions.size(), mesh.triangles.size(),
      [&](std::size_t t) { return place[mesh.triangles[t][0]]; },
      [&](std::size_t t) {
        const Triangle& v = mesh.triangles[t];
        return std::uint64_t{place[v[1]]} << 32U | place[v[2]];
      });
  std::vector<std::uint32_t> first(mesh.triangles.size());
  for (std::size_t v = 0; v < lists.vertices(); ++v) {
    const std::span<const VertexLists::Item> items = lists.of(v);
    for (std::size_t i = 0; i < items.size(); ++i) {
      const bool repeats_previous = i > 0 && items[i].key == items[i - 1].key;
      first[items[i].index] = repeats_previous ? first[items[i - 1].index] : items[i].index;
    }
  }
  return first;
}

std::vector<TriangleBlock> blocks_of(const Mesh& mesh, std::span<const std::uint32_t> triangles) {
  std::vector<TriangleBlock> triangle_blocks;
  for (std::size_t first = 0; first < triangles.size(); first += kTrianglesPerBlock) {
    Box<Vec3d> box;
    for (std::size_t i = first; i < std::min(first + kTrianglesPerBlock, triangles.size()); ++i) {
      add_triangle(box, mesh, mesh.triangles[triangles[i]]);
    }
    const bool any = box.diagonal() > 0;
    triangle_blocks.push_back({any ? box.center() : Vec3d(), any ? box.size() * 0.5 : Vec3d()});
  }
  return triangle_blocks;
}

}  // namespace

std::vector<SeenPixels> count_seen_pixels(const Mesh& mesh, std::span<const std::uint32_t> group,
                                          std::size_t groups, const OutsideViews& wanted,
                                          std::span<const std::uint8_t> counted) {
  std::vector<SeenPixels> seen_pixels(groups);
  const Ball ball = ball_around(mesh, mesh.triangles);
  if (!(ball.radius > 0)) return seen_pixels;
  OutsideViews views = wanted;
  views.pixels = picture_side(mesh, ball, wanted.pixels);
  std::vector<std::uint32_t> counted_triangles, occluders;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    (counted.empty() || counted[group[t]] != 0 ? counted_triangles : occluders).push_back(t);
  }
  const std::vector<TriangleBlock> triangle_blocks = blocks_of(mesh, occluders);
  std::vector<Triangle> triangles = mesh.triangles;
  for (Triangle& t : triangles) {
    const auto finite = [&](std::uint32_t v) { return is_finite(mesh.positions[v]); };
    // A triangle that is not finite is replaced by one that covers no pixel.
    if (!std::all_of(t.begin(), t.end(), finite)) t = {};
  }
  // In the smaller pictures of large meshes, triangles that are repeated are drawn once. A repetition hides nothing of
  // the earlier triangle: where both cover a pixel, the earlier one is visible.
  const bool draws_repetitions_once = views.pixels < wanted.pixels && occluders.empty();
  const std::vector<std::uint32_t> first =
      draws_repetitions_once ? first_repetitions(mesh) : std::vector<std::uint32_t>();
  std::mutex mutex;  // Guards sums of integers, which do not depend on the order of additions
  const std::uint32_t pictures = (views.count - views.first + views.step - 1) / views.step;
  parallel_for(pictures, 1, [&](std::size_t number, std::size_t) {
    const auto view = views.first + static_cast<std::uint32_t>(number) * views.step;
    Picture picture(mesh, triangles, ball, spiral_direction(view, views.count), views);
    // For each run of consecutive triangles of one group, the group and the number of pixels that were drawn.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> drawn_pixels;
    // For each triangle that is repeated, the number of pixels that its first occurrence covers
    std::vector<std::uint32_t> covered_pixels(first.size());
    for (const std::uint32_t t : counted_triangles) {
      std::uint32_t pixels = 0;
      if (!draws_repetitions_once) {
        pixels = picture.draw(t);
      } else {
        if (first[t] == t) covered_pixels[t] = picture.draw(t);
        pixels = covered_pixels[first[t]];
      }
      if (pixels == 0) continue;
      if (drawn_pixels.empty() || drawn_pixels.back().first != group[t])
        drawn_pixels.push_back({group[t], 0});
      drawn_pixels.back().second += pixels;
    }
    if (!occluders.empty()) {
      picture.end_drawing();
      for (std::size_t i = 0; i < occluders.size(); ++i) {
        if (i % kTrianglesPerBlock == 0 &&
            !picture.may_occlude(triangle_blocks[i / kTrianglesPerBlock])) {
          i += kTrianglesPerBlock - 1;
        } else {
          picture.hide(occluders[i]);
        }
      }
    }
    const std::scoped_lock lock(mutex);
    for (const auto& [of, pixels] : drawn_pixels) seen_pixels[of].drawn += pixels;
    for (const auto& [depth, id] : picture.pixels()) {
      if (id == kNoTriangle) continue;
      SeenPixels& of = seen_pixels[group[id / 2]];
      ++((id & 1) == 0 ? of.front : of.back);
    }
  });
  return seen_pixels;
}

}  // namespace kiln
