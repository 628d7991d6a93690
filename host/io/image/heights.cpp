// Reads height fields: pictures whose values are unscaled heights, and metadata of GeoTIFF.
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "base/formatted.h"
#include "base/option.h"
#include "io/image/picture.h"
#include "kiln/height_field.h"

namespace kiln {
namespace {

constexpr std::size_t kFormatHeadBytes = 32;

/// The value that a PNG stores for 1; 1 for all other pictures.
double largest_stored(const std::string& head) {
  constexpr std::size_t kBitDepthOffset = 24, kColourTypeOffset = 25;
  constexpr char kPalette = 3;
  if (!head.starts_with("\x89PNG\r\n\x1a\n") || head.size() <= kColourTypeOffset) return 1;
  const unsigned bits =
      head[kColourTypeOffset] == kPalette ? 8U : static_cast<unsigned char>(head[kBitDepthOffset]);
  return bits >= 1 && bits <= 16 ? static_cast<double>((1U << bits) - 1U) : 1;
}

#ifdef KILN_HAS_TIFF
bool is_tiff(const std::string& head) {
  using namespace std::string_literals;
  for (const std::string& magic : {"II*\0"s, "MM\0*"s, "II+\0"s, "MM\0+"s}) {
    if (head.starts_with(magic)) return true;
  }
  return false;
}

/// Length in metres of a degree of longitude and of a degree of latitude, at a given latitude on
/// the ellipsoid WGS 84; by the usual trigonometric series.
std::array<double, 2> metres_of_degree(double latitude) {
  const double phi = latitude * std::numbers::pi / 180;
  return {111412.84 * std::cos(phi) - 93.5 * std::cos(3 * phi) + 0.118 * std::cos(5 * phi),
          111132.92 - 559.82 * std::cos(2 * phi) + 1.175 * std::cos(4 * phi)};
}

/// Length in metres of a unit that a GeoTIFF gives by its code; 0: unknown.
double metres_of_unit(unsigned code) {
  constexpr unsigned kMetre = 9001, kFoot = 9002, kSurveyFoot = 9003;
  return code == kMetre ? 1 : code == kFoot ? 0.3048 : code == kSurveyFoot ? 1200.0 / 3937 : 0;
}

/// Converts a GeoTIFF's pixel spacing to the unit of its heights.
void apply_geography(const TiffGeography& geography, const std::string& file, Heights& heights,
                     std::vector<Warning>* warnings) {
  heights.spacing = geography.spacing;
  if (!geography.is_degrees) {
    const double across = metres_of_unit(geography.length_unit);
    const double up = metres_of_unit(geography.height_unit);
    for (double& side : heights.spacing) side *= across > 0 && up > 0 ? across / up : 1;
    return;
  }
  if (heights.spacing[0] == 0) return;
  const double latitude = geography.top - geography.spacing[1] * heights.image.height / 2;
  const std::array<double, 2> degree = metres_of_degree(latitude);
  const double up = metres_of_unit(geography.height_unit);
  for (std::size_t k = 0; k < 2; ++k) heights.spacing[k] *= degree[k] / (up > 0 ? up : 1);
  if (warnings == nullptr) return;
  warnings->push_back(
      {"spacing-in-degrees",
       formatted("The pixel distances of the height field '%s' are in degrees. At latitude %.4g, a "
                 "pixel was taken to be %.5g by %.5g %s. If that is not exact enough, give ",
                 file.c_str(), latitude, heights.spacing[0], heights.spacing[1],
                 up > 0 && up < 1 ? "feet" : "metres") +
           option("extent") + ", or project the file (gdalwarp).",
       1});
}
#endif

}  // namespace

Heights load_heights(const std::filesystem::path& path, std::vector<Warning>* warnings) {
  const std::string file = path.string();
  const auto source = open_file(path, image_failure(file, "an image"));
  const std::string head = source->head(kFormatHeadBytes);
  Heights heights;
#ifdef KILN_HAS_TIFF
  if (is_tiff(head)) {
    TiffGeography geography;
    heights.image = parse_tiff_heights(*source, file, geography);
    heights.no_data = geography.no_data;
    heights.largest = geography.largest;
    apply_geography(geography, file, heights, warnings);
    return heights;
  }
#endif
  static_cast<void>(warnings);
  heights.image = parse_image(*source, file);
  heights.largest = largest_stored(head);
  return heights;
}

}  // namespace kiln
