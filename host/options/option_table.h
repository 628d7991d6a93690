// The option table. One row defines an option completely: flags of commands, checks, help, options in reports, and the
// list for programs (--help-json) are all generated from it.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "kiln/height_field.h"
#include "kiln/map.h"
#include "kiln/match.h"
#include "options/json.h"
#include "options/parse.h"
#include "options/words.h"

namespace kiln {

/// An accessor of a job's member, with the path that names it: "bake.match.ray.rule".
template <typename Job, typename T>
struct Member {
  Member(T& (*function)(Job&), const char* name) : of(function), path(name) {}
  T& (*of)(Job&);
  const char* path;
};
#define KILN_MEMBER(Job, member) \
  ::kiln::Member {               \
    +[](Job & job) -> auto& {    \
      return job.member;         \
    }                            \
    , #member                    \
  }

/// The type of an option: how the words on the command line set a member of a job, and how reports show the member.
struct OptionValue {
  std::string type;    ///< Type in --help-json: flag, whole, number, choice, length, text, list...
  std::string words;   ///< What help prints for the value: a placeholder, or the allowed range
  std::string unit;    ///< Unit of numbers; empty if they have none
  std::string member;  ///< Path of the job's member that the option sets: "bake.match.ray.rule"
  std::vector<std::string> choices = {};
  std::optional<double> low = {}, high = {};
  bool repeats = false;  ///< True if the flag may be repeated
  char delimiter = 0;    ///< Character between several values of one word; 0: a word is one value
  /// Sets the member from the given words. \throws Error(usage)
  std::function<void(void* job, const Message& flag, const OptionWords&)> set = {};
  std::function<Json(const void* job)> get = {};
  /// Inverse of set(): the words that set the member to its value; no words if that is impossible. If empty, the
  /// words are derived from get()
  std::function<OptionWords(const void* job)> get_words = {};
  OptionWords write(const void* job) const;

  /// Returns a type that also allows the value 0, which means that the option is not set.
  OptionValue or_unset() const;
  OptionValue in(std::string_view unit) const;
};

/// Wraps a getter for OptionValue::get. The getter must not modify the job.
template <typename Job, typename Get>
std::function<Json(const void*)> getter_of(Get get) {
  return
      [get](const void* job) { return Json(get(const_cast<Job&>(*static_cast<const Job*>(job)))); };
}
template <typename Job, typename Set>
auto setter_of(Set set) {
  return [set](void* job, const Message& flag, const OptionWords& words) {
    set(*static_cast<Job*>(job), flag, words);
  };
}

/// Makes an option of a custom type.
/// \param set  called with (Job&, flag, words)
/// \param get  called with (Job&); returns the value for reports
template <typename Job, typename Set, typename Get>
OptionValue value_of(const char* member, std::string_view type, std::string_view words, Set set,
                     Get get) {
  return {.type = std::string(type),
          .words = std::string(words),
          .unit = {},
          .member = member,
          .set = setter_of<Job>(set),
          .get = getter_of<Job>(get)};
}

/// Makes an option that is an integer within a range.
template <typename Job, typename T>
OptionValue integer(Member<Job, T> member, std::uint32_t low, std::uint32_t high) {
  OptionValue value = value_of<Job>(
      member.path, "whole", range(low, high).words(),
      [=](Job& job, const Message& flag, const OptionWords& words) {
        std::uint32_t number = 0;
        if (!read_number(words.back(), number) || number < low || number > high) {
          std::string text = words.back();
          fail_usage(flag + range(low, high)(text));
        }
        member.of(job) = number;
      },
      [=](Job& job) { return member.of(job); });
  value.low = low;
  value.high = high;
  return value;
}

/// Makes an option that is a number within a range.
/// \param fractions  true: the value is a share of 1 and may be given as a fraction such as 2/255
template <typename Job, typename T>
OptionValue number(Member<Job, T> member, double low, double high, bool fractions = false) {
  OptionValue value = value_of<Job>(
      member.path, "number", fractions ? fraction_check().words() : range(low, high).words(),
      [=](Job& job, const Message& flag, const OptionWords& words) {
        std::string text = words.back();
        const std::string problem = fractions ? fraction_check()(text) : range(low, high)(text);
        double number = 0;
        if (!problem.empty() || !read_number(text, number)) fail_usage(flag + problem);
        member.of(job) = number;
      },
      [=](Job& job) { return member.of(job); });
  value.low = low;
  value.high = high;
  return value;
}

/// Makes a flag without a value. \param when_given  value of the member if the flag is given
template <typename Job>
OptionValue toggle(Member<Job, bool> member, bool when_given = true) {
  return value_of<Job>(
      member.path, "flag", "",
      [=](Job& job, const Message& flag, const OptionWords& words) {
        if (words.back() != "true" && words.back() != "false") {
          fail_usage(flag + " takes no value: leave =" + words.back() + " out");
        }
        member.of(job) = (words.back() == "true") == when_given;
      },
      [=](Job& job) { return member.of(job); });
}

/// Makes an option that is an enumerator, given by its name.
template <typename Job, typename T>
OptionValue choice(Member<Job, T> member, Words<T> names) {
  std::vector<std::string> choices = names_of(names);
  OptionValue value = value_of<Job>(
      member.path, "choice", one_of(choices).words(),
      [=](Job& job, const Message& flag, const OptionWords& words) {
        std::string text = words.back();
        if (const std::string problem = one_of(choices)(text); !problem.empty()) {
          fail_usage(flag + problem);
        }
        member.of(job) = names.at(text);
      },
      [=](Job& job) { return name_of(names, member.of(job)); });
  value.choices = choices;
  return value;
}

/// Makes an option that is a string, such as a file's name.
/// \param check  throws for an invalid text; null: any text is valid
template <typename Job>
OptionValue text(Member<Job, std::string> member, std::string_view shown = "TEXT",
                 void (*check)(const Message& flag, const std::string& text) = nullptr) {
  return value_of<Job>(
      member.path, "text", shown,
      [=](Job& job, const Message& flag, const OptionWords& words) {
        if (check != nullptr) check(flag, words.back());
        member.of(job) = words.back();
      },
      [=](Job& job) { return member.of(job).empty() ? Json() : Json(member.of(job)); });
}

/// Makes an option that is one of several allowed strings.
template <typename Job>
OptionValue word(Member<Job, std::string> member, const std::vector<std::string>& words) {
  OptionValue value = value_of<Job>(
      member.path, "choice", one_of(words).words(),
      [=](Job& job, const Message& flag, const OptionWords& given) {
        std::string text = given.back();
        if (const std::string problem = one_of(words)(text); !problem.empty()) {
          fail_usage(flag + problem);
        }
        member.of(job) = text;
      },
      [=](Job& job) { return member.of(job); });
  value.choices = words;
  return value;
}

/// Makes an option that is a list of strings.
/// \param delimiter  separator of the strings; 0: the flag is repeated for each string
template <typename Job>
OptionValue texts(Member<Job, std::vector<std::string>> member, char delimiter = 0) {
  OptionValue value = value_of<Job>(
      member.path, "list", delimiter != 0 ? "TEXT,..." : "TEXT",
      [=](Job& job, const Message&, const OptionWords& words) { member.of(job) = words; },
      [=](Job& job) { return member.of(job); });
  value.repeats = true;
  value.delimiter = delimiter;
  return value;
}

/// Makes an option that is a length above 0: world units, or P% of the high poly's diagonal.
template <typename Job>
OptionValue length(Member<Job, std::optional<Length>> member) {
  return value_of<Job>(
      member.path, "length", "D|P%",
      [=](Job& job, const Message& flag, const OptionWords& words) {
        member.of(job) = parse_length_above_0(flag, words.back());
      },
      [=](Job& job) { return member.of(job) ? Json(format_length(*member.of(job))) : Json(); });
}

/// A row of the table. For options of bakes, it also determines with which matches and maps the option is allowed.
struct OptionRow {
  std::string flag;        ///< The flag, such as "--samples"; positional arguments have no dashes
  std::string group = {};  ///< Heading of the option in help
  OptionValue value;
  std::string help;
  /// Key of the option in reports; if empty, derived from the flag ("view_size"); "-": not in reports
  std::string key = {};
  bool required = false;
  /// Flags of earlier rows that cannot be combined with this one, separated by spaces
  std::string excludes = {};
  std::string needs = {};  ///< The flag of an earlier row that this option requires
  /// Path in BakeOptions that is passed to obeys() to find the matches and maps that use this option; if empty, the
  /// path of `member` is passed
  std::string_view option = {};
  bool applies_to_fallback = true;  ///< True if a fallback match uses the option, too
  /// True if the option may be given beside --match auto, which may choose a match that uses it
  bool allowed_with_auto = false;

  std::string report_key() const;
  bool applies_to(const MatchInfo& match) const;
  bool applies_to(const MapInfo& map) const;
  /// True if only some matches, or only some maps, use the option
  bool is_match_option() const;
  bool is_map_option() const;

 private:
  std::string_view path() const;
};

/// Formats a value as one word of the command line; elements of lists are separated by commas. Empty for null.
std::string format_as_word(const Json& value);

/// Finds the row of a flag; null if there is none.
const OptionRow* find_row(std::span<const OptionRow> rows, std::string_view flag);

/// Selects the rows for which `wanted` returns true, and gives them the same heading.
template <typename Wanted>
std::vector<OptionRow> select_rows(std::span<const OptionRow> rows, const char* heading,
                                   const Wanted& wanted) {
  std::vector<OptionRow> selected_rows;
  for (const OptionRow& row : rows) {
    if (!wanted(row)) continue;
    selected_rows.push_back(row);
    selected_rows.back().group = heading;
  }
  return selected_rows;
}

/// Returns the values of a job's options as a JSON object by their keys in reports.
Json values_json(std::span<const OptionRow> rows, const void* job);

/// All data of the rows, for --help-json.
/// \param defaults  a job in which no option is set
Json rows_json(std::span<const OptionRow> rows, const void* defaults);

/// Rows of options that most commands have: --device, --json, --quiet. The job must have the member that a row names.
template <typename Job>
OptionRow device_row(const char* group) {
  return {.flag = "--device",
          .group = group,
          .value = text(KILN_MEMBER(Job, device)),
          .help = "OpenCL device: its index, or a part of its name (see kiln devices)",
          .key = "-"};
}
template <typename Job>
OptionRow json_row(const char* group) {
  return {.flag = "--json",
          .group = group,
          .value = text(KILN_MEMBER(Job, json), "FILE"),
          .help = "Write the report to this file; - means standard output",
          .key = "-"};
}
template <typename Job>
OptionRow quiet_row(const char* group) {
  return {.flag = "--quiet",
          .group = group,
          .value = toggle(KILN_MEMBER(Job, quiet)),
          .help = "Print neither progress nor summary; warnings and errors are still printed",
          .key = "-"};
}
/// The row of --triangulate, for jobs with a member `load`. \param what  names the meshes in the help text
template <typename Job>
OptionRow triangulate_row(const char* group, const std::string& what) {
  return {
      .flag = "--triangulate",
      .group = group,
      .value = choice(KILN_MEMBER(Job, load.triangulation), Words(kTriangulationWords)),
      .help = "How polygons of " + what +
              " are triangulated; LOW's must be triangulated as in the program that shows the map. "
              "auto: quads from their first corner, larger polygons by Delaunay; blender: as "
              "Blender 5; fan: around the first corner; shortest: along the shorter diagonal"};
}
/// The row of --density. \param high  the command's name for the high poly
template <typename Job>
OptionRow density_row(const char* group, const std::string& high,
                      Member<Job, TexelDensity> member) {
  return {.flag = "--density",
          .group = group,
          .value = choice(member, Words(kDensityWords)),
          .help = "Texel density of large charts that Kiln makes: by area, or higher where " +
                  high + " has more detail"};
}
/// The row of --clean, for jobs with members `clean` and `keep_inner`.
template <typename Job>
OptionRow clean_row(const char* group) {
  return {.flag = "--clean",
          .group = group,
          .value = choice(KILN_MEMBER(Job, clean), Words(kCleanHighWords)),
          .help =
              "Repairs of HIGH before the bake: all (weld open edges within 0.001% of the "
              "diagonal; remove duplicate faces, floaters and inner shells; fill pinholes; orient "
              "faces outwards), none, or auto: all if Kiln makes the low poly, else only the "
              "orientation. A warning for each kind of repair states how many were made"};
}
template <typename Job>
OptionRow keep_inner_row(const char* group) {
  return {.flag = "--keep-inner",
          .group = group,
          .value = toggle(KILN_MEMBER(Job, keep_inner)),
          .help = "With --clean: keep parts of HIGH that no view from outside sees"};
}
/// The row of --fill-holes, for jobs with a member `fill_holes`.
template <typename Job>
OptionRow fill_holes_row(const char* group) {
  OptionValue value = value_of<Job>(
      "fill_holes", "share", "P%|all",
      [](Job& job, const Message& flag, const OptionWords& words) {
        job.fill_holes = parse_hole_size(flag, words.back());
      },
      [](Job& job) {
        return job.fill_holes == 0          ? Json()
               : std::isinf(job.fill_holes) ? Json("all")
                                            : Json(formatted("%.9g%%", 100 * job.fill_holes));
      });
  value.choices = {"all"};
  return {.flag = "--fill-holes",
          .group = group,
          .value = std::move(value),
          .help =
              "Fill holes of HIGH whose extent is at most P% of its diagonal, with any number of "
              "edges: by a patch that continues the surface, or by a lid. all: every hole, for a "
              "watertight mesh. A warning states what stays open"};
}
/// The row of --height, for jobs with a member `heights`.
template <typename Job>
OptionRow height_row(const char* group) {
  return {.flag = "--height",
          .group = group,
          .value = value_of<Job>(
              "heights.height", "number", "NUMBER",
              [](Job& job, const Message& flag, const OptionWords& words) {
                if (read_number(words.back(), job.heights.height)) return;
                fail_usage(flag + " is '" + words.back() + "': give a number");
              },
              [](Job& job) { return job.heights.height; }),
          .help = "Height of the value 1 (white in a PNG) in world units, along +Z"};
}
template <typename Job>
OptionRow no_data_row(const char* group) {
  return {.flag = "--no-data",
          .group = group,
          .value = value_of<Job>(
              "heights.no_data", "text", "VALUE|none|auto",
              [](Job& job, const Message& flag, const OptionWords& words) {
                parse_no_data_value(flag, words.back(), job.heights);
              },
              [](Job& job) { return no_data_json(job.heights); }),
          .help =
              "The value that marks pixels without a height, as the file stores it: they become "
              "holes. none: all values are heights; auto: the value that a GeoTIFF states, or "
              "-9999 and similar values if they are far from all heights. NaN is always a hole"};
}
template <typename Job>
OptionRow extent_row(const char* group) {
  return {.flag = "--extent",
          .group = group,
          .value = value_of<Job>(
                       "heights.width, heights.depth", "list", "X[,Y]",
                       [](Job& job, const Message&, const OptionWords& words) {
                         std::tie(job.heights.width, job.heights.depth) =
                             parse_extent(words.back());
                       },
                       [](Job& job) { return extent_json(job.heights); })
                       .in("world units"),
          .help =
              "X or X,Y: distance between the outermost pixels in world units (default: the longer "
              "side is 1; Y follows from the image's aspect ratio)"};
}

}  // namespace kiln
