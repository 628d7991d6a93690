// Mirrored and repeated UVs: which triangles share texels, and which of them is baked.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "kiln/bake.h"
#include "mesh/low_surface.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = LowSurface::kNoCopy;

/// A strip of quads along x, one a unit; each takes the UVs of one square: as it is, mirrored in u, or moved.
struct Quad {
  bool mirrored = false;
  float u = 0, v = 0;  ///< Moved by
};

Mesh strip(const std::vector<Quad>& quads) {
  Mesh mesh;
  mesh.name = "strip";
  for (std::size_t i = 0; i < quads.size(); ++i) {
    const auto first = static_cast<std::uint32_t>(4 * i);
    for (const Vec2 corner : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
      mesh.positions.push_back({static_cast<float>(i) + corner.x, corner.y, 0});
      const float u = quads[i].mirrored ? 1 - corner.x : corner.x;
      mesh.uvs.push_back({0.1F + 0.8F * u + quads[i].u, 0.1F + 0.8F * corner.y + quads[i].v});
    }
    // Mirrored halves have mirrored diagonals, too.
    const Triangle a = quads[i].mirrored ? Triangle{first, first + 1, first + 3}
                                         : Triangle{first, first + 1, first + 2};
    const Triangle b = quads[i].mirrored ? Triangle{first + 1, first + 2, first + 3}
                                         : Triangle{first, first + 2, first + 3};
    mesh.triangles.insert(mesh.triangles.end(), {a, b});
  }
  mesh.uv_triangles = mesh.triangles;
  mesh.normals = {{0, 0, 1}};
  mesh.normal_triangles.assign(mesh.triangles.size(), {0, 0, 0});
  return mesh;
}

std::vector<std::uint32_t> copies(const Mesh& mesh, UvCopies rule) {
  return LowSurface::of(mesh, Frame::of(mesh), nullptr, rule).copy_of;
}

TEST(UvCopies, AreFoundMirroredAndWholeNumbersApart) {
  const Mesh mesh = strip({{true}, {false, 1, -2}, {false, 0.01F, 0}});
  EXPECT_EQ(copies(mesh, UvCopies::plain),
            (std::vector<std::uint32_t>{2, 3, kNone, kNone, kNone, kNone}));
  EXPECT_EQ(copies(mesh, UvCopies::mirrored),
            (std::vector<std::uint32_t>{kNone, kNone, 0, 1, kNone, kNone}));
  EXPECT_EQ(copies(mesh, UvCopies::first),
            (std::vector<std::uint32_t>{kNone, kNone, 0, 1, kNone, kNone}));
}

TEST(UvCopies, InTheUnitSquareComeFirst) {
  EXPECT_EQ(copies(strip({{false, 1, 0}, {}, {}}), UvCopies::first),
            (std::vector<std::uint32_t>{2, 3, kNone, kNone, 2, 3}));
  EXPECT_TRUE(copies(strip({{}, {false, 0.5F, 0}}), UvCopies::plain).empty());
}

/// A chart in the unit square is baked rather than one in any other, wherever that lies and whichever comes first.
TEST(UvCopies, InTheUnitSquareComeFirstWhereverTheOthersLie) {
  for (const Vec2& by : {Vec2{1, 0}, Vec2{0, 1}, Vec2{-1, 0}, Vec2{0, -2}, Vec2{2, 3}}) {
    SCOPED_TRACE(std::to_string(by.x) + ", " + std::to_string(by.y));
    for (const UvCopies rule : {UvCopies::first, UvCopies::plain}) {
      EXPECT_EQ(copies(strip({{false, by.x, by.y}, {}}), rule),
                (std::vector<std::uint32_t>{2, 3, kNone, kNone}));
      EXPECT_EQ(copies(strip({{}, {false, by.x, by.y}}), rule),
                (std::vector<std::uint32_t>{kNone, kNone, 0, 1}));
    }
  }
}

/// A polygon of `corners` corners on a circle of `radius` around (u, v), cut into a fan from the corner `from`; the
/// mirrored one goes round the other way. On the surface it lies beside the ones before.
void add_polygon(Mesh& mesh, std::uint32_t corners, std::uint32_t from, bool mirrored, Vec2 at,
                 float radius) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const float beside = static_cast<float>(mesh.triangles.size());
  for (std::uint32_t k = 0; k < corners; ++k) {
    // Not even, so that a turned one is another one.
    const float angle = 6.2831853F *
                        (static_cast<float>(k) + 0.3F * std::sin(2.0F * static_cast<float>(k))) /
                        static_cast<float>(corners);
    const float x = std::cos(angle), y = std::sin(angle);
    mesh.uvs.push_back({at.x + radius * x, at.y + radius * y});
    mesh.positions.push_back({beside + (mirrored ? -x : x), y, 0});
  }
  for (std::uint32_t k = 1; k + 1 < corners; ++k) {
    const std::uint32_t a = first + from, b = first + (from + k) % corners,
                        c = first + (from + k + 1) % corners;
    mesh.triangles.push_back(mirrored ? Triangle{a, c, b} : Triangle{a, b, c});
  }
}

Mesh finished(Mesh mesh) {
  mesh.name = "polygons";
  mesh.uv_triangles = mesh.triangles;
  mesh.normals = {{0, 0, 1}};
  mesh.normal_triangles.assign(mesh.triangles.size(), {0, 0, 0});
  return mesh;
}

std::size_t shared_ones(const std::vector<std::uint32_t>& copy_of, std::size_t first) {
  std::size_t count = 0;
  for (std::size_t t = 0; t < copy_of.size(); ++t) {
    const bool copy = copy_of[t] != kNone;
    EXPECT_TRUE(!copy || (t >= first && copy_of[t] < first)) << t << " is a copy of " << copy_of[t];
    count += copy ? 1 : 0;
  }
  return count;
}

TEST(UvCopies, AreFoundWhereTheirPolygonsAreCutElsewhere) {
  for (std::uint32_t corners = 4; corners <= 32; corners += corners < 8 ? 1 : 6) {
    for (std::uint32_t from = 0; from < corners; ++from) {
      for (const float radius : {0.4F, 0.02F, 0.0005F}) {
        Mesh mesh;
        add_polygon(mesh, corners, 0, false, {0.5F, 0.5F}, radius);
        add_polygon(mesh, corners, from, true, {3.5F, -0.5F}, radius);
        const std::size_t each = corners - 2;
        EXPECT_EQ(shared_ones(copies(finished(mesh), UvCopies::first), each), each)
            << corners << " corners from " << from << ", radius " << radius;
      }
    }
  }
}

/// Another corner more, a corner moved, half a polygon: these overlap, and nothing is shared.
TEST(UvCopies, AreNotTakenWhereOutlinesDiffer) {
  const auto none = [](const Mesh& mesh) {
    return copies(finished(mesh), UvCopies::first).empty();
  };
  Mesh more, moved, turned;
  add_polygon(more, 6, 0, false, {0.5F, 0.5F}, 0.4F);
  add_polygon(more, 7, 1, true, {0.5F, 0.5F}, 0.4F);
  EXPECT_TRUE(none(more));
  add_polygon(moved, 4, 0, false, {0.5F, 0.5F}, 0.4F);
  add_polygon(moved, 4, 1, true, {0.5F, 0.5F}, 0.4F);
  moved.uvs[6].x += 0.01F;  // the third corner of the second one
  const std::vector<std::uint32_t> kept = copies(finished(moved), UvCopies::first);
  EXPECT_LE(kept.empty() ? 0U : shared_ones(kept, 2), 1U);
  add_polygon(turned, 5, 0, false, {0.5F, 0.5F}, 0.4F);
  add_polygon(turned, 5, 2, false, {0.51F, 0.5F}, 0.4F);
  EXPECT_TRUE(none(turned));
}

/// Half a quad does not stand for a whole one; where anything is shared, the whole one stands for the half.
TEST(UvCopies, AreCoveredWholly) {
  for (const bool mirrored : {false, true}) {
    Mesh mesh;
    add_polygon(mesh, 4, 0, false, {0.5F, 0.5F}, 0.4F);
    mesh.triangles.pop_back();
    add_polygon(mesh, 4, 1, mirrored, {0.5F, 0.5F}, 0.4F);
    std::vector<std::uint32_t> copy_of = copies(finished(mesh), UvCopies::first);
    copy_of.resize(3, kNone);
    EXPECT_EQ(copy_of[1], kNone);
    EXPECT_EQ(copy_of[2], kNone);
  }
}

/// Mirrored quads whose files cut them along other diagonals: one half is baked, and no warning is given.
TEST(UvCopies, OfQuadsCutOtherwiseGiveNoWarning) {
  KILN_REQUIRE_DEVICE();
  Mesh low = strip({{true, 1, 0}, {}});
  low.triangles[0] = {0, 1, 2};
  low.triangles[1] = {0, 2, 3};
  low.uv_triangles = low.triangles;
  const Source source(*test::device(), test::plane(64, 32, 4, 4));
  BakeOptions options;
  options.width = options.height = 64;
  const BakeResult baked = bake(source, low, options);
  EXPECT_EQ(baked.report.uv_copies, 2U);
  for (const Warning& warning : baked.report.warnings) EXPECT_NE(warning.code, "uv-overlap");
}

/// Two sheets side by side over bumps that mirror each other; the second one's UVs are mirrored and one unit
/// off. No warning, and the map is that of the plain sheet alone; the other way round it is the mirrored one's.
TEST(UvCopies, AreBakedOnceFromTheHalfThatIsAskedFor) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = strip({{true, 1, 0}, {}});
  Mesh high = test::plane(64, 32, 2, 1);  // centred, or from 0: brought over the strip
  float least = 1e9F, bottom = 1e9F;
  for (const Vec3& p : high.positions) {
    least = std::min(least, p.x);
    bottom = std::min(bottom, p.y);
  }
  for (Vec3& p : high.positions) {
    p.x -= least;
    p.y -= bottom;
    p.z = 0.01F * p.x * p.x + 0.02F * p.y;
  }
  high.normals.clear();
  high.normal_triangles.clear();
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 64;
  options.encoding.space = NormalMapSpace::object;
  const auto alone = [&](std::size_t quad) {
    Mesh one = strip({{quad == 0}});
    for (Vec3& p : one.positions) p.x += static_cast<float>(quad);
    return bake(source, one, options).maps[0].image.pixels;
  };
  const BakeResult plain = bake(source, low, options);
  options.match.uv_copies = UvCopies::mirrored;
  const BakeResult mirrored = bake(source, low, options);
  options.match.uv_copies = UvCopies::plain;
  EXPECT_EQ(plain.report.uv_copies, 2U);
  EXPECT_EQ(plain.report.texels, mirrored.report.texels);
  EXPECT_EQ(plain.maps[0].image.pixels, alone(1));
  // A unit off, UVs are rounded.
  const std::vector<float>& map = mirrored.maps[0].image.pixels;
  const std::vector<float> wanted = alone(0);
  ASSERT_EQ(map.size(), wanted.size());
  for (std::size_t i = 0; i < map.size(); ++i) EXPECT_NEAR(map[i], wanted[i], 1e-4F) << i;
  EXPECT_NE(plain.maps[0].image.pixels, mirrored.maps[0].image.pixels);
  for (const Warning& warning : plain.report.warnings) ADD_FAILURE() << warning.message.text();
  ASSERT_TRUE(plain.report.recall.has_value());
  EXPECT_EQ(plain.report.recall->lost, 0);
}

/// Tangents of a mirrored half keep their sign, so that a renderer turns the shared texels round: a map that
/// leans along +x on the plain half is seen to lean along -x on the mirrored one.
TEST(UvCopies, KeepTheSignOfTangents) {
  const Mesh mesh = strip({{}, {true}});
  const LowSurface surface = LowSurface::of(mesh, Frame::of(mesh));
  for (std::size_t t = 0; t < 4; ++t) {
    const LowSurface::Corner& corner = surface.triangles[t][0];
    EXPECT_EQ(corner.sign, t < 2 ? 1 : -1);
    EXPECT_NEAR(corner.tangent.x, t < 2 ? 1 : -1, 1e-6);
  }
}

/// A dome that mirrors itself in the plane x = 1, between a half with plain UVs and one with mirrored ones: at
/// the seam both read the same texels, and the normals that they show differ by 1/255 at most.
TEST(UvCopies, LeaveNoStepAcrossTheMirrorSeam) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = strip({{true}, {false, 3, -2}});
  Mesh high = test::plane(128, 64, 2, 1);
  float least = 1e9F, bottom = 1e9F;
  for (const Vec3& p : high.positions) {
    least = std::min(least, p.x);
    bottom = std::min(bottom, p.y);
  }
  high.normals.clear();
  for (Vec3& p : high.positions) {
    p.x -= least;
    p.y -= bottom;
    const float x = p.x - 1, wave = 0.15F * (1 + 0.3F * std::sin(6 * p.y));
    p.z = wave * (1 - x * x);
    const float slope_y = 0.27F * std::cos(6 * p.y) * (1 - x * x);
    const float size = std::sqrt(4 * wave * wave * x * x + slope_y * slope_y + 1);
    high.normals.push_back({2 * wave * x / size, -slope_y / size, 1 / size});
  }
  high.normal_triangles = high.triangles;
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 256;
  options.match.max_distance = Length::absolute(0.3);
  for (const UvCopies rule : {UvCopies::plain, UvCopies::mirrored, UvCopies::first}) {
    options.match.uv_copies = rule;
    const BakeResult baked = bake(source, low, options);
    EXPECT_EQ(baked.report.uv_copies, 2U);
    const Image& map = baked.maps[0].image;
    // Between the texels at both sides of u = 0.1; along x the halves have opposite tangents.
    const double column = 0.1 * 256 - 0.5, share = column - std::floor(column);
    double step = 0, most = 0;
    for (std::size_t row = 30; row < 226; ++row) {
      const auto along = [&](std::size_t at) { return 2.0 * map.at(at, row)[0] - 1; };
      const auto left = static_cast<std::size_t>(column);
      step = std::max(step, 2 * std::abs(along(left) * (1 - share) + along(left + 1) * share));
      most = std::max(most, std::abs(along(200)));
    }
    EXPECT_LE(step, 1 / 255.0);
    EXPECT_GT(most, 0.15);  // else there would be nothing to step
  }
}

const Warning* warning_of(const BakeReport& report, const std::string& code) {
  for (const Warning& warning : report.warnings) {
    if (warning.code == code) return &warning;
  }
  return nullptr;
}

/// A fine sheet over each quad of a strip, with a height of its own.
template <typename Height>
Mesh sheets(std::uint32_t quads, const Height& height) {
  constexpr std::uint32_t kSteps = 96;
  Mesh mesh;
  mesh.name = "sheets";
  for (std::uint32_t q = 0; q < quads; ++q) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t j = 0; j <= kSteps; ++j) {
      for (std::uint32_t i = 0; i <= kSteps; ++i) {
        const float x = static_cast<float>(i) / kSteps, y = static_cast<float>(j) / kSteps;
        mesh.positions.push_back({static_cast<float>(q) + x, y, height(q, x, y)});
      }
    }
    for (std::uint32_t j = 0; j < kSteps; ++j) {
      for (std::uint32_t i = 0; i < kSteps; ++i) {
        const std::uint32_t a = first + j * (kSteps + 1) + i, b = a + kSteps + 1;
        mesh.triangles.insert(mesh.triangles.end(), {{a, a + 1, b + 1}, {a, b + 1, b}});
      }
    }
  }
  return mesh;
}

/// Waves along x or y, steepest 32 degrees.
float waves(float along) { return 0.01F * std::sin(62.8F * along); }

BakeOptions plain_options() {
  BakeOptions options;
  options.width = options.height = 128;
  options.match.max_distance = Length::absolute(0.1);
  return options;
}

/// Two materials on one UV square, and other waves under each: half of the high poly is on no texel.
TEST(UvCopies, OfAnotherSurfaceAreLostAndNamed) {
  KILN_REQUIRE_DEVICE();
  Mesh low = strip({{}, {}});
  low.material_names = {"wood", "steel"};
  low.materials = {0, 0, 1, 1};
  const Source source(*test::device(), sheets(2, [](std::uint32_t q, float x, float y) {
    return waves(q == 0 ? x : y);
  }));
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest, MatchMethod::views,
                                   MatchMethod::visibility, MatchMethod::hybrid}) {
    BakeOptions options = plain_options();
    options.match.method = method;
    const BakeReport report = bake(source, low, options).report;
    // The normals are within 5 degrees where both slopes nearly vanish: 10% of each, so 1% of both.
    EXPECT_GT(report.uv_copies_differ, 0.95) << method.name;
    const Warning* warning = warning_of(report, "uv-copies-differ");
    ASSERT_NE(warning, nullptr) << method.name;
    EXPECT_NE(warning->message.text().find("'steel'"), std::string::npos)
        << warning->message.text();
    EXPECT_NE(warning->message.text().find("'wood'"), std::string::npos) << warning->message.text();
    EXPECT_EQ(warning_of(report, "lost-surface"), nullptr);
    if (!report.recall) continue;
    // Half of what views show, but for what is the same by chance.
    EXPECT_NEAR(report.recall->lost, 0.5, 0.03) << method.name;
    EXPECT_NEAR(report.recall->by_copies, report.recall->lost, 0.01) << method.name;
  }
}

/// The same waves under each, moved or mirrored with the UVs: nothing is lost, at any scale and turn of a copy.
TEST(UvCopies, OfTheSameSurfaceAreNotLost) {
  KILN_REQUIRE_DEVICE();
  for (const bool mirrored : {false, true}) {
    for (const float scale : {1.0F, 3.0F}) {
      Mesh low = strip({{}, {mirrored}});
      Mesh high = sheets(2, [&](std::uint32_t q, float x, float y) {
        return waves(q == 1 && mirrored ? 1 - x : x) + 0.3F * waves(y);
      });
      // The second half is as large as `scale` says, and stands upright.
      const auto place = [&](std::vector<Vec3>& positions) {
        for (std::size_t i = positions.size() / 2; i < positions.size(); ++i) {
          const Vec3 p = positions[i];
          positions[i] = {3 - scale * p.z, scale * p.y, scale * (p.x - 1)};
        }
      };
      place(low.positions);
      place(high.positions);
      low.normals.clear();
      low.normal_triangles.clear();
      BakeOptions options = plain_options();
      options.match.max_distance = Length::absolute(0.1 * scale);
      options.maps = {MapKind::normal};
      const BakeReport report = bake(Source(*test::device(), high), low, options).report;
      EXPECT_EQ(report.uv_copies, 2U);
      EXPECT_LT(report.uv_copies_differ, 0.002) << mirrored << " " << scale;
      EXPECT_EQ(warning_of(report, "uv-copies-differ"), nullptr);
      ASSERT_TRUE(report.recall.has_value());
      EXPECT_LT(report.recall->lost, 0.005) << mirrored << " " << scale;
    }
  }
}

/// A copy whose surface is sheared, over a flat sheet. Rays that lean as the copy does end at the same place of its UVs:
/// the same is found, however long the way along the sheet is. Rays that do not lean with it end elsewhere.
TEST(UvCopies, ThatAreShearedAreComparedAlongTheirOwnUvs) {
  KILN_REQUIRE_DEVICE();
  constexpr float kShear = 0.7F, kHeight = 0.05F;
  for (const bool leans : {true, false}) {
    Mesh low = strip({{}, {}});
    for (std::size_t i = 4; i < 8; ++i) low.positions[i].x += 2 + kShear * low.positions[i].y;
    const float along = leans ? 0.6F * kShear : 0, size = std::hypot(along, 0.6F, 0.8F);
    low.normals = {{0, 0.6F, 0.8F}, {along / size, 0.6F / size, 0.8F / size}};
    low.normal_triangles = {{0, 0, 0}, {0, 0, 0}, {1, 1, 1}, {1, 1, 1}};
    Mesh high = test::plane(1, 1, 6, 2);
    for (Vec3& p : high.positions) p = {p.x + 2.2F, p.y + 0.7F, kHeight};
    BakeOptions options = plain_options();
    options.maps = {
        MapKind{"height"}};  // which holds lengths: places are told apart by 0.1% of the diagonal
    const BakeReport report = bake(Source(*test::device(), high), low, options).report;
    EXPECT_EQ(report.uv_copies, 2U);
    EXPECT_NEAR(report.uv_copies_differ, leans ? 0 : 1, 0.01);
  }
}

/// Flat sheets differ by their material, or by their vertices' colours alone.
TEST(UvCopies, OfOtherColoursAreLost) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = strip({{}, {}});
  const Mesh flat = sheets(2, [](std::uint32_t, float, float) { return 0.0F; });
  Mesh colored = flat, clear = flat, named = flat;
  for (const Vec3& p : flat.positions) {
    const auto shade = static_cast<std::uint8_t>(p.x <= 1 ? 200 : 100);
    colored.colors.push_back({shade, 100, 100, 255});
    clear.colors.push_back({100, 100, 100, shade});
  }
  named.material_names = {"a", "b"};
  for (std::size_t t = 0; t < flat.triangles.size(); ++t) {
    named.materials.push_back(t < flat.triangles.size() / 2 ? 0 : 1);
  }
  const auto differ = [&](const Mesh& high) {
    return bake(Source(*test::device(), high), low, plain_options()).report.uv_copies_differ;
  };
  EXPECT_EQ(differ(flat), 0);
  EXPECT_GT(differ(colored), 0.98);
  EXPECT_GT(differ(clear), 0.98) << "alpha alone, which the map opacity shows";
  EXPECT_GT(differ(named), 0.98);
}

/// Two files on one square: joined, each triangle has the name of its file.
TEST(UvCopies, OfAnotherFileAreNamed) {
  KILN_REQUIRE_DEVICE();
  Mesh first = strip({{}}), second = strip({{}});
  first.name = "left.obj";
  second.name = "right.obj";
  for (Vec3& p : second.positions) p.x += 1;
  const Mesh both[] = {first, second};
  const Source source(*test::device(), sheets(2, [](std::uint32_t q, float x, float y) {
    return waves(q == 0 ? x : y);
  }));
  const BakeReport report = bake(source, join_meshes(both), plain_options()).report;
  const Warning* warning = warning_of(report, "uv-copies-differ");
  ASSERT_NE(warning, nullptr);
  EXPECT_NE(warning->message.text().find("'right.obj'"), std::string::npos)
      << warning->message.text();
  EXPECT_NE(warning->message.text().find("'left.obj'"), std::string::npos)
      << warning->message.text();
  EXPECT_NEAR(report.recall->lost, 0.5, 0.03);
}

}  // namespace
}  // namespace kiln
