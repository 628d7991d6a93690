// Arguments that several lab commands share. Each command selects its rows of one option table.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "job/high_poly_input.h"
#include "job/mesh_files.h"
#include "options/option_table.h"
#include "picture/view_arguments.h"

namespace kiln::cli {

struct LabArguments {
  std::string high, low, out, json, device;
  std::string max_distance = "2%";
  std::vector<std::string> matches;  ///< Names of matches; empty: all that suit the meshes
  std::optional<std::uint32_t> size, directions, pixels, picture_size;
  HeightFieldOptions heights;
  LoadMeshOptions load;
  MeshFrameArguments frame;
  ViewArguments view;
  std::set<std::string> given;  ///< Flags that were given, such as "--size"
  bool quiet = false;

  bool was_given(std::string_view flag) const { return given.contains(std::string(flag)); }
  Length search_distance() const;
};

/// Returns the rows of the given flags, in the table's order. Known flags are: --match, --size, --max-distance,
/// --directions, --pixels, --picture-size, --height, --extent, --triangulate, --up, --unit, --uv-set, --allow-outside,
/// --device, --json, --quiet.
std::vector<OptionRow> lab_rows(const std::set<std::string_view>& flags);

/// The view as JSON with "view", "zoom", "at", "z_up" and "square".
Json describe_view(const RenderOptions& view);

/// Makes an option whose value is a list of the given words.
/// \param delimiter  separator of the words in the value; 0: the flag is given once for each word

template <typename Job>
OptionValue list_option(Member<Job, std::vector<std::string>> member,
                        const std::vector<std::string>& words, char delimiter = 0) {
  OptionValue value = texts(member, delimiter);
  value.words = one_of(words).words();
  value.choices = words;
  value.set = setter_of<Job>([=](Job& job, const Message& flag, const OptionWords& given) {
    member.of(job) = given;
    for (std::string& word : member.of(job)) {
      if (const std::string problem = one_of(words)(word); !problem.empty()) {
        fail_usage(flag + problem);
      }
    }
  });
  return value;
}

}  // namespace kiln::cli
