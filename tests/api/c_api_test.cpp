// The C interface: layouts and names that may not change, and what it gives for what it is given.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "kiln/asset.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/kiln_c.h"
#include "kiln/mesh_view.h"
#include "support/environment.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

/// "kiln_span 24: data 0, count 8, stride 16" of every struct, and every function.
std::string interface_as_it_is() {
  std::ostringstream text;
#define BEGIN(type) text << #type " " << sizeof(type) << ":"
#define FIELD(type, field) text << " " #field " " << offsetof(type, field)
  BEGIN(kiln_span);
  FIELD(kiln_span, data), FIELD(kiln_span, count), FIELD(kiln_span, stride);
  text << "\n";
  BEGIN(kiln_mesh_view);
  FIELD(kiln_mesh_view, size), FIELD(kiln_mesh_view, positions), FIELD(kiln_mesh_view, indices);
  FIELD(kiln_mesh_view, index_count), FIELD(kiln_mesh_view, normals), FIELD(kiln_mesh_view, uvs);
  FIELD(kiln_mesh_view, tangents), FIELD(kiln_mesh_view, colors), FIELD(kiln_mesh_view, origin);
  FIELD(kiln_mesh_view, flip_v), FIELD(kiln_mesh_view, reserved), FIELD(kiln_mesh_view, name);
  text << "\n";
  BEGIN(kiln_mesh_arrays);
  FIELD(kiln_mesh_arrays, size), FIELD(kiln_mesh_arrays, positions),
      FIELD(kiln_mesh_arrays, vertex_count);
  FIELD(kiln_mesh_arrays, triangles), FIELD(kiln_mesh_arrays, triangle_count),
      FIELD(kiln_mesh_arrays, uvs);
  FIELD(kiln_mesh_arrays, uv_count), FIELD(kiln_mesh_arrays, uv_triangles),
      FIELD(kiln_mesh_arrays, normals);
  FIELD(kiln_mesh_arrays, normal_count), FIELD(kiln_mesh_arrays, normal_triangles);
  FIELD(kiln_mesh_arrays, colors), FIELD(kiln_mesh_arrays, origin);
  text << "\n";
  BEGIN(kiln_simplify_options);
  FIELD(kiln_simplify_options, size), FIELD(kiln_simplify_options, faces),
      FIELD(kiln_simplify_options, keep_uvs);
  FIELD(kiln_simplify_options, max_error), FIELD(kiln_simplify_options, keep_parts);
  FIELD(kiln_simplify_options, hull), FIELD(kiln_simplify_options, progress),
      FIELD(kiln_simplify_options, user);
  text << "\n";
  BEGIN(kiln_unwrap_options);
  FIELD(kiln_unwrap_options, size), FIELD(kiln_unwrap_options, map_size);
  FIELD(kiln_unwrap_options, border_texels), FIELD(kiln_unwrap_options, pairs);
  FIELD(kiln_unwrap_options, reserved), FIELD(kiln_unwrap_options, progress),
      FIELD(kiln_unwrap_options, user);
  text << "\n";
  BEGIN(kiln_bake_options);
  FIELD(kiln_bake_options, size), FIELD(kiln_bake_options, width), FIELD(kiln_bake_options, height);
  FIELD(kiln_bake_options, samples), FIELD(kiln_bake_options, gutter),
      FIELD(kiln_bake_options, maps);
  FIELD(kiln_bake_options, match), FIELD(kiln_bake_options, fallback),
      FIELD(kiln_bake_options, max_distance);
  FIELD(kiln_bake_options, cage), FIELD(kiln_bake_options, relative),
      FIELD(kiln_bake_options, two_sided);
  FIELD(kiln_bake_options, flip_y), FIELD(kiln_bake_options, object_space),
      FIELD(kiln_bake_options, ao_rays);
  FIELD(kiln_bake_options, reserved), FIELD(kiln_bake_options, ao_distance);
  FIELD(kiln_bake_options, progress), FIELD(kiln_bake_options, user);
  text << "\n";
  BEGIN(kiln_map);
  FIELD(kiln_map, size), FIELD(kiln_map, name), FIELD(kiln_map, width), FIELD(kiln_map, height);
  FIELD(kiln_map, channels), FIELD(kiln_map, reserved), FIELD(kiln_map, pixels);
  text << "\n";
  BEGIN(kiln_report);
  FIELD(kiln_report, size), FIELD(kiln_report, texels), FIELD(kiln_report, samples),
      FIELD(kiln_report, missed);
  FIELD(kiln_report, max_distance), FIELD(kiln_report, mean_abs_distance),
      FIELD(kiln_report, warnings);
  text << "\n";
  BEGIN(kiln_job_image);
  FIELD(kiln_job_image, size), FIELD(kiln_job_image, name), FIELD(kiln_job_image, set);
  FIELD(kiln_job_image, tile), FIELD(kiln_job_image, width), FIELD(kiln_job_image, height);
  FIELD(kiln_job_image, channels), FIELD(kiln_job_image, pixels);
  text << "\n";
#undef BEGIN
#undef FIELD
  const std::string header = read_file(test_data("../../include/kiln/kiln_c.h"));
  const std::regex declared("\nKILN_C_API ([^;]*);");
  for (std::sregex_iterator at(header.begin(), header.end(), declared), end; at != end; ++at) {
    text << std::regex_replace((*at)[1].str(), std::regex("\\s+"), " ") << "\n";
  }
  return text.str();
}

TEST(CInterface, IsTheOneThatProgramsWereCompiledAgainst) {
  // A change here breaks programs: add functions and last fields alone.
  EXPECT_EQ(interface_as_it_is(), read_file(test_data("c_abi.txt")));
}

struct Freed {
  void operator()(kiln_mesh* mesh) const { kiln_mesh_free(mesh); }
  void operator()(kiln_source* source) const { kiln_source_free(source); }
  void operator()(kiln_bake* bake) const { kiln_bake_free(bake); }
};
template <typename T>
using Owned = std::unique_ptr<T, Freed>;

TEST(CInterface, ShadesAHardSurface) {
  const std::vector<float> xyz = {0, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1,
                                  1, 0, 0, 1, 0, 1, 1, 1, 0, 1, 1, 1};
  const std::vector<std::uint32_t> faces = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                                            2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
  kiln_mesh_view view;
  kiln_mesh_view_init(&view);
  view.positions = {xyz.data(), 8, 0};
  view.indices = faces.data();
  view.index_count = faces.size();
  const auto most = [&](double angle) {  // of a normal's components, the least over all normals
    kiln_mesh* made = nullptr;
    EXPECT_EQ(kiln_mesh_new(&view, &made), KILN_OK);
    const Owned<kiln_mesh> mesh(made);
    EXPECT_EQ(kiln_mesh_shade(mesh.get(), angle), KILN_OK) << kiln_error_message();
    kiln_mesh_arrays arrays;
    kiln_mesh_arrays_init(&arrays);
    EXPECT_EQ(kiln_mesh_read(mesh.get(), &arrays), KILN_OK);
    float least = 1;
    for (std::size_t i = 0; i < arrays.normal_count; ++i) {
      const float* n = arrays.normals + 3 * i;
      least = std::min(least, std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])}));
    }
    return arrays.normal_count == 0 ? 0 : least;
  };
  EXPECT_GT(most(0), 0.9999F);  // along the axes: flat
  EXPECT_GT(most(90), 0.9999F);
  EXPECT_LT(most(120), 0.6F);  // of a cube's corner: 0.577
  EXPECT_EQ(kiln_mesh_shade(nullptr, 0), KILN_USAGE);
}

/// One list of vertices for all corners.
struct Corners {
  explicit Corners(const Mesh& mesh) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) {
        positions.push_back(mesh.positions[mesh.triangles[t][c]]);
        if (!mesh.uvs.empty()) uvs.push_back(mesh.uvs[mesh.uv_triangles[t][c]]);
      }
    }
  }
  kiln_mesh_view view() const {
    kiln_mesh_view v;
    kiln_mesh_view_init(&v);
    v.positions = {positions.data(), positions.size(), 0};
    if (!uvs.empty()) v.uvs = {uvs.data(), uvs.size(), 0};
    return v;
  }
  std::vector<Vec3> positions;
  std::vector<Vec2> uvs;
};

Owned<kiln_mesh> mesh_of(const Mesh& mesh) {
  const Corners corners(mesh);
  const kiln_mesh_view view = corners.view();
  kiln_mesh* made = nullptr;
  EXPECT_EQ(kiln_mesh_new(&view, &made), KILN_OK) << kiln_error_message();
  return Owned<kiln_mesh>(made);
}

Owned<kiln_source> source_of(const kiln_mesh* high) {
  kiln_source* made = nullptr;
  EXPECT_EQ(kiln_source_new(nullptr, high, nullptr, nullptr, &made), KILN_OK)
      << kiln_error_message();
  return Owned<kiln_source>(made);
}

TEST(CInterface, BakesTheBytesOfCpp) {
  if (device() == nullptr) GTEST_SKIP() << "no device";
  const Owned<kiln_mesh> high = mesh_of(torus(48, 24)), low = mesh_of(torus(12, 8));
  const Owned<kiln_source> source = source_of(high.get());
  kiln_bake_options options;
  kiln_bake_options_init(&options);
  options.width = 64;
  options.height = 32;
  options.maps = "normal,ao";
  options.fallback = "closest";
  options.ao_rays = 8;
  options.max_distance = 0.1;
  options.relative = 1;
  kiln_bake* made = nullptr;
  ASSERT_EQ(kiln_bake_new(source.get(), low.get(), &options, &made), KILN_OK)
      << kiln_error_message();
  const Owned<kiln_bake> bake(made);

  const auto mesh_in_cpp = [](const Corners& corners) {
    MeshView view;
    view.positions = {corners.positions.data(), corners.positions.size()};
    view.uvs = {corners.uvs.data(), corners.uvs.size()};
    return to_mesh(view);
  };
  BakeOptions same;
  same.width = 64;
  same.height = 32;
  same.maps = {find_map("normal").kind, find_map("ao").kind};
  same.match.fallback = {MatchMethod::closest};
  same.match.max_distance = Length::share(0.1);
  same.occlusion.rays = 8;
  const BakeResult right = kiln::bake(Source(*device(), mesh_in_cpp(Corners(torus(48, 24)))),
                                      mesh_in_cpp(Corners(torus(12, 8))), same);

  ASSERT_EQ(kiln_bake_map_count(bake.get()), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    kiln_map map;
    kiln_map_init(&map);
    ASSERT_EQ(kiln_bake_map(bake.get(), i, &map), KILN_OK);
    const Image& image = right.maps[i].image;
    EXPECT_EQ(map.name, right.maps[i].kind.name);
    ASSERT_EQ(map.width * map.height * map.channels, image.pixels.size());
    EXPECT_EQ(std::memcmp(map.pixels, image.pixels.data(), image.pixels.size() * sizeof(float)), 0)
        << map.name;
  }
  EXPECT_EQ(
      std::memcmp(kiln_bake_coverage(bake.get()), right.coverage.data(), right.coverage.size()), 0);
  kiln_report report;
  kiln_report_init(&report);
  ASSERT_EQ(kiln_bake_report(bake.get(), &report), KILN_OK);
  EXPECT_EQ(report.samples, right.report.samples);
  EXPECT_EQ(report.warnings, right.report.warnings.size());
  EXPECT_EQ(kiln_bake_warning(bake.get(), report.warnings), nullptr);
}

TEST(CInterface, BakesThatFindNothingFail) {
  if (device() == nullptr) GTEST_SKIP() << "no device";
  Mesh far = torus(12, 8), outside = torus(12, 8);
  for (Vec3& p : far.positions) p.x += 100;
  for (Vec2& uv : outside.uvs) uv.x += 5;
  const Owned<kiln_source> source = source_of(mesh_of(torus(48, 24)).get());
  kiln_bake_options options;
  kiln_bake_options_init(&options);
  options.width = options.height = 32;
  kiln_bake* const none = reinterpret_cast<kiln_bake*>(8);
  kiln_bake* bake = none;
  EXPECT_EQ(kiln_bake_new(source.get(), mesh_of(far).get(), &options, &bake), KILN_INPUT);
  EXPECT_STREQ(kiln_error_code(), "many-misses");
  EXPECT_NE(std::string(kiln_error_message()).find("100%"), std::string::npos);
  EXPECT_EQ(kiln_bake_new(source.get(), mesh_of(outside).get(), &options, &bake), KILN_INPUT);
  EXPECT_STREQ(kiln_error_code(), "no-texels");
  EXPECT_EQ(bake, none);
}

TEST(CInterface, SimplifiesAndUnwraps) {
  const Owned<kiln_mesh> high = mesh_of(icosphere(4));
  kiln_simplify_options to;
  kiln_simplify_options_init(&to);
  to.faces = 200;
  kiln_mesh *light = nullptr, *low = nullptr;
  ASSERT_EQ(kiln_simplify(high.get(), &to, &light), KILN_OK) << kiln_error_message();
  const Owned<kiln_mesh> kept(light);
  ASSERT_EQ(kiln_unwrap(light, nullptr, &low), KILN_OK) << kiln_error_message();
  const Owned<kiln_mesh> laid(low);
  kiln_mesh_arrays arrays;
  kiln_mesh_arrays_init(&arrays);
  ASSERT_EQ(kiln_mesh_read(low, &arrays), KILN_OK);
  EXPECT_EQ(arrays.triangle_count, 200U);
  ASSERT_NE(arrays.uv_triangles, nullptr);
  for (std::size_t i = 0; i < 3 * arrays.triangle_count; ++i) {
    ASSERT_LT(arrays.triangles[i], arrays.vertex_count);
    ASSERT_LT(arrays.uv_triangles[i], arrays.uv_count);
  }
}

/// The pictures are those of save_glb() in C++, colours sRGB-encoded; what a material has no place for is left out.
TEST(CInterface, LooksAsFarAsItsLowPolyStrays) {
  if (device() == nullptr) GTEST_SKIP() << "no device";
  Mesh rough = icosphere(5);
  for (Vec3& p : rough.positions) {
    const float by = 1 + 0.35F * std::sin(9 * p.x) * std::sin(8 * p.y) * std::cos(7 * p.z);
    p = {by * p.x, by * p.y, by * p.z};
  }
  rough.normals.clear();
  rough.normal_triangles.clear();
  const Owned<kiln_mesh> high = mesh_of(rough);
  kiln_simplify_options to;
  kiln_simplify_options_init(&to);
  to.faces = 150;
  kiln_mesh* made = nullptr;
  ASSERT_EQ(kiln_simplify(high.get(), &to, &made), KILN_OK) << kiln_error_message();
  const Owned<kiln_mesh> simplified(made);
  ASSERT_EQ(kiln_unwrap(simplified.get(), nullptr, &made), KILN_OK) << kiln_error_message();
  const Owned<kiln_mesh> low(made);
  // The same mesh from elsewhere.
  kiln_mesh_arrays arrays;
  kiln_mesh_arrays_init(&arrays);
  ASSERT_EQ(kiln_mesh_read(low.get(), &arrays), KILN_OK);
  Mesh copy;
  const auto rows = [](auto& to, const auto* from, std::size_t count) {
    using Row = typename std::remove_reference_t<decltype(to)>::value_type;
    to.resize(count);
    std::memcpy(static_cast<void*>(to.data()), from, count * sizeof(Row));
  };
  rows(copy.positions, arrays.positions, arrays.vertex_count);
  rows(copy.triangles, arrays.triangles, arrays.triangle_count);
  rows(copy.uvs, arrays.uvs, arrays.uv_count);
  rows(copy.uv_triangles, arrays.uv_triangles, arrays.triangle_count);
  const Owned<kiln_source> source = source_of(high.get());
  const auto report_of = [&](const kiln_mesh* mesh) {
    kiln_bake_options options;
    kiln_bake_options_init(&options);
    options.width = options.height = 128;
    kiln_bake* baked = nullptr;
    EXPECT_EQ(kiln_bake_new(source.get(), mesh, &options, &baked), KILN_OK) << kiln_error_message();
    const Owned<kiln_bake> bake(baked);
    kiln_report report;
    kiln_report_init(&report);
    EXPECT_EQ(kiln_bake_report(bake.get(), &report), KILN_OK);
    return report;
  };
  const kiln_report known = report_of(low.get()), unknown = report_of(mesh_of(copy).get());
  EXPECT_EQ(known.samples, unknown.samples);
  EXPECT_GT(known.max_distance, 2 * unknown.max_distance);
  EXPECT_LT(known.missed, unknown.missed / 10);
}

TEST(CInterface, TellsWhatWasHandled) {
  const Mesh box = test::cube();
  kiln_mesh_view view;
  kiln_mesh_view_init(&view);
  view.positions = {box.positions.data(), box.positions.size(), 0};
  view.indices = box.triangles[0].data();
  view.index_count = 3 * box.triangles.size();
  kiln_mesh *high = nullptr, *low = nullptr;
  ASSERT_EQ(kiln_mesh_new(&view, &high), KILN_OK);
  EXPECT_EQ(kiln_warning(0), nullptr);
  kiln_simplify_options options;
  kiln_simplify_options_init(&options);
  options.faces = 2;  // a closed mesh has four
  ASSERT_EQ(kiln_simplify(high, &options, &low), KILN_OK);
  ASSERT_NE(kiln_warning(0), nullptr);
  EXPECT_NE(std::string(kiln_warning(0)).find("2 faces were requested"), std::string::npos);
  EXPECT_EQ(kiln_warning(1000), nullptr);
  // Of this thread's last call.
  std::thread([] { EXPECT_EQ(kiln_warning(0), nullptr); }).join();
  kiln_mesh* unwrapped = nullptr;
  ASSERT_EQ(kiln_unwrap(low, nullptr, &unwrapped), KILN_OK);
  EXPECT_EQ(kiln_warning(0), nullptr);
  kiln_mesh_free(unwrapped);
  kiln_mesh_free(low);
  kiln_mesh_free(high);
}

TEST(CInterface, WritesAGlb) {
  if (device() == nullptr) GTEST_SKIP() << "no device";
  const std::filesystem::path folder = scratch_folder();
  Mesh painted = torus(24, 12);
  for (std::size_t i = 0; i < painted.positions.size(); ++i) {
    painted.colors.push_back({static_cast<std::uint8_t>(i), 60, 130, 255});
  }
  Corners corners(painted);
  std::vector<std::array<std::uint8_t, 4>> colors;
  for (const auto& triangle : painted.triangles) {
    for (const std::uint32_t v : triangle) colors.push_back(painted.colors[v]);
  }
  kiln_mesh_view view = corners.view();
  view.colors = {colors.data(), colors.size(), 0};
  kiln_mesh* made = nullptr;
  ASSERT_EQ(kiln_mesh_new(&view, &made), KILN_OK);
  const Owned<kiln_mesh> mesh(made);
  const Owned<kiln_source> source = source_of(mesh.get());
  kiln_bake_options options;
  kiln_bake_options_init(&options);
  options.width = options.height = 32;
  options.maps = "normal,height,color,ao";
  options.ao_rays = 4;
  const auto baked = [&] {
    kiln_bake* bake = nullptr;
    EXPECT_EQ(kiln_bake_new(source.get(), mesh.get(), &options, &bake), KILN_OK);
    return Owned<kiln_bake>(bake);
  };
  const Owned<kiln_bake> bake = baked();
  const auto file = folder / "c.glb";
  ASSERT_EQ(kiln_glb_save(mesh.get(), bake.get(), file.c_str()), KILN_OK) << kiln_error_message();

  std::vector<Image> images;
  for (std::size_t i = 0; i < 4; ++i) {
    kiln_map map;
    kiln_map_init(&map);
    ASSERT_EQ(kiln_bake_map(bake.get(), i, &map), KILN_OK);
    images.push_back({32, 32, map.channels, {map.pixels, map.pixels + 1024 * map.channels}});
  }
  to_srgb(images[2]);
  MeshView same;
  same.positions = {corners.positions.data(), corners.positions.size()};
  same.uvs = {corners.uvs.data(), corners.uvs.size()};
  same.colors = {colors.data(), colors.size()};
  AssetMaps maps;
  maps.normal = images.data();
  maps.color = &images[2];
  maps.occlusion = &images[3];
  save_glb(to_mesh(same), maps, folder / "cpp.glb");
  EXPECT_EQ(read_file(file), read_file(folder / "cpp.glb"));

  EXPECT_EQ(kiln_glb_save(mesh.get(), nullptr, file.c_str()), KILN_OK) << kiln_error_message();
  EXPECT_TRUE(load_asset(file).materials.empty() ||
              load_asset(file).materials[0].normal_map.empty());
  EXPECT_EQ(kiln_glb_save(nullptr, bake.get(), file.c_str()), KILN_USAGE);
  EXPECT_EQ(kiln_glb_save(mesh.get(), bake.get(), "no/such/folder/a.glb"), KILN_OUTPUT);
  options.flip_y = 1;
  EXPECT_EQ(kiln_glb_save(mesh.get(), baked().get(), file.c_str()), KILN_USAGE);
  EXPECT_STREQ(kiln_error_code(), "option-contradiction");
}

TEST(CInterface, SaysWhatIsWrongAndLeavesOutputsAlone) {
  kiln_mesh* const none = reinterpret_cast<kiln_mesh*>(8);
  kiln_mesh* mesh = none;
  EXPECT_EQ(kiln_mesh_new(nullptr, &mesh), KILN_USAGE);
  EXPECT_STREQ(kiln_error_code(), "null");
  EXPECT_EQ(kiln_mesh_load("no/such/file.ply", &mesh), KILN_INPUT);
  EXPECT_NE(std::string(kiln_error_message()).find("no/such/file.ply"), std::string::npos);
  EXPECT_EQ(kiln_mesh_load(nullptr, &mesh), KILN_USAGE);

  const std::vector<float> positions(9, 0.0F);
  const std::vector<std::uint32_t> indices = {0, 1, 3};
  kiln_mesh_view view;
  kiln_mesh_view_init(&view);
  view.positions = {positions.data(), 3, 0};
  view.indices = indices.data();
  view.index_count = 3;
  EXPECT_EQ(kiln_mesh_new(&view, &mesh), KILN_INPUT);
  EXPECT_STREQ(kiln_error_code(), "mesh-index");
  view.size = 0;
  EXPECT_EQ(kiln_mesh_new(&view, &mesh), KILN_USAGE);
  EXPECT_STREQ(kiln_error_code(), "struct-size");
  view.size = sizeof view;
  view.positions.stride = 1;  // elements that overlap
  EXPECT_EQ(kiln_mesh_new(&view, &mesh), KILN_USAGE);
  EXPECT_STREQ(kiln_error_code(), "stride");
  view.positions.stride = SIZE_MAX - 11;  // a negative one
  EXPECT_EQ(kiln_mesh_new(&view, &mesh), KILN_USAGE);
  EXPECT_STREQ(kiln_error_code(), "stride");
  EXPECT_EQ(mesh, none);

  // Another thread has a message of its own.
  std::string there = "?";
  std::thread([&] { there = kiln_error_message(); }).join();
  EXPECT_EQ(there, "");

  kiln_mesh_free(nullptr);
  kiln_source_free(nullptr);
  kiln_bake_free(nullptr);
}

TEST(CInterface, TakesNullAndRefusesWhatIsReserved) {
  kiln_mesh_view_init(nullptr);
  kiln_mesh_arrays_init(nullptr);
  kiln_simplify_options_init(nullptr);
  kiln_unwrap_options_init(nullptr);
  kiln_bake_options_init(nullptr);
  kiln_map_init(nullptr);
  kiln_report_init(nullptr);
  const auto refused = [](kiln_status status) {
    EXPECT_EQ(status, KILN_USAGE);
    EXPECT_STREQ(kiln_error_code(), "struct-reserved") << kiln_error_message();
  };
  const Corners corners(torus(12, 8));
  kiln_mesh_view view = corners.view();
  view.reserved = 1;
  kiln_mesh* made = nullptr;
  refused(kiln_mesh_new(&view, &made));
  const Owned<kiln_mesh> mesh = mesh_of(torus(12, 8));
  kiln_unwrap_options unwrap_options;
  kiln_unwrap_options_init(&unwrap_options);
  unwrap_options.reserved = 7;
  refused(kiln_unwrap(mesh.get(), &unwrap_options, &made));
  const float pixel = 0.5F;
  kiln_map map;
  kiln_map_init(&map);
  map.width = map.height = map.channels = 1;
  map.pixels = &pixel;
  map.reserved = 1;
  refused(kiln_map_save(&map, (scratch_folder() / "a.png").string().c_str()));
  EXPECT_EQ(made, nullptr);
  if (device() == nullptr) GTEST_SKIP() << "no device";
  const Owned<kiln_source> source = source_of(mesh.get());
  kiln_bake_options options;
  kiln_bake_options_init(&options);
  options.reserved = 1;
  kiln_bake* bake = nullptr;
  refused(kiln_bake_new(source.get(), mesh.get(), &options, &bake));
}

TEST(CInterface, WritesOverNothingThatWasRead) {
  const std::filesystem::path folder = scratch_folder(), file = folder / "read.obj";
  Mesh ring = torus(12, 8);
  ring.materials.assign(ring.triangles.size(), 0);
  ring.material_names = {"skin"};
  ring.material_files = {"skin.mtl"};
  save_obj(ring, file);
  std::ofstream(folder / "skin.mtl") << "newmtl skin\n";
  std::filesystem::create_symlink("read.obj", folder / "link.obj");
  std::filesystem::create_hard_link(file, folder / "other.glb");
  const std::string before = read_file(file);
  kiln_mesh* made = nullptr;
  ASSERT_EQ(kiln_mesh_load(file.string().c_str(), &made), KILN_OK) << kiln_error_message();
  const Owned<kiln_mesh> mesh(made);
  ASSERT_EQ(kiln_unwrap(mesh.get(), nullptr, &made), KILN_OK) << kiln_error_message();
  const Owned<kiln_mesh> unwrapped(made);
  kiln_simplify_options options;
  kiln_simplify_options_init(&options);
  options.faces = 40;
  ASSERT_EQ(kiln_simplify(mesh.get(), &options, &made), KILN_OK) << kiln_error_message();
  const Owned<kiln_mesh> light(made);
  const auto refused = [&](kiln_status status) {
    EXPECT_EQ(status, KILN_USAGE);
    EXPECT_STREQ(kiln_error_code(), "output-input");
    EXPECT_EQ(read_file(file), before);
  };
  for (const kiln_mesh* each : {mesh.get(), unwrapped.get(), light.get()}) {
    refused(kiln_mesh_save_obj(each, file.string().c_str()));
    refused(kiln_mesh_save_obj(each, (folder / "link.obj").string().c_str()));
    // Both names are stated where they differ.
    const std::string message = kiln_error_message();
    EXPECT_NE(message.find("link.obj' is the input '"), std::string::npos) << message;
    EXPECT_NE(message.find("read.obj' and would be overwritten: choose another name or folder"),
              std::string::npos)
        << message;
    refused(kiln_mesh_save_obj(each, (folder / "skin.mtl").string().c_str()));
  }
  EXPECT_EQ(read_file(folder / "skin.mtl"), "newmtl skin\n");
  refused(kiln_glb_save(unwrapped.get(), nullptr, (folder / "other.glb").string().c_str()));
  const std::string fresh = (folder / "fresh.obj").string();
  EXPECT_EQ(kiln_mesh_save_obj(light.get(), fresh.c_str()), KILN_OK) << kiln_error_message();
  EXPECT_EQ(kiln_mesh_save_obj(light.get(), fresh.c_str()), KILN_OK) << "it was only written";
}

TEST(CInterface, MapsAreSavedAsWhatTheirNamesSay) {
  const std::vector<float> pixels(3, 0.5F);
  kiln_map map;
  kiln_map_init(&map);
  map.width = map.height = 1;
  map.channels = 3;
  map.pixels = pixels.data();
  const std::filesystem::path folder = test::scratch_folder();
  for (const char* name : {"a.png", "b.PNG", "c.exr"}) {
    EXPECT_EQ(kiln_map_save(&map, (folder / name).string().c_str()), KILN_OK);
  }
  EXPECT_EQ(read_file(folder / "b.PNG"), read_file(folder / "a.png"));
  for (const char* name : {"d.jpg", "e", "f.tga"}) {
    EXPECT_EQ(kiln_map_save(&map, (folder / name).string().c_str()), KILN_USAGE);
    EXPECT_STREQ(kiln_error_code(), "output-name");
    EXPECT_FALSE(std::filesystem::exists(folder / name));
  }
  // Sides that no memory has are told, not read.
  map.width = map.height = 0xFFFFFFFF;
  EXPECT_EQ(kiln_map_save(&map, (folder / "g.png").string().c_str()), KILN_USAGE);
}

TEST(CInterface, StructsOfAnOlderHeaderDo) {
  if (device() == nullptr) GTEST_SKIP() << "no device";
  const Owned<kiln_mesh> high = mesh_of(torus(16, 8));
  const Owned<kiln_source> source = source_of(high.get());
  kiln_bake_options options;
  std::memset(&options, 0xFF, sizeof options);  // beyond its size nothing may be read
  options.size = offsetof(kiln_bake_options, samples);
  options.width = options.height = 16;
  kiln_bake* bake = nullptr;
  ASSERT_EQ(kiln_bake_new(source.get(), high.get(), &options, &bake), KILN_OK)
      << kiln_error_message();
  const Owned<kiln_bake> kept(bake);
  kiln_map map;
  kiln_map_init(&map);
  map.channels = 77;
  map.size = offsetof(kiln_map, channels);
  ASSERT_EQ(kiln_bake_map(bake, 0, &map), KILN_OK);
  EXPECT_EQ(map.width, 16U);
  EXPECT_EQ(map.channels, 77U);
  EXPECT_EQ(kiln_bake_map(bake, 1, &map), KILN_USAGE);
}

TEST(CInterface, CallbacksStopCalls) {
  if (device() == nullptr) GTEST_SKIP() << "no device";
  const Owned<kiln_mesh> high = mesh_of(torus(200, 100));
  const Owned<kiln_source> source = source_of(high.get());
  kiln_bake_options options;
  kiln_bake_options_init(&options);
  int calls = 0;
  options.user = &calls;
  options.progress = [](double, const char* stage, void* user) -> std::int32_t {
    EXPECT_NE(stage, nullptr);
    ++*static_cast<int*>(user);
    return 0;
  };
  kiln_bake* bake = nullptr;
  EXPECT_EQ(kiln_bake_new(source.get(), high.get(), &options, &bake), KILN_CANCELLED);
  EXPECT_EQ(bake, nullptr);
  EXPECT_EQ(calls, 1);
  options.maps = "normal,shine";
  options.progress = nullptr;
  EXPECT_EQ(kiln_bake_new(source.get(), high.get(), &options, &bake), KILN_USAGE);
  EXPECT_NE(std::string(kiln_error_message()).find("shine"), std::string::npos);
}

}  // namespace
}  // namespace kiln::test
