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
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/render.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"

namespace KILN_PUBLIC kiln {

/// Which side of the iso value is the solid one. Normals point out of it.
enum class Inside {
  above,  ///< Voxels at or above the iso value
  below,  ///< Voxels below it
};

/// Treatment of a solid that reaches the volume's border.
enum class VolumeBorder {
  closed,  ///< It is cut off flat at the outermost voxels: the mesh is watertight
  open,    ///< The surface ends there, up to a cell short of it: the mesh has a border
};

/// Which surface of a volume contour() takes.
struct ContourOptions {
  double iso = 0;                              ///< Value of the surface, in the voxels' own unit
  Inside inside = Inside::above;               ///< The solid side
  VolumeBorder border = VolumeBorder::closed;  ///< End of the solid at the volume's border
  /// The outer surface alone: outer voxels that cannot be reached from the volume's border count as
  /// inside. So cavities and their content vanish. Starts are regions of free voxels, joined by six
  /// neighbours. Each has at least a twentieth of the largest one's border voxels; hollows that a
  /// cut opens have fewer.
  bool outer_only = false;
  /// With outer_only: a cube of 2 outer_gap + 1 voxels a side moves through the
  /// outside. Its centre stays in the volume, and it touches no voxel of the solid;
  /// it reaches the voxels that it covers anywhere. 0, a voxel, goes through any
  /// hole; 2, say, closes nostrils, ears and pores up to four voxels wide. A closed
  /// gap has a cap half a cell from its last voxel, with normals along axes. 0 to 64.
  std::uint32_t outer_gap = 0;

  bool operator==(const ContourOptions&) const = default;
};

/// Report of full-resolution contouring.
struct ContourReport {
  std::uint64_t cells = 0;  ///< That the surface passes through
  std::uint64_t vertices =
      0;  ///< Vertices of the finest contour: one for each sheet of surface in a cell
  std::uint64_t quads = 0;          ///< Quads of the finest contour
  double lowest = 0;                ///< Least and greatest finite voxel, where they were looked for
  double highest = 0;               ///< (floating-point volumes, and before an error)
  std::uint64_t filled_voxels = 0;  ///< That count as inside because of outer_only
  double seconds_scan = 0;          ///< Signs of all voxels, cells that the surface passes through
  double seconds_outer = 0;         ///< Filling what is not reached from the border
  double seconds_hermite = 0;       ///< Crossings of edges and their normals
  double seconds_vertices = 0;      ///< Vertices by quadric error functions
  double seconds_quads = 0;         ///< Polygons around crossed edges
  std::vector<Warning> warnings = {};  ///< All steps together
};

/// The full-resolution contour of a volume: dual contouring (Ju, Losasso, Schaefer, Warren 2002, "Dual
/// Contouring of Hermite Data") on the grid of voxels.
///
/// A cell is a cube between eight voxels. An edge between a voxel inside and one outside is crossed where
/// linear interpolation meets the iso value. The normal there is the field's gradient (central
/// differences, interpolated along the edge). Second differences may show a crease between two voxels, as
/// at sharp edges of CSG solids. Then differences are taken on the straight side; a crossing between two
/// planes lies in the one that holds it. Each sheet of surface in a cell gets a vertex of its own
/// (Nielson 2004, "Dual Marching Cubes"). It lies where the quadric error function of its crossings is
/// least, clamped to the cell; directions that the crossings do not decide (eigenvalues below 1/20 of the
/// largest) keep the crossings' mean. Each crossed edge gives a quad of two triangles. Sheets are told
/// apart so that the mesh is a closed, consistently oriented 2-manifold (Wenger 2013, "Isosurfaces",
/// section 3.3: ambiguous faces between two cells that both join what the face separates are joined).
///
/// Voxels that are not finite count as outside, infinities on the solid's side of the iso value as inside
/// ("non-finite-voxels"). Vertices have positions relative
/// to the volume's origin and smooth unit normals. Deterministic: the same on every run, number of
/// threads and conforming device. Nothing is kept, and several threads may call it. A ProgressScope hears of it
/// and may stop it.
/// \param report  where to write what was done; may be null
/// \throws Error(usage) for an iso value that is not finite; Error(input) for a volume of fewer
///         than two voxels along an axis, or more than 32,766; for voxels that are all the same or
///         miss the iso value (says the range); for axes that span no space; for a border that
///         outer_only cannot enter; Error(device)
Mesh contour(const Device& device, const Volume& volume, const ContourOptions& options = {},
             ContourReport* report = nullptr);

/// Settings of extract().
struct ExtractOptions {
  ContourOptions contour{};  ///< The full-resolution surface
  /// Target number of triangles, reached from above or left below. 0: as `error` says.
  std::uint32_t faces = 0;
  /// With faces = 0: how far vertices may be from the planes of the crossings that they stand for: root
  /// mean square, in cells. Above 0.
  double error = 0.1;
  /// Keep every part, hole and handle. Without, clusters count by their error alone: the mesh stays closed
  /// and oriented, but edges may have more than two triangles ("topology-changed").
  bool keep_topology = true;
  /// Leave out connected parts with fewer fine vertices than this share of the largest one's, 0 to 1
  /// ("small-parts"): specks of noise.
  double min_part = 0;

  std::uint32_t size = 1024;                       ///< Side of the map, 16 to 8192 texels
  std::uint32_t border_texels = 2;                 ///< Around each chart, 1 to 64
  UnwrapMethod unwrap = UnwrapMethod::pairs;       ///< charts: few large ones, by unwrap()
  TexelDensity density = TexelDensity::area;       ///< detail: of charts, by the full contour
  NormalMapSpace space = NormalMapSpace::tangent;  ///< tangent (MikkTSpace) or object
  bool flip_y = false;                             ///< Green down (DirectX)
  bool raw = false;                                ///< Components in [-1, 1] instead of n/2 + 1/2

  /// Settings that extract() chooses by the volume, whatever is given above; ExtractReport::used says what came out.
  struct Choice {
    /// With faces = 0: the least error, `error` or more, that leaves at most a twentieth of the
    /// contour's triangles. Barry and Wood, table 1: 80.6 to 99.97% less.
    bool error = false;
    /// Keeps the topology unless that leaves more than twice the triangles aimed at.
    bool topology = false;
    /// Leaves parts under 1% of the largest one out where there are 100 of them or more: noise.
    bool min_part = false;
    /// The smallest map, a multiple of 16 texels, with about one texel a cell; 8192 where that is too small.
    bool size = false;
  };
  Choice choose{};  ///< Settings that extract() chooses; none unless asked
};

/// Settings as used: given or chosen.
struct ExtractUsed {
  double error = 0;               ///< Limit, cells; 0 where faces were asked for
  bool keep_topology = true;      ///< As ExtractOptions::keep_topology
  double min_part = 0;            ///< As ExtractOptions::min_part
  std::uint32_t size = 0;         ///< Side of the map, texels
  std::uint64_t aimed_faces = 0;  ///< Triangles aimed at; 0 where the error alone decides
  std::uint64_t kept_faces = 0;   ///< With the topology, where it was let go for that
};

/// Report of an extraction.
struct ExtractReport {
  ContourReport contour = {};   ///< Report of the full-resolution surface
  ExtractUsed used = {};        ///< The options as given or as chosen
  std::uint64_t clusters = 0;   ///< Inner nodes of the tree of vertices
  std::uint64_t faces = 0;      ///< Triangles of the low poly
  std::uint64_t quads = 0;      ///< Polygons it was made of: quads, and triangles where cells of
  std::uint64_t triangles = 0;  ///< several sizes meet
  std::uint64_t parts = 0;      ///< Connected parts of the full contour
  std::uint64_t dropped_parts = 0;       ///< ... left out for being small
  double error = 0;                      ///< Greatest root mean square distance of a vertex, cells
  std::uint64_t non_manifold_edges = 0;  ///< Edges of the low poly with more than two triangles
  std::uint64_t mended = 0;        ///< Triangles that were folded or had no area, and were mended
  std::uint64_t left_out = 0;      ///< Triangles of gaps that closed: two back to back at a time
  std::uint64_t folded = 0;        ///< Triangles that face away from the full contour and stay
  std::uint64_t without_area = 0;  ///< ... that have no area
  std::uint64_t repeated = 0;      ///< ... that have the corners of another one
  std::uint64_t charts = 0;        ///< Charts of the layout: by pairs, one for each polygon
  double texels_per_cell = 0;      ///< Side of a cell in texels of the map
  double coverage = 0;             ///< Share of the map that triangles cover, 0 to 1
  std::uint64_t splatted_texels = 0;   ///< That fine vertices fell into; others are filled
  double seconds_simplify = 0;         ///< Tree of vertices and choice among them
  double seconds_atlas = 0;            ///< Layout of the charts
  double seconds_map = 0;              ///< Splatting, filling and encoding of normals
  double seconds_total = 0;            ///< All steps together
  std::vector<Warning> warnings = {};  ///< All steps together
};

/// A low poly with its normal map.
struct ExtractResult {
  Mesh mesh = {};             ///< The low poly, with UVs and smooth normals
  Image normal_map = {};      ///< 3 channels; outside the charts (1/2, 1/2, 1)
  ExtractReport report = {};  ///< Report of the extraction
};

/// Texels a cell from which on extract() warns ("map-too-fine").
inline constexpr double kMapTooFine = 4;

/// A low poly with a normal map straight from a volume (Barry and Wood, "Direct Extraction of Normal
/// Mapped Meshes from Volume Data").
///
/// The vertices of the full-resolution contour are gathered bottom-up through an octree: vertices
/// that touch within a node become one. Its quadric error function is their sum, and it stays in the
/// node's box. A node's vertex may stand for its children where the surface that it replaces is a
/// disk. The disk meets the node's edges and faces as one sheet does. So the low poly is a manifold
/// of the same topology (Schaefer, Ju, Warren 2007, "Manifold Dual Contouring", section 3: it allows
/// more than the criterion of Ju et al. 2002, section 4.1, which permits only one sheet a cell).
///
/// Each polygon of the low poly is a chart, unless ExtractOptions::unwrap says charts. The fine
/// vertices of the clusters that it spans are projected onto it and their normals splatted into the
/// map; other texels are filled smoothly within the chart by push-pull. Charts have borders from
/// the same fine vertices, so that bilinear filtering blends neighbours. Along an edge its charts
/// hold the same normals, but across creases of 30 degrees and more; what that changes fades out
/// within a cell. Large charts are laid out by unwrap(), and read the polygons' texels, twice as
/// fine: both sides of their seams hold the same. Where the map has kMapTooFine texels a cell or
/// more, push-pull fills it between fine vertices. That is no better, and may be worse, than the
/// low poly's own normals ("map-too-fine"). Threads, lifetimes and callbacks as contour().
/// \throws as contour(); Error(usage) for an option out of range or a map too small for the faces asked
///         for; Error(input) where it is too small for the charts that the topology keeps
ExtractResult extract(const Device& device, const Volume& volume,
                      const ExtractOptions& options = {});

/// A box of voxels.
struct VolumeRegion {
  std::array<std::uint32_t, 3> first{};  ///< Lowest voxel along x, y, z
  std::array<std::uint32_t, 3> size{};   ///< Voxels
};

/// A volume that is contoured once and extracted many times: at other numbers of faces (level of detail), and
/// after some of its voxels changed (destruction; Barry and Wood, section 5). Results are, to the bit, what
/// extract() gives for volume().
///
/// extract() starts at the tree of vertices. update() contours anew the planes of voxels (z) that a
/// change reaches, three on either side. It takes over all other vertices and clusters of the tree;
/// the signs of all voxels, the quads and the tree's joins are found again. A volume may have voxels
/// that are not finite: where a change moves its lowest voxel, everything is found again.
/// Memory: the volume's, 16 bytes a crossed edge, 80 bytes a fine vertex, 180 bytes a cluster, 6 bits a voxel.
/// Thread safety: one thread at a time. It owns the volume (move it in) and holds the Device.
class VolumeSession {
 public:
  /// \throws Error as contour()
  VolumeSession(const Device& device, Volume volume, const ContourOptions& options = {});
  ~VolumeSession();
  VolumeSession(VolumeSession&&) noexcept;             ///< The other is empty then
  VolumeSession& operator=(VolumeSession&&) noexcept;  ///< The other is empty then

  /// \param options  whose `contour` is the session's
  /// \throws Error as extract(); Error(usage) for other options of the contour
  ExtractResult extract(const ExtractOptions& options) const;

  /// Changes the voxels of a box, and contours again what that reaches.
  /// \param voxels  of the volume's type, x fastest; not kept
  /// \throws Error(usage) for a box that is not in the volume, or as many bytes as it does not have; as
  ///         contour(), where nothing is left of the surface. Nothing is changed then.
  void update(const VolumeRegion& region, std::span<const std::byte> voxels);

  /// Work of the last update(), or of the constructor.
  struct Update {
    std::uint64_t vertices = 0;  ///< Fine vertices found anew
    std::uint64_t kept = 0;      ///< ... taken over
    double seconds_contour = 0;  ///< Spent on vertices and quads
    double seconds_tree = 0;     ///< Spent on the tree of vertices
  };
  const Update& last_update() const;  ///< Until the next update()

  const Volume& volume() const;  ///< As it is now

 private:
  struct KILN_OPAQUE Impl;
  Impl* impl_;
};

}  // namespace kiln
