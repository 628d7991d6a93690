// Parts of `kiln render`: its arguments, the map that it bakes, its pictures and figures.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "job/describe.h"
#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "kiln/kiln.h"
#include "kiln/render.h"
#include "picture/dressed.h"
#include "picture/sheet.h"
#include "picture/view_arguments.h"
#include "report/console.h"

namespace kiln::cli {

struct RenderArguments {
  std::string mesh, normal, reference, out, device, json;
  DressMaps dress;
  std::vector<std::string> show;
  HeightFieldOptions heights;
  ViewArguments view;
  std::uint32_t size = 512, samples = 3, ambient_rays = 64, views = 0;
  std::optional<std::uint32_t> frames;
  Job bake;  // flags of the match; given ones are in bake.given
  std::uint32_t map_size = 1024;
  bool map_size_given = false;
  NormalMapSpace space = NormalMapSpace::tangent;
  Bitangent bitangent = Bitangent::pixel;
  bool flip_y = false, flat = false, show_normals = false, error = false, quiet = false;
  bool draw_cage = false, no_maps = false;
};

/// True if a map is to be baked for the picture: --map-size was given, or a flag of the match without --draw-cage.
bool bakes(const RenderArguments& arguments);

/// The flags of the match as the bake has them.
Job baking(const RenderArguments& arguments);

/// Checks that would otherwise fail after the meshes were read. \throws Error(usage)
void check_bake(const RenderArguments& arguments);

Image bake_map(const RenderArguments& arguments, const Device& device, const HighPolyInput& dense,
               const Mesh& mesh, std::vector<Warning>& warnings);

/// Pictures side by side, with a thin line between them.
Image join(std::vector<Image> panels);
/// Asks for pictures before the first is drawn. \param count  held at a time, at most
/// \throws Error(internal) where they do not fit
void require_pictures(const PictureGeometry& size, std::uint64_t count);
/// The seven views that angles of a page and of `kiln render` are stated over: that of the options, and both ways along
/// each axis.
std::vector<ViewAngles> measured_views(const RenderOptions& options);
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map);
Image contact_sheet(const Scene& scene, std::uint32_t count, RenderOptions options);
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up);

/// Compares rendered normals with those of the map as it is, and with its green turned round; adds a warning
/// where it fits better so, by a tenth or more.
/// \param map    without an image: nothing is done
/// \param frame  the high poly, which pictures show all of
void check_green(const Device& device, const Mesh& mesh, NormalMap map, const Scene& high,
                 const Mesh& frame, bool z_up, std::vector<Warning>& warnings);

/// The surface that rays start from, as --cage or --cage-mesh and what goes with them say: of two shells the
/// outer one. \param high  null: none
/// \throws Error(usage) where a share of HIGH's diagonal, or auto, is asked for without HIGH; Error(input)
Mesh outer_cage(const Job& arguments, const Device& device, const Mesh& low, const Mesh* high,
                std::vector<Warning>& warnings);

class CagePicture {
 public:
  CagePicture(const Device& device, Mesh cage);

  const Mesh& mesh() const { return mesh_; }
  /// Tints what the cage covers and draws the edges that look to the viewer. What sticks out of it stays as
  /// it is. \param within  drawn in `picture` with these options
  void draw(const Scene& within, const RenderOptions& options, Image& picture) const;

 private:
  Mesh mesh_;
  Scene scene_;
};

}  // namespace kiln::cli
