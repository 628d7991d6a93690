#include "lab/rating.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "arguments/bake_arguments.h"
#include "arguments/bake_values.h"
#include "lab/normal_error.h"
#include "lab/study.h"
#include "lab/value_tiles.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

constexpr double kPictureSide = 330;  // of a square with the mesh's area in a picture
constexpr float kBeside = -99;
constexpr int kSpread = 6;  ///< Texels that fields reach beyond charts, for pictures

/// Pushes values over the borders of charts, so that pictures have no seams of their own.
Image spread(Image field, float none) {
  const auto width = static_cast<std::ptrdiff_t>(field.width);
  const auto height = static_cast<std::ptrdiff_t>(field.height);
  for (int round = 0; round < kSpread; ++round) {
    const std::vector<float> before = field.pixels;
    for (std::ptrdiff_t y = 0; y < height; ++y) {
      for (std::ptrdiff_t x = 0; x < width; ++x) {
        float& value = field.pixels[static_cast<std::size_t>(y * width + x)];
        if (value != none) continue;
        constexpr std::array<std::array<std::ptrdiff_t, 2>, 4> kSteps = {
            {{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
        for (const auto& [dx, dy] : kSteps) {
          if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
          const float other = before[static_cast<std::size_t>((y + dy) * width + x + dx)];
          if (other == none) continue;
          value = other;
          break;
        }
      }
    }
  }
  return field;
}

/// A field as it lies on the mesh, seen from one side: values survive the way through a map of 16 bits, which
/// holds their place between the least and the largest.
Image draw_field(const Device& device, const Mesh& low, const Image& field, float none,
                 const RenderOptions& view) {
  const Image full = spread(field, none);
  float from = std::numeric_limits<float>::max();
  float to = std::numeric_limits<float>::lowest();
  for (const float value : full.pixels) {
    if (value == none) continue;
    from = std::min(from, value);
    to = std::max(to, value);
  }
  const float extent = std::max(to - from, 1e-30F);
  Image map{full.width, full.height, 3, {}};
  map.pixels.reserve(full.pixels.size() * 3);
  for (const float value : full.pixels) {
    const float share = value == none ? 0 : (value - from) / extent;
    map.pixels.insert(map.pixels.end(), {share, 1.0F, value == none ? 0.0F : 1.0F});
  }
  RenderOptions colors = view;
  colors.show_colors = true;
  colors.samples = 1;
  const Image drawn = Scene(device, low, {&map}).draw(colors);
  Image result{drawn.width, drawn.height, 1, {}};
  for (std::size_t i = 0; i < drawn.pixels.size(); i += 3) {
    const bool covered = drawn.pixels[i + 1] > 0;
    const bool known = drawn.pixels[i + 2] > 0.75F;
    result.pixels.push_back(!covered ? kBeside : !known ? none : from + drawn.pixels[i] * extent);
  }
  return result;
}

void draw_pictures(const Device& device, const Mesh& high, const Mesh& low, const Image& map,
                   const RatingOptions& options, Rating& row) {
  RenderOptions view = options.view;
  view.frame = &high;
  const Scene scene(device, low, {&map});
  if (view.size == 0) view.size = picture_size(scene, view, kPictureSide);
  row.shape = gray(scene.draw(view));
  const AssessmentFields& fields = row.match.fields;
  row.object_space = draw_field(device, low, fields.object_space, -1, view);
  row.normalised = draw_field(device, low, fields.normalised_image_space, -1, view);
  row.uniformity = draw_field(device, low, fields.uniformity, -1, view);
  view.show_normals = true;
  view.samples = 1;
  row.angle = normal_angles(Scene(device, high).draw(view), scene.draw(view));
}

/// Bakes next to nothing in the same way, so that seconds are those of the work and not of compiling.
void compile_kernels(const Device& device, const BakeOptions& like) {
  Mesh square;
  square.name = "square";
  square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.1F}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  square.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  square.uv_triangles = square.triangles;
  BakeOptions bake_with = like;
  bake_with.width = bake_with.height = 16;
  bake_with.max_distance = Length::share(0.1);
  bake_with.progress = nullptr;
  bake_with.parts = nullptr;
  bake_with.cage_mesh = nullptr;
  bake_with.match = nullptr;
  bake_with.maps = {find_map(shading_map()).kind};
  bake_with.transfers = {};
  bake_with.own_maps = {};
  bake_with.occlusion = {};
  bake_with.report_errors = false;
  bake(Source(device, square), square, bake_with);
}

/// One row to come.
struct Candidate {
  std::string name, method;
  std::optional<VisibilityAt> visibility_at;
};

/// Every method, and those that take directions of visibility once a place where these are gathered.
std::vector<Candidate> candidates(const RatingOptions& options) {
  std::vector<Candidate> result;
  for (const std::string& method : options.methods) {
    if (!find_match(method).takes_visibility || options.visibility_at.empty()) {
      result.push_back({method, method, std::nullopt});
      continue;
    }
    for (const VisibilityAt at : options.visibility_at) {
      result.push_back({method + "_" + name_of(visibility_at_values(), at), method, at});
    }
  }
  return result;
}

BakeOptions bake_options(const Candidate& candidate, const RatingOptions& options) {
  BakeOptions bake_with;
  bake_with.width = bake_with.height = options.size;
  bake_with.max_distance = options.max_distance;
  bake_with.uv = options.uv;
  if (options.bake_of) bake_with = options.bake_of(candidate.method);
  bake_with.method = match_method(candidate.method);
  if (candidate.visibility_at) bake_with.visibility.at = *candidate.visibility_at;
  bake_with.keep_match = true;
  bake_with.recall_vertices = options.pictures;
  // First of all, for rendered normals, also where its error is not asked for.
  const MapKind shown = find_map(shading_map()).kind;
  std::erase(bake_with.maps, shown);
  bake_with.maps.insert(bake_with.maps.begin(), shown);
  bake_with.report_errors = !options.maps.empty();
  return bake_with;
}

}  // namespace

std::optional<Ratings> rate(const Device& device, const Mesh& high, const Mesh& low,
                            const RatingOptions& options, const Progress& progress) {
  Ratings ratings;
  ratings.views = kHeldOutViews;
  ratings.maps = options.maps;
  if (!progress(0, "preparing the high poly")) return std::nullopt;
  const Source source(device, high);
  ratings.diagonal = source.stats().diagonal;
  ratings.warnings = source.warnings();
  const std::vector<Vec3> usual = spread_views(12);
  std::vector<ViewAngles> angles;
  for (const Vec3& toward : held_out_views(kHeldOutViews, usual, kLeastHeldOutAngle)) {
    angles.push_back(view_angles(toward));
  }
  const NormalReference reference(Scene(device, high), high, angles, options.pixels);
  std::vector<Candidate> rows = candidates(options);
  std::erase_if(rows, [&](const Candidate& row) {
    std::optional<LeftOut> left = unfit(match_method(row.method), "--match " + row.method, source,
                                        high, low, options.uv, options.strict);
    if (left) ratings.left_out.push_back({row.name, left->reason});
    return left.has_value();
  });
  const double steps = static_cast<double>(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Rating row;
    row.name = rows[i].name;
    row.method = rows[i].method;
    row.visibility_at = rows[i].visibility_at;
    BakeOptions bake_with = bake_options(rows[i], options);
    const auto show = [&](double from, double to, const std::string& stage) {
      return [&, from, to, stage](double done, std::string_view) {
        return progress((static_cast<double>(i) + from + (to - from) * done) / steps, stage);
      };
    };

    compile_kernels(device, bake_with);
    bake_with.progress = show(0, 0.2, "matching by " + row.name);
    BakeResult baked = bake(source, low, bake_with);
    row.recalled = std::move(baked.recalled);
    if (baked.cancelled) return std::nullopt;
    const bool found_nothing =
        baked.report.samples != 0 && baked.report.missed == baked.report.samples;
    const bool last_hope = ratings.rows.empty() && i + 1 == rows.size();
    if (found_nothing && !options.strict && !last_hope) {
      ratings.left_out.push_back({row.name, why_nothing(baked.report, high, low)});
      continue;
    }
    check_result(baked.report, high, low);
    row.bake = baked.report;
    std::erase_if(row.bake.errors, [&](const MapError& error) {
      return std::find(options.maps.begin(), options.maps.end(), error.kind.name) ==
             options.maps.end();
    });
    AssessOptions assess_with;
    assess_with.directions = options.directions;
    if (baked.report.views) assess_with.avoid = baked.report.views->directions;
    assess_with.fields = options.pictures;
    assess_with.progress = show(0.2, 0.8, "rating " + row.name);
    row.match = assess(source, low, *baked.match, assess_with);
    if (row.match.cancelled) return std::nullopt;
    if (!show(0.8, 1, "comparing normals")(0, "")) return std::nullopt;
    const Image& map = baked.maps[0].image;
    const Scene scene(device, low, {&map});
    row.normal = reference.compare(scene);
    if (ratings.rows.empty()) ratings.without_map = reference.compare(scene, true);
    if (options.pictures) {
      draw_pictures(device, high, low, map, options, row);
      row.normal_error = normal_error_texture(device, Scene(device, high), scene, high, low, angles,
                                              map.width, map.height, options.pixels);
    }
    ratings.rows.push_back(std::move(row));
  }
  return ratings;
}

Mesh recall_mesh(const Mesh& high, const Rating& row) {
  constexpr std::array<std::array<std::uint8_t, 4>, 3> kColors = {
      {{160, 160, 160, 255}, {60, 160, 75, 255}, {215, 40, 40, 255}}};
  Mesh mesh = high;
  mesh.colors.clear();
  for (const Recalled recalled : row.recalled) {
    mesh.colors.push_back(kColors[static_cast<std::size_t>(recalled)]);
  }
  return mesh;
}

Plot ratings_plot(const Ratings& ratings) {
  struct Measure {
    const char* title;
    const char* unit;
    const Image Rating::*picture;
    double (*value)(const Rating&, float);  ///< Of a pixel, as ValueTiles has it
  };
  const auto share = [](const Rating& row, float pixel) {
    return pixel == kBeside ? ValueTiles::kBeside
           : pixel < 0      ? ValueTiles::kNotKnown
                            : 100 * pixel / row.match.diagonal;
  };
  const auto plain = [](const Rating&, float pixel) {
    return pixel == kBeside ? ValueTiles::kBeside
           : pixel < 0      ? ValueTiles::kNotKnown
                            : double{pixel};
  };
  const auto angle = [](const Rating&, float pixel) {
    return pixel == -1 ? ValueTiles::kBeside : pixel < 0 ? ValueTiles::kNotKnown : double{pixel};
  };
  const std::array<Measure, 4> measures = {
      {{"object space", "% of the diagonal", &Rating::object_space, share},
       {"normalised image space", "0 to 1", &Rating::normalised, plain},
       {"uniformity", "% longer or shorter", &Rating::uniformity, plain},
       {"error of the normal", "degrees", &Rating::angle, angle}}};
  ValueTiles tiles;
  std::vector<Json> shades;
  for (const Rating& row : ratings.rows) shades.push_back(tiles.add_gray(row.shape)["index"]);
  Json blocks = Json::array();
  for (const Measure& measure : measures) {
    Json block = {{"title", measure.title}, {"unit", measure.unit}};
    for (std::size_t i = 0; i < ratings.rows.size(); ++i) {
      const Rating& row = ratings.rows[i];
      Json tile =
          tiles.add(row.*measure.picture, [&](float pixel) { return measure.value(row, pixel); });
      tile["shade"] = shades[i];
      tile["captions"] = Json::array({row.name});
      block["tiles"].push_back(std::move(tile));
    }
    blocks.push_back(std::move(block));
  }
  return {
      "measure",
      {{"kind", "pictures"},
       {"image", "measure_plot.png"},
       {"tile", tiles.size()},
       {"blocks", blocks},
       {"legend", {{{"code", 1}, {"text", "missed, never visible, or seen of one mesh only"}}}}},
      tiles.image()};
}

}  // namespace kiln::cli
