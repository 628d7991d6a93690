// Chooses sizes and encodings of an asset's pictures for the smallest error within a byte budget.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "asset/gltf_pictures.h"
#include "io/image/picture.h"
#include "kiln/asset.h"

namespace kiln {

/// Error of a picture against the map, averaged over the surface or over rendered pixels.
struct PictureError {
  /// Mean over the texels of the length of the difference vector of all channels, in steps of 1/255
  double steps = 0;
  /// Mean angle between the original and the decoded normals; 0 for pictures that are no normal
  /// maps
  double degrees = 0;
};

/// One way to store a picture.
struct PictureChoice {
  std::size_t level = 0;        ///< Number of halvings of the full size
  std::uint32_t width = 0;      ///< Width in texels
  std::uint32_t height = 0;     ///< Height in texels
  PictureEncoding encoding;     ///< Format, quality, dithering
  std::uint64_t bytes = 0;      ///< Bytes in the GLB, rounded up to a multiple of 4
  PictureError error;           ///< Error of the decoded picture
  std::vector<std::byte> data;  ///< The encoded picture
};

/// Pareto-optimal ways to store a picture, in order of increasing bytes and decreasing error.
struct PictureEncodings {
  PictureSlot picture = PictureSlot::normal;
  double weight = 1;                   ///< Share of the low poly's surface that shows this picture
  std::vector<PictureChoice> choices;  ///< The choices; at least one
  /// Errors of lossless 8-bit pictures, indexed by PictureChoice::level
  std::vector<PictureError> levels;
};

/// Measures a decoded normal map of any size.
using NormalMapError = std::function<PictureError(const Image&)>;

/// Allowed encodings of pictures, and the measure of their errors.
struct PictureFitOptions {
  /// If `any_format` is set, PNG and JPEG are tried, which all glTF readers support; otherwise only `format`, and PNG
  /// for pictures that `format` cannot store. A set `quality` or `max_normal_error` excludes other encodings.
  EncodeMapsOptions encode = {};
  bool any_format = true;
  /// True: encode every third quality, as for the final file; false: encode only a few qualities
  bool all_qualities = false;
  std::uint64_t max_picture_bytes = 0;  ///< Maximum bytes of a picture; larger ones are skipped
  /// Measures a decoded normal map; if empty, the error is the mean angle to the texels of the full-size map
  NormalMapError normal_error = {};
};

/// Encodes each picture of a set of maps at several sizes and qualities. Smaller sizes average covered texels: normals
/// as directions, colours in linear light. Uncovered texels get the mean of the nearest coarser level that has one, so that no
/// background colour bleeds in. Errors compare the decoded picture, filtered bilinearly, with the maps. Deterministic
/// on any number of threads. Cost: each size and quality is encoded and decoded once, in total 1.33 times the texels
/// per quality; a size is skipped if the bytes of the next smaller one show that it cannot fit.
std::vector<PictureEncodings> encode_pictures(const AssetMaps& maps,
                                              const PictureFitOptions& options);

/// Inserts estimates for the qualities of lossy pictures between those that were tried: bytes and errors are
/// interpolated in log-log scale, in which they are almost linear. A choice for a budget then is close to the choice
/// among encodings with `all_qualities`, and does not depend on where the few qualities lie. Inserted choices have
/// no data.
void add_intermediate_qualities(PictureEncodings& picture_encodings);

/// A combination of encodings: one choice for each picture.
struct PictureFit {
  std::vector<std::size_t> choices;  ///< For each picture, index into PictureEncodings::choices
  std::uint64_t bytes = 0;           ///< Sum of the bytes of all pictures
  /// Sum of PictureError::steps, weighted by the pictures' shares of the surface
  double error = 0;
};

/// The choices with the smallest sum of errors within `bytes`; nullopt if even the smallest choices exceed it.
std::optional<PictureFit> least_error(std::span<const PictureEncodings> encodings_by_picture,
                                      std::uint64_t bytes);

/// Returns the sum of the bytes of all pictures, each in its smallest encoding.
std::uint64_t least_bytes(std::span<const PictureEncodings> encodings_by_picture);

}  // namespace kiln
