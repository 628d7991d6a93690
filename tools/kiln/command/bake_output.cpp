// The files of a bake.
#include <algorithm>

#include "arguments/low_record.h"
#include "arguments/paths.h"
#include "command/bake_run.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kClusters = "_clusters.exr";

/// Of a map for one of several clusters of directions.
std::string cluster_name(const std::string& map, std::uint32_t cluster) {
  return cluster == 0 ? map : map + "_" + std::to_string(cluster);
}

bool has_clusters(const std::string& map) { return find_map(map).type != MapType::coverage; }

/// Values of a map's channels that lie at 0 and at 1 in a file; none where it holds them as they are.
std::vector<ValueRange> stored_ranges(const BakedMap& map, const BakeResult& result,
                                      const SaveImageOptions& options) {
  std::vector<ValueRange> ranges;
  for (std::uint32_t c = 0; c < map.image.channels && !is_exr(options); ++c) {
    ranges.push_back(value_range(map, result.coverage, c));
    if (ranges[c].low == 0 && ranges[c].high == 1) return {};
  }
  return ranges;
}

/// Moves values into [0, 1].
void store_in(const std::vector<ValueRange>& ranges, Image& image) {
  if (ranges.empty()) return;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const auto [low, high] = ranges[i % image.channels];
    image.pixels[i] = high > low ? (image.pixels[i] - low) / (high - low) : 0.5F;
  }
}

Json range_json(const std::vector<ValueRange>& ranges) {
  Json json = Json::array();
  for (const auto [low, high] : ranges) json.push_back({low, high});
  return json;
}

/// The levels of a map's mip-map, and the file that each is in.
Json describe_levels(const BakedMap& map, const std::vector<fs::path>& files) {
  Json levels = Json::array();
  for (std::size_t level = 0; level <= map.mips.size(); ++level) {
    const Image& image = level == 0 ? map.image : map.mips[level - 1];
    levels.push_back({{"level", level},
                      {"width", image.width},
                      {"height", image.height},
                      {"file", files[std::min(level, files.size() - 1)].string()}});
  }
  return levels;
}

/// \returns false where it was cancelled
bool announce(BakeRun& run, const fs::path& path) {
  run.outputs.push_back(path.string());
  return run.console.progress(kAtSave, "writing " + path.string());
}

/// One map, with its mip chain. \returns false where it was cancelled
bool save_map(BakeRun& run, BakedMap& map) {
  const SaveImageOptions& options = run.save_options;
  const std::string name = cluster_name(map_name(map.kind), map.cluster);
  if (const std::vector<ValueRange> range = stored_ranges(map, run.result, options);
      !range.empty()) {
    store_in(range, map.image);
    for (Image& level : map.mips) store_in(range, level);
    run.ranges[name] = range_json(range);
  }
  const std::vector<fs::path> files =
      map_files(run.arguments.out, run.low.stem + "_" + name, map.mips.size(), options);
  for (std::size_t level = 0; level < files.size(); ++level) {
    if (!announce(run, files[level])) return false;
    if (run.options.mips && is_exr(options)) {
      save_mipmapped(map.image, map.mips, files[level], options);
    } else {
      save_image(level == 0 ? map.image : map.mips[level - 1], files[level], options);
    }
  }
  if (run.options.mips) run.mips[name] = describe_levels(map, files);
  return true;
}

}  // namespace

void check_outputs(const BakeArguments& arguments, const SaveImageOptions& save_options) {
  const fs::path folder = arguments.out;
  if (folder.empty()) throw Error(ErrorCode::usage, "--out is empty: give a folder.");
  if (!arguments.save_match.empty() && fs::path(arguments.save_match).extension() != ".exr") {
    throw Error(ErrorCode::usage, "--save-match '" + arguments.save_match +
                                      "': a match is an EXR, so the name must end in .exr.");
  }
  const std::string stem = low_stem(arguments);
  std::vector<fs::path> outputs = {arguments.json, arguments.save_match};
  for (const std::string& map : arguments.maps) {
    outputs.push_back(folder / (stem + "_" + map + extension(save_options)));
    for (std::uint32_t k = 1; k < arguments.visibility_clusters && has_clusters(map); ++k) {
      outputs.push_back(folder / (stem + "_" + cluster_name(map, k) + extension(save_options)));
    }
  }
  if (arguments.visibility_clusters > 1) outputs.push_back(folder / (stem + kClusters));
  if (arguments.low.empty() || arguments.unwrap) outputs.push_back(folder / (stem + ".obj"));
  check_paths({arguments.high, arguments.low, arguments.cage_mesh, arguments.load_match}, outputs);
  if (arguments.low.empty() || arguments.unwrap) {
    check_not_foreign(folder / (stem + ".obj"), arguments.force);
  }
  if (!arguments.force) check_low_record(folder, stem, low_source(arguments));
}

bool save_outputs(BakeRun& run) {
  const fs::path folder = run.arguments.out;
  if (run.low.made) {
    const fs::path path = folder / (run.low.stem + ".obj");
    if (!announce(run, path)) return false;
    save_obj(run.low.mesh, path);
  }
  for (BakedMap& map : run.result.maps) {
    if (!save_map(run, map)) return false;
  }
  if (run.result.clusters) {
    const fs::path path = folder / (run.low.stem + kClusters);
    if (!announce(run, path)) return false;
    save_clusters(*run.result.clusters, path);
  }
  if (!run.arguments.save_match.empty()) {
    if (!announce(run, run.arguments.save_match)) return false;
    save_match(*run.result.match, run.arguments.save_match);
  }
  save_low_record(folder, run.low.stem, low_source(run.arguments));
  return true;
}

}  // namespace kiln::cli
