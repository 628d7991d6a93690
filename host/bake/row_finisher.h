// Pads, encodes and passes on the rows of maps while a bake computes them.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "bake/map_rows.h"
#include "cl/context.h"

namespace kiln {

/// Finishes maps row by row. A row is final once all rows within the padding's width are computed. So each map is a
/// window of rows: from the padding's width above the first row that is not final, to the last computed row.
///
/// Padding copies raw values from rows that are final already. So rows are encoded in a copy.
class RowFinisher {
 public:
  /// The images have the size and the padding of the options, whose padding must have a finite width.
  RowFinisher(cl::Context& context, const BakeOptions& options);

  /// Adds a map. \returns its number
  std::size_t add(const MapInfo& map);
  bool empty() const { return maps_.empty(); }
  /// Sets the receiver of a map's rows.
  void set_target(std::size_t map, MapRows& target) { maps_[map].target = &target; }

  /// Appends rows of zeros to all maps up to row `end_row`, unless they have these rows already.
  void extend(std::uint32_t end_row);
  /// The values of rows [first_row, first_row + row_count) of a map, which were appended and are not final.
  std::span<float> rows(std::size_t map, std::uint32_t first_row, std::uint32_t row_count);
  /// Passes on all rows that are final now that the appended rows are computed.
  /// \param coverage  of the whole map; texels that get padding are marked
  void finish(std::span<std::uint8_t> coverage);
  /// Number of texels that became padding.
  std::uint64_t padded() const { return padded_; }

 private:
  struct Map {
    MapInfo info;
    Image window;
    MapRows* target = nullptr;
  };

  void pass_rows_on(Map& map, std::span<const std::uint8_t> coverage, std::uint32_t end_row);

  cl::Context& context_;
  const BakeOptions& options_;
  std::uint32_t padding_;
  std::deque<Map> maps_;
  Image finished_;               // Rows that are passed on
  std::uint32_t first_row_ = 0;  // First row of the maps' windows
  std::uint32_t final_end_ = 0;  // End of the rows that were passed on
  std::uint32_t end_row_ = 0;    // End of the windows
  std::uint64_t padded_ = 0;
};

}  // namespace kiln
