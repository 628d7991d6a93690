// Failures of hard surfaces: details on the face, hard edges, cards, parts that cross, mirrored halves.
#include <cmath>
#include <utility>

#include "shared/common.h"
#include "stability/scenes.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

constexpr double kStampHalf = 0.1;  // of its side, which is 1 in UV
constexpr double kStampHeight = 0.03;

/// A rectangle of n by n cells, its points moved.
template <typename Move>
Mesh sheet(std::uint32_t n, double width, double height, const Move& move) {
  Mesh mesh = plane(n, n, width, height);
  for (Vec3& p : mesh.positions) p = move(p);
  return mesh;
}

Mesh without_uvs(Mesh mesh) {
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

/// Triangles of b after those of a; UVs where both have them, groups by name.
Mesh both(Mesh a, const Mesh& b) {
  const auto append = [](std::vector<Triangle>& to, const std::vector<Triangle>& of,
                         std::size_t n) {
    const auto first = static_cast<std::uint32_t>(n);
    for (const Triangle& t : of) to.push_back({t[0] + first, t[1] + first, t[2] + first});
  };
  append(a.triangles, b.triangles, a.positions.size());
  append(a.uv_triangles, b.uv_triangles, a.uvs.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  a.uvs.insert(a.uvs.end(), b.uvs.begin(), b.uvs.end());
  a.normals.clear();
  a.normal_triangles.clear();
  return a;
}

void name_parts(Mesh& mesh, std::size_t first, const std::string& suffix) {
  mesh.group_names = {"X" + suffix, "Y" + suffix};
  mesh.groups.assign(mesh.triangles.size(), 1);
  std::fill_n(mesh.groups.begin(), first, 0U);
}

bool within_stamp(double u, double v, double middle) {
  return std::abs(u - middle) < kStampHalf && std::abs(v - 0.5) < kStampHalf;
}

/// Triangles below `base` are the face, those above stamps.
Verdict of_stamps(bool on_stamp, std::uint32_t triangle, std::size_t base) {
  if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
  return (triangle >= base) == on_stamp ? Verdict::right : Verdict::wrong;
}

FailureScene stamp_on_the_face() {
  const auto flat = [](Vec3 p) { return p; };
  const auto raised = [](Vec3 p) { return Vec3{p.x, p.y, static_cast<float>(kStampHeight)}; };
  FailureScene scene{"lost stamp",
                     "The high poly lies on the low poly, and a stamp floats above it; right: the "
                     "stamp where it is.",
                     without_uvs(sheet(7, 1, 1, flat)), plane(1, 1)};
  const std::size_t base = scene.high.triangles.size();
  scene.high = both(scene.high, without_uvs(sheet(4, 2 * kStampHalf, 2 * kStampHalf, raised)));
  scene.judge = [base](double u, double v, std::uint32_t triangle, double) {
    return of_stamps(within_stamp(u, v, 0.5), triangle, base);
  };
  return scene;
}

/// The plane bent down along the middle of x by 90 degrees, moved out by `height` along its halves' normals.
Vec3 bent(const Vec3& p, double height) {
  const double side = p.x < 0 ? -1 : 1, out = std::sqrt(0.5);
  return {static_cast<float>((p.x + side * height) * out), p.y,
          static_cast<float>((height - side * p.x) * out)};
}

FailureScene stamps_beside_a_hard_edge() {
  FailureScene scene{
      "skewed stamps",
      "Stamps float over both sides of a hard edge; right: where they are, seen along "
      "the faces' own normals.",
      without_uvs(sheet(8, 1, 1, [](Vec3 p) { return bent(p, 0); })),
      sheet(2, 1, 1, [](Vec3 p) { return bent(p, 0); })};
  const std::size_t base = scene.high.triangles.size();
  for (const double middle : {-0.25, 0.25}) {
    const auto place = [middle](Vec3 p) {
      return bent({p.x + static_cast<float>(middle), p.y, 0}, kStampHeight);
    };
    scene.high = both(scene.high, without_uvs(sheet(4, 2 * kStampHalf, 2 * kStampHalf, place)));
  }
  const auto out = static_cast<float>(std::sqrt(0.5));
  scene.low.normals = {{-out, 0, out}, {out, 0, out}};
  for (std::size_t t = 0; t < scene.low.triangles.size(); ++t) {
    double x = 0;
    for (const std::uint32_t v : scene.low.triangles[t]) x += double{scene.low.positions[v].x};
    const std::uint32_t side = x < 0 ? 0 : 1;
    scene.low.normal_triangles[t] = {side, side, side};
  }
  scene.judge = [base](double u, double v, std::uint32_t triangle, double) {
    return of_stamps(within_stamp(u, v, 0.25) || within_stamp(u, v, 0.75), triangle, base);
  };
  return scene;
}

FailureScene leaf_card() {
  const auto bow = [](Vec3 p) {
    return Vec3{p.x, p.y, static_cast<float>(0.3 * (1 - 4 * double{p.x} * p.x))};
  };
  FailureScene scene{
      "leaf card",
      "A leaf bends a fifth of its size away from its flat card, and nobody says how "
      "far to look; right: any match.",
      without_uvs(sheet(16, 1, 1, bow)), plane(1, 1)};
  scene.says_reach = false;
  scene.cage = scene.reach = Length::absolute(0.35);
  scene.judge = [](double, double, std::uint32_t triangle, double) {
    return triangle == KILN_NO_TRIANGLE ? Verdict::undecided : Verdict::right;
  };
  return scene;
}

FailureScene crossing_parts() {
  // Y leans through X; UVs of X lie in the left half, those of Y in the right one.
  const auto lie = [](double by) {
    return [by](Vec3 p) { return Vec3{p.x, p.y, static_cast<float>(by)}; };
  };
  const auto lean = [](double by) {
    return [by](Vec3 p) { return Vec3{p.x, p.y, static_cast<float>(by + 0.1 * double{p.x})}; };
  };
  FailureScene scene{
      "crossing parts",
      "Two plates cross at 6 degrees; right: each part of the low poly its own plate.",
      without_uvs(sheet(8, 1, 1, lie(0.01))), sheet(1, 1, 1, lie(0))};
  Mesh other = sheet(1, 1, 1, lean(0));
  for (Vec2& uv : scene.low.uvs) uv.x = 0.5F * uv.x;
  for (Vec2& uv : other.uvs) uv.x = 0.5F + 0.5F * uv.x;
  const std::size_t low_first = scene.low.triangles.size();
  scene.low = both(scene.low, other);
  const std::size_t first = scene.high.triangles.size();
  scene.high = both(scene.high, without_uvs(sheet(8, 1, 1, lean(0.01))));
  name_parts(scene.low, low_first, "_low");
  name_parts(scene.high, first, "_high");
  scene.judge = [first](double u, double, std::uint32_t triangle, double) {
    if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
    return (triangle < first) == (u < 0.5) ? Verdict::right : Verdict::wrong;
  };
  return scene;
}

FailureScene mirrored_halves() {
  const auto lift = [](Vec3 p) { return Vec3{p.x + 0.6F, p.y, 0.02F}; };
  FailureScene scene{"mirrored halves",
                     "Two halves share their UVs, one mirrored; right: the half that is not.",
                     without_uvs(sheet(8, 1, 1, lift)), sheet(1, 1, 1, [](Vec3 p) {
                       return Vec3{p.x + 0.6F, p.y, 0};
                     })};
  const std::size_t first = scene.high.triangles.size();
  Mesh low = scene.low, high = scene.high;
  for (Mesh* mesh : {&low, &high}) {
    for (Vec3& p : mesh->positions) p.x = -p.x;
    for (Triangle& t : mesh->triangles) std::swap(t[1], t[2]);
    for (Triangle& t : mesh->uv_triangles) std::swap(t[1], t[2]);
  }
  scene.low = both(low, scene.low);  // the mirrored one stands first
  scene.high = both(scene.high, high);
  scene.judge = [first](double, double, std::uint32_t triangle, double) {
    if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
    return triangle < first ? Verdict::right : Verdict::wrong;
  };
  return scene;
}

}  // namespace

std::vector<FailureScene> hard_failures() {
  return {stamp_on_the_face(), stamps_beside_a_hard_edge(), leaf_card(), crossing_parts(),
          mirrored_halves()};
}

}  // namespace kiln::test
