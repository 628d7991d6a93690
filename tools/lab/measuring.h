// Code that ratings, charts, studies and galleries share: held-out views, which are view directions that measure errors
// and that no match uses, and the check whether a match suits the meshes.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "job/describe.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/lab_arguments.h"
#include "picture/sheet.h"

namespace kiln::cli {

constexpr std::uint32_t kHeldOutViews = 30;
/// Minimum angle in degrees between a held-out view and a view for matching.
constexpr double kMinHeldOutAngle = 2;

/// Rejects flags that have no effect with these arguments.
/// \param why  the message after the flag, such as "is for pictures: add --out."
/// \throws Error(usage) if one of the flags was given
void refuse_flags(const LabArguments& arguments, const std::set<std::string>& flags,
                  const std::string& why);

std::vector<ViewAngles> angles_of(const std::vector<Vec3>& directions);
/// Returns kHeldOutViews view directions, each at least kMinHeldOutAngle away from the 12 default views of a bake.
std::vector<ViewAngles> default_held_out_angles();
/// Describes held-out views for a report.
/// \param size         pixels per side of their pictures
/// \param least_angle  smallest angle in degrees between a held-out view and a view for matching
Json describe_views(const std::vector<Vec3>& held_out, std::uint32_t size, double least_angle);

/// Checks that at least one picture shows both meshes. \throws Error(input) if none does
void check_meshes_are_visible(const NormalError& error, const Mesh& high, const Mesh& low);

/// A setting that is left out because it does not suit the meshes, with the reason.
struct OmittedSetting {
  std::string name, reason;
};
/// Describes for a report the settings that were left out.
/// \param key    key of a setting's name in the report, such as "method"
/// \param lines  receives a line of text for each setting; may be null
Json describe_left_out(const std::vector<OmittedSetting>& left_out, const char* key,
                       std::vector<std::string>* lines = nullptr);

/// Checks whether a match suits two meshes. For matching by UVs, HIGH must have UVs, and both layouts must agree and
/// overlap, which a bake of a small map checks. Other matches always suit.
/// \param name  name of the setting, for messages
/// \param required  true to throw if the match does not suit
/// \returns the reason why the match does not suit; nullopt if it suits
/// \throws Error(input) if the match is required, but does not suit
std::optional<OmittedSetting> explain_unsuitable(MatchMethod method, const std::string& name,
                                                 const Source& source, const Mesh& high,
                                                 const Mesh& low, const UvOptions& uv,
                                                 bool required);

/// Finds which texel of a map each pixel of a picture of LOW shows.
class TexelViews {
 public:
  static constexpr std::size_t kNone = ~std::size_t{0};  ///< Index for pixels that do not show LOW

  TexelViews(const Device& device, const Mesh& low);

  /// \param size  texels per side of the map
  /// \returns a texel index for each pixel of the view's picture, rows from the top; kNone where LOW is not visible
  std::vector<std::size_t> find_texels(RenderOptions view, std::uint32_t size) const;

 private:
  Image map_;
  Scene scene_;
};

/// Projects the error of rendered normals back onto texels. The value of a texel is the mean angle between HIGH's
/// rendered normals and LOW's with its map, over all pixels of all views that show the texel.
/// \param shown   LOW with its map
/// \param frame   the mesh that the pictures show in full
/// \param size    texels per side of the result
/// \param pixels  pixels per side of the pictures
/// \returns degrees, one channel; -1 if no view shows both meshes at the texel
Image make_normal_error_texture(const TexelViews& texel_views, const Scene& high,
                                const Scene& shown, const Mesh& frame,
                                const std::vector<ViewAngles>& views, std::uint32_t size,
                                std::uint32_t pixels);

}  // namespace kiln::cli
