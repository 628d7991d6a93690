// The BVH of a saved source (.kilnsrc), which a later run reads instead of building it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "accel/device_bvh.h"
#include "io/file/byte_source.h"
#include "kiln/types.h"

namespace kiln {

/// Hash of all inputs of a tree's construction.
std::uint64_t tree_key(std::span<const Vec3> positions, std::span<const Triangle> triangles);

/// Appends bytes to a file.
using AppendBytes = std::function<void(const void* data, std::size_t bytes)>;

/// Writes a tree. \param key  of the tree's triangles
void write_saved_tree(cl::Context& context, const Tree& tree, std::uint64_t key,
                      const AppendBytes& append);

/// A tree in a file. The contents are checked before use, so that a search of a malicious file can neither read out of
/// bounds nor loop forever.
class SavedTree {
 public:
  /// \param offset  the tree's offset in the file \throws Error(input)
  SavedTree(const std::filesystem::path& path, std::uint64_t offset);

  /// True if the tree was built from these triangles.
  bool fits(std::span<const Vec3> positions, std::span<const Triangle> triangles) const;
  /// Reads the tree. \param triangles  number of the mesh's triangles \throws Error(input) if it is damaged
  std::shared_ptr<Tree> read(cl::Context& context, std::uint64_t triangles) const;

 private:
  struct Head {
    char magic[8] = {};
    std::uint64_t key = 0, hash = 0;
    std::uint64_t nodes = 0, blocks = 0;
    std::uint64_t triangles = 0, skipped = 0, duplicates = 0;
    double leaves_per_line = 0;
    std::uint64_t has_prisms = 0;
  };
  friend void write_saved_tree(cl::Context& context, const Tree& tree, std::uint64_t key,
                               const AppendBytes& append);

  void check_head();
  [[noreturn]] void fail(const std::string& problem) const;
  void read_bytes(std::uint64_t offset, void* to, std::size_t bytes) const;

  std::filesystem::path path_;
  std::unique_ptr<ByteSource> file_;
  std::uint64_t offset_ = 0;
  Head head_;
};

/// Checks a tree's indices: each node but the root is the child of exactly one preceding node, the depth is bounded,
/// and all leaves and triangles exist. \returns the problem; empty if there is none
std::string tree_problem(std::span<const kiln_bvh_node> nodes,
                         std::span<const kiln_bvh_block> blocks, bool has_prisms,
                         std::uint64_t triangles);

}  // namespace kiln
