// The layouts of a low poly's texture sets, one after the other.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "kiln/texture_sets.h"
#include "source/high_poly.h"

namespace kiln {

/// Gives a copy of a low poly the UV layout of one texture set after the other, as lay_out_set() does, but in time
/// proportional to the set's triangles. While this object exists, the source recognizes the copy by its address, so
/// bakes of it neither check nor hash the whole mesh. Without this, the time would be proportional to the number of
/// sets times the number of triangles.
class SetLayouts {
 public:
  /// \param low valid, with UVs; must outlive this object, and so must the source and the copy
  /// \param part  a copy with tangents; nobody else changes it
  SetLayouts(const Source& source, const Mesh& low, Mesh& part);
  ~SetLayouts();
  SetLayouts(const SetLayouts&) = delete;
  SetLayouts& operator=(const SetLayouts&) = delete;

  /// Gives the copy the layout of a set. \param set  of find_texture_sets(low)
  void lay_out(const TextureSet& set);

 private:
  const Source::Impl& source_;
  const Mesh& low_;
  Mesh& part_;
  std::uint32_t nowhere_;  // Index of a UV that is not finite, which triangles of other sets get
  Source::Impl::KnownLow known_;
  std::vector<std::uint32_t> members_;  // Triangles of the set that lay_out() was last called with
  // Offset of the current UVs, in tiles. Its first value differs from the offset of every set, so that the first set's
  // UVs are computed
  std::uint32_t tile_u_ = std::numeric_limits<std::uint32_t>::max(), tile_v_ = tile_u_;
};

}  // namespace kiln
