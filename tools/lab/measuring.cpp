#include "lab/measuring.h"

#include <algorithm>

#include "job/check_result.h"
#include "kiln/measure.h"
#include "kiln/option_error.h"
#include "kiln/render.h"
#include "lab/table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

/// Texels per side of the map that is baked to find out whether two UV layouts agree.
constexpr std::uint32_t kTrialSize = 256;

/// Returns the reason why a match by UVs does not suit the meshes; empty if it does.
std::string explain_uv_mismatch(MatchMethod method, const Source& source, const Mesh& high,
                                const Mesh& low, const UvOptions& uv) {
  if (high.uvs.empty()) return "'" + high.name + "' has no UVs.";
  BakeOptions trial;
  trial.match.method = method;
  trial.match.uv = uv;
  trial.width = trial.height = kTrialSize;
  try {
    const BakeReport report = bake(source, low, trial).report;
    if (report.samples != 0 && report.missed == report.samples)
      return explain_empty_result(report, high, low).text(option_as_flag);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) throw;
    return error.message().text(option_as_flag);
  }
  return {};
}

/// Texels per side of the map that make_uv_map() returns. UVs are linear, so bilinear filtering of the map is exact.
constexpr std::uint32_t kUvMapSide = 256;

/// Makes a map with three channels: u and v of the texel's centre, and 1.
Image make_uv_map() {
  Image map{kUvMapSide, kUvMapSide, 3, {}};
  for (std::uint32_t y = 0; y < kUvMapSide; ++y) {
    for (std::uint32_t x = 0; x < kUvMapSide; ++x) {
      map.pixels.insert(map.pixels.end(), {(static_cast<float>(x) + 0.5F) / kUvMapSide,
                                           (static_cast<float>(y) + 0.5F) / kUvMapSide, 1.0F});
    }
  }
  return map;
}

}  // namespace

void refuse_flags(const LabArguments& a, const std::set<std::string>& flags,
                  const std::string& why) {
  for (const std::string& flag : flags) {
    refuse_if(a.was_given(flag), flag + " " + why);
  }
}

std::vector<ViewAngles> angles_of(const std::vector<Vec3>& directions) {
  std::vector<ViewAngles> angles;
  for (const Vec3& toward : directions) angles.push_back(view_angles(toward));
  return angles;
}

std::vector<ViewAngles> default_held_out_angles() {
  return angles_of(held_out_views(kHeldOutViews, spread_views(12), kMinHeldOutAngle));
}

Json describe_views(const std::vector<Vec3>& held_out, std::uint32_t size, double least_angle) {
  Json directions = Json::array();
  for (const Vec3& d : held_out) directions.push_back(Json::array({d.x, d.y, d.z}));
  return fields("views size least_angle_to_a_matching_view_degrees directions",
                {held_out.size(), size, least_angle, directions});
}

void check_meshes_are_visible(const NormalError& error, const Mesh& high, const Mesh& low) {
  if (error.pixels != 0) return;
  throw Error(ErrorCode::input, "'" + low.name + "' and '" + high.name +
                                    "' do not overlap in any picture, so no error can be measured: "
                                    "place both at the same position, in the same units.");
}

Json describe_left_out(const std::vector<OmittedSetting>& left_out, const char* key,
                       std::vector<std::string>* lines) {
  Json json = Json::array();
  for (const OmittedSetting& omitted : left_out) {
    json.push_back({{key, omitted.name}, {"reason", omitted.reason}});
    if (lines != nullptr) lines->push_back("left out: " + omitted.name + ": " + omitted.reason);
  }
  return json;
}

std::optional<OmittedSetting> explain_unsuitable(MatchMethod method, const std::string& name,
                                                 const Source& source, const Mesh& high,
                                                 const Mesh& low, const UvOptions& uv,
                                                 bool required) {
  if (!obeys(find_match(method.name), "match.uv")) return std::nullopt;
  const std::string reason = explain_uv_mismatch(method, source, high, low, uv);
  if (reason.empty()) return std::nullopt;
  if (required) {
    throw Error(ErrorCode::input,
                name + " does not suit '" + high.name + "' and '" + low.name + "': " + reason);
  }
  return OmittedSetting{name, reason};
}

TexelViews::TexelViews(const Device& device, const Mesh& low)
    : map_(make_uv_map()), scene_(device, low, {&map_}) {}

std::vector<std::size_t> TexelViews::find_texels(RenderOptions view, std::uint32_t size) const {
  view.samples = 1;
  view.show_normals = false;
  view.show_colors = true;
  const Image picture = scene_.draw(view);
  const auto cell = [&](float share) {
    return std::min(static_cast<std::uint32_t>(std::max(0.0F, share) * static_cast<float>(size)),
                    size - 1);
  };
  std::vector<std::size_t> texels;
  for (std::size_t i = 0; i < picture.pixels.size(); i += 3) {
    const float* uv = &picture.pixels[i];
    texels.push_back(uv[2] < 0.999F ? kNone : std::size_t{cell(uv[1])} * size + cell(uv[0]));
  }
  return texels;
}

Image make_normal_error_texture(const TexelViews& texel_views, const Scene& high,
                                const Scene& shown, const Mesh& frame,
                                const std::vector<ViewAngles>& views, std::uint32_t size,
                                std::uint32_t pixels) {
  std::vector<double> sums(std::size_t{size} * size);
  std::vector<std::uint32_t> counts(sums.size());
  for (const ViewAngles& angles : views) {
    RenderOptions view;
    view.frame = &frame;
    view.size = pixels;
    view.samples = 1;
    view.azimuth_degrees = angles.azimuth_degrees;
    view.elevation_degrees = angles.elevation_degrees;
    view.trim = false;
    view.show_normals = true;
    const Image error = normal_angles(high.draw(view), shown.draw(view));
    const std::vector<std::size_t> texels = texel_views.find_texels(view, size);
    for (std::size_t i = 0; i < texels.size(); ++i) {
      if (error.pixels[i] < 0 || texels[i] == TexelViews::kNone) continue;
      sums[texels[i]] += error.pixels[i];
      ++counts[texels[i]];
    }
  }
  Image result{size, size, 1, {}};
  for (std::size_t i = 0; i < sums.size(); ++i) {
    result.pixels.push_back(counts[i] == 0 ? -1.0F : static_cast<float>(sums[i] / counts[i]));
  }
  return result;
}

}  // namespace kiln::cli
