#include "match/registry.h"

#include <algorithm>
#include <string>

#include "base/intern.h"
#include "base/option_list.h"

namespace kiln {

std::span<const MatchRow> match_rows() {
  static const std::vector<MatchRow> rows = {ray_match(),        views_match(),  closest_match(),
                                             visibility_match(), hybrid_match(), uv_match(),
                                             axis_match()};
  return rows;
}

const MatchRow& match_row(MatchMethod method) {
  std::string known_names;
  for (const MatchRow& row : match_rows()) {
    if (row.info.method == method) return row;
    known_names += (known_names.empty() ? "" : ", ") + std::string(row.info.method.name);
  }
  throw Error(ErrorCode::usage, "method is '" + std::string(method.name) + "': it must be one of " +
                                    known_names + ".");
}

std::string match_names(bool (*has)(const MatchRow& row)) {
  std::vector<std::string_view> names;
  for (const MatchRow& row : match_rows()) {
    if (has(row)) names.push_back(row.info.method.name);
  }
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += i == 0 ? "" : i + 1 == names.size() ? " or " : ", ";
    text += names[i];
  }
  return text;
}

MatchMethod match_at_uvs() {
  const std::span<const MatchRow> rows = match_rows();
  return std::find_if(rows.begin(), rows.end(),
                      [](const MatchRow& row) { return row.find_at_uvs != nullptr; })
      ->info.method;
}

std::vector<MatchMethod> planned_matches(std::uint8_t MatchRow::*turn) {
  std::vector<const MatchRow*> rows;
  for (const MatchRow& row : match_rows()) {
    if (row.*turn != 0) rows.push_back(&row);
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [&](const MatchRow* a, const MatchRow* b) { return a->*turn < b->*turn; });
  std::vector<MatchMethod> methods;
  for (const MatchRow* row : rows) methods.push_back(row->info.method);
  return methods;
}

std::span<const MatchInfo> matches() {
  static const std::vector<MatchInfo> match_infos = [] {
    std::vector<MatchInfo> list;
    for (const MatchRow& row : match_rows()) list.push_back(row.info);
    return list;
  }();
  return match_infos;
}

bool obeys(const MatchInfo& match, std::string_view option) {
  return contains_option("match.method match.fallback match.fallback_blend", option) ||
         contains_option(match.options, option);
}

MatchMethod::MatchMethod(std::string_view text) : name(intern(text)) {}

const MatchInfo& find_match(std::string_view name) {
  MatchMethod method;
  // stores the registry's string, since the lifetime of the caller's is unknown
  method.name = name;
  return match_row(method).info;
}

}  // namespace kiln
