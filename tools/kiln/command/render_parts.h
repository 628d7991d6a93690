// Parts of `kiln render`: arguments, baked map, pictures and measurements.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "job/describe.h"
#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "kiln/render.h"
#include "picture/mapped_mesh.h"
#include "picture/sheet.h"
#include "picture/view_arguments.h"
#include "report/console.h"

namespace kiln::cli {

struct RenderArguments {
  std::string mesh, normal, reference, out, device, json;
  LitMapFiles apply_maps;
  std::vector<std::string> show;
  HeightFieldOptions heights;
  ViewArguments view;
  std::uint32_t size = 512, samples = 3, ambient_rays = 64, views = 0;
  std::optional<std::uint32_t> frames;
  Job bake;  // Options of the baked map; bake.given holds the flags that were given
  std::uint32_t map_size = 1024;
  bool map_size_given = false;
  NormalMapSpace space = NormalMapSpace::tangent;
  Bitangent bitangent = Bitangent::pixel;
  bool flip_y = false, flat = false, show_normals = false, error = false, quiet = false;
  bool draw_cage = false, no_maps = false;
};

/// True if a map must be baked for the picture: if --map-size was given, or if a flag of matching was given without
/// --draw-cage.
bool requests_baked_map(const RenderArguments& arguments);

/// Converts the arguments to the job that bakes the map.
Job bake_job_of(const RenderArguments& arguments);

/// Checks the arguments of the bake before meshes are read. \throws Error(usage)
void check_bake(const RenderArguments& arguments);

Image bake_map(const RenderArguments& arguments, const Device& device, const HighPolyInput& dense,
               const Mesh& mesh, std::vector<Warning>& warnings);

/// Joins pictures side by side, separated by thin lines.
Image join(std::vector<Image> panels);
/// Checks the memory for pictures before the first one is drawn.
/// \param count  maximum number of pictures at a time
/// \throws Error(internal) if they do not fit
void require_pictures(const PictureGeometry& size, std::uint64_t count);
/// Returns the seven views in which pages and `kiln render` measure angles: the view of the options, and the views from
/// both directions of each axis.
std::vector<ViewAngles> list_measured_views(const RenderOptions& options);
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map);
Image draw_contact_sheet(const Scene& scene, std::uint32_t count, RenderOptions options);
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up);

/// Warns if HIGH's normals fit the map better with inverted green: if the error of rendered normals falls by at least
/// 10%.
/// \param map  not checked if it has no image
/// \param frame  the mesh that the pictures show in full: the high poly
void check_green_channel(const Device& device, const Mesh& mesh, NormalMap map, const Scene& high,
                         const Mesh& frame, bool z_up, std::vector<Warning>& warnings);

/// Returns the surface at which rays start, by --cage, --cage-mesh and related flags; of two shells the outer one.
/// \param high  may be null
/// \throws Error(usage) if the cage is relative to HIGH's diagonal, or auto, without HIGH; Error(input)
Mesh outer_cage(const Job& arguments, const Device& device, const Mesh& low, const Mesh* high,
                std::vector<Warning>& warnings);

class CagePicture {
 public:
  CagePicture(const Device& device, Mesh cage);

  const Mesh& mesh() const { return mesh_; }
  /// Tints the pixels that the cage covers, and draws its edges that face the viewer. Parts of the scene outside the
  /// cage stay unchanged.
  /// \param within  the scene that `picture` shows, drawn with `options`
  void draw(const Scene& within, const RenderOptions& options, Image& picture) const;

 private:
  Mesh mesh_;
  Scene scene_;
};

}  // namespace kiln::cli
