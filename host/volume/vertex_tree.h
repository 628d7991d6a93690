// The fine vertices gathered bottom-up through an octree, and which of them may become one.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/fine_surface.h"
#include "volume/qef.h"
#include "volume/raw_vector.h"

namespace kiln {

/// Clusters of fine vertices. The octree's nodes are implicit: at level l, cells with the same
/// coordinates >> l. Fine vertices of a node that touch (through the faces between its cells) form a
/// cluster; a node has one for each sheet. A cluster of a single child is that child.
///
/// Nodes 0 to leaves() - 1 are the fine vertices; clusters follow, level by level, so that a parent's
/// number is above its children's.
class VertexTree {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  /// An earlier tree, whose clusters are taken over where nothing changed: the same, but sooner.
  struct Earlier {
    const VertexTree* tree = nullptr;
    KeptVertices kept;
  };
  /// \param open  the volume's border is open
  VertexTree(const FineSurface& surface, const std::array<std::uint32_t, 3>& size, bool open,
             const Earlier& earlier = {nullptr, {}});

  bool open() const { return open_; }  ///< True if the volume's border is
  std::uint32_t leaves() const { return leaves_; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(parent_.size()); }
  std::uint32_t parent(std::uint32_t node) const { return parent_[node]; }

  struct Cluster {
    Qef qef;
    Vec3d place;        ///< Padded coordinates
    float error;        ///< Root mean square distance of its own or the worst below, cells
    bool is_one_sheet;  ///< May replace what is below without changing the topology
    std::uint8_t level;
    CellPlace node;  ///< The lowest cell of its node
  };
  const Cluster& cluster(std::uint32_t node) const { return clusters_[node - leaves_]; }

 private:
  /// The cluster at a level whose lowest fine vertex is given, where the earlier tree has it.
  static const Cluster* find_earlier(const Earlier& earlier, std::uint32_t leaf,
                                     std::uint32_t level);

  bool open_ = false;
  std::uint32_t leaves_ = 0;
  RawVector<std::uint32_t> parent_;
  RawVector<Cluster> clusters_;
};

}  // namespace kiln
