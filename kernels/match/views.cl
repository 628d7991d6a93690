// Views: matching samples of the low poly by depth views of the high poly.
//
// Wang, Froehlich, Goebel, "Fast Normal Map Generation for Simplified Meshes", section 2: each sample is
// projected into each view, and the view with the nearest depth decides (or, section 6, the one closest to
// the normal). The key gives the triangle (an item buffer); the point is the exact intersection of that
// triangle, or a triangle of one of the 4 surrounding pixels, with the line through the sample along the
// view's direction. A view without such a point on a face turned towards the sample is skipped, and the
// next best one decides. So the result is the best of all views, independent of batches.
//
// kernel            global   local  memory traffic an item
// kiln_views_match  samples  64     reads 24 B + 8 B a view (gathered) + triangles; writes 21 B if better
// kiln_views_probe  samples  64     reads 24 B + 8 B a view (gathered); writes 4 B a view
//
// Strengths: no BVH; a sample costs one projection per view. Limits: samples that no view sees stay
// undecided; up to 64 views per launch.
#include "accel/keys.clh"
#include "lib/vector3.clh"
#include "shared/match.h"
#include "shared/views.h"

typedef struct {
  float3 position, direction;
} views_sample;

static inline views_sample views_load(global const float* points, size_t i, size_t plane) {
  const views_sample sample = {
      (float3)(points[i], points[i + plane], points[i + 2 * plane]),
      (float3)(points[i + 3 * plane], points[i + 4 * plane], points[i + 5 * plane])};
  return sample;
}

/// A line through the sample, represented by two directions perpendicular to the line.
typedef struct {
  float3 right, up;
} views_line;

static inline views_line views_make_line_of_view(global const kiln_view* view) {
  const views_line line = {vload3(0, view->right), vload3(0, view->up)};
  return line;
}

/// Two directions perpendicular to a unit vector (Duff et al. 2017, "Building an orthonormal basis,
/// revisited").
static inline views_line views_make_line_of_direction(float3 d) {
#pragma OPENCL FP_CONTRACT OFF
  const float side = d.z < 0.0f ? -1.0f : 1.0f;
  const float p = -1.0f / (side + d.z);
  const float q = d.x * d.y * p;
  const views_line line = {(float3)(1.0f + side * d.x * d.x * p, side * q, -side * d.x),
                           (float3)(q, side + d.y * d.y * p, -d.y)};
  return line;
}

typedef struct {
  uint triangle;
  float u, v;
  float3 offset;  // from the sample to the point
  float line_distance_squared;   // 0 if the line intersects the triangle
} views_point;

/// Projects a point to a pixel of a view. Returns false if it is outside the picture.
static inline bool views_project_point(global const kiln_view* view, float3 point, float* x, float* y) {
#pragma OPENCL FP_CONTRACT OFF
  *x = dot3(vload3(0, view->right), point) * view->scale + view->left;
  *y = view->top - dot3(vload3(0, view->up), point) * view->scale;
  return *x >= 0.0f && *y >= 0.0f && *x < (float)view->width && *y < (float)view->height;
}

/// Intersects a line through the sample with one triangle, or finds the triangle's nearest point to the
/// line. Returns false if the face is turned away from the sample's direction, or seen edge-on.
static inline bool views_intersect(const views_line* line, const views_sample* sample, uint triangle,
                                   bool two_sided, global const uint* restrict triangles,
                                   global const float* restrict positions, views_point* out) {
#pragma OPENCL FP_CONTRACT OFF
  const uint3 index = vload3(triangle, triangles);
  const float3 a = vload3(index.x, positions) - sample->position;
  const float3 b = vload3(index.y, positions) - sample->position;
  const float3 c = vload3(index.z, positions) - sample->position;
  const float3 normal = cross3(b - a, c - a);
  if (!two_sided && !(dot3(normal, sample->direction) >= 0.0f)) return false;
  const float3 right = line->right;
  const float3 up = line->up;
  const float ax = dot3(right, a), ay = dot3(up, a);
  const float bx = dot3(right, b), by = dot3(up, b);
  const float cx = dot3(right, c), cy = dot3(up, c);
  const float weight_a = bx * cy - by * cx;
  const float weight_b = cx * ay - cy * ax;
  const float weight_c = ax * by - ay * bx;
  const float area = (weight_a + weight_b) + weight_c;
  if (!(fabs(area) > 0.0f)) return false;
  // The line passes outside the triangle: the triangle's point nearest to the line is used.
  const float u = weight_b / area;
  const float v = weight_c / area;
  out->triangle = triangle;
  out->u = clamp(u, 0.0f, 1.0f);
  out->v = clamp(v, 0.0f, 1.0f - out->u);
  const bool inside = out->u == u && out->v == v;
  out->offset = (a * (1.0f - out->u - out->v) + b * out->u) + c * out->v;
  const float x = dot3(right, out->offset);
  const float y = dot3(up, out->offset);
  out->line_distance_squared = inside ? 0.0f : x * x + y * y;
  return isfinite(out->u) && isfinite(out->v);
}

/// Finds the best point among the triangles of the 4 pixels whose centres surround (x, y). The triangle
/// of the pixel that holds (x, y) takes precedence if the line intersects it.
static inline bool views_find_best(global const kiln_view* view, const views_line* line,
                                   const views_sample* sample, float x, float y, float max_distance,
                                   global const ulong* restrict keys, global const uchar* restrict drawn,
                                   global const uint* restrict triangles,
                                   global const float* restrict positions, views_point* best) {
#pragma OPENCL FP_CONTRACT OFF
  const int x0 = (int)floor(x - 0.5f);
  const int y0 = (int)floor(y - 0.5f);
  const bool two_sided = (view->flags & KILN_RASTER_TWO_SIDED) != 0;
  const float3 toward = vload3(0, view->toward);
  const int nearest_pixel = (((int)y - y0) << 1 | ((int)x - x0)) & 3;
  uint tried_triangles[4];
  bool found = false;
  float best_near = 0.0f;
  for (int step = 0; step < 4; ++step) {
    const int k = step ^ nearest_pixel;
    const int column = clamp(x0 + (k & 1), 0, (int)view->width - 1);
    const int row = clamp(y0 + (k >> 1), 0, (int)view->height - 1);
    const uint triangle =
        (uint)keys_at(keys, drawn, keys_index(view->first, view->width, (uint)column, (uint)row));
    tried_triangles[step] = triangle;
    bool is_repeated = triangle == KILN_NO_TRIANGLE;
    for (int i = 0; i < step; ++i) is_repeated |= tried_triangles[i] == triangle;
    views_point point;
    if (is_repeated || !views_intersect(line, sample, triangle, two_sided, triangles, positions, &point))
      continue;
    if (!(dot3(point.offset, point.offset) <= max_distance * max_distance)) continue;
    const float near = dot3(toward, point.offset);
    // The smaller distance from the line wins, then the smaller distance to the viewer, then the lower
    // triangle.
    const bool is_better = !found || point.line_distance_squared < best->line_distance_squared ||
                        (point.line_distance_squared == best->line_distance_squared &&
                         (near > best_near || (near == best_near && triangle < best->triangle)));
    if (is_better) {
      *best = point;
      best_near = near;
      found = true;
    }
    if (step == 0 && found && best->line_distance_squared == 0.0f) return true;
  }
  return found;
}

/// Searches the point on the line along the sample's own direction, iteratively: a point of that line is projected into
/// the view, and the line is intersected with the triangles of the surrounding pixels, which gives the next point (as
/// relief mapping searches a depth image; Policarpo, Oliveira, Comba 2005). A picture shows only some of the triangles
/// that are smaller than a pixel. So if the line intersects none of the triangles, the point nearest to the line is
/// used if it lies within a pixel of it. Returns false if there is no such point.
/// \param along  distance along the line at which the search begins
static inline bool views_refine(global const kiln_view* view, const views_sample* sample,
                                float along, float max_distance, global const ulong* restrict keys,
                                global const uchar* restrict drawn,
                                global const uint* restrict triangles,
                                global const float* restrict positions, views_point* point) {
#pragma OPENCL FP_CONTRACT OFF
  const views_line line = views_make_line_of_direction(sample->direction);
  float min_distance_squared = 1.0f / (view->scale * view->scale);
  bool found = false;
  for (int round = 0; round < 5; ++round) {
    const float3 target = sample->position + sample->direction * along;
    float x, y;
    if (!views_project_point(view, target, &x, &y)) break;
    views_point next;
    if (!views_find_best(view, &line, sample, x, y, max_distance, keys, drawn, triangles, positions,
                         &next))
      break;
    if (next.line_distance_squared < min_distance_squared) {
      *point = next;
      min_distance_squared = next.line_distance_squared;
      found = true;
    }
    if (next.line_distance_squared == 0.0f) break;
    along = dot3(next.offset, sample->direction);
  }
  return found;
}

/// Projects a sample to a pixel of a view. Returns false if it is outside the picture, or the view
/// sees it at too flat an angle.
static inline bool views_project_sample(global const kiln_view* view, const views_sample* sample,
                                        float cosine, const kiln_views_params* params, float* x,
                                        float* y) {
#pragma OPENCL FP_CONTRACT OFF
  if (!(cosine >= params->least_cosine)) return false;
  return views_project_point(view, sample->position, x, y);
}

/// Computes the depth of a sample minus the depth of its pixel; infinite for an empty pixel.
static inline float views_compute_depth_difference(global const kiln_view* view, const views_sample* sample,
                                                   float x, float y, global const ulong* restrict keys,
                                                   global const uchar* restrict drawn) {
#pragma OPENCL FP_CONTRACT OFF
  const ulong key = keys_at(keys, drawn, keys_index(view->first, view->width, (uint)x, (uint)y));
  if (key == KILN_RASTER_EMPTY) return INFINITY;
  const float depth = KILN_RASTER_FAR - dot3(vload3(0, view->toward), sample->position);
  return depth - as_float((uint)(key >> 32));
}

/// \param ids  index in the mesh of each triangle to which keys refer; null: its own
/// \param score  best score of each sample so far, smaller is better; updated if a view is better
kernel void kiln_views_match(const kiln_views_params params, global const kiln_view* restrict views,
                             global const ulong* restrict keys, global const uchar* restrict drawn,
                             global const uint* restrict triangles,
                             global const float* restrict positions, global const uint* restrict ids,
                             global const float* restrict points, global float* restrict score,
                             global uint* restrict hit_triangle,
                             global float* restrict hit_barycentric,
                             global float* restrict hit_distance,
                             global uchar* restrict hit_status) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const views_sample sample = views_load(points, i, params.capacity);
  ulong excluded_views = 0;
  for (;;) {
    float best_score = score[i];
    uint chosen_view = params.view_count;
    float chosen_x = 0.0f;
    float chosen_y = 0.0f;
    float chosen_along = 0.0f;
    views_point point;
    for (uint k = 0; k < params.view_count; ++k) {
      if ((excluded_views >> k & 1) != 0) continue;
      global const kiln_view* view = views + k;
      const float cosine = dot3(vload3(0, view->toward), sample.direction);
      if (params.criterion == KILN_VIEWS_ANGLE && !(-cosine < best_score)) continue;
      float x, y;
      if (!views_project_sample(view, &sample, cosine, &params, &x, &y)) continue;
      const float signed_difference = views_compute_depth_difference(view, &sample, x, y, keys, drawn);
      const float difference = fabs(signed_difference);
      if (!(difference <= params.max_distance)) continue;
      float along = cosine * signed_difference;
      float value = params.criterion == KILN_VIEWS_ANGLE ? -cosine : difference;
      if (params.criterion == KILN_VIEWS_DISTANCE) {
        views_point line_point;
        const views_line line = views_make_line_of_view(view);
        if (!views_find_best(view, &line, &sample, x, y, params.max_distance, keys, drawn, triangles,
                             positions, &line_point)) {
          continue;
        }
        value = dot3(line_point.offset, line_point.offset);
        along = dot3(line_point.offset, sample.direction);
        if (value < best_score) point = line_point;
      }
      if (value < best_score) {
        best_score = value;
        chosen_view = k;
        chosen_x = x;
        chosen_y = y;
        chosen_along = along;
      }
    }
    if (chosen_view == params.view_count) return;
    bool found = params.refine != 0 &&
                 views_refine(views + chosen_view, &sample, chosen_along, params.max_distance, keys,
                              drawn, triangles, positions, &point);
    found |= params.criterion == KILN_VIEWS_DISTANCE;
    if (!found) {
      const views_line line = views_make_line_of_view(views + chosen_view);
      found = views_find_best(views + chosen_view, &line, &sample, chosen_x, chosen_y, params.max_distance,
                              keys, drawn, triangles, positions, &point);
    }
    if (found) {
      const float length = sqrt(dot3(point.offset, point.offset));
      score[i] = best_score;
      hit_triangle[i] = ids != 0 ? ids[point.triangle] : point.triangle;
      hit_barycentric[i] = point.u;
      hit_barycentric[i + params.result_capacity] = point.v;
      hit_distance[i] = dot3(point.offset, sample.direction) < 0.0f ? -length : length;
      hit_status[i] = KILN_STATUS_VIEW;
      return;
    }
    excluded_views |= (ulong)1 << chosen_view;
  }
}

/// The cosine between a sample's direction and each view's; 0 if the view does not see it.
/// \param quality  [view_count * count]
kernel void kiln_views_probe(const kiln_views_params params, global const kiln_view* restrict views,
                             global const ulong* restrict keys, global const uchar* restrict drawn,
                             global const float* restrict points, global float* restrict quality) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const views_sample sample = views_load(points, i, params.capacity);
  for (uint k = 0; k < params.view_count; ++k) {
    global const kiln_view* view = views + k;
    const float cosine = dot3(vload3(0, view->toward), sample.direction);
    float x, y;
    const bool seen =
        views_project_sample(view, &sample, cosine, &params, &x, &y) &&
        fabs(views_compute_depth_difference(view, &sample, x, y, keys, drawn)) <= params.max_distance;
    quality[(size_t)k * params.count + i] = seen ? cosine : 0.0f;
  }
}
