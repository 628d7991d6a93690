#include "source/saved_tree.h"

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "base/byte_hash.h"
#include "base/option.h"
#include "base/parallel.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr char kTreeMagic[8] = {'k', 'i', 'l', 'n', 'b', 'v', 'h', '1'};
constexpr std::size_t kTreeBytesPerRead = std::size_t{4} << 20;

}  // namespace

std::uint64_t tree_key(std::span<const Vec3> positions, std::span<const Triangle> triangles) {
  return hash_bytes(positions, triangles);
}

std::string tree_problem(std::span<const kiln_bvh_node> nodes,
                         std::span<const kiln_bvh_block> blocks, bool has_prisms,
                         std::uint64_t triangles) {
  // Level of each node, counted from 1. 0: there is no such node, or it is not a child of a node before it
  std::vector<std::uint8_t> levels(nodes.size());
  if (nodes.empty() || blocks.empty()) return "its tree is empty";
  levels[0] = 1;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (levels[i] == 0) continue;
    for (const std::uint32_t child : nodes[i].child) {
      if ((child & KILN_BVH_LEAF) != 0) {
        if ((child & ~KILN_BVH_LEAF) >= blocks.size()) return "a leaf of its tree is missing";
        continue;
      }
      if (!has_prisms && (child & KILN_BVH_PRISM) != 0) return "its tree has an unexpected prism";
      const std::uint32_t node = node_of_child(child);
      if (node <= i || node >= nodes.size() || levels[node] != 0) {
        return "a node of its tree is missing or has two parents";
      }
      levels[node] = static_cast<std::uint8_t>(levels[i] + 1);
      if (levels[node] > KILN_BVH_MAX_DEPTH) return "its tree is too deep";
    }
  }
  for (const kiln_bvh_block& block : blocks) {
    for (const std::uint32_t triangle : block.triangle) {
      if (triangle >= triangles && triangle != KILN_NO_TRIANGLE) {
        return "its tree refers to a triangle that does not exist";
      }
    }
  }
  return {};
}

void write_saved_tree(cl::Context& context, const Tree& tree, std::uint64_t key,
                      const AppendBytes& append) {
  const std::vector<kiln_bvh_node> nodes = tree.nodes.download(context);
  const std::vector<kiln_bvh_block> blocks = tree.blocks.download(context);
  SavedTree::Head head;
  std::memcpy(head.magic, kTreeMagic, sizeof kTreeMagic);
  head.key = key;
  head.hash = hash_bytes(nodes, blocks);
  head.nodes = nodes.size();
  head.blocks = blocks.size();
  head.triangles = tree.stats.triangles;
  head.skipped = tree.stats.skipped;
  head.duplicates = tree.stats.duplicates;
  head.leaves_per_line = tree.stats.leaves_per_line;
  head.has_prisms = tree.has_prisms() ? 1 : 0;
  append(&head, sizeof head);
  append(nodes.data(), nodes.size() * sizeof(kiln_bvh_node));
  append(blocks.data(), blocks.size() * sizeof(kiln_bvh_block));
}

SavedTree::SavedTree(const std::filesystem::path& path, std::uint64_t offset)
    : path_(path),
      file_(open_file(path,
                      [name = path.string()](const std::string& place, const std::string& problem,
                                             const Message& remedy) {
                        throw Error(ErrorCode::input, name + ": " +
                                                          (place.empty() ? "" : place + ": ") +
                                                          problem + ". " + remedy);
                      })),
      offset_(offset) {
  check_head();
}

void SavedTree::check_head() {
  const std::uint64_t size = file_->size();
  if (size < offset_ || size - offset_ < sizeof head_) fail("its search structure cannot be read");
  read_bytes(0, &head_, sizeof head_);
  if (std::memcmp(head_.magic, kTreeMagic, sizeof kTreeMagic) != 0)
    fail("its search structure is damaged");
  const std::uint64_t bytes = size - offset_ - sizeof head_;
  if (head_.nodes > bytes / sizeof(kiln_bvh_node) ||
      head_.blocks > bytes / sizeof(kiln_bvh_block) ||
      head_.nodes * sizeof(kiln_bvh_node) + head_.blocks * sizeof(kiln_bvh_block) != bytes) {
    fail("it is cut short, or followed by other bytes");
  }
}

void SavedTree::fail(const std::string& problem) const {
  throw Error(ErrorCode::input, path_.string() + ": " + problem + ". Save it again with " +
                                    option("save_source") + ".");
}

void SavedTree::read_bytes(std::uint64_t offset, void* to, std::size_t bytes) const {
  parallel_for(bytes, kTreeBytesPerRead, [&](std::size_t begin, std::size_t end) {
    if (file_->read_at(offset_ + offset + begin, static_cast<char*>(to) + begin, end - begin) !=
        end - begin) {
      fail("it cannot be read to its end");
    }
  });
}

bool SavedTree::fits(std::span<const Vec3> positions, std::span<const Triangle> triangles) const {
  return head_.key == tree_key(positions, triangles);
}

std::shared_ptr<Tree> SavedTree::read(cl::Context& context, std::uint64_t triangles) const {
  Tree::Stats stats;
  stats.triangles = head_.triangles;
  stats.skipped = head_.skipped;
  stats.duplicates = head_.duplicates;
  stats.leaves_per_line = head_.leaves_per_line;
  return std::make_shared<Tree>(
      context, stats, head_.has_prisms != 0, static_cast<std::size_t>(head_.nodes),
      static_cast<std::size_t>(head_.blocks),
      [&](std::span<kiln_bvh_node> nodes, std::span<kiln_bvh_block> blocks) {
        read_bytes(sizeof head_, nodes.data(), nodes.size_bytes());
        read_bytes(sizeof head_ + nodes.size_bytes(), blocks.data(), blocks.size_bytes());
        if (hash_bytes(nodes, blocks) != head_.hash) fail("its search structure is damaged");
        const std::string problem = tree_problem(nodes, blocks, head_.has_prisms != 0, triangles);
        if (!problem.empty()) fail(problem);
      });
}

}  // namespace kiln
