#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "kiln/export.h"
#include "kiln/image.h"

namespace KILN_PUBLIC kiln {

/// One of several images in a file.
struct ImageLayer {
  std::string name;                   ///< Without dots; its channels are NAME.R and so on
  const Image* image = nullptr;       ///< The caller's; must stay until the file is written
  std::array<double, 3> origin{};     ///< As SaveImageOptions::origin: the attribute NAME.origin
  std::vector<ImageText> texts = {};  ///< As SaveImageOptions::texts: attributes NAME.KEYWORD
};

/// Writes several images of one size as one OpenEXR file: channels NAME.R, NAME.G, NAME.B and NAME.A, NAME.R and
/// NAME.G, or NAME.Y. Otherwise like save_image, threads and lifetimes included.
/// \throws Error(usage) for no layer, layers of different sizes, names that are empty, have dots or come twice,
///         and PNG formats; Error(output)
void save_layers(std::span<const ImageLayer> layers, const std::filesystem::path& path,
                 const SaveImageOptions& options = {});

}  // namespace kiln
