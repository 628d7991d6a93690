// The implementation of a session: a pipeline whose bands stay on the device, and the changes since its last
// bake.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/pipeline.h"
#include "kiln/session.h"
#include "mesh/high_poly_normals.h"

namespace kiln {

/// A set of indices in the order of insertion.
class IndexSet {
 public:
  explicit IndexSet(std::size_t size = 0) : is_member_(size, 0) {}
  void add(std::uint32_t item) {
    if (is_member_[item] != 0) return;
    is_member_[item] = 1;
    items_.push_back(item);
  }
  void sort() { std::sort(items_.begin(), items_.end()); }
  void clear() {
    for (const std::uint32_t item : items_) is_member_[item] = 0;
    items_.clear();
  }
  const std::vector<std::uint32_t>& items() const { return items_; }

 private:
  std::vector<std::uint8_t> is_member_;
  std::vector<std::uint32_t> items_;
};

/// Texels affected by changed normals, and the padding that copies them. Texels of all bands are numbered
/// consecutively.
class SessionTexels {
 public:
  /// Prepares the selection of texels. \param pipeline  with all bands sampled; must outlive this
  SessionTexels(Pipeline& pipeline, std::size_t triangles, std::uint32_t width);

  /// Invalidates all data that was computed from points.
  void invalidate();
  /// Precomputes all data that partial updates need, so that the first one is as fast as later ones.
  /// \param copied true: padding texels are copies of baked texels
  void prepare(const BakeOptions& options, bool copied);
  /// Selects the texels whose triangles have a changed normal. \returns false if they are more than half of all
  bool choose(const HighPolyNormals& normals, const HighPolyNormals::Change& change);
  /// Computes the selected texels of all maps that do not depend on positions.
  void read();
  /// Writes the selected texels into the finished maps. \returns bounds of these texels and of the padding
  /// that copies them
  Rectangle finish(const BakeOptions& options);
  /// True if the coverage is the same as when the padding was computed.
  bool coverage_stays() const;
  /// Finishes all texels of all maps with the stored padding, which is cheaper than computing padding again;
  /// requires coverage_stays().
  void finish_all(const BakeOptions& options);

  std::size_t count() const { return count_; }
  std::size_t chosen() const { return chosen_.items().size(); }

 private:
  /// A band's texels in host memory.
  struct Band {
    std::vector<std::uint32_t> index, first;  // arrays as in TexelBand
    std::uint32_t first_texel = 0;
  };

  void index();
  void warm_up();
  void find_padding(const BakeOptions& options);
  Rectangle box() const;
  void read_band(std::size_t number, std::span<const std::uint32_t> texels);
  std::size_t place_of(std::size_t band, std::uint32_t texel) const;

  Pipeline& pipeline_;
  std::size_t triangles_;
  std::uint32_t width_;
  std::vector<Band> bands_;
  std::size_t count_ = 0;
  // texels of each triangle of the high poly; empty: must be rebuilt
  Adjacency texels_of_triangle_;
  Adjacency padding_;  // padding texels that copy each texel; empty: unknown
  std::vector<std::uint8_t> padded_coverage_;  // coverage for which padding_ was computed
  IndexSet chosen_;
  std::vector<std::size_t> places_;  // indices of the chosen texels in the map
  std::vector<std::size_t> all_places_;
};

struct KILN_HIDDEN BakeSession::Impl {
  Impl(const Device& device, Mesh&& dense, Mesh&& low_mesh, const BakeOptions& wanted,
       const SessionOptions& session);

  const BakeResult& bake();
  /// Applies moved vertices and changed normals. \returns the changed entries of the pool of normals
  HighPolyNormals::Change update_source();
  void bake_maps(const HighPolyNormals::Change& change, bool any_moved);

  Mesh high, low;
  BakeOptions options;
  SessionOptions settings;  // including the session's bounds
  Source::Impl source;
  HighPolyNormals normals;
  Pipeline pipeline;
  SessionTexels texels;
  Clusters visibility;  // clusters of the low poly, which does not change
  Adjacency users;      // corners that use each vertex
  IndexSet moved, set;  // moved vertices, and vertices with new normals, since the last bake
  bool baked = false;
  // true after a bake threw an exception, since the session's data is invalid then
  bool failed = false;
  Update update;

 private:
  void move_vertices(IndexSet& triangles, HighPolyNormals::Change& change);
  void upload_normals(IndexSet& triangles, const HighPolyNormals::Change& change);
  bool padding_is_copied();
};

}  // namespace kiln
