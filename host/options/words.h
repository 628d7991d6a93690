// Names of enumerators on the command line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/job.h"
#include "kiln/match.h"
#include "kiln/texture_sets.h"
#include "kiln/unwrap.h"
#include "options/values.h"

namespace kiln {

/// A word, and the enumerator that it stands for.
template <typename T>
struct Word {
  const char* word;
  T value;
};

/// The words that an option accepts, in alphabetical order as in help. It refers to the words and does not own them.
template <typename T>
class Words {
 public:
  template <std::size_t N>
  Words(const Word<T> (&rows)[N]) : begin_(rows), end_(rows + N) {}

  const Word<T>* begin() const { return begin_; }
  const Word<T>* end() const { return end_; }

  /// The enumerator that a word stands for; nullptr if the option does not accept the word.
  const T* find(std::string_view word) const {
    for (const Word<T>& row : *this) {
      if (row.word == word) return &row.value;
    }
    return nullptr;
  }
  bool contains(std::string_view word) const { return find(word) != nullptr; }
  /// The enumerator of a word that one_of() has accepted.
  T at(std::string_view word) const {
    const T* const value = find(word);
    if (value == nullptr)
      throw Error(ErrorCode::internal,
                  "The option's value '" + std::string(word) + "' was not checked before use.");
    return *value;
  }

 private:
  const Word<T>*begin_, *end_;
};

template <typename T>
std::vector<std::string> names_of(const Words<T>& words) {
  std::vector<std::string> names;
  for (const auto& [word, value] : words) names.emplace_back(word);
  return names;
}

template <typename T>
Check one_of(const Words<T>& words) {
  return one_of(names_of(words));
}

/// The word on the command line that stands for an enumerator.
template <typename T>
std::string name_of(const Words<T>& words, T wanted) {
  for (const auto& [word, value] : words) {
    if (value == wanted) return word;
  }
  throw Error(ErrorCode::internal, "An enumerator of an option has no word in options/words.h.");
}

inline constexpr Word<NormalMapSpace> kSpaceWords[] = {{"face", NormalMapSpace::face},
                                                       {"object", NormalMapSpace::object},
                                                       {"tangent", NormalMapSpace::tangent}};
inline constexpr Word<Bitangent> kBitangentWords[] = {{"pixel", Bitangent::pixel},
                                                      {"vertex", Bitangent::vertex}};
inline constexpr Word<Triangulation> kTriangulationWords[] = {
    {"auto", Triangulation::automatic},
    {"blender", Triangulation::blender},
    {"fan", Triangulation::fan},
    {"shortest", Triangulation::shortest}};
inline constexpr Word<RayTraversal> kTraversalWords[] = {
    {"auto", RayTraversal::automatic}, {"cpu", RayTraversal::cpu}, {"gpu", RayTraversal::gpu}};
inline constexpr Word<RayRule> kRayRuleWords[] = {{"nearest", RayRule::nearest},
                                                  {"outermost", RayRule::outermost}};
inline constexpr Word<OcclusionBy> kOcclusionByWords[] = {
    {"auto", OcclusionBy::automatic}, {"rays", OcclusionBy::rays}, {"views", OcclusionBy::views}};
inline constexpr Word<OcclusionFalloff> kFalloffWords[] = {{"linear", OcclusionFalloff::linear},
                                                           {"none", OcclusionFalloff::none},
                                                           {"smooth", OcclusionFalloff::smooth}};
inline constexpr Word<RayDirection> kRayDirectionWords[] = {{"auto", RayDirection::automatic},
                                                            {"averaged", RayDirection::averaged},
                                                            {"face", RayDirection::face},
                                                            {"painted", RayDirection::painted}};
inline constexpr Word<VisibilityAt> kVisibilityAtWords[] = {
    {"face", VisibilityAt::face}, {"texel", VisibilityAt::texel}, {"vertex", VisibilityAt::vertex}};
inline constexpr Word<VisibilityTest> kVisibilityTestWords[] = {{"auto", VisibilityTest::automatic},
                                                                {"rays", VisibilityTest::rays},
                                                                {"views", VisibilityTest::views}};
inline constexpr Word<ViewLikelihood> kLikelihoodWords[] = {
    {"all", ViewLikelihood::all}, {"horizon", ViewLikelihood::horizon}, {"up", ViewLikelihood::up}};
inline constexpr Word<ViewCriterion> kCriterionWords[] = {{"angle", ViewCriterion::angle},
                                                          {"depth", ViewCriterion::depth},
                                                          {"distance", ViewCriterion::distance}};
inline constexpr Word<ImageFormat> kFormatWords[] = {
    {"dds", ImageFormat::dds},           {"exr", ImageFormat::exr_half},
    {"exr32", ImageFormat::exr_float},   {"ktx2", ImageFormat::ktx2},
    {"png16", ImageFormat::png16},       {"png8", ImageFormat::png8},
    {"tga", ImageFormat::tga},           {"tiff16", ImageFormat::tiff16},
    {"tiff32", ImageFormat::tiff_float}, {"tiff8", ImageFormat::tiff8},
    {"webp", ImageFormat::webp}};
inline constexpr Word<Dither> kDitherWords[] = {
    {"auto", Dither::automatic}, {"off", Dither::off}, {"on", Dither::on}};
inline constexpr Word<MeshCompression> kMeshCompressionWords[] = {
    {"draco", MeshCompression::draco},
    {"meshopt", MeshCompression::meshopt},
    {"none", MeshCompression::none}};
/// Words for ways to fill missed texels. One of them may be the last entry of --fallback.
inline constexpr Word<MissPolicy> kMissWords[] = {
    {"fill", MissPolicy::fill}, {"low", MissPolicy::keep}, {"mark", MissPolicy::mark}};
inline constexpr Word<IdBy> kIdSourceWords[] = {{"color", IdBy::color},
                                                {"group", IdBy::group},
                                                {"material", IdBy::material},
                                                {"object", IdBy::object},
                                                {"part", IdBy::part}};
inline constexpr Word<NormalTextureFormat> kNormalTextureFormatWords[] = {
    {"auto", NormalTextureFormat::automatic},
    {"dx", NormalTextureFormat::directx},
    {"gl", NormalTextureFormat::opengl},
    {"two-channel", NormalTextureFormat::two_channel},
    {"two-channel-dx", NormalTextureFormat::two_channel_directx}};
inline constexpr Word<std::optional<PartsBy>> kPartsByChoices[] = {
    {"all", std::nullopt},       {"name", PartsBy::name},         {"group", PartsBy::group},
    {"object", PartsBy::object}, {"material", PartsBy::material}, {"list", PartsBy::list}};
inline constexpr Word<std::optional<SetsBy>> kSetsWords[] = {
    {"auto", std::nullopt},     {"material", SetsBy::material}, {"none", SetsBy::none},
    {"object", SetsBy::object}, {"one", SetsBy::none},          {"udim", SetsBy::udim}};
inline constexpr Word<UvCopies> kUvCopiesWords[] = {
    {"first", UvCopies::first}, {"mirrored", UvCopies::mirrored}, {"plain", UvCopies::plain}};
inline constexpr Word<TexelDensity> kDensityWords[] = {{"area", TexelDensity::area},
                                                       {"detail", TexelDensity::detail}};
inline constexpr Word<CleanHigh> kCleanHighWords[] = {
    {"all", CleanHigh::all}, {"auto", CleanHigh::automatic}, {"none", CleanHigh::none}};
inline constexpr Word<bool> kLodUvsWords[] = {{"own", false}, {"shared", true}};
inline constexpr Word<bool> kLodFilesWords[] = {{"each", false}, {"one", true}};
inline constexpr Word<bool> kPartOcclusionWords[] = {{"all", false}, {"own", true}};
inline constexpr Word<std::optional<AlphaMode>> kAlphaWords[] = {
    {"auto", std::nullopt}, {"blend", AlphaMode::blend}, {"mask", AlphaMode::mask}};
inline constexpr Word<std::optional<bool>> kSidesWords[] = {
    {"auto", std::nullopt}, {"no", false}, {"yes", true}};
inline constexpr Word<bool> kTangentWords[] = {{"file", true}, {"mikktspace", false}};

}  // namespace kiln
