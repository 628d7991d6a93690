#include "kiln/session.h"

#include <cmath>
#include <string>
#include <utility>

#include "bake/session_impl.h"
#include "base/option.h"
#include "kiln/validate.h"

namespace kiln {
namespace {

const Mesh& check_vertices(const Mesh& high) {
  validate(high);
  if (high.triangles.empty()) {
    throw Error(ErrorCode::input,
                "'" + high.name + "' has no triangles: there is nothing to bake from.");
  }
  for (const Vec3& p : high.positions) {
    if (is_finite(p)) continue;
    throw Error(ErrorCode::input,
                "'" + high.name +
                    "' has a vertex that is not finite, which sessions do not support: remove it.");
  }
  return high;
}

/// Rejects options that sessions do not support.
const BakeOptions& check_vertices(const BakeOptions& options) {
  if (options.match.saved != nullptr || options.progress) {
    throw Error(
        ErrorCode::usage,
        "A session supports neither a saved match nor a progress callback: leave them out.");
  }
  check_options(options);
  if (options.report.errors) {
    throw Error(ErrorCode::usage,
                option("report.errors") +
                    ": a session does not measure errors. Use bake() with its high poly instead.",
                "option-contradiction");
  }
  if (options.match.visibility.clusters > 1 || options.match.fallback_blend > 0) {
    throw Error(ErrorCode::usage, "Sessions do not support clusters and blending: leave them out.");
  }
  return options;
}

/// Marks the source as one whose vertices will move. The pipeline must be constructed afterwards.
Source::Impl& mark_as_moving(Source::Impl& source) {
  source.will_move = true;
  return source;
}

}  // namespace

BakeSession::Impl::Impl(const Device& device, Mesh&& dense, Mesh&& low_mesh,
                        const BakeOptions& wanted, const SessionOptions& session)
    : high(std::move(dense)),
      low(std::move(low_mesh)),
      options(wanted),
      session_options{session.bounds ? *session.bounds : Bounds::of(check_vertices(high)),
                      session.traversal},
      source(device, check_vertices(high), traversal_of(session.traversal), session_options.bounds),
      normals(high, source.positions),
      pipeline({mark_as_moving(source), low, check_vertices(options)}, BandStorage::kept),
      texels((pipeline.sample(), pipeline), high.triangles.size(), options.width),
      corners_of_vertex(
          Adjacency::make(high.positions.size(), high.triangles.size() * 3,
                          [&](std::size_t i) { return high.triangles[i / 3][i % 3]; })),
      moved(high.positions.size()),
      set(high.normals.size()) {}

/// True if padding texels are copies of baked texels, so that a partial update can copy them again.
bool BakeSession::Impl::padding_is_copied() {
  return options.encoding.gutter >= 0 && !options.encoding.mips &&
         ((options.encoding.miss == MissPolicy::keep &&
           !pipeline.layers().any_map_fills_misses()) ||
          pipeline.result().report.missed == 0);
}

/// Runs the stages that a change requires.
void BakeSession::Impl::bake_maps(const HighPolyNormals::Change& normal_change,
                                  bool has_moved_vertices) {
  Layers& layers = pipeline.layers();
  Pass pass;
  pass.match = !baked || (has_moved_vertices && !pipeline.keeps_surface_points());
  pass.update_distances = !pass.match && has_moved_vertices &&
                          (options.report.keep_match || layers.any_map_depends_on_positions());
  pass.compute_maps = pass.match || normal_change.rebuilt || layers.any_map_reads_around() ||
                      (has_moved_vertices && layers.any_map_depends_on_positions());
  if (pass.match) {
    pipeline.prepare_match(visibility);
    texels.invalidate();
  }
  update.matched = pass.match;
  pass.compute_maps = pass.compute_maps || !texels.choose_texels(normals, normal_change);
  if (pass.match || pass.update_distances || pass.compute_maps) pipeline.run_over_bands(pass);
  // Whether the match suits the meshes is only checked at the first bake
  if (pass.match) pipeline.finish_match(!baked);
  if (!pass.compute_maps) texels.read();
  update.texels = pass.compute_maps ? texels.count() : texels.chosen_count();
  update.seconds_detail = pipeline.lap();
  // With two_component, finish_maps() is required, since only it raises normals below the surface and warns
  // about them.
  const bool is_partial = padding_is_copied() && !options.encoding.two_component;
  if (pass.compute_maps && baked && is_partial && texels.is_coverage_unchanged()) {
    texels.finish_all_texels(options);
    update.dirty = {0, 0, options.width, options.height};
  } else if (pass.compute_maps || !is_partial) {
    pipeline.finish_maps();
    update.dirty = {0, 0, options.width, options.height};
  } else {
    update.dirty = texels.finish(options);
  }
  pipeline.finish_report();
}

const BakeResult& BakeSession::Impl::bake() {
  update = {};
  const bool has_moved_vertices = !moved.items().empty();
  if (baked && !has_moved_vertices && set.items().empty()) return pipeline.result();
  pipeline.restart_stopwatch();
  const HighPolyNormals::Change normal_change = update_source();
  pipeline.layers().invalidate_source_results();
  pipeline.context().finish();
  update.seconds_source = pipeline.lap();
  bake_maps(normal_change, has_moved_vertices);
  moved.clear();
  if (!baked) texels.prepare(options, padding_is_copied());
  baked = true;
  const BakeReport& report = pipeline.result().report;
  update.seconds_match = report.seconds_build + report.seconds_match;
  update.seconds_detail += report.seconds_detail;
  update.seconds_image = report.seconds_image + report.seconds_mips + pipeline.lap();
  return pipeline.result();
}

BakeSession::BakeSession(const Device& device, Mesh high, Mesh low, const BakeOptions& options,
                         const SessionOptions& session)
    : impl_(new Impl(device, std::move(high), std::move(low), options, session)) {}
BakeSession::~BakeSession() { delete impl_; }
BakeSession::BakeSession(BakeSession&& other) noexcept
    : impl_(std::exchange(other.impl_, nullptr)) {}
BakeSession& BakeSession::operator=(BakeSession&& other) noexcept {
  delete std::exchange(impl_, std::exchange(other.impl_, nullptr));
  return *this;
}

const BakeResult& BakeSession::bake() {
  if (impl_->has_failed) {
    delete std::exchange(impl_, new Impl(impl_->source.device, Mesh(impl_->high), Mesh(impl_->low),
                                         impl_->options, impl_->session_options));
  }
  impl_->has_failed = true;
  const BakeResult& result = impl_->bake();
  impl_->has_failed = false;
  return result;
}

const Mesh& BakeSession::high() const { return impl_->high; }
const Bounds& BakeSession::bounds() const { return *impl_->session_options.bounds; }
const std::vector<Warning>& BakeSession::warnings() const { return impl_->source.warnings; }
const BakeSession::Update& BakeSession::last_update() const { return impl_->update; }

namespace {

void check_range(const char* what, std::uint32_t first, std::size_t count, std::size_t size) {
  if (first <= size && count <= size - first) return;
  throw Error(ErrorCode::usage, std::string(what) + " " + std::to_string(first) + " to " +
                                    std::to_string(first + count) +
                                    " were given, but the high poly has " + std::to_string(size) +
                                    ".");
}

}  // namespace

void BakeSession::set_positions(std::uint32_t first, std::span<const Vec3> positions) {
  Impl& impl = *impl_;
  Mesh& mesh = impl.high;
  check_range("Positions", first, positions.size(), mesh.positions.size());
  const Frame& frame = impl.source.frame;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double p[3] = {positions[i].x, positions[i].y, positions[i].z};
    for (std::size_t k = 0; k < 3; ++k) {
      // Positions within the bounds have coordinates up to 0.5; kernels require at most about 1.
      const double coordinate = (p[k] + (mesh.origin[k] - frame.center[k])) * frame.scale;
      if (std::abs(coordinate) <= 1) continue;
      throw Error(ErrorCode::usage,
                  "The position of vertex " + std::to_string(first + i) +
                      " is not finite, or too far outside the session's bounds: create the session "
                      "with larger " +
                      option("bounds") + ".",
                  "session-bounds");
    }
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (mesh.positions[first + i] == positions[i]) continue;
    mesh.positions[first + i] = positions[i];
    impl.moved.add(static_cast<std::uint32_t>(first + i));
  }
}

void BakeSession::set_normals(std::uint32_t first, std::span<const Vec3> normals) {
  Impl& impl = *impl_;
  Mesh& mesh = impl.high;
  check_range("Normals", first, normals.size(),
              mesh.normal_triangles.empty() ? 0 : mesh.normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (is_usable_normal(normals[i])) continue;
    throw Error(ErrorCode::usage, "Normal " + std::to_string(first + i) +
                                      " has no direction: it must be finite and not 0.");
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (mesh.normals[first + i] == normals[i]) continue;
    mesh.normals[first + i] = normals[i];
    impl.set.add(static_cast<std::uint32_t>(first + i));
  }
}

}  // namespace kiln
