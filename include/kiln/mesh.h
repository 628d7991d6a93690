#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// A corner's tangent: the frame of tangent space is (tangent, sign * cross(normal, tangent), normal). Where
/// it has no direction, or is not finite, the one of MikkTSpace is taken.
struct Tangent {
  Vec3 direction = {};  ///< Along u, of any length above 0
  float sign = 1;       ///< 1 or -1: -1 where the UVs are mirrored
};

/// UVs of a mesh in another set of its file.
struct UvSet {
  std::uint32_t set = 0;       ///< As the file numbers it
  std::vector<Vec2> uvs = {};  ///< One for each of Mesh::uvs: triangles share Mesh::uv_triangles
  bool operator==(const UvSet&) const = default;
};

/// An indexed triangle mesh with optional per-corner ("wedge") UVs and normals.
///
/// Every optional attribute is either empty or complete. Index arrays are parallel to `triangles`.
/// Triangles keep the order of the file (polygons are split in place), and no triangle is ever left
/// out: degenerate ones and ones with a non-finite corner stay, and are skipped where they are
/// used.
///
/// Vertices with exactly equal positions count as one wherever the surface matters (averaged normals,
/// ray directions, charts), whatever their indices: meshes that are split at seams need no welding. Readers
/// weld STL alone, whose corners have no indices.
///
/// A value: copies share nothing. Threads may read one mesh at the same time; nobody may change it while a
/// function of Kiln reads it. No function keeps a reference, but where it says so.
struct Mesh {
  std::string name = {};           ///< Stem of the file, or any name; used in messages.
  std::array<double, 3> origin{};  ///< World position of a vertex = origin + positions[i]. Readers
                                   ///< set it where single precision would lose detail.
  std::vector<Vec3> positions = {};      ///< One per vertex, in the file's units.
  std::vector<Triangle> triangles = {};  ///< Indices into positions.

  std::vector<Vec2> uvs = {};  ///< Pool of texture coordinates, origin at the lower left.
  std::vector<Triangle> uv_triangles = {};  ///< Indices into uvs; empty where there are no UVs.
  std::vector<Vec3> normals =
      {};  ///< Pool of unit normals; zero: none given, computed when needed.
  std::vector<Triangle> normal_triangles =
      {};  ///< Indices into normals; empty: computed when needed.

  /// The low poly's own tangents, three a triangle in the order of its corners; empty: MikkTSpace computes
  /// them (what bakers and renderers share, unless an engine has its own). See Tangent.
  std::vector<Tangent> tangents = {};

  std::vector<std::array<std::uint8_t, 4>> colors = {};  ///< RGBA per vertex, or empty.
  std::vector<std::uint32_t> groups = {};      ///< Per triangle, index into group_names, or empty.
  std::vector<std::string> group_names = {};   ///< Names that `groups` counts from 0.
  std::vector<std::uint32_t> objects = {};     ///< Per triangle, index into object_names, or empty.
  std::vector<std::string> object_names = {};  ///< Names that `objects` counts from 0.
  std::vector<std::uint32_t> materials =
      {};  ///< Per triangle, index into material_names, or empty.
  std::vector<std::string> material_names = {};  ///< Names that `materials` counts from 0.
  std::vector<std::string> material_files = {};  ///< Files of materials, as OBJ names them.
  /// Per triangle, the polygon that it was cut from: numbers from 0 on, each as often as the polygon has
  /// triangles, in order. Empty: every triangle is a polygon. Computed normals weight the polygons' own
  /// corners and normals, as Blender does.
  std::vector<std::uint32_t> polygons = {};
  double metres = 0;  ///< A unit's: 1 where the file or LoadMeshOptions says its unit; 0: unknown
  std::uint32_t uv_set = 0;  ///< Which of its file's sets of UVs it has
  /// Other sets that pictures of its file's materials lie on (glTF). Of a set that does not fit `uvs` nothing is read.
  std::vector<UvSet> other_uvs = {};
};

/// Which triangles are baked where several have the same UVs, on purpose: mirrored halves, repeated parts. UVs
/// that are whole numbers apart are the same. Among several of the same kind, those in the unit square are baked
/// before others, then the first chart. The others share the texels, and are no overlap.
enum class UvCopies {
  plain,     ///< Those whose UVs are not mirrored, where there are any
  mirrored,  ///< Those whose UVs are mirrored, where there are any
  first,     ///< Neither is preferred
};

/// Rules by which a polygon of more than three corners is cut into triangles. A map is right
/// only where the program that shows it cuts the low poly's polygons as the bake did. By `automatic` alone no
/// corner on a straight edge is left out, and larger polygons are cut alike wherever they begin.
enum class Triangulation {
  automatic,  ///< Quads along corners 0 and 2, unless that alone gives a needle or folds; else constrained Delaunay
  blender,  ///< As Blender 5 draws: quads along corners 0 and 2, but where that folds; else its ear clipping
  fan,       ///< The fan around the first corner, whatever the shape, as most engines' importers do
  shortest,  ///< Quads along the shorter diagonal; more corners: ears, the shortest cut first
};

/// Which way is up in a file. It is turned so that Y is: Z up becomes (x, z, -y).
enum class UpAxis { as_given, x, y, z, minus_x, minus_y, minus_z };

/// Settings of load_mesh().
struct LoadMeshOptions {
  Triangulation triangulation = Triangulation::automatic;  ///< Rule for polygons
  std::uint32_t uv_set = 0;      ///< Which of several sets of UVs becomes Mesh::uvs
  std::string uv_set_name = {};  ///< The set's name instead, where the format has names (FBX)
  /// Upward axis of files that do not say it themselves (PLY, OBJ, STL, OFF).
  UpAxis up = UpAxis::as_given;
  /// A unit of files that do not say it themselves (those, 3DS and X), which are scaled to metres; 0: as given.
  double metres = 0;
  bool override_up = false;    ///< True: `up` holds for files that say otherwise, too
  bool override_unit = false;  ///< True: `metres`, too
  /// True: pictures of FBX and the like, and files of glTF, may lie outside the folder of the file
  bool outside = false;
};

/// Reads a mesh: PLY (ascii, binary of either byte order; faces or triangle strips), OBJ, STL (ascii, binary), OFF (ascii)
/// or glTF 2.0 (.glb, .gltf, .vrm; see load_asset()), chosen by extension in any case; where they were built in
/// (mesh_formats()), FBX by ufbx, and DAE (Collada), 3DS and X by Assimp.
///
/// Every node of a glTF, FBX, DAE, 3DS or X file is an object in world space: names that stand twice get ".001". Skins of
/// glTF are taken in the pose at rest ("rest-pose"), meshes of FBX and DAE with bones as these stand by the nodes' own
/// values; animations are left out. Files that say their axes and unit (glTF, FBX, DAE) are brought to metres with
/// Y up; 3DS and X to Y up; others are as given, but for LoadMeshOptions::up and metres. Of what Assimp reads a forked
/// child of the process tries each file first, within limits of time and memory: a crash there is an Error(input).
///
/// Polygons become triangles as Triangulation::automatic has it. In PLY's strips -1 ends a strip, and
/// a triangle with a repeated corner, which only turns it, is none. PLY gives UVs per vertex (s t, u
/// v, tu tv, s0 t0, texture_u texture_v...) or per corner (a face list "texcoord"), which goes first, OBJ per corner. Index
/// 0 of a UV or normal in OBJ is none. OFF has
/// any of the letters ST, C, N, 4 and n. Colours of OBJ (r g b, r g b a, or ZBrush's #MRGB lines), of PLY's
/// floats and of OFF are bytes where any of the file is above 1 (1.001, for rounding), else fractions. Colours of faces
/// (PLY, OFF, the 15 bits of STL as VisCAM, SolidView or Magics write them) become those of vertices: one between faces of
/// several colours is there once for each. Where vertices have colours that vary, those count, and so does one colour of
/// all vertices that is not white, where faces have one, too. A PLY's pictures (lines "comment TextureFile NAME") are its materials, one a picture, by the faces' `texnumber`.
/// Names in OBJ may hold '#'. OBJ, PLY and OFF may be UTF-16 with a byte-order mark. STL corners
/// with exactly equal positions become one vertex. Positions are read in double precision. A mesh
/// farther from the world's origin than 16 of its diagonals gets an `origin` of its own; its box is that of
/// triangles with area. PLY's vertices may give tangents, `tx ty tz` or `tangent_x`..., and their sign `tw` (without it, the
/// UVs say it): Mesh::tangents, where there are UVs. Clear them for those of MikkTSpace. Normals
/// are made unit. OBJ's groups are its `g` and `o` names, whichever came last; its objects are its
/// `o` names alone, its materials those of `usemtl`, described in the files of `mtllib`. Triangles
/// before the first such name have one of their own, "default".
///
/// Imperfect data is handled and reported by these warnings:
///   non-finite-vertices   kept
///   non-finite-uvs        kept
///   degenerate-triangles  no area, exactly (repeated corners included): kept
///   rounded-triangles     area in the file, but none in single precision: kept
///   coarse-coordinates    stored or rounded in steps that show beside the edges, with the place and the remedy
///   short-faces           fewer than three corners: left out, since they are not triangles
///   fan-split-polygons    polygons that cross themselves or have no area, or too costly: cut all the same
///   missing-uvs           corners without UV where others have one: NaN, nothing is baked there
///   missing-normals       corners without normal where others have one: normal zero
///   missing-colors        vertices without colour where others have one: white
///   color-scale           colours above 1 that are nearly black as bytes: they may be brighter than white
///   face-colors-left-out  faces have colours, but the vertices' own were taken
///   color-indices         OFF: colours of faces by a number in a list that the file has not: none
///   stl-colors            STL: all triangles are marked as without a colour, and have one: the header's was taken
///   zero-indices          OBJ: index 0 of a UV or a normal: none there
///   texture-numbers       PLY: a `texnumber` of no picture (vertex colours, if any), or pictures without one (the first)
///   texture-without-uvs   PLY: pictures, but no UVs: not read
///   bad-texcoords         PLY: not two numbers a corner: the vertices' UVs, or none
///   bad-polypaint         colours of #MRGB lines that are none, or of no vertex: ignored
///   unused-properties     PLY: a second set of UVs, or a part of a set: ignored
///   ignored-header-lines  PLY: lines of the header that are none of PLY's
///   bad-tangents          NaN, infinite, zero or along the normal: MikkTSpace's are taken there
///   long-tangents         not of length 1: they are made so where they are used
///   tangent-signs         neither 1 nor -1: below 0 counts as -1
///   ignored-statements    OBJ statements that Kiln has no use for (lines, points, curves)
///   trailing-bytes        after the last triangle of a binary STL: ignored
///
/// \param path      the file
/// \param warnings  where to append what was imperfect but handled; may be null
/// \throws Error(input) names the file, the place (line, byte or element) and the remedy: no file;
///         no known format, or another one than the name says; truncated; an index out of range; no
///         faces; no finite vertex; no triangle with area; coordinates beyond float's range; a set of UVs
///         that is not there, but the first.
/// Thread safety: may be called from several threads. Memory and time are linear in the file's
/// size; about 0.2 s for a binary PLY or an OBJ of a million triangles on one core.
Mesh load_mesh(const std::filesystem::path& path, std::vector<Warning>* warnings = nullptr);

/// The same with choices. Lists, errors, threads and cost as above.
Mesh load_mesh(const std::filesystem::path& path, const LoadMeshOptions& options,
               std::vector<Warning>* warnings = nullptr);

/// The kinds of meshes that this build reads, such as "PLY".
std::vector<std::string> mesh_formats();

/// Reads a mesh from memory. Otherwise as above.
/// \param bytes  of a whole file; not kept
/// \param name   as its file would be called, such as "head.ply": the extension says the format, the stem
///               becomes Mesh::name, and messages have it
Mesh load_mesh(std::span<const std::byte> bytes, std::string_view name,
               std::vector<Warning>* warnings = nullptr);

/// Joins meshes into one, in their order: the parts of one scene that lie in files of their own. Positions keep
/// their places in the world; the result has the first one's origin.
///
/// Names of groups, objects and materials stay, and those of the same name are one. What one mesh has and
/// another lacks: UVs are NaN (nothing is baked there), normals zero (computed), colours white, tangents
/// without direction (MikkTSpace's), materials "default". A mesh without groups or objects is one of its own
/// name. The result's name is theirs with " + " between, of more than three the first and a count.
/// Warnings: missing-uvs, missing-colors, as load_mesh(); they name the mesh.
/// Memory and time are linear in the meshes. Thread safety: may be called from several threads.
/// \param meshes    at least one; of one, the result is a copy with names
/// \param warnings  where to append; may be null
/// \throws Error(usage) for none; Error(input) for a mesh that does not hold together, see validate(), or for
///         more than 2^31 - 1 of anything
Mesh join_meshes(std::span<const Mesh> meshes, std::vector<Warning>* warnings = nullptr);

/// Triangles that agree_windings() turned round.
struct TurnedTriangles {
  std::uint64_t count = 0;  ///< Triangles
  std::uint32_t first = 0;  ///< The lowest of them, where there are any
};

/// Turns triangles round that face against those beside them, so that each part faces one way. A part is what edges of
/// two triangles connect, by exactly equal positions. Of a part that disagrees, what has less area is turned. Where
/// both have two fifths of it, a closed part faces outwards. A part with one side alone (a Möbius strip) stays as it
/// is, and so does one that agrees, whichever way it faces. The triangles' own normals are turned with them, where
/// they faced as the triangles did.
/// Time: 0.02 s for a million triangles that agree. Thread safety: may be called from several threads, for other meshes.
/// \param mesh  changed: the order of corners, and normals added to the pool
/// \throws Error(input) for a mesh that does not hold together, see validate()
TurnedTriangles agree_windings(Mesh& mesh);

/// Writes a Wavefront OBJ: positions, colours without alpha, UVs, normals, groups, objects, names of
/// materials. It has 9 significant digits, so that reading it back gives the same floats; 17 digits
/// for the positions of a mesh with an origin. `material_files` are named as they are, and not
/// written. The file appears whole or not at all. About 0.4 s for a million triangles. Tangents are
/// not written. Thread safety: may be called from several threads, for files of different names.
/// \throws Error(usage) for a mesh with an index out of range or an incomplete attribute, before
///         anything is written
/// \throws Error(output)
void save_obj(const Mesh& mesh, const std::filesystem::path& path);

}  // namespace kiln
