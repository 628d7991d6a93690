// A session's parts: a pipeline whose bands stay, and what changed since its last bake.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/pipeline.h"
#include "kiln/session.h"
#include "mesh/high_poly_normals.h"

namespace kiln {

/// A list without repetitions of what was added since it was cleared.
class Stamps {
 public:
  explicit Stamps(std::size_t size = 0) : stamped_(size, 0) {}
  void add(std::uint32_t item) {
    if (stamped_[item] != 0) return;
    stamped_[item] = 1;
    items_.push_back(item);
  }
  void sort() { std::sort(items_.begin(), items_.end()); }
  void clear() {
    for (const std::uint32_t item : items_) stamped_[item] = 0;
    items_.clear();
  }
  const std::vector<std::uint32_t>& items() const { return items_; }

 private:
  std::vector<std::uint8_t> stamped_;
  std::vector<std::uint32_t> items_;
};

/// Which texels show changed normals, and the padding that copies them. Texels of all bands are numbered one
/// after another.
class SessionTexels {
 public:
  /// \param pipeline  with all bands sampled; it outlives this
  SessionTexels(Pipeline& pipeline, std::size_t triangles, std::uint32_t width);

  /// Marks as out of date what was found out of points.
  void forget();
  /// Finds out what the next partial update would: it shall not be slower than those after it.
  /// \param copied  padding is copied from texels
  void prepare(const BakeOptions& options, bool copied);
  /// Chooses the texels whose triangles have a changed normal. \returns false for more than half of all
  bool choose(const HighPolyNormals& normals, const HighPolyNormals::Change& change);
  /// Makes the chosen texels of all maps that read no positions.
  void read();
  /// Puts them into the finished maps. \returns where they and the padding that copies them lie
  Rectangle finish(const BakeOptions& options);
  /// True if the same texels are baked as when padding was found last.
  bool coverage_stays() const;
  /// Finishes all texels of all maps if coverage_stays(): cheaper than finding their padding again.
  void finish_all(const BakeOptions& options);

  std::size_t count() const { return count_; }
  std::size_t chosen() const { return chosen_.items().size(); }

 private:
  /// A band's texels on the host.
  struct Band {
    std::vector<std::uint32_t> index, first;  // as on the device
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
  Adjacency texels_of_;  // of each triangle of the high poly; empty where out of date
  Adjacency padding_;    // texels that copy each one; empty where not known
  std::vector<std::uint8_t> padded_coverage_;  // that the padding was found for
  Stamps chosen_;
  std::vector<std::size_t> places_;  // of the chosen texels, in the map
  std::vector<std::size_t> all_places_;
};

struct KILN_HIDDEN BakeSession::Impl {
  Impl(const Device& device, Mesh&& dense, Mesh&& low_mesh, const BakeOptions& wanted,
       const SessionOptions& session);

  const BakeResult& bake();
  /// Takes over what moved and turned. \returns the entries of the pool of normals that changed
  HighPolyNormals::Change update_source();
  void bake_maps(const HighPolyNormals::Change& change, bool any_moved);

  Mesh high, low;
  BakeOptions options;
  SessionOptions settings;  // with bounds
  Source::Impl source;
  HighPolyNormals normals;
  Pipeline pipeline;
  SessionTexels texels;
  Clusters visibility;  // of the low poly: it stays
  Adjacency users;      // corners of each vertex
  Stamps moved, set;    // vertices and normals changed since the last bake
  bool baked = false;
  bool failed = false;  // the last bake did not end: what it brought up to date is not known
  Update update;

 private:
  void move_vertices(Stamps& triangles, HighPolyNormals::Change& change);
  void upload_normals(Stamps& triangles, const HighPolyNormals::Change& change);
  bool padding_is_copied();
};

}  // namespace kiln
