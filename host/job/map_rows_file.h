// The file of a map that is written row by row while the map is baked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "bake/map_rows.h"
#include "io/image/image_rows.h"
#include "io/image/stored_error.h"

namespace kiln {

/// Properties of a map's values before they are converted to those that files store, for warnings about its format.
struct MapValues {
  RangeExcess excess;  ///< Number of texels out of the map's range, and the worst one
  /// Largest magnitude of finite baked values; 0 for maps of a fixed range
  float max_magnitude = 0;

  /// Adds rows of the map. \param rows  the map, whose image begins at `first_row`  \param coverage  of these rows
  void add(const BakedMap& rows, std::uint32_t first_row, std::span<const std::uint8_t> coverage);
};

/// Converts the rows of a map to the values that its file format stores, and writes them. The file appears with
/// commit().
class MapFile : public MapRows {
 public:
  /// \param map  the map without pixels  \throws Error(output)
  MapFile(const BakedMap& map, std::filesystem::path path, const SaveImageOptions& options);

  void put(Image& rows, std::span<const std::uint8_t> coverage) override;
  /// Completes the file. \throws Error(output)
  void commit() { file_->commit(); }

  MapKind kind() const { return kind_; }
  const std::filesystem::path& path() const { return path_; }
  TextureUse use() const { return options_.use; }
  const MapValues& values() const { return values_; }
  /// Quantisation error of 8-bit formats
  StoredError error() const { return errors_.error(); }

 private:
  MapKind kind_;
  std::filesystem::path path_;
  SaveImageOptions options_;
  BakedMap rows_;  // The map, with the rows that are being written
  std::uint32_t next_row_ = 0;
  MapValues values_;
  StoredErrorSums errors_;
  std::unique_ptr<ImageRows> file_;
};

}  // namespace kiln
