#include "reference/assess.h"

#include <algorithm>
#include <cmath>

#include "reference/ray.h"

namespace kiln::reference {
namespace {

constexpr double kEdge = 1e-5;  // barycentrics this near to 0 may go either way in single precision

Place place_of(const Vec3& v) { return {v.x, v.y, v.z}; }
Place minus(const Place& a, const Place& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Place along(const Place& a, const Place& d, double t) {
  return {a[0] + d[0] * t, a[1] + d[1] * t, a[2] + d[2] * t};
}
double inner(const Place& a, const Place& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double size_of(const Place& a) { return std::sqrt(inner(a, a)); }
Place outer(const Place& a, const Place& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Place face_normal(const Mesh& mesh, std::uint32_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  const Place a = place_of(mesh.positions[t[0]]);
  return outer(minus(place_of(mesh.positions[t[1]]), a), minus(place_of(mesh.positions[t[2]]), a));
}
Place blend(const Mesh& mesh, std::uint32_t triangle, double u, double v) {
  const Triangle& t = mesh.triangles[triangle];
  const Place a = place_of(mesh.positions[t[0]]);
  return along(along(a, minus(place_of(mesh.positions[t[1]]), a), u),
               minus(place_of(mesh.positions[t[2]]), a), v);
}

}  // namespace

std::vector<AssessTexel> assess_texels(const Mesh& high, const Mesh& low, const Match& match) {
  const double width = match.width, height = match.height;
  std::vector<AssessTexel> texels;
  std::vector<std::uint8_t> taken(match.triangle.size(), 0);
  for (std::uint32_t t = 0; t < low.triangles.size(); ++t) {
    std::array<std::array<double, 2>, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2& uv = low.uvs[low.uv_triangles[t][k]];
      at[k] = {uv.x * width - 0.5, (1 - double{uv.y}) * height - 0.5};
    }
    const double ux = at[1][0] - at[0][0], uy = at[1][1] - at[0][1];
    const double vx = at[2][0] - at[0][0], vy = at[2][1] - at[0][1];
    const double size = ux * vy - uy * vx;
    if (size == 0) continue;
    const auto least = [&](int i) { return std::min({at[0][i], at[1][i], at[2][i]}); };
    const auto most = [&](int i) { return std::max({at[0][i], at[1][i], at[2][i]}); };
    const Place n = face_normal(low, t);
    for (double y = std::max(0.0, std::ceil(least(1))); y <= std::min(height - 1, most(1)); ++y) {
      for (double x = std::max(0.0, std::ceil(least(0))); x <= std::min(width - 1, most(0)); ++x) {
        const double px = x - at[0][0], py = y - at[0][1];
        const double u = (px * vy - py * vx) / size, v = (ux * py - uy * px) / size;
        if (u < 0 || v < 0 || u + v > 1) continue;
        AssessTexel texel;
        texel.element = static_cast<std::size_t>(y) * match.width + static_cast<std::size_t>(x);
        if (taken[texel.element]++ != 0) continue;
        texel.triangle = t;
        texel.position = blend(low, t, u, v);
        texel.normal = {n[0] / size_of(n), n[1] / size_of(n), n[2] / size_of(n)};
        texel.area = size_of(n) / std::abs(size);
        texel.found = match.triangle[texel.element] != 0xFFFFFFFFU;
        if (texel.found) {
          texel.match = blend(high, match.triangle[texel.element], match.u[texel.element],
                              match.v[texel.element]);
        }
        texels.push_back(texel);
      }
    }
  }
  std::sort(texels.begin(), texels.end(),
            [](const auto& a, const auto& b) { return a.element < b.element; });
  return texels;
}

RaySums view_texel(const Mesh& high, const Mesh& low, const AssessTexel& texel,
                   std::span<const Vec3> directions) {
  RaySums sums;
  double radius = 0;
  for (const Mesh* mesh : {&high, &low}) {
    for (const Vec3& p : mesh->positions) radius = std::max(radius, size_of(place_of(p)));
  }
  const Place offset = minus(texel.match, texel.position);
  for (const Vec3& direction : directions) {
    const Place d = place_of(direction);
    const double cosine = inner(texel.normal, d);
    if (!(cosine > 0)) continue;
    RaySearch search{.t_min = 1e-5 * radius, .t_max = 4 * radius};
    const bool hidden = cast_ray(low.positions, low.triangles, texel.position, d, search).found;
    search.slack = kEdge;
    const bool wide = cast_ray(low.positions, low.triangles, texel.position, d, search).found;
    search.slack = -kEdge;
    const bool slim = cast_ray(low.positions, low.triangles, texel.position, d, search).found;
    sums.near_edge = sums.near_edge || wide != slim;
    if (hidden) continue;
    const Place across = along(offset, d, -inner(offset, d));
    sums.seen += cosine;
    sums.across += cosine * size_of(across);
    sums.across_square += cosine * inner(across, across);
    // From the viewer.
    const Place back = {-d[0], -d[1], -d[2]};
    const Place viewer = along(texel.position, d, 4 * radius);
    const RaySearch whole{.t_min = 0, .t_max = 8 * radius};
    const RayHit hit = cast_ray(high.positions, high.triangles, viewer, back, whole);
    if (!hit.found || !(inner(face_normal(high, hit.triangle), d) > 0)) continue;
    const double apart = size_of(minus(texel.match, along(viewer, back, hit.t)));
    sums.met += cosine;
    sums.apart += cosine * apart;
    sums.apart_square += cosine * apart * apart;
  }
  return sums;
}

double uniformity_percent(const std::vector<AssessTexel>& texels, const Match& match,
                          std::span<const std::uint32_t> chart, std::uint64_t& pairs) {
  std::vector<const AssessTexel*> at(match.triangle.size(), nullptr);
  for (const AssessTexel& texel : texels) at[texel.element] = &texel;
  double sum = 0;
  pairs = 0;
  const auto add = [&](const AssessTexel& a, std::size_t element) {
    const AssessTexel* b = at[element];
    if (b == nullptr || !a.found || !b->found || chart[a.triangle] != chart[b->triangle]) return;
    const double own = size_of(minus(a.position, b->position));
    sum += 100 * std::abs(size_of(minus(a.match, b->match)) - own) / own;
    ++pairs;
  };
  for (const AssessTexel& texel : texels) {
    if ((texel.element + 1) % match.width != 0) add(texel, texel.element + 1);
    if (texel.element + match.width < at.size()) add(texel, texel.element + match.width);
  }
  return sum / static_cast<double>(pairs);
}

}  // namespace kiln::reference
