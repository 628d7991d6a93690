// What came out beside what is wanted: golden maps, limits, hashes.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "batch/job_file.h"
#include "batch/runner.h"
#include "kiln/image.h"

namespace kiln {

/// Holds an asset's files to [check]: golden maps, and the share of missed samples.
/// \returns what is wrong, a sentence each; none: nothing is
std::vector<std::string> check_asset(const JobFile& file, const AssetResult& result);
/// The golden file of an output.
std::filesystem::path golden_of(const JobFile& file, const std::string& output);
/// Makes an asset's files the golden ones, as files of the open OutputSet, if any. \returns those that are new or other
std::vector<std::string> accept_asset(const JobFile& file, const AssetResult& result);
/// Golden files beside those of a run's outputs that no output stands for.
std::vector<std::string> golden_without_outputs(const JobFile& file,
                                                const std::vector<AssetResult>& results);

/// True if a file may be a map whose texels can be compared, by its ending.
bool is_map_file(const std::filesystem::path& path);
/// True if a file's name is that of a map of unit vectors: "low_normal.png".
bool holds_directions(const std::filesystem::path& map);
/// The map `mask` beside a map of the same low poly: its texels that are 0 do not count. Empty: there is none.
std::filesystem::path mask_beside(const std::filesystem::path& map);
/// Hash of a picture's size, channels and values, whatever its file is packed like; of other files that of their bytes.
std::string pixel_hash(const std::filesystem::path& path);
/// The same of a picture that was read.
std::string pixel_hash(const Image& image);
/// "HASH  PATH" a line. \param hashes  by path
std::string hashes_text(const std::map<std::string, std::string>& hashes);
/// Of such a text. \param file  for messages \throws Error(input)
std::map<std::string, std::string> parse_hashes(const std::string& text, const std::string& file);
/// How two lists differ, a sentence a file.
std::vector<std::string> compare_hashes(const std::map<std::string, std::string>& wanted,
                                        const std::map<std::string, std::string>& found);

/// Results as JUnit's XML, a case an asset. \param assets  of to_json()
std::string junit_text(const std::string& name, const Json& assets);

/// Which of `count` parts of about equal expected seconds each asset belongs to: the same on all machines.
std::vector<std::size_t> shards_of(const std::vector<BatchAsset>& assets, std::size_t count);

}  // namespace kiln
