// The page of kiln run --report: pictures and figures of each asset, in one file.
#pragma once

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

/// Adds to each asset of a report what a page shows: "pictures", "rendered" and "maps". A picture that cannot be drawn
/// leaves a note.
/// \param device  called once, for the first picture \param cache  that keeps pictures; null: none
/// \returns false where interrupted
bool add_pictures(Json& report, const std::vector<BatchAsset>& assets,
                  const std::vector<AssetResult>& results, const std::function<Device()>& device,
                  BakeCache* cache, Console& console);

/// The same without bytes of pictures.
Json without_pictures(const Json& report);

/// Writes the page, which needs no other file. \throws Error(output)
void save_page(const std::filesystem::path& path, const Json& report);

}  // namespace kiln::cli
