// Structs of the contours of volumes and of their maps, shared by kernels/volume and host/volume.
#ifndef KILN_SHARED_VOLUME_H
#define KILN_SHARED_VOLUME_H

#include "shared/common.h"

#ifdef __OPENCL_C_VERSION__
typedef ulong kiln_ulong;
#else
typedef uint64_t kiln_ulong;
#endif

/// Cells, voxels and edges have padded coordinates: voxel i of the volume is i + 1, and the padding is
/// outside the solid. Cell c lies between padded voxels c and c + 1, edge (c, axis) leaves voxel c along
/// the axis.
///
/// 64 consecutive positions along x. The index of an edge or cell is the base of its word plus the number of bits set
/// before its own (rank: Jacobson 1989, "Space-efficient static trees and graphs"), so that positions are converted to
/// indices without a search. Edges count along x first, then y, then z.
typedef struct kiln_volume_word {
  kiln_ulong edge[3];  ///< Bit set of the positions whose edge along x, y, z is crossed
  kiln_ulong cell;     ///< Bit set of the positions whose cell the surface crosses
  kiln_uint edge_base;
  kiln_uint cell_base;
} kiln_volume_word;
KILN_CHECK_SIZE(kiln_volume_word, 40);

typedef struct kiln_volume_grid {
  kiln_uint size[3];  ///< Voxels
  kiln_uint words;    ///< Words per row of size[0] + 2 padded voxels
  kiln_uint first_z;  ///< First plane of the slab of voxels on the device
  kiln_uint count_z;
  kiln_uint begin;  ///< Index of the first edge, or vertex, of this launch
  kiln_uint count;  ///< Number of items
  kiln_float iso;
  kiln_int below;      ///< 1: the solid is below the iso value
  kiln_float outside;  ///< Value that replaces non-finite voxels
  kiln_uint reserved;
  /// Columns of the matrix from index space to world space: the offset of one step along x, y, z
  kiln_float to_world[9];
  /// Rows of the matrix that transforms normals from index space to world space, except for their length
  kiln_float normal_to_world[9];
  kiln_uint padding[2];
} kiln_volume_grid;
KILN_CHECK_SIZE(kiln_volume_grid, 128);

/// A crossing: position along its edge, and the outward unit normal in index space.
typedef struct kiln_volume_crossing {
  kiln_float t;
  kiln_float normal[3];
} kiln_volume_crossing;
KILN_CHECK_SIZE(kiln_volume_crossing, 16);

/// Quadric error function of crossings (point p, unit normal n), relative to the cell's lowest
/// corner: E(x) = x' A x - 2 b' x + c.
typedef struct kiln_volume_qef {
  kiln_float a[6];     ///< sum n n': xx xy xz yy yz zz
  kiln_float b[3];     ///< sum n (n . p)
  kiln_float c;        ///< sum (n . p)^2
  kiln_float mass[3];  ///< sum p
  kiln_float count;
} kiln_volume_qef;
KILN_CHECK_SIZE(kiln_volume_qef, 56);

/// A vertex of the finest contour.
typedef struct kiln_volume_vertex {
  kiln_float position[3];  ///< In world units, relative to the volume's origin
  kiln_float normal[3];    ///< Unit vector in world space
} kiln_volume_vertex;
KILN_CHECK_SIZE(kiln_volume_vertex, 24);

/// A vertex's key: its cell's x, y, z in 16 bits each from the lowest, then 12 bits for the cell's edges
/// that its sheet crosses. Edge 4 a + u + 2 v runs along axis a, u steps along axis (a+1)%3 and v along
/// (a+2)%3.
#define KILN_VOLUME_KEY_BITS 16

/// Eigenvalues below this share of the largest count as 0: along their eigenvectors the vertex stays at the mean of the
/// crossings.
#define KILN_VOLUME_EIGEN_LIMIT 0.05f

/// A polygon of the low poly and its rectangle of texels: one triangle, or two that share the edge from
/// corner 0 to corner 2: (0, 1, 2) and (0, 2, 3). Texels are local to the rectangle, rows from the top;
/// whole numbers are their centres.
typedef struct kiln_volume_chart {
  /// Per triangle: affine functions that give the weights of its 2nd and 3rd corner at a point (x, y, z, 1)
  kiln_float project[2][2][4];
  /// Per triangle: affine functions that give the same two weights at a texel (x, y, 1)
  kiln_float weights[2][2][3];
  kiln_float texel[4][2];       ///< Texels of the corners
  kiln_float normal[2][3];      ///< Unit normals of the triangles
  kiln_uint corner[4];          ///< Vertices of the low poly
  kiln_uint size[2];            ///< Width, height
  kiln_uint first_texel;        ///< Index of the chart's first texel in the pool, at level 0
  kiln_uint triangle;           ///< Index of the chart's first triangle in the low poly
  kiln_uint triangles;          ///< 1 or 2
  kiln_uint corners;            ///< 3 or 4
  kiln_uint place[2];           ///< Position of the chart's first texel in the map
  /// Index of the chart's first border texel. Border texels are stored edge after edge of the chart; each edge includes
  /// both ends
  kiln_uint first_ring;
  kiln_uint padding;
} kiln_volume_chart;
KILN_CHECK_SIZE(kiln_volume_chart, 224);

/// A level of the charts' pyramids: sides halve, rounded up, down to 1 x 1. Rows of all charts that have
/// the level are consecutive.
typedef struct kiln_volume_level {
  kiln_uint rows;
  kiln_uint level;
  kiln_uint charts;
  kiln_int space;      ///< KILN_SPACE_*
  kiln_float y_scale;  ///< 1: green points up; -1: down
  kiln_float scale;    ///< Map values are scale * n + offset
  kiln_float offset;
  kiln_float reach;  ///< Width of the band along a seam that its correction changes, texels
} kiln_volume_level;
KILN_CHECK_SIZE(kiln_volume_level, 32);

#endif
