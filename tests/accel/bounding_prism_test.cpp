// Bounding prisms of nodes change no answer: trees with and without them, every bit compared.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "accel/bvh.h"
#include "accel/bvh_nodes.h"
#include "accel/device_bvh.h"
#include "closest_scene.h"
#include "kiln/render.h"
#include "support/crowded.h"
#include "support/ray_scene.h"

namespace kiln::test {
namespace {

struct Pile {
  const char* name;
  Scene scene;
};

std::vector<Pile> piles() {
  constexpr std::uint32_t kMany = 1500;
  return {{"shifted", shifted<Scene>(kMany)},
          {"turned", turned<Scene>(kMany)},
          {"slivers", slivers<Scene>(kMany)},
          {"fan", fan<Scene>(3 * kMany)}};
}

/// Rays in all directions, some along the planes of triangles, some from far away.
std::vector<Ray> rays_of(const Scene& scene) {
  std::vector<Ray> rays = random_rays(600, 21);
  for (const float spread : {3.0F, 7.9F, 8.1F, 100.0F}) {
    for (Ray ray : random_rays(100, 22, spread)) {
      const Vec3& to = scene.positions[rays.size() * 7 % scene.positions.size()];
      ray.direction = unit(
          {0.7F * to.x - ray.origin.x, 0.7F * to.y - ray.origin.y, 0.7F * to.z - ray.origin.z});
      rays.push_back(ray);
    }
  }
  PortableRandom random(23);
  for (std::size_t i = 0; i < 1000; ++i) {
    // Towards a point of a triangle's edge: from a point of its plane, from just off it, or from anywhere.
    const std::size_t t = (i * 31) % scene.triangles.size();
    const auto corner = [&](std::size_t k) { return scene.positions[scene.triangles[t][k]]; };
    const Vec3 a = corner(0), b = corner(1), c = corner(2);
    const float w = random.unit(), s = 1 + random.unit(),
                off = i % 3 == 0 ? 0 : random.within(1e-4F);
    const Vec3 at{a.x + w * (b.x - a.x), a.y + w * (b.y - a.y), a.z + w * (b.z - a.z)};
    Vec3 from{at.x + s * (at.x - c.x) + off, at.y + s * (at.y - c.y) - off,
              at.z + s * (at.z - c.z) + off};
    if (i % 2 == 0) from = random.point(1);
    rays.push_back({from, unit({at.x - from.x, at.y - from.y, at.z - from.z}), 0.05F});
  }
  return rays;
}

std::shared_ptr<const Tree> tree_of(const Scene& scene, bool keep) {
  return std::make_shared<const Tree>(context_of(*device()), scene.positions, scene.triangles,
                                      keep);
}

constexpr Traversal kAll[] = {Traversal::cpu, Traversal::cpu_single, Traversal::gpu};

TEST(BoundingPrisms, AreThereWhereBoxesOverlap) {
  for (const Pile& pile : piles()) {
    const Bvh bvh = build_bvh(pile.scene.positions, pile.scene.triangles);
    EXPECT_GT(bvh.prisms, 0u) << pile.name;
    EXPECT_EQ(build_bvh(pile.scene.positions, pile.scene.triangles, false).prisms, 0u) << pile.name;
  }
  for (const Scene& scene : {bumpy_sphere(40, 3, 0.01F), random_soup(20000, 4, 0.02F)}) {
    EXPECT_EQ(build_bvh(scene.positions, scene.triangles).prisms, 0u);
  }
}

/// The nodes and leaves of a tree on the device, as bytes.
std::string bytes_of(const Tree& tree) {
  cl::Context& context = context_of(*device());
  const std::vector<kiln_bvh_node> nodes = tree.nodes.download(context);
  const std::vector<kiln_bvh_block> blocks = tree.blocks.download(context);
  return std::string(reinterpret_cast<const char*>(nodes.data()), nodes.size() * sizeof nodes[0]) +
         std::string(reinterpret_cast<const char*>(blocks.data()),
                     blocks.size() * sizeof blocks[0]);
}

TEST(Tree, OnTheDeviceIsTheOneThatIsBuiltOnTheHost) {
  KILN_REQUIRE_DEVICE();
  std::vector<Scene> scenes = {bumpy_sphere(60, 3, 0.01F), random_soup(3, 4, 0.02F), Scene()};
  for (const Pile& pile : piles()) scenes.push_back(pile.scene);
  for (const Scene& scene : scenes) {
    SCOPED_TRACE(scene.triangles.size());
    for (const bool keep : {false, true}) {
      const Bvh bvh = build_bvh(scene.positions, scene.triangles, !keep);
      const auto tree = tree_of(scene, keep);
      const std::string host =
          std::string(reinterpret_cast<const char*>(bvh.nodes().data()), bvh.nodes().size_bytes()) +
          std::string(reinterpret_cast<const char*>(bvh.blocks().data()),
                      bvh.blocks().size_bytes());
      EXPECT_TRUE(bytes_of(*tree) == host);
      EXPECT_EQ(tree->stats.nodes, bvh.node_count);
      EXPECT_EQ(tree->stats.bytes, host.size());
      EXPECT_EQ(tree->stats.triangles, bvh.triangles);
      EXPECT_EQ(tree->stats.duplicates, bvh.duplicates);
      EXPECT_EQ(tree->stats.leaves_per_line, bvh.leaves_per_line);
      EXPECT_EQ(tree->defines().empty(), bvh.prisms != 0);
    }
  }
}

TEST(Tree, PartsAreFreedAsTheyAreJoined) {
  const Scene scene = bumpy_sphere(120, 3, 0.01F);
  bvh::TreeParts parts = bvh::build_parts(scene.positions, scene.triangles, true);
  ASSERT_GT(parts.subtrees.size(), 1U);
  std::vector<kiln_bvh_node> nodes(parts.node_count());
  std::vector<kiln_bvh_block> blocks(parts.block_count());
  parts.join(nodes, blocks);
  for (const bvh::Subtree& subtree : parts.subtrees) {
    EXPECT_EQ(subtree.nodes.capacity(), 0U);
    EXPECT_EQ(subtree.blocks.capacity(), 0U);
  }
}

TEST(BoundingPrisms, ChangeNoRay) {
  KILN_REQUIRE_DEVICE();
  for (const Pile& pile : piles()) {
    const std::vector<Ray> rays = rays_of(pile.scene);
    const auto with = tree_of(pile.scene, false), without = tree_of(pile.scene, true);
    for (const Traversal traversal : kAll) {
      const RayCaster with_prisms(context_of(*device()), with, traversal);
      const RayCaster plain(context_of(*device()), without, traversal);
      for (const RayCase& entry : all_queries()) {
        EXPECT_TRUE(cast(with_prisms, rays, entry.query) == cast(plain, rays, entry.query))
            << pile.name << ", " << entry.name << ", " << static_cast<int>(traversal);
      }
    }
  }
}

TEST(BoundingPrisms, ChangeNoOcclusion) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*device());
  for (const Pile& pile : piles()) {
    const std::vector<Ray> rays = rays_of(pile.scene);
    const auto count = static_cast<std::uint32_t>(rays.size());
    const std::vector<float> planes = planes_of(rays, count);
    const cl::Array<float> points(context, std::span<const float>(planes));
    const auto with = tree_of(pile.scene, false), without = tree_of(pile.scene, true);
    for (const Traversal traversal : kAll) {
      const auto hits = [&](const std::shared_ptr<const Tree>& tree, const RayQuery& query) {
        cl::Array<std::uint8_t> hit(context, count);
        RayCaster(context, tree, traversal).occluded(points, count, count, query, hit);
        return hit.download(context);
      };
      for (const float t_max : {0.01F, 0.3F, 20.0F}) {
        for (const bool two_sided : {false, true}) {
          const RayQuery query{.t_min = 1e-4F, .t_max = t_max, .two_sided = two_sided};
          EXPECT_TRUE(hits(with, query) == hits(without, query))
              << pile.name << ", " << t_max << ", " << static_cast<int>(traversal);
        }
      }
    }
  }
}

TEST(BoundingPrisms, ChangeNoClosestPoint) {
  KILN_REQUIRE_DEVICE();
  for (const Pile& pile : piles()) {
    const std::vector<Ray> samples = rays_of(pile.scene);
    const auto with = tree_of(pile.scene, false), without = tree_of(pile.scene, true);
    for (const Traversal traversal : kAll) {
      const ClosestFinder with_prisms(context_of(*device()), with, traversal);
      const ClosestFinder plain(context_of(*device()), without, traversal);
      for (const float distance : {0.05F, 10.0F}) {
        for (const bool two_sided : {false, true}) {
          const ClosestQuery query{.max_distance = distance, .two_sided = two_sided};
          EXPECT_TRUE(find(with_prisms, samples, query) == find(plain, samples, query))
              << pile.name << ", " << distance << ", " << static_cast<int>(traversal);
        }
      }
    }
  }
}

}  // namespace
}  // namespace kiln::test
