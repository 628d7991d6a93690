// Draws pictures of a bake for the report page: high poly, low poly, low poly with its maps, and the angles between
// their normals.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kiln/image_data.h"

namespace kiln {
class Device;
struct Job;
}  // namespace kiln

namespace kiln::cli {

/// Pictures of a bake, and the mean angles between rendered normals.
struct DrawnAsset {
  Image high, low;
  /// Low poly with its maps, and angles between normals; empty if no map can be shown
  Image with_maps, errors;
  double without_maps_degrees = 0;  ///< Mean angle between rendered normals of HIGH and LOW
  double with_maps_degrees = 0;     ///< Mean angle between HIGH and LOW with its maps
  double scale_degrees = 0;  ///< Angle in degrees that the brightest colour in `errors` shows
  std::string note;          ///< Reason why a picture is missing; empty if none is missing
};

/// Draws the inputs and outputs of a job, from the default view of `kiln render`.
/// \param files  files that the job wrote
/// \param size   side of the square pictures in pixels
/// \throws Error(input) if a file cannot be read
DrawnAsset draw_asset(const Device& device, const Job& job, const std::vector<std::string>& files,
                      std::uint32_t size);

/// A map for the report page: statistics of its values, and a picture.
struct MapPicture {
  std::string name;  ///< Name of the map, such as "normal"
  std::string file;  ///< File of the map; empty if the map is embedded in an asset
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::optional<double>> least, mean,
      most;  ///< Minimum and maximum of the finite values, per channel; nullopt if there are none
  double value_shown_black = 0,
         value_shown_white = 1;  ///< The values that the picture shows as black and as white
  std::string hash;              ///< Hash of the map's values
  Image picture;  ///< The map's first three channels, or its only one; values in [0, 1]
  Image alpha;    ///< The map's fourth channel; empty if it has none
};

/// Pictures of a job's maps, from its files or from the textures of its asset.
/// \param side  maximum side of pictures in texels; larger maps are averaged
std::vector<MapPicture> picture_maps(const Job& job, const std::vector<std::string>& files,
                                     std::uint32_t side);

}  // namespace kiln::cli
