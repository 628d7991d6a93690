#include "sweep.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <thread>
#include <utility>

namespace kiln::sample {
namespace {

constexpr std::size_t kPieceElements = std::size_t{1} << 20;  // vertices or triangles per piece
constexpr double kTriangleHeight =
    0.8660254037844386;  // height of an equilateral triangle with unit edges

Profile::ProfileControl blend(const Profile::ProfileControl& a, const Profile::ProfileControl& b,
                              double ta, double tb, double t) {
  const double s = (t - ta) / (tb - ta);
  return {a.radius + s * (b.radius - a.radius), a.height + s * (b.height - a.height)};
}

double distance(const Profile::ProfileControl& a, const Profile::ProfileControl& b) {
  return std::hypot(a.radius - b.radius, a.height - b.height);
}

/// Vertices on each ring of a sweep with edges of about `edge`.
std::vector<std::uint32_t> ring_sizes(const Profile& profile, double edge) {
  const auto bands = static_cast<std::size_t>(
      std::max(4.0, std::round(profile.length() / (edge * kTriangleHeight))));
  std::vector<std::uint32_t> sizes(bands + 1, 1);
  for (std::size_t i = 1; i < bands; ++i) {
    const double radius =
        profile.at(profile.length() * static_cast<double>(i) / static_cast<double>(bands)).radius;
    sizes[i] =
        static_cast<std::uint32_t>(std::max(5.0, std::round(2 * std::numbers::pi * radius / edge)));
  }
  return sizes;
}

std::uint64_t triangle_count(const std::vector<std::uint32_t>& sizes) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i + 1 < sizes.size(); ++i) {
    sum += (sizes[i] > 1 ? sizes[i] : 0) + (sizes[i + 1] > 1 ? sizes[i + 1] : 0);
  }
  return sum;
}

/// Returns the rotation of a ring, in vertex spacings. Every second ring is rotated by half a spacing, so that triangles
/// are equilateral.
double ring_rotation(std::size_t ring) { return ring % 2 == 0 ? 0.0 : 0.5; }

/// Joins two rings of any sizes with triangles. Each step advances on the ring that is behind.
void join_rings(std::size_t ring, std::uint32_t low, std::uint32_t low_size, std::uint32_t high,
                std::uint32_t high_size, std::vector<Triangle>& out) {
  std::uint32_t i = 0, j = 0;
  const std::uint32_t low_steps = low_size > 1 ? low_size : 0;
  const std::uint32_t high_steps = high_size > 1 ? high_size : 0;
  while (i < low_steps || j < high_steps) {
    const double next_low = (i + 1 + ring_rotation(ring)) / low_size;
    const double next_high = (j + 1 + ring_rotation(ring + 1)) / high_size;
    const std::uint32_t a = low + i % low_size, b = high + j % high_size;
    if (j == high_steps || (i < low_steps && next_low <= next_high)) {
      out.push_back({a, low + (i + 1) % low_size, b});
      ++i;
    } else {
      out.push_back({a, high + (j + 1) % high_size, b});
      ++j;
    }
  }
}

}  // namespace

Profile::Profile(const std::vector<ProfileControl>& controls) {
  constexpr int kPieces = 256;
  const auto count = static_cast<std::ptrdiff_t>(controls.size());
  // The ends of the profile lie on the axis, so the curve is continued by its mirror image.
  const auto control = [&](std::ptrdiff_t i) -> ProfileControl {
    if (i < 0) return {-controls[1].radius, controls[1].height};
    if (i >= count) {
      const ProfileControl& c = controls[static_cast<std::size_t>(count - 2)];
      return {-c.radius, c.height};
    }
    return controls[static_cast<std::size_t>(i)];
  };
  for (std::ptrdiff_t i = 0; i + 1 < count; ++i) {
    const ProfileControl p0 = control(i - 1), p1 = control(i), p2 = control(i + 1),
                         p3 = control(i + 2);
    const double t0 = 0, t1 = t0 + std::sqrt(distance(p0, p1));
    const double t2 = t1 + std::sqrt(distance(p1, p2)), t3 = t2 + std::sqrt(distance(p2, p3));
    for (int k = 0; k < kPieces; ++k) {
      const double t = t1 + (t2 - t1) * k / kPieces;
      const ProfileControl a1 = blend(p0, p1, t0, t1, t), a2 = blend(p1, p2, t1, t2, t);
      const ProfileControl a3 = blend(p2, p3, t2, t3, t);
      const ProfileControl b1 = blend(a1, a2, t0, t2, t), b2 = blend(a2, a3, t1, t3, t);
      ProfileControl c = blend(b1, b2, t1, t2, t);
      c.radius = std::max(c.radius, 0.0);
      points_.push_back(c);
    }
  }
  points_.push_back(controls.back());
  arc_.push_back(0);
  for (std::size_t i = 1; i < points_.size(); ++i) {
    arc_.push_back(arc_.back() + distance(points_[i - 1], points_[i]));
  }
  for (std::size_t i = 0; i < controls.size(); ++i) control_arc_.push_back(arc_[i * kPieces]);
}

Profile::Sample Profile::at(double arc) const {
  const auto above = std::upper_bound(arc_.begin() + 1, arc_.end() - 1, arc);
  const auto i = static_cast<std::size_t>(above - arc_.begin());
  const ProfileControl &a = points_[i - 1], &b = points_[i];
  const double length = std::max(arc_[i] - arc_[i - 1], 1e-12);
  const double s = std::clamp((arc - arc_[i - 1]) / length, 0.0, 1.0);
  // The normal is computed from points several steps apart, so that it varies smoothly.
  const ProfileControl& before = points_[i >= 9 ? i - 9 : 0];
  const ProfileControl& after = points_[std::min(i + 8, points_.size() - 1)];
  const double dr = after.radius - before.radius, dy = after.height - before.height;
  const double scale = 1 / std::max(std::hypot(dr, dy), 1e-12);
  return {a.radius + s * (b.radius - a.radius), a.height + s * (b.height - a.height), dy * scale,
          -dr * scale};
}

void sweep(const Profile& profile, std::uint64_t faces,
           const std::function<Point(const SurfacePoint&)>& displace, MeshPieceSink& sink) {
  // An equilateral triangle of edge e has the area e^2 sqrt(3) / 4. The number of triangles falls as the edge grows, so
  // bisect around this estimate.
  double area = 0;
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i) {
    area += 2 * std::numbers::pi * profile.at(profile.length() * (i + 0.5) / kSteps).radius *
            profile.length() / kSteps;
  }
  const double guess = std::sqrt(4 * area / (std::sqrt(3.0) * static_cast<double>(faces)));
  double shortest = guess / 2, longest = guess * 2;
  while (longest / shortest > 1 + 1e-6) {
    const double middle = std::sqrt(shortest * longest);
    (triangle_count(ring_sizes(profile, middle)) > faces ? shortest : longest) = middle;
  }
  const double edge = longest;
  const std::vector<std::uint32_t> sizes = ring_sizes(profile, edge);
  std::vector<std::uint32_t> first(sizes.size() + 1, 0);
  for (std::size_t i = 0; i < sizes.size(); ++i) first[i + 1] = first[i] + sizes[i];
  sink.begin(first.back(), triangle_count(sizes));

  std::vector<Vec3> positions;
  for (std::size_t begin = 0, end = 0; begin < sizes.size(); begin = end) {
    while (end < sizes.size() && (end == begin || first[end + 1] - first[begin] <= kPieceElements))
      ++end;
    positions.resize(first[end] - first[begin]);
    std::atomic<std::size_t> next{begin};
    const auto work = [&] {
      for (std::size_t ring = next++; ring < end; ring = next++) {
        const double arc =
            profile.length() * static_cast<double>(ring) / static_cast<double>(sizes.size() - 1);
        const Profile::Sample s = profile.at(arc);
        for (std::uint32_t k = 0; k < sizes[ring]; ++k) {
          const double angle = 2 * std::numbers::pi * (k + ring_rotation(ring)) / sizes[ring];
          const double c = std::cos(angle), d = -std::sin(angle);
          const Point moved = displace({{s.radius * c, s.height, s.radius * d},
                                        {s.normal_radius * c, s.normal_height, s.normal_radius * d},
                                        arc,
                                        angle,
                                        s.radius,
                                        edge});
          positions[first[ring] - first[begin] + k] = {static_cast<float>(moved.x),
                                                       static_cast<float>(moved.y),
                                                       static_cast<float>(moved.z)};
        }
      }
    };
    {
      std::vector<std::jthread> pool;
      for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) pool.emplace_back(work);
      work();
    }
    sink.add(std::span<const Vec3>(positions));
  }
  std::vector<Triangle> triangles;
  for (std::size_t ring = 0; ring + 1 < sizes.size(); ++ring) {
    join_rings(ring, first[ring], sizes[ring], first[ring + 1], sizes[ring + 1], triangles);
    if (triangles.size() < kPieceElements && ring + 2 < sizes.size()) continue;
    sink.add(std::span<const Triangle>(triangles));
    triangles.clear();
  }
}

Mesh sweep(const Profile& profile, std::uint64_t faces,
           const std::function<Point(const SurfacePoint&)>& displace) {
  struct MeshSink : MeshPieceSink {
    void begin(std::uint64_t vertices, std::uint64_t triangles) override {
      mesh.positions.reserve(vertices);
      mesh.triangles.reserve(triangles);
    }
    void add(std::span<const Vec3> positions) override {
      mesh.positions.insert(mesh.positions.end(), positions.begin(), positions.end());
    }
    void add(std::span<const Triangle> triangles) override {
      mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
    }
    Mesh mesh;
  } sink;
  sweep(profile, faces, displace, sink);
  return std::move(sink.mesh);
}

}  // namespace kiln::sample
