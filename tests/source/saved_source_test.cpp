// A saved source (.kilnsrc): bakes from it have the bytes of bakes from the mesh, and damaged files are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asset/saved_mesh.h"
#include "base/byte_hash.h"
#include "kiln/files.h"
#include "kiln/job.h"
#include "shared/bvh.h"
#include "source/high_poly.h"
#include "source/saved_tree.h"
#include "support/crowded.h"
#include "support/environment.h"
#include "support/mesh_check.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

void write_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// An OBJ with two objects, of two materials, one of which is turned inside out.
fs::path write_high(const fs::path& folder) {
  std::ofstream file(folder / "high.obj");
  std::uint32_t first = 1;
  const auto add = [&](const Mesh& mesh, const char* name, float x, bool turned) {
    file << "o " << name << "\nusemtl paint_" << name << "\n";
    for (const Vec3& p : mesh.positions)
      file << "v " << p.x + x << " " << p.y << " " << p.z << "\n";
    for (const Triangle& t : mesh.triangles) {
      file << "f " << first + t[0] << " " << first + t[turned ? 2 : 1] << " "
           << first + t[turned ? 1 : 2] << "\n";
    }
    first += static_cast<std::uint32_t>(mesh.positions.size());
  };
  add(test::BumpySphere::dense(4000), "near", 0, false);
  add(test::BumpySphere::dense(1000), "far", 3, true);
  return folder / "high.obj";
}

Job job_of(const fs::path& high, const fs::path& folder) {
  save_obj(test::BumpySphere::light(), folder / "low.obj");
  Job job;
  job.high = {high.string()};
  job.low.given = {(folder / "low.obj").string()};
  job.out = (folder / "maps").string();
  job.bake.width = job.bake.height = 128;
  job.bake.maps = {find_map("normal").kind, find_map("ao").kind, find_map("id").kind};
  return job;
}

std::vector<std::string> bake_files(const Job& job) {
  std::vector<std::string> bytes;
  for (const std::string& file : run(*test::device(), job).files) {
    if (!is_saved_source_name(file)) bytes.push_back(test::read_file(file));
  }
  return bytes;
}

class SavedSource : public testing::Test {
 protected:
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    folder_ = test::scratch_folder();
    Job job = job_of(write_high(folder_), folder_);
    saved_ = folder_ / "high.kilnsrc";
    job.save_source = saved_.string();
    expected_ = bake_files(job);
  }

  /// Bakes from the saved source with changed bytes. \returns the error's text; empty if it bakes
  std::string error_with(const std::string& bytes) {
    const fs::path file = folder_ / "changed.kilnsrc";
    write_bytes(file, bytes);
    try {
      run(*test::device(), job_of(file, folder_));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      EXPECT_NE(std::string(error.what()).find("changed.kilnsrc"), std::string::npos)
          << error.what();
      return error.what();
    }
    return {};
  }

  fs::path folder_, saved_;
  std::vector<std::string> expected_;
};

TEST_F(SavedSource, BakesTheSameBytes) {
  ASSERT_EQ(expected_.size(), 3U);
  EXPECT_EQ(bake_files(job_of(saved_, folder_)), expected_);
}

// The tree is that of the repaired mesh: without repairs, it does not fit, and another is built.
TEST_F(SavedSource, BakesTheSameBytesWithOtherOptions) {
  Job from_mesh = job_of(folder_ / "high.obj", folder_);
  Job from_saved = job_of(saved_, folder_);
  for (Job* job : {&from_mesh, &from_saved}) {
    job->clean = CleanHigh::none;
    job->given.insert("--clean");
    job->bake.match.method = find_match("closest").method;
  }
  EXPECT_EQ(bake_files(from_saved), bake_files(from_mesh));
}

TEST_F(SavedSource, HasTheMeshAsItWasRead) {
  const Mesh mesh = load_mesh(folder_ / "high.obj");
  const Mesh saved = load_mesh(saved_);
  EXPECT_EQ(test::broken_promise(saved), "");
  EXPECT_EQ(saved.positions, mesh.positions);
  EXPECT_EQ(saved.triangles, mesh.triangles);
  EXPECT_EQ(saved.objects, mesh.objects);
  EXPECT_EQ(saved.object_names, mesh.object_names);
  EXPECT_EQ(saved.materials, mesh.materials);
  EXPECT_EQ(saved.material_names, mesh.material_names);
  EXPECT_EQ(saved.name, "high");
}

// Whoever saves and whoever bakes from the file is told that materials are missing.
TEST_F(SavedSource, WarnsOfMaterialsThatItHasNot) {
  Job saving = job_of(folder_ / "high.obj", folder_);
  saving.save_source = (folder_ / "again.kilnsrc").string();
  saving.bake.maps = {find_map("normal").kind};
  Job baking = job_of(saved_, folder_);
  baking.bake.maps = saving.bake.maps;
  Job neither = job_of(folder_ / "high.obj", folder_);
  neither.bake.maps = saving.bake.maps;
  const auto warns = [](const Job& job) {
    const std::vector<Warning> warnings = run(*test::device(), job).warnings;
    return std::count_if(warnings.begin(), warnings.end(), [](const Warning& warning) {
      return warning.code == "unsaved-materials" && warning.count == 2;
    });
  };
  EXPECT_EQ(warns(saving), 1);
  EXPECT_EQ(warns(baking), 1);
  EXPECT_EQ(warns(neither), 0);
}

TEST_F(SavedSource, TreeFitsItsTrianglesAlone) {
  const SavedTree tree(saved_, saved_mesh_end(saved_));
  const Mesh mesh = load_mesh(saved_);
  EXPECT_FALSE(tree.fits(mesh.positions, mesh.triangles));  // not in the working frame
}

TEST_F(SavedSource, DamagedFilesAreRefused) {
  const std::string whole = test::read_file(saved_);
  const std::size_t tree = saved_mesh_end(saved_);
  for (const std::size_t length : {std::size_t{0}, std::size_t{7}, std::size_t{31}, std::size_t{32},
                                   tree / 2, tree, tree + 8, tree + 100, whole.size() - 1}) {
    EXPECT_NE(error_with(whole.substr(0, length)), "") << length;
  }
  EXPECT_NE(error_with(whole + "x"), "");
  for (const std::size_t place :
       {std::size_t{0}, std::size_t{8}, std::size_t{17}, std::size_t{25}, tree / 2, tree + 1,
        tree + 20, tree + 30, (tree + whole.size()) / 2, whole.size() - 3}) {
    std::string changed = whole;
    changed[place] = static_cast<char>(changed[place] ^ 0x10);
    EXPECT_NE(error_with(changed), "") << place;
  }
}

// A file that is not damaged but made so: its hashes are right.
TEST_F(SavedSource, MadeUpMeshesAreRefused) {
  const std::string whole = test::read_file(saved_);
  const std::size_t end = saved_mesh_end(saved_);
  const auto with = [&](std::size_t place, std::uint64_t value, std::size_t size) {
    std::string changed = whole;
    std::memcpy(&changed[32 + place], &value, size);
    const std::uint64_t hash = hash_bytes(std::string_view(changed).substr(32, end - 32));
    std::memcpy(&changed[24], &hash, sizeof hash);
    return changed;
  };
  constexpr std::size_t kPositions = 3 * 8 + 8 + 4;
  const Mesh mesh = load_mesh(saved_);
  const std::size_t triangles = kPositions + 8 + mesh.positions.size() * sizeof(Vec3);
  EXPECT_EQ(error_with(with(kPositions, mesh.positions.size(), 8)), "");
  EXPECT_NE(error_with(with(kPositions, mesh.positions.size() - 1, 8)), "");
  EXPECT_NE(error_with(with(kPositions, ~std::uint64_t{0}, 8)), "");
  EXPECT_NE(error_with(with(triangles, 0, 8)), "");
  EXPECT_NE(error_with(with(triangles + 8, 0xFFFFFFFF, 4)), "");
}

std::vector<kiln_bvh_node> nodes_of(std::size_t count) {
  std::vector<kiln_bvh_node> nodes(count);
  for (kiln_bvh_node& node : nodes) {
    for (std::uint32_t& child : node.child) child = KILN_BVH_LEAF;
  }
  return nodes;
}

TEST(SavedTreeCheck, IndicesOfMadeUpTreesAreChecked) {
  std::vector<kiln_bvh_node> nodes = nodes_of(4);
  std::vector<kiln_bvh_block> blocks(2);
  for (kiln_bvh_block& block : blocks) {
    for (std::uint32_t& triangle : block.triangle) triangle = 9;
  }
  const auto problem = [&](bool prisms = true) { return tree_problem(nodes, blocks, prisms, 10); };
  const auto problem_with = [&](std::size_t node, std::uint32_t child, bool prisms = true) {
    const std::uint32_t before = std::exchange(nodes[node].child[3], child);
    const std::string found = problem(prisms);
    nodes[node].child[3] = before;
    return found;
  };
  nodes[0].child[0] = 1;
  nodes[1].child[0] = KILN_BVH_PRISM | 2;
  EXPECT_EQ(problem(), "");
  EXPECT_NE(problem(false), "");
  EXPECT_NE(problem_with(1, 0), "");                   // the root again
  EXPECT_NE(problem_with(1, 1), "");                   // itself
  EXPECT_NE(problem_with(3, 1), "");                   // a node before it
  EXPECT_NE(problem_with(0, 3), "");                   // a second parent
  EXPECT_NE(problem_with(0, 4), "");                   // beyond the nodes
  EXPECT_NE(problem_with(0, KILN_BVH_PRISM | 3), "");  // a prism without its node
  EXPECT_NE(problem_with(0, KILN_BVH_LEAF | 2), "");
  blocks[1].triangle[2] = KILN_NO_TRIANGLE;
  EXPECT_EQ(problem(), "");
  blocks[1].triangle[2] = 10;
  EXPECT_NE(problem(), "");
  std::vector<kiln_bvh_node> chain = nodes_of(KILN_BVH_MAX_DEPTH + 1);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i)
    chain[i].child[0] = static_cast<std::uint32_t>(i + 1);
  blocks[1].triangle[2] = 0;
  EXPECT_NE(tree_problem(chain, blocks, true, 10), "");
  chain.pop_back();
  chain.back().child[0] = KILN_BVH_LEAF;
  EXPECT_EQ(tree_problem(chain, blocks, true, 10), "");
  EXPECT_NE(tree_problem({}, blocks, true, 10), "");
  EXPECT_NE(tree_problem(nodes, {}, true, 10), "");
}

/// A mesh with triangles that searches leave out: without area, and equal to others. \param crowded  true: its boxes
/// overlap, so that its tree has prisms
Mesh mesh_with_left_out(bool crowded) {
  Mesh mesh = test::BumpySphere::dense(3000);
  if (crowded) {
    const auto slivers = test::slivers<test::Soup>(3000);
    mesh = Mesh();
    mesh.positions = slivers.positions;
    mesh.triangles = slivers.triangles;
  }
  mesh.triangles.push_back({4, 4, 5});
  for (std::size_t t = 0; t < 3; ++t) mesh.triangles.push_back(mesh.triangles[7 * t]);
  return mesh;
}

/// A tree in a file has all values of the tree that was built, and it is found for its own triangles alone.
TEST(SavedTreeFile, TreesComeBackWhole) {
  KILN_REQUIRE_DEVICE();
  bool had_prisms = false;
  for (const bool crowded : {false, true}) {
    const Source source(*test::device(), mesh_with_left_out(crowded));
    const Source::Impl& impl = impl_of(source);
    const fs::path path = test::scratch_folder() / "tree";
    {
      AtomicFile file(path);
      impl.save_tree([&](const void* data, std::size_t bytes) { file.write(data, bytes); });
      file.commit();
    }
    const SavedTree saved(path, 0);
    EXPECT_TRUE(saved.fits(impl.positions, impl.triangles));
    auto triangles = impl.triangles;
    std::swap(triangles[3][0], triangles[3][1]);
    EXPECT_FALSE(saved.fits(impl.positions, triangles));
    auto positions = impl.positions;
    positions.back().z = std::nextafter(positions.back().z, 2.0F);
    EXPECT_FALSE(saved.fits(positions, impl.triangles));
    cl::Context& context = context_of(*test::device());
    const std::shared_ptr<Tree> back = saved.read(context, impl.triangles.size());
    const Tree tree(context, impl.positions, impl.triangles, false);
    EXPECT_EQ(tree.stats.skipped, 1U);
    EXPECT_EQ(tree.stats.duplicates, 3U);
    EXPECT_EQ(back->stats.triangles, tree.stats.triangles);
    EXPECT_EQ(back->stats.skipped, tree.stats.skipped);
    EXPECT_EQ(back->stats.duplicates, tree.stats.duplicates);
    EXPECT_EQ(back->stats.nodes, tree.stats.nodes);
    EXPECT_EQ(back->stats.bytes, tree.stats.bytes);
    EXPECT_EQ(back->stats.leaves_per_line, tree.stats.leaves_per_line);
    EXPECT_GT(tree.stats.leaves_per_line, 0);
    EXPECT_EQ(back->has_prisms(), tree.has_prisms());
    had_prisms = had_prisms || tree.has_prisms();
    const auto same = [](const auto& a, const auto& b) {
      return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
    };
    EXPECT_TRUE(same(back->nodes.download(context), tree.nodes.download(context)));
    EXPECT_TRUE(same(back->blocks.download(context), tree.blocks.download(context)));
  }
  EXPECT_TRUE(had_prisms);
}

/// A session moves the mesh, and its tree is built for that: a saved one is not used.
TEST(SavedTreeFile, IsNotUsedForAMeshThatMoves) {
  KILN_REQUIRE_DEVICE();
  const Mesh mesh = mesh_with_left_out(false);
  const Source whole(*test::device(), mesh);
  const fs::path path = test::scratch_folder() / "tree";
  {
    AtomicFile file(path);
    impl_of(whole).save_tree([&](const void* data, std::size_t bytes) { file.write(data, bytes); });
    file.commit();
  }
  std::string bytes = test::read_file(path);
  bytes.back() =
      static_cast<char>(bytes.back() ^ 1);  // A damaged tree is an error where it is read
  write_bytes(path, bytes);
  for (const bool moves : {false, true}) {
    Source::Impl impl(*test::device(), mesh, Traversal::automatic);
    impl.will_move = moves;
    impl.offer_tree(std::make_shared<SavedTree>(path, 0));
    if (moves) {
      impl.rays();
      EXPECT_EQ(impl.duplicates(), 0U) << "triangles that are equal may part";
    } else {
      EXPECT_THROW(impl.rays(), Error);
    }
  }
}

TEST_F(SavedSource, IsWholeOrAbsent) {
  const fs::path file = folder_ / "cancelled.kilnsrc";
  Job job = job_of(folder_ / "high.obj", folder_);
  job.save_source = file.string();
  const JobResult result =
      run(*test::device(), job, [](double share, std::string_view) { return share < 0.5; });
  EXPECT_TRUE(result.cancelled);
  EXPECT_FALSE(fs::exists(file));
  for (const auto& entry : fs::directory_iterator(folder_))
    EXPECT_EQ(entry.path().string().find("cancelled"), std::string::npos) << entry.path();
}

TEST_F(SavedSource, WrongUseIsRefused) {
  const auto code = [&](const std::function<void(Job&)>& change) {
    Job job = job_of(saved_, folder_);
    change(job);
    try {
      run(*test::device(), job);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code([&](Job& job) { job.save_source = (folder_ / "x.ply").string(); }),
            ErrorCode::usage);
  EXPECT_EQ(code([&](Job& job) {
              job.in_memory = true;
              job.out = "a.glb";
              job.save_source = (folder_ / "x.kilnsrc").string();
            }),
            ErrorCode::usage);
  EXPECT_EQ(code([&](Job& job) { job.frame.up = {"z"}; }), ErrorCode::input);
}

}  // namespace
}  // namespace kiln
