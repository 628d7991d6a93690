#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/lowpoly.h"
#include "kiln/maybe.h"
#include "kiln/mesh.h"
#include "kiln/source.h"

namespace KILN_PUBLIC kiln {

/// Maps that are planned have so many texels a side at least.
inline constexpr std::uint32_t kSmallestMap = 16;

/// What a low poly and its maps come to in a renderer's memory.
///
/// A vertex takes 24 bytes: position 12, normal 4, tangent 4, UV 4; without a map 16. A vertex at a
/// seam counts once a side. An index takes 2 bytes, 4 beyond 65,536 vertices. Maps have mip-maps,
/// which add a third. A texel takes 1 byte in blocks of 8 bits a channel (BC5, BC7), with one
/// channel half a byte (BC4). With 16 bits it takes 2 bytes a channel.
struct LightBytes {
  std::uint64_t vertices = 0;  ///< Bytes of vertices and indices
  std::uint64_t texels = 0;    ///< Bytes of all maps
  /// Bytes of both.
  std::uint64_t total() const { return vertices + texels; }
};

struct LightBake;

/// The error to reach, how large the mesh will be seen, and what to bake.
struct LightPlanOptions {
  /// The mean angle, degrees, between rendered normals of the low poly with its map and those of the high
  /// poly. Above 0.
  double max_error = 0;
  /// Of other maps that are baked, each once. A map that is too small for one of them is left out of the choice.
  std::vector<MapBound> bounds = {};
  /// For a bound of the map ao without OcclusionOptions::max_error: half of it is left to the rays.
  bool choose_rays = true;
  /// Pixels that the mesh covers, the longer of width and height, at the largest size at which it is seen. 16 to
  /// 16384. It is as large from all sides. Then what is finer than a pixel does not count: mean normals of pixels are
  /// compared. 0: endlessly many pixels.
  std::uint32_t screen = 0;
  /// How far outlines may differ: the share of what either mesh covers in pictures that one of them covers alone, above
  /// 0 and below 1. 0: nothing is asked for; then meshes that differ by over a tenth give way where finer ones are not far.
  double max_outline = 0;
  /// Choose how to match; else BakeOptions::method does.
  bool choose_match = true;
  /// The low poly's own normals may do, without a map.
  bool may_leave_map_out = true;
  /// Choose BakeOptions::samples; else they stay.
  bool choose_samples = true;
  /// Bits a channel that maps are saved with: 8 or 16; 0: choose.
  std::uint32_t bits = 0;
  /// What to bake. Without a max_distance or cage, it grows up to 16% of the diagonal where samples are missed.
  /// Its size is the largest that maps may have; they are square, kSmallestMap texels a side at least. With
  /// the map MapKind::normal. No cage mesh, no parts, no saved match.
  BakeOptions bake = {};
  UnwrapMethod unwrap = UnwrapMethod::charts;  ///< How the low poly is laid out
  TexelDensity density = TexelDensity::area;   ///< Where the texels of large charts go
  /// The high poly is a height_field_mesh(). Low polys keep its border (SimplifyOptions::height_field) and its
  /// layout, and MatchMethod::uv is tried first.
  bool height_field = false;
  /// Called on the caller's thread as soon as the choice is measured, so that it can be shown meanwhile.
  /// LightBake::chosen, trials, trade, outlook, levels and wanted stand then. Called again where that missed the error
  /// and the search went on. May be null.
  std::function<void(const LightBake&)> on_measured = {};
};

/// A low poly with a map of a size: expected, or made and measured.
struct LightTrial {
  std::uint64_t faces = 0;      ///< Triangles
  std::uint64_t positions = 0;  ///< Vertices before seams split them
  std::uint64_t vertices = 0;   ///< Vertices after that; expected where nothing was made
  std::uint64_t charts = 0;     ///< Of its layout; 0 where nothing was laid out
  std::uint32_t size = 0;       ///< Texels a side; 0: no map
  /// Texels a side that its charts are laid out for: `size`, or half of it, where they are farther apart than need be.
  std::uint32_t laid_out_for = 0;
  std::uint32_t samples = 1;              ///< BakeOptions::samples
  std::uint32_t bits = 8;                 ///< A channel
  MatchMethod method = MatchMethod::ray;  ///< How points of the high poly are found
  LightBytes bytes;                       ///< In memory
  double expected = 0;                    ///< Mean angle, degrees, by the model
  double measured = -1;       ///< Mean angle, degrees, of the map itself; below 0: not made
  double one_sided = 0;       ///< NormalError::one_sided_share of the same pictures: outlines
  double standard_error = 0;  ///< Of `measured`: NormalError::standard_error_degrees
};

/// What a number of faces can do.
struct LightLevel {
  std::uint64_t faces = 0;      ///< Triangles
  std::uint64_t positions = 0;  ///< Vertices
  double without_map = 0;       ///< Mean angle of its own normals, degrees
  double limit = 0;             ///< With a map of endless size, degrees
};

/// The lightest mesh and maps that reach an error, and what they were chosen from.
struct LightBake {
  Mesh low;                       ///< With UVs where there is a map
  SimplifyReport simplified;      ///< How the mesh was made
  Maybe<UnwrapReport> unwrapped;  ///< None without a map
  Maybe<BakeResult> result;       ///< The maps; none where no map is needed
  BakeOptions bake;               ///< That `result` is baked with
  Image drawn;  ///< The normal map as renderers read it: n/2 + 1/2, rounded to `chosen`'s bits
  LightTrial chosen;                ///< What `low` and `result` are
  std::vector<LightTrial> trials;   ///< That were made and measured, in order
  std::vector<LightTrial> trade;    ///< By rising size: the fewest faces expected to do with each
  std::vector<LightTrial> outlook;  ///< Expected, of `levels` with each size
  std::vector<LightLevel> levels;   ///< That were looked at, by rising faces
  double wanted = 0;                ///< LightPlanOptions::max_error
  double max_outline = 0;           ///< LightPlanOptions::max_outline
  /// `chosen` was measured within `wanted` and, where that was asked for, `max_outline`; and each of `bounds` within its
  /// own.
  bool reached = false;
  std::vector<MapReached> bounds;  ///< Of LightPlanOptions::bounds, what `result` reaches
  bool cancelled = false;          ///< By BakeOptions::progress
  double seconds_simplify = 0;     ///< Making low polys
  double seconds_unwrap = 0;       ///< Laying them out
  double seconds_measure = 0;      ///< Looking at them and at maps
};

/// Bytes of a low poly with square maps. This and split_vertices(): any thread, nothing is kept.
/// \param vertices  after splitting at seams
/// \param size      texels a side; 0: no maps
/// \param channels  of each map
LightBytes light_bytes(std::uint64_t vertices, std::uint64_t faces, std::uint32_t size,
                       const std::vector<std::uint32_t>& channels, std::uint32_t bits);

/// Vertices of a mesh as a renderer holds them: a position has one for every pair of UV and normal that its corners
/// have, by index.
std::uint64_t split_vertices(const Mesh& mesh);

/// Chooses faces, map size, samples, match and bits together: the fewest bytes that reach an error.
///
/// One run of simplify() gives low polys of all numbers of faces. Of a few, pictures from kPlanViews directions
/// are compared with the high poly's: p, the error of the mesh's own normals, and f, that of a map of endless
/// size. A map of s texels a side then has the error e = f + 1 / (1 / (p - f) + h(s)). One layout, baked at two
/// sizes, and mip-maps tell h for several sizes. For each size follow the fewest faces that are expected to do, and their bytes.
/// The pair with the fewest is made and measured, which corrects h; that repeats until nothing better is expected,
/// at most five times, or nine as long as none does. What is returned is always measured on the very map.
/// Meshes with flaws give way to finer ones, as do those whose outlines differ by over a tenth
/// (LightTrial::one_sided).
/// Lifetimes, threads, tangents and welding as bake() and simplify(): nothing is kept, and several threads may
/// plan from one Source. BakeOptions::progress comes on the caller's thread, ten times a second. Where it says
/// stop, LightBake::cancelled is set.
/// \param high  the mesh that `source` was made of
/// \throws as simplify(), unwrap() and bake(); Error(usage) for options out of range
/// Deterministic: the same on every run and number of threads.
LightBake bake_light(const Source& source, const Mesh& high, const LightPlanOptions& options);

/// Pictures of a high poly at a size on screen, compared with low polys as LightPlanOptions::screen does: mean
/// normals of pixels. They come from directions that plans do not look from.
/// Thread safety: one thread at a time.
class ScreenPictures {
 public:
  /// \param source  must outlive this
  /// \param screen  pixels that the high poly covers, the longer of width and height, 16 to 16384
  /// \param views   directions, 1 or more
  /// \throws Error(usage) for numbers out of range
  ScreenPictures(const Source& source, std::uint32_t screen, std::size_t views = 30);
  ~ScreenPictures();
  ScreenPictures(const ScreenPictures&) = delete;
  ScreenPictures& operator=(const ScreenPictures&) = delete;

  /// The mean angle of a low poly's own normals, degrees.
  double degrees(const Mesh& low) const;
  /// With a normal map, n/2 + 1/2. \param baked  how it was made
  double degrees(const Mesh& low, const Image& map, const BakeOptions& baked) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
