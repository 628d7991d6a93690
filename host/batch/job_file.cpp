#include "batch/job_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "base/lower_case.h"
#include "batch/path_pattern.h"
#include "job/files.h"
#include "job/job_options.h"
#include "job/map_words.h"
#include "kiln/error.h"
#include "kiln/job.h"
#include "kiln/options.h"
#include "kiln/version.h"
#include "options/near_words.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSidecarBytes = std::size_t{1} << 20;
constexpr std::array kRunKeys = {"skip", "name", "retries", "timeout", "before", "after"};
/// Options that apply to the whole run, which only the command line can set.
constexpr std::array kWholeRunOptions = {"device", "quiet"};

[[noreturn]] void fail_in(const Origin& origin, const std::string& key, const Message& problem) {
  throw Error(ErrorCode::usage, origin.place() + ": " + key + ": " + problem);
}

/// Returns all keys that a table of a job file may have.
std::vector<std::string> known_keys() {
  std::vector<std::string> keys(kRunKeys.begin(), kRunKeys.end());
  for (const OptionRow& row : bake_rows()) keys.push_back(option_key(row));
  return keys;
}

std::string dashes_to_underscores(std::string key) {
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

/// Returns the end of a message about an unknown key: "; did you mean size?", or a list of the known keys.
std::string suggest_key(const std::string& word, const std::vector<std::string>& known) {
  const std::string suggestion = nearest_word(word, known);
  if (!suggestion.empty()) return "; did you mean " + suggestion + "?";
  std::string list;
  for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
  return known.size() > 12 ? ": kiln bake --help lists options." : "; there are " + list + ".";
}

void check_keys(const TomlValue& table, const std::string& file, const std::string& table_name,
                const std::vector<std::string>& known) {
  for (std::size_t i = 0; i < table.keys.size(); ++i) {
    if (std::find(known.begin(), known.end(), table.keys[i]) != known.end()) continue;
    throw Error(ErrorCode::usage, file + ":" + std::to_string(table.elements[i].line) + ": " +
                                      table_name + " has no key '" + table.keys[i] + "'" +
                                      suggest_key(table.keys[i], known));
  }
}

class LayerReader {
 public:
  LayerReader(std::string file, std::string layer, std::string folder)
      : file_(std::move(file)), layer_(std::move(layer)), folder_(std::move(folder)) {}

  OptionLayer read_layer(const TomlValue& table) const {
    OptionLayer layer{layer_, {}};
    for (std::size_t i = 0; i < table.keys.size(); ++i) {
      Setting setting = read_setting(table.keys[i], table.elements[i]);
      if (const Setting* const other = layer.find(setting.key)) {
        fail_in(setting.origin, table.keys[i],
                "line " + std::to_string(other->origin.line) + " sets it, too: remove one.");
      }
      layer.settings.push_back(std::move(setting));
    }
    return layer;
  }

  Origin origin(const TomlValue& value) const { return {layer_, file_, value.line}; }

 private:
  Setting read_setting(const std::string& name, const TomlValue& value) const {
    Setting setting{dashes_to_underscores(name), {}, false, origin(value), folder_};
    if (is_run_key(setting.key)) {
      read_run_key(setting, value);
      return setting;
    }
    const OptionRow* row = find_option_row(setting.key);
    if (row == nullptr) {
      fail_in(setting.origin, name,
              "there is no such option" + suggest_key(setting.key, known_keys()));
    }
    setting.key = option_key(*row);
    if (std::find(kWholeRunOptions.begin(), kWholeRunOptions.end(), setting.key) !=
        kWholeRunOptions.end()) {
      fail_in(setting.origin, name,
              "this applies to the whole run: use the flag kiln run --" + setting.key + ".");
    }
    const TomlValue* words = &value;
    if (value.is_table() && value.find("file") != nullptr) {
      check_keys(value, file_, name, {"file", "optional"});
      // If the value of `cage` names a file, it is stored as a setting of the option `cage_mesh`.
      if (setting.key == "cage") setting.key = "cage_mesh";
      row = find_option_row(setting.key);
      words = value.find("file");
      if (path_access(*row) != PathAccess::input) {
        fail_in(
            setting.origin, name,
            "only input files may be optional, but this option takes no input file: give the value "
            "without optional.");
      }
      if (const TomlValue* const optional = value.find("optional")) {
        if (optional->kind != TomlValue::Kind::boolean) {
          fail_in(origin(*optional), "optional",
                  std::string("it is ") + optional->kind_name() + ": give true or false.");
        }
        setting.optional = optional->text == "true";
      }
      if (setting.optional && (setting.key == "high" || setting.key == "low")) {
        fail_in(
            setting.origin, name,
            "the baked mesh cannot be optional: use a pattern that only matches existing files.");
      }
    }
    setting.words = parse_words(*row, name, *words);
    check_option(*row, setting, words->is_list());
    return setting;
  }

  OptionWords parse_words(const OptionRow& row, const std::string& name,
                          const TomlValue& value) const {
    OptionWords words;
    if (value.is_list()) {
      if (value.elements.empty())
        fail_in(origin(value), name, "the list is empty: remove it, or add a value.");
      for (const TomlValue& element : value.elements)
        words.push_back(parse_word(name, element, false));
    } else if (value.is_table()) {
      if (!row.value.repeats) fail_in(origin(value), name, "it is a table: give one value.");
      for (std::size_t i = 0; i < value.keys.size(); ++i) {
        words.push_back(value.keys[i] + "=" + parse_word(name, value.elements[i], true));
      }
    } else {
      words.push_back(parse_word(name, value, false));
    }
    return words;
  }

  std::string parse_word(const std::string& name, const TomlValue& value, bool allow_lists) const {
    if (value.is_list() && allow_lists) {
      std::string text;
      for (const TomlValue& element : value.elements) {
        text += (text.empty() ? "" : ",") + parse_word(name, element, false);
      }
      return text;
    }
    if (value.is_list() || value.is_table() || value.kind == TomlValue::Kind::date) {
      fail_in(origin(value), name,
              std::string("it is ") + value.kind_name() + ": give a text or a number.");
    }
    if (!value.is_text() && value.text == "nan") {
      fail_in(origin(value), name, "nan is not a valid value of an option: give a number.");
    }
    if (value.text.empty())
      fail_in(origin(value), name, "it is empty: remove it, or give a value.");
    // In double quotes, TOML reads "textures\new" as a path with a tab and a line break.
    const auto is_control = [](char c) {
      return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
    };
    if (std::any_of(value.text.begin(), value.text.end(), is_control)) {
      fail_in(origin(value), name,
              std::string("it contains a line break, a tab or another control character. ") +
                  kBackslashRemedy);
    }
    return value.text;
  }

  /// Checks a setting by applying it to an empty job, so that errors name its line.
  void check_option(const OptionRow& row, Setting& setting, bool list) const {
    Job job;
    try {
      if (setting.key == "faces" && list) {
        for (const std::string& word : setting.words)
          set_option(job, setting.key, std::vector{word});
        return;
      }
      if (path_access(row) != PathAccess::none) {
        for (std::string& word : setting.words) {
          word = replace_path(row, word,
                              [](const std::string& path) { return PathPattern(path).text(); });
        }
      }
      if (list) {
        set_option(job, setting.key, setting.words);
      } else if (setting.words.size() == 1) {
        // A string is split like the flag's value: "normal,ao".
        if (row.value.delimiter != 0) setting.words = split(setting.words[0], row.value.delimiter);
        set_option(job, setting.key, setting.words);
      } else {
        set_option(job, setting.key, setting.words);
      }
    } catch (const Error& error) {
      fail_in(setting.origin, setting.key, error.message());
    }
  }

  static OptionWords split(const std::string& text, char delimiter) {
    OptionWords words;
    std::size_t begin = 0;
    for (;;) {
      const std::size_t end = std::min(text.find(delimiter, begin), text.size());
      words.push_back(text.substr(begin, end - begin));
      if (end == text.size()) return words;
      begin = end + 1;
    }
  }

  void read_run_key(Setting& setting, const TomlValue& value) const {
    const std::string& key = setting.key;
    const auto fail_expecting = [&](const char* what) {
      fail_in(setting.origin, key,
              std::string("it is ") + value.kind_name() + ": give " + what + ".");
    };
    if (key == "skip") {
      if (value.kind == TomlValue::Kind::boolean) {  // a sidecar may set `skip` to true or false
        setting.words = {value.text};
        return;
      }
      if (!value.is_list() && !value.is_text()) fail_expecting("a list of patterns");
      const std::vector<TomlValue> patterns = value.is_list() ? value.elements : std::vector{value};
      for (const TomlValue& pattern : patterns) {
        if (!pattern.is_text()) fail_in(origin(pattern), key, "a pattern is a text.");
        try {
          setting.words.push_back(PathPattern(pattern.text).text());
        } catch (const Error& error) {
          fail_in(origin(pattern), key, error.message());
        }
      }
      return;
    }
    double number = 0;
    if (key == "retries") {
      if (value.kind != TomlValue::Kind::integer || !read_number(value.text, number) ||
          number < 0 || number > 100) {
        fail_expecting("a whole number, 0 to 100");
      }
    } else if (key == "timeout") {
      const bool is_number =
          value.kind == TomlValue::Kind::integer || value.kind == TomlValue::Kind::number;
      if (!is_number || !read_number(value.text, number) || !(number > 0 && number <= 1e6)) {
        fail_in(setting.origin, key, "it is " + value.text + ": give seconds, above 0 to 1000000.");
      }
    } else if (!value.is_text() || value.text.empty()) {
      fail_expecting("a text");
    }
    setting.words = {value.text};
  }

  std::string file_, layer_, folder_;
};

/// Compares the running version with ">=0.4", "==0.3.1" or "<1". \throws Error(usage)
void check_version(const Origin& origin, const TomlValue& value) {
  if (!value.is_text()) fail_in(origin, "kiln", "give a text, such as \">=0.3\".");
  const std::string& text = value.text;
  std::size_t position = 0;
  while (position < text.size()) {
    const std::size_t end = std::min(text.find(',', position), text.size());
    std::string condition = text.substr(position, end - position);
    condition.erase(std::remove(condition.begin(), condition.end(), ' '), condition.end());
    position = end + 1;
    const std::size_t digits = std::min(condition.find_first_of("0123456789"), condition.size());
    const std::string sign = condition.substr(0, digits);
    std::array<int, 3> required_version{},
        running_version = {KILN_VERSION_MAJOR, KILN_VERSION_MINOR, KILN_VERSION_PATCH};
    std::size_t parts = 0;
    const char* cursor = condition.data() + digits;
    const char* const last = condition.data() + condition.size();
    bool is_valid = cursor != last;
    while (is_valid && cursor != last) {
      if (parts == 3) is_valid = false;
      if (!is_valid) break;
      const auto [next, error] = std::from_chars(cursor, last, required_version[parts++]);
      is_valid = error == std::errc() && (next == last || (*next == '.' && next + 1 != last));
      cursor = next == last ? next : next + 1;
    }
    const bool is_known_sign =
        sign == ">=" || sign == ">" || sign == "<=" || sign == "<" || sign == "==" || sign == "=";
    if (!is_valid || !is_known_sign)
      fail_in(origin, "kiln", "'" + text + "' is not a version: give \">=0.3\", or \">=0.3, <1\".");
    // "==0.3" matches all versions 0.3.x.
    if (sign.find('=') == 0)
      std::fill(running_version.begin() + static_cast<std::ptrdiff_t>(parts), running_version.end(),
                0);
    const bool is_compatible = sign == ">="   ? running_version >= required_version
                               : sign == ">"  ? running_version > required_version
                               : sign == "<=" ? running_version <= required_version
                               : sign == "<"  ? running_version < required_version
                                              : running_version == required_version;
    if (!is_compatible) {
      fail_in(origin, "kiln",
              "this is Kiln " + std::string(version()) + ", but the file requires " + text +
                  ": install a suitable version, or change this line.");
    }
  }
}

/// Converts "5%" to a share of 1; numbers are unchanged.
double limit_value(const LayerReader& reader, const std::string& key, const TomlValue& value) {
  std::string text = value.text;
  const bool percent = value.is_text() && text.ends_with('%');
  if (percent) text.pop_back();
  double number = 0;
  const bool is_number =
      value.kind == TomlValue::Kind::integer || value.kind == TomlValue::Kind::number;
  if ((!is_number && !percent) || !read_number(text, number) || !std::isfinite(number) ||
      number < 0) {
    fail_in(reader.origin(value), key,
            "'" + value.text +
                "' is not a limit: give a number of 0 or more, or a share such as \"5%\".");
  }
  return percent ? number / 100 : number;
}

CheckRules read_check(const TomlValue& table, const std::string& file) {
  const LayerReader reader(file, "check", "");
  CheckRules rules;
  rules.origin = reader.origin(table);
  if (!table.is_table()) fail_in(rules.origin, "check", "write it as a table: [check].");
  check_keys(table, file, "[check]", {"golden", "limits"});
  if (const TomlValue* const golden = table.find("golden")) {
    if (!golden->is_text() || golden->text.empty())
      fail_in(reader.origin(*golden), "golden", "give a folder.");
    rules.golden = PathPattern(golden->text).text();
  }
  const TomlValue* const limits = table.find("limits");
  if (limits == nullptr) return rules;
  if (!limits->is_table())
    fail_in(reader.origin(*limits), "limits",
            "give a table, such as { missed = \"5%\", normal.mean = 0.5 }.");
  const std::vector<std::string> measures = {"mean", "max", "outliers"};
  for (std::size_t i = 0; i < limits->keys.size(); ++i) {
    const std::string& key = limits->keys[i];
    const TomlValue& value = limits->elements[i];
    if (!value.is_table()) {
      const std::vector<std::string> known_limits = {"missed", "mean", "max", "outliers"};
      if (std::find(known_limits.begin(), known_limits.end(), key) == known_limits.end()) {
        fail_in(reader.origin(value), key,
                "there is no such limit" + suggest_key(key, known_limits));
      }
      rules.limits.push_back({"", key, limit_value(reader, key, value), reader.origin(value)});
      continue;
    }
    for (std::size_t k = 0; k < value.keys.size(); ++k) {
      const TomlValue& limit = value.elements[k];
      if (std::find(measures.begin(), measures.end(), value.keys[k]) == measures.end()) {
        fail_in(reader.origin(limit), key + "." + value.keys[k],
                "there is no such limit for a map" + suggest_key(value.keys[k], measures));
      }
      rules.limits.push_back({key, value.keys[k],
                              limit_value(reader, key + "." + value.keys[k], limit),
                              reader.origin(limit)});
    }
  }
  return rules;
}

}  // namespace

std::string Origin::place() const {
  return file.empty() ? layer : file + ":" + std::to_string(line);
}

const Setting* OptionLayer::find(std::string_view key) const {
  const auto found = std::find_if(settings.begin(), settings.end(),
                                  [&](const Setting& s) { return s.key == key; });
  return found == settings.end() ? nullptr : &*found;
}

bool is_run_key(std::string_view key) {
  return std::find(kRunKeys.begin(), kRunKeys.end(), key) != kRunKeys.end();
}

std::string option_key(const OptionRow& row) {
  return dashes_to_underscores(lower_case(row.flag.substr(row.flag.find_first_not_of('-'))));
}

const OptionRow* find_option_row(std::string_view key) {
  for (const OptionRow& row : bake_rows()) {
    // Job files have no keys for these flags: further files are elements of the list `high` or `low`.
    if (row.flag != "--high" && row.flag != "--low" && option_key(row) == key) return &row;
  }
  return nullptr;
}

PathAccess path_access(const OptionRow& row) {
  constexpr std::array kOutputs = {"--out", "--save-cage", "--save-match", "--save-source",
                                   "--json"};
  constexpr std::array kInputs = {"HIGH",           "LOW",          "--cage-mesh",
                                  "--load-match",   "--match-list", "--view-weight",
                                  "--ao-occluders", "--maps",       "--transfer"};
  const auto has_flag = [&](const char* flag) { return row.flag == flag; };
  if (std::any_of(kOutputs.begin(), kOutputs.end(), has_flag)) return PathAccess::output;
  return std::any_of(kInputs.begin(), kInputs.end(), has_flag) ? PathAccess::input
                                                               : PathAccess::none;
}

std::string replace_path(const OptionRow& row, const std::string& word,
                         const std::function<std::string(const std::string&)>& change) {
  if (path_access(row) == PathAccess::none) return word;
  if (row.flag == "--maps") {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || is_variant(word)) return word;
    return word.substr(0, equals + 1) + change(word.substr(equals + 1));
  }
  if (row.flag == "--transfer" && word.starts_with("mtl:")) return word;
  if (row.flag == "--view-weight" || row.flag == "--ao-occluders") {
    const auto& names = row.value.choices;
    if (std::find(names.begin(), names.end(), word) != names.end()) return word;
  }
  return change(word);
}

OptionLayer read_sidecar(const fs::path& path, const std::string& folder) {
  const std::string file = path.string();
  const TomlValue table =
      parse_toml(read_small_file(path, kMaxSidecarBytes, "'" + file + "'"), file);
  OptionLayer layer = LayerReader(file, "sidecar", folder).read_layer(table);
  for (const char* const key : {"high", "low", "name", "before", "after"}) {
    if (const Setting* const setting = layer.find(key)) {
      fail_in(setting->origin, key, "a sidecar describes one asset: set this in the job file.");
    }
  }
  return layer;
}

JobFile parse_job_file(std::string_view text, const fs::path& path, const std::string& profile) {
  const std::string file = path.string();
  const TomlValue root = parse_toml(text, file);
  // The version is checked first, since a file for another version may contain unknown keys.
  if (const TomlValue* const kiln = root.find("kiln"))
    check_version({"file", file, kiln->line}, *kiln);
  check_keys(root, file, "a job file", {"kiln", "defaults", "profile", "bake", "check"});
  JobFile job;
  job.path = path;
  job.folder = path.parent_path();
  const auto reject_keys = [&](const OptionLayer& layer, std::initializer_list<const char*> keys) {
    for (const char* const key : keys) {
      if (const Setting* const setting = layer.find(key)) {
        fail_in(setting->origin, key, "it applies to one bake: set it in [[bake]].");
      }
    }
  };
  if (const TomlValue* const defaults = root.find("defaults")) {
    const LayerReader reader(file, "defaults", "");
    if (!defaults->is_table())
      fail_in(reader.origin(*defaults), "defaults", "write it as a table: [defaults].");
    job.defaults = reader.read_layer(*defaults);
    reject_keys(job.defaults, {"high", "low", "name", "skip"});
  }
  std::vector<std::string> profiles;
  if (const TomlValue* const profile_tables = root.find("profile")) {
    const Origin origin{"profile", file, profile_tables->line};
    if (!profile_tables->is_table())
      fail_in(origin, "profile", "write it as a table: [profile.NAME].");
    for (std::size_t i = 0; i < profile_tables->keys.size(); ++i) {
      const std::string name = "profile." + profile_tables->keys[i];
      const LayerReader reader(file, name, "");
      if (!profile_tables->elements[i].is_table()) {
        fail_in(reader.origin(profile_tables->elements[i]), name,
                "write it as a table: [" + name + "].");
      }
      // Profiles that are not selected are checked as well.
      OptionLayer layer = reader.read_layer(profile_tables->elements[i]);
      reject_keys(layer, {"high", "low", "name", "skip"});
      profiles.push_back(profile_tables->keys[i]);
      if (profile_tables->keys[i] == profile) job.profile = std::move(layer);
    }
  }
  if (!profile.empty() && !job.profile) {
    throw Error(ErrorCode::usage, file + ": there is no [profile." + profile + "]" +
                                      (profiles.empty() ? ", nor any other profile."
                                                        : suggest_key(profile, profiles)));
  }
  const TomlValue* const bake_rules = root.find("bake");
  if (bake_rules == nullptr) {
    throw Error(ErrorCode::usage, file + ": there is no [[bake]]: add one with high and out.");
  }
  if (!bake_rules->is_list() || bake_rules->elements.empty()) {
    fail_in({"bake", file, bake_rules->line}, "bake", "write each as [[bake]].");
  }
  for (const TomlValue& bake : bake_rules->elements) {
    const LayerReader reader(
        file,
        bake_rules->elements.size() == 1 ? "bake" : "bake " + std::to_string(job.bakes.size() + 1),
        "");
    if (!bake.is_table()) fail_in(reader.origin(bake), "bake", "write each as [[bake]].");
    OptionLayer layer = reader.read_layer(bake);
    if (layer.find("high") == nullptr)
      fail_in(reader.origin(bake), "bake", "high is missing: name the high-poly mesh.");
    job.bakes.push_back(std::move(layer));
  }
  if (const TomlValue* const check = root.find("check")) job.check = read_check(*check, file);
  return job;
}

JobFile read_job_file(const fs::path& path, const std::string& profile) {
  return parse_job_file(
      read_small_file(path, kMaxJobFileBytes, "The job file '" + path.string() + "'"), path,
      profile);
}

std::string job_file_schema() {
  const Json job = Json::parse(job_schema());
  const Json text = {{"type", "string"}};
  const Json texts = {{"anyOf", Json::array({text, Json{{"type", "array"}, {"items", text}}})}};
  Json properties = Json::object();
  const Json options = job.at("properties");
  for (const std::string& key : options.keys()) {
    if (std::find(kWholeRunOptions.begin(), kWholeRunOptions.end(), key) != kWholeRunOptions.end())
      continue;
    Json property = options.at(key);
    const OptionRow* const row = find_option_row(key);
    const bool takes_file = row != nullptr && path_access(*row) == PathAccess::input;
    if (takes_file || key == "cage") {
      property["anyOf"].push_back(
          {{"type", "object"},
           {"properties", {{"file", texts}, {"optional", {{"type", "boolean"}}}}},
           {"required", Json::array({"file"})},
           {"additionalProperties", false}});
    }
    if (key == "faces") {
      property["anyOf"].push_back(
          {{"type", "array"}, {"items", {{"type", "integer"}, {"minimum", 1}}}});
    }
    properties[key] = property;
  }
  properties["retries"] = {{"type", "integer"},
                           {"minimum", 0},
                           {"maximum", 100},
                           {"description", "Number of retries of a failed bake"}};
  properties["timeout"] = {{"type", "number"},
                           {"exclusiveMinimum", 0},
                           {"description", "Time limit of a bake in seconds"}};
  properties["before"] = {
      {"type", "string"},
      {"description",
       "Shell command to run before each bake, with the asset's JSON on standard input"}};
  properties["after"] = {{"type", "string"},
                         {"description", "Shell command to run after each bake"}};
  const auto table = [&](Json extra_properties, Json required) {
    Json profile_tables = properties;
    if (extra_properties.is_object()) profile_tables.update(extra_properties);
    Json schema = {
        {"type", "object"}, {"properties", profile_tables}, {"additionalProperties", false}};
    if (!required.empty()) schema["required"] = required;
    return schema;
  };
  const Json bake_only_properties = {{"skip", texts}, {"name", text}};
  const Json limit = {{"type", Json::array({"number", "string"})}};
  const Json map_limits = {{"type", "object"},
                           {"properties", {{"mean", limit}, {"max", limit}, {"outliers", limit}}},
                           {"additionalProperties", false}};
  const Json limits = {
      {"type", "object"},
      {"properties", {{"missed", limit}, {"mean", limit}, {"max", limit}, {"outliers", limit}}},
      {"additionalProperties", map_limits}};
  const Json schema = {
      {"$schema", "https://json-schema.org/draft/2020-12/schema"},
      {"title", "A job file of Kiln"},
      {"type", "object"},
      {"properties",
       {{"kiln",
         {{"type", "string"},
          {"description", "Versions of Kiln that the file requires, such as >=0.3"}}},
        {"defaults", table(Json(), Json::array())},
        {"profile", {{"type", "object"}, {"additionalProperties", table(Json(), Json::array())}}},
        {"bake",
         {{"type", "array"},
          {"minItems", 1},
          {"items", table(bake_only_properties, Json::array({"high"}))}}},
        {"check",
         {{"type", "object"},
          {"properties", {{"golden", text}, {"limits", limits}}},
          {"additionalProperties", false}}}}},
      {"required", Json::array({"bake"})},
      {"additionalProperties", false}};
  return schema.dump(1);
}

namespace {

std::string to_toml(const Json& value) {
  if (value.is_string()) return toml_quoted(value.text());
  if (!value.is_array()) return value.dump();
  std::string list;
  for (const Json& element : value.elements())
    list += (list.empty() ? "" : ", ") + to_toml(element);
  return "[" + list + "]";
}

/// Copies a JSON value, with special characters of patterns escaped in its paths.
Json with_escaped_paths(const OptionRow& row, const Json& value) {
  if (value.is_array()) {
    Json list = Json::array();
    for (const Json& element : value.elements()) list.push_back(with_escaped_paths(row, element));
    return list;
  }
  if (!value.is_string()) return value;
  return replace_path(row, value.text(), escape_pattern);
}

}  // namespace

std::string to_job_file(std::string_view text) {
  const Json json = Json::parse(text);
  std::string file = "kiln = \">=" + std::to_string(KILN_VERSION_MAJOR) + "." +
                     std::to_string(KILN_VERSION_MINOR) + "\"\n\n[[bake]]\n";
  for (const std::string& key : json.keys()) {
    if (std::find(kWholeRunOptions.begin(), kWholeRunOptions.end(), key) != kWholeRunOptions.end())
      continue;
    const OptionRow* const row = find_option_row(key);
    const Json& value = json.at(key);
    file += key + " = " + to_toml(row == nullptr ? value : with_escaped_paths(*row, value)) + "\n";
  }
  return file;
}

}  // namespace kiln
