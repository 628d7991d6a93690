// Maps that leave a bake row by row, so that no float image of a large map has to exist.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "kiln/bake.h"

namespace kiln {

/// Receives the finished rows of a map, in their order.
class MapRows {
 public:
  MapRows() = default;
  MapRows(const MapRows&) = delete;
  MapRows& operator=(const MapRows&) = delete;
  virtual ~MapRows() = default;

  /// \param rows  the next rows, padded and encoded as BakedMap::image; they may be changed
  /// \param coverage  of these rows, as BakeResult::coverage
  virtual void put(Image& rows, std::span<const std::uint8_t> coverage) = 0;
};

/// Returns the receiver of a map's rows, which must outlive the bake. \param map has the properties that do not depend
/// on the bake, and the image's size, but no pixels
using OpenMapRows = std::function<MapRows&(const BakedMap& map)>;

/// Bakes like bake(), but passes the rows of maps on as soon as the rows around them are baked; `pixels` of their
/// images stay empty in the result. Whole images are kept for maps and options that need them: mip chains, padding
/// without a limit, blended fallbacks, measured errors, filled or marked misses, ids, two-component normals and several
/// clusters.
/// \throws as bake(), and what a receiver throws
BakeResult bake_rows(const Source& source, const Mesh& low, const BakeOptions& options,
                     const OpenMapRows& open);

}  // namespace kiln
