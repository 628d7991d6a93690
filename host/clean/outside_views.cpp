#include "clean/outside_views.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <numbers>
#include <utility>

#include "base/parallel.h"
#include "clean/triangle_list.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// Places are whole numbers of so many a pixel, so that edges of two triangles leave no gap.
constexpr std::int32_t kSteps = 256;
/// Depths closer than this, as a share of the radius, are one place.
constexpr float kSamePlace = 1e-6F;
/// Triangles, one after another, that are asked together whether they can hide anything.
constexpr std::uint32_t kBlock = 64;
/// Times that triangles may cover a picture on average; where they cover it more often, it is smaller, so that its time
/// is bounded. Closed bodies cover it one to ten times.
constexpr double kMostCover = 32;
constexpr std::uint32_t kLeastPixels = 64;
constexpr std::uint32_t kNothing = std::numeric_limits<std::uint32_t>::max();

struct Ball {
  Vec3d middle;
  double radius = 0;
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
  Picture(const Mesh& mesh, const Ball& ball, const Vec3d& toward, const OutsideViews& views)
      : mesh_(mesh),
        views_(views),
        ball_(ball),
        toward_(toward),
        depths_(views.pixels * views.pixels, -1e30F),
        ids_(depths_.size(), kNothing) {
    const Vec3d other = std::abs(toward.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
    right_ = cross(other, toward);
    right_ = right_ * (1 / length(right_));
    up_ = cross(toward, right_);
    scale_ = 0.5 * views.pixels * kSteps / ball.radius;
    dots_.resize(mesh.positions.size());
    for (std::size_t v = 0; v < dots_.size(); ++v) {
      if (is_finite(mesh.positions[v])) dots_[v] = dot_of(Vec3d(mesh.positions[v]));
    }
  }

  /// \returns how many pixels it covers
  std::uint32_t draw(std::uint32_t t) {
    return each_pixel(t, [&](std::size_t at, float depth, std::uint32_t id) {
      const float before = depths_[at];
      if (depth < before - kSamePlace) return;
      if (depth <= before + kSamePlace && !(is_front(id) && !is_front(ids_[at]))) return;
      depths_[at] = depth;
      ids_[at] = id;
    });
  }
  /// Twice the triangle that each pixel shows, and 1 for its back; or kNothing.
  const std::vector<std::uint32_t>& ids() const { return ids_; }

  /// From now on nothing more is drawn, but what is shown may be hidden by others.
  void end_of_drawing() {
    shows_.resize(ids_.size());
    std::transform(ids_.begin(), ids_.end(), shows_.begin(),
                   [](std::uint32_t id) { return id != kNothing; });
  }
  /// Pixels that would show this triangle, had all been drawn in order, show nothing.
  void hide(std::uint32_t t) {
    each_pixel(t, [&](std::size_t at, float depth, std::uint32_t id) {
      if (shows_[at] == 0 || depth < depths_[at] - kSamePlace) return;
      if (depth <= depths_[at] + kSamePlace) {
        const bool first = id < ids_[at];
        if (is_front(id) == is_front(ids_[at]) ? !first : !is_front(id)) return;
      }
      ids_[at] = kNothing;
      shows_[at] = 0;
    });
  }
  /// False if nothing is shown where a ball is.
  bool shows_at(const Ball& ball) const {
    const Dot middle = dot_of(ball.middle);
    const auto reach = static_cast<std::int32_t>(ball.radius * scale_) + 1;
    const Extent extent =
        extent_of(middle.x - reach, middle.x + reach, middle.y - reach, middle.y + reach);
    for (std::int32_t y = extent.y0; y <= extent.y1; ++y) {
      if (shows_in(pixel(extent.x0, y), pixel(extent.x1, y) + 1)) return true;
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
      return static_cast<std::int32_t>(
          std::clamp((dot(p, axis) + ball_.radius) * scale_, 0.0, 1e8));
    };
    return {place(right_), place(up_), static_cast<float>(dot(p, toward_) / ball_.radius)};
  }
  std::size_t pixel(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y) * views_.pixels + static_cast<std::size_t>(x);
  }
  static bool is_front(std::uint32_t id) { return (id & 1) == 0; }
  bool shows_in(std::size_t begin, std::size_t end) const {
    return begin < end && std::memchr(&shows_[begin], 1, end - begin) != nullptr;
  }

  /// \param body  of pixels that a triangle covers, with its depth and what ids() has of it
  /// \returns how many
  template <class Body>
  std::uint32_t each_pixel(std::uint32_t t, const Body& body) {
    const Triangle& v = mesh_.triangles[t];
    std::array<const Dot*, 3> p{&dots_[v[0]], &dots_[v[1]], &dots_[v[2]]};
    const auto [left, right] = std::minmax({p[0]->x, p[1]->x, p[2]->x});
    const auto [low, high] = std::minmax({p[0]->y, p[1]->y, p[2]->y});
    const Extent extent = extent_of(left, right, low, high);
    if (extent.x0 > extent.x1 || extent.y0 > extent.y1) return 0;
    // Whole numbers below 2^53, so that these are exact.
    const auto turn = [](const Dot& a, const Dot& b, double x, double y) {
      return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    };
    double area = turn(*p[0], *p[1], p[2]->x, p[2]->y);
    const bool back = area < 0;
    if (area == 0 || (back && !views_.backs)) return 0;
    for (const std::uint32_t corner : v) {
      if (!is_finite(mesh_.positions[corner])) return 0;
    }
    if (back) {
      std::swap(p[1], p[2]);
      area = -area;
    }
    const auto step = [](const Dot& a, const Dot& b) { return 1.0 * kSteps * (a.y - b.y); };
    const double step0 = step(*p[1], *p[2]), step1 = step(*p[2], *p[0]);
    std::uint32_t count = 0;
    for (std::int32_t py = extent.y0; py <= extent.y1; ++py) {
      const std::size_t begin = pixel(extent.x0, py), end = pixel(extent.x1, py) + 1;
      if (!shows_.empty() && !shows_in(begin, end)) continue;
      const double x = extent.x0 * kSteps + kSteps / 2, y = py * kSteps + kSteps / 2;
      double w0 = turn(*p[1], *p[2], x, y), w1 = turn(*p[2], *p[0], x, y);
      for (std::size_t at = begin; at < end; ++at, w0 += step0, w1 += step1) {
        const double w2 = area - w0 - w1;
        // One branch, since which pixels are inside cannot be foretold.
        if (!(std::min({w0, w1, w2}) >= 0)) continue;
        ++count;
        const auto depth =
            static_cast<float>((w0 * p[0]->depth + w1 * p[1]->depth + w2 * p[2]->depth) / area);
        body(at, depth, 2 * t + (back ? 1 : 0));
      }
    }
    return count;
  }

  const Mesh& mesh_;
  const OutsideViews& views_;
  Ball ball_;
  Vec3d toward_, right_, up_;
  double scale_ = 0;  ///< Steps a unit of length
  std::vector<Dot> dots_;
  std::vector<float> depths_;
  std::vector<std::uint32_t> ids_;
  std::vector<std::uint8_t> shows_;  ///< Of a pixel, whether it shows anything; none while drawing
};

/// Balls around blocks of triangles.
std::vector<Ball> balls_around_blocks(const Mesh& mesh) {
  std::vector<Ball> balls;
  for (std::size_t first = 0; first < mesh.triangles.size(); first += kBlock) {
    const std::size_t count = std::min<std::size_t>(kBlock, mesh.triangles.size() - first);
    balls.push_back(ball_around(mesh, std::span(mesh.triangles).subspan(first, count)));
  }
  return balls;
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
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  const auto is_asked = [&](std::uint32_t t) { return asked.empty() || asked[group[t]] != 0; };
  const std::vector<Ball> blocks = asked.empty() ? std::vector<Ball>() : balls_around_blocks(mesh);
  std::mutex mutex;  // Whole numbers are summed: their order does not matter.
  const std::uint32_t pictures = (views.count - views.first + views.step - 1) / views.step;
  parallel_for(pictures, 1, [&](std::size_t number, std::size_t) {
    const auto view = views.first + static_cast<std::uint32_t>(number) * views.step;
    Picture picture(mesh, ball, direction(view, views.count), views);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> drawn;  // of runs of one group
    for (std::uint32_t t = 0; t < count; ++t) {
      if (!is_asked(t)) continue;
      const std::uint32_t pixels = picture.draw(t);
      if (pixels == 0) continue;
      if (drawn.empty() || drawn.back().first != group[t]) drawn.push_back({group[t], 0});
      drawn.back().second += pixels;
    }
    if (!asked.empty()) {
      picture.end_of_drawing();
      for (std::uint32_t t = 0; t < count; ++t) {
        if (t % kBlock == 0 && !picture.shows_at(blocks[t / kBlock])) {
          t += kBlock - 1;
        } else if (!is_asked(t)) {
          picture.hide(t);
        }
      }
    }
    const std::scoped_lock lock(mutex);
    for (const auto& [of, pixels] : drawn) seen[of].drawn += pixels;
    for (const std::uint32_t id : picture.ids()) {
      if (id == kNothing) continue;
      SeenPixels& of = seen[group[id / 2]];
      ++((id & 1) == 0 ? of.front : of.back);
    }
  });
  return seen;
}

}  // namespace kiln
