#include "options/parse.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <filesystem>
#include <limits>
#include <string_view>

#include "base/formatted.h"
#include "kiln/unwrap.h"

namespace kiln {
namespace {

[[noreturn]] void fail_value(const Message& name, const std::string& text,
                             const Message& expected) {
  fail_usage(name + " '" + text + "': expected " + expected + ".");
}

template <typename T>
bool parse_entire_text(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::pair<std::uint32_t, std::uint32_t> parse_size(const std::string& text) {
  constexpr const char* kExpected = "one side or WxH, each 1 to 16384, such as 2048 or 2048x1024";
  const std::size_t separator = text.find_first_of("xX");
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  if (separator == std::string::npos) {
    if (!parse_entire_text(text, width)) fail_value(option("size"), text, kExpected);
    height = width;
  } else if (!parse_entire_text(std::string_view(text).substr(0, separator), width) ||
             !parse_entire_text(std::string_view(text).substr(separator + 1), height)) {
    fail_value(option("size"), text, kExpected);
  }
  if (width < 1 || width > 16384 || height < 1 || height > 16384)
    fail_value(option("size"), text, kExpected);
  return {width, height};
}

Length parse_length(const Message& name, const std::string& text) {
  constexpr const char* kExpected =
      "a length such as 0.05, or a share of the high poly's diagonal such as 2%";
  std::string_view number = text;
  const bool is_relative = !number.empty() && number.back() == '%';
  if (is_relative) number.remove_suffix(1);
  double value = 0;
  if (!parse_entire_text(number, value) || !std::isfinite(value) || value < 0)
    fail_value(name, text, kExpected);
  return is_relative ? Length::share(value / 100) : Length::absolute(value);
}

Length parse_cage(const std::string& text) {
  const std::string ending = std::filesystem::path(text).extension().string();
  refuse_if(ending.size() > 1 && std::isalpha(static_cast<unsigned char>(ending[1])) != 0,
            option("cage") + " '" + text + "' looks like a file: the flag for one is " +
                option("cage_mesh", "FILE") + ".");
  return parse_length(option("cage"), text);
}

std::pair<double, double> parse_extent(const std::string& text) {
  constexpr const char* kExpected = "X or X,Y in world units, above 0, such as 100 or 100,50";
  const std::size_t comma = text.find(',');
  const std::string_view view = text;
  const auto number = [&](std::string_view part) {
    double value = 0;
    if (!parse_entire_text(part, value) || !std::isfinite(value) || value <= 0) {
      fail_value(option("extent"), text, kExpected);
    }
    return value;
  };
  if (comma == std::string::npos) return {number(view), 0};
  return {number(view.substr(0, comma)), number(view.substr(comma + 1))};
}

void parse_no_data_value(const Message& name, const std::string& word,
                         HeightFieldOptions& heights) {
  heights.no_data.reset();
  heights.guess_no_data = word == "auto";
  if (heights.guess_no_data || word == "none") return;
  double value = 0;
  if (!read_number(word, value)) {
    fail_usage(name + " is '" + word + "': give a number, none or auto");
  }
  heights.no_data = value;
  heights.guess_no_data = true;
}

Json no_data_json(const HeightFieldOptions& heights) {
  if (heights.no_data) return *heights.no_data;
  return heights.guess_no_data ? "auto" : "none";
}

Json extent_json(const HeightFieldOptions& heights) {
  if (heights.width == 0) return {};
  const std::string width = formatted("%.12g", heights.width);
  return heights.depth == 0 ? width : width + formatted(",%.12g", heights.depth);
}

Length parse_length_above_0(const Message& name, const std::string& text) {
  const Length length = parse_length(name, text);
  refuse_if(length.value == 0, name + " is 0: it must be above 0.");
  return length;
}

std::string format_length(const Length& length) {
  return length.relative ? formatted("%.12g%%", 100 * length.value)
                         : formatted("%.12g", length.value);
}

namespace {

/// Parses a percentage up to 50%, and returns it as a share of 1.
double parse_percentage(const Message& name, const std::string& text, const char* expected_text) {
  std::string_view number = text;
  if (!number.empty() && number.back() == '%') number.remove_suffix(1);
  double value = 0;
  if (!parse_entire_text(number, value) || !(value >= 1e-6 && value <= 50))
    fail_value(name, text, expected_text);
  return value / 100;
}

}  // namespace

double parse_error_bound(const std::string& text) {
  return parse_percentage(option("max_error"), text,
                          "a percentage of the diagonal, above 0 and up to 50, such as 0.2%");
}

double parse_outline_bound(const std::string& text) {
  return parse_percentage(
      option("max_outline"), text,
      "a percentage of the pixels that the meshes cover, above 0 and up to 50, such as 2%");
}

double parse_hole_size(const Message& name, const std::string& text) {
  if (text == "all") return std::numeric_limits<double>::infinity();
  const std::string number =
      !text.empty() && text.back() == '%' ? text.substr(0, text.size() - 1) : "";
  double value = 0;
  if (!parse_entire_text(number, value) || !(value >= 0 && value <= 100)) {
    fail_value(name, text, "a percentage of HIGH's diagonal from 0% to 100%, such as 10%, or all");
  }
  return value / 100;
}

double parse_degrees(const Message& name, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  refuse_if(error != std::errc() || end != text.data() + text.size() || !(value > 0) || value > 180,
            name + " is '" + text + "': give degrees above 0, up to 180, such as 1.5.");
  return value;
}

UnwrapOptions unwrap_options(const std::string& method, std::uint32_t size, const Mesh* high) {
  UnwrapOptions options;
  options.size = std::clamp(size, 16U, 65536U);
  options.method = method == "pairs"     ? UnwrapMethod::pairs
                   : method == "squares" ? UnwrapMethod::squares
                                         : UnwrapMethod::charts;
  if (options.method == UnwrapMethod::charts)
    options.border_texels = std::max(2U, options.size / 256);
  options.detail_of = high;
  return options;
}

void check_density(bool given, const std::string& method) {
  if (!given || (method != "pairs" && method != "squares")) return;
  fail_usage(option("density") + " only applies to large charts, but " + option("unwrap", method) +
             " makes none: leave it out, or unwrap by charts.");
}

std::optional<double> fraction(std::string_view text) {
  const std::size_t slash = text.find('/');
  double numerator = 0, denominator = 1;
  if (!parse_entire_text(text.substr(0, slash), numerator) || !std::isfinite(numerator) ||
      !(numerator >= 0)) {
    return std::nullopt;
  }
  if (slash == std::string_view::npos) return numerator;
  if (!parse_entire_text(text.substr(slash + 1), denominator) || !std::isfinite(denominator) ||
      !(denominator > 0)) {
    return std::nullopt;
  }
  return numerator / denominator;
}

Check fraction_check() {
  return {[](std::string& text) -> std::string {
            const std::optional<double> share = fraction(text);
            if (!share || *share > 1) {
              return ": '" + text + "' is not a fraction: give 0 to 1, such as 0.01 or 2/255";
            }
            char digits[32];
            text.assign(digits, std::to_chars(digits, digits + sizeof digits, *share).ptr);
            return {};
          },
          "0 to 1 or N/255"};
}

std::uint32_t parse_pixels(const Message& name, const std::string& text) {
  const std::string digits = text.ends_with("px") ? text.substr(0, text.size() - 2) : text;
  std::int32_t value = 0;
  refuse_if(!parse_entire_text(digits, value) || value < 16 || value > 16384,
            name + " is '" + text + "': give pixels, 16 to 16384, such as 600px.");
  return static_cast<std::uint32_t>(value);
}

std::uint64_t parse_bytes(const Message& name, const std::string& text) {
  constexpr double kMaxGlbBytes =
      4294967295.0;  // the format GLB stores the length of a file in 32 bits
  const std::size_t digits = text.find_first_not_of("0123456789.");
  const std::string number = text.substr(0, digits);
  const std::string unit = digits == std::string::npos ? "" : lower_case(text.substr(digits));
  constexpr std::pair<std::string_view, double> kUnits[] = {
      {"", 1},         {"b", 1},         {"k", 1e3},         {"kb", 1e3},        {"m", 1e6},
      {"mb", 1e6},     {"g", 1e9},       {"gb", 1e9},        {"ki", 1024},       {"kib", 1024},
      {"mi", 1048576}, {"mib", 1048576}, {"gi", 1073741824}, {"gib", 1073741824}};
  const auto* const unit_entry = std::find_if(
      std::begin(kUnits), std::end(kUnits), [&](const auto& entry) { return entry.first == unit; });
  double value = 0;
  const bool has_known_unit = unit_entry != std::end(kUnits) && read_number(number, value);
  const double bytes = has_known_unit ? std::floor(value * unit_entry->second) : 0;
  refuse_if(!(bytes >= 1 && bytes <= kMaxGlbBytes) || (unit_entry->second == 1 && bytes != value),
            name + " is '" + text +
                "': give bytes, 1 to 4294967295, such as 500000, 500K (thousands), 1.5M or 488KiB "
                "(1024).");
  return static_cast<std::uint64_t>(bytes);
}

std::int32_t parse_padding(const std::string& text) {
  if (text == "inf" || text == "infinite") return -1;
  std::int32_t value = 0;
  if (!parse_entire_text(text, value) || value < 0 || value > 4096) {
    fail_value(option("gutter"), text, "0 to 4096 texels, or inf");
  }
  return value;
}

std::pair<double, double> parse_view(const std::string& text) {
  const std::size_t comma = text.find(',');
  double azimuth = 0;
  double elevation = 0;
  if (comma == std::string::npos ||
      !parse_entire_text(std::string_view(text).substr(0, comma), azimuth) ||
      !parse_entire_text(std::string_view(text).substr(comma + 1), elevation) ||
      !std::isfinite(azimuth) || !(elevation >= -90 && elevation <= 90)) {
    fail_value(option("view"), text, "azimuth and elevation (-90 to 90) in degrees, such as 30,15");
  }
  return {azimuth, elevation};
}

template <typename T>
bool parse_vector3(std::string_view rest, std::array<T, 3>& values) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t comma = i < 2 ? rest.find(',') : rest.size();
    if (comma == std::string_view::npos || !parse_entire_text(rest.substr(0, comma), values[i]) ||
        !std::isfinite(values[i])) {
      return false;
    }
    if (i < 2) rest.remove_prefix(comma + 1);
  }
  return true;
}
template bool parse_vector3(std::string_view, std::array<double, 3>&);
template bool parse_vector3(std::string_view, std::array<std::uint64_t, 3>&);

Vec3 parse_direction(const Message& name, const std::string& text) {
  std::array<float, 3> values{};
  if (!parse_vector3(text, values) || values == std::array<float, 3>{}) {
    fail_value(name, text, "a direction X,Y,Z away from the mesh, such as 0,0.5,1");
  }
  return {values[0], values[1], values[2]};
}

std::array<double, 3> parse_point(const Message& name, const std::string& text) {
  std::array<double, 3> values{};
  if (!parse_vector3(text, values))
    fail_value(name, text, "a point X,Y,Z, such as 500000,4500000,0");
  return values;
}

std::uint32_t parse_views(const std::string& text) {
  std::uint32_t value = 0;
  if (!parse_entire_text(text, value) || value > 512) {
    fail_value(option("views"), text,
               "1 to 512, or auto, or 0 if " + option("view") + " gives all views");
  }
  return value;
}

std::string format_share_of_diagonal(double share) {
  return share < 10 ? formatted("%.3f%% of the diagonal", 100 * share)
                    : formatted("%.3g times the diagonal", share);
}

std::string with_commas(std::uint64_t value) {
  const std::string digits = std::to_string(value);
  std::string result;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i != 0 && (digits.size() - i) % 3 == 0) result += ',';
    result += digits[i];
  }
  return result;
}

std::string plural(std::uint64_t count, const char* what) {
  return with_commas(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace kiln
