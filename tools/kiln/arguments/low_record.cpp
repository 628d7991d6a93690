#include "arguments/low_record.h"

#include <algorithm>
#include <system_error>

#include "arguments/small_file.h"
#include "kiln/kiln.h"
#include "report/json_text.h"
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
  const Json json = Json::parse(head_of_file(path, kMostBytes), nullptr, false);
  if (!json.is_object() || !json.contains("low") || !json["low"].is_string()) return {};
  return folder / unescape_bytes(json["low"].get<std::string>());
}

bool same(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a, b, error);
}

}  // namespace

void check_low_record(const fs::path& folder, const std::string& stem, const fs::path& source,
                      const std::vector<fs::path>& maps) {
  std::error_code none;
  const auto there = std::find_if(maps.begin(), maps.end(),
                                  [&](const fs::path& map) { return fs::exists(map, none); });
  const fs::path recorded = recorded_source(folder, stem);
  // A mesh that is gone may have been renamed.
  if (there == maps.end() || recorded.empty() || !fs::exists(recorded, none)) return;
  // The low poly that Kiln wrote here is the one that these maps belong to.
  const fs::path made = folder / (stem + ".obj");
  if (same(recorded, source) || same(recorded, made) || same(source, made)) return;
  throw Error(ErrorCode::usage, "'" + there->string() + "' is a map of '" +
                                    recorded.lexically_normal().string() + "', and '" +
                                    source.string() +
                                    "' would write over it. Choose another --out, rename one of "
                                    "the meshes, or add --force.");
}

void save_low_record(const fs::path& folder, const std::string& stem, const fs::path& source) {
  std::error_code error;
  fs::path path = fs::relative(source, folder, error);
  if (error || path.empty()) path = fs::absolute(source);
  save_text(record_path(folder, stem), to_text({{"low", path.string()}}));
}

}  // namespace kiln::cli
