#include "arguments/low_record.h"

#include <algorithm>
#include <system_error>

#include "arguments/paths.h"
#include "arguments/small_file.h"
#include "kiln/files.h"
#include "kiln/kiln.h"
#include "report/json.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 1 << 16;

fs::path record_path(const fs::path& folder, const std::string& stem) {
  return folder / ("." + stem + ".kiln.json");
}

/// The mesh that a record names; empty where there is no record, or none of ours.
fs::path recorded_source(const fs::path& folder, const std::string& stem) {
  const fs::path path = record_path(folder, stem);
  if (!is_readable_file(path)) return {};
  Json json = Json::parse(head_of_file(path, kMostBytes));
  if (!json.is_object() || !json["low"].is_string()) return {};
  return folder / unescape_bytes(json["low"].text());
}

/// A map in a folder, of any format or UDIM tile: the first by name; empty where there is none.
fs::path map_of(const fs::path& folder, const std::string& stem) {
  std::string first;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    const bool is_map = std::any_of(maps().begin(), maps().end(), [&](const MapInfo& map) {
      return name.starts_with(stem + "_" + std::string(map.kind.name) + ".");
    });
    if (is_map && (first.empty() || name < first)) first = name;
  }
  return first.empty() ? fs::path() : folder / first;
}

}  // namespace

void check_low_record(const fs::path& folder, const std::string& stem, const fs::path& source) {
  const fs::path map = map_of(folder, stem);
  const fs::path recorded = recorded_source(folder, stem);
  std::error_code none;
  // A mesh that is gone may have been renamed.
  if (map.empty() || recorded.empty() || !fs::exists(recorded, none)) return;
  // The low poly that Kiln wrote here is the one that these maps belong to.
  const fs::path made = folder / (stem + ".obj");
  if (is_one_file(recorded, source) || is_one_file(recorded, made) || is_one_file(source, made))
    return;
  throw Error(ErrorCode::usage, "'" + map.string() + "' is a map of '" +
                                    recorded.lexically_normal().string() + "', and maps of '" +
                                    source.string() +
                                    "' would have its name. Choose another --out, rename one of "
                                    "the meshes, or add --force.");
}

void save_low_record(const fs::path& folder, const std::string& stem, const fs::path& source) {
  std::error_code error;
  fs::path path = fs::relative(source, folder, error);
  if (error || path.empty()) path = fs::absolute(source);
  Json record;
  record["low"] = path.string();
  save_text(record_path(folder, stem), to_text(record));
}

}  // namespace kiln::cli
