// Shared measures of ratings, charts, studies and galleries: views that nothing is matched from, and fitness.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "job/describe.h"
#include "kiln/kiln.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/lab_arguments.h"
#include "picture/sheet.h"

namespace kiln::cli {

constexpr std::uint32_t kHeldOutViews = 30;
constexpr double kLeastHeldOutAngle = 2;  ///< Degrees from a view matched from to one measured from

/// Refuses flags that were given but serve nothing: "FLAG is for WHY". \throws Error(usage)
void refuse(const LabArguments& arguments, const std::set<std::string>& flags,
            const std::string& why);

std::vector<ViewAngles> angles_of(const std::vector<Vec3>& directions);
/// kHeldOutViews, none near those of a bake's default of 12 views.
std::vector<ViewAngles> usual_held_out_angles();
/// Description of held-out views, for a report. \param size  of pictures, pixels a side
Json describe_views(const std::vector<Vec3>& held_out, std::uint32_t size, double least_angle);

/// \throws Error(input) where no picture shows both meshes
void check_seen(const NormalError& error, const Mesh& high, const Mesh& low);

/// Something that was to be compared but does not do for two meshes.
struct LeftOut {
  std::string name, reason;
};
/// \param key  of the name \param lines  for people, to which one is added for each; null: none
Json describe_left_out(const std::vector<LeftOut>& left_out, const char* key,
                       std::vector<std::string>* lines = nullptr);

/// True if a way to match does for two meshes. By UVs: HIGH must have some, and both layouts must agree
/// and share some place (found by baking a small map). Others always do.
/// \param name  of what is to be compared, for people
/// \param must  throw where it does not
/// \returns nothing where it does
/// \throws Error(input) where it must do, but does not
std::optional<LeftOut> unfit(MatchMethod method, const std::string& name, const Source& source,
                             const Mesh& high, const Mesh& low, const UvOptions& uv, bool must);

/// Pictures of LOW that say which texel each pixel shows.
class Places {
 public:
  static constexpr std::size_t kNone = ~std::size_t{0};  ///< LOW is not seen there

  Places(const Device& device, const Mesh& low);

  /// \param size  texels a side
  /// \returns an index a pixel, rows from the top
  std::vector<std::size_t> texels(RenderOptions view, std::uint32_t size) const;

 private:
  Image map_;
  Scene scene_;
};

/// The error of rendered normals, brought back onto the texels that show it: the mean angle between HIGH's
/// normals and those that LOW shows with its map, over all pixels of all views with a texel under them.
/// \param shown   LOW with its map
/// \param size    of the result, texels a side
/// \param pixels  a side of the pictures
/// \returns degrees, one channel; -1 where no view sees both meshes
Image normal_error_texture(const Places& places, const Scene& high, const Scene& shown,
                           const Mesh& frame, const std::vector<ViewAngles>& views,
                           std::uint32_t size, std::uint32_t pixels);

}  // namespace kiln::cli
