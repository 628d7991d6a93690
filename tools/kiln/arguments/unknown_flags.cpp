#include "arguments/unknown_flags.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "arguments/near_words.h"
#include "kiln/map.h"
#include "kiln/match.h"

namespace kiln::cli {
namespace {

struct Answer {
  std::string_view flag;  // without dashes
  std::string_view sentence;
};

constexpr std::string_view kTiles = "The flag is --sets udim: maps of each UDIM tile.";
constexpr std::string_view kSkew =
    "By default details on flat faces stand straight, without a skew map. --direction painted "
    "takes "
    "weights from LOW's vertex colours instead. Add edges to LOW where detail slides all the same.";
constexpr std::string_view kExplode =
    "Parts need not be moved apart: --match-by name gives each part of LOW its own part of HIGH.";
constexpr std::string_view kBevel =
    "Kiln bakes no bevels yet. Bevel the edges of HIGH before the bake.";
constexpr std::string_view kDenoise =
    "--ao-error E smooths ambient occlusion where that blurs nothing. For bent_normal and "
    "thickness raise --ao-rays, for other maps --samples.";
constexpr std::string_view kTile = "Kiln divides the work by itself. Leave the tile size out.";
constexpr std::string_view kColour =
    "Colour is a map: --maps color takes HIGH's textures and materials, --maps vertex_color its "
    "vertices' colours.";
constexpr std::string_view kTexture =
    "--transfer mtl:roughness bakes a picture that HIGH's materials name, --transfer FILE any "
    "other, over HIGH's UVs. --pack puts several maps in one file.";
constexpr std::string_view kCage = "The flag is --cage D: rays start this far outside LOW.";
constexpr std::string_view kDistance = "The flag is --max-distance D: how far to look each way.";
constexpr std::string_view kPadding = "The flag is --gutter N: texels of padding around charts.";
constexpr std::string_view kSamples = "The flag is --samples N: N x N samples a texel.";
constexpr std::string_view kRays =
    "The flag is --ao-rays N: rays a sample, of ao, bent_normal and thickness.";
constexpr std::string_view kAoDistance =
    "The flag is --ao-distance D: how far away something still darkens a point.";
constexpr std::string_view kSize = "The flag is --size N, or --size WxH.";
constexpr std::string_view kGreen = "The flag is --flip-y: green points down, as in DirectX.";
constexpr std::string_view kGreenUp = "Green points up by default, as in OpenGL. Leave it out.";
constexpr std::string_view kMeshes =
    "Meshes are given without a flag: kiln bake HIGH LOW --out DIR.";
constexpr std::string_view kOut = "The flag is --out DIR: the folder for the maps.";
constexpr std::string_view kName = "Maps are named after LOW. Rename LOW, or choose another --out.";
constexpr std::string_view kThreads = "The environment variable KILN_THREADS sets the threads.";
constexpr std::string_view kDevice = "The flag is --device NAME: see kiln devices.";
constexpr std::string_view kFalloff =
    "The flag is --ao-falloff linear or smooth: what is further away darkens less.";
constexpr std::string_view kFaces =
    "Rays hit front faces alone. --two-sided adds back faces; --ao-ignore-back-faces leaves them "
    "out "
    "of ambient occlusion.";
constexpr std::string_view kFill = "--gutter inf fills all of the map from the charts.";
constexpr std::string_view kSpace =
    "The flag is --space tangent, object or face. Tangents follow MikkTSpace.";
constexpr std::string_view kMaps = "The flag is --maps, such as --maps normal,ao.";
constexpr std::string_view kAxes =
    "Red is right, green is up, blue is out of the surface. --flip-y turns green down.";
constexpr std::string_view kRayFails =
    "The flag is --fallback closest: nearest points decide what rays miss.";
constexpr std::string_view kNoBias = "Rays of ao start on the surface itself. Leave the bias out.";
constexpr std::string_view kHemisphere =
    "Rays of ao take in the whole hemisphere, and differ from sample to sample. --ao-rays N sets "
    "their number.";
constexpr std::string_view kOwnCage =
    "The flag is --cage-mesh FILE: rays start from LOW with its vertices moved.";
constexpr std::string_view kDepth =
    "--format png8, png16, exr (16 bits) or exr32 sets the bits a channel.";
constexpr std::string_view kAveraged = "The flag is --direction averaged.";
constexpr std::string_view kOwnPart =
    "The flag is --part-occlusion own, with --match-by name: a part is darkened by itself alone.";
constexpr std::string_view kForce =
    "Maps of the same LOW are written over. --force also writes over maps of another LOW.";
constexpr std::string_view kHelp = "The flag is --help.";
constexpr std::string_view kVerbose =
    "The summary says what was done. --json FILE has all figures.";
constexpr std::string_view kVertexColors =
    "Maps are textures. `kiln simplify` keeps vertex colours; --maps vertex_color bakes them.";
constexpr std::string_view kMiss =
    "The flag is --fallback: end its chain with low (was keep), fill or mark, such as "
    "--fallback closest,fill.";

constexpr std::array kBake = {
    // Not there yet.
    Answer{"udim", kTiles},
    Answer{"udims", kTiles},
    Answer{"uv-tile", kTiles},
    Answer{"skew", kSkew},
    Answer{"skew-map", kSkew},
    Answer{"skew-correction", kSkew},
    Answer{"explode", kExplode},
    Answer{"match-by-name", kExplode},
    Answer{"bake-groups", kExplode},
    Answer{"bevel", kBevel},
    Answer{"rounded-edges", kBevel},
    Answer{"denoise", kDenoise},
    Answer{"tile-size", kTile},
    Answer{"bucket-size", kTile},
    // By another name.
    Answer{"miss", kMiss},
    Answer{"extrusion", kCage},
    Answer{"cage-extrusion", kCage},
    Answer{"cage-offset", kCage},
    Answer{"ray-distance", kDistance},
    Answer{"max-ray-distance", kDistance},
    Answer{"frontal-distance", kDistance},
    Answer{"max-frontal-distance", kDistance},
    Answer{"max-rear-distance", kDistance},
    Answer{"margin", kPadding},
    Answer{"padding", kPadding},
    Answer{"dilation", kPadding},
    Answer{"edge-padding", kPadding},
    Answer{"antialiasing", kSamples},
    Answer{"aa", kSamples},
    Answer{"supersampling", kSamples},
    Answer{"subsampling", kSamples},
    Answer{"ao-samples", kRays},
    Answer{"rays", kRays},
    Answer{"secondary-rays", kRays},
    Answer{"max-occluder-distance", kAoDistance},
    Answer{"resolution", kSize},
    Answer{"res", kSize},
    Answer{"width", kSize},
    Answer{"texture-size", kSize},
    Answer{"flip-green", kGreen},
    Answer{"invert-green", kGreen},
    Answer{"directx", kGreen},
    Answer{"opengl", kGreenUp},
    Answer{"output", kOut},
    Answer{"o", kOut},
    Answer{"name", kName},
    Answer{"threads", kThreads},
    Answer{"gpu", kDevice},
    Answer{"cpu", kDevice},
    Answer{"selected-to-active", kMeshes},
    Answer{"use-selected-to-active", kMeshes},
    Answer{"high-poly", kMeshes},
    Answer{"low-poly", kMeshes},
    Answer{"highpoly", kMeshes},
    Answer{"lowpoly", kMeshes},
    Answer{"hp", kMeshes},
    Answer{"lp", kMeshes},
    Answer{"input", kMeshes},
    Answer{"discard-back-faces-hits", kFaces},
    Answer{"ignore-back-faces", kFaces},
    Answer{"back-faces", kFaces},
    Answer{"ignore-backfaces", kFaces},
    Answer{"cull-backfaces", kFaces},
    Answer{"diffusion", kFill},
    Answer{"apply-diffusion", kFill},
    Answer{"infinite-padding", kFill},
    Answer{"background", kFill},
    Answer{"background-color", kFill},
    Answer{"dilation-width", kPadding},
    Answer{"margin-type", kPadding},
    Answer{"pad", kPadding},
    Answer{"normal-space", kSpace},
    Answer{"tangent-space", kSpace},
    Answer{"normal-type", kSpace},
    Answer{"type", kMaps},
    Answer{"bake-type", kMaps},
    Answer{"pass", kMaps},
    Answer{"passes", kMaps},
    Answer{"map", kMaps},
    Answer{"bakers", kMaps},
    Answer{"swizzle", kAxes},
    Answer{"swizzle-coordinates", kAxes},
    Answer{"max-frontal-ray-distance", kDistance},
    Answer{"max-rear-ray-distance", kDistance},
    Answer{"search-distance", kDistance},
    Answer{"max-offset", kCage},
    Answer{"min-offset", kCage},
    Answer{"offset", kCage},
    Answer{"paint-offset", kOwnCage},
    Answer{"use-cage", kOwnCage},
    Answer{"cage-object", kOwnCage},
    Answer{"cage-file", kOwnCage},
    Answer{"paint-skew", kSkew},
    Answer{"closest-hit-if-ray-fails", kRayFails},
    Answer{"ao-bias", kNoBias},
    Answer{"bias", kNoBias},
    Answer{"ao-spread", kHemisphere},
    Answer{"ao-jitter", kHemisphere},
    Answer{"ao-distribution", kHemisphere},
    Answer{"spread-angle", kHemisphere},
    Answer{"bits", kDepth},
    Answer{"bit-depth", kDepth},
    Answer{"depth", kDepth},
    Answer{"color-depth", kDepth},
    Answer{"average-normals", kAveraged},
    Answer{"smooth-normals", kAveraged},
    Answer{"self-occlusion", kOwnPart},
    Answer{"normal-format", kGreen},
    Answer{"normal-orientation", kGreen},
    Answer{"anti-aliasing", kSamples},
    Answer{"multisampling", kSamples},
    Answer{"s", kSize},
    Answer{"overwrite", kForce},
    Answer{"help-all", kHelp},
    Answer{"verbose", kVerbose},
    Answer{"v", kVerbose},
    Answer{"target", kVertexColors},
    Answer{"multilayer", "The flag is --layers: all maps in one EXR."},
    Answer{"ignore-per-vertex-color",
           "Vertex colours are read by --maps vertex_color alone. Leave it out."},
    Answer{"ignore-transforms",
           "Meshes must lie in one place. Apply transforms before you export them."},
    Answer{"falloff", kFalloff},
    Answer{"attenuation", kFalloff},
    Answer{"colour", kColour},
    Answer{"albedo", kColour},
    Answer{"diffuse", kColour},
    Answer{"base-color", kColour},
    Answer{"basecolor", kColour},
    Answer{"vertex-colors", kColour},
    Answer{"texture", kTexture},
    Answer{"textures", kTexture},
    Answer{"roughness", kTexture},
    Answer{"metallic", kTexture},
    Answer{"metalness", kTexture},
    Answer{"specular", kTexture},
    Answer{"emissive", kTexture},
};

/// Of all commands that make a low poly.
constexpr std::string_view kCount =
    "The flag is --faces N: triangles of the low poly. --max-error 0.2% bounds its deviation "
    "instead.";
constexpr std::array kLow = {
    Answer{"ratio", kCount},        Answer{"decimate", kCount},  Answer{"decimation", kCount},
    Answer{"target-faces", kCount}, Answer{"triangles", kCount}, Answer{"tris", kCount},
    Answer{"polycount", kCount},    Answer{"percent", kCount},
};

constexpr std::array kChart = {
    Answer{"json", "The data are written to --out DIR: chart.json, and chart.csv."},
    Answer{"csv", "The data are written to --out DIR: chart.csv, and chart.json."},
};

std::string answer_of(std::span<const Answer> answers, const std::string& name) {
  for (const Answer& answer : answers) {
    if (answer.flag == name) return std::string(answer.sentence);
  }
  return {};
}

/// "--no-flip-y": flags are off unless they are given.
std::string answer_to_negated(const Command& command, const std::string& name) {
  if (!name.starts_with("no-")) return {};
  const std::string flag = name.substr(3);
  const Option* option = command.find_option("--" + flag);
  if (option == nullptr) return {};
  if (!option->is_flag()) {
    return "Leave --" + flag + " out for its default, or give it a value.";
  }
  return "Without --" + flag + " it is off, which is the default: leave --no-" + flag + " out.";
}

/// A map or a match, given as a flag.
std::string answer_to_name(const std::string& name) {
  const auto answer = [&](const char* what, const char* flag, std::string_view ours) {
    return "'" + name + "' is " + what + ": " + flag + " " + std::string(ours) + ".";
  };
  const MapInfo* const map = map_called(name);
  if (map != nullptr) return answer("a map", "--maps", map->kind.name);
  const MatchInfo* const match = match_called(name);
  if (match != nullptr) return answer("a match", "--match", match->method.name);
  return {};
}

std::string nearest_flag(const Command& command, const std::string& name) {
  std::vector<std::string> known = {"help"};
  for (const Option* option : command.get_options()) {
    known.insert(known.end(), option->get_lnames().begin(), option->get_lnames().end());
  }
  const std::string nearest = nearest_word(name, known);
  return nearest.empty() ? "" : "--" + nearest;
}

}  // namespace

std::string answer_to_unknown(const Command& command, const std::string& word) {
  const std::string flag = word.substr(0, word.find('='));
  const std::string name = flag.substr(std::min(flag.find_first_not_of('-'), flag.size()));
  const std::string start = command.get_name() + " has no option '" + flag + "'";
  if (std::string text = answer_to_negated(command, name); !text.empty()) {
    return start + ". " + text;
  }
  if (command.get_name() == "chart") {
    if (std::string text = answer_of(kChart, name); !text.empty()) return start + ". " + text;
  }
  if (command.get_name() == "bake") {
    if (std::string text = answer_of(kBake, name); !text.empty()) return start + ". " + text;
    if (std::string text = answer_to_name(name); !text.empty()) return start + ". " + text;
  }
  if (command.find_option("--faces") != nullptr) {
    if (std::string text = answer_of(kLow, name); !text.empty()) return start + ". " + text;
  }
  const std::string nearest = nearest_flag(command, name);
  return start + (nearest.empty() ? "." : "; did you mean " + nearest + "?");
}

}  // namespace kiln::cli
