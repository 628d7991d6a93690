// Simplifies a mesh with other libraries, for simplify_bench.py:
//
//     decimate_peer meshoptimizer|openmesh HIGH.obj FACES OUT.obj
//
// HIGH.obj must be welded, and contain only lines "v x y z" and "f a b c". Prints the seconds of the
// simplification, without reading and writing.
#include <meshoptimizer.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using OmMesh = OpenMesh::TriMesh_ArrayKernelT<>;

struct Mesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<unsigned int, 3>> triangles;
};

Mesh read(const char* path) {
  Mesh mesh;
  std::ifstream file(path);
  for (std::string kind; file >> kind;) {
    if (kind == "v") {
      auto& p = mesh.positions.emplace_back();
      file >> p[0] >> p[1] >> p[2];
    } else {
      auto& t = mesh.triangles.emplace_back();
      file >> t[0] >> t[1] >> t[2];
      for (unsigned int& v : t) --v;
    }
  }
  return mesh;
}

void write(const Mesh& mesh, const char* path) {
  std::ofstream file(path);
  file.precision(9);
  for (const auto& p : mesh.positions) file << "v " << p[0] << " " << p[1] << " " << p[2] << "\n";
  for (const auto& t : mesh.triangles) {
    file << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  }
}

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double by_meshoptimizer(const Mesh& high, std::size_t faces, Mesh& low) {
  low.positions = high.positions;
  low.triangles.resize(high.triangles.size());
  const Clock::time_point start = Clock::now();
  const std::size_t count = meshopt_simplify(
      low.triangles.data()->data(), high.triangles.data()->data(), 3 * high.triangles.size(),
      high.positions.data()->data(), high.positions.size(), sizeof(std::array<float, 3>), 3 * faces,
      1.0F, 0, nullptr);
  const double seconds = since(start);
  low.triangles.resize(count / 3);
  return seconds;
}

/// Simplifies by quadrics alone, as in the first example of OpenMesh's manual.
double by_openmesh(const Mesh& high, std::size_t faces, Mesh& low) {
  OmMesh mesh;
  for (const auto& p : high.positions) mesh.add_vertex({p[0], p[1], p[2]});
  const auto vertex = [](unsigned int v) { return OmMesh::VertexHandle(static_cast<int>(v)); };
  for (const auto& t : high.triangles) {
    mesh.add_face(vertex(t[0]), vertex(t[1]), vertex(t[2]));
  }
  const Clock::time_point start = Clock::now();
  OpenMesh::Decimater::DecimaterT<OmMesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<OmMesh>::Handle quadrics;
  decimater.add(quadrics);
  decimater.module(quadrics).unset_max_err();
  decimater.initialize();
  decimater.decimate_to_faces(0, faces);
  const double seconds = since(start);
  mesh.garbage_collection();
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    low.positions.push_back({p[0], p[1], p[2]});
  }
  for (const auto f : mesh.faces()) {
    auto& t = low.triangles.emplace_back();
    std::size_t k = 0;
    for (const auto v : f.vertices()) t[k++] = static_cast<unsigned int>(v.idx());
  }
  return seconds;
}

}  // namespace

int main(int count, char** words) {
  if (count != 5) {
    std::fprintf(stderr, "usage: decimate_peer meshoptimizer|openmesh HIGH.obj FACES OUT.obj\n");
    return 2;
  }
  const std::string library = words[1];
  const std::size_t faces = std::strtoul(words[3], nullptr, 10);
  const Mesh high = read(words[2]);
  Mesh low;
  const double seconds =
      library == "openmesh" ? by_openmesh(high, faces, low) : by_meshoptimizer(high, faces, low);
  write(low, words[4]);
  std::printf("%.6f\n", seconds);
  return 0;
}
