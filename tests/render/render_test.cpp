// Pictures: what is where, which way it faces, and that the map is read as it was baked.
#include "kiln/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

RenderOptions normals_seen(std::uint32_t size, double azimuth, double elevation) {
  RenderOptions options;
  options.size = size;
  options.samples = 1;
  options.ambient_rays = 0;
  options.show_normals = true;
  options.azimuth_degrees = azimuth;
  options.elevation_degrees = elevation;
  return options;
}

/// The normal at a pixel; zero where the picture is empty.
std::array<double, 3> normal_at(const Image& image, std::size_t x, std::size_t y) {
  const float* p = image.at(x, y);
  if (p[0] == 0 && p[1] == 0 && p[2] == 0) return {};
  return {2.0 * p[0] - 1, 2.0 * p[1] - 1, 2.0 * p[2] - 1};
}

void expect_normal(const Image& image, std::size_t x, std::size_t y,
                   const std::array<double, 3>& expected) {
  const auto found = normal_at(image, x, y);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(found[k], expected[k], 1e-5) << "axis " << k;
}

TEST(Render, LooksFromWhereItSays) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(*test::device(), test::cube());
  // The middle of the picture shows the face that looks at the camera.
  expect_normal(scene.draw(normals_seen(33, 0, 0)), 16, 16, {0, 0, 1});
  expect_normal(scene.draw(normals_seen(33, 90, 0)), 16, 16, {1, 0, 0});
  expect_normal(scene.draw(normals_seen(33, 180, 0)), 16, 16, {0, 0, -1});
  expect_normal(scene.draw(normals_seen(33, 0, 90)), 16, 16, {0, 1, 0});
  expect_normal(scene.draw(normals_seen(33, 0, -90)), 16, 16, {0, -1, 0});
  RenderOptions z_up = normals_seen(33, 0, 0);
  z_up.z_up = true;
  expect_normal(scene.draw(z_up), 16, 16, {0, -1, 0});
  z_up.elevation_degrees = 90;
  expect_normal(scene.draw(z_up), 16, 16, {0, 0, 1});
  // From the front, the top of the picture is up and its right is +X.
  Mesh arrow = test::plane(1, 1, 1, 1);
  arrow.positions.resize(3);
  arrow.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}};
  arrow.triangles = {{0, 1, 2}};
  arrow.uvs.clear();
  arrow.uv_triangles.clear();
  arrow.normals.clear();
  arrow.normal_triangles.clear();
  const Image image = Scene(*test::device(), arrow).draw(normals_seen(64, 0, 0));
  expect_normal(image, 50, 20, {0, 0, 1});  // right of the diagonal, near the top
  expect_normal(image, 20, 55, {0, 0, 1});
  expect_normal(image, 15, 15, {0, 0, 0});
}

TEST(Render, ShowsTheSpheresNormals) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(*test::device(), test::uv_sphere(128, 64));
  const std::uint32_t size = 201;
  const Image image = scene.draw(normals_seen(size, 0, 0));
  // The sphere fills the picture but for 4% on each side.
  const double radius = size / 2.0 * 0.92;
  int inside = 0;
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) {
      const double px = (x + 0.5 - size / 2.0) / radius;
      const double py = -(y + 0.5 - size / 2.0) / radius;
      const double r = std::hypot(px, py);
      const auto normal = normal_at(image, x, y);
      if (r > 1.02) {
        EXPECT_EQ(normal, (std::array<double, 3>{}));
      } else if (r < 0.9) {
        ++inside;
        const double pz = std::sqrt(1 - r * r);
        const double cosine = normal[0] * px + normal[1] * py + normal[2] * pz;
        // Facets of 2.8 degrees with interpolated normals.
        ASSERT_GT(cosine, std::cos(0.6 * 3.14159265 / 180)) << x << ", " << y;
      }
    }
  }
  EXPECT_GT(inside, 20000);
}

TEST(Render, ShowsTheMapsColours) {
  KILN_REQUIRE_DEVICE();
  // Red grows to the right, green up; row 0 is at the top.
  Image map{64, 64, 3, {}};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto channel = [](double value) { return static_cast<float>(value); };
      map.pixels.insert(map.pixels.end(),
                        {channel((x + 0.5) / 64), channel(1 - (y + 0.5) / 64), 0.25F});
    }
  }
  const Scene scene(*test::device(), test::plane(1, 1), {&map});
  RenderOptions options = normals_seen(128, 0, 0);
  options.show_normals = false;
  options.show_colors = true;
  const Image image = scene.draw(options);
  // The plane fills the picture but for 4% on each side.
  const double half = 64 * 0.92;
  int inside = 0;
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 128; ++x) {
      const double px = (x + 0.5 - 64) / half, py = (64 - y - 0.5) / half;
      const float* color = image.at(static_cast<std::size_t>(x), static_cast<std::size_t>(y));
      if (std::max(std::abs(px), std::abs(py)) > 1.05) {
        EXPECT_EQ(color[0] + color[1] + color[2], 0);
      } else if (std::max(std::abs(px), std::abs(py)) < 0.95) {
        ++inside;
        EXPECT_NEAR(color[0], px / 2 + 0.5, 1e-3);
        EXPECT_NEAR(color[1], py / 2 + 0.5, 1e-3);
        EXPECT_NEAR(color[2], 0.25, 1e-4);
      }
    }
  }
  EXPECT_GT(inside, 5000);
  options.ignore_map = true;
  EXPECT_THROW(scene.draw(options), Error);
}

TEST(Render, ReadsEveryKindOfMapAsItWasBaked) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(100000, true);
  const Mesh low = test::BumpySphere::light(96, 48);
  const Source source(*test::device(), high);
  const Image expected = Scene(*test::device(), high).draw(normals_seen(300, 40, 20));
  RenderOptions options = normals_seen(300, 40, 20);
  options.frame = &high;
  double without = 0;
  for (const NormalMapSpace space :
       {NormalMapSpace::tangent, NormalMapSpace::object, NormalMapSpace::face}) {
    for (const bool flip_y : {false, true}) {
      BakeOptions bake_options;
      bake_options.width = bake_options.height = 1024;
      bake_options.match.max_distance = Length::absolute(0.15);
      bake_options.encoding.space = space;
      bake_options.encoding.flip_y = flip_y;
      const BakeResult baked = bake(source, low, bake_options);
      const Scene scene(*test::device(), low, {&baked.maps[0].image, space, flip_y});
      const auto error = [&](const Image& image) {
        Image mask{300, 300, 1, {}};
        for (std::size_t i = 0; i < 90000; ++i) {
          const auto covered = [&](const Image& of) { return of.pixels[i * 3 + 2] != 0; };
          mask.pixels.push_back(covered(image) && covered(expected) ? 1.0F : 0.0F);
        }
        return compare_images(image, expected, &mask).mean_angle_degrees;
      };
      const double with = error(scene.draw(options));
      RenderOptions plain = options;
      plain.ignore_map = true;
      without = error(scene.draw(plain));
      EXPECT_GT(without, 5);
      // The rest is parallax: the low poly's points lie beside the dense one's.
      EXPECT_LT(with, 0.25 * without) << static_cast<int>(space) << flip_y;
    }
  }
}

/// A sheet is lit from behind as from the front, whichever side its faces show: its picture is as bright, from both.
TEST(Render, SheetsAreLitFromBothSides) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(*test::device(), test::plane(8, 8));
  const auto brightness = [&](double azimuth, double elevation) {
    RenderOptions options;
    options.size = 40;
    options.ambient_rays = 0;
    options.azimuth_degrees = azimuth;
    options.elevation_degrees = elevation;
    const Image image = scene.draw(options);
    double sum = 0;
    for (const float value : image.pixels) sum += double{value};
    return sum / static_cast<double>(image.pixels.size());
  };
  const double front = brightness(0, 0);
  EXPECT_GT(front, 0.2);
  for (const auto& [azimuth, elevation] : {std::pair{180, 0}, {150, 20}, {-160, -30}, {20, 20}}) {
    // Turned by less than 45 degrees, the light keeps its angle to the sheet, and the picture more than half of its area.
    EXPECT_GT(brightness(azimuth, elevation), 0.45 * front) << azimuth << " " << elevation;
  }
  EXPECT_NEAR(brightness(180, 0), front, 0.02);
}

TEST(Render, ClayIsLitAndTheSameEveryTime) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(*test::device(), test::torus(60, 30));
  RenderOptions options;
  options.size = 90;
  const Image first = scene.draw(options);
  EXPECT_EQ(first.pixels, scene.draw(options).pixels);
  float least = 1, most = 0;
  for (const float value : first.pixels) {
    ASSERT_TRUE(std::isfinite(value));
    least = std::min(least, value);
    most = std::max(most, value);
  }
  EXPECT_GE(least, 0.02F);
  EXPECT_LE(most, 1.0F);
  EXPECT_GT(most - least, 0.3F);
  // The hole's wall sees less of the sky.
  RenderOptions open = options;
  open.ambient_rays = 0;
  double darker = 0;
  const Image bright = scene.draw(open);
  for (std::size_t i = 0; i < first.pixels.size(); ++i)
    darker += bright.pixels[i] - first.pixels[i];
  EXPECT_GT(darker / static_cast<double>(first.pixels.size()), 0.001);
}

/// Its sky lies nearer than rays begin.
TEST(Render, LooksAsCloseAsItSays) {
  KILN_REQUIRE_DEVICE();
  RenderOptions closest;
  closest.size = 16;
  closest.zoom = 100000;
  closest.at = {0.5, 0.1, 0.1};  // on a face
  closest.azimuth_degrees = 90;
  const Image image = Scene(*test::device(), test::cube()).draw(closest);
  EXPECT_GT(image.pixels[0], 0.1F);
}

/// Its frame rounds the others.
TEST(Render, SaysWhichVertexLiesFarFromTheOthers) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh = test::plane(8, 8);
  for (Vec3& p : mesh.positions) p = {0.3F * p.x, 0.3F * p.y, p.z};  // no powers of two
  const Scene near(*test::device(), mesh);
  EXPECT_TRUE(near.warnings().empty());
  const auto far = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.uv_triangles.push_back(mesh.uv_triangles[0]);
  mesh.normal_triangles.push_back(mesh.normal_triangles[0]);
  mesh.positions.push_back({1e6F, 0.5F, 0.5F});
  mesh.triangles.push_back({1, 0, far});
  const Scene scene(*test::device(), mesh);
  ASSERT_FALSE(scene.warnings().empty());
  EXPECT_EQ(scene.warnings().back().code, "coarse-source");
  EXPECT_NE(
      scene.warnings().back().message.text().find("Vertex " + std::to_string(far) + " at (1e+06"),
      std::string::npos)
      << scene.warnings().back().message.text();
}

TEST(Render, RefusesWhatCannotBe) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(*test::device(), test::cube());
  const auto expect_code = [&](ErrorCode code, const std::function<void()>& run) {
    try {
      run();
      FAIL() << "taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code) << error.what();
    }
  };
  for (const auto& change : std::vector<std::function<void(RenderOptions&)>>{
           [](RenderOptions& o) { o.size = 0; }, [](RenderOptions& o) { o.size = 9000; },
           [](RenderOptions& o) { o.samples = 17; }, [](RenderOptions& o) { o.samples = 0; },
           [](RenderOptions& o) { o.elevation_degrees = 91; },
           [](RenderOptions& o) { o.azimuth_degrees = NAN; }}) {
    RenderOptions options;
    change(options);
    expect_code(ErrorCode::usage, [&] { scene.draw(options); });
  }
  const Image map{4, 4, 3, std::vector<float>(48, 0.5F)};
  expect_code(ErrorCode::input,
              [&] { Scene(*test::device(), test::tetrahedron(), {.image = &map}); });
  const Image grey{4, 4, 1, std::vector<float>(16, 0.5F)};
  expect_code(ErrorCode::input, [&] { Scene(*test::device(), test::cube(), {.image = &grey}); });
}

}  // namespace
}  // namespace kiln
