#include "simplify/simplify_input.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "base/counted.h"
#include "base/parallel.h"
#include "mesh/box.h"
#include "mesh/charts.h"
#include "mesh/normals.h"
#include "mesh/triangle_shape.h"
#include "mesh/two_sided.h"
#include "mesh/uv_grid.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Number of removed triangles for each reason, and the first triangle of each.
struct RemovedTriangles {
  std::uint64_t count = 0;
  std::size_t first = 0;
  void add(std::size_t triangle) {
    if (count++ == 0) first = triangle;
  }
  void report(const char* code, const char* one, const char* many,
              std::vector<Warning>& warnings) const {
    if (count == 0) return;
    const std::string where = " (the first is " + std::to_string(first) + ")";
    warnings.push_back(
        {code,
         count == 1 ? "1 triangle " + (one + where) + "; it was left out"
                    : counted(count, "triangle") + " " + many + where + "; they were left out",
         count});
  }
};

enum class TriangleState : std::uint8_t { usable, not_finite, degenerate };

constexpr std::size_t kTrianglesPerTask = std::size_t{1} << 15;

/// Which triangles have the same vertices as an earlier triangle.
struct RepeatedTriangles {
  /// 1 for each triangle that repeats an earlier one; empty if none does
  std::vector<std::uint8_t> is_duplicate;
  bool has_opposed = false;  ///< True if a repeated triangle has the opposite orientation
};

/// \param triangles  triangles whose corners start with the lowest vertex
RepeatedTriangles find_repeats(const std::vector<Triangle>& triangles, std::size_t vertices) {
  const VertexLists triangles_by_vertex(
      vertices, triangles.size(), [&](std::size_t i) { return triangles[i][0]; },
      [&](std::size_t i) { return std::uint64_t{triangles[i][1]} << 32 | triangles[i][2]; });
  RepeatedTriangles found{std::vector<std::uint8_t>(triangles.size(), 0)};
  std::atomic<bool> any_opposed = false, any_duplicate = false;
  const auto is_below = [](const VertexLists::Item& item, std::uint64_t key) {
    return item.key < key;
  };
  parallel_for(vertices, kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
    bool is_opposed = false, is_duplicate = false;
    for (std::size_t v = begin; v < end; ++v) {
      const std::span<const VertexLists::Item> items = triangles_by_vertex.of(v);
      for (std::size_t i = 1; i < items.size(); ++i) {
        if (items[i].key == items[i - 1].key)
          found.is_duplicate[items[i].index] = is_duplicate = true;
        if (is_opposed) continue;
        const std::uint64_t other = std::rotl(items[i].key, 32);
        if (other > items[i].key) continue;
        const auto at = std::lower_bound(items.begin(), items.begin() + i, other, is_below);
        is_opposed = at->key == other;
      }
    }
    if (is_opposed) any_opposed = true;
    if (is_duplicate) any_duplicate = true;
  });
  found.has_opposed = any_opposed;
  if (!any_duplicate) found.is_duplicate.clear();
  return found;
}

Triangle welded_corners(const Mesh& mesh, const std::vector<std::uint32_t>& welded, std::size_t t) {
  Triangle v = mesh.triangles[t];
  for (std::uint32_t& vertex : v) {
    if (vertex >= mesh.positions.size()) {
      throw Error(ErrorCode::input, "simplify: triangle " + std::to_string(t) + " of mesh '" +
                                        mesh.name + "' uses vertex " + std::to_string(vertex) +
                                        ", but the mesh has only " +
                                        std::to_string(mesh.positions.size()) +
                                        " vertices; check the program that wrote it");
    }
    vertex = welded[vertex];
  }
  return v;
}

/// Removes the backs of two-sided sheets.
/// \returns Work::backs
std::vector<std::uint32_t> drop_backs(std::vector<Triangle>& triangles,
                                      std::vector<SourceTriangle>& sources, std::size_t vertices) {
  const TwoSided sides = TwoSided::of(triangles, vertices);
  std::vector<std::uint32_t> backs;
  if (sides.empty()) return backs;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (sides.backs[t] != 0) continue;
    const std::uint32_t twin = sides.twins[t];
    triangles[backs.size()] = triangles[t];
    backs.push_back(twin == TwoSided::kNone ? twin : sources[twin].index);
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < sides.backs.size(); ++t) {
    if (sides.backs[t] == 0) sources[kept++] = sources[t];
  }
  triangles.resize(kept);
  sources.resize(kept);
  return backs;
}

}  // namespace

std::vector<Triangle> clean(const Mesh& mesh, std::vector<SourceTriangle>& sources,
                            std::vector<std::uint32_t>* backs, std::vector<Warning>& warnings) {
  const std::vector<std::uint32_t> welded = weld_vertices(mesh.positions);
  RemovedTriangles not_finite, degenerate, duplicate;
  std::vector<Triangle> result(mesh.triangles.size());
  std::vector<TriangleState> triangle_states(result.size());
  sources.resize(result.size());
  std::atomic<bool> all_usable = true;
  parallel_for(result.size(), kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
    bool are_all_usable = true;
    for (std::size_t t = begin; t < end; ++t) {
      const Triangle v = welded_corners(mesh, welded, t);
      const Vec3 &a = mesh.positions[v[0]], &b = mesh.positions[v[1]], &c = mesh.positions[v[2]];
      triangle_states[t] = !is_finite(a) || !is_finite(b) || !is_finite(c)
                               ? TriangleState::not_finite
                           : triangle_shape(a, b, c).area > 0 ? TriangleState::usable
                                                              : TriangleState::degenerate;
      are_all_usable = are_all_usable && triangle_states[t] == TriangleState::usable;
      const std::size_t lowest = v[0] <= v[1] ? (v[0] <= v[2] ? 0 : 2) : (v[1] <= v[2] ? 1 : 2);
      result[t] = {v[lowest], v[(lowest + 1) % 3], v[(lowest + 2) % 3]};
      sources[t] = {static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(lowest)};
    }
    if (!are_all_usable) all_usable = false;
  });
  /// Removes the triangles for which a predicate is false.
  const auto keep_if = [&](const auto& is_kept) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < result.size(); ++i) {
      if (!is_kept(i)) continue;
      result[kept] = result[i];
      sources[kept++] = sources[i];
    }
    result.resize(kept);
    sources.resize(kept);
  };
  if (!all_usable) {
    keep_if([&](std::size_t t) {
      if (triangle_states[t] == TriangleState::not_finite) not_finite.add(t);
      if (triangle_states[t] == TriangleState::degenerate) degenerate.add(t);
      return triangle_states[t] == TriangleState::usable;
    });
  }
  const RepeatedTriangles repeated_triangles = find_repeats(result, mesh.positions.size());
  if (!repeated_triangles.is_duplicate.empty()) {
    keep_if([&](std::size_t i) {
      if (repeated_triangles.is_duplicate[i] != 0) duplicate.add(sources[i].index);
      return repeated_triangles.is_duplicate[i] == 0;
    });
  }
  not_finite.report("non-finite-triangles", "has a corner that is not finite",
                    "have a corner that is not finite", warnings);
  degenerate.report("degenerate-triangles", "has no area", "have no area", warnings);
  duplicate.report("duplicate-triangles", "repeats an earlier one", "repeat an earlier one",
                   warnings);
  if (result.empty()) {
    throw Error(ErrorCode::input,
                "simplify: mesh '" + mesh.name + "' has no usable triangle among " +
                    std::to_string(mesh.triangles.size()) + "; check the program that wrote it");
  }
  if (backs != nullptr && repeated_triangles.has_opposed)
    *backs = drop_backs(result, sources, mesh.positions.size());
  return result;
}

Scale::Scale(const Mesh& mesh, const std::vector<Triangle>& triangles) {
  std::vector<Box<Vec3>> task_boxes(triangles.size() / kTrianglesPerTask + 1);
  parallel_for(triangles.size(), kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
    Box<Vec3> box;
    for (std::size_t t = begin; t < end; ++t) {
      for (const std::uint32_t v : triangles[t]) box.add(mesh.positions[v]);
    }
    task_boxes[begin / kTrianglesPerTask] = box;
  });
  Box<Vec3> all;
  for (const Box<Vec3>& box : task_boxes) all.join(box);
  center_ = all.center();
  diagonal_ = all.diagonal();
}

double Scale::slack() const {
  const double farthest =
      std::max({std::abs(center_.x), std::abs(center_.y), std::abs(center_.z)}) + diagonal_;
  return std::numeric_limits<float>::epsilon() * farthest / diagonal_;
}

Vec3d Scale::to_work(const Vec3& p) const {
  const Vec3d offset = to_double(p) - center_;
  return {offset.x / diagonal_, offset.y / diagonal_, offset.z / diagonal_};
}

Work compact(const Mesh& mesh, std::vector<Triangle> triangles, std::vector<SourceTriangle> sources,
             std::vector<std::uint32_t> backs, const Scale& scale) {
  Work work;
  std::vector<std::uint32_t> number(mesh.positions.size(), kNoVertex);
  work.points.reserve(mesh.positions.size());
  for (Triangle& t : triangles) {
    for (std::uint32_t& vertex : t) {
      if (number[vertex] == kNoVertex) {
        number[vertex] = static_cast<std::uint32_t>(work.points.size());
        work.points.push_back(scale.to_work(mesh.positions[vertex]));
      }
      vertex = number[vertex];
    }
  }
  work.triangles = std::move(triangles);
  work.sources = std::move(sources);
  work.backs = std::move(backs);
  return work;
}

Labels labels_of(const Mesh& mesh, const Work& work) {
  using NamesOfTriangle = std::array<std::uint32_t, 3>;
  using NamesOfBothSides = std::pair<NamesOfTriangle, NamesOfTriangle>;
  constexpr std::uint32_t kNoBack = TwoSided::kNone;
  Labels labels;
  if (mesh.groups.empty() && mesh.objects.empty() && mesh.materials.empty() && work.backs.empty()) {
    return labels;
  }
  const auto name_at = [&](const std::vector<std::uint32_t>& names, std::uint32_t t) {
    return names.size() == mesh.triangles.size() ? names[t] : 0;
  };
  const auto names_at = [&](std::uint32_t t) {
    if (t == kNoBack) return NamesOfTriangle{kNoBack, kNoBack, kNoBack};
    return NamesOfTriangle{name_at(mesh.groups, t), name_at(mesh.objects, t),
                           name_at(mesh.materials, t)};
  };
  std::map<NamesOfBothSides, std::uint32_t> numbers;
  labels.of.reserve(work.triangles.size());
  NamesOfBothSides last{};
  for (std::size_t i = 0; i < work.sources.size(); ++i) {
    const std::uint32_t t = work.sources[i].index;
    const std::uint32_t back = work.backs.empty() ? kNoBack : work.backs[i];
    const NamesOfBothSides names{names_at(t), names_at(back)};
    if (!labels.of.empty() && names == last) {
      labels.of.push_back(labels.of.back());
      continue;
    }
    last = names;
    const auto [found, added] =
        numbers.try_emplace(names, static_cast<std::uint32_t>(numbers.size()));
    if (added) {
      labels.source.push_back(t);
      if (!work.backs.empty()) labels.backs.push_back(back);
    }
    labels.of.push_back(found->second);
  }
  return labels;
}

Layout layout_of(const Mesh& mesh, const Work& work) {
  struct LayoutCorner {
    std::uint32_t vertex;
    std::uint64_t uv;  ///< Bit pattern of the UV
    std::uint32_t example;
    auto key() const { return std::tuple(vertex, uv, example); }
  };
  const std::vector<std::uint32_t> charts = uv_charts(mesh);
  Labels labels = labels_of(mesh, work);
  Layout layout;
  layout.groups = std::move(labels.of);
  layout.group_of = std::move(labels.source);
  layout.corners.resize(work.triangles.size());
  std::vector<LayoutCorner> corners;
  corners.reserve(work.triangles.size() * 3);
  for (std::uint32_t t = 0; t < work.triangles.size(); ++t) {
    const SourceTriangle& source = work.sources[t];
    layout.charts.push_back(charts[source.index]);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Vec2& given = mesh.uvs[mesh.uv_triangles[source.index][(k + source.first) % 3]];
      const Vec2 uv{given.x + 0.0F, given.y + 0.0F};  // Turns -0 into 0
      const std::uint64_t bits = std::uint64_t{std::bit_cast<std::uint32_t>(uv.x)} << 32 |
                                 std::bit_cast<std::uint32_t>(uv.y);
      corners.push_back({work.triangles[t][k], bits, 3 * t + k});
    }
  }
  std::sort(corners.begin(), corners.end(),
            [](const LayoutCorner& a, const LayoutCorner& b) { return a.key() < b.key(); });
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const LayoutCorner& c = corners[i];
    if (i == 0 || corners[i - 1].vertex != c.vertex || corners[i - 1].uv != c.uv) {
      layout.uvs.push_back({std::bit_cast<float>(static_cast<std::uint32_t>(c.uv >> 32)),
                            std::bit_cast<float>(static_cast<std::uint32_t>(c.uv))});
    }
    layout.corners[c.example / 3][c.example % 3] =
        static_cast<std::uint32_t>(layout.uvs.size() - 1);
  }
  return layout;
}

std::vector<Vec3> to_floats(const std::vector<Vec3d>& points) {
  std::vector<Vec3> result(points.size());
  std::transform(points.begin(), points.end(), result.begin(), to_float);
  return result;
}

bool turn_outwards(const Mesh& mesh, std::vector<Triangle>& triangles) {
  // A mesh counts as closed if the sum of its area vectors has at most this length, as a share of the mesh's area.
  constexpr double kMaxOpenShare = 1e-6;
  const auto at = [&](std::uint32_t v) {
    const Vec3& p = mesh.positions[v];
    return Vec3d{p.x, p.y, p.z};
  };
  const Vec3d middle = at(triangles.at(0)[0]);
  struct AreaAndVolume {
    Vec3d face{};
    double area = 0, volume = 0;
  };
  std::vector<AreaAndVolume> parts(triangles.size() / kTrianglesPerTask + 1);
  parallel_for(triangles.size(), kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
    AreaAndVolume sums;
    for (std::size_t t = begin; t < end; ++t) {
      const Triangle& v = triangles[t];
      const Vec3d a = at(v[0]) - middle, b = at(v[1]) - middle, c = at(v[2]) - middle;
      const Vec3d face = cross(b - a, c - a);
      sums.face += face;
      sums.area += length(face);
      sums.volume += dot(a, cross(b, c));
    }
    parts[begin / kTrianglesPerTask] = sums;
  });
  Vec3d sum{0, 0, 0};
  double area = 0, volume = 0;
  for (const AreaAndVolume& part : parts) {
    sum += part.face;
    area += part.area;
    volume += part.volume;
  }
  if (!(volume < 0) || !(length(sum) <= kMaxOpenShare * area)) return false;
  for (Triangle& t : triangles) std::swap(t[1], t[2]);
  return true;
}

bool is_finely_curved(const Work& work) {
  constexpr double kMinAlignedCosine = 0.99996192306;  // Cosine of half a degree
  constexpr std::size_t kMinAlignedPercent = 15, kWholePercent = 100;
  std::vector<Vec3d> first(work.points.size(),
                           Vec3d{0, 0, 0});  // For each vertex, the normal of its first triangle
  std::size_t aligned_corners = 0, all = 0;
  for (const Triangle& t : work.triangles) {
    const Vec3d &a = work.points[t[0]], &b = work.points[t[1]], &c = work.points[t[2]];
    const Vec3d face_normal = cross(b - a, c - a);
    const double size = length(face_normal);
    if (!(size > 0)) continue;
    const Vec3d normal = face_normal * (1 / size);
    for (const std::uint32_t v : t) {
      if (dot(first[v], first[v]) == 0) {
        first[v] = normal;
        continue;
      }
      ++all;
      if (dot(first[v], normal) > kMinAlignedCosine) ++aligned_corners;
    }
  }
  return kWholePercent * aligned_corners >= kMinAlignedPercent * all && all > 0;
}

}  // namespace kiln
