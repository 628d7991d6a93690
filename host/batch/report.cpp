#include "batch/report.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>

#include "job/describe.h"
#include "job/files.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/version.h"
#include "options/values.h"

namespace kiln {
namespace {

/// Maximum size of a report: ten thousand assets with pictures are about 100 MB.
constexpr std::size_t kMaxReportBytes = std::size_t{1} << 30;

/// Weights by which changes of assets are ranked, in degrees of rendered normals. A failure outweighs any error; a
/// missed share of 1% counts as 1 degree; a new kind of warning counts 0.1 degrees; changed pixels with the same error
/// come last.
struct ChangeWeights {
  static constexpr double kFailed = 1000, kMissedShare = 100, kWarning = 0.1, kPixels = 0.001;
};
/// Smallest changes of the mean angle in degrees, and of shares, that are reported. Smaller ones are rounding errors.
constexpr double kMinReportedDegrees = 0.005, kMinReportedShare = 0.0005;
/// A slower bake is reported if it takes more than this factor times the former time, and at least kMinSlowSeconds.
constexpr double kMinSlowdown = 2, kMinSlowSeconds = 1;

bool is_failure(const Json& asset) {
  const std::string& state = asset.at("state").text();
  return state == name_of(AssetState::failed) || state == name_of(AssetState::not_run) ||
         state == name_of(AssetState::cancelled);
}

std::map<std::string, const Json*> index_by_text(const Json& list, const char* key) {
  std::map<std::string, const Json*> found;
  for (const Json& element : list.elements()) found.try_emplace(element.at(key).text(), &element);
  return found;
}

std::string size_text(const Json& map) {
  return formatted("%.0f x %.0f x %.0f", map.at("width").number(), map.at("height").number(),
                   map.at("channels").number());
}

class Comparison {
 public:
  Json compare(const Json& former, const Json& now) {
    const bool failed = is_failure(now), had_failed = is_failure(former);
    if (failed && !had_failed)
      add_change(ChangeWeights::kFailed, "it failed, but succeeded before");
    if (!failed && had_failed) add_change(-ChangeWeights::kFailed, "it failed before");
    if (!failed && !had_failed) {
      compare_figures(former, now);
      compare_maps(former.at("maps"), now.at("maps"));
    }
    compare_warnings(former.at("warnings"), now.at("warnings"));
    return {{"state", changes_.empty() ? "same" : "changed"}, {"what", changes_}, {"worse", rank_}};
  }

 private:
  void add_change(double worse, const std::string& what) {
    rank_ += worse;
    changes_.push_back(what);
  }

  void compare_figures(const Json& former, const Json& now) {
    const Json &former_degrees = former.at("rendered.mean_degrees"),
               &degrees = now.at("rendered.mean_degrees");
    if (former_degrees.is_number() && degrees.is_number() &&
        std::abs(degrees.number() - former_degrees.number()) >= kMinReportedDegrees) {
      add_change(degrees.number() - former_degrees.number(),
                 formatted("rendered normals deviate by %.2f degrees, formerly %.2f",
                           degrees.number(), former_degrees.number()));
    }
    const double missed = now.at("missed").number(), missed_before = former.at("missed").number();
    if (std::abs(missed - missed_before) >= kMinReportedShare) {
      add_change(ChangeWeights::kMissedShare * (missed - missed_before),
                 formatted("%.3g%% of the samples are missed, formerly %.3g%%", 100 * missed,
                           100 * missed_before));
    }
    const bool both_baked = former.at("state").text() == name_of(AssetState::baked) &&
                            now.at("state").text() == name_of(AssetState::baked);
    const double seconds = now.at("seconds").number(),
                 former_seconds = former.at("seconds").number();
    if (both_baked && seconds >= kMinSlowSeconds && seconds > kMinSlowdown * former_seconds)
      add_change(0,
                 formatted("it took %.3g s; in the former report %.3g s", seconds, former_seconds));
  }

  void compare_maps(const Json& former, const Json& now) {
    // Reports that were not embedded in a page contain no maps.
    if (!former.is_array() || !now.is_array()) return;
    const auto former_maps = index_by_text(former, "name"),
               current_maps = index_by_text(now, "name");
    for (const auto& [name, map] : current_maps) {
      const auto former_entry = former_maps.find(name);
      if (former_entry == former_maps.end()) {
        add_change(0, name + " is new");
      } else if (size_text(*former_entry->second) != size_text(*map)) {
        add_change(ChangeWeights::kPixels,
                   name + " is " + size_text(*map) + ", not " + size_text(*former_entry->second));
      } else if (former_entry->second->at("hash").text() != map->at("hash").text()) {
        add_change(ChangeWeights::kPixels, name + " has other pixels");
      }
    }
    for (const auto& [name, map] : former_maps) {
      if (current_maps.count(name) == 0) add_change(ChangeWeights::kPixels, name + " is gone");
    }
  }

  void compare_warnings(const Json& former, const Json& now) {
    const auto former_warnings = index_by_text(former, "code"),
               current_warnings = index_by_text(now, "code");
    for (const auto& [code, warning] : current_warnings) {
      if (former_warnings.count(code) == 0)
        add_change(ChangeWeights::kWarning, "it warns now: " + code);
    }
    for (const auto& [code, warning] : former_warnings) {
      if (current_warnings.count(code) == 0)
        add_change(-ChangeWeights::kWarning, "a warning is gone: " + code);
    }
  }

  double rank_ = 0;
  std::vector<std::string> changes_;
};

/// Parses a report's shard "2/8".
/// \returns false if the report has no shard
bool read_shard(const Json& report, double& part, double& count) {
  const std::string& text = report.at("shard").text();
  const std::size_t slash = text.find('/');
  return slash != std::string::npos && read_number(text.substr(0, slash), part) &&
         read_number(text.substr(slash + 1), count);
}

}  // namespace

Json count_states(const Json& assets) {
  std::map<std::string, std::size_t> counts;
  for (const Json& asset : assets.elements()) ++counts[asset.at("state").text()];
  Json states = Json::object();
  for (const auto& [state, count] : counts) states[state] = count;
  return states;
}

Json report_of(const ReportHead& head, const Batch& batch,
               const std::vector<AssetResult>& results) {
  Json assets = Json::array();
  for (std::size_t i = 0; i < results.size(); ++i) {
    Json asset = to_json(batch.assets[i], results[i]);
    asset["report"] = results[i].report.empty() ? Json() : Json::parse(results[i].report);
    assets.push_back(std::move(asset));
  }
  const auto text_or_null = [](const std::string& text) {
    return text.empty() ? Json() : Json(text);
  };
  const Json states = count_states(assets);
  return {{"version", version()},
          {"job", head.job},
          {"profile", text_or_null(head.profile)},
          {"shard", text_or_null(head.shard)},
          {"seconds", head.seconds},
          {"states", states},
          {"warnings", describe(batch.warnings)},
          {"assets", std::move(assets)}};
}

std::string report_schema() {
  const Json text = {{"type", "string"}}, number = {{"type", "number"}},
             integer = {{"type", "integer"}, {"minimum", 0}};
  const Json text_or_null = {{"type", Json::array({"string", "null"})}};
  const Json number_or_null = {{"type", Json::array({"number", "null"})}};
  const auto list = [](const Json& items) { return Json{{"type", "array"}, {"items", items}}; };
  const auto object = [](const Json& properties, const Json& required) {
    return Json{{"type", "object"}, {"properties", properties}, {"required", required}};
  };
  const Json warning = object({{"code", text}, {"message", text}, {"count", integer}},
                              Json::array({"code", "message"}));
  const Json map = object({{"name", text},
                           {"file", text_or_null},
                           {"width", integer},
                           {"height", integer},
                           {"channels", integer},
                           {"min", list(number_or_null)},
                           {"mean", list(number_or_null)},
                           {"max", list(number_or_null)},
                           {"shown", list(number)},
                           {"hash", text},
                           {"picture", text},
                           {"alpha", text}},
                          Json::array({"name", "width", "height", "channels", "hash"}));
  const Json error = {
      {"type", Json::array({"object", "null"})},
      {"properties", {{"message", text}, {"id", text}, {"code", {{"type", "integer"}}}}},
      {"required", Json::array({"message", "id", "code"})}};
  const Json baseline = object({{"state", {{"enum", Json::array({"same", "changed", "new"})}}},
                                {"what", list(text)},
                                {"worse", number},
                                {"pictures", {{"type", "object"}}},
                                {"maps", {{"type", "object"}}}},
                               Json::array({"state", "what", "worse"}));
  const Json rendered = object({{"mean_degrees", number_or_null},
                                {"without_maps_degrees", number_or_null},
                                {"scale_degrees", number_or_null},
                                {"note", text_or_null}},
                               Json::array());
  Json states = Json::array();
  for (const AssetState state : {AssetState::not_run, AssetState::baked, AssetState::unchanged,
                                 AssetState::restored, AssetState::failed, AssetState::cancelled}) {
    states.push_back(name_of(state));
  }
  const Json asset = object({{"asset", text},
                             {"state", {{"enum", states}}},
                             {"seconds", number},
                             {"attempts", integer},
                             {"high", list(text)},
                             {"low", list(text)},
                             {"out", text},
                             {"files", list(text)},
                             {"warnings", list(warning)},
                             {"missed", number},
                             {"reason", text_or_null},
                             {"error", error},
                             {"report", {{"type", Json::array({"object", "null"})}}},
                             {"rendered", rendered},
                             {"maps", list(map)},
                             {"pictures", {{"type", "object"}, {"additionalProperties", text}}},
                             {"baseline", baseline}},
                            Json::array({"asset", "state", "seconds", "attempts", "high", "low",
                                         "out", "files", "warnings", "missed", "reason", "error"}));
  const Json schema = {
      {"$schema", "https://json-schema.org/draft/2020-12/schema"},
      {"title", "A report of kiln run"},
      {"type", "object"},
      {"properties",
       {{"version", text},
        {"job", text},
        {"profile", text_or_null},
        {"shard", text_or_null},
        {"seconds", number},
        {"states", {{"type", "object"}, {"additionalProperties", integer}}},
        {"warnings", list(warning)},
        {"assets", list(asset)},
        {"baseline", text_or_null},
        {"gone", list(text)}}},
      {"required", Json::array({"version", "job", "seconds", "states", "warnings", "assets"})}};
  return schema.dump(1);
}

std::string report_in_page(const Json& report) {
  const std::string text = report.with_texts(escape_bytes).dump();
  std::string escaped;
  escaped.reserve(text.size() + text.size() / 64);
  // In JSON, "<" occurs only within strings, where it may be escaped. U+2028 and U+2029 are harmless in a data element.
  for (const char c : text) {
    if (c == '<') {
      escaped += "\\u003c";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

Json read_report(const std::filesystem::path& path, const std::string& what) {
  std::string text = read_small_file(path, kMaxReportBytes, what);
  if (const std::size_t begin = text.find(kReportBegin); begin != std::string::npos) {
    const std::size_t json_begin = begin + kReportBegin.size();
    text = text.substr(json_begin,
                       std::min(text.find(kReportEnd, json_begin), text.size()) - json_begin);
  }
  Json report = Json::parse(text).with_texts(unescape_bytes);
  const Json& assets = report.at("assets");
  const bool is_report =
      assets.is_array() &&
      std::all_of(assets.elements().begin(), assets.elements().end(), [](const Json& asset) {
        return asset.at("asset").is_string() && asset.at("state").is_string() &&
               asset.at("seconds").is_number() && asset.at("missed").is_number();
      });
  if (!is_report) {
    throw Error(ErrorCode::input, what +
                                      " is not a report of kiln run: give a file that --json or "
                                      "--report wrote.");
  }
  return report;
}

Json merge_reports(const std::vector<Json>& reports, const std::vector<std::string>& names) {
  Json merged = reports.at(0);
  std::map<std::string, std::size_t> asset_reports;
  std::set<double> parts;
  double seconds = 0, count = 0;
  Json assets = Json::array(), warnings = Json::array();
  std::set<std::string> known_warnings;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    for (const char* const key : {"version", "profile"}) {
      if (reports[i].at(key).dump() == merged.at(key).dump()) continue;
      throw Error(ErrorCode::usage, std::string("--merge: '") + names[0] + "' and '" + names[i] +
                                        "' have different " + key +
                                        ": run all shards with the same settings.");
    }
    double part = 0, shard_count = 0;
    if (read_shard(reports[i], part, shard_count)) {
      if (count != 0 && shard_count != count) {
        throw Error(ErrorCode::usage, "--merge: '" + names[i] + "' is part " +
                                          reports[i].at("shard").text() + ", others are of " +
                                          formatted("%.0f", count) +
                                          ": run all shards with the same settings.");
      }
      count = shard_count;
      parts.insert(part);
    }
    seconds = std::max(seconds, reports[i].at("seconds").number());
    for (const Json& asset : reports[i].at("assets").elements()) {
      const auto [owner, added] = asset_reports.try_emplace(asset.at("asset").text(), i);
      if (!added) {
        throw Error(ErrorCode::usage, "--merge: '" + asset.at("asset").text() + "' is in '" +
                                          names[owner->second] + "' and in '" + names[i] +
                                          "': give each shard once.");
      }
      assets.push_back(asset);
    }
    for (const Json& warning : reports[i].at("warnings").elements()) {
      if (known_warnings.insert(warning.dump()).second) warnings.push_back(warning);
    }
  }
  for (double part = 1; part <= count; ++part) {
    if (parts.count(part) != 0) continue;
    throw Error(ErrorCode::usage, formatted("--merge: part %.0f/%.0f is missing: ", part, count) +
                                      "give the reports of all shards.");
  }
  // Assets are sorted by name, since those of one shard lie between those of others. A single run has the same order.
  std::vector<Json> sorted = assets.elements();
  std::sort(sorted.begin(), sorted.end(), [](const Json& a, const Json& b) {
    return a.at("asset").text() < b.at("asset").text();
  });
  merged["shard"] = Json();
  merged["seconds"] = seconds;
  merged["states"] = count_states(assets);
  merged["warnings"] = std::move(warnings);
  merged["assets"] = Json(sorted);
  return merged;
}

void add_baseline(Json& report, const Json& former) {
  const auto former_assets = index_by_text(former.at("assets"), "asset");
  std::set<std::string> current_names;
  Json assets = Json::array();
  for (Json asset : report.at("assets").elements()) {
    const std::string name = asset.at("asset").text();
    current_names.insert(name);
    const auto former_entry = former_assets.find(name);
    if (former_entry == former_assets.end()) {
      asset["baseline"] = {{"state", "new"},
                           {"what", Json::array({"it is new"})},
                           {"worse", is_failure(asset) ? ChangeWeights::kFailed : 0.0}};
    } else {
      Json baseline = Comparison().compare(*former_entry->second, asset);
      if (baseline.at("state").text() == "changed") {
        // A page shows the former pictures beside the new ones.
        if (former_entry->second->at("pictures").is_object())
          baseline["pictures"] = former_entry->second->at("pictures");
        Json maps = Json::object();
        for (const Json& map : former_entry->second->at("maps").elements()) {
          if (map.at("picture").is_string()) maps[map.at("name").text()] = map;
        }
        baseline["maps"] = std::move(maps);
      }
      asset["baseline"] = std::move(baseline);
    }
    assets.push_back(std::move(asset));
  }
  Json removed = Json::array();
  for (const auto& [name, asset] : former_assets) {
    if (current_names.count(name) == 0) removed.push_back(name);
  }
  report["assets"] = std::move(assets);
  report["gone"] = std::move(removed);
}

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace kiln
