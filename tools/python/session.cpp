#include "session.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>

#include "arrays.h"
#include "bake.h"
#include "base/option.h"
#include "job/check_result.h"
#include "kiln/session.h"
#include "match.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

/// A session with the objects that it references. Only one thread may use it at a time, until close(). All calls hold
/// the GIL.
template <typename Session>
class Exclusive {
 public:
  Exclusive() = default;
  ~Exclusive() { close(); }
  Exclusive(const Exclusive&) = delete;
  Exclusive& operator=(const Exclusive&) = delete;

  void set(std::shared_ptr<Session> made) { session_ = std::move(made); }

  /// Calls a function with the session, and keeps it alive if another thread closes it meanwhile.
  /// \throws Error(usage) after close(), and during another call
  template <typename Function>
  auto call_with_session(const Function& function) {
    if (session_ == nullptr)
      throw Error(ErrorCode::usage, "The session is closed: create a new one.", "closed");
    if (busy_) {
      throw Error(ErrorCode::usage,
                  "Another thread is using the session, which supports one thread at a time: wait "
                  "for it, or use a lock.",
                  "busy");
    }
    struct Use {
      bool& busy;
      std::shared_ptr<Session> session;
      ~Use() {
        busy = false;
        free(session);
      }
    } const use{busy_ = true, session_};
    return function(*use.session);
  }

  void close() { free(session_); }
  bool closed() const { return session_ == nullptr; }

 private:
  /// Releases the GIL before the session is destroyed, since destruction waits for the driver, which may wait for a
  /// callback that needs the GIL.
  static void free(std::shared_ptr<Session>& session) {
    std::shared_ptr<Session> last;
    last.swap(session);
    const nb::gil_scoped_release unlocked;
    last.reset();
  }

  std::shared_ptr<Session> session_;
  bool busy_ = false;
};

/// Adds the parameter's name to a library error that does not name it.
template <typename Function>
auto with_parameter(const char* parameter, const Function& function) {
  try {
    return function();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::usage) throw;
    throw Error(error.code(), option(parameter) + ": " + error.message(), error.id());
  }
}

/// Index of the first row that an array sets. \param first  nullopt: the array has all rows
std::uint32_t find_first_row(const char* parameter, std::optional<std::uint32_t> first,
                             std::size_t given, std::size_t all) {
  const std::string row_count_text = "but the high poly has " + std::to_string(all);
  if (!first && given != all) {
    throw Error(ErrorCode::usage,
                option(parameter) + ": " + std::to_string(given) + " rows were given, " +
                    row_count_text +
                    ": give all rows in the order of session.mesh, or the index of the first one "
                    "as first=.",
                "array-shape");
  }
  if (first && (*first > all || given > all - *first)) {
    throw Error(ErrorCode::usage,
                option(parameter) + ": rows " + std::to_string(*first) + " to " +
                    std::to_string(*first + given - 1) + " were given, " + row_count_text + ".",
                "array-range");
  }
  return first.value_or(0);
}

class PyBakeSession {
 public:
  PyBakeSession(const PyMesh& high, const PyMesh& low, const Keywords& words,
                const std::optional<PyMesh>& cage_mesh, const std::vector<PyMesh>& occluders,
                bool by_high, bool by_low, const nb::list& textures, nb::handle bounds,
                const std::string& device)
      : high_(high), low_name_(low.mesh->name) {
    const Call call;
    auto request = std::make_unique<Request>(words, cage_mesh ? &*cage_mesh : nullptr, occluders,
                                             by_high, by_low);
    if (request->chooses_match()) {
      throw Error(
          ErrorCode::usage,
          option("match", "auto") + " measures the maps of one bake: name a match, or call bake().",
          "option-enum");
    }
    take_textures(textures, request->normal_format(), request->options);
    const std::optional<Bounds> box = bounds_of(bounds, *high.mesh);
    std::vector<Warning> warnings;
    auto work = call.run([&] {
      high_.mesh = with_corrected_normals(high_.mesh, "HIGH", Trusted::faces, warnings);
      request->prepare(nullptr, high_, inward_parts(*high_.mesh).count != 0, low);
      const BakeOptions& options = request->options;
      BakeSession session(device_of(device), *high_.mesh, request->low(), options, {.bounds = box});
      return std::make_shared<Work>(Work{std::move(request), std::move(session)});
    });
    const std::vector<Warning>& source = work->session.warnings();
    warnings.insert(warnings.end(), source.begin(), source.end());
    // the report describes a mesh that does not change, so it is dropped
    high_.report = nb::none();
    high_.made = nullptr;
    work_.set(std::move(work));
    warn(warnings);
  }

  void set_positions(nb::handle given, std::optional<std::uint32_t> first) {
    const Call call;
    const auto rows = doubles(given, "positions", {-1, 3});
    work_.call_with_session([&](Work& work) {
      const Mesh& high = work.session.high();
      const std::uint32_t first_vertex =
          find_first_row("positions", first, rows.shape(0), high.positions.size());
      std::vector<Vec3> positions(rows.shape(0));
      std::uint64_t moved_count = 0;
      for (std::size_t i = 0; i < positions.size(); ++i) {
        const double* const p = rows.data() + 3 * i;
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
          throw Error(ErrorCode::usage,
                      option("positions") + ": row " + std::to_string(i) +
                          " has a number that is not finite.",
                      "array-range");
        }
        positions[i] = {static_cast<float>(p[0] - high.origin[0]),
                        static_cast<float>(p[1] - high.origin[1]),
                        static_cast<float>(p[2] - high.origin[2])};
        moved_count += positions[i] == high.positions[first_vertex + i] ? 0 : 1;
      }
      with_parameter("positions", [&] {
        call.run([&] { work.session.set_positions(first_vertex, positions); });
      });
      moved_vertices_ += moved_count;
    });
  }

  void set_normals(nb::handle given, std::optional<std::uint32_t> first) {
    const Call call;
    const auto rows = floats(given, "normals", {-1, 3});
    work_.call_with_session([&](Work& work) {
      const Mesh& high = work.session.high();
      if (high.normals.empty()) {
        throw Error(
            ErrorCode::usage,
            option("normals") +
                ": the high poly has no explicit normals; its computed ones follow the positions.",
            "option-contradiction");
      }
      const std::uint32_t first_vertex =
          find_first_row("normals", first, rows.shape(0), high.normals.size());
      const auto* const begin = reinterpret_cast<const Vec3*>(rows.data());
      const std::vector<Vec3> normals(begin, begin + rows.shape(0));
      with_parameter("normals",
                     [&] { call.run([&] { work.session.set_normals(first_vertex, normals); }); });
      normals_were_set_ = true;
    });
  }

  PyBake bake() {
    const Call call;
    return work_.call_with_session([&](Work& work) {
      std::vector<Warning> notes;
      BakeResult result = call.run([&] {
        BakeResult baked = work.session.bake();
        notes = check_normals(work.session.high());
        check_result(baked.report, work.session.high(), work.request->low());
        return baked;
      });
      result.report.warnings.insert(result.report.warnings.begin(), notes.begin(), notes.end());
      return wrap_bake_result(std::move(result), *work.request, low_name_);
    });
  }

  /// Returns (triangles, texels, matched, (x, y, width, height), seconds).
  nb::tuple last_update() {
    return work_.call_with_session([](Work& work) {
      const BakeSession::Update& u = work.session.last_update();
      const Rectangle& box = u.dirty;
      return nb::make_tuple(u.triangles, u.texels, u.matched,
                            nb::make_tuple(box.x, box.y, box.width, box.height), u.seconds());
    });
  }

  /// Returns a copy of the current mesh.
  PyMesh mesh() {
    return work_.call_with_session([&](Work& work) {
      PyMesh copy = high_;
      copy.mesh = make_shared_mesh(Mesh(work.session.high()));
      return copy;
    });
  }

  /// Returns the two corners of the box in world units.
  nb::tuple bounds() {
    return work_.call_with_session([](Work& work) {
      const auto world = [&](const std::array<double, 3>& corner) {
        const std::array<double, 3>& origin = work.session.high().origin;
        return nb::make_tuple(origin[0] + corner[0], origin[1] + corner[1], origin[2] + corner[2]);
      };
      const Bounds& box = work.session.bounds();
      return nb::make_tuple(world(box.low), world(box.high));
    });
  }

  void close() { work_.close(); }
  bool closed() const { return work_.closed(); }

 private:
  /// The session's options point into the request, so both are kept together.
  struct Work {
    std::unique_ptr<Request> request;
    BakeSession session;
  };

  /// Warns if positions moved but explicit normals did not, since these do not follow positions.
  std::vector<Warning> check_normals(const Mesh& high) {
    std::vector<Warning> notes;
    const std::uint64_t moved_count = std::exchange(moved_vertices_, 0);
    const bool normals_were_set = std::exchange(normals_were_set_, false);
    if (high.normals.empty() || (moved_count == 0 && !normals_were_set)) return notes;
    if (!normals_were_set) {
      notes.push_back({"normals-stayed",
                       "'" + high.name + "' has explicit normals, which did not change when " +
                           std::to_string(moved_count) +
                           " of its vertices moved: update them by set_normals(). Normals of a "
                           "mesh without explicit ones are updated automatically.",
                       moved_count});
    }
    std::vector<Warning> opposed_warnings;
    Mesh copy = high;
    correct_normals("HIGH", Trusted::faces, copy, opposed_warnings);
    for (const Warning& warning : opposed_warnings) {
      if (warning.code != "turned-normals") continue;
      notes.push_back({"normals-oppose",
                       "Normals of '" + high.name +
                           "' oppose its faces after a change. The session uses them unchanged, "
                           "but kiln.bake() would flip them.",
                       warning.count});
    }
    return notes;
  }

  PyMesh high_;  // the initial mesh, with its file
  std::string low_name_;
  std::uint64_t moved_vertices_ = 0;  // number of vertices that moved since the last bake
  bool normals_were_set_ = false;     // true if normals were set since the last bake
  Exclusive<Work> work_;
};

class PyViewSession {
 public:
  PyViewSession(const PySource& source, const PyMesh& low, const Keywords& words)
      : high_(source.high) {
    const Call call;
    auto request = std::make_unique<Request>(words, nullptr, std::vector<PyMesh>(), true, false);
    const Source source_copy = source.get();
    std::vector<Warning> warnings;
    work_.set(call.run([&] {
      request->prepare(&source_copy, source.high, source.faces_inwards, low);
      warnings = request->warnings;
      ViewSession session(source_copy, request->low(), request->options);
      return std::make_shared<Work>(Work{std::move(request), std::move(session)});
    }));
    warn(warnings);
  }

  /// Adds a view. \returns (samples, decided, changed)
  nb::tuple add(nb::handle direction) {
    const Call call;
    const auto xyz = doubles(direction, "direction", {3});
    const Vec3 toward = {static_cast<float>(xyz.data()[0]), static_cast<float>(xyz.data()[1]),
                         static_cast<float>(xyz.data()[2])};
    return work_.call_with_session([&](Work& work) {
      const ViewSession::Step step = with_parameter("direction", [&] {
        // No progress is reported, so that a view cannot be cancelled half-way, after some samples have used it.
        const nb::gil_scoped_release unlocked;
        return work.session.add(toward);
      });
      ++views_;
      return nb::make_tuple(step.samples, step.decided, step.changed);
    });
  }

  PyMatch match() {
    const Call call;
    return work_.call_with_session([&](Work& work) {
      auto found = call.run([&] { return std::make_shared<const Match>(work.session.match()); });
      const auto count = [&](SampleStatus status) {
        return std::count(found->status.begin(), found->status.end(),
                          static_cast<std::uint8_t>(status));
      };
      nb::dict report;
      report["views"] = views_;
      report["viewed"] = count(SampleStatus::view);
      report["missed"] = count(SampleStatus::missed);
      return PyMatch{std::move(found), high_, report};
    });
  }

  void close() { work_.close(); }
  bool closed() const { return work_.closed(); }

 private:
  struct Work {
    std::unique_ptr<Request> request;
    ViewSession session;
  };

  PyMesh high_;
  std::uint64_t views_ = 0;
  Exclusive<Work> work_;
};

}  // namespace

void add_session(nb::module_& module) {
  nb::class_<PyBakeSession>(module, "BakeSessionCore")
      .def(
          "__init__",
          [](PyBakeSession* self, const PyMesh& high, const PyMesh& low, const Keywords& words,
             const std::optional<PyMesh>& cage_mesh, const std::vector<PyMesh>& occluders,
             bool by_high, bool by_low, const nb::list& textures, nb::handle bounds,
             const std::string& device) {
            new (self) PyBakeSession(high, low, words, cage_mesh, occluders, by_high, by_low,
                                     textures, bounds, device);
          },
          "high"_a, "low"_a, "words"_a, "cage_mesh"_a.none(), "occluders"_a, "by_high"_a,
          "by_low"_a, "textures"_a, "bounds"_a.none(), "device"_a)
      .def("set_positions", &PyBakeSession::set_positions, "positions"_a.none(), "first"_a.none())
      .def("set_normals", &PyBakeSession::set_normals, "normals"_a.none(), "first"_a.none())
      .def("bake", &PyBakeSession::bake)
      .def("last_update", &PyBakeSession::last_update)
      .def("mesh", &PyBakeSession::mesh)
      .def("bounds", &PyBakeSession::bounds)
      .def("close", &PyBakeSession::close)
      .def_prop_ro("closed", &PyBakeSession::closed);
  nb::class_<PyViewSession>(module, "ViewSessionCore")
      .def(
          "__init__",
          [](PyViewSession* self, const PySource& source, const PyMesh& low,
             const Keywords& words) { new (self) PyViewSession(source, low, words); },
          "source"_a, "low"_a, "words"_a)
      .def("add", &PyViewSession::add, "direction"_a.none())
      .def("match", &PyViewSession::match)
      .def("close", &PyViewSession::close)
      .def_prop_ro("closed", &PyViewSession::closed);
}

}  // namespace kiln::python
