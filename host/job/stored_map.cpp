// Values of maps as files store them: converted at once, or row by row while the map is baked.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "image/mip_padding.h"
#include "image/stored_values.h"
#include "job/map_file.h"
#include "job/map_words.h"
#include "job/stages.h"

namespace kiln {
namespace {

/// Warns of texels beyond the map's range, which integer formats clamp.
void warn_of_clamped(const RunContext& run, const BakedMap& map, const std::string& name,
                     const RangeExcess& excess) {
  if (holds_floats(run.job.image) || excess.texels == 0) return;
  const std::string example =
      formatted("%.6g at texel column %u, row %u", double{excess.value}, excess.x, excess.y);
  run.log.warnings.push_back({"beyond-range",
                              plural(excess.texels, "texel") + " of the map " + name +
                                  (excess.texels == 1 ? " exceeds its range and is clamped: "
                                                      : " exceed its range and are clamped, for "
                                                        "example ") +
                                  example + ": give " +
                                  option("range", std::string(map.kind.name) + "=LO,HI") +
                                  " with a range that contains them, or " +
                                  option("format", "exr") + ", which stores values unclamped.",
                              excess.texels});
}

Json range_json(const std::vector<ValueRange>& ranges) {
  Json json = Json::array();
  for (const auto [low, high] : ranges) json.push_back({low, high});
  return json;
}

/// Mean length of a texel's side on the low poly, world units.
double texel_side(const Mesh& low, const BakeReport& report) {
  double area = 0;
  for (std::size_t i = 0; i < low.triangles.size(); ++i) {
    const Triangle& t = low.triangles[i];
    // triangles of other texture sets have no finite UVs
    if (!std::isfinite(low.uvs[low.uv_triangles[i][0]].x)) continue;
    std::array<std::array<double, 3>, 2> side{};
    const Vec3 &a = low.positions[t[0]], &b = low.positions[t[1]], &c = low.positions[t[2]];
    side[0] = {double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z};
    side[1] = {double{c.x} - a.x, double{c.y} - a.y, double{c.z} - a.z};
    const auto& [u, v] = side;
    const double doubled =
        std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
    if (std::isfinite(doubled)) area += doubled / 2;
  }
  const double texels = static_cast<double>(std::max<std::uint64_t>(1, report.texels));
  return std::sqrt(area / texels);
}

/// Warns if the file format stores the values of a map with steps that are too coarse, or overflows.
/// \param ranges  ranges of an integer format; empty for floats
/// \param max_magnitude  see MapValues
void warn_of_format(const BakeScene& scene, const BakeResult& result, const BakedMap& map,
                    const std::string& name, const std::vector<ValueRange>& ranges,
                    float max_magnitude) {
  // Magnitudes that round to infinity in half precision, and below which half precision loses bits.
  constexpr float kMinHalfOverflow = 65520, kMinNormalHalf = 0x1p-14F;
  constexpr int kHalfMantissaBits = 10, kFloatMantissaBits = 23, kMinHalfExponent = -24;
  const SaveImageOptions& image = scene.run.job.image;
  const ImageFormat format = image.format;
  const bool is_half_precision = format == ImageFormat::exr_half;
  if (max_magnitude == 0) return;
  const auto warn = [&](const char* code, const std::string& what) {
    scene.run.log.warnings.push_back(
        {code,
         "The map " + name + " " + what +
             (format == ImageFormat::exr_float || format == ImageFormat::tiff_float
                  ? "Set an " + option("origin") + " nearer to the mesh, or none."
                  : "Use " + option("format", "exr32") + "."),
         1});
  };
  const auto number = [](double value) { return formatted("%.3g", value); };
  if (is_half_precision && max_magnitude >= kMinHalfOverflow) {
    return warn("map-overflow",
                "reaches " + number(double{max_magnitude}) +
                    ", but half precision ends at 65504: larger texels become infinite. ");
  }
  if (is_half_precision && max_magnitude < kMinNormalHalf) {
    return warn("map-steps", "has values of at most " + number(double{max_magnitude}) +
                                 ", which half precision stores in steps of " +
                                 number(std::exp2(kMinHalfExponent)) + ". ");
  }
  const bool stores_positions = obeys(map.info, "encoding.origin") &&
                                std::any_of(maps().begin(), maps().end(), [&](const MapInfo& info) {
                                  return info.kind == map.kind;
                                });
  if (!stores_positions) return;
  double precision_step = std::exp2(std::ilogb(max_magnitude) -
                                    (is_half_precision ? kHalfMantissaBits : kFloatMantissaBits));
  if (!holds_floats(image)) {
    precision_step = 0;
    for (const auto [low, high] : ranges) {
      precision_step =
          std::max(precision_step, (double{high} - low) / (stores_8_bits(image) ? 255 : 65535));
    }
  }
  const double texel_size = texel_side(scene.low.mesh, result.report);
  if (precision_step > texel_size) {
    warn("map-steps", "is stored in steps of " + number(precision_step) + ", but its texels are " +
                          number(texel_size) + " apart. ");
  }
}

/// Records the properties of a written map, and warns about what its file format loses.
void record_stored(const BakeScene& scene, const BakedMap& map, const std::string& name,
                   const MapValues& values, BakedLayout& baked) {
  StoredMaps& stored = baked.stored;
  warn_of_clamped(scene.run, map, name, values.excess);
  if (obeys(map.info, "encoding.origin")) stored.origin = map.origin;
  const auto has_name_of_map = [&](const MapVariant& variant) {
    return variant.name == map.kind.name;
  };
  const std::vector<MapVariant>& variants = baked.options.variants;
  if (!map.ids.empty() && std::any_of(variants.begin(), variants.end(), has_name_of_map)) {
    stored.variant_ids[name] = ids_json(map.ids);
  }
  const std::vector<ValueRange> range = stored_ranges(map, scene.run.job.image.format);
  warn_of_format(scene, baked.result, map, name, range, values.max_magnitude);
  if (!range.empty()) stored.ranges[name] = range_json(range);
}

Json describe_error(const StoredError& error, TextureUse use) {
  return describe(error, use == TextureUse::normal || use == TextureUse::tangent_normal);
}

}  // namespace

void MapValues::add(const BakedMap& rows, std::uint32_t first_row,
                    std::span<const std::uint8_t> coverage) {
  const RangeExcess rows_excess = beyond_range(rows, coverage);
  const std::uint64_t texels = excess.texels + rows_excess.texels;
  if (rows_excess.distance > excess.distance) {
    excess = rows_excess;
    excess.y += first_row;
  }
  excess.texels = texels;
  if (rows.info.low != 0 || rows.info.high != 0) return;
  for (std::size_t i = 0; i < rows.image.pixels.size(); ++i) {
    const auto state = TexelState{coverage[i / rows.image.channels]};
    const float value = std::abs(rows.image.pixels[i]);
    if (state == TexelState::baked && std::isfinite(value))
      max_magnitude = std::max(max_magnitude, value);
  }
}

void convert_to_stored(const BakeScene& scene, BakedMap& map, const std::string& name,
                       BakedLayout& baked) {
  const SaveImageOptions& options = scene.run.job.image;
  MapValues values;
  values.add(map, 0, baked.result.coverage);
  record_stored(scene, map, name, values, baked);
  to_stored(map, options.format);
  if (!writes_gltf(scene.run.job) && pads_for_mips(scene.run.job)) {
    pad_for_mips(map, baked.result.coverage, chooses_padding(scene.run.job));
  }
  if (!stores_8_bits(options) || writes_gltf(scene.run.job)) return;
  SaveImageOptions file_options = options;
  file_options.use = texture_use(map, baked.options);
  baked.stored.errors[name] = describe_error(
      stored_error(map.image, file_options, baked.result.coverage), file_options.use);
}

MapFile::MapFile(const BakedMap& map, std::filesystem::path path, const SaveImageOptions& options)
    : kind_(map.kind),
      path_(std::move(path)),
      options_(options),
      rows_(map),
      errors_(map.image.height),
      file_(save_image_rows({map.image.width, map.image.height, map.image.channels}, path_,
                            options)) {}

void MapFile::put(Image& rows, std::span<const std::uint8_t> coverage) {
  std::swap(rows_.image, rows);
  values_.add(rows_, next_row_, coverage);
  rows_.stored = false;
  to_stored(rows_, options_.format);
  if (stores_8_bits(options_)) errors_.add(rows_.image, next_row_, options_, coverage);
  file_->put(rows_.image);
  next_row_ += rows_.image.height;
  std::swap(rows_.image, rows);
}

MapFile* BakedLayout::file_of(const BakedMap& map) const {
  const auto file = std::find_if(files.begin(), files.end(),
                                 [&](const auto& each) { return each->kind() == map.kind; });
  return file != files.end() ? file->get() : nullptr;
}

bool writes_map_rows(const BakeScene& scene, const BakeOptions& options) {
  const Job& job = scene.run.job;
  const RunHooks& hooks = scene.run.hooks;
  return hooks.writes && !hooks.on_baked && !hooks.sample && hooks.not_written.empty() &&
         !job.in_memory && !job.match_auto && !job.layers && !options.encoding.mips &&
         parse_packs(job).empty() && !writes_gltf(job) && !pads_for_mips(job) &&
         writes_rows(job.image.format);
}

MapRows& begin_map_file(const BakeScene& scene, const BakedMap& map, BakedLayout& baked) {
  const Job& job = scene.run.job;
  SaveImageOptions options = job.image;
  options.use = texture_use(map, baked.options);
  options.origin = map.origin;
  options.texts =
      value_texts(job.image, stored_ranges(map, job.image.format), std::string(map.unit));
  const SetNames names = scene.names();
  const std::string name = names.stem + "_" + std::string(map.kind.name) + names.tile;
  baked.files.push_back(std::make_unique<MapFile>(
      map, map_files(out_folder(job), name, 0, job.image).front(), options));
  return *baked.files.back();
}

void finish_map_file(const BakeScene& scene, const BakedMap& map, const std::string& name,
                     MapFile& file, BakedLayout& baked, JobOutputs& outputs) {
  record_stored(scene, map, name, file.values(), baked);
  if (stores_8_bits(scene.run.job.image)) {
    baked.stored.errors[name] = describe_error(file.error(), file.use());
  }
  register_output(scene.run, file.path(), outputs);
  file.commit();
}

}  // namespace kiln
