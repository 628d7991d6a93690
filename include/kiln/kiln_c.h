/// \file
/// Kiln for C, and for languages that call C: Rust, C#, Python's ctypes. It reads meshes, simplifies, unwraps and
/// bakes, and returns maps and GLBs.
///
/// Objects are opaque: kiln_..._free() frees each, and null is allowed there. Structs begin with their size, which
/// kiln_..._init() sets together with all defaults, so programs compiled against an older header work with a newer
/// library. New fields are appended. A field `reserved` must be 0 ("struct-reserved").
///
/// Functions that may fail return a kiln_status. If it is not KILN_OK, outputs are unchanged, and kiln_error_message()
/// returns this thread's message. No exception leaves a function.
///
/// Threads: as in C++. Objects are immutable, so any number of threads may read one.
#ifndef KILN_KILN_C_H
#define KILN_KILN_C_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__) && !defined(KILN_STATIC)
/// Marks functions that a shared library exports
#define KILN_C_API __attribute__((visibility("default")))
#else
#define KILN_C_API  ///< Marks functions that a shared library exports
#endif

#ifdef __cplusplus
extern "C" {
#endif

/// Result of a call. The values are the exit codes of the command line.
typedef int32_t kiln_status;
#define KILN_OK 0           ///< Success
#define KILN_INTERNAL 1     ///< A defect of Kiln, or out of memory
#define KILN_USAGE 2        ///< A parameter is out of range, or null where that is not allowed
#define KILN_INPUT 3        ///< A file or a mesh cannot be used
#define KILN_DEVICE 4       ///< No OpenCL device, or a device call failed
#define KILN_OUTPUT 5       ///< A result could not be written
#define KILN_CANCELLED 130  ///< The progress callback cancelled the call

/// Message of this thread's last failed call: one or two sentences for users. Never null; valid until the thread's next
/// failure.
KILN_C_API const char* kiln_error_message(void);
/// Identifier of the same error for programs, such as "mesh-index"; if it has none, the name of its kind,
/// such as "usage". Never null.
KILN_C_API const char* kiln_error_code(void);
/// Returns a warning, one sentence, of this thread's last successful kiln_mesh_new(), kiln_mesh_load(),
/// kiln_simplify(), kiln_unwrap() or kiln_source_new(). Null beyond the last warning; valid until the next of
/// these calls. For warnings of bakes see kiln_bake_warning().
KILN_C_API const char* kiln_warning(size_t index);
/// Returns the version of the library, "MAJOR.MINOR.PATCH".
KILN_C_API const char* kiln_c_version(void);

/// Called about ten times a second on the thread that called Kiln. It must not throw.
/// \param done  completed share, 0 to 1
/// \param stage  name of the current step; valid during the callback
/// \param user  pointer that was given with the callback
/// \returns 0 to cancel the call, which then returns KILN_CANCELLED within 0.3 s
typedef int32_t (*kiln_progress)(double done, const char* stage, void* user);

/* ---- meshes ---- */

/// A triangle mesh.
typedef struct kiln_mesh kiln_mesh;

/// Elements in the caller's memory, at a constant stride.
typedef struct kiln_span {
  const void* data;  ///< Address of the first element; null: the span is empty
  size_t count;      ///< Number of elements
  /// Bytes from one element to the next, at least an element's size; 0: contiguous
  size_t stride;
} kiln_span;

/// A mesh in the caller's memory, as renderers keep it: one list of vertices and indices into it.
typedef struct kiln_mesh_view {
  size_t size;          ///< Size of this struct, set by its init function
  kiln_span positions;  ///< Three floats per vertex
  const uint32_t*
      /// Three indices per triangle, counter-clockwise seen from outside; null: every three
      /// vertices in their order are a triangle
      indices;
  size_t index_count;  ///< Number of indices, a multiple of 3
  kiln_span normals;   ///< Three floats per vertex, or an empty span
  kiln_span uvs;       ///< Two floats per vertex, or an empty span; the origin is at the lower left
  /// Four floats per vertex, or an empty span: x, y, z of the direction of increasing u, and the
  /// sign of the bitangent
  kiln_span tangents;
  kiln_span colors;  ///< Four bytes per vertex, or an empty span: RGBA, sRGB-encoded
  double origin[3];  ///< World position of the origin of `positions`
  int32_t flip_v;    ///< Not 0: the UVs' origin is at the upper left
  int32_t reserved;  ///< Must be 0
  const char* name;  ///< Name in messages; null: "mesh"
} kiln_mesh_view;

/// Read access to a mesh's arrays, valid as long as the mesh. Corners have separate indices into UVs and
/// normals.
typedef struct kiln_mesh_arrays {
  size_t size;                       ///< Size of this struct, set by its init function
  const float* positions;            ///< Three floats per vertex
  size_t vertex_count;               ///< Number of vertices
  const uint32_t* triangles;         ///< Three vertex indices per triangle
  size_t triangle_count;             ///< Number of triangles
  const float* uvs;                  ///< Two floats per UV, or null
  size_t uv_count;                   ///< Number of UVs
  const uint32_t* uv_triangles;      ///< Three UV indices per triangle, or null
  const float* normals;              ///< Three floats per normal, or null
  size_t normal_count;               ///< Number of normals
  const uint32_t* normal_triangles;  ///< Three normal indices per triangle, or null
  const uint8_t* colors;             ///< Four bytes per vertex, or null
  double origin[3];                  ///< World position of the origin of `positions`
} kiln_mesh_arrays;

/// Sets the field `size`, and all other fields to 0.
KILN_C_API void kiln_mesh_view_init(kiln_mesh_view* view);
/// Makes a mesh from a view, whose data it copies.
/// \param mesh  out
KILN_C_API kiln_status kiln_mesh_new(const kiln_mesh_view* view, kiln_mesh** mesh);
/// Reads a file: PLY, OBJ, STL, OFF, glTF and others. \param path  UTF-8  \param mesh  out
KILN_C_API kiln_status kiln_mesh_load(const char* path, kiln_mesh** mesh);
/// Writes a Wavefront OBJ. The file appears whole or not at all.
/// \param path  UTF-8; must not be a file that the mesh was read from
KILN_C_API kiln_status kiln_mesh_save_obj(const kiln_mesh* mesh, const char* path);
/// Sets the field `size`, and all other fields to 0.
KILN_C_API void kiln_mesh_arrays_init(kiln_mesh_arrays* arrays);
/// Returns pointers to a mesh's arrays.
/// \param arrays  in: its field `size`; out: all other fields
KILN_C_API kiln_status kiln_mesh_read(const kiln_mesh* mesh, kiln_mesh_arrays* arrays);
/// Computes the normals of a high poly.
/// \param angle  edges whose faces meet at this many degrees or more become hard, up to 180; 0: choose hard
///               edges automatically, if the mesh has no normals, as kiln_simplify() and kiln_source_new()
///               do (shade_high() in kiln/normals.h)
KILN_C_API kiln_status kiln_mesh_shade(kiln_mesh* mesh, double angle);
/// Frees a mesh.
KILN_C_API void kiln_mesh_free(kiln_mesh* mesh);

/* ---- low polys ---- */

/// Options of kiln_simplify().
typedef struct kiln_simplify_options {
  size_t size;       ///< Size of this struct, set by its init function
  uint32_t faces;    ///< Target number of triangles; 0: as few as max_error allows
  int32_t keep_uvs;  ///< Not 0: preserve UVs, groups, materials and their borders
  /// If `faces` is 0: largest deviation of the surface, as a share of the diagonal
  double max_error;
  int32_t keep_parts;      ///< Not 0: keep all parts, including very small ones
  int32_t hull;            ///< Not 0: the result encloses the mesh
  kiln_progress progress;  ///< Progress callback; null: none
  void* user;              ///< Pointer that is passed to `progress`
} kiln_simplify_options;

/// Options of kiln_unwrap().
typedef struct kiln_unwrap_options {
  size_t size;             ///< Size of this struct, set by its init function
  uint32_t map_size;       ///< Side of the map, texels
  uint32_t border_texels;  ///< Padding between charts, texels
  uint32_t pairs;          ///< Not 0: lay out triangles in pairs, instead of few large charts
  uint32_t reserved;       ///< Must be 0
  kiln_progress progress;  ///< Progress callback; null: none
  void* user;              ///< Pointer that is passed to `progress`
} kiln_unwrap_options;

/// Sets the field `size`, and all other fields to their defaults.
KILN_C_API void kiln_simplify_options_init(kiln_simplify_options* options);
/// Simplifies a mesh.
/// \param options  null: defaults
/// \param low  out; it has UVs only if keep_uvs is set
KILN_C_API kiln_status kiln_simplify(const kiln_mesh* high, const kiln_simplify_options* options,
                                     kiln_mesh** low);
/// Sets the field `size`, and all other fields to their defaults.
KILN_C_API void kiln_unwrap_options_init(kiln_unwrap_options* options);
/// Gives a mesh new UVs. \param options  null: defaults  \param unwrapped  out
KILN_C_API kiln_status kiln_unwrap(const kiln_mesh* mesh, const kiln_unwrap_options* options,
                                   kiln_mesh** unwrapped);

/* ---- baking ---- */

/// A high poly on the device: made once, used by any number of bakes.
typedef struct kiln_source kiln_source;
/// The maps of a bake.
typedef struct kiln_bake kiln_bake;

/// Options of a bake: maps, and the search for points of the high poly.
typedef struct kiln_bake_options {
  size_t size;        ///< Size of this struct, set by its init function
  uint32_t width;     ///< Texels, 1 to 16384
  uint32_t height;    ///< Texels, 1 to 16384
  uint32_t samples;   ///< N x N samples per texel, 1 to 16
  int32_t gutter;     ///< Width of the padding, texels; -1: fill the whole map
  const char* maps;   ///< Names of the maps to bake, separated by commas; null: "normal"
  const char* match;  ///< Name of the match; null: "ray"
  /// Names of matches for samples that `match` misses, separated by commas; null: none
  const char* fallback;
  /// Search distance; 0: the default, or one that follows from the deviation that kiln_simplify()
  /// measured
  double max_distance;
  /// Cage distance: rays start this far outside of the low poly and run inward; 0: no cage
  double cage;
  /// Not 0: max_distance, cage and ao_distance are shares of the diagonal; 0: they are in world
  /// units
  int32_t relative;
  int32_t two_sided;       ///< Not 0: rays hit back faces, too
  int32_t flip_y;          ///< Not 0: green points down (DirectX); 0: up (OpenGL)
  int32_t object_space;    ///< Not 0: normals are in object space; 0: in tangent space
  uint32_t ao_rays;        ///< Rays per sample of the map ao, 1 to 4096
  uint32_t reserved;       ///< Must be 0
  double ao_distance;      ///< Largest distance of occluders in the map ao; 0: unlimited
  kiln_progress progress;  ///< Progress callback; null: none
  void* user;              ///< Pointer that is passed to `progress`
} kiln_bake_options;

/// A map, valid as long as its bake: rows from the top (row 0 is at v = 1), channels interleaved.
typedef struct kiln_map {
  size_t size;          ///< Size of this struct, set by its init function
  const char* name;     ///< Name of the map, such as "normal"
  uint32_t width;       ///< Texels
  uint32_t height;      ///< Texels
  uint32_t channels;    ///< 1 to 4
  uint32_t reserved;    ///< Must be 0
  const float* pixels;  ///< width * height * channels; unit vectors as n/2 + 1/2
} kiln_map;

/// Report of a bake.
typedef struct kiln_report {
  size_t size;               ///< Size of this struct, set by its init function
  uint64_t texels;           ///< Number of texels that the low poly covers
  uint64_t samples;          ///< Samples that the low poly covers
  uint64_t missed;           ///< Samples without a matched point
  double max_distance;       ///< Search distance in effect, world units
  double mean_abs_distance;  ///< Mean |distance| of the samples that hit, world units
  uint64_t warnings;         ///< Number of warnings, see kiln_bake_warning()
} kiln_report;

/// Uploads a high poly to a device. \param device  index or part of its name; null: the first GPU, else the first
/// CPU
/// \param progress  null: none
/// \param user  passed to `progress`
/// \param source  out; it copies the mesh's data
KILN_C_API kiln_status kiln_source_new(const char* device, const kiln_mesh* high,
                                       kiln_progress progress, void* user, kiln_source** source);
/// Frees a source. Its bakes remain valid.
KILN_C_API void kiln_source_free(kiln_source* source);
/// Sets the field `size`, and all other fields to their defaults, those of `kiln bake --help`.
KILN_C_API void kiln_bake_options_init(kiln_bake_options* options);
/// Bakes. Returns KILN_INPUT also if no texel has a matched point ("many-misses"), or if none is covered
/// ("no-texels").
/// \param low  with UVs  \param options  null: defaults  \param bake  out
KILN_C_API kiln_status kiln_bake_new(const kiln_source* source, const kiln_mesh* low,
                                     const kiln_bake_options* options, kiln_bake** bake);
/// Returns the number of maps, which are in the order of `maps`.
KILN_C_API size_t kiln_bake_map_count(const kiln_bake* bake);
/// Sets the field `size`, and all other fields to 0.
KILN_C_API void kiln_map_init(kiln_map* map);
/// Returns a map.
/// \param index  0 for the first map
/// \param map  in: its field `size`; out: all other fields
KILN_C_API kiln_status kiln_bake_map(const kiln_bake* bake, size_t index, kiln_map* map);
/// Returns the states of all texels, rows from the top: 0 empty, 1 baked, 2 missed, 3 padding.
/// Valid as long as the bake.
KILN_C_API const uint8_t* kiln_bake_coverage(const kiln_bake* bake);
/// Sets the field `size`, and all other fields to 0.
KILN_C_API void kiln_report_init(kiln_report* report);
/// Returns the bake's report.
/// \param report  in: its field `size`; out: all other fields
KILN_C_API kiln_status kiln_bake_report(const kiln_bake* bake, kiln_report* report);
/// Returns a warning, one sentence; null beyond the last. Valid as long as the bake.
KILN_C_API const char* kiln_bake_warning(const kiln_bake* bake, size_t index);
/// Frees a bake.
KILN_C_API void kiln_bake_free(kiln_bake* bake);

/// Writes the values of a map as they are, as PNG (.png, 16 bits, clamped to [0, 1]) or EXR (.exr, half). The
/// file appears whole or not at all.
/// \param path  UTF-8
KILN_C_API kiln_status kiln_map_save(const kiln_map* map, const char* path);

/// Writes a low poly as binary glTF 2.0, with the bake's maps normal, ao, color and opacity. The file appears
/// whole or not at all.
/// \param low  the mesh for which `bake` was made
/// \param bake  null: no maps
/// \param path  UTF-8; must not be a file that was read
KILN_C_API kiln_status kiln_glb_save(const kiln_mesh* low, const kiln_bake* bake, const char* path);

/* ---- jobs: what `kiln bake` does, in one call ---- */

/// A whole bake described by options, see kiln/job.h. Options have the names of the command's flags, see
/// `kiln bake --help`.
typedef struct kiln_job kiln_job;
/// The result of a job.
typedef struct kiln_job_result kiln_job_result;

/// A map that a job returned in memory, valid as long as the result.
typedef struct kiln_job_image {
  size_t size;          ///< Size of this struct, set by its init function
  const char* name;     ///< Name of the map, such as "normal"
  const char* set;      ///< Name of the texture set; empty if there is only one
  const char* tile;     ///< Number of the UDIM tile, such as "1001"; empty: none
  uint32_t width;       ///< Texels
  uint32_t height;      ///< Texels
  uint32_t channels;    ///< 1 to 4
  const float* pixels;  ///< Rows from the top, encoded as in files: in [0, 1], colours sRGB-encoded
} kiln_job_image;

/// Creates a job with default options. \param job  out
KILN_C_API kiln_status kiln_job_new(kiln_job** job);
/// Frees a job.
KILN_C_API void kiln_job_free(kiln_job* job);
/// Sets an option, replacing its value: "high", "low", "out", "faces", "maps", "match.max_distance"...
/// \param option  name of a flag, or of a member of kiln::Job
/// \param value  value as the flag accepts it, UTF-8
KILN_C_API kiln_status kiln_job_set(kiln_job* job, const char* option, const char* value);
/// Adds a value to an option that accepts several.
KILN_C_API kiln_status kiln_job_add(kiln_job* job, const char* option, const char* value);
/// Sets all options from JSON: see kiln::job_from_json().
KILN_C_API kiln_status kiln_job_set_json(kiln_job* job, const char* json);
/// Copies a mesh as the high poly.
/// \param name  name in messages and file names; null: "high"
KILN_C_API kiln_status kiln_job_set_high(kiln_job* job, const kiln_mesh* mesh, const char* name);
/// Copies a mesh as the low poly.
/// \param name  name in messages and file names; null: "low"
KILN_C_API kiln_status kiln_job_set_low(kiln_job* job, const kiln_mesh* mesh, const char* name);
/// Sets whether results stay in memory instead of being written to files; see kiln_job_glb() and
/// kiln_job_map().
KILN_C_API kiln_status kiln_job_set_in_memory(kiln_job* job, int32_t in_memory);
/// Runs a job.
/// \param device  as for kiln_source_new(); null: the job's option "device"
/// \param progress  null: none
/// \param result  out
KILN_C_API kiln_status kiln_job_run(const kiln_job* job, const char* device, kiln_progress progress,
                                    void* user, kiln_job_result** result);
/// Frees a result.
KILN_C_API void kiln_job_result_free(kiln_job_result* result);
/// Returns the path of a written file, UTF-8; null beyond the last.
KILN_C_API const char* kiln_job_file(const kiln_job_result* result, size_t index);
/// Returns a warning; those that are consequences of other warnings are left out. Null beyond the
/// last.
KILN_C_API const char* kiln_job_warning(const kiln_job_result* result, size_t index);
/// Returns the limit that the result exceeds (max_missed, faces, max_error), for which the command exits
/// with 1; null if it exceeds none.
KILN_C_API const char* kiln_job_failure(const kiln_job_result* result);
/// Returns the report as JSON, as the command's --json writes it.
KILN_C_API const char* kiln_job_report(const kiln_job_result* result);
/// Returns the GLB of a job whose results are in memory; null if the job made none.
/// \param size  out: number of bytes; may be null
KILN_C_API const void* kiln_job_glb(const kiln_job_result* result, size_t* size);
/// Sets the field `size`, and all other fields to 0.
KILN_C_API void kiln_job_image_init(kiln_job_image* image);
/// Returns a map of a job whose results are in memory, and which made no GLB.
/// \param image  in: its field `size`; out: all other fields
KILN_C_API kiln_status kiln_job_map(const kiln_job_result* result, size_t index,
                                    kiln_job_image* image);
/// Returns a copy of the low poly.
/// \param low  out
KILN_C_API kiln_status kiln_job_low(const kiln_job_result* result, kiln_mesh** low);

#ifdef __cplusplus
}
#endif

#endif
