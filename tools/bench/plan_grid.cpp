// Compares plans of low polys with a brute-force grid over faces and map sizes.
//
// plan_grid [--screen PIXELS] [--repeat N] [--times] [--cache FILE] HIGH:DEGREES [HIGH:DEGREES ...]
//
// For each high poly, makes the plan. Then, for every map size and without a map, it evaluates low polys with fewer and
// fewer faces. It starts with the most faces that fit in 105% of the plan's bytes, reduces them by 5% per step, and
// ends when two low polys in a row exceed the error. They are simplified and unwrapped as in the plan, with its samples
// per texel, bits and match. Errors are measured in pictures from 30 directions that the plan does not use. The error
// bound is scaled by the ratio of the plan's error in these pictures to its own. With --screen, plan and pictures are
// for that size on screen. --cache stores the grid's measurements for later runs. Prints one JSON line per mesh:
//
//   tried faces, size, bytes, expected and measured degrees of each candidate looked faces, degrees without a map and
//   with an infinite one, of each evaluated level excess bytes of the plan over those of the lightest pair that was
//   found; 1 if that is the plan grid points of the grid ratio processor seconds of the plan, over those of one bake of
//   its result: reading the file and the high poly's structures count in both; least of --repeat runs each. --times:
//   nothing but this
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "simplify/simplify_levels.h"

namespace kiln {
namespace {

constexpr double kFaceStep = 0.95, kGridBytesRatio = 1.05;
constexpr std::uint32_t kMostFaces = 25000, kFewestFaces = 12, kLargestMap = 2048,
                        kSmallestMap = 16;
constexpr std::uint32_t kHeldOutPictures = 30, kPicturePixels = 128;

double cpu_seconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

template <typename Run>
double min_seconds(int repeat, const Run& run) {
  double least = 1e300;
  for (int i = 0; i < repeat; ++i) {
    const double start = cpu_seconds();
    run();
    least = std::min(least, cpu_seconds() - start);
  }
  return least;
}

struct PlanRequest {
  std::string path;
  double degrees = 0;
  std::uint32_t screen = 0;
  int repeat = 2;
  bool times = false;
  std::string cache;  ///< File with measurements of earlier runs; empty: none
};

LowPolyPlanOptions plan_options(const PlanRequest& request) {
  LowPolyPlanOptions options;
  options.max_error = request.degrees;
  options.screen = request.screen;
  options.bake.width = options.bake.height = kLargestMap;
  return options;
}

BakeOptions bake_options(const Candidate& chosen, std::uint32_t size) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.method = chosen.method;
  // The number of samples is chosen as in plans.
  options.samples = std::clamp(1024 / size, 1U, 4U);
  return options;
}

Mesh unwrap_for_map(const Mesh& mesh, std::uint32_t size) {
  return unwrap(mesh, {UnwrapMethod::charts, size, std::max(2U, size / 256)});
}

/// Runs one bake of a plan's result, including reading the file.
void bake_chosen(const Device& device, const std::string& path, const Candidate& chosen) {
  const Mesh high = load_mesh(path);
  SimplifyOptions options;
  options.faces = static_cast<std::uint32_t>(chosen.faces);
  options.fit_normals =
      chosen.size == 0;  // otherwise normals are fitted after unwrapping, which creates the seams
  SimplifyReport report;
  const Mesh low = simplify(high, options, &report);
  if (chosen.size == 0) return;
  const Source source(device, high);
  bake(source, fit_normals(unwrap_for_map(low, chosen.size), high),
       bake_options(chosen, chosen.size));
}

/// Measures errors in pictures from directions that plans do not use.
class Pictures {
 public:
  Pictures(const Device& device, const Source& source, const Mesh& high, std::uint32_t screen)
      : device_(device) {
    const std::vector<Vec3> seen = held_out_views(kPlanViews, spread_views(12));
    std::vector<ViewAngles> views;
    for (const Vec3& toward : held_out_views(kHeldOutPictures, seen))
      views.push_back(view_angles(toward));
    if (screen != 0) {
      on_screen_ = std::make_unique<ScreenPictures>(source, screen, kHeldOutPictures);
    } else {
      points_ = std::make_unique<NormalReference>(Scene(device, high), high, views, kPicturePixels);
    }
  }
  double degrees(const Mesh& low) const {
    return on_screen_ ? on_screen_->degrees(low)
                      : points_->compare(Scene(device_, low)).mean_degrees;
  }
  double degrees(const Mesh& low, const Image& map, const BakeOptions& baked) const {
    if (on_screen_) return on_screen_->degrees(low, map, baked);
    const NormalMap normal{&map, baked.encoding.space, baked.encoding.flip_y,
                           baked.encoding.bitangent};
    return points_->compare(Scene(device_, low, normal)).mean_degrees;
  }

 private:
  const Device& device_;
  std::unique_ptr<NormalReference> points_;
  std::unique_ptr<ScreenPictures> on_screen_;
};

struct Point {
  std::uint64_t faces = 0;
  std::uint32_t size = 0;
  std::uint64_t bytes = 0;
  double degrees = 0;
};

Image rounded(Image map, std::uint32_t bits) {
  const float steps = static_cast<float>((1U << bits) - 1);
  for (float& value : map.pixels) {
    value = std::floor(std::clamp(value, 0.0F, 1.0F) * steps + 0.5F) / steps;
  }
  return map;
}

std::vector<std::uint32_t> grid_face_counts(std::size_t dense) {
  std::vector<std::uint32_t> faces;
  for (double goal = std::min<double>(kMostFaces, 0.5 * static_cast<double>(dense));
       goal >= kFewestFaces; goal *= kFaceStep) {
    faces.push_back(static_cast<std::uint32_t>(goal));
  }
  return faces;
}

class Grid {
 public:
  Grid(const Source& source, const Mesh& high, const Pictures& pictures, const Candidate& chosen,
       const PlanRequest& request)
      : source_(source),
        pictures_(pictures),
        chosen_(chosen),
        file_(request.cache),
        key_(high.name + " " + std::to_string(request.screen) + " " +
             std::string(chosen.method.name) + " " + std::to_string(chosen.bits)),
        levels_(high, grid_face_counts(high.triangles.size()), LevelRule::shape) {
    if (file_.empty()) return;
    std::ifstream cached_lines(file_);
    for (std::string line; std::getline(cached_lines, line);) {
      const std::size_t tab = line.find('\t');
      if (tab == std::string::npos || line.substr(0, tab) != key_) continue;
      std::istringstream values(line.substr(tab));
      std::size_t level = 0;
      Point point;
      values >> level >> point.size >> point.faces >> point.bytes >> point.degrees;
      cached_points_[{level, point.size}] = point;
    }
  }

  /// Evaluates candidates of one map size that reach the error `wanted` with fewer than `most` bytes.
  void run(std::uint32_t size, double wanted, double most, std::vector<Point>& found) {
    int misses = 0;
    for (std::size_t level = 0; level < levels_.count() && misses < 2; ++level) {
      const std::uint64_t least =
          low_poly_bytes(levels_.vertices(level), levels_.faces(level), size, {3}, chosen_.bits)
              .total();
      if (static_cast<double>(least) > most) continue;
      const Point point = cached_or_measured(level, size);
      ++count;
      if (point.degrees <= wanted) {
        found.push_back(point);
        misses = 0;
      } else {
        ++misses;
      }
    }
  }

  int count = 0;

 private:
  Point cached_or_measured(std::size_t level, std::uint32_t size) {
    const auto found = cached_points_.find({level, size});
    if (found != cached_points_.end()) return found->second;
    const Point point = at(level, size);
    if (!file_.empty()) {
      std::ofstream(file_, std::ios::app)
          << key_ << '\t' << level << ' ' << point.size << ' ' << point.faces << ' ' << point.bytes
          << ' ' << point.degrees << '\n';
    }
    return cached_points_[{level, size}] = point;
  }

  Point at(std::size_t level, std::uint32_t size) {
    const auto made = meshes_.find(level);
    const Mesh& mesh = made != meshes_.end() ? made->second : meshes_[level] = levels_.mesh(level);
    Point point{mesh.triangles.size(), size};
    if (size == 0) {
      point.bytes = low_poly_bytes(split_vertices(mesh), point.faces, 0, {3}, chosen_.bits).total();
      point.degrees = pictures_.degrees(mesh);
      return point;
    }
    Mesh low = unwrap_for_map(mesh, size);
    levels_.fit_normals(low);
    BakeOptions options = bake_options(chosen_, size);
    options.report.recall = 0;
    const BakeResult result = bake(source_, low, options);
    point.bytes = low_poly_bytes(split_vertices(low), point.faces, size, {3}, chosen_.bits).total();
    point.degrees = pictures_.degrees(low, rounded(result.maps[0].image, chosen_.bits), options);
    return point;
  }

  const Source& source_;
  const Pictures& pictures_;
  const Candidate& chosen_;
  const std::string file_, key_;
  std::map<std::pair<std::size_t, std::uint32_t>, Point> cached_points_;
  SimplifyLevels levels_;
  std::map<std::size_t, Mesh> meshes_;
};

/// Prints short lists of the maps that a plan baked, and of the low polys that it evaluated.
void print_tries(const LowPolyPlan& plan) {
  const char* comma = "";
  std::printf(",\"tried\":[");
  for (const Candidate& t : plan.candidates) {
    std::printf("%s[%llu,%u,%llu,%.3f,%.3f]", std::exchange(comma, ","),
                static_cast<unsigned long long>(t.faces), t.size,
                static_cast<unsigned long long>(t.bytes.total()), t.expected, t.measured);
  }
  comma = "";
  std::printf("],\"looked\":[");
  for (const PlanLevel& l : plan.levels) {
    std::printf("%s[%llu,%.3f,%.3f]", std::exchange(comma, ","),
                static_cast<unsigned long long>(l.faces), l.without_map, l.limit);
  }
  std::printf("]");
}

void compare(const Device& device, const PlanRequest& request) {
  const Mesh high = load_mesh(request.path);
  const Source source(device, high);
  const LowPolyPlan plan = plan_low_poly(source, high, plan_options(request));
  std::printf("{\"mesh\":\"%s\",\"wanted\":%g,\"screen\":%u,\"reached\":%s,\"trials\":%zu",
              high.name.c_str(), request.degrees, request.screen, plan.reached ? "true" : "false",
              plan.candidates.size());
  const Candidate& chosen = plan.chosen;
  std::printf(",\"faces\":%llu,\"size\":%u,\"bytes\":%llu,\"measured\":%.4f",
              static_cast<unsigned long long>(chosen.faces), chosen.size,
              static_cast<unsigned long long>(chosen.bytes.total()), chosen.measured);
  std::printf(",\"match\":\"%s\",\"simplify\":%.3f,\"unwrap\":%.3f,\"measure\":%.3f,\"looks\":%zu",
              std::string(chosen.method.name).c_str(), plan.seconds_simplify, plan.seconds_unwrap,
              plan.seconds_measure, plan.levels.size());
  print_tries(plan);
  const double planned = min_seconds(request.repeat, [&] {
    const Mesh mesh = load_mesh(request.path);
    plan_low_poly(Source(device, mesh), mesh, plan_options(request));
  });
  const double baked =
      min_seconds(request.repeat, [&] { bake_chosen(device, request.path, chosen); });
  std::printf(",\"seconds\":%.3f,\"bake\":%.3f,\"ratio\":%.2f", planned, baked, planned / baked);
  if (!request.times) {
    const Pictures pictures(device, source, high, request.screen);
    const double at_plan = plan.result ? pictures.degrees(plan.low, plan.drawn, plan.bake)
                                       : pictures.degrees(plan.low);
    const double wanted = at_plan * request.degrees / chosen.measured;
    Grid grid(source, high, pictures, chosen, request);
    std::vector<Point> found{{chosen.faces, chosen.size, chosen.bytes.total(), at_plan}};
    grid.run(0, wanted, kGridBytesRatio * static_cast<double>(chosen.bytes.total()), found);
    for (std::uint32_t size = kSmallestMap; size <= kLargestMap; size *= 2) {
      grid.run(size, wanted, kGridBytesRatio * static_cast<double>(chosen.bytes.total()), found);
    }
    const Point best =
        *std::min_element(found.begin(), found.end(),
                          [](const Point& a, const Point& b) { return a.bytes < b.bytes; });
    std::printf(
        ",\"pictures\":%.4f,\"best_faces\":%llu,\"best_size\":%u,\"best_bytes\":%llu,\"best_"
        "degrees\":%.4f,"
        "\"excess\":%.3f,\"grid\":%d",
        at_plan, static_cast<unsigned long long>(best.faces), best.size,
        static_cast<unsigned long long>(best.bytes), best.degrees,
        static_cast<double>(chosen.bytes.total()) / static_cast<double>(best.bytes), grid.count);
  }
  std::printf("}\n");
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  PlanRequest request;
  std::vector<PlanRequest> all;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::size_t colon = word.rfind(':');
    if (word == "--times") {
      request.times = true;
    } else if (word == "--screen" && i + 1 < argc) {
      request.screen = static_cast<std::uint32_t>(std::atoi(argv[++i]));
    } else if (word == "--cache" && i + 1 < argc) {
      request.cache = argv[++i];
    } else if (word == "--repeat" && i + 1 < argc) {
      request.repeat = std::max(1, std::atoi(argv[++i]));
    } else if (colon != std::string::npos) {
      request.path = word.substr(0, colon);
      request.degrees = std::atof(word.c_str() + colon + 1);
      all.push_back(request);
    } else {
      std::fprintf(stderr, "plan_grid: '%s' is no HIGH:DEGREES\n", word.c_str());
      return 2;
    }
  }
  const Device device = Device::open();
  for (const PlanRequest& one : all) compare(device, one);
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  try {
    return kiln::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plan_grid: %s\n", error.what());
    return 1;
  }
}
