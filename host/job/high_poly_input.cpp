#include "job/high_poly_input.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "base/memory.h"
#include "base/option.h"
#include "clean/high_hulls.h"
#include "job/mesh_files.h"
#include "kiln/height_field.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// Upper bound of the distance between a height field's surface and the plane under it, as a share of the diagonal.
double max_height_share(const Mesh& field) {
  const Bounds box = Bounds::of(field);
  double squared_diagonal = 0;
  for (std::size_t k = 0; k < 3; ++k) squared_diagonal += std::pow(box.high[k] - box.low[k], 2);
  const double max_distance =
      std::max({std::abs(box.low[2]), std::abs(box.high[2]), box.high[2] - box.low[2]});
  return squared_diagonal > 0 ? max_distance / std::sqrt(squared_diagonal) : 0;
}

/// Returns the options of a height field. If they state no extent, it is derived from the file's pixel spacing.
HeightFieldOptions with_file_extent(const Heights& read, HeightFieldOptions options) {
  if (options.width != 0 || options.depth != 0 || read.spacing[0] == 0) return options;
  options.width = (read.image.width - 1.0) * read.spacing[0];
  options.depth = (read.image.height - 1.0) * read.spacing[1];
  return options;
}

void warn_of_no_data(const std::string& path, const NoData& found, const Image& image,
                     const HeightFieldOptions& options, std::vector<Warning>& warnings) {
  const std::string field_label = "The height field '" + path + "'";
  const std::uint64_t all = std::uint64_t{image.width} * image.height;
  if (found.pixels != 0) {
    std::string invalid_values;
    for (const double value : found.values) {
      invalid_values += (invalid_values.empty() ? "" : ", ") + formatted("%.9g", value);
    }
    warnings.push_back(
        {"no-data",
         field_label + " has no valid height in " + with_commas(found.pixels) + " of " +
             plural(all, "pixel") + " (" +
             (invalid_values.empty() ? "not finite" : invalid_values + " or not finite") +
             "): these pixels become holes. Fill them first, or, if " +
             (invalid_values.empty()
                  ? "a number stands for missing heights, give it by " +
                        option("no_data", "VALUE") + "."
                  : "these values are real heights, add " + option("no_data", "none") + "."),
         found.pixels});
  } else if (options.no_data) {
    warnings.push_back({"no-data-idle",
                        field_label + " contains no pixel of " +
                            formatted("%.9g", *options.no_data) + ", the value of " +
                            option("no_data") + ": give the number exactly as the file stores it.",
                        1});
  }
  if (found.doubtful) {
    const std::string value = formatted("%.9g", *found.doubtful);
    warnings.push_back(
        {"no-data-doubtful",
         field_label + " has heights of " + value +
             ", far from all others: if this value stands for missing heights, add " +
             option("no_data", value) + ".",
         1});
  }
}

/// Checks the memory of a bake from a height field before its mesh is built: a picture of 100 KB may give 134 million
/// triangles, so that a later stage would run out of memory after minutes.
void require_field_memory(const std::string& path, const Image& image) {
  // The mesh, its repair and its BVH: 370 bytes a pixel at 2048 x 2048, 400 at 4096 x 4096.
  constexpr std::uint64_t kBytesPerPixel = 350;
  std::uint64_t heights = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += image.channels) {
    heights += std::isfinite(image.pixels[i]) ? 1 : 0;
  }
  require_memory("A bake of the height field '" + path + "' of " + std::to_string(image.width) +
                     " x " + std::to_string(image.height) + " pixels",
                 kBytesPerPixel * heights, [](const std::string& problem) {
                   throw Error(ErrorCode::input,
                               problem + ". Scale the height field down, or raise the " +
                                   option("memory_limit") + ".");
                 });
}

}  // namespace

HeightFieldOptions prepare_heights(const std::string& path, Heights& read,
                                   const HeightFieldOptions& options,
                                   std::vector<Warning>& warnings) {
  const NoData found = mark_no_data(read, options.no_data, options.guess_no_data);
  warn_of_no_data(path, found, read.image, options, warnings);
  return with_file_extent(read, options);
}

std::string mesh_format_list() {
  std::string text;
  for (const std::string& name : mesh_formats()) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string high_poly_formats() {
  return mesh_format_list() + "; or a height field: PNG, EXR, TIFF";
}

bool is_height_field(const std::string& path) {
  const std::string ending = lower_extension(path);
  return ending == ".png" || ending == ".exr" || ending == ".tif" || ending == ".tiff";
}

HighPolyInput load_high(const std::vector<JobInput>& inputs, const HeightFieldOptions& heights,
                        const LoadMeshOptions& options, bool named, std::vector<Warning>& warnings,
                        bool with_materials, bool keep_hulls) {
  if (inputs.size() == 1 && !inputs[0].asset && is_height_field(inputs[0].name)) {
    return load_high(inputs[0].name, heights, warnings, options);
  }
  std::vector<std::string> files;
  for (const JobInput& input : inputs) {
    files.push_back(input.name);
    if (input.asset || !is_height_field(input.name)) continue;
    fail_usage("'" + input.name +
               "' is a height field, which cannot be joined with other "
               "files: give it alone.");
  }
  refuse_if(has_height_field_options(heights),
            option_of("--height") + ", " + option("extent") + " and " + option("no_data") +
                " apply to height fields (PNG, EXR or TIFF), but " + quote_files(files) +
                (files.size() == 1 ? " is a mesh." : " are meshes."));
  MeshFiles read = load_meshes(inputs, options, named, warnings, with_materials);
  if (!keep_hulls) {
    drop_hidden_hulls(read.mesh, warnings);
    keep_named_materials(read);
  }
  // tangents of the file are dropped: HIGH's normal textures use MikkTSpace
  read.mesh.tangents = {};
  correct_normals("HIGH", Trusted::faces, read.mesh, warnings);
  HighPolyInput input;
  input.mesh = std::move(read.mesh);
  input.nodes_and_materials = std::move(read.nodes_and_materials);
  return input;
}

HighPolyInput load_high(const std::string& path, const HeightFieldOptions& heights,
                        std::vector<Warning>& warnings, const LoadMeshOptions& options) {
  if (!is_height_field(path)) {
    return load_high(std::vector<JobInput>{path}, heights, options, /*named=*/false, warnings);
  }
  HighPolyInput input;
  Heights read = load_heights(path, &warnings);
  input.field = prepare_heights(path, read, heights, warnings);
  input.heights = std::move(read.image);
  if (input.heights->channels > 1) {
    warnings.push_back({"height-channels",
                        "The height field '" + path + "' has " +
                            std::to_string(input.heights->channels) +
                            " channels: only the first is used as heights.",
                        1});
  }
  require_field_memory(path, *input.heights);
  input.mesh = height_field_mesh(*input.heights, input.field);
  input.mesh.name = std::filesystem::path(path).stem().string();
  return input;
}

std::optional<CleanOptions> clean_options(CleanHigh choice, bool repair_all, bool keep_inner,
                                          double fill_holes, bool all_parts) {
  if (choice == CleanHigh::none) return std::nullopt;
  CleanOptions options;
  options.windings_alone = choice == CleanHigh::automatic && !repair_all;
  options.keep_inner = keep_inner;
  options.fill_holes = fill_holes;
  if (all_parts) options.floater = 0;
  return options;
}

CleanReport clean_high(Mesh& high, const std::optional<CleanOptions>& options,
                       std::vector<Warning>& warnings) {
  if (!options) return {};
  CleanReport report = clean_mesh(high, *options);
  if (!report.warnings.empty()) {
    report.warnings.back().message += " (" + option("clean", "none") + " leaves HIGH as it is.)";
  }
  warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
  return report;
}

void shade(const ShadingOptions& options, HighPolyInput& high, std::vector<Warning>& warnings) {
  if (!high.heights) high.shading = shade(options, high.mesh, warnings);
}

ShadingReport shade(const ShadingOptions& options, Mesh& high, std::vector<Warning>& warnings) {
  ShadingReport report = shade_high(high, options);
  warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
  return report;
}

Message shading_line(const ShadingReport& shading, const ShadingOptions& options) {
  const bool is_automatic = options.rule == ShadingRule::automatic;
  if (is_automatic && shading.missing == 0) return {};
  const Message rule = " (" + option("high_normals", shading_rule_name(options)) + ")";
  const std::string reason = shading.given == 0
                                 ? "the file has none"
                                 : plural(shading.missing, "triangle") +
                                       (shading.missing == 1 ? " has none" : " have none");
  switch (shading.chosen) {
    case ShadingRule::smooth:
      return "HIGH's normals: smooth" +
             (is_automatic ? "; " + reason +
                                 (shading.parts == 0 ? ", and no edge bends by 20 degrees"
                                                     : ", and its edges bend like those of a scan")
                           : "") +
             rule;
    case ShadingRule::flat:
      return "HIGH's normals: flat" + rule;
    case ShadingRule::angle: {
      std::string text = "HIGH's normals: " + plural(shading.hard_edges, "hard edge") + " in " +
                         with_commas(shading.hard_parts) + " of " + plural(shading.parts, "part");
      text += formatted(", of %.3g degrees or more; edges up to %.3g degrees are smooth",
                        shading.least_degrees, shading.most_degrees);
      if (shading.split_parts != 0) {
        text += "; " + plural(shading.split_parts, "part") +
                (shading.split_parts == 1 ? " follows" : " follow") +
                " the split vertices of the file";
      }
      return text + (is_automatic ? "; " + reason : "") + rule;
    }
    default:
      return "HIGH's normals: " + std::string(shading.given == 0 ? "smooth" : "the file's") + rule;
  }
}

Json describe(const ShadingReport& shading) {
  constexpr const char* kShadingWords[] = {"auto", "file", "smooth", "flat", "hard_edges"};
  return {{"chosen", kShadingWords[static_cast<std::size_t>(shading.chosen)]},
          {"given", shading.given},
          {"missing", shading.missing},
          {"parts", shading.parts},
          {"hard_parts", shading.hard_parts},
          {"split_parts", shading.split_parts},
          {"hard_edges", shading.hard_edges},
          {"least_degrees", shading.least_degrees},
          {"most_degrees", shading.most_degrees},
          {"bent_planes", shading.bent_planes}};
}

void correct_normals(const std::string& which, Trusted trust, Mesh& mesh,
                     std::vector<Warning>& warnings) {
  const AgreedNormals found = agree_normals(mesh, trust);
  const std::uint64_t corrected_count = found.normals + found.faces;
  if (corrected_count + found.unexplained == 0) return;
  const Vec3& example_position = mesh.positions[mesh.triangles[found.first][0]];
  const std::string place_text =
      formatted(", one at (%.5g, %.5g, %.5g)", mesh.origin[0] + example_position.x,
                mesh.origin[1] + example_position.y, mesh.origin[2] + example_position.z);
  const std::string total_text = " of " + with_commas(mesh.triangles.size()) + " triangles";
  const char* remedy =
      " To avoid this, recalculate the normals in the program that made the mesh, or export it "
      "again.";
  if (corrected_count != 0) {
    Message correction_text;
    if (found.faces != 0) {
      correction_text = plural(found.faces, "triangle") + (found.faces == 1 ? " was" : " were") +
                        " flipped to agree with their normals";
    }
    if (found.normals != 0) {
      correction_text += (correction_text.empty() ? "" : "; ") +
                         ("the normals of " + plural(found.normals, "triangle")) +
                         " were flipped to agree with their faces";
    }
    if (found.mirrored != 0) {
      correction_text += "; those of " + with_commas(found.mirrored) + " came from mirroring";
    }
    if (found.unclear != 0) {
      correction_text +=
          ". For " + plural(found.unclear, "triangle") +
          " of open parts it is unknown whether the face or the normal was wrong: check the "
          "map, or add " +
          option("two_sided");
    }
    warnings.push_back({"turned-normals",
                        which + " '" + mesh.name + "': normals of " + with_commas(corrected_count) +
                            total_text + " point against their faces" + place_text + "; " +
                            correction_text + "." + remedy,
                        corrected_count});
  }
  if (found.unexplained != 0) {
    warnings.push_back(
        {"strange-normals",
         which + " '" + mesh.name + "': most normals oppose their faces in parts with " +
             with_commas(found.unexplained) + total_text +
             (corrected_count == 0 ? place_text : "") +
             ", which neither flipping nor mirroring explains; the normals are used unchanged." +
             remedy,
         found.unexplained});
  }
}

Message explain_inside_out(const Mesh& high, const Mesh& low) {
  const InwardParts found = inward_parts(high);
  if (found.count == 0 || inward_parts(low).count != 0) return {};
  const std::string text = formatted(
      "%s of %s that %s a closed surface %s inside out, for example at (%.5g, %.5g, %.5g): rays "
      "hit the "
      "backs of its faces",
      with_commas(found.count).c_str(), plural(found.parts, "part").c_str(),
      found.parts == 1 ? "has" : "have", found.count == 1 ? "is" : "are",
      high.origin[0] + found.example.x, high.origin[1] + found.example.y,
      high.origin[2] + found.example.z);
  return "HIGH '" + high.name + "': " + text +
         ". Flip these faces in the modelling tool (recalculate normals outside), or add " +
         option("two_sided") + ".";
}

UvOptions uv_options(const HighPolyInput& high, UvOptions options) {
  return high.heights ? height_field_uv_options(high.mesh, options) : options;
}

UvOptions height_field_uv_options(const Mesh& field, UvOptions options) {
  const double max_height = max_height_share(field);
  options.warn_distance += max_height;
  options.max_distance += max_height;
  return options;
}

}  // namespace kiln
