// Pictures of a bake for the report page: high poly, low poly, low poly with its maps, and the angles between their
// normals.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kiln/device.h"
#include "kiln/image.h"
#include "kiln/job.h"

namespace kiln::cli {

/// Pictures of a bake, and the mean angles between rendered normals.
struct DrawnAsset {
  Image high, low;
  Image with_maps, errors;          ///< Empty if no map can be shown
  double without_maps_degrees = 0;  ///< Mean angle between rendered normals of HIGH and LOW
  double with_maps_degrees = 0;     ///< Mean angle between HIGH and LOW with its maps
  double scale_degrees = 0;         ///< Angle of the brightest colour in `errors`
  std::string note;                 ///< Why a picture is missing; empty if none is
};

/// Draws a job's inputs and outputs, from the default view of `kiln render`. \param files files that the job wrote
/// \param size  side of the square pictures, pixels \throws Error(input) if a file cannot be read
DrawnAsset draw_asset(const Device& device, const Job& job, const std::vector<std::string>& files,
                      std::uint32_t size);

/// A map for the report page: statistics of its values, and a picture.
struct MapPicture {
  std::string name;  ///< "normal"
  std::string file;  ///< Empty if the map is embedded in an asset's file
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::optional<double>> least, mean,
      most;  ///< Range of finite values per channel; nullopt if there are none
  double shown_from = 0, shown_to = 1;  ///< Values of black and white
  std::string hash;                     ///< Hash of its values
  Image picture;  ///< Its first three channels, or its only one; values in [0, 1]
  Image alpha;    ///< Its fourth channel; empty if it has none
};

/// Maps of a job: its picture files, or the textures of its asset's materials.
/// \param side  maximum side of pictures in texels; larger maps are averaged down to it
std::vector<MapPicture> picture_maps(const Job& job, const std::vector<std::string>& files,
                                     std::uint32_t side);

}  // namespace kiln::cli
