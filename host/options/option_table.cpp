#include "options/option_table.h"

#include <algorithm>

namespace kiln {

OptionValue OptionValue::or_unset() const {
  OptionValue value = *this;
  value.get = [get = get](const void* job) {
    Json json = get(job);
    return json.number() == 0 ? Json() : json;
  };
  return value;
}

OptionWords OptionValue::write(const void* job) const {
  if (get_words) return get_words(job);
  const Json json = get(job);
  OptionWords list;
  if (json.is_array()) {
    for (const Json& element : json.elements()) list.push_back(format_as_word(element));
  } else if (!json.is_null()) {
    list.push_back(format_as_word(json));
  }
  return list;
}

OptionValue OptionValue::in(std::string_view wanted) const {
  OptionValue value = *this;
  value.unit = wanted;
  return value;
}

std::string OptionRow::report_key() const {
  if (!key.empty()) return key == "-" ? "" : key;
  std::string name = flag.substr(flag.find_first_not_of('-'));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string_view OptionRow::path() const {
  if (!option.empty()) return option;
  constexpr std::string_view kBakePrefix = "bake.";
  const std::string_view member = value.member;
  if (!member.starts_with(kBakePrefix)) return {};
  return member.substr(kBakePrefix.size(), member.find(',') - kBakePrefix.size());
}

bool OptionRow::applies_to(const MatchInfo& match) const { return obeys(match, path()); }

bool OptionRow::applies_to(const MapInfo& map) const { return obeys(map, path()); }

bool OptionRow::is_match_option() const {
  return !path().empty() && std::any_of(matches().begin(), matches().end(),
                                        [&](const MatchInfo& match) { return applies_to(match); });
}

bool OptionRow::is_map_option() const {
  // Options of the match are not attributed to maps: a map that displays the match's decisions would otherwise be
  // reported as using the options of the match.
  return !path().empty() && !path().starts_with("match.") &&
         std::any_of(maps().begin(), maps().end(),
                     [&](const MapInfo& map) { return applies_to(map); });
}

std::string format_as_word(const Json& value) {
  if (value.is_string()) return value.text();
  if (!value.is_array()) return value.is_null() ? "" : value.dump();
  std::string text;
  for (const Json& element : value.elements()) {
    text += (text.empty() ? "" : ",") + format_as_word(element);
  }
  return text;
}

const OptionRow* find_row(std::span<const OptionRow> rows, std::string_view flag) {
  const auto row =
      std::find_if(rows.begin(), rows.end(), [&](const OptionRow& r) { return r.flag == flag; });
  return row == rows.end() ? nullptr : &*row;
}

Json values_json(std::span<const OptionRow> rows, const void* job) {
  Json json = Json::object();
  for (const OptionRow& row : rows) {
    if (const std::string key = row.report_key(); !key.empty()) json[key] = row.value.get(job);
  }
  return json;
}

Json rows_json(std::span<const OptionRow> rows, const void* defaults) {
  Json list = Json::array();
  for (const OptionRow& row : rows) {
    const OptionValue& value = row.value;
    Json json = {{"name", row.flag.substr(row.flag.find_first_not_of('-'))},
                 {"flag", row.flag.starts_with('-') ? Json(row.flag) : Json()},
                 {"member", value.member},
                 {"type", value.type},
                 {"unit", value.unit.empty() ? Json() : Json(value.unit)},
                 {"range", value.low ? Json::array({*value.low, *value.high}) : Json()},
                 {"choices", value.choices.empty() ? Json() : Json(value.choices)},
                 {"default", value.get(defaults)},
                 {"required", row.required},
                 {"repeats", value.repeats},
                 {"matches", Json()},
                 {"maps", Json()},
                 {"group", row.group},
                 {"help", row.help}};
    if (row.is_match_option()) {
      json["matches"] = Json::array();
      for (const MatchInfo& match : matches()) {
        if (row.applies_to(match)) json["matches"].push_back(match.method.name);
      }
    }
    if (row.is_map_option()) {
      json["maps"] = Json::array();
      for (const MapInfo& map : maps()) {
        if (row.applies_to(map)) json["maps"].push_back(map.kind.name);
      }
    }
    list.push_back(std::move(json));
  }
  return list;
}

}  // namespace kiln
