// Normals that oppose their faces, and parts that face inwards.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "kiln/normals.h"
#include "support/shapes.h"

namespace kiln {
namespace {

void turn(Mesh& mesh, std::size_t t) {
  for (std::vector<Triangle>* corners :
       {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
    if (!corners->empty()) std::swap((*corners)[t][1], (*corners)[t][2]);
  }
}

void turn_faces(Mesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) turn(mesh, t);
}

Vec3 times(const Vec3& v, const Vec3& signs) {
  return {v.x * signs.x, v.y * signs.y, v.z * signs.z};
}

void mirror_positions(Mesh& mesh, const Vec3& signs) {
  for (Vec3& p : mesh.positions) p = times(p, signs);
}

void mirror_normals(Mesh& mesh, const Vec3& signs) {
  for (Vec3& n : mesh.normals) n = times(n, signs);
}

Vec3 corner(const Mesh& mesh, std::size_t t, std::size_t k) {
  return mesh.positions[mesh.triangles[t][k]];
}

Vec3 face_normal(const Mesh& mesh, std::size_t t) {
  const Vec3 a = corner(mesh, t, 0), b = corner(mesh, t, 1), c = corner(mesh, t, 2);
  const double u[3] = {b.x - a.x, b.y - a.y, b.z - a.z}, v[3] = {c.x - a.x, c.y - a.y, c.z - a.z};
  const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                       u[0] * v[1] - u[1] * v[0]};
  const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  return {static_cast<float>(n[0] / size), static_cast<float>(n[1] / size),
          static_cast<float>(n[2] / size)};
}

double dot_of(const Vec3& a, const Vec3& b) {
  return double{a.x} * b.x + double{a.y} * b.y + double{a.z} * b.z;
}

/// An ellipsoid with smooth normals, three different axes: no mirror image but by a plane of its axes is itself.
Mesh bean() {
  Mesh mesh = test::icosphere(3);
  for (Vec3& p : mesh.positions) p = {p.x * 1.5F + 0.2F * p.y * p.y + 0.1F * p.z, p.y, p.z * 0.7F};
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  const Mesh flat = mesh;
  std::vector<std::array<double, 3>> sums(mesh.positions.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 n = face_normal(flat, t);
    for (const std::uint32_t v : mesh.triangles[t]) {
      sums[v][0] += n.x;
      sums[v][1] += n.y;
      sums[v][2] += n.z;
    }
  }
  for (const auto& s : sums) {
    const double size = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    mesh.normals.push_back({static_cast<float>(s[0] / size), static_cast<float>(s[1] / size),
                            static_cast<float>(s[2] / size)});
  }
  mesh.normal_triangles = mesh.triangles;
  return mesh;
}

/// A box with six flat faces, each with its own normal: 12 triangles.
Mesh box() {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.positions.push_back({i & 1 ? 1.0F : -1.0F, i & 2 ? 1.5F : -1.5F, i & 4 ? 2.0F : -2.0F});
  }
  const std::array<std::array<std::uint32_t, 4>, 6> faces = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (std::uint32_t f = 0; f < 6; ++f) {
    mesh.triangles.push_back({faces[f][0], faces[f][1], faces[f][2]});
    mesh.triangles.push_back({faces[f][0], faces[f][2], faces[f][3]});
    mesh.normals.push_back(face_normal(mesh, 2 * std::size_t{f}));
    mesh.normal_triangles.insert(mesh.normal_triangles.end(), 2, {f, f, f});
  }
  return mesh;
}

/// A wavy sheet over the XY plane, with its normals up.
Mesh sheet() {
  Mesh mesh = test::plane(24, 20);
  mesh.normals.clear();
  for (Vec3& p : mesh.positions) {
    const double height = 0.1 * std::sin(9 * double{p.x}) + 0.08 * std::cos(7 * double{p.y});
    const double dx = 0.9 * std::cos(9 * double{p.x}), dy = -0.56 * std::sin(7 * double{p.y});
    const double size = std::sqrt(dx * dx + dy * dy + 1);
    p.z = static_cast<float>(height);
    mesh.normals.push_back({static_cast<float>(-dx / size), static_cast<float>(-dy / size),
                            static_cast<float>(1 / size)});
  }
  mesh.normal_triangles = mesh.triangles;
  return mesh;
}

/// Every corner's normal looks to the front of its face; of a closed shape about the origin, that is outwards.
void expect_right(const Mesh& mesh, bool outwards) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 face = face_normal(mesh, t);
    if (outwards) EXPECT_GT(dot_of(face, corner(mesh, t, 0)), 0) << t;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GT(dot_of(face, mesh.normals[mesh.normal_triangles[t][k]]), 0.5) << t;
    }
  }
}

TEST(NormalSides, OrdinaryMeshesStayToTheBit) {
  Mesh room = bean();  // agrees, and faces inwards
  turn_faces(room);
  mirror_normals(room, {-1, -1, -1});
  for (const Mesh& right : {bean(), box(), sheet(), room, test::torus(40, 20), test::plane(3, 3)}) {
    Mesh mesh = right;
    const AgreedNormals found = agree_normals(mesh, Trusted::faces);
    EXPECT_EQ(found.normals + found.faces + found.unexplained, 0U);
    EXPECT_EQ(mesh.triangles, right.triangles);
    EXPECT_EQ(mesh.normal_triangles, right.normal_triangles);
    EXPECT_EQ(mesh.normals, right.normals);
  }
}

TEST(NormalSides, ClosedPartsFaceOutwardsWhateverWasTurned) {
  const std::array<Vec3, 4> mirrors = {{{-1, 1, 1}, {1, -1, 1}, {1, 1, -1}, {-1, -1, -1}}};
  for (const Mesh& right : {bean(), box()}) {
    const std::uint64_t all = right.triangles.size();
    Mesh normals = right;  // normals alone
    mirror_normals(normals, {-1, -1, -1});
    AgreedNormals found = agree_normals(normals, Trusted::normals);
    EXPECT_EQ(found.normals, all);
    EXPECT_EQ(found.faces + found.unclear + found.mirrored, 0U);
    expect_right(normals, true);
    EXPECT_EQ(normals.triangles, right.triangles);
    Mesh faces = right;  // windings alone
    turn_faces(faces);
    found = agree_normals(faces, Trusted::faces);
    EXPECT_EQ(found.faces, all);
    EXPECT_EQ(found.normals + found.unclear, 0U);
    EXPECT_EQ(faces.triangles, right.triangles);
    EXPECT_EQ(faces.normals, right.normals);
    for (const Vec3& signs : mirrors) {
      // A mirror image, of which normals, windings, or neither were made to fit.
      for (const bool with_normals : {false, true}) {
        for (const bool with_faces : {false, true}) {
          Mesh mesh = right;
          mirror_positions(mesh, signs);
          if (with_normals) mirror_normals(mesh, signs);
          if (with_faces) turn_faces(mesh);
          if (signs.x + signs.y + signs.z == -3 && !with_normals && !with_faces) {
            // All looks inwards, as a room does: another function's concern.
            EXPECT_EQ(inward_parts(mesh).count, 1U);
            continue;
          }
          found = agree_normals(mesh, Trusted::faces);
          EXPECT_EQ(found.normals + found.faces, with_normals && with_faces ? 0U : all)
              << signs.x << signs.y << signs.z << with_normals << with_faces;
          expect_right(mesh, true);
        }
      }
    }
  }
}

TEST(NormalSides, APartOfAMeshIsTurnedAlone) {
  Mesh right = box(), wrong = box(), inner = box(), outer = box();
  for (Vec3& p : wrong.positions) p.x += 10;
  turn_faces(wrong);
  // A shell of two walls whose faces were turned: the inner wall looks inwards rightly.
  for (Vec3& p : outer.positions) p = {p.x + 20, p.y, p.z};
  for (Vec3& p : inner.positions) p = {p.x * 0.5F + 20, p.y * 0.5F, p.z * 0.5F};
  turn_faces(outer);
  mirror_normals(inner, {-1, -1, -1});
  const Mesh wanted_inner = [&] {
    Mesh mesh = inner;
    turn_faces(mesh);
    return mesh;
  }();
  const std::array<Mesh, 4> all = {right, wrong, outer, inner};
  Mesh mesh = join_meshes(all);
  const AgreedNormals found = agree_normals(mesh, Trusted::faces);
  EXPECT_EQ(found.faces, 36U);
  EXPECT_EQ(found.normals, 0U);
  EXPECT_EQ(found.first, 12U);
  Mesh turned = wrong, turned_outer = outer;
  turn_faces(turned);
  turn_faces(turned_outer);
  const std::array<Mesh, 4> wanted = {right, turned, turned_outer, wanted_inner};
  EXPECT_EQ(mesh.triangles, join_meshes(wanted).triangles);
}

TEST(NormalSides, OfOpenSheetsNeighboursTellThenWhatIsTrusted) {
  for (const Trusted trust : {Trusted::faces, Trusted::normals}) {
    Mesh mesh = sheet();
    turn_faces(mesh);
    const AgreedNormals found = agree_normals(mesh, trust);
    EXPECT_EQ(trust == Trusted::faces ? found.normals : found.faces, mesh.triangles.size());
    EXPECT_EQ(found.unclear, mesh.triangles.size());
    expect_right(mesh, false);
    EXPECT_EQ(face_normal(mesh, 0).z > 0, trust == Trusted::normals);
  }
  // Half of it turned round, the other half sound: the seam tells.
  Mesh half = sheet();
  const std::vector<Triangle> before = half.triangles;
  for (std::size_t t = 0; t < half.triangles.size() / 2; ++t) turn(half, t);
  const AgreedNormals found = agree_normals(half, Trusted::faces);
  EXPECT_EQ(found.faces, half.triangles.size() / 2);
  EXPECT_EQ(found.normals + found.unclear, 0U);
  EXPECT_EQ(half.triangles, before);
  // Slopes of a mirror image, whose normals all look up still.
  Mesh slopes = sheet();
  mirror_positions(slopes, {-1, 1, 1});
  turn_faces(slopes);
  const AgreedNormals mirrored = agree_normals(slopes, Trusted::faces);
  EXPECT_EQ(mirrored.mirrored, slopes.triangles.size());
  for (std::size_t t = 0; t < slopes.triangles.size(); ++t) {
    EXPECT_GT(dot_of(face_normal(slopes, t), slopes.normals[slopes.normal_triangles[t][0]]), 0.9);
  }
}

TEST(NormalSides, NormalsOfARounderShapeStay) {
  // Cards in all directions, with the normals of a ball: half of them oppose their faces on purpose.
  Mesh tree;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const double a = 2.4 * i, z = 1 - (2 * i + 1) / 200.0, r = std::sqrt(1 - z * z);
    const Vec3 n{static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)),
                 static_cast<float>(z)};
    const double b = 1.7 * i, w = std::sin(3.1 * i), s = std::sqrt(1 - w * w);
    const Vec3 u{static_cast<float>(s * std::cos(b)), static_cast<float>(s * std::sin(b)),
                 static_cast<float>(w)};
    const Vec3 v{static_cast<float>(-std::sin(b)), static_cast<float>(std::cos(b)), 0};
    const auto first = static_cast<std::uint32_t>(tree.positions.size());
    for (const auto& [p, q] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
      tree.positions.push_back({5 * n.x + 0.1F * (p * u.x + q * v.x),
                                5 * n.y + 0.1F * (p * u.y + q * v.y),
                                5 * n.z + 0.1F * (p * u.z + q * v.z)});
    }
    tree.normals.push_back(n);
    for (const Triangle t : {Triangle{0, 1, 2}, {0, 2, 3}}) {
      tree.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      tree.normal_triangles.push_back({i, i, i});
    }
  }
  const Mesh before = tree;
  const AgreedNormals found = agree_normals(tree, Trusted::faces);
  EXPECT_EQ(found.normals + found.faces, 0U);
  EXPECT_EQ(tree.normals, before.normals);
}

TEST(NormalSides, FindsPartsThatFaceInwards) {
  EXPECT_EQ(inward_parts(bean()).count, 0U);
  EXPECT_EQ(inward_parts(sheet()).count, 0U);
  Mesh turned = bean();
  turn_faces(turned);
  EXPECT_EQ(inward_parts(turned).count, 1U);
  EXPECT_EQ(inward_parts(turned).parts, 1U);
  // Without a lid it still has an inside.
  std::erase_if(turned.triangles,
                [&](const Triangle& t) { return turned.positions[t[0]].z > 0.6F; });
  turned.normal_triangles = turned.triangles;
  EXPECT_EQ(inward_parts(turned).count, 1U);
  // The inner wall of a shell faces inwards rightly.
  Mesh inner = box();
  mirror_positions(inner, {-0.5F, 0.5F, 0.5F});
  const std::array<Mesh, 2> shell = {box(), inner};
  EXPECT_EQ(inward_parts(join_meshes(shell)).count, 0U);
}

/// Corners of its own for each triangle, with these signs of its normals, and tangents that tell corners apart.
Mesh split_normals(const Mesh& mesh, const std::vector<float>& signs) {
  Mesh split = mesh;
  split.normals.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 n = mesh.normals[mesh.normal_triangles[t][k]];
      split.normal_triangles[t][k] = static_cast<std::uint32_t>(split.normals.size());
      split.normals.push_back(times(n, {signs[t], signs[t], signs[t]}));
      split.tangents.push_back({{static_cast<float>(t), static_cast<float>(k), 1}, 1});
    }
  }
  return split;
}

/// The bitangent, sign * cross(normal, tangent), must stay where a normal turns, and corners keep their tangents.
TEST(NormalSides, TangentsGoWithTheirCorners) {
  const Mesh right = bean();
  const std::vector<float> front(right.triangles.size(), 1), back(right.triangles.size(), -1);
  Mesh negated = split_normals(right, back);
  const AgreedNormals turned = agree_normals(negated, Trusted::faces);
  EXPECT_EQ(turned.normals, right.triangles.size());
  EXPECT_EQ(turned.faces, 0U);
  EXPECT_EQ(turned.mirrored, 0U);
  for (std::size_t i = 0; i < negated.tangents.size(); ++i) {
    EXPECT_EQ(negated.tangents[i].sign, -1);
    EXPECT_EQ(negated.tangents[i].direction,
              (Vec3{static_cast<float>(i / 3), static_cast<float>(i % 3), 1}));
  }
  expect_right(negated, true);
  Mesh inverted = split_normals(right, front);
  turn_faces(
      inverted);  // its tangents stay where they were: as of a file that has its faces turned
  const Mesh before = inverted;
  const AgreedNormals faces = agree_normals(inverted, Trusted::normals);
  EXPECT_EQ(faces.faces, right.triangles.size());
  EXPECT_EQ(faces.normals, 0U);
  for (std::size_t t = 0; t < right.triangles.size(); ++t) {
    for (const auto& [k, from] : {std::pair{0, 0}, {1, 2}, {2, 1}}) {
      EXPECT_EQ(inverted.tangents[3 * t + k].direction, before.tangents[3 * t + from].direction);
      EXPECT_EQ(inverted.tangents[3 * t + k].sign, 1);
      EXPECT_EQ(inverted.triangles[t][k], before.triangles[t][from]);
    }
  }
  // A mirror image's tangents are those of another surface.
  Mesh mirrored = split_normals(right, front);
  mirrored.name = "left hand.obj";
  mirror_normals(mirrored, {1, -1, 1});
  try {
    (void)agree_normals(mirrored, Trusted::faces);
    ADD_FAILURE() << "a mirror image with tangents";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_STREQ(error.what(),
                 "Mesh 'left hand.obj' has the normals of its mirror image, so its tangents cannot "
                 "be trusted either: export it again, or leave its tangents out.");
  }
  mirrored.tangents.clear();
  EXPECT_EQ(agree_normals(mirrored, Trusted::faces).mirrored, right.triangles.size());
}

/// Normals that oppose three triangles of four are no turned part: nothing is changed, and the part is counted.
TEST(NormalSides, PartsThatNothingExplainsAreCounted) {
  const Mesh right = bean();
  std::vector<float> signs(right.triangles.size());
  for (std::size_t t = 0; t < signs.size(); ++t) signs[t] = t % 4 == 1 ? 1 : -1;
  Mesh foreign = split_normals(right, signs);
  foreign.tangents.clear();
  // Before it a part that is right: it is not counted, nor the first.
  Mesh whole = box();
  for (Vec3& p : whole.positions) p.x += 9;
  const auto vertices = static_cast<std::uint32_t>(whole.positions.size());
  const auto normals = static_cast<std::uint32_t>(whole.normals.size());
  for (std::size_t t = 0; t < foreign.triangles.size(); ++t) {
    Triangle corners = foreign.triangles[t], own = foreign.normal_triangles[t];
    for (std::size_t k = 0; k < 3; ++k) corners[k] += vertices, own[k] += normals;
    whole.triangles.push_back(corners);
    whole.normal_triangles.push_back(own);
  }
  whole.positions.insert(whole.positions.end(), foreign.positions.begin(), foreign.positions.end());
  whole.normals.insert(whole.normals.end(), foreign.normals.begin(), foreign.normals.end());
  const Mesh before = whole;
  const AgreedNormals result = agree_normals(whole, Trusted::faces);
  EXPECT_EQ(result.unexplained, right.triangles.size());
  EXPECT_EQ(result.first, 12U);
  EXPECT_EQ(result.normals + result.faces + result.mirrored + result.unclear, 0U);
  EXPECT_EQ(whole.normal_triangles, before.normal_triangles);
  EXPECT_EQ(whole.triangles, before.triangles);
}

}  // namespace
}  // namespace kiln
