// Plans of low polys that share what they simplify.
//
// bake_light() finds the fewest bytes of vertices and texels that reach an error e of rendered normals.
//
// 1. One run of collapses gives meshes of all numbers of faces F, 4% apart (SimplifyLevels): from a high
//    poly of up to 25,000 faces on, else from half of its faces. Where that is too coarse, another begins
//    at the high poly itself, or at 50,000, 100,000 or 200,000 faces. The errors so far say at which.
//    Their normals are fitted, and part at creases of 75 degrees, where charts end, too. So p(F) below is that of
//    a mesh with and without UVs; vertices at creases are counted.
// 2. Pictures from 30 directions compare a few of them with the high poly: p(F) without a map, f(F) with an
//    endless one. Both are nearly straight lines of log F. With a size on screen, a pixel has 3 x 3 rays, and
//    mean normals are compared. The mesh fills its pictures then, since a size on screen is its own.
// 3. One layout tells the sharpness h(s) of many sizes: e(F, s) = f + 1 / (1 / (p - f) + h(s)). Texels blur
//    what the low poly lacks, and no more. It is laid out for half the size that seems right, since that takes less
//    time. The map counts for 1.12 of its h, since its charts are farther apart than need be. Its first mip-map has
//    the layout's size. Smaller ones count for 0.8 of theirs: charts of small maps are farther apart. Beyond the
//    sizes that are known, h follows the slope of the largest two: edges are blurred by a texel's width, smooth
//    detail by its square. The first mesh leaves half of the error to texels.
//    Where another match turns out better on it, it is looked for again.
// 4. For each size, the fewest faces with e(F, s) in bounds; of all sizes, the fewest bytes. A fine mesh is
//    looked at only where the lines of 2 leave room for it: its guessed error is at most 1.3 times the one
//    asked for, its bytes at most 1.5 times the least. A map has two texels a face at least.
// 5. That pair is made and measured, which corrects h. Of maps within 7% of the fewest bytes, the one with the
//    fewest faces comes first: its layout takes the least time. With a third of the faces, 17% more bytes will do.
//    Steps 4 and 5 repeat until nothing 7% lighter is expected: at most 6 maps, up to 10 as long as none is in
//    bounds. Once one is, the search ends where layouts after the first have 3 times its faces: they take most of the
//    time. A try that would exceed that must be expected to be 15% lighter. A mesh has at most 3 times the faces of
//    the finest that was laid out. A map has at most twice the largest size. Errors scatter with the charts. So maps
//    are aimed 2% below the error. Each miss at a size leaves 3% more room, and makes that size dearer. The next
//    mesh for it weighs at least 5% more, after two misses 10%, then 15%. A size that missed by at most 20% is
//    tried so up to twice, whatever the model expects. Its errors are taken to fall with the 0.4th power
//    of the faces.
// 6. One size whose h is known from other faces alone is tried: with 93% of the bytes, where at most 1.2 times
//    the error is expected.
// 7. Where 85% of the bytes are expected to come within 1.05 times the error, that is tried.
// 8. What reaches the error may weigh over 1.3 times what missed it by at most a tenth. Up to two meshes half-way
//    between the two are tried then.
//    Errors without a map do not fall evenly. So at last the finest mesh without one is looked at that would be 7%
//    lighter; where it does, the search goes on.
// 9. Where what was found has folded triangles, triangles without area or new holes, finer meshes without are
//    looked for: up to 8 levels up, at most 1.5 times as heavy.
// 10. Normals tell nothing of what only one of the meshes covers. Where that is over a tenth of what either
//    does, the mesh and coarser ones are left out. The search goes on. Where another share was asked for, levels
//    that are too coarse for it are left out first, by looks.
//
// Pictures of the high poly are taken while it is simplified. The result's deviation is measured while its maps are
// baked.
//
// Tries of visibility and hybrid matches look from 64 directions, not 512: errors differ by less than a
// thousandth. What is chosen is baked from all. Should it miss the error, the search goes on with all. Where a
// mesh without a map is already within the error, no map is tried first. Nor is one, where that would be
// heavier: the first mesh of 3, with the smallest map, than the lightest mesh without. Where no pixel shows both meshes, as of
// parts smaller than a pixel, the error counts as 180 degrees.
//
// Coarse meshes stray farther than bakes search. Where over 0.5% of samples are missed, looks and tries search
// twice as far, up to 16% of the diagonal. A distance or a cage that was asked for stays (far_enough.h).
//
// Vertices are fitted to the high poly, which takes longest. So each mesh is made and laid out once, for maps
// and all levels of `--lod`. Meshes that are only looked at are fitted roughly, and compared at fewer places. A
// mesh that was made tells by how much its f and p differ from the looks around it. All looks are corrected by
// that. What a head start left folded is mended for the chosen mesh alone, which is then tried again. Searches skip
// levels while errors are far below what is asked for. Where no map is in question, a look leaves f to its line. Between levels up to 8 times apart in faces, p and f are read off their lines.
//
// bake_lods() repeats this for half the size on screen, a quarter and so on. With shared UVs, further levels are
// the fewest faces that the first level's map still fits: simplified with its layout kept, found by bisection,
// each measured. tools/bench/README.md has what a brute-force grid finds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include "kiln/light_plan.h"
#include "lowpoly/simplify_levels.h"

namespace kiln {

/// A low poly with UVs.
struct LaidOut {
  Mesh mesh;
  UnwrapReport report;
};

/// Low polys of all numbers of faces, and those that were made: fitting one takes longest.
struct KnownLevels {
  std::shared_ptr<const SimplifyLevels> levels;        ///< Null until they are made
  std::map<std::size_t, Mesh> meshes;                  ///< By level
  std::map<std::size_t, std::array<Mesh, 2>> glances;  ///< Of SimplifyLevels::glance()
  std::map<std::pair<std::size_t, std::uint32_t>, LaidOut> laid_out;  ///< By level and size
};

/// Low polys of one high poly, by the faces of the finest.
using LevelCache = std::map<std::uint32_t, KnownLevels>;

/// bake_light(), its options checked.
/// \param most_faces  of the low poly; 0: any
LightBake plan_light(const Source& source, const Mesh& high, const LightPlanOptions& options,
                     LevelCache& cache, std::uint64_t most_faces = 0);

}  // namespace kiln
