// Bakes an OpenMesh mesh: Kiln makes the low poly and its maps. openmesh HIGH GAME.glb
#include <kiln/interop/openmesh.h>
#include <kiln/job.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <cstdio>

int main(int count, char** arguments) {
  OpenMesh::PolyMesh_ArrayKernelT<> high;
  if (count != 3 || !OpenMesh::IO::read_mesh(high, arguments[1])) return 2;
  const kiln::Job job{
      .high = {kiln::from_openmesh(high)}, .low = kiln::MakeLow{.faces = 500}, .out = arguments[2]};
  const kiln::Mesh low = kiln::run(kiln::Device::open(), job).low;
  std::printf("%zu faces of OpenMesh, %zu of the low poly\n", high.n_faces(), low.triangles.size());
}
