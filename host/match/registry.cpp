#include "match/registry.h"

#include <string>

namespace kiln {

std::span<const MatchRow> match_rows() {
  static const std::vector<MatchRow> rows = {ray_match(),        views_match(),  closest_match(),
                                             visibility_match(), hybrid_match(), uv_match(),
                                             axis_match()};
  return rows;
}

const MatchRow& match_row(MatchMethod method) {
  std::string known;
  for (const MatchRow& row : match_rows()) {
    if (row.info.method == method) return row;
    known += (known.empty() ? "" : ", ") + std::string(row.info.method.name);
  }
  throw Error(ErrorCode::usage,
              "method is '" + std::string(method.name) + "': it must be one of " + known + ".");
}

std::span<const MatchInfo> matches() {
  static const std::vector<MatchInfo> infos = [] {
    std::vector<MatchInfo> list;
    for (const MatchRow& row : match_rows()) list.push_back(row.info);
    return list;
  }();
  return infos;
}

const MatchInfo& find_match(std::string_view name) { return match_row(MatchMethod{name}).info; }

}  // namespace kiln
