#include "job/lists.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>
#include <system_error>

#include "job/files.h"
#include "job/job_options.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxListBytes = std::size_t{16} << 20;

std::string trim_blanks(std::string_view text) {
  const std::string_view blanks = " \t\r";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(blanks) - first + 1));
}

/// Parses one line of --match-list: LOW = HIGH, HIGH.
PartPair parse_pair(const std::string& line, const Message& place) {
  const std::size_t equals = line.find('=');
  PartPair pair;
  pair.low = trim_blanks(std::string_view(line).substr(0, equals));
  if (equals != std::string::npos) {
    std::istringstream rest(line.substr(equals + 1));
    for (std::string name; std::getline(rest, name, ',');) {
      if (name = trim_blanks(name); !name.empty()) pair.high.push_back(name);
    }
  }
  if (pair.low.empty() || pair.high.empty()) {
    throw OptionError(place + " is '" + line +
                          "': write LOW = HIGH, or LOW = HIGH, HIGH, with names of groups or "
                          "objects.",
                      ErrorCode::input);
  }
  return pair;
}

}  // namespace

std::vector<PartPair> parse_part_list(const std::string& list, const Message& what) {
  std::vector<PartPair> pairs;
  std::istringstream text(list);
  std::size_t line_number = 0;
  for (std::string line; std::getline(text, line);) {
    ++line_number;
    line = trim_blanks(line);
    if (line.empty() || line[0] == '#') continue;
    pairs.push_back(parse_pair(line, what + ", line " + std::to_string(line_number) + ","));
  }
  if (pairs.empty())
    throw OptionError(what + " has no line LOW = HIGH: add one.", ErrorCode::input);
  return pairs;
}

PartNames part_names(const Job& job) {
  PartNames names = job.part_names;
  names.by = job.parts_by.value();
  if (names.by != PartsBy::list) return names;
  const Message message_start = option("match_list") + " '" + job.match_list + "'";
  names.list =
      parse_part_list(read_small_file(job.match_list, kMaxListBytes, message_start), message_start);
  return names;
}

namespace {

// Maximum number of directions in a file. It limits the time of a run, since each of up to 4096 visibility directions
// is compared with all of them.
constexpr std::size_t kMaxDirections = 65536;
constexpr const char* kWordSeparators = " \t\v\f";

/// Removes the next word from a line and returns it; empty at the end of the line.
std::string_view pop_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kWordSeparators), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kWordSeparators));
  line.remove_prefix(word.size());
  return word;
}

bool parse_number(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size() && std::isfinite(value);
}

bool parse_weighted_direction(std::string_view line,
                              VisibilityOptions::Likelihood& weighted_direction) {
  std::array<double, 4> coordinates_and_weight{};
  for (double& value : coordinates_and_weight) {
    if (!parse_number(pop_word(line), value)) return false;
  }
  // Directions beyond the range of float would become infinite or zero.
  constexpr double kMaxCoordinate = 3e38;
  double largest_coordinate = 0;
  for (std::size_t i = 0; i < 3; ++i)
    largest_coordinate = std::max(largest_coordinate, std::abs(coordinates_and_weight[i]));
  weighted_direction.direction = {};
  if (largest_coordinate > kMaxCoordinate) return false;
  weighted_direction.direction = {static_cast<float>(coordinates_and_weight[0]),
                                  static_cast<float>(coordinates_and_weight[1]),
                                  static_cast<float>(coordinates_and_weight[2])};
  weighted_direction.weight = coordinates_and_weight[3];
  const Vec3& d = weighted_direction.direction;
  return pop_word(line).empty() && weighted_direction.weight >= 0 &&
         (d.x != 0 || d.y != 0 || d.z != 0);
}

}  // namespace

std::vector<VisibilityOptions::Likelihood> parse_likelihoods(std::string_view text,
                                                             const std::string& name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // UTF-8 byte order mark
  std::vector<VisibilityOptions::Likelihood> result;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end);
    text.remove_prefix(text.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, text.size()));
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(kWordSeparators) == line.npos) continue;
    VisibilityOptions::Likelihood weighted_direction;
    const std::string line_place = "'" + name + "', line " + std::to_string(line_number);
    if (!parse_weighted_direction(line, weighted_direction)) {
      throw Error(ErrorCode::input, line_place +
                                        ": give \"X Y Z WEIGHT\": a non-zero direction to the "
                                        "viewer, and a weight of 0 or more.");
    }
    if (result.size() == kMaxDirections) {
      throw Error(ErrorCode::input, line_place + ": there are more than " +
                                        std::to_string(kMaxDirections) +
                                        " directions: remove some lines.");
    }
    result.push_back(weighted_direction);
  }
  if (result.empty()) {
    throw Error(ErrorCode::input, "'" + name + "' has no line \"X Y Z WEIGHT\". Add one.");
  }
  return result;
}

std::vector<VisibilityOptions::Likelihood> load_likelihoods(const std::string& path) {
  return parse_likelihoods(
      read_small_file(path, kMaxListBytes,
                      option("view_weight") + " '" + path + "', neither all, horizon nor up,"),
      path);
}

}  // namespace kiln
