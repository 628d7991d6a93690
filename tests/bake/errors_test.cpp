// Errors that bakes report of themselves, against what is known of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "detail/occlusion_scene.h"
#include "image/gutter.h"
#include "kiln/bake.h"
#include "kiln/texture_sets.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

const MapError& error_of(const BakeResult& result, std::string_view map,
                         std::string_view reference) {
  for (const MapError& error : result.report.errors) {
    if (error.kind.name == map && error.reference.find(reference) != std::string_view::npos) {
      return error;
    }
  }
  throw std::runtime_error("no such error");
}

BakeOptions asking(std::vector<MapKind> maps, std::uint32_t side) {
  BakeOptions options;
  options.width = options.height = side;
  options.maps = std::move(maps);
  options.match.max_distance = Length::absolute(0.2);
  options.report.errors = true;
  return options;
}

TEST(MapErrors, FallWithMoreSamples) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(40000, true));
  const Mesh low = test::BumpySphere::light(24, 12);
  BakeOptions options =
      asking({MapKind::normal, MapKind{"height"}, MapKind::mask, MapKind{"id"}}, 64);
  const BakeResult one = bake(source, low, options);
  EXPECT_EQ(one.report.errors.size(), 2U) << "names and masks have no means";
  options.samples = 4;
  const BakeResult many = bake(source, low, options);
  const MapError &normal = error_of(one, "normal", "16 times"),
                 &height = error_of(one, "height", "");
  EXPECT_EQ(normal.unit, "degrees");
  EXPECT_EQ(height.unit, "world units");
  EXPECT_GT(normal.texels, 900U);
  EXPECT_LE(normal.texels, 2000U);
  EXPECT_GT(normal.rms, 0.02);
  EXPECT_LT(normal.rms, 3);
  EXPECT_LE(normal.mean, normal.rms);
  EXPECT_LE(normal.rms, normal.max);
  EXPECT_LE(normal.p95, normal.max);
  EXPECT_LT(error_of(many, "normal", "").rms, normal.rms / 2);
  EXPECT_LT(error_of(many, "height", "").rms, height.rms / 2);
}

TEST(MapErrors, AreThoseThatAFinerBakeShows) {
  KILN_REQUIRE_DEVICE();
  // Heights of a wave over a plane are known: what a texel holds is the wave at its middle, and what it is
  // compared with is the mean over 4 x 4 points.
  constexpr std::uint32_t kSide = 32;
  Mesh high = test::plane(256, 1);
  const auto wave = [](double x) { return 0.05 * std::sin(40 * x); };
  for (Vec3& p : high.positions) p.z = static_cast<float>(wave(p.x));
  const BakeResult baked =
      bake(Source(*test::device(), high), test::plane(1, 1), asking({MapKind{"height"}}, kSide));
  double squares = 0;
  for (std::uint32_t x = 0; x < kSide; ++x) {
    double mean = 0;
    for (int i = 0; i < 4; ++i) mean += wave((x + (i + 0.5) / 4) / kSide - 0.5) / 4;
    squares += std::pow(wave((x + 0.5) / kSide - 0.5) - mean, 2) / kSide;
  }
  EXPECT_NEAR(error_of(baked, "height", "").rms, std::sqrt(squares), 0.03 * std::sqrt(squares));
}

TEST(MapErrors, OfRaysFallWithTheirNumber) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(20000, true));
  const Mesh low = test::BumpySphere::light(24, 12);
  double last = 1e9;
  for (const std::uint32_t rays : {16U, 64U, 256U}) {
    BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}, MapKind::normal}, 32);
    options.occlusion.rays = rays;
    const BakeResult baked = bake(source, low, options);
    const MapError& ao = error_of(baked, "ao", "4096 rays");
    EXPECT_EQ(ao.unit, "1/255");
    EXPECT_EQ(error_of(baked, "bent_normal", "4096 rays").unit, "degrees");
    EXPECT_THROW(error_of(baked, "normal", "4096 rays"), std::runtime_error);
    EXPECT_LT(ao.rms, last * 0.7) << rays;
    EXPECT_GT(ao.rms, 0);
    last = ao.rms;
  }
  EXPECT_LT(last, 4);
}

TEST(MapErrors, OcclusionIsMadeToTheErrorAskedFor) {
  KILN_REQUIRE_DEVICE();
  // Under a disc that hovers over a floor: all shades from dark to open.
  Mesh high = test::plane(1, 1, 4, 4);
  test::add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Source source(*test::device(), high);
  const Mesh low = test::ground(1);
  BakeOptions options = asking({MapKind{"ao"}}, 64);
  options.report.errors = false;
  options.occlusion.rays = 16;
  double last = 1;
  for (const double wanted : {0.02, 0.004, 0.002}) {
    options.occlusion.max_error = wanted;
    const BakeResult baked = bake(source, low, options);
    ASSERT_EQ(baked.report.errors.size(), 1U) << "what was reached is always said";
    const double reached = error_of(baked, "ao", "4096 rays").rms / 255;
    EXPECT_LT(reached, wanted);
    EXPECT_LT(reached, last);
    last = reached;
    for (const Warning& warning : baked.report.warnings) {
      EXPECT_NE(warning.code, "ray-error-not-reached");
    }
  }
  // No rays of 4096 come this near.
  options.occlusion.max_error = 1e-7;
  const BakeResult beyond = bake(source, low, options);
  EXPECT_TRUE(
      std::any_of(beyond.report.warnings.begin(), beyond.report.warnings.end(),
                  [](const Warning& warning) { return warning.code == "ray-error-not-reached"; }));
  // Any map is within 1, so nothing is cast to say so; the map is no worse than that of plain rays.
  const auto pixels = [&](double max_error, std::uint32_t rays) {
    options.occlusion.max_error = max_error;
    options.occlusion.rays = rays;
    const BakeResult baked = bake(source, low, options);
    EXPECT_TRUE(baked.report.errors.empty());
    return baked.maps[0].image.pixels;
  };
  const std::vector<float> truth = pixels(0, 4096);
  for (const std::uint32_t rays : {16U, 64U}) {
    std::array<double, 2> rms{}, worst{};
    for (const int smoothed : {0, 1}) {
      const std::vector<float> map = pixels(smoothed, rays);
      for (std::size_t i = 0; i < map.size(); ++i) {
        const double error = std::abs(map[i] - truth[i]);
        rms[smoothed] += error * error / static_cast<double>(map.size());
        worst[smoothed] = std::max(worst[smoothed], error);
      }
    }
    EXPECT_LE(rms[1], rms[0]) << rays;
    EXPECT_LE(worst[1], worst[0]) << rays;
  }
}

/// A plane with thin walls that stand on it, which cross and come near each other at all distances.
Mesh walls_on_a_plane(int count) {
  Mesh mesh = test::plane(1, 1, 4, 4);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  std::uint32_t state = 7;
  const auto random = [&] {  // 0 to 1
    state = state * 1664525U + 1013904223U;
    return static_cast<float>(state >> 8U) * 0x1p-24F;
  };
  for (int i = 0; i < count; ++i) {
    const float x = 1.2F * random() - 0.6F, y = 1.2F * random() - 0.6F,
                angle = 6.2831853F * random();
    const float half = 0.05F + 0.25F * random(), height = 0.05F + 0.2F * random();
    const Vec3 a{x - half * std::cos(angle), y - half * std::sin(angle), 0};
    const Vec3 b{x + half * std::cos(angle), y + half * std::sin(angle), 0};
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, {b.x, b.y, height}, {a.x, a.y, height}});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  return mesh;
}

// Beside a thin wall shares change within a texel or two: smoothing there may make no texel worse than plain rays do.
TEST(MapErrors, SmoothingBlursNoThinWall) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), walls_on_a_plane(8));
  const Mesh low = test::ground(1);
  BakeOptions options = asking({MapKind{"ao"}}, 192);
  options.report.errors = false;
  options.match.max_distance = Length::absolute(0.01);
  const auto pixels = [&](double max_error, std::uint32_t rays) {
    options.occlusion.max_error = max_error;
    options.occlusion.rays = rays;
    return bake(source, low, options).maps[0].image.pixels;
  };
  const std::vector<float> truth = pixels(0, 2048);
  const auto errors = [&](const std::vector<float>& map) {
    double squares = 0, worst = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const double error = std::abs(double{map[i]} - truth[i]);
      squares += error * error;
      worst = std::max(worst, error);
    }
    return std::pair(std::sqrt(squares / static_cast<double>(map.size())), worst);
  };
  const auto [plain_rms, plain_worst] = errors(pixels(0, 64));
  const auto [rms, worst] = errors(pixels(1, 64));
  std::printf("thin walls: rms %.2f of 255 for %.2f of plain rays, most %.1f for %.1f\n", 255 * rms,
              255 * plain_rms, 255 * worst, 255 * plain_worst);
  EXPECT_LE(rms, plain_rms);
  EXPECT_LE(worst, plain_worst);
}

// Errors are measured at 2,000 texels, whatever the map's size, also where the match wants whole bands. (Once all texels of such a map
// cast 4096 rays: 64 times as long here.)
TEST(MapErrors, TakeAsLongForLargeMapsAsForSmallOnes) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 4, 4);
  test::add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Source source(*test::device(), high);
  const Mesh low = test::ground(1);
  BakeOptions options = asking({MapKind{"ao"}}, 48);
  options.report.errors = false;
  options.match.method = MatchMethod::visibility;
  options.match.visibility.directions = 16;
  options.match.visibility.view_size = 64;
  options.occlusion.rays = 8;
  options.occlusion.max_error = 0.9;
  const auto least_seconds = [&](std::uint32_t side) {
    options.width = options.height = side;
    double least = 1e9;
    for (int attempt = 0; attempt < 3; ++attempt) {
      const BakeResult baked = bake(source, low, options);
      EXPECT_GT(error_of(baked, "ao", "4096 rays").texels, 1000U);
      least = std::min(least, baked.report.seconds_errors);
    }
    return least;
  };
  const double small = least_seconds(48);
  EXPECT_LT(least_seconds(384), 10 * small);
}

TEST(MapErrors, ChangeNoTexelAndSayNothingUnasked) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(2000, true));
  const Mesh low = test::BumpySphere::light(8, 4);
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest, MatchMethod::views,
                                   MatchMethod::visibility, MatchMethod::hybrid}) {
    BakeOptions options = asking({MapKind::normal, MapKind{"ao"}}, 20);
    options.match.method = method;
    options.match.visibility.directions = 48;
    options.match.visibility.view_size = 64;
    options.report.keep_match = true;
    const BakeResult with = bake(source, low, options);
    options.report.errors = false;
    const BakeResult without = bake(source, low, options);
    EXPECT_EQ(with.maps[0].image.pixels, without.maps[0].image.pixels) << method.name;
    EXPECT_EQ(with.maps[1].image.pixels, without.maps[1].image.pixels) << method.name;
    EXPECT_EQ(with.report.errors.size(), 3U) << method.name;
    EXPECT_TRUE(without.report.errors.empty());
    EXPECT_EQ(with.report.missed, without.report.missed);
    // A saved match has no further points.
    options.report.errors = true;
    options.match.saved = &*without.match;
    options.report.keep_match = false;
    const BakeResult saved = bake(source, low, options);
    ASSERT_EQ(saved.report.errors.size(), 1U);
    EXPECT_NEAR(saved.report.errors[0].rms, error_of(with, "ao", "4096 rays").rms, 1e-9)
        << method.name;
  }
}

/// CIELAB of linear sRGB under D65, written out for this test (IEC 61966-2-1, CIE 15).
std::array<double, 3> lab_of(const float* rgb) {
  const double x = (0.4124 * rgb[0] + 0.3576 * rgb[1] + 0.1805 * rgb[2]) / 0.9505;
  const double y = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
  const double z = (0.0193 * rgb[0] + 0.1192 * rgb[1] + 0.9505 * rgb[2]) / 1.089;
  const auto f = [](double t) {
    return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
  };
  return {116 * f(y) - 16, 500 * (f(x) - f(y)), 200 * (f(y) - f(z))};
}

/// Difference of two texels as the manual defines it for each unit. Convexity's third channel says what its first two
/// do, so it is no difference of its own.
double texel_difference(const MapError& error, const MapInfo& map, const float* a, const float* b) {
  if (map.type == MapType::unit_vector) {
    double cosine = 0, p = 0, q = 0;
    for (int c = 0; c < 3; ++c) {
      cosine += double{a[c]} * b[c];
      p += double{a[c]} * a[c];
      q += double{b[c]} * b[c];
    }
    return std::acos(std::clamp(cosine / std::sqrt(p * q), -1.0, 1.0)) * 180 / std::numbers::pi;
  }
  double squares = 0;
  if (map.type == MapType::color && map.channels >= 3) {
    const std::array<double, 3> p = lab_of(a), q = lab_of(b);
    for (std::size_t c = 0; c < 3; ++c) squares += (p[c] - q[c]) * (p[c] - q[c]);
    return std::sqrt(squares);
  }
  const std::uint32_t channels = map.kind == MapKind{"convexity"} ? 2 : map.channels;
  for (std::uint32_t c = 0; c < channels; ++c) squares += std::pow(double{a[c]} - b[c], 2);
  return std::sqrt(squares) * (error.unit == "1/255" ? 255 : 1);
}

/// A bake whose errors are stated, and which maps it makes.
struct ErrorCase {
  std::string name;
  Mesh high, low;
  BakeOptions options;
  Mesh cage = {};  ///< Rays start from it if it has triangles
};

/// Root mean squares over the texels that both bakes hold: the map against the same bake with 16 times as many samples
/// a texel, a bake of its own. Ambient occlusion's has as many rays as a texel of the finer evaluation.
void expect_errors_of_a_finer_bake(const ErrorCase& test) {
  SCOPED_TRACE(test.name);
  BakeOptions options = test.options;
  options.report.errors = true;
  options.encoding.raw = true;
  options.encoding.gutter = 0;
  if (!test.cage.triangles.empty()) options.match.cage_mesh = &test.cage;
  const Source source(*test::device(), test.high);
  const BakeResult baked = bake(source, test.low, options);
  options.report.errors = false;
  options.samples *= 4;
  options.occlusion.rays = 256;
  options.occlusion.by = OcclusionBy::rays;
  options.occlusion.max_error = 0;
  for (MapVariant& variant : options.variants) {
    if (variant.occlusion) variant.occlusion->rays = 256;
  }
  const BakeResult finer = bake(source, test.low, options);
  ASSERT_LE(baked.report.texels, 2000U) << "all texels are to be compared";
  std::size_t compared = 0;
  for (const BakedMap& map : baked.maps) {
    if (map.info.type == MapType::id || map.info.type == MapType::coverage) continue;
    if (map.cluster > 0) continue;  // the report has the first cluster's errors
    SCOPED_TRACE(map.kind.name);
    const auto stated = std::find_if(
        baked.report.errors.begin(), baked.report.errors.end(), [&](const MapError& error) {
          return error.kind == map.kind &&
                 error.reference.find("matched") != std::string_view::npos;
        });
    ASSERT_NE(stated, baked.report.errors.end()) << "an error that is not known is to be said";
    const Image& exact = finer.map(map.kind).image;
    double squares = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      if (TexelState{baked.coverage[i]} != TexelState::baked ||
          TexelState{finer.coverage[i]} != TexelState::baked) {
        continue;
      }
      const std::size_t at = i * map.image.channels;
      squares += std::pow(
          texel_difference(*stated, map.info, &map.image.pixels[at], &exact.pixels[at]), 2);
      ++count;
    }
    ASSERT_GT(count, 0U);
    const double rms = std::sqrt(squares / static_cast<double>(count));
    testing::Test::RecordProperty(test.name + "_" + std::string(map.kind.name),
                                  std::to_string(stated->rms) + " for " + std::to_string(rms));
    EXPECT_EQ(stated->texels, count);
    // Errors of roundings alone, as of positions of a plane far off, have no third.
    EXPECT_NEAR(stated->rms, rms, rms / 3 + 1e-4 * (stated->unit == "degrees" ? 1 : 1e-2));
    ++compared;
  }
  EXPECT_GT(compared, 0U);
}

/// Waves over the unit square, with the layout of a plane, colours and alpha; all of it seen from +Z.
Mesh waves(std::uint32_t cells, double height) {
  Mesh mesh = test::plane(cells, cells);
  for (Vec3& p : mesh.positions) {
    const double x = p.x, y = p.y;
    p.z = static_cast<float>(height *
                             (std::sin(23 * x + 1) * std::cos(17 * y) + 0.4 * std::sin(61 * y)));
    const auto shade = [](double value) {
      return static_cast<std::uint8_t>(std::clamp(127.5 + 127 * value, 0.0, 255.0));
    };
    mesh.colors.push_back({shade(std::sin(40 * x)), shade(std::cos(31 * y)),
                           shade(std::sin(25 * (x + y))), shade(std::cos(47 * x))});
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

/// Four quads with the layout of a plane, not flat, so that each match has its own directions.
Mesh folded_quads() {
  Mesh mesh = test::plane(2, 2);
  mesh.positions[4].z = 0.08F;
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

BakeOptions options_of(MatchMethod method, std::vector<MapKind> maps, std::uint32_t side) {
  BakeOptions options;
  options.width = options.height = side;
  options.maps = std::move(maps);
  options.match.method = method;
  options.match.max_distance = Length::absolute(0.3);
  options.match.visibility.directions = 64;
  options.match.visibility.view_size = 64;
  options.match.views.size = 200;
  options.occlusion.rays = 16;
  options.curvature_radius = Length::absolute(0.04);
  options.match.uv.max_distance = options.match.uv.max_overlap = 1e9;
  return options;
}

Mesh moved(Mesh mesh, double x, double y) {
  mesh.origin[0] += x;
  mesh.origin[1] += y;
  return mesh;
}

std::vector<ErrorCase> error_cases() {
  const std::vector<MapKind> some = {MapKind::normal, MapKind{"height"}, MapKind{"vertex_color"}};
  const Mesh high = waves(96, 0.02), low = folded_quads();
  std::vector<ErrorCase> cases;
  const auto add = [&](std::string name, BakeOptions options) -> ErrorCase& {
    cases.push_back({std::move(name), high, low, std::move(options)});
    return cases.back();
  };
  for (const MatchMethod method :
       {MatchMethod::ray, MatchMethod::closest, MatchMethod::views, MatchMethod::visibility,
        MatchMethod::hybrid, MatchMethod::uv, MatchMethod::axis}) {
    const std::string name(method.name);
    add(name, options_of(method, some, 24));
    if (method == MatchMethod::axis) cases.back().options.match.views.directions = {{0.2F, 0, 1}};
    // A grid of samples of its own, a map of other sides.
    ErrorCase& wide = add(name + "_2x2", cases.back().options);
    wide.options.samples = 2;
    wide.options.width = 16;
    wide.options.height = 40;
  }
  for (const MatchMethod method : {MatchMethod::visibility, MatchMethod::hybrid}) {
    for (const VisibilityAt at : {VisibilityAt::face, VisibilityAt::vertex}) {
      add(std::string(method.name) + (at == VisibilityAt::face ? "_face" : "_vertex"),
          options_of(method, some, 24));
      cases.back().options.match.visibility.at = at;
    }
  }
  // Each map by the match that has the most to go wrong: one that reads texels.
  add("maps", options_of(MatchMethod::visibility,
                         {"normal",    "normal_object", "normal_face", "bent_normal",  "ao",
                          "thickness", "curvature",     "convexity",   "displacement", "distance",
                          "position",  "slope",         "uv",          "wireframe",    "visibility",
                          "deviation", "color",         "opacity",     "shadow",       "height"},
                         28));
  // Texels of 1/16 of the map, and of 1/44.
  for (const std::uint32_t side : {16U, 44U}) {
    add("uv_" + std::to_string(side),
        options_of(MatchMethod::uv, {"height", "curvature", "ao"}, side));
  }
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::uv, MatchMethod::visibility}) {
    const std::string name(method.name);
    ErrorCase& far = add(name + "_far", options_of(method, some, 24));
    far.high = moved(high, 512345, 5412345);
    far.low = moved(low, 512345, 5412345);
    // Half of the layout is the other half's mirror image.
    ErrorCase& mirrored = add(name + "_mirrored", options_of(method, some, 24));
    for (Mesh* mesh : {&mirrored.low, &mirrored.high}) {
      for (Vec2& uv : mesh->uvs) uv.x = 1 - std::abs(2 * uv.x - 1);
    }
    // A hole in the high poly, which another match fills, blended with it.
    ErrorCase& hole = add(name + "_fallback", options_of(method, some, 32));
    std::erase_if(hole.high.triangles, [&](const Triangle& t) {
      const Vec3& p = high.positions[t[0]];
      return std::abs(p.x - 0.1F) < 0.15F && std::abs(p.y) < 0.2F;
    });
    if (method == MatchMethod::uv) {
      hole.high.uv_triangles = hole.high.triangles;
      hole.options.match.fallback = {MatchMethod::closest};
    } else {
      hole.high.uvs.clear();
      hole.high.uv_triangles.clear();
      hole.options.match.fallback = {MatchMethod::closest};
    }
    hole.options.match.fallback_blend = 3;
  }
  // A card whose high poly is farther off than 2% of the diagonal: its own reach finds it.
  ErrorCase& card = add("open_sheet", options_of(MatchMethod::ray, some, 24));
  card.options.match.max_distance.reset();
  for (Vec3& p : card.high.positions) p.z += 0.2F;
  // One of two texture sets, whose UVs are the other's, too; its map has the unit square.
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::uv, MatchMethod::visibility}) {
    ErrorCase& set = add(std::string(method.name) + "_set", options_of(method, some, 24));
    const auto second = static_cast<std::uint32_t>(set.low.positions.size());
    const std::size_t triangles = set.low.triangles.size();
    for (std::uint32_t p = 0; p < second; ++p) {
      Vec3 moved_aside = set.low.positions[p];
      moved_aside.x += 3;
      set.low.positions.push_back(moved_aside);
    }
    set.low.materials.assign(triangles, 0);
    for (std::size_t t = 0; t < triangles; ++t) {
      const Triangle& c = set.low.triangles[t];
      set.low.triangles.push_back({c[0] + second, c[1] + second, c[2] + second});
      set.low.uv_triangles.push_back(set.low.uv_triangles[t]);
      set.low.materials.push_back(1);
    }
    set.low.material_names = {"here", "aside"};
    set.low.tangents = tangents_of(set.low);
    const std::vector<TextureSet> sets = find_texture_sets(set.low, SetsBy::material);
    Mesh part = set.low;
    lay_out_set(set.low, sets.at(0), part);
    set.low = std::move(part);
  }
  // Occlusion by pictures from all around, and smoothed over the surface; a disc hovers over the waves.
  for (const char* name : {"occlusion_by_views", "occlusion_smoothed"}) {
    ErrorCase& occluded = add(name, options_of(MatchMethod::ray, {"ao", "bent_normal"}, 32));
    test::add_disc(occluded.high, {0.1F, 0, 0.3F}, 0.3F, false);
    occluded.high.normals.clear();
    occluded.high.normal_triangles.clear();
    occluded.high.colors.clear();
    occluded.high.uvs.clear();
    occluded.high.uv_triangles.clear();
    occluded.options.match.max_distance = Length::absolute(0.15);
    if (*std::string_view(name).rbegin() == 's') {
      occluded.options.occlusion.by = OcclusionBy::views;
      occluded.options.occlusion.views = 64;
    } else {
      occluded.options.maps = {"ao"};
      occluded.options.occlusion.rays = 64;
      occluded.options.occlusion.max_error = 1;
    }
  }
  // A map of the user's own, with an edge through each wave.
  ErrorCase& own = add("own_map", options_of(MatchMethod::ray, {}, 24));
  own.options.own_maps = {
      {"steps",
       "float4 kiln_map(const kiln_point* point) {\n"
       "  const float high = point->position.z > 0.004f ? 1.0f : 0.0f;\n"
       "  return (float4)(high, point->position.x, high * point->position.y, 1.0f);\n"
       "}\n"}};
  // Rays from cages: one above the low poly, and shells on both sides of it.
  for (const bool shells : {false, true}) {
    ErrorCase& caged =
        add(shells ? "cage_shells" : "cage_offsets", options_of(MatchMethod::ray, some, 24));
    caged.options.match.max_distance.reset();
    const auto add_shell = [&](float offset) {
      const auto first = static_cast<std::uint32_t>(caged.cage.positions.size());
      for (Vec3 p : low.positions) {
        p.z += offset * (1 + 0.5F * p.x);
        caged.cage.positions.push_back(p);
      }
      for (const Triangle& t : low.triangles) {
        caged.cage.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
      }
    };
    add_shell(0.2F);
    if (shells) add_shell(-0.2F);
  }
  // Directions from two views of unequal weight, and texels whose directions are split into two clusters.
  ErrorCase& weighted =
      add("visibility_likelihoods", options_of(MatchMethod::visibility, some, 24));
  weighted.options.match.visibility.likelihood = ViewLikelihood::list;
  weighted.options.match.visibility.likelihoods = {{{0.3F, 0, 1}, 3}, {{-0.5F, 0.4F, 1}, 1}};
  ErrorCase& clusters = add("visibility_clusters", options_of(MatchMethod::visibility, some, 24));
  clusters.options.match.visibility.clusters = 2;
  clusters.options.match.visibility.cluster_deviation = 0.3;
  // Variants with settings of their own beside the maps that have the bake's.
  ErrorCase& variants = add("variants", options_of(MatchMethod::ray, {"ao", "curvature"}, 24));
  OcclusionOptions near = variants.options.occlusion;
  near.rays = 64;
  near.distance = Length::absolute(0.05);
  variants.options.variants = {
      {.name = "ao_near", .kind = "ao", .occlusion = near},
      {.name = "curvature_wide", .kind = "curvature", .curvature_radius = Length::absolute(0.1)}};
  // Two sheets 0.1% apart.
  ErrorCase& thin =
      add("thin", options_of(MatchMethod::ray, {"normal", "curvature", "convexity"}, 24));
  const auto count = static_cast<std::uint32_t>(high.positions.size());
  for (std::size_t i = 0; i < count; ++i) {
    Vec3 p = high.positions[i];
    p.z -= 0.001F;
    thin.high.positions.push_back(p);
  }
  thin.high.colors.clear();
  thin.high.uvs.clear();
  thin.high.uv_triangles.clear();
  for (const Triangle& t : high.triangles) {
    thin.high.triangles.push_back({t[0] + count, t[2] + count, t[1] + count});
  }
  return cases;
}

// Every match, and every map, on the inputs that made a stated error wrong: matches that read the places of samples,
// samples with a reach of their own, blended texels, far origins, mirrored layouts, sheets behind others.
TEST(MapErrors, AreWithinAThirdOfThoseOfAFinerBake) {
  KILN_REQUIRE_DEVICE();
  for (const ErrorCase& test : error_cases()) expect_errors_of_a_finer_bake(test);
}

/// A picture of one number a texel, in so many equal channels.
Texture grey_picture(std::uint32_t channels) {
  constexpr std::uint32_t kSide = 128;
  auto image = std::make_shared<Image>();
  image->width = image->height = kSide;
  image->channels = channels;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const double value = 0.5 + 0.5 * std::sin(0.7 * x) * std::cos(0.45 * y);
      for (std::uint32_t c = 0; c < channels; ++c) {
        image->pixels.push_back(static_cast<float>(value));
      }
    }
  }
  Texture texture;
  texture.kind = TextureKind::linear;
  texture.images = {image};
  return texture;
}

// However many equal channels a picture has, its map has one: its error is that of one number, and no more than 255 of
// 255.
TEST(MapErrors, OfGreyTexturesAreThoseOfOneChannel) {
  KILN_REQUIRE_DEVICE();
  const Mesh plane = test::plane(1, 1);
  std::optional<double> stated;
  for (const std::uint32_t channels : {1U, 2U, 3U, 4U}) {
    BakeOptions options = options_of(MatchMethod::ray, {}, 20);
    options.transfers = {{"roughness", grey_picture(channels)}};
    if (channels == 2 || channels == 4) {  // alpha is none of the number
      Image& image = const_cast<Image&>(*options.transfers[0].texture.images[0]);
      for (std::size_t i = channels - 1; i < image.pixels.size(); i += channels) {
        image.pixels[i] = 0.25F;
      }
    }
    expect_errors_of_a_finer_bake({"grey_" + std::to_string(channels), plane, plane, options});
    options.report.errors = true;
    const BakeResult baked = bake(Source(*test::device(), plane), plane, options);
    EXPECT_EQ(baked.maps[0].image.channels, 1U) << channels;
    const double rms = error_of(baked, "roughness", "matched").rms;
    EXPECT_GT(rms, 1);
    if (!stated) stated = rms;
    EXPECT_NEAR(rms, *stated, 1e-9 * *stated) << channels;
  }
  // Colours stay, and so does what differs in one channel by a step of 255.
  BakeOptions options = options_of(MatchMethod::ray, {}, 20);
  Texture colored = grey_picture(3);
  const_cast<Image&>(*colored.images[0]).pixels[5 * 3 + 1] += 1.0F / 255;
  options.transfers = {{"colored", colored}, {"shown", grey_picture(1)}};
  options.transfers[1].texture.kind = TextureKind::srgb;
  const BakeResult baked = bake(Source(*test::device(), plane), plane, options);
  EXPECT_EQ(baked.map(MapKind{"colored"}).image.channels, 3U);
  EXPECT_EQ(baked.map(MapKind{"shown"}).image.channels, 3U);
}

}  // namespace
}  // namespace kiln
