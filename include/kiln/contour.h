#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/image_data.h"
#include "kiln/mesh.h"
#include "kiln/render.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"

namespace KILN_PUBLIC kiln {

/// The side of the iso value, above or below it, on which voxels are solid. Normals point away from the solid.
enum class Inside {
  above,  ///< Voxels at or above the iso value
  below,  ///< Voxels below the iso value
};

/// Treatment of a solid that reaches the volume's border.
enum class VolumeBorder {
  closed,  ///< The solid is cut off flat at the outermost voxels: the mesh is watertight
  open,    ///< The surface ends at the border or up to a cell before it: the mesh is open there
};

/// Settings of contour().
struct ContourOptions {
  double iso = 0;                 ///< Value of the field on the surface, in the voxels' unit
  Inside inside = Inside::above;  ///< Which side of the iso value is solid
  VolumeBorder border = VolumeBorder::closed;  ///< Treatment of the solid at the volume's border
  /// The outer surface alone: outer voxels that cannot be reached from the volume's border count as
  /// inside, so cavities and their content are removed. The flood starts from regions of free
  /// voxels on the border (6-connected) that have at least 1/20 of the largest region's border
  /// voxels; smaller ones are hollows that the volume's border cuts open.
  bool outer_only = false;
  /// With outer_only: the outside is the volume swept by a cube of 2 outer_gap + 1 voxels a side,
  /// whose centre stays in the volume and which never touches the solid. 0 (one voxel) passes
  /// through any hole; 2, for example, closes nostrils, ears and pores up to four voxels wide. A
  /// closed gap has a cap half a cell from its last voxel, with normals along axes. 0 to 64.
  std::uint32_t outer_gap = 0;

  bool operator==(const ContourOptions&) const = default;
};

/// Report of full-resolution contouring.
struct ContourReport {
  std::uint64_t cells = 0;  ///< Cells that the surface crosses
  std::uint64_t vertices =
      0;  ///< Vertices of the full contour: one per sheet of the surface in a cell
  std::uint64_t quads = 0;  ///< Quads of the full contour
  double lowest = 0;        ///< Smallest finite voxel; see `highest`
  /// Largest finite voxel. `lowest` and `highest` are only computed for floating-point volumes, and
  /// for error messages
  double highest = 0;
  std::uint64_t filled_voxels = 0;  ///< Voxels that count as inside because of outer_only
  /// Duration of classifying voxels, and of finding the cells that the surface crosses
  double seconds_scan = 0;
  double seconds_outer = 0;            ///< Duration of the flood fill from the border
  double seconds_hermite = 0;          ///< Duration of computing edge crossings and their normals
  double seconds_vertices = 0;         ///< Duration of placing vertices by quadric error functions
  double seconds_quads = 0;            ///< Duration of making quads around crossed edges
  std::vector<Warning> warnings = {};  ///< Warnings of all steps
};

/// The full-resolution contour of a volume: dual contouring (Ju, Losasso, Schaefer, Warren 2002, "Dual
/// Contouring of Hermite Data") on the grid of voxels.
///
/// A cell is a cube between eight voxels. An edge between a voxel inside and one outside is crossed where
/// linear interpolation meets the iso value. The normal there is the field's gradient (central differences,
/// interpolated along the edge). Second differences may show a crease between two voxels, as at sharp edges of
/// CSG solids. Then differences are taken on the side where the field is straight. If the field is planar on
/// both sides, the crossing is put on the plane that belongs to its side of the crease. Each sheet of surface in a cell
/// gets a vertex of its own (Nielson 2004, "Dual Marching Cubes"). It lies where the quadric error function of its
/// crossings is least, clamped to the cell; along directions that the crossings do not determine (eigenvalues below
/// 1/20 of the largest), it lies at the mean of the crossings. Each crossed edge gives a quad of two triangles. Sheets
/// are separated so that the mesh is a closed, consistently oriented 2-manifold (Wenger 2013, "Isosurfaces", section
/// 3.3: ambiguous faces between two cells that both join what the face separates are joined).
///
/// Voxels that are not finite count as outside, infinities on the solid's side of the iso value as inside
/// ("non-finite-voxels"). Vertices have positions relative to the volume's origin and smooth unit normals.
/// Deterministic: the same on every run, number of threads and conforming device. No argument is kept, and
/// several threads may call it. Reports to a ProgressScope, which may cancel it.
/// \param report  receives the report; may be null
/// \throws Error(usage) for an iso value that is not finite; Error(input) for a volume of fewer than two voxels
///         along an axis, or more than 32,766; for voxels that are all equal, or whose range (named in the
///         message) misses the iso value; for axes that span no space; if the solid fills the border, so that
///         outer_only has no start; Error(device)
Mesh contour(const Device& device, const Volume& volume, const ContourOptions& options = {},
             ContourReport* report = nullptr);

/// Settings of extract().
struct ExtractOptions {
  ContourOptions contour{};  ///< Settings of the full contour
  /// Target number of triangles, which the result does not exceed. 0: the bound `error` decides.
  std::uint32_t faces = 0;
  /// With faces = 0: largest distance of vertices from the planes of the crossings that they represent:
  /// root mean square, in cells. Above 0.
  double error = 0.1;
  /// Keep the topology: every part, hole and handle. If false, clusters are chosen by their error alone:
  /// the mesh stays closed and oriented, but edges may have more than two triangles ("topology-changed").
  bool keep_topology = true;
  /// Remove connected parts that have fewer vertices in the full contour than this share of the
  /// largest part's number, 0 to 1: specks of noise. The warning "small-parts" counts them.
  double min_part = 0;

  std::uint32_t size = 1024;                  ///< Side of the map, 16 to 8192 texels
  std::uint32_t border_texels = 2;            ///< Padding around each chart, 1 to 64 texels
  UnwrapMethod unwrap = UnwrapMethod::pairs;  ///< Method of the UV layout
  /// Only for UnwrapMethod::charts. TexelDensity::detail is measured on the full contour
  TexelDensity density = TexelDensity::area;
  /// Space of the normals: tangent (MikkTSpace) or object
  NormalMapSpace space = NormalMapSpace::tangent;
  bool flip_y = false;  ///< True: green points down (DirectX); false: up (OpenGL)
  bool raw = false;     ///< Components in [-1, 1] instead of n/2 + 1/2

  /// Settings that extract() chooses according to the volume, instead of those above; ExtractReport::used holds
  /// the result.
  struct Choice {
    /// With faces = 0: choose the smallest error, `error` or more, that leaves at most 1/20 of the
    /// contour's triangles. Barry and Wood removed 80.6 to 99.97% of the triangles (table 1).
    bool error = false;
    /// Keep the topology, unless that leaves more than twice the target number of triangles.
    bool topology = false;
    /// If there are 100 or more parts under 1% of the largest one, drop them as noise.
    bool min_part = false;
    /// Choose the smallest map, a multiple of 16 texels, with about one texel per cell; at most 8192.
    bool size = false;
  };
  Choice choose{};  ///< Which settings extract() chooses; by default none
};

/// Settings in use: those given, or those that were chosen.
struct ExtractUsed {
  double error = 0;               ///< Error bound in use, cells; 0 if `faces` was given
  bool keep_topology = true;      ///< Value of ExtractOptions::keep_topology in use
  double min_part = 0;            ///< Value of ExtractOptions::min_part in use
  std::uint32_t size = 0;         ///< Side of the map, texels
  std::uint64_t aimed_faces = 0;  ///< Target number of triangles; 0 if the error alone decides
  /// If the topology was not kept: number of triangles that the result would have if it were kept
  std::uint64_t kept_faces = 0;
};

/// Report of an extraction.
struct ExtractReport {
  ContourReport contour = {};  ///< Report of the full-resolution surface
  ExtractUsed used = {};       ///< Options in use: those given, or those that were chosen
  std::uint64_t clusters = 0;  ///< Number of inner nodes of the octree of vertices
  std::uint64_t faces = 0;     ///< Triangles of the low poly
  std::uint64_t quads = 0;     ///< Quads of the low poly
  /// Triangular polygons of the low poly, which lie where cells of different sizes meet
  std::uint64_t triangles = 0;
  std::uint64_t parts = 0;          ///< Number of connected parts of the full contour
  std::uint64_t dropped_parts = 0;  ///< Number of parts that were removed because they are small
  /// Largest root mean square distance of a vertex from the planes of its crossings, cells
  double error = 0;
  std::uint64_t non_manifold_edges = 0;  ///< Edges of the low poly with more than two triangles
  std::uint64_t mended = 0;              ///< Folded or degenerate triangles that were repaired
  /// Triangles removed in pairs, back to back, where gaps closed
  std::uint64_t left_out = 0;
  std::uint64_t folded = 0;        ///< Remaining triangles that face away from the full contour
  std::uint64_t without_area = 0;  ///< Remaining triangles without area
  std::uint64_t repeated = 0;      ///< Remaining triangles with the same corners as another one
  std::uint64_t charts = 0;        ///< Number of charts; with UnwrapMethod::pairs, one per polygon
  double texels_per_cell = 0;      ///< Number of the map's texels along a cell's side
  double coverage = 0;             ///< Share of the map that triangles cover, 0 to 1
  /// Texels into which vertices of the full contour were splatted; the other texels are filled from
  /// these
  std::uint64_t splatted_texels = 0;
  /// Duration of building the octree of vertices and of choosing its nodes
  double seconds_simplify = 0;
  double seconds_atlas = 0;            ///< Duration of laying out the charts
  double seconds_map = 0;              ///< Duration of splatting, filling and encoding normals
  double seconds_total = 0;            ///< Duration of all steps together
  std::vector<Warning> warnings = {};  ///< Warnings of all steps
};

/// A low poly with its normal map.
struct ExtractResult {
  Mesh mesh = {};             ///< The low poly, with UVs and smooth normals
  Image normal_map = {};      ///< 3 channels; (1/2, 1/2, 1) outside the charts
  ExtractReport report = {};  ///< Report of the extraction
};

/// Texels per cell at and above which extract() warns ("map-too-fine").
inline constexpr double kMapTooFine = 4;

/// A low poly with a normal map, extracted directly from a volume (Barry and Wood, "Direct Extraction of Normal Mapped
/// Meshes from Volume Data").
///
/// The vertices of the full-resolution contour are clustered bottom-up through an octree: connected
/// vertices of a node are merged into one. The merged vertex has the sum of their quadric error
/// functions, and stays in the node's box. The vertex of a node may replace those of the node's
/// children if the replaced surface is a disk that meets the node's edges and faces as a single
/// sheet does. So the low poly is a manifold of the same topology (Schaefer, Ju, Warren 2007,
/// "Manifold Dual Contouring", section 3: this criterion allows more than that of Ju et al. 2002,
/// section 4.1, which permits only one sheet per cell).
///
/// Each polygon of the low poly is a chart, unless ExtractOptions::unwrap is UnwrapMethod::charts. The
/// fine vertices of the clusters that it spans are projected onto it and their normals splatted into
/// the map; other texels are filled smoothly within the chart by push-pull. Charts have borders from
/// the same fine vertices, so that bilinear filtering blends neighbours. Charts that share an edge hold
/// the same normals along it, except at creases of 30 degrees and more; the correction fades out within
/// a cell. Large charts are laid out by unwrap(), and resampled from the polygons' texels at twice the
/// resolution, so both sides of a seam hold the same values. Where the map has kMapTooFine texels a
/// cell or more, push-pull fills it between fine vertices. That is no better, and may be worse, than
/// the low poly's own normals ("map-too-fine"). Rules for threads, lifetimes and
/// callbacks are those of contour().
/// \throws as contour(); Error(usage) for an option out of range or a map too small for the number of
///         faces; Error(input) for a map too small for the charts that are left to keep the topology
ExtractResult extract(const Device& device, const Volume& volume,
                      const ExtractOptions& options = {});

/// A box of voxels.
struct VolumeRegion {
  std::array<std::uint32_t, 3> first{};  ///< Index of the box's first voxel along x, y, z
  std::array<std::uint32_t, 3> size{};   ///< Number of voxels along x, y, z
};

/// Contours a volume once and extracts low polys repeatedly: at several numbers of faces (levels of detail),
/// and after changes of voxels (destruction; Barry and Wood, section 5). Results are identical to extract() of
/// volume(), to the bit.
///
/// extract() starts at the octree of vertices. update() contours the changed planes of voxels (z) again, with
/// three planes on either side, and reuses all other vertices and clusters; the signs of all voxels, the quads
/// and the octree's merges are recomputed. In volumes with non-finite voxels, a change of the lowest voxel
/// recomputes everything. Memory: the volume's, 16 bytes per crossed edge, 80 per fine vertex, 180 per
/// cluster, and 6 bits per voxel. Thread safety: one thread at a time. It owns the volume (move it in) and
/// holds the Device.
class VolumeSession {
 public:
  /// \throws Error as contour()
  VolumeSession(const Device& device, Volume volume, const ContourOptions& options = {});
  ~VolumeSession();
  VolumeSession(VolumeSession&&) noexcept;             ///< A session that was moved from is empty
  VolumeSession& operator=(VolumeSession&&) noexcept;  ///< A session that was moved from is empty

  /// \param options  `contour` must equal the session's
  /// \throws Error as extract(); Error(usage) if `contour` differs
  ExtractResult extract(const ExtractOptions& options) const;

  /// Replaces the voxels of a box, and contours the affected planes again.
  /// \param voxels  of the volume's type, x fastest; not kept
  /// \throws Error(usage) for a box outside of the volume, or a wrong number of bytes; as contour(), if
  ///         no surface is left. The session is unchanged then.
  void update(const VolumeRegion& region, std::span<const std::byte> voxels);

  /// Counts and durations of the last update(), or of the constructor if there was none.
  struct Update {
    std::uint64_t vertices = 0;  ///< Vertices of the full contour that were computed again
    std::uint64_t kept = 0;      ///< Vertices of the full contour that were reused
    double seconds_contour = 0;  ///< Duration of computing vertices and quads
    double seconds_tree = 0;     ///< Duration of building the octree of vertices
  };
  const Update& last_update() const;  ///< Valid until the next update()

  const Volume& volume() const;  ///< Current voxels

 private:
  struct KILN_OPAQUE Impl;
  Impl* impl_;
};

}  // namespace kiln
