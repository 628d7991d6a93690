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

/// The tangent at a corner. The frame of tangent space there is (tangent, sign * cross(normal,
/// tangent), normal). Tangents that have no direction, or are not finite, are replaced by those of
/// MikkTSpace.
struct Tangent {
  Vec3 direction = {};  ///< Direction in which u increases, of any length above 0
  float sign = 1;       ///< Sign of the bitangent: 1, or -1 where the UVs are mirrored
};

/// UVs of a mesh in another UV set of its file.
struct UvSet {
  std::uint32_t set = 0;       ///< Index of the UV set in the file
  std::vector<Vec2> uvs = {};  ///< One UV per entry of Mesh::uvs; Mesh::uv_triangles indexes both
  bool operator==(const UvSet&) const = default;
};

/// An indexed triangle mesh with optional per-corner ("wedge") UVs and normals.
///
/// Every optional attribute is either empty or complete. Index arrays are parallel to `triangles`.
/// Triangles keep the order of the file (polygons are split in place), and readers drop none: degenerate
/// ones and ones with a non-finite corner are kept, and skipped where triangles are used.
///
/// Vertices with exactly equal positions count as one wherever the surface matters (averaged normals, ray
/// directions, charts), whatever their indices: meshes that are split at seams need no welding. Readers
/// weld only STL, whose corners have no indices.
///
/// A value type: copies share nothing. Threads may read one mesh at the same time; nobody may change it
/// while a function of Kiln reads it. No function keeps a reference, unless its documentation says so.
struct Mesh {
  std::string name = {};  ///< Stem of the file, or any name; used in messages.
  /// World position of a vertex = origin + positions[i]. Readers set it where single precision would lose
  /// detail.
  std::array<double, 3> origin{};
  std::vector<Vec3> positions = {};      ///< One per vertex, in the file's units.
  std::vector<Triangle> triangles = {};  ///< Indices into positions.

  std::vector<Vec2> uvs = {};  ///< Pool of texture coordinates, origin at the lower left.
  std::vector<Triangle> uv_triangles = {};  ///< Indices into `uvs`; empty if there are no UVs.
  std::vector<Vec3> normals = {};  ///< Pool of unit normals; zero: not given, computed when needed.
  std::vector<Triangle> normal_triangles =
      {};  ///< Indices into normals; empty: computed when needed.

  /// The low poly's own tangents, three a triangle in the order of its corners; empty: MikkTSpace computes
  /// them (the convention of bakers and renderers, unless an engine has its own). See Tangent.
  std::vector<Tangent> tangents = {};

  /// RGBA colour per vertex, sRGB-encoded; or empty.
  std::vector<std::array<std::uint8_t, 4>> colors = {};
  std::vector<std::uint32_t> groups = {};      ///< Per triangle, index into group_names, or empty.
  std::vector<std::string> group_names = {};   ///< Names, indexed by `groups`.
  std::vector<std::uint32_t> objects = {};     ///< Per triangle, index into object_names, or empty.
  std::vector<std::string> object_names = {};  ///< Names, indexed by `objects`.
  std::vector<std::uint32_t> materials =
      {};  ///< Per triangle, index into material_names, or empty.
  std::vector<std::string> material_names = {};  ///< Names, indexed by `materials`.
  std::vector<std::string> material_files = {};  ///< Material files, as named in an OBJ.
  /// Per triangle, the polygon that it was cut from: numbered from 0 in order, each repeated for all of
  /// the polygon's triangles. Empty: every triangle is a polygon. Computed normals are weighted by the
  /// polygons' own corners and normals, as in Blender.
  std::vector<std::uint32_t> polygons = {};
  /// Metres per unit of positions: 1 if the file or LoadMeshOptions states the unit; 0: unknown
  double metres = 0;
  std::uint32_t uv_set = 0;  ///< Index in the file of the UV set that `uvs` holds
  /// Other UV sets, used by pictures of the file's materials (glTF). Sets whose size does not match `uvs` are ignored.
  std::vector<UvSet> other_uvs = {};
};

/// Which triangles are baked if several intentionally have the same UVs: mirrored halves, repeated parts. UVs
/// that differ by whole numbers count as the same. Among triangles of the preferred kind, those in the unit
/// square take precedence, then those of the first chart. All others share their texels, are not baked, and
/// do not count as overlap.
enum class UvCopies {
  plain,     ///< Prefer triangles whose UVs are not mirrored
  mirrored,  ///< Prefer triangles whose UVs are mirrored
  first,     ///< Prefer neither kind
};

/// Rules by which a polygon of more than three corners is cut into triangles. A map is correct only if the
/// renderer triangulates the low poly's polygons as the bake did. Only `automatic` uses corners on straight
/// edges, and cuts larger polygons independently of their first corner.
enum class Triangulation {
  /// Quads between corners 0 and 2, unless only that diagonal gives a needle or a fold; polygons with more
  /// corners by constrained Delaunay triangulation
  automatic,
  /// As Blender 5 does: quads between corners 0 and 2, unless that folds the quad; other polygons
  /// by Blender's ear clipping
  blender,
  /// As a fan around the first corner, regardless of the polygon's shape, as importers of most
  /// engines do
  fan,
  /// Quads along the shorter diagonal; polygons with more corners by ear clipping, shortest cut
  /// first
  shortest,
};

/// Up axis of a file. The mesh is rotated so that Y is up: Z up becomes (x, z, -y).
enum class UpAxis { as_given, x, y, z, minus_x, minus_y, minus_z };

/// Settings of load_mesh().
struct LoadMeshOptions {
  Triangulation triangulation = Triangulation::automatic;  ///< Rule for polygons
  std::uint32_t uv_set = 0;  ///< UV set of files with several that becomes Mesh::uvs
  /// Name of the UV set instead of its number, in formats with names (FBX)
  std::string uv_set_name = {};
  /// Up axis of files that do not state it (PLY, OBJ, STL, OFF).
  UpAxis up = UpAxis::as_given;
  /// Metres per unit, for files that do not state their unit; positions are scaled to metres. 0:
  /// positions are not scaled.
  double metres = 0;
  bool override_up = false;    ///< True: `up` replaces the axis that a file states
  bool override_unit = false;  ///< True: `metres` replaces the unit that a file states
  /// Allow FBX, glTF and similar files to refer to files outside of their own folder
  bool outside = false;
};

/// Reads a mesh: PLY (ascii, binary of either byte order; faces or triangle strips), OBJ, STL (ascii, binary), OFF
/// (ascii) or glTF 2.0 (.glb, .gltf, .vrm; see load_asset()), chosen by extension in any case; in builds with them
/// (mesh_formats()), FBX by ufbx, and DAE (Collada), 3DS and X by Assimp.
///
/// Every node of a glTF, FBX, DAE, 3DS or X file is an object in world space: repeated names get suffixes such as
/// ".001". Skins of glTF are read in their rest pose ("rest-pose"), skins of FBX and DAE in the pose of their nodes;
/// animations are ignored. Files that state their axes and unit (glTF, FBX, DAE) are converted to metres with Y up; 3DS
/// and X to Y up; others are unchanged, except by LoadMeshOptions::up and metres. A forked child process tries each of
/// Assimp's files first, within limits of time and memory: a crash there is an Error(input).
///
/// Polygons are cut by Triangulation::automatic. In PLY's triangle strips -1 ends a strip, and triangles with a
/// repeated corner, which only change its direction, are skipped. PLY gives UVs per vertex (s t, u v, tu tv, s0 t0,
/// texture_u texture_v...) or per corner (a face list "texcoord"), which takes precedence, OBJ per corner. Index 0 of a
/// UV or normal in OBJ means none. OFF may have any of the letters ST, C, N, 4 and n. Colours of OBJ (r g b, r g b a,
/// or ZBrush's #MRGB lines), of PLY's floats and of OFF are bytes if any value of the file is above 1 (1.001, for
/// rounding), else fractions. Colours of faces (PLY, OFF, the 15 bits of STL as VisCAM, SolidView or Magics write them)
/// become those of vertices; a vertex between faces of several colours is duplicated for each. If both vertices and
/// faces have colours, those of vertices are used, unless all of them are white. A PLY's pictures (lines "comment
/// TextureFile NAME") are its materials, one a picture, by the faces' `texnumber`. Names in OBJ may hold '#'. OBJ, PLY
/// and OFF may be UTF-16 with a byte-order mark. STL corners with exactly equal positions become one vertex. Positions
/// are read in double precision. A mesh farther from the world's origin than 16 of its diagonals gets an `origin`; its
/// box is that of triangles with area. PLY's vertices may give tangents, `tx ty tz` or `tangent_x`..., and their sign
/// `tw` (without it, the sign follows from the UVs): Mesh::tangents, if there are UVs. Clear them for those of
/// MikkTSpace. Normals are normalised. OBJ's groups are its `g` and `o` names, whichever came last; its objects are its
/// `o` names alone, its materials those of `usemtl`, described in the files of `mtllib`. Triangles before the first
/// such name belong to "default".
///
/// Imperfect data is handled and reported by these warnings:
///   non-finite-vertices   kept
///   non-finite-uvs        kept
///   degenerate-triangles  no area, exactly (repeated corners included): kept
///   rounded-triangles     area in the file, but none in single precision: kept
///   coarse-coordinates    stored or rounded in steps that are visible beside the edges, with the place and the remedy
///   short-faces           fewer than three corners: dropped, since they are not triangles
///   fan-split-polygons    self-intersecting polygons, without area, or too costly: cut as a fan
///   missing-uvs           corners without UV where others have one: NaN, nothing is baked there
///   missing-normals       corners without normal where others have one: normal zero
///   missing-colors        vertices without colour where others have one: white
///   color-scale           colours above 1 that are nearly black as bytes: they may be brighter than white
///   face-colors-left-out  faces have colours, but the vertices' own were taken
///   color-indices         OFF: face colours by an index into a list that the file lacks: ignored
///   stl-colors            STL: all triangles are marked as uncoloured but have a colour: the header's is used
///   zero-indices          OBJ: index 0 of a UV or a normal: read as none
///   texture-numbers       PLY: `texnumber` without a picture (vertex colours are used, if any), or pictures without
///   `texnumber` (the first is used)
///   texture-without-uvs   PLY: pictures, but no UVs: not read
///   bad-texcoords         PLY: not two numbers per corner: the vertices' UVs are used, or none
///   bad-polypaint         invalid colours in #MRGB lines, or of no vertex: ignored
///   unused-properties     PLY: a second set of UVs, or a part of a set: ignored
///   ignored-header-lines  PLY: unknown lines in the header
///   bad-tangents          NaN, infinite, zero or along the normal: replaced by MikkTSpace's
///   long-tangents         not of length 1: normalised when used
///   tangent-signs         neither 1 nor -1: below 0 counts as -1
///   ignored-statements    OBJ statements that Kiln ignores (lines, points, curves)
///   trailing-bytes        after the last triangle of a binary STL: ignored
///
/// \param path      the file
/// \param warnings  receives warnings of imperfect data that was handled; may be null
/// \throws Error(input) names the file, the place (line, byte or element) and the remedy: no file; unknown format, or
///         one that contradicts the name; truncated; an index out of range; no faces; no finite vertex; no triangle
///         with area; coordinates beyond float's range; a missing UV set other than the first.
/// Thread safety: may be called from several threads. Memory and time are linear in the file's
/// size; about 0.2 s for a binary PLY or an OBJ of a million triangles on one core.
Mesh load_mesh(const std::filesystem::path& path, std::vector<Warning>* warnings = nullptr);

/// Loads a mesh with options. Warnings, errors, threads and cost are those of load_mesh() without options.
Mesh load_mesh(const std::filesystem::path& path, const LoadMeshOptions& options,
               std::vector<Warning>* warnings = nullptr);

/// Mesh formats that this build reads, such as "PLY".
std::vector<std::string> mesh_formats();

/// Reads a mesh from memory, and is otherwise like load_mesh() of a file.
/// \param bytes  of a whole file; not kept
/// \param name   a file name, such as "head.ply": its extension selects the format, its stem becomes
///               Mesh::name, and messages use it
Mesh load_mesh(std::span<const std::byte> bytes, std::string_view name,
               std::vector<Warning>* warnings = nullptr);

/// Joins meshes into one, in their order, such as the parts of a scene in separate files. Positions keep their
/// world coordinates; the result has the first one's origin.
///
/// Groups, objects and materials keep their names; equal names are merged. Attributes that only some meshes
/// have are filled for the others: UVs are NaN (nothing is baked there), normals zero (computed), colours
/// white, tangents without direction (MikkTSpace's), materials "default". A mesh without groups or objects
/// becomes one with the mesh's name. The result's name is the meshes' names, joined by " + "; for more
/// than three meshes it is the first name and a count. Warnings: missing-uvs, missing-colors, as load_mesh(); they name
/// the mesh. Memory and time are linear in the meshes. Thread safety: may be called from several threads.
/// \param meshes    at least one; of one, the result is a copy with names
/// \param warnings  receives warnings; may be null
/// \throws Error(usage) for no mesh; Error(input) for an invalid mesh, see validate(), or for more than
///         2^31 - 1 elements of a kind
Mesh join_meshes(std::span<const Mesh> meshes, std::vector<Warning>* warnings = nullptr);

/// Triangles whose winding agree_windings() reversed.
struct TurnedTriangles {
  std::uint64_t count = 0;  ///< Number of triangles
  std::uint32_t first = 0;  ///< Lowest index of a reversed triangle, if count > 0
};

/// Makes windings consistent: reverses triangles whose winding opposes that of their neighbours, so that each part
/// faces one way. A part consists of triangles connected by edges of two triangles, by exactly equal positions. In an
/// inconsistent part, the side of smaller area is reversed. If both sides have at least 2/5 of the area, a closed part
/// is made to face outwards. One-sided parts (a Möbius strip) and consistent parts are unchanged, whichever way they
/// face. The normals of a reversed triangle are flipped, too, if they agreed with its winding. Time: 0.02 s for a
/// million triangles that agree. Thread safety: may be called from several threads, for different meshes.
/// \param mesh  changed: the order of corners, and normals added to the pool
/// \throws Error(input) for an invalid mesh, see validate()
TurnedTriangles agree_windings(Mesh& mesh);

/// Writes a Wavefront OBJ: positions, colours without alpha, UVs, normals, groups, objects, names of
/// materials. Numbers have 9 significant digits, so that reading restores the same floats; positions
/// of a mesh with an origin have 17. `material_files` are referenced, not written. The file appears
/// whole or not at all. About 0.4 s for a million triangles. Tangents are not written. Thread
/// safety: may be called from several threads, for files of different names.
/// \throws Error(usage) for a mesh with an index out of range or an incomplete attribute, before
///         anything is written
/// \throws Error(output)
void save_obj(const Mesh& mesh, const std::filesystem::path& path);

}  // namespace kiln
