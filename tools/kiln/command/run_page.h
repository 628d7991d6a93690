// Writes the page of `kiln run --report`: pictures and statistics of each asset in one file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "batch/bake_cache.h"
#include "batch/runner.h"
#include "kiln/device.h"
#include "options/json.h"
#include "report/console.h"

namespace kiln::cli {

/// Sides of the pictures and maps on a page, in pixels.
struct PageSizes {
  std::uint32_t picture = 256, map = 512;
};

/// Chooses the sizes for a page. They are halved, down to 64 and 32, until the expected bytes of all pictures are at most
/// 48 MB, and those of all maps 96 MB, so that browsers can open pages with thousands of assets. An asset with files has
/// four pictures. Compressed texels take about 1.5 bytes.
PageSizes choose_page_sizes(const std::vector<AssetResult>& results);

/// Adds the contents of a page to each asset of a report: "pictures", "rendered" and "maps". If a picture cannot be
/// drawn, a note explains why.
/// \param device  opens the device; called once, for the first picture
/// \param cache   cache of pictures; null: none
/// \returns false if the user interrupted
bool add_pictures(Json& report, const std::vector<BatchAsset>& assets,
                  const std::vector<AssetResult>& results, const std::function<Device()>& device,
                  BakeCache* cache, Console& console);

/// Copies a report without the bytes of pictures.
Json remove_picture_bytes(const Json& report);

/// Writes the page as one self-contained file. \throws Error(output)
void save_page(const std::filesystem::path& path, const Json& report);

}  // namespace kiln::cli
