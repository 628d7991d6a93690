// Checks the outputs of a run against golden maps, limits and hashes.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "batch/job_file.h"
#include "batch/runner.h"
#include "kiln/image_data.h"

namespace kiln {

/// Checks an asset by the rules of [check]: golden maps, and the share of missed samples.
/// \returns one sentence per problem
std::vector<std::string> check_asset(const JobFile& file, const AssetResult& result);
/// Returns the path of the golden file with which an output is compared.
std::filesystem::path golden_path(const JobFile& file, const std::string& output);
/// Copies an asset's files to the golden folder, through the open OutputSet, if any. \returns files that are new or
/// changed
std::vector<std::string> accept_asset(const JobFile& file, const AssetResult& result);
/// Finds golden files that belong to no output of a run, in the folders that contain golden files of the run's outputs.
std::vector<std::string> golden_without_outputs(const JobFile& file,
                                                const std::vector<AssetResult>& results);

/// True if the file's extension is that of a picture, so that its texels can be compared.
bool is_map_file(const std::filesystem::path& path);
/// True if the file's name, such as "low_normal.png", is that of a map of unit vectors.
bool holds_directions(const std::filesystem::path& map);
/// Finds the map `mask` that was baked with a map. Its zero texels are excluded from comparisons of the map.
/// \returns its path; empty if there is none
std::filesystem::path find_mask_beside(const std::filesystem::path& map);
/// Hashes a picture's size, channels and values, independently of its compression; hashes the bytes of other files.
std::string pixel_hash(const std::filesystem::path& path);
/// Hashes a decoded picture's size, channels and values.
std::string pixel_hash(const Image& image);
/// Formats hashes as lines of "HASH PATH".
/// \param hashes  hashes by path
std::string format_hashes(const std::map<std::string, std::string>& hashes);
/// Parses the lines of format_hashes() to hashes by path.
/// \param file  file name for messages
/// \throws Error(input)
std::map<std::string, std::string> parse_hashes(const std::string& text, const std::string& file);
/// Compares two lists of hashes by path. \returns one sentence per file that differs
std::vector<std::string> compare_hashes(const std::map<std::string, std::string>& expected,
                                        const std::map<std::string, std::string>& actual);

/// Formats results as JUnit XML, with one test case per asset.
/// \param assets  a list of the assets' results, each from to_json()
std::string format_junit(const std::string& name, const Json& assets);

/// Distributes assets over `count` shards of about equal expected time. \returns the shard of each asset; identical on
/// all machines
std::vector<std::size_t> assign_shards(const std::vector<BatchAsset>& assets, std::size_t count);

}  // namespace kiln
