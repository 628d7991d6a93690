// Pictures of a bake for a page: high poly, low poly, low poly with its maps, and where their normals differ.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kiln/device.h"
#include "kiln/image.h"
#include "kiln/job.h"

namespace kiln::cli {

/// Pictures of a bake, and the angles that they show.
struct DrawnAsset {
  Image high, low;
  Image with_maps, errors;          ///< Without texels where no map can be shown
  double without_maps_degrees = 0;  ///< Mean angle between rendered normals of HIGH and LOW
  double with_maps_degrees = 0;     ///< The same of LOW with its maps
  double scale_degrees = 0;         ///< Of the brightest colour of `errors`
  std::string note;                 ///< Why a picture is missing; empty: none is
};

/// Draws what a job was given and wrote, from the view that `kiln render` takes. \param files  that it wrote
/// \param size  of the pictures, which are square, pixels \throws Error(input) where a file cannot be read
DrawnAsset draw_asset(const Device& device, const Job& job, const std::vector<std::string>& files,
                      std::uint32_t size);

/// A map for a page: its own values, and the picture that shows them.
struct MapPicture {
  std::string name;  ///< "normal"
  std::string file;  ///< Empty: it is within an asset's file
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::optional<double>> least, mean,
      most;                             ///< By channel, of finite values; none: there is none
  double shown_from = 0, shown_to = 1;  ///< Values of black and white
  std::string hash;                     ///< Of its values
  Image picture;  ///< Of its first three channels, or its only one; values in [0, 1]
  Image alpha;    ///< Of its fourth; without texels where it has none
};

/// Maps of a job: files of pictures that it wrote, or what its asset's materials have.
/// \param side  most texels a side of pictures; maps are averaged down to it
std::vector<MapPicture> picture_maps(const Job& job, const std::vector<std::string>& files,
                                     std::uint32_t side);

}  // namespace kiln::cli
