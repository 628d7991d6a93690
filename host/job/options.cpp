// Accesses options of a job by name: text and JSON in both directions.
#include "kiln/options.h"

#include <algorithm>
#include <set>
#include <utility>

#include "job/job_options.h"
#include "options/json.h"
#include "options/near_words.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// The name of an option in Python and JSON, such as "max_distance".
std::string option_key(const OptionRow& row) {
  std::string name = lower_case(row.flag.substr(row.flag.find_first_not_of('-')));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

bool is_positional(const OptionRow& row) { return !row.flag.starts_with('-'); }
/// True for the rows of --high and --low. JSON lists their files together with the first input of HIGH or LOW.
bool adds_further_files(const OptionRow& row) {
  return row.flag == "--high" || row.flag == "--low";
}

/// True if the members that a row sets, such as "bake.width, bake.height", include `name`, with or
/// without "bake." before it.
bool row_has_member(const OptionRow& row, std::string_view name) {
  std::string_view remaining_members = row.value.member;
  for (;;) {
    const std::size_t comma = remaining_members.find(", ");
    std::string_view member = remaining_members.substr(0, comma);
    if (member == name) return true;
    if (member.starts_with("bake.") && member.substr(5) == name) return true;
    if (comma == std::string_view::npos) return false;
    remaining_members.remove_prefix(comma + 2);
  }
}

std::string key_of_name(std::string_view name) {
  std::string key(name.substr(std::min(name.find_first_not_of('-'), name.size())));
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

const OptionRow& require_option(std::string_view name) {
  if (const OptionRow* const row = find_option(name)) return *row;
  std::vector<std::string> option_names;
  for (const OptionRow& row : bake_rows()) {
    if (!adds_further_files(row)) option_names.push_back(option_key(row));
  }
  const std::string suggestion = nearest_word(key_of_name(name), option_names);
  fail_usage(
      "A job has no option '" + std::string(name) + "'" +
      (suggestion.empty() ? ": options_json() lists them." : "; did you mean " + suggestion + "?"));
}

void set_row_value(Job& job, const OptionRow& row, const OptionWords& words) {
  if (is_positional(row) && row.flag != "--out") {
    std::vector<JobInput>& inputs = row.flag == "HIGH" ? job.high : job.low.given;
    inputs.assign(words.begin(), words.end());
    return;
  }
  const std::string name = option_key(row);
  refuse_if(words.empty(), option(name) + " has no value: give one, or leave the option out.");
  refuse_if(words.size() > 1 && !row.value.repeats,
            option(name) + " was given " + std::to_string(words.size()) + " values: give it one.");
  for (const std::string& word : words) {
    refuse_if(word.empty(), option(name) + " has no value: give one, or leave the option out.");
  }
  try {
    row.value.set(&job, option(name), words);
  } catch (const OptionError& error) {
    throw OptionError(error, words.back(), row.value.words);
  }
  job.given.insert(row.flag);
}

/// Splits a text such as "a,b" into words if the option is a list with a separator.
OptionWords split(const OptionRow& row, std::string_view value) {
  OptionWords words;
  while (row.value.delimiter != 0) {
    const std::size_t end = value.find(row.value.delimiter);
    if (end == std::string_view::npos) break;
    words.emplace_back(value.substr(0, end));
    value.remove_prefix(end + 1);
  }
  words.emplace_back(value);
  return words;
}

/// Joins the numbers of a JSON list to one word: "64x32" for a size, else "0,0,1".
std::string join_numbers(const OptionRow& row, const Json& value) {
  std::string text = format_as_word(value);
  if (row.value.type == "size") std::replace(text.begin(), text.end(), ',', 'x');
  return text;
}

/// Converts a JSON value to the words of an option. A list of only numbers is one word, such as a direction or a size.
OptionWords words_from_json(const OptionRow& row, const Json& value) {
  const auto is_numbers = [](const Json& list) {
    return list.is_array() && !list.elements().empty() &&
           std::all_of(list.elements().begin(), list.elements().end(),
                       [](const Json& element) { return element.is_number(); });
  };
  if (is_numbers(value)) return {join_numbers(row, value)};
  if (value.is_array()) {
    OptionWords words;
    for (const Json& element : value.elements()) {
      if (is_numbers(element)) {
        words.push_back(join_numbers(row, element));
        continue;
      }
      refuse_if(element.is_array() || element.is_object() || element.is_null(),
                option(option_key(row)) + ": one element of the list is " + element.dump() +
                    ": use only texts and numbers.");
      words.push_back(format_as_word(element));
    }
    return words;
  }
  if (value.is_object()) {
    OptionWords words;
    for (const std::string& key : value.keys()) {
      const Json& part = value.at(key);
      words.push_back(key + "=" +
                      (is_numbers(part) ? join_numbers(row, part) : format_as_word(part)));
    }
    return words;
  }
  return {format_as_word(value)};
}

/// Converts a word to JSON: to a number or boolean if the option's type is one and the text is valid JSON, else to a
/// string.
Json json_from_word(const OptionRow& row, const std::string& word) {
  if (row.value.type == "flag") return word == "true";
  const bool is_number = row.value.type == "whole" || row.value.type == "number";
  const Json value = is_number ? Json::parse(word) : Json();
  return !is_number || value.is_null() || value.dump() != word ? Json(word) : value;
}

Json input_names_json(const std::vector<JobInput>& inputs) {
  Json names = Json::array();
  for (const JobInput& input : inputs) {
    refuse_if(input.asset != nullptr,
              "The mesh '" + input.name +
                  "' is in memory, but JSON can only name files: save the mesh, and use its path.");
    names.push_back(input.name);
  }
  return names.size() == 1 ? names[0] : names;
}

bool differs_from_default(const OptionRow& row, const Job& job) {
  static const Job default_job;
  return row.value.write(&job) != row.value.write(&default_job);
}

}  // namespace

const OptionRow* find_option(std::string_view name) {
  const std::string key = key_of_name(name);
  for (const OptionRow& row : bake_rows()) {
    if (!adds_further_files(row) && option_key(row) == key) return &row;
  }
  for (const OptionRow& row : bake_rows()) {
    if (row_has_member(row, name)) return &row;
  }
  return nullptr;
}

void set_option(Job& job, std::string_view name, std::string_view value) {
  const OptionRow& row = require_option(name);
  set_row_value(job, row, split(row, value));
}

void set_option(Job& job, std::string_view name, const std::vector<std::string>& values) {
  set_row_value(job, require_option(name), values);
}

std::vector<std::string> option_values(const Job& job, std::string_view name) {
  const OptionRow& row = require_option(name);
  if (row.flag == "HIGH") return high_files(job);
  if (row.flag == "LOW") return low_files(job);
  return row.value.write(&job);
}

std::set<std::string> options_given(const Job& job) {
  std::set<std::string> given = job.given;
  for (const OptionRow& row : bake_rows()) {
    if (differs_from_default(row, job)) given.insert(row.flag);
  }
  return given;
}

bool is_given(const Job& job, std::string_view name) {
  const OptionRow& row = require_option(name);
  if (row.flag == "HIGH") return !job.high.empty();
  if (row.flag == "LOW") return !job.low.given.empty();
  return job.given.contains(row.flag) || differs_from_default(row, job);
}

std::string to_json(const Job& job) {
  const MatchOptions& match = job.bake.match;
  refuse_if(
      match.cage_mesh != nullptr || match.saved != nullptr || !job.bake.occlusion.by_others.empty(),
      "A cage, a match or an occluder is in memory, but JSON can only name files: save it, and use "
      "its path.");
  Json json = Json::object();
  if (!job.high.empty()) json["high"] = input_names_json(job.high);
  if (!job.low.given.empty()) json["low"] = input_names_json(job.low.given);
  const std::set<std::string> given = options_given(job);
  for (const OptionRow& row : bake_rows()) {
    if (is_positional(row) || adds_further_files(row) || !given.contains(row.flag)) continue;
    const OptionWords words = row.value.write(&job);
    if (words.empty()) continue;
    Json value = Json::array();
    for (const std::string& word : words) value.push_back(json_from_word(row, word));
    json[option_key(row)] = row.value.repeats ? value : value[0];
  }
  return json.dump(1);
}

void set_options(Job& job, std::string_view text) {
  const Json json = Json::parse(text);
  refuse_if(!json.is_object(),
            "A job is a JSON object, such as {\"high\": \"statue.glb\", \"out\": \"maps\"}.");
  for (const std::string& key : json.keys()) {
    const OptionRow& row = require_option(key);
    const Json& value = json.at(key);
    if (!value.is_null()) set_row_value(job, row, words_from_json(row, value));
  }
}

Job job_from_json(std::string_view text) {
  Job job;
  set_options(job, text);
  return job;
}

std::string options_json() {
  const Job default_job;
  return rows_json(bake_rows(), &default_job).dump(1);
}

std::string job_schema() {
  Json properties = Json::object();
  Json required = Json::array();
  for (const OptionRow& row : bake_rows()) {
    if (adds_further_files(row)) continue;
    const OptionValue& value = row.value;
    Json property = Json::object();
    const bool is_number = value.type == "whole" || value.type == "number";
    const char* const type = value.type == "flag"    ? "boolean"
                             : value.type == "whole" ? "integer"
                             : is_number             ? "number"
                                                     : "string";
    Json schema = {{"type", type}};
    if (is_number && value.low) schema["minimum"] = *value.low;
    if (is_number && value.high) schema["maximum"] = *value.high;
    if (value.type == "choice" && !value.choices.empty()) schema["enum"] = value.choices;
    Json alternatives = Json::array({schema});
    // A text such as "inf", or a fraction, is allowed instead of a number.
    if (is_number) alternatives.push_back({{"type", "string"}});
    if (!is_number && value.type != "flag" && value.type != "choice")
      alternatives.push_back({{"type", "number"}});
    if (value.type == "flag or choice") alternatives.push_back({{"type", "boolean"}});
    if (value.repeats || is_positional(row)) {
      alternatives.push_back(
          {{"type", "array"}, {"items", {{"type", Json::array({"string", "number"})}}}});
      alternatives.push_back({{"type", "object"}});
    }
    property["anyOf"] = alternatives;
    property["description"] = row.help;
    properties[option_key(row)] = property;
    if (row.required) required.push_back(option_key(row));
  }
  const Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                       {"title", "A job of Kiln"},
                       {"type", "object"},
                       {"properties", properties},
                       {"required", required},
                       {"additionalProperties", false}};
  return schema.dump(1);
}

}  // namespace kiln
