// The high poly's normals, kept up to date as it moves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/normals.h"

namespace kiln {

/// For each of some keys, a list of items in ascending order.
struct Adjacency {
  std::vector<std::uint32_t> first;  ///< [keys + 1]
  std::vector<std::uint32_t> items;

  std::span<const std::uint32_t> of(std::size_t key) const {
    return {items.data() + first[key], items.data() + first[key + 1]};
  }
  /// \param key_of  the key of an item, or `keys` or more for none
  template <typename KeyOf>
  static Adjacency make(std::size_t keys, std::size_t items, const KeyOf& key_of) {
    Adjacency result;
    result.first.assign(keys + 1, 0);
    for (std::size_t i = 0; i < items; ++i) {
      if (const std::size_t key = key_of(i); key < keys) ++result.first[key];
    }
    // Each key's end; dealt out from the last item on, all come to stand at their beginnings.
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

/// Updates normals to those that corner_normals() gives for the mesh as it is now, to the bit, at the cost of what changed. (But for
/// finding out which vertices share a place, which goes over all of them where they moved.)
class HighPolyNormals {
 public:
  /// \param positions  in the working frame
  HighPolyNormals(const Mesh& mesh, std::span<const Vec3> positions);

  /// Which entries of the pool changed; or the pool is another.
  struct Change {
    bool rebuilt = false;
    std::vector<std::uint32_t> entries;  ///< In ascending order
  };
  /// \param triangles  those with a moved corner
  Change move(const Mesh& mesh, std::span<const Vec3> positions,
              std::span<const std::uint32_t> triangles);
  /// Takes over entries of the mesh's own pool that were set. \param entries  in ascending order
  Change set(const Mesh& mesh, std::span<const Vec3> positions,
             std::span<const std::uint32_t> entries);

  const CornerNormals& corners() const { return corners_; }
  /// Corners (3 * triangle + corner) that use an entry of the pool.
  std::span<const std::uint32_t> corners_of(std::uint32_t entry) const { return users_.of(entry); }

 private:
  Change rebuild(const Mesh& mesh, std::span<const Vec3> positions);
  /// The first triangles of the polygons that the given ones belong to.
  static std::vector<std::uint32_t> first_of_polygons(const Mesh& mesh,
                                                      std::span<const std::uint32_t> triangles);
  void index();
  /// Some normals are made up for corners that have none: no entry by itself says what they are.
  bool has_extra(const Mesh& mesh) const;

  bool computed_;  // from positions
  std::vector<std::uint32_t> first_;
  CornerNormals corners_;
  Adjacency users_;
  std::vector<CornerWeights> weights_;  // per triangle, where computed
};

}  // namespace kiln
