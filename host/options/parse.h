// Parses and formats values on the command line.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/formatted.h"
#include "base/lower_case.h"
#include "base/option.h"
#include "kiln/height_field.h"
#include "kiln/message.h"
#include "kiln/option_error.h"
#include "options/json.h"
#include "options/values.h"

namespace kiln {

struct UnwrapOptions;

/// Makes a message part that names an option by its flag, such as "--max-distance".
Message option_of(std::string_view flag, std::string_view value = {});

/// Throws a message. \throws OptionError, or Error(usage) if the message names no option
[[noreturn]] void fail_usage(const Message& message);
/// Throws a message if a condition holds.
inline void refuse_if(bool condition, const Message& message) {
  if (condition) fail_usage(message);
}

/// Parses "2048" or "2048x1024" to width and height. \throws Error(usage)
std::pair<std::uint32_t, std::uint32_t> parse_size(const std::string& text);

/// Parses "0.05" (world units) or "2%" (of the bounding box's diagonal). \throws Error(usage)
Length parse_length(const Message& name, const std::string& text);

/// Parses the length of --cage. \throws Error(usage), also for a file's name, since --cage-mesh takes files
Length parse_cage(const std::string& text);

/// Parses a length as parse_length() does; it must be above 0.
/// \throws Error(usage)
Length parse_length_above_0(const Message& name, const std::string& text);

/// Formats a length: "0.05", or "2%".
std::string format_length(const Length& length);

/// Parses a share of the diagonal, up to 50%: "0.2%" or "0.2" give 0.002. \throws Error(usage)
double parse_error_bound(const std::string& text);

/// Parses the largest holes to fill, as a share of the diagonal: "10%" gives 0.1, "all" infinity. \throws Error(usage)
double parse_hole_size(const Message& name, const std::string& text);

/// Parses a share of the pixels that meshes cover, up to 50%, as parse_error_bound() does.
/// \throws Error(usage)
double parse_outline_bound(const std::string& text);

/// Parses degrees above 0. \throws Error(usage)
double parse_degrees(const Message& name, const std::string& text);

/// Parses "600px" or "600", 16 to 16384. \throws Error(usage)
std::uint32_t parse_pixels(const Message& name, const std::string& text);

/// Parses "500000", "500K" or "500KB" (thousands), or "488KiB" (1024), also with a fraction: "1.5M". The result must be
/// an integer from 1 to 2^32 - 1, the largest GLB. \throws Error(usage)
std::uint64_t parse_bytes(const Message& name, const std::string& text);

/// Parses texels, "16", or "inf" (-1). \throws Error(usage)
std::int32_t parse_padding(const std::string& text);

/// Parses azimuth and elevation "AZ,EL" in degrees. \throws Error(usage)
std::pair<double, double> parse_view(const std::string& text);

/// Parses "X" or "X,Y" in world units above 0; Y is 0 if omitted. \throws Error(usage)
std::pair<double, double> parse_extent(const std::string& text);

/// Formats the extent as parse_extent() reads it; null if it follows from the image.
Json extent_json(const HeightFieldOptions& heights);
/// Parses --no-data: a number, "none" or "auto". \throws Error(usage)
void parse_no_data_value(const Message& name, const std::string& word, HeightFieldOptions& heights);
Json no_data_json(const HeightFieldOptions& heights);

/// Parses "X,Y,Z" of finite numbers. \returns false for anything else
template <typename T>
bool parse_vector3(std::string_view text, std::array<T, 3>& values);

/// Parses a direction "X,Y,Z", not all 0. \throws Error(usage)
Vec3 parse_direction(const Message& name, const std::string& text);

/// Parses a point "X,Y,Z". \throws Error(usage)
std::array<double, 3> parse_point(const Message& name, const std::string& text);

/// Parses a number of views. \throws Error(usage)
std::uint32_t parse_views(const std::string& text);

/// Checks --density against the unwrap method.
/// \throws Error(usage) if --density was given and the method makes no large charts
void check_density(bool given, const std::string& method);

/// Converts --unwrap to options of unwrap(). The padding of charts is 1/256 of the size (8 texels of 2,048), at least 2
/// texels; pairs and squares have 2 texels.
/// \param method  "pairs" or "squares"; anything else means charts
/// \param size    the map's smaller side, texels
/// \param high  high poly whose detail determines the charts' texel density; if null, density follows area
UnwrapOptions unwrap_options(const std::string& method, std::uint32_t size,
                             const Mesh* high = nullptr);

/// Parses a number or a fraction such as 2/255. nullopt for all other texts, and for negative or infinite values.
std::optional<double> fraction(std::string_view text);

/// Returns a check of option values that accepts numbers from 0 to 1, also as fractions such as 2/255, and replaces a
/// fraction by its decimal number.
Check fraction_check();

/// Formats a share of the diagonal as "1.234% of the diagonal", or as "83 times the diagonal" if it is 10 or more.
std::string format_share_of_diagonal(double share);

/// Formats 12345678 as "12,345,678".
std::string with_commas(std::uint64_t value);
/// Formats a count with its noun: "1 seam" or "1,200 seams".
std::string plural(std::uint64_t count, const char* what);

}  // namespace kiln
