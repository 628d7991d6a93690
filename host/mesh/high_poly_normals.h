// The normals of a high poly that moves, updated after each change.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/normals.h"

namespace kiln {

/// Lists of items by key. Each list is in ascending order.
struct Adjacency {
  std::vector<std::uint32_t> first;  ///< Start of each key's list; one extra entry
  std::vector<std::uint32_t> items;

  std::span<const std::uint32_t> of(std::size_t key) const {
    return {items.data() + first[key], items.data() + first[key + 1]};
  }
  /// \param key_of  function that returns the key of an item; items whose key is `keys` or more are left out
  template <typename KeyOf>
  static Adjacency make(std::size_t keys, std::size_t items, const KeyOf& key_of) {
    Adjacency result;
    result.first.assign(keys + 1, 0);
    for (std::size_t i = 0; i < items; ++i) {
      if (const std::size_t key = key_of(i); key < keys) ++result.first[key];
    }
    // At first, each entry is the end of its key's list. Placing the items in reverse order moves the entry to the
    // beginning of the list.
    std::uint32_t sum = 0;
    for (std::uint32_t& list : result.first) list = sum += list;
    result.items.resize(sum);
    for (std::size_t i = items; i-- > 0;) {
      if (const std::size_t key = key_of(i); key < keys) {
        result.items[--result.first[key]] = static_cast<std::uint32_t>(i);
      }
    }
    return result;
  }
};

/// Updates normals after changes. The results are bit-identical to corner_normals() of the whole mesh. The cost is
/// proportional to the changes, except for welding, which visits all vertices if positions changed.
class HighPolyNormals {
 public:
  /// \param positions  positions in the working frame
  HighPolyNormals(const Mesh& mesh, std::span<const Vec3> positions);

  /// The entries of the pool of normals that changed, or a flag that the whole pool was replaced.
  struct Change {
    bool rebuilt = false;
    std::vector<std::uint32_t> entries;  ///< Indices of changed entries, ascending
  };
  /// Updates the normals after vertices moved.
  /// \param triangles  triangles with at least one corner that moved
  Change move(const Mesh& mesh, std::span<const Vec3> positions,
              std::span<const std::uint32_t> triangles);
  /// Updates normals that were changed in the mesh.
  /// \param entries  indices of these normals, ascending
  Change set(const Mesh& mesh, std::span<const Vec3> positions,
             std::span<const std::uint32_t> entries);

  const CornerNormals& corners() const { return corners_; }
  /// Corners (3 * triangle + corner) that use an entry of the pool.
  std::span<const std::uint32_t> corners_of(std::uint32_t entry) const {
    return corners_of_entry_.of(entry);
  }

 private:
  Change rebuild(const Mesh& mesh, std::span<const Vec3> positions);
  /// The first triangles of the polygons that contain the given triangles.
  static std::vector<std::uint32_t> first_triangles_of_polygons(
      const Mesh& mesh, std::span<const std::uint32_t> triangles);
  void index();
  /// True if invalid normals of some corners were replaced by computed ones. Their entries are not normals of the mesh,
  /// so that a change requires rebuild().
  bool has_extra_normals(const Mesh& mesh) const;

  bool is_computed_;  // True if normals are computed from positions
  std::vector<std::uint32_t> welded_;
  CornerNormals corners_;
  Adjacency corners_of_entry_;
  std::vector<CornerWeights> weights_;  // Weights of each triangle, if normals are computed
};

}  // namespace kiln
