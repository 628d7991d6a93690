#include "batch/checks.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <numeric>
#include <set>
#include <sstream>
#include <system_error>

#include "base/file.h"
#include "base/lower_case.h"
#include "batch/content_hash.h"
#include "io/file/atomic_file.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "kiln/map.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::string read_bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Finds the map whose name ends the stem of a file, such as "normal" for "low_normal"; of several, the one with the
/// longest name. \returns null if there is none
const MapInfo* find_map_by_stem(const fs::path& file) {
  const std::string stem = file.stem().string();
  const MapInfo* found = nullptr;
  for (const MapInfo& map : maps()) {
    const std::string name(map.kind.name);
    // A UDIM tile's number follows the map's name: "low_normal.1001".
    const std::size_t suffix_start = stem.rfind("_" + name);
    if (suffix_start == std::string::npos) continue;
    const std::size_t end = suffix_start + 1 + name.size();
    if (end != stem.size() && stem[end] != '.') continue;
    if (found == nullptr || name.size() > found->kind.name.size()) found = &map;
  }
  return found;
}

/// Finds the limit for a map; if there is none, the limit for all maps. \returns null if there is none either
const CheckLimit* find_limit(const CheckRules& rules, const std::string& map,
                             const std::string& measure) {
  const CheckLimit* limit_for_all_maps = nullptr;
  for (const CheckLimit& limit : rules.limits) {
    if (limit.measure != measure) continue;
    if (!limit.map.empty() && limit.map == map) return &limit;
    if (limit.map.empty()) limit_for_all_maps = &limit;
  }
  return limit_for_all_maps;
}

/// Compares an output with its golden map. \returns the difference as a sentence; empty if it is within the limits
std::string compare_with_golden(const CheckRules& rules, const fs::path& output,
                                const fs::path& golden, const Image* mask) {
  if (read_bytes(output) == read_bytes(golden)) return {};
  if (!is_map_file(output)) return "its bytes differ from '" + golden.string() + "'";
  const Image output_image = load_image(output), golden_image = load_image(golden);
  if (output_image.width != golden_image.width || output_image.height != golden_image.height ||
      output_image.channels != golden_image.channels) {
    return formatted("it has %u x %u texels of %u channels, '", output_image.width,
                     output_image.height, output_image.channels) +
           golden.string() +
           formatted("' %u x %u of %u: restore the size, or accept the new one by --accept",
                     golden_image.width, golden_image.height, golden_image.channels);
  }
  const MapInfo* const info = find_map_by_stem(output);
  const bool compares_angles =
      info != nullptr && info->type == MapType::unit_vector && output_image.channels >= 3;
  const std::string map = info == nullptr ? "" : std::string(info->kind.name);
  const Image* const compared_texels =
      mask != nullptr && mask->width == output_image.width && mask->height == output_image.height
          ? mask
          : nullptr;
  const Image differences =
      image_differences(output_image, golden_image, compared_texels, !compares_angles);
  const CheckLimit* const max = find_limit(rules, map, "max");
  const CheckLimit* const mean = find_limit(rules, map, "mean");
  const CheckLimit* const outliers = find_limit(rules, map, "outliers");
  // Without limits, all texels must be equal. If the mean has a limit and the maximum has none, single texels may
  // differ by any amount, and `outliers` has no effect.
  const double max_difference = max != nullptr ? max->value : mean != nullptr ? HUGE_VAL : 0;
  double sum = 0, max_found = 0;
  std::uint64_t count = 0, beyond_count = 0;
  for (const float value : differences.pixels) {
    if (value < 0) continue;
    ++count;
    sum += double{value};
    max_found = std::max(max_found, double{value});
    // Differences have single precision, so limits in decimal digits need a tolerance.
    beyond_count += double{value} > max_difference * (1 + 1e-6) ? 1 : 0;
  }
  if (count == 0) return {};
  const char* const unit = compares_angles ? " degrees" : "";
  const double share = static_cast<double>(beyond_count) / static_cast<double>(count);
  if (share > (outliers != nullptr ? outliers->value : 0)) {
    return formatted("%.4g%% of its texels differ from '", 100 * share) + golden.string() +
           formatted("' by more than %.4g%s, at most by %.4g (allowed: %.4g%%)", max_difference,
                     unit, max_found, 100 * (outliers != nullptr ? outliers->value : 0));
  }
  const double average = sum / static_cast<double>(count);
  if (mean != nullptr && average > mean->value) {
    return formatted("it differs by %.4g%s on average from '", average, unit) + golden.string() +
           formatted("' (allowed: %.4g)", mean->value);
  }
  return {};
}

/// Returns the stem of the file of the map `mask` that belongs to the file of another map; empty if that is not a map.
std::string mask_stem(const fs::path& file) {
  const MapInfo* const info = find_map_by_stem(file);
  if (info == nullptr) return {};
  std::string name = file.stem().string();
  name.replace(name.rfind("_" + std::string(info->kind.name)) + 1, info->kind.name.size(), "mask");
  return name;
}

bool is_mask(const fs::path& file) {
  const MapInfo* const info = find_map_by_stem(file);
  return info != nullptr && info->type == MapType::coverage && info->kind.name == "mask";
}

/// Loads the map `mask` that was baked with an output; nullopt if there is none.
std::optional<Image> load_mask_of(const AssetResult& result, const fs::path& output) {
  const std::string name = mask_stem(output);
  for (const std::string& file : result.files) {
    if (!name.empty() && is_mask(file) && fs::path(file).stem().string() == name)
      return load_image(file);
  }
  return std::nullopt;
}

fs::path absolute_path(const fs::path& path) {
  return os::absolute_normal(path.empty() ? fs::path(".") : path);
}

}  // namespace

bool is_map_file(const fs::path& path) {
  constexpr std::array kEndings = {".png", ".exr", ".tif", ".tiff", ".tga", ".webp"};
  const std::string ending = lower_case(path.extension().string());
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

fs::path golden_path(const JobFile& file, const std::string& output) {
  const fs::path relative_path =
      absolute_path(output).lexically_relative(absolute_path(file.folder / "x").parent_path());
  return file.folder / file.check.golden / relative_path;
}

std::vector<std::string> check_asset(const JobFile& file, const AssetResult& result) {
  std::vector<std::string> problems;
  if (const CheckLimit* const missed = find_limit(file.check, "", "missed");
      missed != nullptr && result.missed > missed->value) {
    problems.push_back(formatted("%.4g%% of the samples were missed (allowed: %.4g%%)",
                                 100 * result.missed, 100 * missed->value));
  }
  if (file.check.golden.empty()) return problems;
  for (const std::string& output : result.files) {
    const fs::path golden = golden_path(file, output);
    std::error_code error;
    if (!fs::exists(golden, error)) {
      problems.push_back("'" + output + "': there is no '" + golden.string() +
                         "': inspect the map, and accept it by --accept '" + result.name + "'");
      continue;
    }
    const std::optional<Image> mask =
        is_map_file(output) ? load_mask_of(result, output) : std::nullopt;
    const std::string problem =
        compare_with_golden(file.check, output, golden, mask ? &*mask : nullptr);
    if (!problem.empty()) problems.push_back("'" + output + "': " + problem);
  }
  return problems;
}

std::vector<std::string> accept_asset(const JobFile& file, const AssetResult& result) {
  std::vector<std::string> changed;
  for (const std::string& output : result.files) {
    const fs::path golden = golden_path(file, output);
    const std::string bytes = read_bytes(output);
    std::error_code error;
    if (fs::exists(golden, error) && read_bytes(golden) == bytes) continue;
    prepare_output_folder(golden.parent_path());
    AtomicFile out(golden);
    out.write(bytes);
    out.commit();
    changed.push_back(golden.string());
  }
  return changed;
}

std::vector<std::string> golden_without_outputs(const JobFile& file,
                                                const std::vector<AssetResult>& results) {
  std::set<fs::path> expected, folders;
  for (const AssetResult& result : results) {
    for (const std::string& output : result.files) {
      const fs::path golden = absolute_path(golden_path(file, output));
      expected.insert(golden);
      folders.insert(golden.parent_path());
    }
  }
  std::vector<std::string> stale_files;
  for (const fs::path& folder : folders) {
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
      const fs::path path = absolute_path(entry->path());
      const bool hidden = path.filename().string().starts_with('.');
      std::error_code ignored_error;
      if (!hidden && entry->is_regular_file(ignored_error) && expected.count(path) == 0)
        stale_files.push_back(path.string());
    }
  }
  return stale_files;
}

bool holds_directions(const fs::path& map) {
  const MapInfo* const info = find_map_by_stem(map);
  return info != nullptr && info->type == MapType::unit_vector;
}

fs::path find_mask_beside(const fs::path& map) {
  const std::string name = mask_stem(map);
  std::error_code error;
  const fs::path file = map.parent_path() / (name + map.extension().string());
  return !name.empty() && file != map && is_mask(file) && fs::is_regular_file(file, error)
             ? file
             : fs::path();
}

std::string pixel_hash(const fs::path& path) {
  return is_map_file(path) ? pixel_hash(load_image(path)) : file_hash(path).value_or("");
}

std::string pixel_hash(const Image& image) {
  ContentHash hash;
  const std::array<std::uint32_t, 3> sizes = {image.width, image.height, image.channels};
  hash.add(std::as_bytes(std::span(sizes)));
  hash.add_array(image.pixels);
  return hash.text();
}

std::string format_hashes(const std::map<std::string, std::string>& hashes) {
  std::string text;
  for (const auto& [path, hash] : hashes) text += hash + "  " + escape_bytes(path) + "\n";
  return text;
}

std::map<std::string, std::string> parse_hashes(const std::string& text, const std::string& file) {
  constexpr std::size_t kHashDigits = 32;
  std::map<std::string, std::string> hashes;
  std::istringstream in(text);
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty()) continue;
    const bool is_valid = line.size() > kHashDigits + 2 && line.substr(kHashDigits, 2) == "  " &&
                          line.find_first_not_of("0123456789abcdef") == kHashDigits;
    if (!is_valid) {
      throw Error(ErrorCode::input, "'" + file + "':" + std::to_string(number) +
                                        ": this is not a line of --hashes: create the file again.");
    }
    hashes[unescape_bytes(line.substr(kHashDigits + 2))] = line.substr(0, kHashDigits);
  }
  return hashes;
}

std::vector<std::string> compare_hashes(const std::map<std::string, std::string>& expected_hashes,
                                        const std::map<std::string, std::string>& actual_hashes) {
  std::vector<std::string> differences;
  for (const auto& [path, hash] : expected_hashes) {
    const auto output_hash = actual_hashes.find(path);
    if (output_hash == actual_hashes.end()) {
      differences.push_back("'" + path + "' was not written");
    } else if (output_hash->second != hash) {
      differences.push_back("'" + path + "' has different pixels: " + output_hash->second +
                            ", not " + hash);
    }
  }
  for (const auto& [path, hash] : actual_hashes) {
    if (expected_hashes.count(path) == 0)
      differences.push_back("'" + path + "' is not in the list");
  }
  return differences;
}

namespace {

/// Escapes text for XML and removes characters that XML does not allow.
std::string xml_text(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '&':
        escaped += "&amp;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return escaped;
}

}  // namespace

std::string format_junit(const std::string& name, const Json& assets) {
  std::size_t failures = 0;
  double seconds = 0;
  std::string cases;
  for (const Json& asset : assets.elements()) {
    const Json& error = asset.at("error");
    const double asset_seconds = asset.at("seconds").number();
    seconds += asset_seconds;
    cases += "  <testcase classname=\"" + xml_text(name) + "\" name=\"" +
             xml_text(escape_bytes(asset.at("asset").text())) +
             formatted("\" time=\"%.3f\"", asset_seconds);
    if (error.is_null() && asset.at("state").text() != "not run" &&
        asset.at("state").text() != "cancelled") {
      cases += "/>\n";
      continue;
    }
    ++failures;
    const std::string message =
        error.is_null() ? asset.at("state").text() : escape_bytes(error.at("message").text());
    const std::string type = error.is_null() ? "cancelled" : error.at("id").text();
    cases += ">\n    <failure type=\"" + xml_text(type) + "\" message=\"" +
             xml_text(message.substr(0, message.find('\n'))) + "\">" + xml_text(message) +
             "</failure>\n  </testcase>\n";
  }
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"" + xml_text(name) +
         formatted("\" tests=\"%zu\" failures=\"%zu\" errors=\"0\" time=\"%.3f\">\n", assets.size(),
                   failures, seconds) +
         cases + "</testsuite>\n";
}

std::vector<std::size_t> assign_shards(const std::vector<BatchAsset>& assets, std::size_t count) {
  // Greedy distribution: in order of decreasing expected time (ties: by name), each asset is added to the shard with
  // the smallest total so far.
  std::vector<std::size_t> order(assets.size()), shards(assets.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (assets[a].expected_seconds != assets[b].expected_seconds) {
      return assets[a].expected_seconds > assets[b].expected_seconds;
    }
    return assets[a].name < assets[b].name;
  });
  std::vector<double> seconds(count);
  for (const std::size_t i : order) {
    const auto smallest_shard = std::min_element(seconds.begin(), seconds.end());
    shards[i] = static_cast<std::size_t>(smallest_shard - seconds.begin());
    *smallest_shard += std::max(1e-9, assets[i].expected_seconds);
  }
  return shards;
}

}  // namespace kiln
