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

namespace kiln {
namespace {

/// Places are whole numbers of so many a pixel, so that edges of two triangles leave no gap.
constexpr std::int64_t kSteps = 256;
/// Depths closer than this, as a share of the radius, are one place.
constexpr float kSamePlace = 1e-6F;
constexpr std::uint32_t kNothing = std::numeric_limits<std::uint32_t>::max();

struct Ball {
  Vec3d middle;
  double radius = 0;
};

Ball ball_around(const Mesh& mesh) {
  Box box;
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) box.add(Vec3d(mesh.positions[v]));
  }
  return {(box.low + box.high) * 0.5, 0.5 * box.diagonal()};
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
        depths_(views.pixels * views.pixels, -1e30F),
        ids_(depths_.size(), kNothing) {
    const Vec3d other = std::abs(toward.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
    Vec3d right = cross(other, toward);
    right = right * (1 / length(right));
    const Vec3d up = cross(toward, right);
    const double scale = 0.5 * views.pixels * kSteps / ball.radius;
    dots_.resize(mesh.positions.size());
    for (std::size_t v = 0; v < dots_.size(); ++v) {
      if (!is_finite(mesh.positions[v])) continue;
      const Vec3d p = Vec3d(mesh.positions[v]) - ball.middle;
      const auto place = [&](const Vec3d& axis) {
        return static_cast<std::int32_t>(
            std::clamp((dot(p, axis) + ball.radius) * scale, 0.0, 1e8));
      };
      dots_[v] = {place(right), place(up), static_cast<float>(dot(p, toward) / ball.radius)};
    }
  }

  /// \returns how many pixels it covers
  std::uint32_t draw(std::uint32_t t) {
    const Triangle& v = mesh_.triangles[t];
    std::array<const Dot*, 3> p{&dots_[v[0]], &dots_[v[1]], &dots_[v[2]]};
    const auto turn = [](const Dot& a, const Dot& b, std::int64_t x, std::int64_t y) {
      return (std::int64_t{b.x} - a.x) * (y - a.y) - (std::int64_t{b.y} - a.y) * (x - a.x);
    };
    const auto [left, right] = std::minmax({p[0]->x, p[1]->x, p[2]->x});
    const auto [low, high] = std::minmax({p[0]->y, p[1]->y, p[2]->y});
    const auto first = [](std::int32_t x) { return (x + kSteps / 2 - 1) / kSteps; };
    const auto last = [&](std::int32_t x) {
      return std::min<std::int64_t>((x + kSteps / 2) / kSteps - 1, views_.pixels - 1);
    };
    const std::int64_t x0 = first(left), x1 = last(right), y0 = first(low), y1 = last(high);
    if (x0 > x1 || y0 > y1) return 0;
    std::int64_t area = turn(*p[0], *p[1], p[2]->x, p[2]->y);
    const bool back = area < 0;
    if (area == 0 || (back && !views_.backs)) return 0;
    for (const std::uint32_t corner : v) {
      if (!is_finite(mesh_.positions[corner])) return 0;
    }
    if (back) {
      std::swap(p[1], p[2]);
      area = -area;
    }
    std::uint32_t count = 0;
    for (std::int64_t py = y0; py <= y1; ++py) {
      for (std::int64_t px = x0; px <= x1; ++px) {
        const std::int64_t x = px * kSteps + kSteps / 2, y = py * kSteps + kSteps / 2;
        const std::int64_t w0 = turn(*p[1], *p[2], x, y), w1 = turn(*p[2], *p[0], x, y);
        const std::int64_t w2 = area - w0 - w1;
        if ((w0 | w1 | w2) < 0) continue;
        ++count;
        const auto depth = static_cast<float>((static_cast<double>(w0) * p[0]->depth +
                                               static_cast<double>(w1) * p[1]->depth +
                                               static_cast<double>(w2) * p[2]->depth) /
                                              static_cast<double>(area));
        show(static_cast<std::size_t>(py) * views_.pixels + static_cast<std::size_t>(px), depth,
             2 * t + (back ? 1 : 0));
      }
    }
    return count;
  }
  /// Twice the triangle that each pixel shows, and 1 for its back; or kNothing.
  const std::vector<std::uint32_t>& ids() const { return ids_; }

 private:
  void show(std::size_t pixel, float depth, std::uint32_t id) {
    const float before = depths_[pixel];
    if (depth < before - kSamePlace) return;
    if (depth <= before + kSamePlace && !((id & 1) == 0 && (ids_[pixel] & 1) == 1)) return;
    depths_[pixel] = depth;
    ids_[pixel] = id;
  }

  const Mesh& mesh_;
  const OutsideViews& views_;
  std::vector<Dot> dots_;
  std::vector<float> depths_;
  std::vector<std::uint32_t> ids_;
};

}  // namespace

std::vector<SeenPixels> look_from_outside(const Mesh& mesh, std::span<const std::uint32_t> group,
                                          std::size_t groups, const OutsideViews& views) {
  std::vector<SeenPixels> seen(groups);
  const Ball ball = ball_around(mesh);
  if (!(ball.radius > 0)) return seen;
  std::mutex mutex;  // Whole numbers are summed: their order does not matter.
  parallel_for(views.count, 1, [&](std::size_t view, std::size_t) {
    Picture picture(mesh, ball, direction(static_cast<std::uint32_t>(view), views.count), views);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> drawn;  // of runs of one group
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const std::uint32_t count = picture.draw(t);
      if (count == 0) continue;
      if (drawn.empty() || drawn.back().first != group[t]) drawn.push_back({group[t], 0});
      drawn.back().second += count;
    }
    const std::scoped_lock lock(mutex);
    for (const auto& [of, count] : drawn) seen[of].drawn += count;
    for (const std::uint32_t id : picture.ids()) {
      if (id == kNothing) continue;
      SeenPixels& of = seen[group[id / 2]];
      ++((id & 1) == 0 ? of.front : of.back);
    }
  });
  return seen;
}

}  // namespace kiln
