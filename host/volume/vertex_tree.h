// An octree of clusters of fine vertices, built bottom-up, which records the clusters that may be replaced by
// one vertex.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/fine_surface.h"
#include "volume/qef.h"
#include "volume/raw_vector.h"

namespace kiln {

/// Clusters of fine vertices. The octree's nodes are implicit: at level l, a node consists of the cells with the same
/// coordinates >> l. Fine vertices of a node that are adjacent (through faces between its cells) form a cluster; a
/// node has one cluster per sheet. A cluster with a single child is not stored: the child takes its place.
///
/// Nodes 0 to leaves() - 1 are the fine vertices; clusters follow level by level, so that a parent's number is above
/// its children's.
class VertexTree {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  /// The tree before an update. Its clusters are reused where nothing changed; the result is the
  /// same as that of a new tree.
  struct EarlierTree {
    const VertexTree* tree = nullptr;
    UnchangedVertices kept;
  };
  /// \param open  true if the volume has an open border
  VertexTree(const FineSurface& surface, const std::array<std::uint32_t, 3>& size, bool open,
             const EarlierTree& earlier = {nullptr, {}});

  bool open() const { return has_open_border_; }  ///< True if the volume has an open border
  std::uint32_t leaves() const { return leaves_; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(parents_.size()); }
  std::uint32_t parent(std::uint32_t node) const { return parents_[node]; }

  struct Cluster {
    Qef qef;
    Vec3d place{};  ///< Position in padded coordinates
    /// Root-mean-square error in cells: the largest of the cluster's own error and those of its
    /// descendants
    float error;
    /// True if one vertex may replace its descendants without changing the topology
    bool is_one_sheet;
    std::uint8_t level;
    CellPlace node;  ///< Lowest cell of its octree node
  };
  const Cluster& cluster(std::uint32_t node) const { return clusters_[node - leaves_]; }

 private:
  /// Finds the earlier tree's cluster at a level by the lowest index of its fine vertices; null if there is none.
  static const Cluster* find_earlier_cluster(const EarlierTree& earlier, std::uint32_t leaf,
                                             std::uint32_t level);

  bool has_open_border_ = false;
  std::uint32_t leaves_ = 0;
  RawVector<std::uint32_t> parents_;
  RawVector<Cluster> clusters_;
};

}  // namespace kiln
