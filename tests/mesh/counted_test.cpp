// Work grows no faster than what is given: not seconds are counted but basic blocks that run, of the files that
// tests/CMakeLists.txt compiles with a call to count() in each.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "asset/materials.h"
#include "clean/steps.h"
#include "kiln/image.h"
#include "kiln/match.h"
#include "kiln/material.h"
#include "kiln/normals.h"
#include "kiln/simplify.h"
#include "mesh/curvature.h"
#include "mesh/surface_distance.h"
#include "simplify/transfer_labels.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace {
std::atomic<std::uint64_t> blocks{0};
}
extern "C" void __sanitizer_cov_trace_pc() { blocks.fetch_add(1, std::memory_order_relaxed); }

namespace kiln {
namespace {

/// The power by which the blocks of work(n) grow from a sixteenth to all, less those of work(1).
double growth(const std::function<void(std::uint32_t)>& work, std::uint32_t all = 20000) {
  const auto count = [&](std::uint32_t n) {
    const std::uint64_t before = blocks;
    work(n);
    return static_cast<double>(blocks - before);
  };
  const double least = count(1), few = count(all / 16) - least, many = count(all) - least;
  EXPECT_GT(least, 10) << "no file counts";
  return std::log(std::max(many, 1.0) / std::max(few, 1.0)) / std::log(16.0);
}

/// A triangle for each name.
Mesh named(const std::vector<std::string>& names) {
  Mesh mesh;
  mesh.group_names = names;
  for (std::uint32_t i = 0; i < names.size(); ++i) {
    mesh.positions.insert(mesh.positions.end(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.groups.push_back(i);
  }
  return mesh;
}

using Name = std::function<std::string(std::uint32_t)>;
Mesh named(std::uint32_t n, const Name& name) {
  std::vector<std::string> names{"x"};
  for (std::uint32_t i = 1; i < n; ++i) names.push_back(name(i));
  return named(names);
}

Name with(const std::string& before, const std::string& after = "", std::uint32_t times = 1) {
  return [=](std::uint32_t i) { return before + std::to_string(times * i) + after; };
}

TEST(Counted, NamesThatMatchAndNamesThatDoNot) {
  const std::string text(64, 'n');
  for (const auto& pair : {std::pair(with("one", "", 7), with("other", "", 3)),
                           std::pair(with("a", "_low"), with("a", "_high")),
                           std::pair(with("a", text), with("b", text)),
                           std::pair(with(text, "_L"), with(text, "_H"))}) {
    const auto& low = pair.first;
    const auto& high = pair.second;
    SCOPED_TRACE(low(1) + " " + high(1));
    EXPECT_LE(growth([&](std::uint32_t n) { pair_parts(named(n, high), named(n, low)); }), 1.1);
  }
}

/// Names of one letter: the nearest are looked for within a band.
TEST(Counted, LengthsOfNames) {
  EXPECT_LE(growth([&](std::uint32_t n) {
              const std::string long_name(n, 'a');
              pair_parts(named({"x", long_name + "b"}), named({"x", "c" + long_name}));
            }),
            1.1);
  // ...and a pattern that nearly fits at each place.
  PartNames names;
  names.by = PartsBy::list;
  EXPECT_LE(growth([&](std::uint32_t n) {
              names.list = {{"*a*a*a*a*a*ab", {"*a*a*a*a*ab"}}, {"x", {"x"}}};
              const Mesh mesh = named({"x", std::string(n, 'a')});
              pair_parts(mesh, mesh, names);
            }),
            1.1);
}

/// As many patterns as names, alike before, behind or between their stars.
TEST(Counted, PatternsOfAList) {
  for (const auto& pattern : {with("a", "_*"), with("*_a"), with("*_a", "_*"), with("a*_", "_low"),
                              with("*a*", "_*"), with("a*_b", "_*c")}) {
    SCOPED_TRACE(pattern(1));
    EXPECT_LE(growth([&](std::uint32_t n) {
                PartNames names;
                names.by = PartsBy::list;
                for (std::uint32_t i = 0; i < n; ++i)
                  names.list.push_back({pattern(i), {pattern(i)}});
                names.list.push_back({"*", {"*"}});
                pair_parts(named(n, with("a", "_high")), named(n, with("a", "_low")), names);
              }),
              1.1);
  }
}

/// Materials of one picture: it is read once.
TEST(Counted, RepeatsOfATexture) {
  const std::filesystem::path folder = test::scratch_folder();
  save_image({64, 64, 3, std::vector<float>(64 * 64 * 3, 0.5F)}, folder / "a.png",
             {.format = ImageFormat::png8});
  for (const bool other_paths : {false, true}) {
    EXPECT_LE(growth([&](std::uint32_t n) {
                Mesh mesh = test::plane(1, 1);
                mesh.material_files = {"a.mtl", "b.mtl"};
                for (const std::string& file : mesh.material_files) {
                  std::ofstream mtl(folder / file);
                  for (std::uint32_t i = 0; i < n; ++i) {
                    mtl << "newmtl m" << i << "\nmap_Kd "
                        << (other_paths ? "././a.png\n" : "a.png\n") << "Kd 0." << i << " 0 "
                        << (file == "a.mtl" ? "0\n" : "1\n");
                  }
                }
                for (std::uint32_t i = 0; i < n; ++i) {
                  mesh.material_names.push_back("m" + std::to_string(i));
                }
                const std::vector<Material> materials = load_materials(mesh, folder / "a.obj");
                const Texture texture = load_material_texture(materials, MaterialSlot::color);
                EXPECT_EQ(texture.images.size(), 1U);
              }),
              1.1);
  }
}

/// A wavy sheet of about n triangles.
Mesh sheet(std::uint32_t n) {
  const auto side = static_cast<std::uint32_t>(std::sqrt(n / 2.0)) + 1;
  Mesh mesh = test::plane(side, side);
  for (Vec3& p : mesh.positions) p.z = 0.02F * std::sin(40 * p.x) * std::cos(37 * p.y);
  return mesh;
}

/// Thin triangles of all lengths up to 0.6, in all directions.
Mesh needles(std::uint32_t n) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-0.5F, 0.5F), way(-0.3F, 0.3F);
  Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 a{place(random), place(random), place(random)};
    const Vec3 b{a.x + way(random), a.y + way(random), a.z + way(random)};
    mesh.positions.insert(mesh.positions.end(), {a, b, {a.x + 1e-3F, a.y + 1e-3F, a.z}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

/// A map of 256 texels: as many places of HIGH are asked for, however many vertices it has. Needles are cut into pieces
/// where these are many, so that fewer than 20,000 cost less each.
TEST(Counted, CurvatureOfASmallMap) {
  for (Mesh (*make)(std::uint32_t) : {sheet, needles}) {
    EXPECT_LE(growth(
                  [&](std::uint32_t n) {
                    const Mesh mesh = make(n);
                    const MeanCurvature curvature(mesh.positions, mesh.triangles, 0.03);
                    MeanCurvature::Scratch scratch;
                    for (std::size_t i = 0; i < 256; ++i) {
                      const std::size_t triangle = mesh.triangles.size() * i / 256;
                      curvature.on(static_cast<std::uint32_t>(triangle), 0.3, 0.3, scratch);
                    }
                  },
                  320000),
              1.1);
  }
}

/// What fitted normals and deviations ask: nearest points of a fixed number of places.
TEST(Counted, NearestPointsOfNeedles) {
  EXPECT_LE(growth([&](std::uint32_t n) {
              const Mesh mesh = needles(n);
              const SurfaceDistance surface(mesh.positions, mesh.triangles);
              for (const Vec3& p : sheet(1000).positions) surface.squared(p);
            }),
            1.1);
}

/// n triangles on one edge, whose third corners are anywhere, on a circle around the edge, or in a plane with it.
enum class Apexes { anywhere, around, in_a_plane };
Mesh on_one_edge(std::uint32_t n, Apexes apexes) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> place(-1, 1);
  Mesh mesh;
  mesh.positions = {{0, 0, -0.5F}, {0, 0, 0.5F}};
  for (std::uint32_t i = 0; i < n; ++i) {
    const float angle = 6.2831853F * static_cast<float>(i) / static_cast<float>(n);
    const float x = place(random), y = place(random), z = place(random);
    mesh.positions.push_back(apexes == Apexes::anywhere ? Vec3{x, y, z}
                             : apexes == Apexes::around ? Vec3{std::cos(angle), std::sin(angle), 0}
                                                        : Vec3{x, 0, z});
    mesh.triangles.push_back({0, 1, 2 + i});
  }
  return mesh;
}

/// The triangles in another order, each from another corner on.
Mesh turned(Mesh mesh) {
  std::reverse(mesh.triangles.begin(), mesh.triangles.end());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle& corners = mesh.triangles[t];
    std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(t % 3),
                corners.end());
  }
  return mesh;
}

/// Building a tree takes n log n, which grows by this power here.
constexpr double kTreeGrowth = 1.2;

/// Triangles on one edge, whose boxes all overlap, are kept: no search visits them.
TEST(Counted, SimplificationOfOneEdge) {
  for (const Apexes apexes : {Apexes::anywhere, Apexes::around, Apexes::in_a_plane}) {
    for (const std::uint32_t faces : {64U, 0U}) {
      EXPECT_LE(growth(
                    [&](std::uint32_t n) {
                      simplify(on_one_edge(std::max(n, 2U), apexes), {.faces = faces});
                    },
                    8000),
                kTreeGrowth)
          << static_cast<int>(apexes) << " to " << faces;
    }
  }
}

/// Each triangle has UVs of its own, so that every side is a seam.
TEST(Counted, KeptUvsOfOneEdge) {
  EXPECT_LE(growth(
                [&](std::uint32_t n) {
                  Mesh mesh = on_one_edge(std::max(n, 2U), Apexes::anywhere);
                  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
                    const float u = static_cast<float>(t % 128) / 128;
                    const float v = static_cast<float>(t / 128) / 128;
                    mesh.uvs.insert(mesh.uvs.end(), {{u, v}, {u + 0.005F, v}, {u, v + 0.005F}});
                    mesh.uv_triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
                  }
                  simplify(mesh, {.faces = 64, .keep_uvs = true});
                },
                8000),
            kTreeGrowth);
}

/// Normals, names and distances of a low poly that has the high poly's triangles.
TEST(Counted, TransferBetweenMeshesOfOneEdge) {
  const auto named_parts = [](std::uint32_t n) {
    Mesh mesh = on_one_edge(n, Apexes::anywhere);
    mesh.group_names = {"a", "b"};
    for (std::uint32_t t = 0; t < n; ++t) mesh.groups.push_back(t % 2);
    return mesh;
  };
  EXPECT_LE(growth(
                [&](std::uint32_t n) {
                  const Mesh mesh = on_one_edge(n, Apexes::anywhere);
                  fit_normals(turned(mesh), mesh);
                },
                8000),
            kTreeGrowth);
  EXPECT_LE(growth(
                [&](std::uint32_t n) {
                  Mesh low = turned(on_one_edge(n, Apexes::anywhere));
                  transfer_labels(named_parts(n), low);
                },
                8000),
            kTreeGrowth);
  EXPECT_LE(growth(
                [&](std::uint32_t n) {
                  const Mesh mesh = on_one_edge(n, Apexes::anywhere), low = turned(mesh);
                  const SurfaceDistance surface(mesh.positions, mesh.triangles);
                  low_to_high_distance(surface, low.positions, low.triangles);
                  one_sided_distance(low.positions, low.triangles, surface, 4 * n);
                },
                8000),
            kTreeGrowth);
}

/// Open sides that all end at one vertex: the search for a small hole's rim stops there.
TEST(Counted, SmallHolesAtOneVertex) {
  EXPECT_LE(growth([&](std::uint32_t n) {
              Mesh mesh = needles(n);
              for (std::uint32_t t = 0; t < n; ++t) {
                mesh.positions[std::size_t{3} * t] = {0, 0, 0};
                mesh.triangles[t][0] = 0;
              }
              EXPECT_EQ(fill_small_holes(mesh, 1).count, 0U);
            }),
            1.1);
}

}  // namespace
}  // namespace kiln
