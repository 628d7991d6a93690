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

/// Places are whole numbers of so many a pixel, so that edges of two triangles leave no gap.
constexpr std::int32_t kSteps = 256;
/// Depths closer than this, as a share of the radius, are one place.
constexpr float kSamePlace = 1e-6F;
/// Triangles of a block.
constexpr std::uint32_t kBlock = 32;
/// Times that triangles may cover a picture on average. Where they cover it more often, the picture is smaller, so that
/// time is linear in the number of triangles. Closed bodies cover it one to ten times; pictures of the least side are of
/// meshes that repeat themselves tens of thousands of times.
constexpr double kMostCover = 32;
constexpr std::uint32_t kLeastPixels = 16;
/// Pixels of a side of a tile, a power of two.
constexpr std::int32_t kTile = 4;
constexpr float kFar = 1e30F;
constexpr std::uint32_t kNothing = std::numeric_limits<std::uint32_t>::max();

struct Ball {
  Vec3d middle;
  double radius = 0;
};

/// The box of triangles that are asked together whether they can hide anything.
struct Block {
  Vec3d middle, half;
};

Ball ball_around(const Mesh& mesh, std::span<const Triangle> triangles) {
  Box box;
  for (const Triangle& t : triangles) {
    for (const std::uint32_t v : t) box.add(Vec3d(mesh.positions[v]));
  }
  return {(box.low + box.high) * 0.5, 0.5 * box.diagonal()};
}

/// The side of pictures of so much area. Seen from all around, a triangle shows half of its area in the mean (Cauchy).
std::uint32_t bounded_side(const Mesh& mesh, const Ball& ball, std::uint32_t pixels) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) area += area_of(mesh, t);
  const double cover = area / 2 / (4 * ball.radius * ball.radius);
  if (cover <= kMostCover) return pixels;
  return std::max(kLeastPixels, static_cast<std::uint32_t>(pixels * std::sqrt(kMostCover / cover)));
}

/// Directions on a spiral around the sphere.
Vec3d direction(std::uint32_t i, std::uint32_t count) {
  const double z = 1 - (2.0 * i + 1) / count;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// A vertex in a picture.
struct Dot {
  std::int32_t x, y;
  float depth;  ///< Towards the viewer
};

class Picture {
 public:
  Picture(const Mesh& mesh, std::span<const Triangle> triangles, const Ball& ball,
          const Vec3d& toward, const OutsideViews& views)
      : triangles_(triangles),
        views_(views),
        ball_(ball),
        toward_(toward),
        pixels_(std::size_t{views.pixels} * views.pixels) {
    const Vec3d other = std::abs(toward.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
    right_ = cross(other, toward);
    right_ = right_ * (1 / length(right_));
    up_ = cross(toward, right_);
    scale_ = 0.5 * views.pixels * kSteps / ball.radius;
    dots_.resize(mesh.positions.size());
    std::transform(mesh.positions.begin(), mesh.positions.end(), dots_.begin(),
                   [&](const Vec3& v) { return dot_of(Vec3d(v)); });
  }

  /// \returns how many pixels it covers
  std::uint32_t draw(std::uint32_t t) {
    return each_pixel(t, [&](Pixel& at, float depth, std::uint32_t id) {
      if (depth < at.depth - kSamePlace) return;
      if (depth <= at.depth + kSamePlace && !(is_front(id) && !is_front(at.id))) return;
      at = {depth, id};
    });
  }
  struct Pixel {
    float depth = -kFar;
    /// Twice the triangle that it shows, and 1 for its back; or kNothing.
    std::uint32_t id = kNothing;
  };
  const std::vector<Pixel>& pixels() const { return pixels_; }

  /// From now on nothing more is drawn, but what is shown may be hidden by others.
  void end_of_drawing() {
    tiles_side_ = (views_.pixels + kTile - 1) / kTile;
    tiles_.resize(std::size_t{tiles_side_} * tiles_side_);
    for (std::uint32_t i = 0; i < pixels_.size(); ++i) {
      Pixel& at = pixels_[i];
      if (at.id == kNothing) {
        at.depth = kFar;
        continue;
      }
      Tile& tile = tile_at(i % views_.pixels, i / views_.pixels);
      tile.farthest = std::min(tile.farthest, at.depth);
      ++tile.shown;
    }
  }
  /// Pixels that would show this triangle, had all been drawn in order, show nothing.
  void hide(std::uint32_t t) {
    each_pixel(t, [&](Pixel& at, float depth, std::uint32_t id) {
      if (depth < at.depth - kSamePlace) return;
      if (depth <= at.depth + kSamePlace) {
        const bool first = id < at.id;
        if (is_front(id) == is_front(at.id) ? !first : !is_front(id)) return;
      }
      at = {kFar, kNothing};
      const auto i = static_cast<std::uint32_t>(&at - pixels_.data());
      Tile& tile = tile_at(i % views_.pixels, i / views_.pixels);
      if (--tile.shown == 0) tile.farthest = kFar;
    });
  }
  /// False if nothing in a block hides anything.
  bool may_hide(const Block& block) const {
    const Dot middle = dot_of(block.middle);
    const auto reach = [&](const Vec3d& axis) {
      return std::abs(axis.x) * block.half.x + std::abs(axis.y) * block.half.y +
             std::abs(axis.z) * block.half.z;
    };
    const auto steps = [&](const Vec3d& axis) {
      return static_cast<std::int32_t>(reach(axis) * scale_) + 2;
    };
    const Extent extent = extent_of(middle.x - steps(right_), middle.x + steps(right_),
                                    middle.y - steps(up_), middle.y + steps(up_));
    // No less than all depths in it, however these are rounded.
    const float top = middle.depth + static_cast<float>(reach(toward_) / ball_.radius) + kSamePlace;
    for (std::int32_t y = extent.y0; y <= extent.y1; y = (y | (kTile - 1)) + 1) {
      if (may_hide(extent, y, top)) return true;
    }
    return false;
  }

 private:
  /// Pixels whose centres a box holds, from first to last.
  struct Extent {
    std::int32_t x0, x1, y0, y1;
  };
  Extent extent_of(std::int32_t left, std::int32_t right, std::int32_t low,
                   std::int32_t high) const {
    const auto first = [](std::int32_t x) { return std::max((x + kSteps / 2 - 1) / kSteps, 0); };
    const auto last = [&](std::int32_t x) {
      return std::min((x + kSteps / 2) / kSteps, static_cast<std::int32_t>(views_.pixels)) - 1;
    };
    return {first(left), last(right), first(low), last(high)};
  }
  Dot dot_of(const Vec3d& point) const {
    const Vec3d p = point - ball_.middle;
    const auto place = [&](const Vec3d& axis) {
      // In this order, what is not a number becomes 0.
      const double steps = std::max(0.0, (dot(p, axis) + ball_.radius) * scale_);
      return static_cast<std::int32_t>(std::min(steps, 1e8));
    };
    return {place(right_), place(up_), static_cast<float>(dot(p, toward_) / ball_.radius)};
  }
  static bool is_front(std::uint32_t id) { return (id & 1) == 0; }
  /// A square of pixels, by which triangles that hide none of them are told without a look at each.
  struct Tile {
    float farthest = kFar;    ///< No pixel shows anything behind this depth.
    std::uint32_t shown = 0;  ///< Pixels that show anything.
  };
  Tile& tile_at(std::uint32_t x, std::uint32_t y) {
    return tiles_[std::size_t{y / kTile} * tiles_side_ + x / kTile];
  }
  /// False if in this row's tiles nothing up to a depth hides anything.
  bool may_hide(const Extent& extent, std::int32_t y, float top) const {
    const Tile* const row = &tiles_[static_cast<std::size_t>(y / kTile) * tiles_side_];
    for (std::int32_t x = extent.x0 / kTile; x <= extent.x1 / kTile; ++x) {
      if (!(top < row[x].farthest - kSamePlace)) return true;
    }
    return false;
  }

  /// \param body  of pixels that a triangle covers, with its depth and what it shows
  /// \returns how many
  template <class Body>
  std::uint32_t each_pixel(std::uint32_t t, const Body& body) {
    const Triangle& v = triangles_[t];
    std::array<const Dot*, 3> p{&dots_[v[0]], &dots_[v[1]], &dots_[v[2]]};
    // Not of a list, which would branch on places that cannot be foretold.
    const auto least = [](std::int32_t a, std::int32_t b, std::int32_t c) {
      return std::min(std::min(a, b), c);
    };
    const auto most = [](std::int32_t a, std::int32_t b, std::int32_t c) {
      return std::max(std::max(a, b), c);
    };
    const Extent extent =
        extent_of(least(p[0]->x, p[1]->x, p[2]->x), most(p[0]->x, p[1]->x, p[2]->x),
                  least(p[0]->y, p[1]->y, p[2]->y), most(p[0]->y, p[1]->y, p[2]->y));
    if (extent.x0 > extent.x1 || extent.y0 > extent.y1) return 0;
    const auto turn = [](const Dot& a, const Dot& b, std::int64_t x, std::int64_t y) {
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
    const std::int64_t step0 = kSteps * (p[1]->y - p[2]->y), step1 = kSteps * (p[2]->y - p[0]->y);
    std::uint32_t count = 0;
    for (std::int32_t py = extent.y0; py <= extent.y1; ++py) {
      if (!tiles_.empty() && (py == extent.y0 || py % kTile == 0) && !may_hide(extent, py, top)) {
        py |= kTile - 1;
        continue;
      }
      Pixel* const row = &pixels_[static_cast<std::size_t>(py) * views_.pixels];
      const std::int64_t x = extent.x0 * kSteps + kSteps / 2, y = py * kSteps + kSteps / 2;
      std::int64_t w0 = turn(*p[1], *p[2], x, y), w1 = turn(*p[2], *p[0], x, y);
      for (std::int32_t px = extent.x0; px <= extent.x1; ++px, w0 += step0, w1 += step1) {
        const std::int64_t w2 = area - w0 - w1;
        // One branch, since which pixels are inside cannot be foretold.
        if ((w0 | w1 | w2) < 0) continue;
        ++count;
        if (top < row[px].depth - kSamePlace) continue;
        // Whole numbers below 2^53: only the depth is rounded.
        const auto of = [](std::int64_t w, const Dot& dot) {
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
  Ball ball_;
  Vec3d toward_, right_, up_;
  double scale_ = 0;  ///< Steps a unit of length
  std::vector<Dot> dots_;
  std::vector<Pixel> pixels_;
  std::vector<Tile> tiles_;  ///< None while drawing
  std::uint32_t tiles_side_ = 0;
};

/// For each triangle the first one that has the same corners in the same order, which covers the same pixels.
std::vector<std::uint32_t> first_alike(const Mesh& mesh) {
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
      const bool same = i > 0 && items[i].key == items[i - 1].key;
      first[items[i].index] = same ? first[items[i - 1].index] : items[i].index;
    }
  }
  return first;
}

std::vector<Block> blocks_of(const Mesh& mesh, std::span<const std::uint32_t> triangles) {
  std::vector<Block> blocks;
  for (std::size_t first = 0; first < triangles.size(); first += kBlock) {
    Box box;
    for (std::size_t i = first; i < std::min(first + kBlock, triangles.size()); ++i) {
      for (const std::uint32_t v : mesh.triangles[triangles[i]]) box.add(point_of(mesh, v));
    }
    const bool any = box.diagonal() > 0;
    blocks.push_back(
        {any ? (box.low + box.high) * 0.5 : Vec3d(), any ? (box.high - box.low) * 0.5 : Vec3d()});
  }
  return blocks;
}

}  // namespace

std::vector<SeenPixels> look_from_outside(const Mesh& mesh, std::span<const std::uint32_t> group,
                                          std::size_t groups, const OutsideViews& wanted,
                                          std::span<const std::uint8_t> asked) {
  std::vector<SeenPixels> seen(groups);
  const Ball ball = ball_around(mesh, mesh.triangles);
  if (!(ball.radius > 0)) return seen;
  OutsideViews views = wanted;
  views.pixels = bounded_side(mesh, ball, wanted.pixels);
  std::vector<std::uint32_t> shown, others;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    (asked.empty() || asked[group[t]] != 0 ? shown : others).push_back(t);
  }
  const std::vector<Block> blocks = blocks_of(mesh, others);
  std::vector<Triangle> triangles = mesh.triangles;
  for (Triangle& t : triangles) {
    const auto finite = [&](std::uint32_t v) { return is_finite(mesh.positions[v]); };
    if (!std::all_of(t.begin(), t.end(), finite)) t = {};  // Covers nothing.
  }
  // Where pictures are smaller, triangles repeat each other. What repeats an earlier one hides nothing of it: where both lie
  // in one place, the earlier one is seen.
  const bool repeats = views.pixels < wanted.pixels && others.empty();
  const std::vector<std::uint32_t> first =
      repeats ? first_alike(mesh) : std::vector<std::uint32_t>();
  std::mutex mutex;  // Whole numbers are summed: their order does not matter.
  const std::uint32_t pictures = (views.count - views.first + views.step - 1) / views.step;
  parallel_for(pictures, 1, [&](std::size_t number, std::size_t) {
    const auto view = views.first + static_cast<std::uint32_t>(number) * views.step;
    Picture picture(mesh, triangles, ball, direction(view, views.count), views);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> drawn;  // of runs of one group
    std::vector<std::uint32_t> covered(first.size());            // pixels, of first ones
    for (const std::uint32_t t : shown) {
      std::uint32_t pixels = 0;
      if (!repeats) {
        pixels = picture.draw(t);
      } else {
        if (first[t] == t) covered[t] = picture.draw(t);
        pixels = covered[first[t]];
      }
      if (pixels == 0) continue;
      if (drawn.empty() || drawn.back().first != group[t]) drawn.push_back({group[t], 0});
      drawn.back().second += pixels;
    }
    if (!others.empty()) {
      picture.end_of_drawing();
      for (std::size_t i = 0; i < others.size(); ++i) {
        if (i % kBlock == 0 && !picture.may_hide(blocks[i / kBlock])) {
          i += kBlock - 1;
        } else {
          picture.hide(others[i]);
        }
      }
    }
    const std::scoped_lock lock(mutex);
    for (const auto& [of, pixels] : drawn) seen[of].drawn += pixels;
    for (const auto& [depth, id] : picture.pixels()) {
      if (id == kNothing) continue;
      SeenPixels& of = seen[group[id / 2]];
      ++((id & 1) == 0 ? of.front : of.back);
    }
  });
  return seen;
}

}  // namespace kiln
