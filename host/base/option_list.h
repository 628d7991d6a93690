// Lists of options as paths in BakeOptions, such as "occlusion match.ray.rule".
#pragma once

#include <string_view>

namespace kiln {

/// True if a list contains an option, its group, or, if `option` is a group, one of the group's options.
/// \param list    paths separated by blanks
/// \param option  a path, such as "occlusion.rays", or a group, "occlusion"
inline bool contains_option(std::string_view list, std::string_view option) {
  const auto is_within = [](std::string_view path, std::string_view group) {
    return path.starts_with(group) && (path.size() == group.size() || path[group.size()] == '.');
  };
  while (!list.empty()) {
    const std::string_view listed_option = list.substr(0, list.find(' '));
    if (is_within(option, listed_option) || is_within(listed_option, option)) return true;
    list.remove_prefix(listed_option.size() == list.size() ? listed_option.size()
                                                           : listed_option.size() + 1);
  }
  return false;
}

}  // namespace kiln
