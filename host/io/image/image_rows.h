// Picture files that are written row by row, so that no program has to hold all of a large picture.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "kiln/image.h"

namespace kiln {

/// Size of an image whose pixels are not all in memory.
struct ImageShape {
  std::uint32_t width = 0, height = 0, channels = 0;
};

/// Writes a picture file row by row. Without commit(), the destructor removes the file.
class ImageRows {
 public:
  ImageRows() = default;
  ImageRows(const ImageRows&) = delete;
  ImageRows& operator=(const ImageRows&) = delete;
  virtual ~ImageRows() = default;

  /// Appends rows. \param rows  the next rows; of the picture's width and channels
  /// \throws Error(output)
  virtual void put(const Image& rows) = 0;
  /// Completes the file after its last row; at most one call. \throws Error(output)
  virtual void commit() = 0;
};

/// True for formats that save_image_rows() writes: PNG and OpenEXR.
bool writes_rows(ImageFormat format);

/// Begins the file that save_image() would write for the whole image: the bytes are the same, however the rows are
/// divided.
/// \throws as save_image(); Error(usage) for a format that is not written row by row
std::unique_ptr<ImageRows> save_image_rows(const ImageShape& shape,
                                           const std::filesystem::path& path,
                                           const SaveImageOptions& options);

}  // namespace kiln
