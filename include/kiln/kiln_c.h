/// \file
/// Kiln for C, and for all that calls C: Rust, C#, Python's ctypes. Meshes in, simplify, unwrap, bake, maps and GLBs out.
///
/// Objects are opaque: kiln_..._free() frees each, and null is allowed there. Structs begin with their size, which
/// kiln_..._init() sets with all defaults: programs that were compiled against an older header go on working with a
/// newer library. A new field comes last. A field `reserved` must be 0 ("struct-reserved").
///
/// Functions that may fail return a kiln_status. Where it is not KILN_OK, nothing was made, outputs are as they were,
/// and kiln_error_message() says of this thread what is wrong. No exception leaves a function.
///
/// Threads: as in C++. Objects do not change once they are made, so any number of threads may read one.
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

/// Outcome of a call: the command's exit codes.
typedef int32_t kiln_status;
#define KILN_OK 0           ///< Done
#define KILN_INTERNAL 1     ///< A defect of Kiln's own, or memory ran out
#define KILN_USAGE 2        ///< A parameter is out of its range, or null where it must not be
#define KILN_INPUT 3        ///< A file or a mesh cannot be used
#define KILN_DEVICE 4       ///< No OpenCL device, or a device call failed
#define KILN_OUTPUT 5       ///< A result could not be written
#define KILN_CANCELLED 130  ///< The callback said stop

/// Message of this thread's last call that failed: one or two sentences for a person. Never null; good until its next failure.
KILN_C_API const char* kiln_error_message(void);
/// The same for programs: a stable word such as "mesh-index", else the kind, such as "usage". Never null.
KILN_C_API const char* kiln_error_code(void);
/// Warnings, a sentence each, of this thread's last kiln_mesh_new(), kiln_mesh_load(),
/// kiln_simplify(), kiln_unwrap() or kiln_source_new() that was done: fewer faces than a shape needs, say. Null beyond the last;
/// good until the next of these calls. Of a bake: kiln_bake_warning().
KILN_C_API const char* kiln_warning(size_t index);
/// "MAJOR.MINOR.PATCH" of the library.
KILN_C_API const char* kiln_c_version(void);

/// Called about ten times a second on the thread that called Kiln. It must not throw.
/// \param done  share done, 0 to 1  \param stage  what is being done; good during the callback
/// \param user  as given  \returns 0 to stop the call, which then returns KILN_CANCELLED within 0.3 s
typedef int32_t (*kiln_progress)(double done, const char* stage, void* user);

/* ---- meshes ---- */

/// A triangle mesh.
typedef struct kiln_mesh kiln_mesh;

/// Elements in the caller's memory, a fixed number of bytes apart.
typedef struct kiln_span {
  const void* data;  ///< The first; null: there are none
  size_t count;      ///< Elements
  size_t stride;     ///< Bytes from one to the next, no fewer than an element has; 0: side by side
} kiln_span;

/// A mesh in the caller's memory, as renderers keep it: one list of vertices and indices into it.
typedef struct kiln_mesh_view {
  size_t size;          ///< sizeof this struct
  kiln_span positions;  ///< Three floats a vertex
  const uint32_t*
      indices;  ///< Three a triangle, counter-clockwise from outside; null: vertices in their order
  size_t index_count;  ///< A multiple of 3
  kiln_span normals;   ///< Three floats a vertex, or none
  kiln_span uvs;       ///< Two floats a vertex, or none; origin at the lower left
  kiln_span tangents;  ///< Four floats a vertex, or none: along u, and the bitangent's sign
  kiln_span colors;    ///< Four bytes a vertex, or none: RGBA, sRGB-encoded
  double origin[3];    ///< That positions are measured from
  int32_t flip_v;      ///< Not 0: UVs have their origin at the upper left
  int32_t reserved;    ///< 0
  const char* name;    ///< For messages; null: "mesh"
} kiln_mesh_view;

/// A mesh's own memory, good as long as the mesh. Corners have indices of their own into UVs and normals.
typedef struct kiln_mesh_arrays {
  size_t size;                       ///< sizeof this struct, as given
  const float* positions;            ///< Three a vertex
  size_t vertex_count;               ///< Vertices
  const uint32_t* triangles;         ///< Three a triangle: vertices
  size_t triangle_count;             ///< Triangles
  const float* uvs;                  ///< Two each, or null
  size_t uv_count;                   ///< UVs
  const uint32_t* uv_triangles;      ///< Three a triangle: UVs, or null
  const float* normals;              ///< Three each, or null
  size_t normal_count;               ///< Normals
  const uint32_t* normal_triangles;  ///< Three a triangle: normals, or null
  const uint8_t* colors;             ///< Four bytes a vertex, or null
  double origin[3];                  ///< That positions are measured from
} kiln_mesh_arrays;

/// Sets the size, and all else to 0.
KILN_C_API void kiln_mesh_view_init(kiln_mesh_view* view);
/// Copies what a view shows. \param mesh  out
KILN_C_API kiln_status kiln_mesh_new(const kiln_mesh_view* view, kiln_mesh** mesh);
/// Reads a file: PLY, OBJ, STL, OFF, glTF and others. \param path  UTF-8  \param mesh  out
KILN_C_API kiln_status kiln_mesh_load(const char* path, kiln_mesh** mesh);
/// Writes a Wavefront OBJ, whole or not at all. \param path  UTF-8; no file that the mesh was read from or made of
KILN_C_API kiln_status kiln_mesh_save_obj(const kiln_mesh* mesh, const char* path);
/// Sets the size, and all else to 0.
KILN_C_API void kiln_mesh_arrays_init(kiln_mesh_arrays* arrays);
/// Gives pointers to a mesh's numbers. \param arrays  in: its size; out: all else
KILN_C_API kiln_status kiln_mesh_read(const kiln_mesh* mesh, kiln_mesh_arrays* arrays);
/// Gives a high poly normals. \param angle  degrees from which on edges are hard, up to 180; 0: as scans and hard surfaces
/// need it, where it has none, which kiln_simplify() and kiln_source_new() do, too (shade_high() in kiln/normals.h)
KILN_C_API kiln_status kiln_mesh_shade(kiln_mesh* mesh, double angle);
/// Frees a mesh.
KILN_C_API void kiln_mesh_free(kiln_mesh* mesh);

/* ---- low polys ---- */

/// Options of kiln_simplify().
typedef struct kiln_simplify_options {
  size_t size;             ///< sizeof this struct
  uint32_t faces;          ///< Triangles; 0: as few as max_error allows
  int32_t keep_uvs;        ///< Not 0: keep UVs, groups and materials and their borders
  double max_error;        ///< With faces 0: share of the diagonal that surfaces may part by
  int32_t keep_parts;      ///< Not 0: leave out no part for its size
  int32_t hull;            ///< Not 0: the result encloses the mesh
  kiln_progress progress;  ///< Null: none
  void* user;              ///< For progress
} kiln_simplify_options;

/// Options of kiln_unwrap().
typedef struct kiln_unwrap_options {
  size_t size;             ///< sizeof this struct
  uint32_t map_size;       ///< Texels a side of the map that it is for
  uint32_t border_texels;  ///< Between charts
  uint32_t pairs;          ///< Not 0: triangles in pairs instead of few large charts
  uint32_t reserved;       ///< 0
  kiln_progress progress;  ///< Null: none
  void* user;              ///< For progress
} kiln_unwrap_options;

/// Sets the size and all defaults.
KILN_C_API void kiln_simplify_options_init(kiln_simplify_options* options);
/// Decimates. \param options  null: defaults  \param low  out, without UVs but with keep_uvs
KILN_C_API kiln_status kiln_simplify(const kiln_mesh* high, const kiln_simplify_options* options,
                                     kiln_mesh** low);
/// Sets the size and all defaults.
KILN_C_API void kiln_unwrap_options_init(kiln_unwrap_options* options);
/// Gives a mesh new UVs. \param options  null: defaults  \param unwrapped  out
KILN_C_API kiln_status kiln_unwrap(const kiln_mesh* mesh, const kiln_unwrap_options* options,
                                   kiln_mesh** unwrapped);

/* ---- baking ---- */

/// A high poly on the device: made once, baked from many times.
typedef struct kiln_source kiln_source;
/// The maps of a bake.
typedef struct kiln_bake kiln_bake;

/// Options of a bake: maps, and the search for points.
typedef struct kiln_bake_options {
  size_t size;           ///< sizeof this struct
  uint32_t width;        ///< Texels, 1 to 16384
  uint32_t height;       ///< Texels, 1 to 16384
  uint32_t samples;      ///< N x N a texel, 1 to 16
  int32_t gutter;        ///< Texels filled around charts; -1: everywhere
  const char* maps;      ///< Names, separated by commas; null: "normal"
  const char* match;     ///< Name; null: "ray"
  const char* fallback;  ///< Matches for what that misses, separated by commas; null: none
  double
      max_distance;  ///< Length of the search; 0: the default, or as far as kiln_simplify() strayed
  double cage;       ///< Cast from so far outside, inward; 0: none
  int32_t
      relative;  ///< Not 0: max_distance, cage and ao_distance are shares of the diagonal, else world units
  int32_t two_sided;       ///< Not 0: also hit back faces
  int32_t flip_y;          ///< Not 0: green down (DirectX)
  int32_t object_space;    ///< Not 0: normals in object space, else in tangent space
  uint32_t ao_rays;        ///< A sample, 1 to 4096
  uint32_t reserved;       ///< 0
  double ao_distance;      ///< Distance within which something darkens; 0: any
  kiln_progress progress;  ///< Null: none
  void* user;              ///< For progress
} kiln_bake_options;

/// One map, good as long as its bake: rows from the top (row 0 is at v = 1), channels interleaved.
typedef struct kiln_map {
  size_t size;          ///< sizeof this struct, as given
  const char* name;     ///< Such as "normal"
  uint32_t width;       ///< Texels
  uint32_t height;      ///< Texels
  uint32_t channels;    ///< 1 to 4
  uint32_t reserved;    ///< 0
  const float* pixels;  ///< width * height * channels; unit vectors as n/2 + 1/2
} kiln_map;

/// Report of a bake.
typedef struct kiln_report {
  size_t size;               ///< sizeof this struct, as given
  uint64_t texels;           ///< Covered by the low poly
  uint64_t samples;          ///< Covered by the low poly
  uint64_t missed;           ///< Samples without a point
  double max_distance;       ///< As used, world units
  double mean_abs_distance;  ///< Mean |distance| of the samples that hit, world units
  uint64_t warnings;         ///< See kiln_bake_warning()
} kiln_report;

/// Puts a high poly on a device. \param device  index or part of its name; null: the first GPU, else the first CPU
/// \param progress  null: none  \param user  for it  \param source  out; it keeps what it needs of the mesh
KILN_C_API kiln_status kiln_source_new(const char* device, const kiln_mesh* high,
                                       kiln_progress progress, void* user, kiln_source** source);
/// Frees a source. Bakes of it stay.
KILN_C_API void kiln_source_free(kiln_source* source);
/// Sets the size and all defaults, those of `kiln bake --help`.
KILN_C_API void kiln_bake_options_init(kiln_bake_options* options);
/// Bakes. KILN_INPUT also where nothing was found for any texel ("many-misses"), or none is covered ("no-texels").
/// \param low  with UVs  \param options  null: defaults  \param bake  out
KILN_C_API kiln_status kiln_bake_new(const kiln_source* source, const kiln_mesh* low,
                                     const kiln_bake_options* options, kiln_bake** bake);
/// Number of maps, which are in the order asked for.
KILN_C_API size_t kiln_bake_map_count(const kiln_bake* bake);
/// Sets the size, and all else to 0.
KILN_C_API void kiln_map_init(kiln_map* map);
/// One of them. \param index  from 0  \param map  in: its size; out: all else
KILN_C_API kiln_status kiln_bake_map(const kiln_bake* bake, size_t index, kiln_map* map);
/// One value of TexelState a texel: 0 empty, 1 baked, 2 missed, 3 padding. Good as long as the bake.
KILN_C_API const uint8_t* kiln_bake_coverage(const kiln_bake* bake);
/// Sets the size, and all else to 0.
KILN_C_API void kiln_report_init(kiln_report* report);
/// The bake's report. \param report  in: its size; out: all else
KILN_C_API kiln_status kiln_bake_report(const kiln_bake* bake, kiln_report* report);
/// A warning's sentence; null beyond the last. Good as long as the bake.
KILN_C_API const char* kiln_bake_warning(const kiln_bake* bake, size_t index);
/// Frees a bake.
KILN_C_API void kiln_bake_free(kiln_bake* bake);

/// Writes a map as it is, values clamped to [0, 1] in PNG (whose name ends in .png: 16 bits) and kept in EXR (.exr:
/// half). Whole or not at all. \param path  UTF-8
KILN_C_API kiln_status kiln_map_save(const kiln_map* map, const char* path);

/// Writes a low poly with its maps as binary glTF 2.0, which engines open: of the bake normal, ao, color and opacity.
/// Whole or not at all. \param low  as it was baked  \param bake  null: no maps  \param path  UTF-8; no file that was read
/// for them
KILN_C_API kiln_status kiln_glb_save(const kiln_mesh* low, const kiln_bake* bake, const char* path);

/* ---- jobs: what `kiln bake` does, in one call ---- */

/// All that a bake is told: see kiln/job.h. Options have the names of the command's flags: `kiln bake --help`.
typedef struct kiln_job kiln_job;
/// What a job came to.
typedef struct kiln_job_result kiln_job_result;

/// A map of a job in memory, good as long as the result.
typedef struct kiln_job_image {
  size_t size;        ///< sizeof this struct
  const char* name;   ///< "normal"
  const char* set;    ///< The texture set; empty: there is but one
  const char* tile;   ///< The UDIM tile; empty: none
  uint32_t width;     ///< Texels
  uint32_t height;    ///< Texels
  uint32_t channels;  ///< Channels
  const float*
      pixels;  ///< Row by row from the top, as files hold them: in [0, 1], colours sRGB-encoded
} kiln_job_image;

/// A job that was told nothing. \param job  out
KILN_C_API kiln_status kiln_job_new(kiln_job** job);
/// Frees a job.
KILN_C_API void kiln_job_free(kiln_job* job);
/// Sets an option, in place of what it was: "high", "low", "out", "faces", "maps", "match.max_distance"...
/// \param option  as a flag's name, or a member of kiln::Job  \param value  as the flag takes it, UTF-8
KILN_C_API kiln_status kiln_job_set(kiln_job* job, const char* option, const char* value);
/// Adds a value to an option that takes several.
KILN_C_API kiln_status kiln_job_add(kiln_job* job, const char* option, const char* value);
/// Sets all options from JSON: see kiln::job_from_json().
KILN_C_API kiln_status kiln_job_set_json(kiln_job* job, const char* json);
/// Takes a copy of a mesh for the high poly. \param name  for messages and names of files; null: "high"
KILN_C_API kiln_status kiln_job_set_high(kiln_job* job, const kiln_mesh* mesh, const char* name);
/// Takes a copy of a mesh for the low poly. \param name  likewise; null: "low"
KILN_C_API kiln_status kiln_job_set_low(kiln_job* job, const kiln_mesh* mesh, const char* name);
/// Whether results stay in memory, and no file is written: kiln_job_glb(), kiln_job_map().
KILN_C_API kiln_status kiln_job_set_in_memory(kiln_job* job, int32_t in_memory);
/// Runs a job. \param device  as of kiln_source_new(); null: the job's own  \param progress  null: none
/// \param result  out
KILN_C_API kiln_status kiln_job_run(const kiln_job* job, const char* device, kiln_progress progress,
                                    void* user, kiln_job_result** result);
/// Frees a result.
KILN_C_API void kiln_job_result_free(kiln_job_result* result);
/// Files that were written, UTF-8; null beyond the last.
KILN_C_API const char* kiln_job_file(const kiln_job_result* result, size_t index);
/// Warnings that follow from no other one; null beyond the last.
KILN_C_API const char* kiln_job_warning(const kiln_job_result* result, size_t index);
/// Which limit the result misses (max_missed, faces, max_error), where the command exits with 1; null: none.
KILN_C_API const char* kiln_job_failure(const kiln_job_result* result);
/// The report, JSON as --json writes it.
KILN_C_API const char* kiln_job_report(const kiln_job_result* result);
/// The GLB of a job in memory; null: it made none. \param size  out: bytes; may be null
KILN_C_API const void* kiln_job_glb(const kiln_job_result* result, size_t* size);
/// Sets the size, and all else to 0.
KILN_C_API void kiln_job_image_init(kiln_job_image* image);
/// A map of a job in memory without a GLB. \param image  in: its size; out: all else
KILN_C_API kiln_status kiln_job_map(const kiln_job_result* result, size_t index,
                                    kiln_job_image* image);
/// A copy of the low poly. \param low  out
KILN_C_API kiln_status kiln_job_low(const kiln_job_result* result, kiln_mesh** low);

#ifdef __cplusplus
}
#endif

#endif
