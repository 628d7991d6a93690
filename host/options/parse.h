// Values as people write them on the command line.
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
#include "base/option.h"
#include "kiln/bake.h"
#include "kiln/height_field.h"
#include "kiln/message.h"
#include "kiln/option_error.h"
#include "kiln/unwrap.h"
#include "options/json.h"
#include "options/values.h"

namespace kiln {

/// The option of a flag, "--max-distance".
Message option_of(std::string_view flag, std::string_view value = {});

/// \throws OptionError, or Error(usage) where the message names no option
[[noreturn]] void fail_usage(const Message& message);
/// The same, where it is so.
inline void refuse_if(bool is, const Message& message) {
  if (is) fail_usage(message);
}

/// ASCII letters in lower case.
std::string lower_case(std::string text);
/// Extension of a file's name, in lower case: ".png".
std::string lower_extension(const std::filesystem::path& path);

/// "2048" or "2048x1024". \throws Error(usage)
std::pair<std::uint32_t, std::uint32_t> parse_size(const std::string& text);

/// "0.05" in world units, or "2%" of the bounding box's diagonal. \throws Error(usage)
Length parse_length(const Message& name, const std::string& text);

/// The same of --cage. \throws Error(usage), also for a file, which has a flag of its own
Length parse_cage(const std::string& text);

/// parse_length(), above 0. \throws Error(usage)
Length parse_length_above_0(const Message& name, const std::string& text);

/// As it is written: "0.05", or "2%".
std::string length_text(const Length& length);

/// "0.2%" or "0.2" of the diagonal as 0.002, up to 50%. \throws Error(usage)
double parse_error_bound(const std::string& text);

/// The same of what meshes cover in pictures. \throws Error(usage)
double parse_outline_bound(const std::string& text);

/// Degrees above 0. \throws Error(usage)
double parse_degrees(const Message& name, const std::string& text);

/// "600px" or "600", 16 to 16384. \throws Error(usage)
std::uint32_t parse_pixels(const Message& name, const std::string& text);

/// "500000", "500K" (also 500KB; thousands) or "488KiB" (1024), also with a fraction: "1.5M". A whole number of bytes, 1 to those
/// of a GLB, 2^32 - 1. \throws Error(usage)
std::uint64_t parse_bytes(const Message& name, const std::string& text);

/// "16" or "inf" (-1). \throws Error(usage)
std::int32_t parse_gutter(const std::string& text);

/// "AZ,EL" in degrees. \throws Error(usage)
std::pair<double, double> parse_view(const std::string& text);

/// "X" or "X,Y" in world units, above 0; Y is 0 where it is left out. \throws Error(usage)
std::pair<double, double> parse_extent(const std::string& text);

/// The same as text; null: by the image.
Json extent_json(const HeightFieldOptions& heights);
/// --no-data: a number, "none" or "auto". \throws Error(usage)
void read_no_data(const Message& name, const std::string& word, HeightFieldOptions& heights);
Json no_data_json(const HeightFieldOptions& heights);

/// "X,Y,Z", finite. \returns false for anything else
template <typename T>
bool parse_three(std::string_view text, std::array<T, 3>& values);

/// "X,Y,Z", not all 0. \throws Error(usage)
Vec3 parse_direction(const Message& name, const std::string& text);

/// "X,Y,Z". \throws Error(usage)
std::array<double, 3> parse_place(const Message& name, const std::string& text);

/// A number of views. \throws Error(usage)
std::uint32_t parse_views(const std::string& text);

/// For every command that has --density. \throws Error(usage) where it was given and no large charts are laid out
void check_density(bool given, const std::string& method);

/// \param method  "pairs" or "squares"; all else is charts
/// \param size    the map's smaller side, texels
/// \param high    whose detail charts get texels by; null: by area
/// Charts stand 1/256 of the size apart (8 texels of 2,048), at least 2 texels; pairs and squares 2 texels.
UnwrapOptions unwrap_options(const std::string& method, std::uint32_t size,
                             const Mesh* high = nullptr);

/// A number, or two with a stroke between them such as 2/255. None: it is neither, negative or not finite.
std::optional<double> fraction(std::string_view text);

/// A check for options: a share of 1 as fraction() reads it, which it turns into a number.
Check share_of_1();

/// "1.234% of the diagonal"; from ten on, "83 times the diagonal".
std::string of_diagonal(double share);

/// 12345678 as "12,345,678".
std::string with_commas(std::uint64_t value);
/// "1 seam" or "1,200 seams".
std::string plural(std::uint64_t count, const char* what);

}  // namespace kiln
