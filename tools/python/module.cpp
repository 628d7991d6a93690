// kiln._core: the extension module behind kiln/*.py.
#include "asset.h"
#include "bake.h"
#include "call.h"
#include "job.h"
#include "kiln/limits.h"
#include "kiln/version.h"
#include "match.h"
#include "measure.h"
#include "mesh.h"
#include "session.h"
#include "source.h"
#include "surface.h"
#include "volume.h"

NB_MODULE(_core, module) {
  using namespace kiln::python;
  register_errors(module);
  add_mesh(module);
  add_source(module);
  add_match(module);
  add_bake(module);
  add_session(module);
  add_surface(module);
  add_asset(module);
  add_job(module);
  add_measure(module);
  add_volume(module);
  module.def("version", &kiln::version);
  module.def("memory_left", &kiln::memory_left);
}
