#include "lab/study.h"

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "arguments/bake_values.h"
#include "lab/measuring.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kPictureSize = 640;  // pixels a side of the error picture's panels

/// What is to be measured, in an order that makes each low poly once.
std::vector<Setting> plan(const StudyOptions& options, const Mesh& high, const Mesh* low) {
  std::vector<Setting> settings;
  const auto add = [&](Curve curve, std::uint32_t views, std::uint32_t faces, std::uint32_t size) {
    Setting setting;
    setting.curve = curve;
    setting.views = views;
    setting.target_faces = faces;
    setting.size = size;
    settings.push_back(setting);
  };
  if (options.kind == StudyKind::views) {
    const std::uint32_t faces =
        low != nullptr ? static_cast<std::uint32_t>(low->triangles.size()) : options.faces;
    add(Curve::none, 0, faces, 0);
    add(Curve::ray, 0, faces, options.size);
    for (const std::uint32_t views : kStudyViews) {
      add(Curve::paper, views, faces, options.size);
      add(Curve::kiln, views, faces, options.size);
    }
    return settings;
  }
  for (const std::uint32_t faces : kStudyFaces) {
    if (faces >= high.triangles.size()) break;
    add(Curve::none, 0, faces, 0);
    if (options.kind == StudyKind::size) {
      for (const std::uint32_t size : kStudySizes) add(Curve::kiln, options.views, faces, size);
    } else {
      add(Curve::ray, 0, faces, options.size);
      add(Curve::paper, options.views, faces, options.size);
      add(Curve::kiln, options.views, faces, options.size);
    }
  }
  if (settings.empty()) {
    throw Error(ErrorCode::input, "'" + high.name + "' has " +
                                      std::to_string(high.triangles.size()) +
                                      " triangles: a study of low polys needs more than " +
                                      std::to_string(kStudyFaces[0]) + ".");
  }
  return settings;
}

/// The low polys, each made where it is first needed.
class LowMeshes {
 public:
  LowMeshes(const Mesh& high, const Mesh* given, double& seconds)
      : high_(high), given_(given), seconds_(seconds) {}

  /// With UVs laid out for a map of this size (0: as the last).
  const Mesh& get(std::uint32_t faces, std::uint32_t size, std::vector<Warning>& warnings) {
    if (given_ != nullptr) return *given_;
    Stopwatch watch;
    if (faces != faces_) {
      SimplifyOptions options;
      options.faces = faces;
      SimplifyReport report;
      simple_ = simplify(high_, options, &report);
      warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
      mesh_ = simple_;
    }
    if (size != 0 && (faces != faces_ || size != size_)) {
      UnwrapOptions options;
      options.method = UnwrapMethod::pairs;
      options.size = std::max(size, 16U);
      UnwrapReport report;
      mesh_ = fit_normals(unwrap(simple_, options, &report), high_);
      warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
      size_ = size;
    } else if (faces != faces_) {
      size_ = 0;
    }
    faces_ = faces;
    seconds_ += watch.total();
    return mesh_;
  }

 private:
  const Mesh& high_;
  const Mesh* given_;
  double& seconds_;
  std::uint32_t faces_ = 0, size_ = 0;
  Mesh simple_, mesh_;
};

BakeOptions bake_options(const Setting& setting, const StudyOptions& options) {
  BakeOptions bake;
  bake.width = bake.height = setting.size;
  bake.max_distance = options.max_distance;
  bake.keep_match = true;
  if (setting.curve == Curve::ray) return bake;
  bake.method = first_match(&MatchInfo::takes_views);
  bake.views.count = setting.views;
  bake.views.size = options.view_size;
  if (setting.curve == Curve::paper) {
    bake.views.criterion = ViewCriterion::depth;
    bake.views.refine = false;
  }
  return bake;
}

/// A look from the front, a little from the side and above, where nothing is matched from there; else the
/// held-out view nearest to it.
RenderOptions picture_options(const Mesh& frame, const std::vector<Vec3>& held_out,
                              const std::vector<Vec3>& used, bool z_up) {
  constexpr Vec3 kFront = {0.4830F, 0.2588F, 0.8365F};  // 30 degrees aside, 15 above
  const std::array<Vec3, 1> front = {z_up ? Vec3{kFront.x, -kFront.z, kFront.y} : kFront};
  const auto angle = [&](const Vec3& view) { return least_angle_degrees({&view, 1}, front); };
  Vec3 toward = front[0];
  if (least_angle_degrees(front, used) < kLeastHeldOutAngle) {
    toward = *std::min_element(held_out.begin(), held_out.end(),
                               [&](const Vec3& a, const Vec3& b) { return angle(a) < angle(b); });
  }
  const ViewAngles view = view_angles(z_up ? Vec3{toward.x, toward.z, -toward.y} : toward);
  RenderOptions options;
  options.size = kPictureSize;
  options.azimuth_degrees = view.azimuth_degrees;
  options.elevation_degrees = view.elevation_degrees;
  options.z_up = z_up;
  options.frame = &frame;
  return options;
}

std::string stage(const Setting& setting) {
  std::string text = std::to_string(setting.target_faces) + " faces";
  if (setting.curve == Curve::none) return text + ", no map";
  text += ", " + std::to_string(setting.size) + " x " + std::to_string(setting.size) + " map, ";
  if (setting.curve == Curve::ray) return text + "rays";
  return text + std::to_string(setting.views) + (setting.views == 1 ? " view" : " views") +
         (setting.curve == Curve::paper ? " as in the paper" : "");
}

}  // namespace

std::string curve_name(Curve curve) {
  switch (curve) {
    case Curve::paper:
      return "paper";
    case Curve::kiln:
      return "kiln";
    case Curve::ray:
      return default_match();
    case Curve::none:
      break;
  }
  return "none";
}

Study run_study(const Device& device, const Mesh& high, const Mesh* low,
                const StudyOptions& options, const Progress& progress) {
  Study study;
  study.settings = plan(options, high, low);
  // The same views for all three studies, so that their figures can be compared.
  std::vector<Vec3> used = spread_views(options.views);
  for (const std::uint32_t count : kStudyViews) {
    const std::vector<Vec3> more = spread_views(count);
    used.insert(used.end(), more.begin(), more.end());
  }
  study.held_out = held_out_views(kHeldOutViews, used, kLeastHeldOutAngle);
  study.least_angle_degrees = least_angle_degrees(study.held_out, used);

  study.cancelled = true;  // until all is done
  if (!progress(0, "preparing the high poly")) return study;
  const Source source(device, high);
  study.diagonal = source.stats().diagonal;
  study.warnings = source.warnings();
  const Scene high_scene(device, high);
  const std::vector<ViewAngles> angles = angles_of(study.held_out);
  const NormalReference reference(high_scene, high, angles, options.pixels);
  std::optional<DepthReference> depths;
  if (options.kind == StudyKind::faces) depths.emplace(high_scene, high, angles, options.pixels);
  RenderOptions picture = picture_options(high, study.held_out, used, options.z_up);
  study.original = high_scene.draw(picture);
  picture.show_normals = true;
  picture.samples = 1;
  const Image high_normals = high_scene.draw(picture);

  LowMeshes lows(high, low, study.seconds_low);
  bool first = true;
  double least = 0;
  double most = 0;
  for (std::size_t i = 0; i < study.settings.size(); ++i) {
    Setting& setting = study.settings[i];
    const auto show = [&](double done) {
      return progress((static_cast<double>(i) + done) / static_cast<double>(study.settings.size()),
                      stage(setting));
    };
    if (!show(0)) return study;
    const Mesh& mesh = lows.get(setting.target_faces, setting.size, setting.warnings);
    setting.faces = mesh.triangles.size();
    Stopwatch watch;
    NormalMap map;
    BakeResult result;
    if (setting.curve != Curve::none) {
      BakeOptions bake_with = bake_options(setting, options);
      bake_with.progress = [&](double done, std::string_view) { return show(done / 2); };
      result = bake(source, mesh, bake_with);
      if (result.cancelled) return study;
      const BakeReport& report = result.report;
      setting.warnings.insert(setting.warnings.end(), report.warnings.begin(),
                              report.warnings.end());
      setting.distance = match_distance(*result.match);
      if (report.views) setting.view_size = report.views->size;
      study.max_distance = report.max_distance;
      map.image = &result.maps[0].image;
    }
    setting.seconds_bake = watch.lap();
    if (!show(0.5)) return study;
    const Scene scene(device, mesh, map);
    setting.normal = reference.compare(scene);
    if (depths && setting.curve == Curve::none) setting.depth = depths->compare(scene);
    check_seen(setting.normal, high, mesh);
    setting.seconds_measure = watch.lap();

    if (setting.views == 0) continue;
    const double mean = setting.normal.mean_degrees;
    if (!first && mean >= least && mean <= most) continue;
    const ErrorPicture seen{i, normal_angles(high_normals, scene.draw(picture))};
    if (first || mean > most) study.worst = seen, most = mean;
    if (first || mean < least) study.best = seen, least = mean;
    first = false;
  }

  // By curve, which is how they are read; the pictures' settings move along.
  std::vector<std::size_t> order(study.settings.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto key = [&](std::size_t i) {
    const Setting& s = study.settings[i];
    return std::tuple(s.curve, s.target_faces, s.size, s.views);
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  std::vector<Setting> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(study.settings[i]));
  study.settings = std::move(sorted);
  for (ErrorPicture* seen : {&study.worst, &study.best}) {
    seen->setting = static_cast<std::size_t>(std::find(order.begin(), order.end(), seen->setting) -
                                             order.begin());
  }
  study.cancelled = false;
  return study;
}

}  // namespace kiln::cli
