#include "command/run_page.h"

#include <algorithm>
#include <optional>

#include "base/file.h"
#include "batch/checks.h"
#include "batch/report.h"
#include "interrupt.h"
#include "job/job_options.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "picture/asset_pictures.h"

namespace kiln::cli {

extern const char kReportPage[];

namespace {

namespace fs = std::filesystem;

constexpr double kBytesOfTexel = 1.5, kMaxPictureBytes = 48e6, kMaxMapBytes = 96e6;
constexpr std::uint32_t kMinPictureSide = 64, kMinMapSide = 32;
constexpr double kPicturesPerAsset = 4;

}  // namespace

PageSizes choose_page_sizes(const std::vector<AssetResult>& results) {
  std::size_t assets = 0, maps = 0;
  for (const AssetResult& result : results) {
    if (!result.files.empty()) ++assets;
    maps += static_cast<std::size_t>(
        std::count_if(result.files.begin(), result.files.end(),
                      [](const std::string& file) { return is_map_file(file); }));
  }
  const auto fit = [](std::uint32_t side, std::uint32_t least, double count, double most) {
    while (side > least && count * side * side * kBytesOfTexel > most) side /= 2;
    return side;
  };
  PageSizes sizes;
  sizes.picture = fit(sizes.picture, kMinPictureSide,
                      kPicturesPerAsset * static_cast<double>(assets), kMaxPictureBytes);
  sizes.map = fit(sizes.map, kMinMapSide, static_cast<double>(maps), kMaxMapBytes);
  return sizes;
}

namespace {

/// Encodes a picture as a data URI.
Json data_uri(const Image& image) {
  if (image.width == 0) return {};
  const std::vector<std::byte> bytes = encode(image, {ImageFormat::png8});
  return "data:image/png;base64," +
         kiln::base64({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

Json map_json(const MapPicture& map) {
  Json json = {{"name", map.name},
               {"file", map.file.empty() ? Json() : Json(map.file)},
               {"width", map.width},
               {"height", map.height},
               {"channels", map.channels},
               {"min", map.least},
               {"mean", map.mean},
               {"max", map.most},
               {"shown", Json::array({map.value_shown_black, map.value_shown_white})},
               {"hash", map.hash},
               {"picture", data_uri(map.picture)}};
  if (map.alpha.width != 0) json["alpha"] = data_uri(map.alpha);
  return json;
}

/// Draws an asset. \returns its "pictures", "rendered" and "maps" for the page
Json drawn_asset(const BatchAsset& asset, const AssetResult& result,
                 const std::function<Device()>& device, const PageSizes& sizes) {
  Json asset_entry = {
      {"pictures", Json::object()}, {"rendered", Json::object()}, {"maps", Json::array()}};
  std::string note;
  try {
    for (const MapPicture& map : picture_maps(asset.job, result.files, sizes.map))
      asset_entry["maps"].push_back(map_json(map));
  } catch (const Error& error) {
    note = error.what();
  }
  try {
    const DrawnAsset pictures = draw_asset(device(), asset.job, result.files, sizes.picture);
    for (const auto& [name, image] :
         {std::pair{"high", &pictures.high}, std::pair{"low", &pictures.low},
          std::pair{"with_maps", &pictures.with_maps}, std::pair{"errors", &pictures.errors}}) {
      if (image->width != 0) asset_entry["pictures"][name] = data_uri(*image);
    }
    asset_entry["rendered"] = {{"mean_degrees", pictures.with_maps_degrees},
                               {"without_maps_degrees", pictures.without_maps_degrees},
                               {"scale_degrees", pictures.scale_degrees}};
    if (note.empty()) note = pictures.note;
  } catch (const Error& error) {
    note = std::string("No pictures: ") + error.what();
  }
  if (!note.empty()) asset_entry["rendered"]["note"] = note;
  return asset_entry;
}

}  // namespace

bool add_pictures(Json& report, const std::vector<BatchAsset>& assets,
                  const std::vector<AssetResult>& results, const std::function<Device()>& device,
                  BakeCache* cache, Console& console) {
  const PageSizes sizes = choose_page_sizes(results);
  std::optional<Device> opened;
  const auto open_device = [&] {
    if (!opened) opened = device();
    return *opened;
  };
  Json described = Json::array();
  for (std::size_t i = 0; i < results.size(); ++i) {
    Json asset = report.at("assets")[i];
    if (!results[i].files.empty()) {
      const double share = static_cast<double>(i) / static_cast<double>(results.size());
      if (!console.progress(share, assets[i].name + ": pictures")) return false;
      const std::string key =
          cache == nullptr ? ""
                           : cache->derived_data_key(assets[i], results[i].files,
                                                     "page " + std::to_string(sizes.picture) + " " +
                                                         std::to_string(sizes.map));
      Json asset_entry;
      if (cache != nullptr) asset_entry = Json::parse(cache->get_derived_data(key).value_or(""));
      if (!asset_entry.is_object()) {
        asset_entry = drawn_asset(assets[i], results[i], open_device, sizes);
        if (cache != nullptr)
          cache->put_derived_data(key, asset_entry.with_texts(escape_bytes).dump());
      } else {
        asset_entry = asset_entry.with_texts(unescape_bytes);
      }
      asset.update(asset_entry);
    }
    described.push_back(std::move(asset));
  }
  report["assets"] = std::move(described);
  return true;
}

Json remove_picture_bytes(const Json& report) {
  Json result = report;
  Json assets = Json::array();
  const auto without = [](const Json& object, std::initializer_list<std::string_view> left_out) {
    Json rest = Json::object();
    for (const std::string& key : object.keys()) {
      if (std::find(left_out.begin(), left_out.end(), key) == left_out.end())
        rest[key] = object.at(key);
    }
    return rest;
  };
  for (const Json& asset : report.at("assets").elements()) {
    Json rest = without(asset, {"pictures"});
    if (asset.at("maps").is_array()) {
      Json maps = Json::array();
      for (const Json& map : asset.at("maps").elements())
        maps.push_back(without(map, {"picture", "alpha"}));
      rest["maps"] = std::move(maps);
    }
    if (asset.at("baseline").is_object())
      rest["baseline"] = without(asset.at("baseline"), {"pictures", "maps"});
    assets.push_back(std::move(rest));
  }
  result["assets"] = std::move(assets);
  return result;
}

void save_page(const fs::path& path, const Json& report) {
  // Links are relative to the page's folder.
  const fs::path folder = os::absolute_normal(path).parent_path();
  Json linked = report, assets = Json::array();
  for (Json asset : report.at("assets").elements()) {
    Json maps = Json::array();
    for (Json map : asset.at("maps").elements()) {
      if (map.at("file").is_string()) {
        map["href"] =
            os::absolute_normal(map.at("file").text()).lexically_proximate(folder).generic_string();
      }
      maps.push_back(std::move(map));
    }
    if (asset.at("maps").is_array()) asset["maps"] = std::move(maps);
    assets.push_back(std::move(asset));
  }
  linked["assets"] = std::move(assets);
  const std::string page = kReportPage, mark = "@REPORT@";
  const std::size_t mark_start = page.find(mark);
  save_text(path, page.substr(0, mark_start) + std::string(kReportBegin) + report_in_page(linked) +
                      std::string(kReportEnd) + page.substr(mark_start + mark.size()));
}

}  // namespace kiln::cli
