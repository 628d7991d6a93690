// Pictures of every way to match, side by side: `kiln gallery HIGH LOW`.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "lab/uv_fit.h"
#include "picture/sheet.h"
#include "report/report.h"

namespace kiln::cli {

struct GalleryOptions {
  std::vector<std::string> methods;  ///< As `kiln bake --match` has them
  bool strict = false;  ///< All must do for the meshes. Else those that do not are left out
  UvOptions uv;
  std::uint32_t size = 1024;   ///< Texels a side
  std::uint32_t pixels = 512;  ///< A side of the pictures whose normals are measured
  Length max_distance = Length::share(0.02);
  RenderOptions view;  ///< Without a frame
};

/// One way to match.
struct Exhibit {
  std::string method;
  BakeReport bake;
  Image map;     ///< Normals, tangent space
  Image points;  ///< F(p) of each texel's middle p, object space, from `origin`
  std::array<double, 3> origin{};
  Image offsets;                       ///< F(p) - p
  std::vector<std::uint8_t> coverage;  ///< Of both, per texel: 1 where a point was found
  double mean_degrees = 0;             ///< Of rendered normals, from the pictures' view
  Image error;                         ///< Of the normal, per texel; see normal_error_texture()
};

struct Gallery {
  std::vector<Exhibit> exhibits;
  std::vector<LeftOut> left_out;
  std::vector<Warning> warnings;
  Image matches;  ///< Original, low poly and each match (Tarini et al. 2003, figures 7 and 8)
  Image error;    ///< Where each match's normals differ (Wang et al. 2003, figure 4b)
  Image samples;  ///< Where texels' points land on the high poly (Tarini et al., figure 5)
  std::uint32_t every = 1;          ///< Texels between those drawn in `samples`
  std::uint64_t samples_drawn = 0;  ///< On the low poly
};

/// \returns nothing where progress said stop
/// \throws Error(input) where nothing matches, or (strict) a method does not do
std::optional<Gallery> make_gallery(const Device& device, const Mesh& high, const Mesh& low,
                                    const GalleryOptions& options, const Progress& progress);

/// Points of the world as dots on a picture: those that nothing hides.
/// \returns how many
std::uint64_t draw_points(const Scene& scene, const RenderOptions& view,
                          const std::vector<std::array<double, 3>>& points, double radius,
                          const Colour& colour, Canvas& canvas);

Json describe(const Gallery& gallery);

}  // namespace kiln::cli
