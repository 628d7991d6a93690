// Finds nearest points by Embree's point queries. Embree walks its tree and passes triangles to a callback, which
// computes the distance to a triangle by the regions of Ericson, "Real-Time Collision Detection", 5.1.5. For most
// triangles only one of the seven regions must be examined.
#include <cmath>

#include "embree_peer.h"
#include "embree_threads.h"
#include "shared/common.h"

namespace kiln::bench {
namespace {

struct Weights {
  float u, v;  // barycentric weights of the corners 1 and 2
};

Vec3 subtract(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
float dot_product(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Weights nearest_weights(const Vec3& ab, const Vec3& ac, const Vec3& ap) {
  // Dot products of the edges with the vectors from each corner to the point.
  const float ab_a = dot_product(ab, ap);
  const float ac_a = dot_product(ac, ap);
  if (ab_a <= 0 && ac_a <= 0) return {0, 0};
  const float bb = dot_product(ab, ab);
  const float bc = dot_product(ab, ac);
  const float cc = dot_product(ac, ac);
  const float ab_b = ab_a - bb;
  const float ac_b = ac_a - bc;
  if (ab_b >= 0 && ac_b <= ab_b) return {1, 0};
  const float weight_c = ab_a * ac_b - ab_b * ac_a;
  if (weight_c <= 0 && ab_a >= 0 && ab_b <= 0) return {ab_a / bb, 0};
  const float ab_c = ab_a - bc;
  const float ac_c = ac_a - cc;
  if (ac_c >= 0 && ab_c <= ac_c) return {0, 1};
  const float weight_b = ab_c * ac_a - ab_a * ac_c;
  if (weight_b <= 0 && ac_a >= 0 && ac_c <= 0) return {0, ac_a / cc};
  const float weight_a = ab_b * ac_c - ab_c * ac_b;
  const float to_c = ac_b - ab_b;
  const float to_b = ab_c - ac_c;
  if (weight_a <= 0 && to_c >= 0 && to_b >= 0) {
    const float s = to_c / (to_c + to_b);
    return {1 - s, s};
  }
  const float sum = 1 / (weight_a + weight_b + weight_c);
  return {weight_b * sum, weight_c * sum};
}

struct Search {
  const std::array<Vec3, 3>* corners;
  Vec3 point, direction;
  bool two_sided;
  unsigned triangle;
  Weights weights;
};

bool visit(RTCPointQueryFunctionArguments* call) {
  Search& search = *static_cast<Search*>(call->userPtr);
  const std::array<Vec3, 3>& corner = search.corners[call->primID];
  const Vec3 ab = subtract(corner[1], corner[0]);
  const Vec3 ac = subtract(corner[2], corner[0]);
  const Vec3 ap = subtract(search.point, corner[0]);
  if (!search.two_sided) {
    const Vec3 normal{ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z,
                      ab.x * ac.y - ab.y * ac.x};
    if (dot_product(normal, search.direction) < 0) return false;
  }
  const Weights w = nearest_weights(ab, ac, ap);
  const Vec3 r{ap.x - w.u * ab.x - w.v * ac.x, ap.y - w.u * ab.y - w.v * ac.y,
               ap.z - w.u * ab.z - w.v * ac.z};
  const float squared = dot_product(r, r);
  if (squared > call->query->radius * call->query->radius) return false;
  call->query->radius = std::sqrt(squared);
  search.triangle = call->primID;
  search.weights = w;
  return true;
}

}  // namespace

void EmbreeScene::closest(const RayPlanes& rays, bool two_sided, bool seeded,
                          RayResults& results) const {
  results.triangle.resize(rays.count);
  results.t.resize(rays.count);
  results.u.resize(rays.count);
  results.v.resize(rays.count);
  const auto plane = [&](std::size_t i, std::size_t k) {
    return rays.planes[k * rays.capacity + i];
  };
  on_threads(rays.count, [&](std::size_t begin, std::size_t end) {
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    RTCPointQuery query;
    query.time = 0;
    query.radius = rays.t_max;
    bool found = false;
    Vec3 last;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 point{plane(i, 0), plane(i, 1), plane(i, 2)};
      Search search{corners_.data(), point, {plane(i, 3), plane(i, 4), plane(i, 5)},
                    two_sided,       ~0U,   {0, 0}};
      const Vec3 step = subtract(point, last);
      // If back faces are skipped, the previous result may be invalid for this sample.
      const bool use_previous = seeded && found && two_sided;
      const float bound =
          use_previous ? (query.radius + std::sqrt(dot_product(step, step))) * 1.00001F + 1e-7F
                       : rays.t_max;
      query.x = point.x;
      query.y = point.y;
      query.z = point.z;
      query.radius = std::min(bound, rays.t_max);
      rtcPointQuery(scene_, &query, &context, visit, &search);
      found = search.triangle != ~0U;
      last = point;
      results.triangle[i] = found ? search.triangle : KILN_NO_TRIANGLE;
      results.t[i] = query.radius;
      results.u[i] = search.weights.u;
      results.v[i] = search.weights.v;
    }
  });
}

}  // namespace kiln::bench
