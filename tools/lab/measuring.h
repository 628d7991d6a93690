// Common measures of ratings, charts, studies and galleries: held-out views, and suitability of matches.
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
/// minimum angle in degrees between a view for matching and a view for measuring
constexpr double kMinHeldOutAngle = 2;

/// Throws an error if one of the flags was given: they have no effect with these arguments. The message is "FLAG is for
/// WHY". \throws Error(usage)
void refuse_flags(const LabArguments& arguments, const std::set<std::string>& flags,
                  const std::string& why);

std::vector<ViewAngles> angles_of(const std::vector<Vec3>& directions);
/// Returns kHeldOutViews view directions, none of which is near one of the 12 default views of a bake.
std::vector<ViewAngles> usual_held_out_angles();
/// Describes held-out views for a report. \param size  pixels per side of their pictures
Json describe_views(const std::vector<Vec3>& held_out, std::uint32_t size, double least_angle);

/// Checks that at least one picture shows both meshes. \throws Error(input) if none does
void check_meshes_are_visible(const NormalError& error, const Mesh& high, const Mesh& low);

/// A setting that does not suit the meshes, with the reason.
struct OmittedSetting {
  std::string name, reason;
};
/// Describes settings that were left out for a report.
/// \param key    key of the setting's name
/// \param lines  receives a line of text for each; null: none
Json describe_left_out(const std::vector<OmittedSetting>& left_out, const char* key,
                       std::vector<std::string>* lines = nullptr);

/// Checks whether a match suits two meshes. For matching by UVs, HIGH must have UVs, and both layouts must agree and
/// overlap, which a bake of a small map checks. Other matches always suit.
/// \param name  name of the setting, for messages
/// \param must  true to throw if the match does not suit
/// \returns nullopt if it suits
/// \throws Error(input) if it must suit, but does not
std::optional<OmittedSetting> explain_unsuitable(MatchMethod method, const std::string& name,
                                                 const Source& source, const Mesh& high,
                                                 const Mesh& low, const UvOptions& uv, bool must);

/// Finds the texel that each pixel of LOW's pictures shows.
class TexelViews {
 public:
  static constexpr std::size_t kNone = ~std::size_t{0};  ///< marks pixels that do not show LOW

  TexelViews(const Device& device, const Mesh& low);

  /// Finds the texels that a picture shows.
  /// \param size  texels per side of the map
  /// \returns one texel index per pixel, rows from the top
  std::vector<std::size_t> texels(RenderOptions view, std::uint32_t size) const;

 private:
  Image map_;
  Scene scene_;
};

/// Projects the error of rendered normals back onto texels. The value of a texel is the mean angle between HIGH's
/// rendered normals and LOW's with its map, over all pixels of all views that show the texel.
/// \param shown   LOW with its map
/// \param size    texels per side of the result
/// \param pixels  pixels per side of the pictures
/// \returns degrees, one channel; -1 if no view shows both meshes at the texel
Image normal_error_texture(const TexelViews& texel_views, const Scene& high, const Scene& shown,
                           const Mesh& frame, const std::vector<ViewAngles>& views,
                           std::uint32_t size, std::uint32_t pixels);

}  // namespace kiln::cli
