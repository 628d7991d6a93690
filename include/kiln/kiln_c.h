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
#define KILN_C_API __attribute__((visibility("default")))  ///< Exported by a shared library
#else
#define KILN_C_API  ///< Exported by a shared library
#endif

#ifdef __cplusplus
extern "C" {
#endif

/// Result of a call: the command line's exit codes.
typedef int32_t kiln_status;
#define KILN_OK 0           ///< Success
#define KILN_INTERNAL 1     ///< A defect of Kiln, or out of memory
#define KILN_USAGE 2        ///< A parameter is out of range, or null where that is not allowed
#define KILN_INPUT 3        ///< A file or a mesh cannot be used
#define KILN_DEVICE 4       ///< No OpenCL device, or a device call failed
#define KILN_OUTPUT 5       ///< A result could not be written
#define KILN_CANCELLED 130  ///< The callback cancelled

/// Message of this thread's last failed call: one or two sentences for users. Never null; valid until the thread's next
/// failure.
KILN_C_API const char* kiln_error_message(void);
/// Identifier of the same error for programs, such as "mesh-index", else the kind, such as "usage". Never
/// null.
KILN_C_API const char* kiln_error_code(void);
/// Warnings, one sentence each, of this thread's last successful kiln_mesh_new(), kiln_mesh_load(), kiln_simplify(),
/// kiln_unwrap() or kiln_source_new(). Null beyond the last; valid until the next of these calls. For bakes:
/// kiln_bake_warning().
KILN_C_API const char* kiln_warning(size_t index);
/// "MAJOR.MINOR.PATCH" of the library.
KILN_C_API const char* kiln_c_version(void);

/// Called about ten times a second on the thread that called Kiln. It must not throw.
/// \param done  share done, 0 to 1  \param stage  name of the current step; valid during the callback
/// \param user  as given  \returns 0 to cancel the call, which then returns KILN_CANCELLED within
///              0.3 s
typedef int32_t (*kiln_progress)(double done, const char* stage, void* user);

/* ---- meshes ---- */

/// A triangle mesh.
typedef struct kiln_mesh kiln_mesh;

/// Elements in the caller's memory, at a constant stride.
typedef struct kiln_span {
  const void* data;  ///< The first element; null: empty
  size_t count;      ///< Number of elements
  /// Bytes from one element to the next, at least an element's size; 0: contiguous
  size_t stride;
} kiln_span;

/// A mesh in the caller's memory, as renderers keep it: one list of vertices and indices into it.
typedef struct kiln_mesh_view {
  size_t size;          ///< sizeof this struct
  kiln_span positions;  ///< Three floats per vertex
  const uint32_t*
      /// Three per triangle, counter-clockwise from outside; null: vertices in their order
      indices;
  size_t index_count;  ///< A multiple of 3
  kiln_span normals;   ///< Three floats per vertex, or none
  kiln_span uvs;       ///< Two floats per vertex, or none; origin at the lower left
  /// Four floats per vertex, or none: direction along u, and the bitangent's sign
  kiln_span tangents;
  kiln_span colors;  ///< Four bytes per vertex, or none: RGBA, sRGB-encoded
  double origin[3];  ///< Origin of the positions
  int32_t flip_v;    ///< Not 0: UVs have their origin at the upper left
  int32_t reserved;  ///< 0
  const char* name;  ///< For messages; null: "mesh"
} kiln_mesh_view;

/// Read access to a mesh's arrays, valid as long as the mesh. Corners have separate indices into UVs and
/// normals.
typedef struct kiln_mesh_arrays {
  size_t size;                       ///< sizeof this struct, set by the caller
  const float* positions;            ///< Three per vertex
  size_t vertex_count;               ///< Number of vertices
  const uint32_t* triangles;         ///< Three vertex indices per triangle
  size_t triangle_count;             ///< Number of triangles
  const float* uvs;                  ///< Two per UV, or null
  size_t uv_count;                   ///< Number of UVs
  const uint32_t* uv_triangles;      ///< Three UV indices per triangle, or null
  const float* normals;              ///< Three per normal, or null
  size_t normal_count;               ///< Number of normals
  const uint32_t* normal_triangles;  ///< Three normal indices per triangle, or null
  const uint8_t* colors;             ///< Four bytes per vertex, or null
  double origin[3];                  ///< Origin of the positions
} kiln_mesh_arrays;

/// Sets the size, and all other fields to 0.
KILN_C_API void kiln_mesh_view_init(kiln_mesh_view* view);
/// Copies the view's data. \param mesh  out
KILN_C_API kiln_status kiln_mesh_new(const kiln_mesh_view* view, kiln_mesh** mesh);
/// Reads a file: PLY, OBJ, STL, OFF, glTF and others. \param path  UTF-8  \param mesh  out
KILN_C_API kiln_status kiln_mesh_load(const char* path, kiln_mesh** mesh);
/// Writes a Wavefront OBJ, whole or not at all. \param path  UTF-8; must not be a file that the mesh was read from
KILN_C_API kiln_status kiln_mesh_save_obj(const kiln_mesh* mesh, const char* path);
/// Sets the size, and all other fields to 0.
KILN_C_API void kiln_mesh_arrays_init(kiln_mesh_arrays* arrays);
/// Returns pointers to a mesh's arrays. \param arrays  in: its size; out: all other fields
KILN_C_API kiln_status kiln_mesh_read(const kiln_mesh* mesh, kiln_mesh_arrays* arrays);
/// Computes the normals of a high poly. \param angle  edges that turn by this many degrees or more are hard, up to 180;
/// 0: automatic, for meshes without normals, as kiln_simplify() and kiln_source_new() do (shade_high() in
/// kiln/normals.h)
KILN_C_API kiln_status kiln_mesh_shade(kiln_mesh* mesh, double angle);
/// Frees a mesh.
KILN_C_API void kiln_mesh_free(kiln_mesh* mesh);

/* ---- low polys ---- */

/// Options of kiln_simplify().
typedef struct kiln_simplify_options {
  size_t size;       ///< sizeof this struct
  uint32_t faces;    ///< Target number of triangles; 0: as few as max_error allows
  int32_t keep_uvs;  ///< Not 0: preserve UVs, groups, materials and their borders
  /// With faces 0: largest deviation of the surface, as a share of the diagonal
  double max_error;
  int32_t keep_parts;      ///< Not 0: keep parts however small
  int32_t hull;            ///< Not 0: the result encloses the mesh
  kiln_progress progress;  ///< Null: none
  void* user;              ///< Passed to progress
} kiln_simplify_options;

/// Options of kiln_unwrap().
typedef struct kiln_unwrap_options {
  size_t size;             ///< sizeof this struct
  uint32_t map_size;       ///< Side of the map, texels
  uint32_t border_texels;  ///< Padding between charts, texels
  uint32_t pairs;          ///< Not 0: triangles in pairs instead of few large charts
  uint32_t reserved;       ///< 0
  kiln_progress progress;  ///< Null: none
  void* user;              ///< Passed to progress
} kiln_unwrap_options;

/// Sets the size and all defaults.
KILN_C_API void kiln_simplify_options_init(kiln_simplify_options* options);
/// Decimates. \param options  null: defaults  \param low  out, with UVs only if keep_uvs is set
KILN_C_API kiln_status kiln_simplify(const kiln_mesh* high, const kiln_simplify_options* options,
                                     kiln_mesh** low);
/// Sets the size and all defaults.
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
  size_t size;           ///< sizeof this struct
  uint32_t width;        ///< Texels, 1 to 16384
  uint32_t height;       ///< Texels, 1 to 16384
  uint32_t samples;      ///< N x N samples per texel, 1 to 16
  int32_t gutter;        ///< Padding, texels; -1: the whole map
  const char* maps;      ///< Names of maps, separated by commas; null: "normal"
  const char* match;     ///< Name of the match; null: "ray"
  const char* fallback;  ///< Matches for samples that it misses, separated by commas; null: none
  /// Search distance; 0: the default, or the deviation that kiln_simplify() measured
  double max_distance;
  double cage;  ///< Cast rays from this far outside, inward; 0: off
  /// Not 0: max_distance, cage and ao_distance are shares of the diagonal, else world units
  int32_t relative;
  int32_t two_sided;       ///< Not 0: also hit back faces
  int32_t flip_y;          ///< Not 0: green down (DirectX)
  int32_t object_space;    ///< Not 0: normals in object space, else in tangent space
  uint32_t ao_rays;        ///< Rays per sample, 1 to 4096
  uint32_t reserved;       ///< 0
  double ao_distance;      ///< Largest distance of occluders; 0: unlimited
  kiln_progress progress;  ///< Null: none
  void* user;              ///< Passed to progress
} kiln_bake_options;

/// A map, valid as long as its bake: rows from the top (row 0 is at v = 1), channels interleaved.
typedef struct kiln_map {
  size_t size;          ///< sizeof this struct, set by the caller
  const char* name;     ///< Name, such as "normal"
  uint32_t width;       ///< Texels
  uint32_t height;      ///< Texels
  uint32_t channels;    ///< 1 to 4
  uint32_t reserved;    ///< 0
  const float* pixels;  ///< width * height * channels; unit vectors as n/2 + 1/2
} kiln_map;

/// Report of a bake.
typedef struct kiln_report {
  size_t size;               ///< sizeof this struct, set by the caller
  uint64_t texels;           ///< Texels that the low poly covers
  uint64_t samples;          ///< Samples that the low poly covers
  uint64_t missed;           ///< Samples without a matched point
  double max_distance;       ///< Search distance in effect, world units
  double mean_abs_distance;  ///< Mean |distance| of the samples that hit, world units
  uint64_t warnings;         ///< Number of warnings, see kiln_bake_warning()
} kiln_report;

/// Uploads a high poly to a device. \param device  index or part of its name; null: the first GPU, else the first
/// CPU
/// \param progress  null: none  \param user  passed to it  \param source  out; it copies what it needs of the mesh
KILN_C_API kiln_status kiln_source_new(const char* device, const kiln_mesh* high,
                                       kiln_progress progress, void* user, kiln_source** source);
/// Frees a source. Its bakes remain valid.
KILN_C_API void kiln_source_free(kiln_source* source);
/// Sets the size and all defaults, those of `kiln bake --help`.
KILN_C_API void kiln_bake_options_init(kiln_bake_options* options);
/// Bakes. Returns KILN_INPUT also if no texel has a matched point ("many-misses"), or if none is covered
/// ("no-texels").
/// \param low  with UVs  \param options  null: defaults  \param bake  out
KILN_C_API kiln_status kiln_bake_new(const kiln_source* source, const kiln_mesh* low,
                                     const kiln_bake_options* options, kiln_bake** bake);
/// Number of maps, which are in the requested order.
KILN_C_API size_t kiln_bake_map_count(const kiln_bake* bake);
/// Sets the size, and all other fields to 0.
KILN_C_API void kiln_map_init(kiln_map* map);
/// Returns a map. \param index  from 0  \param map  in: its size; out: all other fields
KILN_C_API kiln_status kiln_bake_map(const kiln_bake* bake, size_t index, kiln_map* map);
/// One value of TexelState per texel: 0 empty, 1 baked, 2 missed, 3 padding. Valid as long as the
/// bake.
KILN_C_API const uint8_t* kiln_bake_coverage(const kiln_bake* bake);
/// Sets the size, and all other fields to 0.
KILN_C_API void kiln_report_init(kiln_report* report);
/// Returns the bake's report. \param report  in: its size; out: all other fields
KILN_C_API kiln_status kiln_bake_report(const kiln_bake* bake, kiln_report* report);
/// A warning's sentence; null beyond the last. Valid as long as the bake.
KILN_C_API const char* kiln_bake_warning(const kiln_bake* bake, size_t index);
/// Frees a bake.
KILN_C_API void kiln_bake_free(kiln_bake* bake);

/// Writes a map without encoding: PNG (.png, 16 bits, values clamped to [0, 1]) or EXR (.exr, half). Whole or not
/// at all.
/// \param path  UTF-8
KILN_C_API kiln_status kiln_map_save(const kiln_map* map, const char* path);

/// Writes a low poly as binary glTF 2.0, with the bake's maps normal, ao, color and opacity. Whole or not at all.
/// \param low  as it was baked  \param bake  null: no maps  \param path  UTF-8; must not be a file that was read
KILN_C_API kiln_status kiln_glb_save(const kiln_mesh* low, const kiln_bake* bake, const char* path);

/* ---- jobs: what `kiln bake` does, in one call ---- */

/// All settings of a bake: see kiln/job.h. Options are named as the command's flags: `kiln bake --help`.
typedef struct kiln_job kiln_job;
/// The result of a job.
typedef struct kiln_job_result kiln_job_result;

/// A map that a job returned in memory, valid as long as the result.
typedef struct kiln_job_image {
  size_t size;          ///< sizeof this struct
  const char* name;     ///< Name, such as "normal"
  const char* set;      ///< Texture set; empty if there is only one
  const char* tile;     ///< UDIM tile; empty: none
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
/// \param option  as a flag's name, or a member of kiln::Job  \param value  as the flag accepts it, UTF-8
KILN_C_API kiln_status kiln_job_set(kiln_job* job, const char* option, const char* value);
/// Adds a value to an option that accepts several.
KILN_C_API kiln_status kiln_job_add(kiln_job* job, const char* option, const char* value);
/// Sets all options from JSON: see kiln::job_from_json().
KILN_C_API kiln_status kiln_job_set_json(kiln_job* job, const char* json);
/// Copies a mesh as the high poly. \param name  for messages and names of files; null: "high"
KILN_C_API kiln_status kiln_job_set_high(kiln_job* job, const kiln_mesh* mesh, const char* name);
/// Copies a mesh as the low poly. \param name  likewise; null: "low"
KILN_C_API kiln_status kiln_job_set_low(kiln_job* job, const kiln_mesh* mesh, const char* name);
/// Sets whether results stay in memory, without files: kiln_job_glb(), kiln_job_map().
KILN_C_API kiln_status kiln_job_set_in_memory(kiln_job* job, int32_t in_memory);
/// Runs a job. \param device  as for kiln_source_new(); null: the job's own  \param progress  null:
/// none
/// \param result  out
KILN_C_API kiln_status kiln_job_run(const kiln_job* job, const char* device, kiln_progress progress,
                                    void* user, kiln_job_result** result);
/// Frees a result.
KILN_C_API void kiln_job_result_free(kiln_job_result* result);
/// Path of a written file, UTF-8; null beyond the last.
KILN_C_API const char* kiln_job_file(const kiln_job_result* result, size_t index);
/// A warning that is not a consequence of another one; null beyond the last.
KILN_C_API const char* kiln_job_warning(const kiln_job_result* result, size_t index);
/// The limit that the result exceeds (max_missed, faces, max_error), for which the command exits with 1;
/// null: none.
KILN_C_API const char* kiln_job_failure(const kiln_job_result* result);
/// The report as JSON, as written by --json.
KILN_C_API const char* kiln_job_report(const kiln_job_result* result);
/// The GLB of a job in memory; null if the job made none. \param size  out: bytes; may be null
KILN_C_API const void* kiln_job_glb(const kiln_job_result* result, size_t* size);
/// Sets the size, and all other fields to 0.
KILN_C_API void kiln_job_image_init(kiln_job_image* image);
/// A map of a job in memory without a GLB. \param image  in: its size; out: all other fields
KILN_C_API kiln_status kiln_job_map(const kiln_job_result* result, size_t index,
                                    kiln_job_image* image);
/// Copies the low poly. \param low  out
KILN_C_API kiln_status kiln_job_low(const kiln_job_result* result, kiln_mesh** low);

#ifdef __cplusplus
}
#endif

#endif
