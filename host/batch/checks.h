// Checks outputs: golden maps, limits, hashes.
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
/// The path of an output's golden file.
std::filesystem::path golden_path(const JobFile& file, const std::string& output);
/// Copies an asset's files to the golden folder, through the open OutputSet, if any. \returns files that are new or
/// changed
std::vector<std::string> accept_asset(const JobFile& file, const AssetResult& result);
/// Golden files that belong to no output of a run. Searches the folders that contain golden files of the run's outputs.
std::vector<std::string> golden_without_outputs(const JobFile& file,
                                                const std::vector<AssetResult>& results);

/// True if a file's extension is that of a map whose texels can be compared.
bool is_map_file(const std::filesystem::path& path);
/// True if a file's name belongs to a map of unit vectors, such as "low_normal.png".
bool holds_directions(const std::filesystem::path& map);
/// The path of the `mask` beside a map of the same low poly, whose zero texels are excluded from comparisons. Empty if
/// there is none.
std::filesystem::path find_mask_beside(const std::filesystem::path& map);
/// Hash of a picture's size, channels and values, independent of its compression; for other files, the hash of their
/// bytes.
std::string pixel_hash(const std::filesystem::path& path);
/// Hash of a decoded picture's size, channels and values.
std::string pixel_hash(const Image& image);
/// Formats hashes as lines of "HASH PATH".
/// \param hashes  hashes by path
std::string format_hashes(const std::map<std::string, std::string>& hashes);
/// The inverse of format_hashes().
/// \param file  file name for messages
/// \throws Error(input)
std::map<std::string, std::string> parse_hashes(const std::string& text, const std::string& file);
/// The differences of two lists of hashes, one sentence per file.
std::vector<std::string> compare_hashes(const std::map<std::string, std::string>& expected,
                                        const std::map<std::string, std::string>& actual);

/// Results as JUnit XML, one test case per asset.
/// \param assets  a list of results of to_json()
std::string format_junit(const std::string& name, const Json& assets);

/// Distributes assets over `count` shards of about equal expected time. \returns the shard of each asset; identical on
/// all machines
std::vector<std::size_t> assign_shards(const std::vector<BatchAsset>& assets, std::size_t count);

}  // namespace kiln
