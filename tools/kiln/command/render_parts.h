// Parts of `kiln render`: its arguments, its baked map, its pictures and measurements.
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

/// True if a map must be baked for the picture: --map-size was given, or a flag of matching without --draw-cage.
bool bakes(const RenderArguments& arguments);

/// The job of that bake.
Job baking(const RenderArguments& arguments);

/// Checks arguments of the bake before meshes are read. \throws Error(usage)
void check_bake(const RenderArguments& arguments);

Image bake_map(const RenderArguments& arguments, const Device& device, const HighPolyInput& dense,
               const Mesh& mesh, std::vector<Warning>& warnings);

/// Joins pictures side by side, separated by thin lines.
Image join(std::vector<Image> panels);
/// Checks the memory for pictures before the first is drawn. \param count maximum number at a time
/// \throws Error(internal) if they do not fit
void require_pictures(const PictureGeometry& size, std::uint64_t count);
/// The seven views of the measured angles in pages and `kiln render`: the options' own, and both directions of each
/// axis.
std::vector<ViewAngles> measured_views(const RenderOptions& options);
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map);
Image contact_sheet(const Scene& scene, std::uint32_t count, RenderOptions options);
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up);

/// Compares HIGH's rendered normals with those of the map as given and with inverted green. Adds a warning if the error
/// is at least 10% lower inverted.
/// \param map  if it has no image, nothing is checked
/// \param frame  the mesh that the pictures frame: the high poly
void check_green(const Device& device, const Mesh& mesh, NormalMap map, const Scene& high,
                 const Mesh& frame, bool z_up, std::vector<Warning>& warnings);

/// The surface where rays start, by --cage, --cage-mesh and related flags; of two shells the outer one. \param high
/// null: none
/// \throws Error(usage) if the cage is relative to HIGH's diagonal, or auto, without HIGH; Error(input)
Mesh outer_cage(const Job& arguments, const Device& device, const Mesh& low, const Mesh* high,
                std::vector<Warning>& warnings);

class CagePicture {
 public:
  CagePicture(const Device& device, Mesh cage);

  const Mesh& mesh() const { return mesh_; }
  /// Tints the pixels that the cage covers, and draws its edges that face the viewer. Parts of the scene outside the
  /// cage are unchanged. \param within the scene drawn in `picture` with these options
  void draw(const Scene& within, const RenderOptions& options, Image& picture) const;

 private:
  Mesh mesh_;
  Scene scene_;
};

}  // namespace kiln::cli
