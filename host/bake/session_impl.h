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

/// A set of indices, which keeps them in the order of their insertion.
class IndexSet {
 public:
  explicit IndexSet(std::size_t size = 0) : is_contained_(size, 0) {}
  void add(std::uint32_t item) {
    if (is_contained_[item] != 0) return;
    is_contained_[item] = 1;
    inserted_.push_back(item);
  }
  void sort() { std::sort(inserted_.begin(), inserted_.end()); }
  void clear() {
    for (const std::uint32_t item : inserted_) is_contained_[item] = 0;
    inserted_.clear();
  }
  const std::vector<std::uint32_t>& items() const { return inserted_; }

 private:
  std::vector<std::uint8_t> is_contained_;
  std::vector<std::uint32_t> inserted_;
};

/// Texels affected by changed normals, and the padding that copies them. Texels of all bands are numbered
/// consecutively.
class SessionTexels {
 public:
  /// Prepares the selection of texels. \param pipeline  with all bands sampled; must outlive this
  SessionTexels(Pipeline& pipeline, std::size_t triangles, std::uint32_t width);

  /// Discards all data that was computed from matched points.
  void invalidate();
  /// Precomputes all data that partial updates need, so that the first one is as fast as later ones.
  /// \param copied true: padding texels are copies of baked texels
  void prepare(const BakeOptions& options, bool copied);
  /// Selects the texels whose triangles have a changed normal. \returns false if they are more than half of all
  bool choose_texels(const HighPolyNormals& normals, const HighPolyNormals::Change& normal_change);
  /// Computes the selected texels of all maps that do not depend on positions.
  void read();
  /// Writes the selected texels into the finished maps. \returns bounds of these texels and of the padding
  /// that copies them
  Rectangle finish(const BakeOptions& options);
  /// True if the coverage is the same as when the padding was computed.
  bool is_coverage_unchanged() const;
  /// Finishes all texels of all maps with the stored padding, which is cheaper than computing padding again;
  /// requires is_coverage_unchanged().
  void finish_all_texels(const BakeOptions& options);

  std::size_t count() const { return count_; }
  std::size_t chosen_count() const { return chosen_texels_.items().size(); }

 private:
  /// A band's texels in host memory.
  struct Band {
    std::vector<std::uint32_t> index, first;  // arrays as in TexelBand
    std::uint32_t first_texel = 0;
  };

  void index();
  void run_kernels_once();
  void record_padding(const BakeOptions& options);
  Rectangle box() const;
  void read_band(std::size_t number, std::span<const std::uint32_t> texels);
  std::size_t map_index(std::size_t band, std::uint32_t texel) const;

  Pipeline& pipeline_;
  std::size_t triangles_;
  std::uint32_t width_;
  std::vector<Band> bands_;
  std::size_t count_ = 0;
  // texels that are matched to each triangle of the high poly; empty: must be rebuilt
  Adjacency texels_of_triangle_;
  Adjacency padding_;  // padding texels that copy each texel; empty: unknown
  // states of the texels (coverage) for which padding_ was computed
  std::vector<std::uint8_t> padded_coverage_;
  IndexSet chosen_texels_;
  std::vector<std::size_t> places_;  // Indices of the chosen texels in the map
  std::vector<std::size_t> all_map_indices_;
};

struct KILN_HIDDEN BakeSession::Impl {
  Impl(const Device& device, Mesh&& dense, Mesh&& low_mesh, const BakeOptions& wanted,
       const SessionOptions& session);

  const BakeResult& bake();
  /// Applies moved vertices and changed normals. \returns the changed entries of the pool of normals
  HighPolyNormals::Change update_source();
  void bake_maps(const HighPolyNormals::Change& normal_change, bool has_moved_vertices);

  Mesh high, low;
  BakeOptions options;
  SessionOptions session_options;  // The caller's options, completed by the session's bounds
  Source::Impl source;
  HighPolyNormals normals;
  Pipeline pipeline;
  SessionTexels texels;
  Clusters visibility;          // clusters of the low poly, which does not change
  Adjacency corners_of_vertex;  // corners that use each vertex
  IndexSet moved, set;  // moved vertices, and vertices with new normals, since the last bake
  bool baked = false;
  // True after a bake threw an exception, which leaves the session's data invalid
  bool has_failed = false;
  Update update;

 private:
  void move_vertices(IndexSet& triangles, HighPolyNormals::Change& normal_change);
  void upload_normals(IndexSet& triangles, const HighPolyNormals::Change& normal_change);
  bool padding_is_copied();
};

}  // namespace kiln
