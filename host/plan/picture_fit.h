// Sizes and encodings of an asset's pictures: the least error within a number of bytes.
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

/// Difference between what a picture shows and what it should, over the surface or the pixels that show it.
struct PictureError {
  double steps = 0;    ///< Mean length of the difference of all channels, in steps of 1/255
  double degrees = 0;  ///< Of normals: the mean angle
};

/// One way to store a picture.
struct PictureChoice {
  std::size_t level = 0;        ///< Sides are halved so many times
  std::uint32_t width = 0;      ///< Texels
  std::uint32_t height = 0;     ///< Texels
  PictureEncoding encoding;     ///< Format, quality, dithering
  std::uint64_t bytes = 0;      ///< In the file: rounded up to 4
  PictureError error;           ///< Of the decoded picture
  std::vector<std::byte> data;  ///< The file
};

/// The ways to store a picture that are worth it: by rising bytes and falling error.
struct PictureLadder {
  PictureSlot picture = PictureSlot::normal;
  double weight = 1;                   ///< Share of the surface that has this picture
  std::vector<PictureChoice> choices;  ///< One at least
  std::vector<PictureError> levels;    ///< By PictureChoice::level: errors of 8 bits without loss
};

/// Error of a decoded normal map of some size.
using NormalMapError = std::function<PictureError(const Image&)>;

/// Ways to store pictures that may be chosen, and how their errors are found.
struct PictureFitOptions {
  /// With `any_format` PNG and JPEG are tried, which all readers have; else the format alone, and PNG for what it cannot hold.
  /// A quality, or a bound of normals' errors, leaves others out.
  EncodeMapsOptions encode = {};
  bool any_format = true;
  bool all_qualities = false;        ///< Steps of 3 in place of a few: for what is written
  std::uint64_t most_bytes = 0;      ///< Larger pictures are left out
  NormalMapError normal_error = {};  ///< Empty: the angle to the largest map's texels
};

/// Ways to store each picture of a set of maps. Smaller sizes are means of covered texels, of normals as directions, of
/// colours in linear light; the rest takes the nearest coarser mean, so that no background bleeds in. Errors are those of the
/// decoded picture, read bilinearly, against the maps themselves.
/// Deterministic on any number of threads. Time: sizes and qualities are encoded and decoded once each, 1.33 times the texels a
/// quality; sizes whose smaller neighbour shows that they cannot fit are skipped.
std::vector<PictureLadder> picture_ladders(const AssetMaps& maps, const PictureFitOptions& options);

/// Choices of one for each ladder.
struct PictureFit {
  std::vector<std::size_t> choices;  ///< Index into PictureLadder::choices
  std::uint64_t bytes = 0;           ///< Sum
  double error = 0;                  ///< Sum of weighted steps
};

/// The least sum of errors with at most so many bytes; none: even the smallest take more.
std::optional<PictureFit> least_error(std::span<const PictureLadder> ladders, std::uint64_t bytes);

/// Bytes of the smallest choices.
std::uint64_t least_bytes(std::span<const PictureLadder> ladders);

}  // namespace kiln
