#include "job/match_inputs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "clean/high_hulls.h"
#include "job/job_options.h"
#include "job/map_words.h"
#include "job/transfers.h"
#include "kiln/cage.h"
#include "kiln/collision_hulls.h"
#include "kiln/image.h"
#include "options/parse.h"

namespace kiln {
void check_cage_directions(const Job& arguments, const Mesh& low, const Mesh& cage) {
  if (cage.triangles.size() != low.triangles.size()) return;
  // If a vertex of LOW corresponds to two different points, the cage is an independent hull that has the same number of
  // triangles by chance.
  std::vector<std::optional<std::uint32_t>> cage_vertex_of(low.positions.size());
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t cage_vertex = cage.triangles[t][k];
      const std::uint32_t first_cage_vertex =
          cage_vertex_of.at(low.triangles[t][k]).value_or(cage_vertex);
      if (cage.positions.at(first_cage_vertex) != cage.positions.at(cage_vertex)) return;
      cage_vertex_of[low.triangles[t][k]] = first_cage_vertex;
    }
  }
  for (const char* flag : {"--direction", "--edge-width"}) {
    if (!arguments.given.contains(flag)) continue;
    fail_usage(option_of(flag) + " does not apply to rays from a " + option("cage_mesh") +
               " with LOW's own triangles, which defines the directions of rays: leave one out.");
  }
}

void MatchInputs::read(const Job& job, const Mesh& high, const Mesh& low,
                       std::vector<Warning>& warnings) {
  if (!job.cage_mesh.empty()) {
    cage_mesh_ = load_cage(job.cage_mesh, low, load_options(job, MeshSide::low), &warnings);
    check_cage_directions(job, low, *cage_mesh_);
  }
  for (const std::string& file : job.occluders) {
    Mesh occluder = load_mesh(file, load_options(job, MeshSide::other), &warnings);
    if (!job.keep_hulls) drop_hidden_hulls(occluder, warnings);
    occluders_.push_back(std::move(occluder));
  }
  if (job.parts_by) {
    parts_ = pair_parts(high, low, part_names(job));
    warnings.insert(warnings.end(), parts_->warnings.begin(), parts_->warnings.end());
  }
}

void MatchInputs::read_with_match(const Job& job, const Mesh& high, const Mesh& low,
                                  std::vector<Warning>& warnings) {
  if (const SetsBy sets = choose_texture_sets(low); sets != SetsBy::none) {
    throw OptionError(
        "LOW '" + low.name + "' has several texture sets, one per " +
            (sets == SetsBy::udim ? "UDIM tile" : "material") +
            ": their UVs overlap, so one map cannot hold them. `kiln bake` makes a map for each. "
            "Here, give a LOW with one set, or one UV layout for all (kiln bake " +
            option("unwrap") + ").",
        ErrorCode::input, "several-sets");
  }
  read(job, high, low, warnings);
  if (!job.load_match.empty()) match_ = load_match(job.load_match);
}

void MatchInputs::find_cage(const Source& source, const Mesh& low, const BakeOptions& options,
                            std::vector<Warning>& warnings) {
  found_cage_ = kiln::find_cage(source, low, options);
  warnings.insert(warnings.end(), found_cage_->warnings.begin(), found_cage_->warnings.end());
  cage_mesh_ = std::move(found_cage_->mesh);
}

void MatchInputs::find_cage(const Job& job, const Device& device, const Mesh& high, const Mesh& low,
                            std::vector<Warning>& warnings) {
  if (!job.cage_auto) return;
  BakeOptions options = options_of(job);
  apply(options);
  find_cage(Source(device, high), low, options, warnings);
}

void MatchInputs::apply_cage(BakeOptions& options) const {
  if (cage_mesh_) options.match.cage_mesh = &*cage_mesh_;
  // The search distance only limited how far find_cage() searched. Rays from the found cage end at the cage itself.
  if (found_cage_) options.match.max_distance.reset();
}

void MatchInputs::apply(BakeOptions& options) const {
  apply_cage(options);
  if (parts_) options.match.parts = &*parts_;
  for (const Mesh& mesh : occluders_) options.occlusion.by_others.push_back(&mesh);
  copy_occluders_to_variants(options);
  if (!match_) return;
  options.match.saved = &*match_;
  options.width = match_->width / match_->samples;
  options.height = match_->height / match_->samples;
  options.samples = match_->samples;
}

namespace {

/// Removes collision hulls, and corrects the index of each file's first triangle.
void remove_collision_hulls(MeshFiles& files, std::vector<Warning>& warnings) {
  const std::vector<std::uint8_t> is_hull = collision_hulls(files.mesh);
  files.hulls = take_collision_hulls(files.mesh, &warnings);
  keep_named_materials(files);
  for (std::size_t& first : files.first) {
    first -= static_cast<std::size_t>(
        std::count(is_hull.begin(), is_hull.begin() + static_cast<std::ptrdiff_t>(first), 1));
  }
}

}  // namespace

MeshFiles load_low_files(const Job& arguments, std::vector<Warning>& warnings,
                         bool with_materials) {
  MeshFiles files = load_meshes(arguments.low.given, load_options(arguments, MeshSide::low),
                                has_more_files(arguments), warnings,
                                with_materials || !asset_file(arguments).empty());
  if (!arguments.file_tangents) {
    files.mesh.tangents = {};
  } else if (arguments.given.contains("--tangents") && files.mesh.tangents.empty()) {
    throw OptionError(option("tangents", "file") + ": LOW " + quote_files(files.files) +
                          " has none. Only PLY files hold them, as vertex properties tx, ty, tz "
                          "and tw beside UVs; leave " +
                          option("tangents") + " out to use MikkTSpace.",
                      ErrorCode::input);
  }
  if (!arguments.keep_hulls) remove_collision_hulls(files, warnings);
  correct_normals("LOW", Trusted::normals, files.mesh, warnings);
  return files;
}

Mesh load_low(const Job& arguments, std::vector<Warning>& warnings) {
  MeshFiles files = load_low_files(arguments, warnings);
  warn_of_shared_texels(files, warnings);
  return arguments.split_at_seams ? split_at_seams(files.mesh) : std::move(files.mesh);
}

namespace {

constexpr std::size_t kMaxCageColumns = 4096;
constexpr float kNoVertex = -1;

bool is_image_file(const std::filesystem::path& path) { return lower_extension(path) == ".exr"; }

std::array<double, 3> offset_between(const Vec3& from, const Vec3& to) {
  return {double{to.x} - from.x, double{to.y} - from.y, double{to.z} - from.z};
}

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Layout of an image with one shell of a cage per half: one pixel per vertex.
struct CageGrid {
  std::uint32_t width = 0, rows = 0;

  explicit CageGrid(std::size_t vertices)
      : width(static_cast<std::uint32_t>(std::min(vertices, kMaxCageColumns))),
        rows(static_cast<std::uint32_t>((vertices + kMaxCageColumns - 1) / kMaxCageColumns)) {}
  std::size_t pixels() const { return std::size_t{width} * rows; }
};

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& problem) {
  throw OptionError("'" + path.string() + "' is no cage of LOW: " + problem + ". Save one with " +
                        option("cage", "auto") + " " + option("save_cage", "FILE.exr") + ".",
                    ErrorCode::input);
}

Image cage_image(const Mesh& cage, const Mesh& low) {
  const std::size_t count = low.positions.size();
  const CageGrid grid(count);
  Image image;
  image.width = grid.width;
  image.height = 2 * grid.rows;
  image.channels = 4;
  for (std::size_t shell = 0; shell < 2; ++shell) {
    for (std::size_t v = 0; v < grid.pixels(); ++v) {
      if (v >= count) {
        image.pixels.insert(image.pixels.end(), {0, 0, 0, kNoVertex});
        continue;
      }
      const Vec3 &vertex = low.positions[v], &outer = cage.positions[v],
                 &inner = cage.positions[count + v];
      std::array<double, 3> direction = offset_between(inner, outer);
      const double size = std::sqrt(dot(direction, direction));
      std::array<float, 3> unit{};
      for (std::size_t k = 0; k < 3 && size > 0; ++k) {
        unit[k] = static_cast<float>(direction[k] / size);
        direction[k] = double{unit[k]};
      }
      const std::array<double, 3> vertex_offset =
          shell == 0 ? offset_between(vertex, outer) : offset_between(inner, vertex);
      const double distance =
          size > 0 ? dot(vertex_offset, direction) / dot(direction, direction) : 0;
      image.pixels.insert(image.pixels.end(),
                          {unit[0], unit[1], unit[2], static_cast<float>(distance)});
    }
  }
  return image;
}

}  // namespace

void save_cage(const Mesh& cage, const Mesh& low, const std::filesystem::path& path) {
  if (is_image_file(path)) {
    save_image(cage_image(cage, low), path, {ImageFormat::exr_float});
  } else {
    save_obj(cage, path);
  }
}

Mesh cage_from_image(const Image& image, const std::filesystem::path& path, const Mesh& low) {
  const std::size_t count = low.positions.size();
  const CageGrid grid(count);
  if (image.channels != 4) {
    fail(path, "it has " + std::to_string(image.channels) + " channels instead of 4");
  }
  if (image.width != grid.width || image.height != 2 * grid.rows) {
    fail(path, "it has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                   " pixels, but LOW's " + std::to_string(count) + " vertices need " +
                   std::to_string(grid.width) + " x " + std::to_string(2 * grid.rows));
  }
  Mesh cage;
  cage.name = path.stem().string();
  cage.origin = low.origin;
  cage.group_names = {"outer", "inner"};
  for (std::uint32_t shell = 0; shell < 2; ++shell) {
    const auto pixel = [&](std::size_t v) {
      return &image.pixels[4 * (shell * grid.pixels() + v)];
    };
    // A single row is exactly as wide as the number of vertices. With more rows, trailing pixels without a vertex have
    // no direction.
    std::size_t used_pixels = grid.pixels();
    while (grid.rows > 1 && used_pixels > 0 && pixel(used_pixels - 1)[3] == kNoVertex &&
           std::all_of(pixel(used_pixels - 1), pixel(used_pixels - 1) + 3,
                       [](float x) { return x == 0; })) {
      --used_pixels;
    }
    if (used_pixels != count) {
      fail(path,
           "it has " + std::to_string(used_pixels) + " vertices, and LOW " + std::to_string(count));
    }
    for (std::size_t v = 0; v < count; ++v) {
      const float* p = pixel(v);
      if (p[3] == kNoVertex) {
        fail(path, std::string("the ") + (shell == 0 ? "outer" : "inner") + " pixel of vertex " +
                       std::to_string(v) + " has alpha -1, which marks pixels without a vertex");
      }
      if (!std::all_of(p, p + 4, [](float x) { return std::isfinite(x); })) {
        fail(path, std::string("the ") + (shell == 0 ? "outer" : "inner") + " pixel of vertex " +
                       std::to_string(v) + " is NaN or infinite");
      }
      const double distance = shell == 0 ? double{p[3]} : -double{p[3]};
      const Vec3& low_position = low.positions[v];
      cage.positions.push_back({static_cast<float>(double{low_position.x} + p[0] * distance),
                                static_cast<float>(double{low_position.y} + p[1] * distance),
                                static_cast<float>(double{low_position.z} + p[2] * distance)});
    }
    const auto first = static_cast<std::uint32_t>(shell * count);
    for (const Triangle& t : low.triangles) {
      cage.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      cage.groups.push_back(shell);
    }
  }
  return cage;
}

Mesh load_cage(const std::filesystem::path& path, const Mesh& low, const LoadMeshOptions& options,
               std::vector<Warning>* warnings) {
  if (is_image_file(path)) return cage_from_image(load_image(path), path, low);
  Mesh cage = load_mesh(path, options, warnings);
  // The cage may be a copy of LOW's whole file, including its collision hulls.
  if (cage.triangles.size() > low.triangles.size()) take_collision_hulls(cage);
  return cage;
}

}  // namespace kiln
