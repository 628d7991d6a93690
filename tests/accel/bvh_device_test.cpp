// The BVH that kernels build: its structure, degenerate input, determinism, and that no result depends on the builder.
#include "accel/bvh_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "accel/bvh.h"
#include "cl/tuning.h"
#include "closest_scene.h"
#include "kiln/error.h"
#include "support/crowded.h"
#include "support/ray_scene.h"

namespace kiln::test {
namespace {

cl::Context& context() { return context_of(*device()); }

std::optional<bvh::DeviceParts> build(const Scene& scene, const bvh::DeviceLimits& limits = {}) {
  return bvh::build_on_device(context(), scene.positions, scene.triangles, limits);
}

/// A device's tree, in the host's memory.
struct Download {
  std::vector<kiln_bvh_node> nodes;
  std::vector<kiln_bvh_block> blocks;
  explicit Download(const bvh::DeviceParts& parts)
      : nodes(parts.nodes.download(context())), blocks(parts.blocks.download(context())) {}
};

/// Walks a tree: each child is used once, boxes hold what is below them, leaves hold their triangles.
struct Walk {
  const Download& tree;
  const Scene& scene;
  std::vector<int> seen = std::vector<int>(scene.triangles.size());
  std::vector<int> node_uses = std::vector<int>(tree.nodes.size());
  std::vector<int> block_uses = std::vector<int>(tree.blocks.size());
  std::uint32_t depth = 0;

  void leaf(std::uint32_t index, const kiln_bvh_node& node, int child) {
    ASSERT_LT(index, tree.blocks.size());
    ++block_uses[index];
    const kiln_bvh_block& block = tree.blocks[index];
    ASSERT_NE(block.triangle[0], KILN_NO_TRIANGLE);
    float lo[3], hi[3];
    std::fill(lo, lo + 3, std::numeric_limits<float>::infinity());
    std::fill(hi, hi + 3, -std::numeric_limits<float>::infinity());
    for (int lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
      const bool is_used = block.triangle[lane] != KILN_NO_TRIANGLE;
      const std::uint32_t triangle = block.triangle[is_used ? lane : 0];
      ASSERT_LT(triangle, scene.triangles.size());
      if (is_used) ++seen[triangle];
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const Vec3& p = scene.positions[scene.triangles[triangle][is_used ? corner : 0]];
        const float axes[3] = {p.x, p.y, p.z};
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_EQ(block.corner[corner][axis][lane], axes[axis]);
          lo[axis] = std::min(lo[axis], axes[axis]);
          hi[axis] = std::max(hi[axis], axes[axis]);
        }
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(node.planes[axis][0][child], lo[axis] - KILN_BVH_EPSILON);
      EXPECT_EQ(node.planes[axis][1][child], hi[axis] + KILN_BVH_EPSILON);
    }
  }

  void node(std::uint32_t index, std::uint32_t level) {
    ASSERT_LT(index, tree.nodes.size());
    ++node_uses[index];
    depth = std::max(depth, level);
    const kiln_bvh_node& node = tree.nodes[index];
    for (int i = 0; i < KILN_BVH_WIDTH; ++i) {
      ASSERT_EQ(node.pad[i], 0u);
      const std::uint32_t child = node.child[i];
      if (node.planes[0][0][i] > node.planes[0][1][i]) {
        EXPECT_EQ(child, KILN_BVH_LEAF);
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_EQ(node.planes[axis][0][i], std::numeric_limits<float>::infinity());
          EXPECT_EQ(node.planes[axis][1][i], -std::numeric_limits<float>::infinity());
        }
        continue;
      }
      if ((child & KILN_BVH_LEAF) != 0) {
        leaf(child & ~KILN_BVH_LEAF, node, i);
        continue;
      }
      ASSERT_GT(child, index);
      ASSERT_LT(child, tree.nodes.size());
      const kiln_bvh_node& below = tree.nodes[child];
      for (int axis = 0; axis < 3; ++axis) {
        float lo = std::numeric_limits<float>::infinity(), hi = -lo;
        for (int j = 0; j < KILN_BVH_WIDTH; ++j) {
          lo = std::min(lo, below.planes[axis][0][j]);
          hi = std::max(hi, below.planes[axis][1][j]);
        }
        EXPECT_EQ(node.planes[axis][0][i], lo);
        EXPECT_EQ(node.planes[axis][1][i], hi);
      }
      this->node(child, level + 1);
    }
  }
};

/// The triangles in the host's tree; of equal ones the lowest.
std::vector<int> host_triangles(const Scene& scene, const Bvh& tree) {
  std::vector<int> seen(scene.triangles.size());
  for (const kiln_bvh_block& block : tree.blocks()) {
    for (const std::uint32_t triangle : block.triangle) {
      if (triangle != KILN_NO_TRIANGLE) ++seen[triangle];
    }
  }
  return seen;
}

/// Limits without that of crowded leaves, and also without that of depth, which is the stacks' of searches.
const bvh::DeviceLimits kCrowded{.leaves_per_line = std::numeric_limits<double>::infinity()};
const bvh::DeviceLimits kDeep{.depth = 100, .leaves_per_line = kCrowded.leaves_per_line};

void check(const Scene& scene, const bvh::DeviceLimits& limits = {}) {
  const std::optional<bvh::DeviceParts> parts = build(scene, limits);
  ASSERT_TRUE(parts.has_value());
  const Download tree(*parts);
  const Bvh host = build_bvh(scene.positions, scene.triangles);
  EXPECT_EQ(parts->triangles, host.triangles);
  EXPECT_EQ(parts->skipped, host.skipped);
  EXPECT_EQ(parts->duplicates, host.duplicates);
  Walk walk{tree, scene};
  walk.node(0, 1);
  EXPECT_EQ(walk.depth, parts->depth);
  EXPECT_EQ(walk.seen, host_triangles(scene, host));
  EXPECT_TRUE(
      std::all_of(walk.node_uses.begin(), walk.node_uses.end(), [](int n) { return n == 1; }));
  EXPECT_TRUE(
      std::all_of(walk.block_uses.begin(), walk.block_uses.end(), [](int n) { return n == 1; }));
}

TEST(DeviceBvh, HoldsEachTriangleOnceWithinItsBoxes) {
  KILN_REQUIRE_DEVICE();
  for (std::size_t count :
       {1u, 2u, 3u, 4u, 5u, 6u, 8u, 9u, 31u, 32u, 33u, 63u, 65u, 1000u, 1024u, 1025u, 20000u}) {
    SCOPED_TRACE(count);
    check(random_soup(count, static_cast<unsigned>(count), 0.02F));
  }
  check(bumpy_sphere(100, 3, 0.01F));
}

/// Selects who builds trees, until the end of a scope.
class WithBuilder {
 public:
  explicit WithBuilder(bool on_device) : before_(context().tuning()) {
    cl::Tuning tuning = before_;
    tuning.min_device_build_triangles = on_device ? 0 : cl::Tuning::kNever;
    context().set_tuning(tuning);
  }
  ~WithBuilder() { context().set_tuning(before_); }
  WithBuilder(const WithBuilder&) = delete;
  WithBuilder& operator=(const WithBuilder&) = delete;

 private:
  cl::Tuning before_;
};

/// The tree of each builder; the device's even if leaves are crowded.
std::shared_ptr<const Tree> tree_by(bool on_device, const Scene& scene) {
  if (!on_device) {
    const WithBuilder builder(false);
    return tree_of(scene);
  }
  std::optional<bvh::DeviceParts> parts = build(scene, kCrowded);
  if (!parts) {
    ADD_FAILURE() << "the device cannot build the tree";
    return tree_of(scene);
  }
  const Download tree(*parts);
  Tree::Stats stats;
  stats.triangles = parts->triangles;
  return std::make_shared<const Tree>(
      context(), stats, /*has_prisms=*/false, tree.nodes.size(), tree.blocks.size(),
      [&](std::span<kiln_bvh_node> nodes, std::span<kiln_bvh_block> blocks) {
        std::copy(tree.nodes.begin(), tree.nodes.end(), nodes.begin());
        std::copy(tree.blocks.begin(), tree.blocks.end(), blocks.begin());
      });
}

/// The same triangles several times each: as copies, turned, and the other way round.
Scene repeated_triangles() {
  Scene scene = random_soup(400, 3, 0.2F);
  const Vec3 a{0, 0, 0}, b{0.5F, 0, 0}, c{0, 0.5F, 0};
  for (int i = 0; i < 900; ++i) {
    scene.add(a, b, c);
    scene.add(b, c, a);
    scene.add(a, c, b);
  }
  for (std::size_t i = 0; i < 200; ++i) scene.triangles.push_back(scene.triangles[5 * i]);
  return scene;
}

Scene concentric_triangles(int count) {
  Scene scene;
  for (int i = 0; i < count; ++i) {
    const float r = 0.4F / static_cast<float>(count) * static_cast<float>(i + 1);
    scene.add({-r, -r, 0}, {r, -r, 0}, {0, 2 * r, 0});
  }
  return scene;
}

TEST(DeviceBvh, DropsDuplicatesAsTheHostDoes) {
  KILN_REQUIRE_DEVICE();
  Scene same;
  for (int i = 0; i < 50000; ++i) same.add({0, 0, 0}, {0.5F, 0, 0}, {0, 0.5F, 0});
  check(same);
  EXPECT_EQ(build(same)->triangles, 1U);
  check(repeated_triangles());
  // Zeros of either sign are equal.
  Scene zeros;
  zeros.add({0, 0, 0}, {0.5F, 0, 0}, {0, 0.5F, 0});
  zeros.add({-0.0F, 0, -0.0F}, {0.5F, -0.0F, 0}, {0, 0.5F, -0.0F});
  check(zeros);
  EXPECT_EQ(build(zeros)->duplicates, 1U);
}

TEST(DeviceBvh, TakesBoxesWithOneCentre) {
  KILN_REQUIRE_DEVICE();
  check(concentric_triangles(20000), kDeep);
  Scene series;
  for (int i = 0; i < 120; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const float r = std::ldexp(1.0F, -i);
      series.add({axis == 0 ? r : 0, axis == 1 ? r : 0, axis == 2 ? r : 0},
                 {axis == 0 ? r : r / 4, axis == 1 ? r : 0, axis == 2 ? r : 0},
                 {axis == 0 ? r : 0, axis == 1 ? r : r / 4, axis == 2 ? r : r / 4});
    }
  }
  check(series, kDeep);
}

/// Number of commands grows with the logarithm of the triangles even if each cluster's best partner is its neighbour on
/// one side, so that one pair alone would merge at a time.
TEST(DeviceBvh, ChainsOfOneSidedChoicesEnd) {
  KILN_REQUIRE_DEVICE();
  const auto commands_of = [](const Scene& scene) {
    const std::uint64_t before = context().commands();
    EXPECT_TRUE(build(scene, kDeep).has_value());
    return context().commands() - before;
  };
  const std::uint64_t usual = commands_of(random_soup(20000, 1, 0.01F));
  EXPECT_LT(commands_of(concentric_triangles(20000)), 2 * usual);
}

/// Whether a triangle has an area is decided in double precision on the host.
TEST(DeviceBvh, SkipsExactlyTheTrianglesThatTheHostSkips) {
  KILN_REQUIRE_DEVICE();
  Scene scene = random_soup(300, 5, 0.1F);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  scene.add({nan, 0, 0}, {1, 0, 0}, {0, 1, 0});
  scene.add({0, 0, 0}, {1, 0, infinity}, {0, 1, 0});
  scene.add({0, 0, 0}, {0, 0, 0}, {0, 1, 0});
  scene.add({0, 0, 0}, {0, 1, 0}, {0, 0, 0});
  scene.add({0, 1, 0}, {0, 0, 0}, {0, 0, 0});
  scene.add({0, 0, 0}, {0.25F, 0.5F, 0.125F}, {0.5F, 1, 0.25F});  // on one line, exactly
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-0.4F, 0.4F);
  std::uniform_int_distribution<int> exponent(-40, 0);
  for (int i = 0; i < 3000; ++i) {
    const Vec3 a{place(random), place(random), place(random)};
    const Vec3 b{place(random), place(random), place(random)};
    // nearly on the line from a to b
    const float t = place(random);
    Vec3 c{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
    if (i % 3 == 0) c.x += std::ldexp(1.0F, exponent(random));
    scene.add(a, b, c);
    const float size = std::ldexp(1.0F, 3 * exponent(random));  // down to denormals
    scene.add({0, 0, 0}, {size, 0, 0},
              {i % 2 == 0 ? size / 2 : 2 * size, i % 2 == 0 ? size : 0, 0});
  }
  check(scene, kDeep);
}

TEST(DeviceBvh, BadIndexIsTheErrorOfTheHost) {
  KILN_REQUIRE_DEVICE();
  Scene scene = random_soup(100, 5, 0.1F);
  scene.triangles[40][1] = 300;
  scene.triangles[70][2] = 0xFFFFFFFFU;
  const auto message = [](const std::function<void()>& call) {
    try {
      call();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const std::string text = message([&] { build(scene); });
  EXPECT_NE(text.find("Triangle 40"), std::string::npos) << text;
  EXPECT_EQ(text, message([&] { build_bvh(scene.positions, scene.triangles); }));
}

TEST(DeviceBvh, TwoBuildsAreTheSameBytes) {
  KILN_REQUIRE_DEVICE();
  for (const Scene& scene : {random_soup(60000, 9, 0.02F), repeated_triangles()}) {
    const Download a(*build(scene)), b(*build(scene));
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    ASSERT_EQ(a.blocks.size(), b.blocks.size());
    EXPECT_EQ(0, std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof a.nodes[0]));
    EXPECT_EQ(0,
              std::memcmp(a.blocks.data(), b.blocks.data(), a.blocks.size() * sizeof a.blocks[0]));
  }
}

TEST(DeviceBvh, TheHostBuildsWhatTheDeviceCannot) {
  KILN_REQUIRE_DEVICE();
  EXPECT_FALSE(build(Scene{}).has_value());
  Scene point;
  point.add({0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  EXPECT_FALSE(build(point).has_value());
  // Leaves so crowded that bounding prisms pay.
  const Scene crowded = shifted<Scene>(4000);
  EXPECT_GT(build_bvh(crowded.positions, crowded.triangles).prisms, 0U);
  EXPECT_FALSE(build(crowded).has_value());
  EXPECT_TRUE(build(crowded, kCrowded).has_value());
  const Scene soup = random_soup(5000, 3, 0.02F);
  const std::optional<bvh::DeviceParts> parts = build(soup);
  ASSERT_TRUE(parts.has_value());
  EXPECT_TRUE(build(soup, {.depth = parts->depth}).has_value());
  EXPECT_FALSE(build(soup, {.depth = parts->depth - 1}).has_value());
  EXPECT_FALSE(build(soup, {.bytes = 100 * soup.triangles.size()}).has_value());
  // A tree then comes from the host, with no difference but that.
  const WithBuilder builder(true);
  const Tree tree(context(), crowded.positions, crowded.triangles);
  EXPECT_FALSE(tree.stats.built_on_device);
  EXPECT_TRUE(tree.has_prisms());
  EXPECT_EQ(tree.stats.triangles, crowded.triangles.size());
  EXPECT_FALSE(Tree(context(), soup.positions, soup.triangles, /*keep=*/true).stats.built_on_device)
      << "trees that are refitted keep all triangles";
  EXPECT_TRUE(Tree(context(), soup.positions, soup.triangles).stats.built_on_device);
}

/// The device builds trees of at least as many triangles as its tuning says.
TEST(DeviceBvh, SmallTreesComeFromTheHost) {
  KILN_REQUIRE_DEVICE();
  const WithBuilder restored(false);
  cl::Tuning tuning = context().tuning();
  tuning.min_device_build_triangles = 1000;
  context().set_tuning(tuning);
  EXPECT_FALSE(tree_of(random_soup(999, 1, 0.1F))->stats.built_on_device);
  EXPECT_TRUE(tree_of(random_soup(1000, 1, 0.1F))->stats.built_on_device);
}

/// Coplanar triangles of all sizes that overlap, so that rays and points have many equal answers.
Scene ties() {
  Scene scene = repeated_triangles();
  std::mt19937 random(12);
  std::uniform_int_distribution<int> grid(-4, 4), sides(1, 4);
  for (int i = 0; i < 1500; ++i) {
    const auto eighths = [](int n) { return static_cast<float>(n) / 8; };
    const float x = eighths(grid(random)), y = eighths(grid(random));
    const float w = eighths(sides(random)), h = eighths(sides(random));
    const float z = i % 2 == 0 ? 0.25F : -0.25F;
    const Vec3 corners[] = {{x - w, y - h, z}, {x + w, y - h, z}, {x, y + h, z}};
    scene.add(corners[0], corners[i % 3 == 0 ? 1 : 2], corners[i % 3 == 0 ? 2 : 1]);
  }
  return scene;
}

TEST(DeviceBvh, NoSearchDependsOnTheBuilder) {
  KILN_REQUIRE_DEVICE();
  std::vector<RayCase> queries = all_queries();
  queries.push_back({"outermost, limited",
                     {.t_min = -0.3F,
                      .t_max = 0.3F,
                      .two_sided = true,
                      .outermost = true,
                      .has_ray_limits = true}});
  std::vector<std::vector<Ray>> samples = {random_rays(4000, 9), coherent_rays(4096, 11, 0.02F)};
  // Straight at coplanar triangles, at places where all products are exact
  std::mt19937 random(3);
  std::uniform_int_distribution<int> step(-32, 31);
  samples.emplace_back(4000);
  for (Ray& ray : samples.back()) {
    const auto place = [&] { return static_cast<float>(2 * step(random) + 1) / 128; };
    const float x = place();
    ray = {{x, place(), 0}, {0, 0, 1}, 0.3F};
  }
  for (const Scene& scene : {random_soup(3000, 7, 0.1F), bumpy_sphere(60, 8, 0.01F), ties(),
                             concentric_triangles(500)}) {
    const auto host = tree_by(false, scene), device = tree_by(true, scene);
    for (const Traversal traversal : {Traversal::cpu, Traversal::cpu_single, Traversal::gpu}) {
      const RayCaster host_caster(context(), host, traversal);
      const RayCaster device_caster(context(), device, traversal);
      const ClosestFinder host_finder(context(), host, traversal);
      const ClosestFinder device_finder(context(), device, traversal);
      for (const std::vector<Ray>& rays : samples) {
        for (const RayCase& entry : queries) {
          SCOPED_TRACE(entry.name);
          const Cast wanted = cast(host_caster, rays, entry.query);
          EXPECT_TRUE(cast(device_caster, rays, entry.query) == wanted);
          if (entry.query.has_ray_limits) continue;
          EXPECT_EQ(occluded(device_caster, rays, entry.query),
                    occluded(host_caster, rays, entry.query));
        }
        for (const bool two_sided : {false, true}) {
          const ClosestQuery query{0.4F, two_sided};
          EXPECT_TRUE(find(device_finder, rays, query) == find(host_finder, rays, query));
        }
      }
    }
  }
}

TEST(DeviceBvh, TakesAMillionTriangles) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = bumpy_sphere(501, 3, 0.0005F);
  ASSERT_GT(scene.triangles.size(), 1000000U);
  const auto host = tree_by(false, scene), device = tree_by(true, scene);
  EXPECT_EQ(device->stats.triangles, host->stats.triangles);
  const std::vector<Ray> rays = coherent_rays(20000, 5, 0.02F);
  const RayQuery query{.t_min = -0.1F, .t_max = 0.1F, .outward_first = true};
  const Cast wanted = cast(RayCaster(context(), host), rays, query);
  EXPECT_TRUE(cast(RayCaster(context(), device), rays, query) == wanted);
  EXPECT_GT(std::count_if(wanted.triangle.begin(), wanted.triangle.end(),
                          [](std::uint32_t t) { return t != KILN_NO_TRIANGLE; }),
            10000);
}

/// Cost of a tree by the surface area heuristic: the expected number of boxes and triangles that a random ray tests.
double cost_of(std::span<const kiln_bvh_node> nodes) {
  double cost = 0;
  const auto half_area = [](const kiln_bvh_node& node, int child) {
    double size[3];
    for (int axis = 0; axis < 3; ++axis)
      size[axis] = double{node.planes[axis][1][child]} - double{node.planes[axis][0][child]};
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  };
  double root[3][2] = {{1e9, -1e9}, {1e9, -1e9}, {1e9, -1e9}};
  for (const kiln_bvh_node& node : nodes) {
    for (int child = 0; child < KILN_BVH_WIDTH; ++child) {
      if (node.planes[0][0][child] > node.planes[0][1][child]) continue;
      cost += half_area(node, child);
      for (int axis = 0; axis < 3; ++axis) {
        root[axis][0] = std::min(root[axis][0], double{node.planes[axis][0][child]});
        root[axis][1] = std::max(root[axis][1], double{node.planes[axis][1][child]});
      }
    }
  }
  const double x = root[0][1] - root[0][0], y = root[1][1] - root[1][0],
               z = root[2][1] - root[2][0];
  return cost / (x * y + y * z + z * x);
}

/// Trees that are correct but bad would pass all tests above.
TEST(DeviceBvh, CostsRaysLittleMoreThanTheHostsTree) {
  KILN_REQUIRE_DEVICE();
  for (const Scene& scene : {random_soup(20000, 3, 0.02F), bumpy_sphere(200, 4, 0.002F)}) {
    const std::optional<bvh::DeviceParts> parts = build(scene);
    ASSERT_TRUE(parts.has_value());
    const Bvh host = build_bvh(scene.positions, scene.triangles);
    EXPECT_LT(cost_of(parts->nodes.download(context())), 1.25 * cost_of(host.nodes()));
    EXPECT_NEAR(parts->leaves_per_line / host.leaves_per_line, 1, 0.3);
  }
}

}  // namespace
}  // namespace kiln::test
