#include "tools/export/elements.h"

#include "base/check.h"
#include "base/planar_polygon.h"
#include "solver/solution/display_solution.h"

namespace enfilade {
namespace {

void CheckCorners(const LeafElement& leaf) {
  ENFILADE_CHECK(leaf.corners.size() == 3 || leaf.corners.size() == 4,
                 "{} corners",
                 leaf.corners.size());
}

void PassVertices(const Solution& solution,
                  const DisplayMesh& mesh,
                  const Patch& patch,
                  const MeshSink& sink) {
  const std::vector<double> areas_m2 = mesh.VertexAreas();
  for (size_t v = 0; v < mesh.VertexCount(); ++v) {
    const Rgb irradiance = mesh.Irradiance(v);
    sink.vertex({mesh.Position(v),
                 solution.RadiosityOf(patch, irradiance),
                 irradiance,
                 areas_m2[v]});
  }
}

// The mesh's first vertex is number `first`.
void PassFaces(CellId cell,
               const DisplayMesh& mesh,
               uint64_t first,
               const MeshSink& sink) {
  mesh.ForEachTriangle([&](const DisplayTriangle& triangle) {
    MeshFace face{cell, triangle.patch, 3};
    for (size_t k = 0; k < triangle.vertices.size(); ++k) {
      face.vertices.at(k) = first + triangle.vertices.at(k);
    }
    sink.face(face);
  });
}

}  // namespace

void ForEachFace(const MeshSource& source,
                 const ExportProgress& progress,
                 const MeshSink& sink) {
  uint64_t first = 0;
  for (size_t c = 0; c < source.cells; ++c) {
    uint64_t count = 0;
    MeshSink renumber;
    renumber.vertex = [&](const MeshVertex& vertex) {
      ++count;
      sink.vertex(vertex);
    };
    renumber.face = [&](const MeshFace& face) {
      MeshFace numbered = face;
      for (uint64_t& vertex : numbered.vertices) {
        vertex += first;
      }
      sink.face(numbered);
    };
    source.for_each(CellId(c), renumber);
    first += count;
    if (progress) {
      progress(static_cast<double>(c + 1) / static_cast<double>(source.cells));
    }
  }
}

MeshSource LeavesOf(const ElementSource& source) {
  MeshSource mesh;
  mesh.cells = source.cells;
  mesh.for_each = [source](CellId cell, const MeshSink& sink) {
    uint64_t next = 0;
    source.for_each_leaf(cell, [&](const LeafElement& leaf) {
      CheckCorners(leaf);
      const double area_m2 =
          PolygonArea(leaf.corners) / static_cast<double>(leaf.corners.size());
      MeshFace face{cell, leaf.patch};
      face.count = static_cast<uint8_t>(leaf.corners.size());
      for (size_t i = 0; i < face.count; ++i) {
        sink.vertex(
            {leaf.corners[i], leaf.radiosity[i], leaf.irradiance[i], area_m2});
        face.vertices.at(i) = next++;
      }
      sink.face(face);
    });
  };
  return mesh;
}

MeshSource DisplayMeshOf(const Solution& solution,
                         const DisplayOptions& options) {
  MeshSource mesh;
  mesh.cells = solution.CellCount();
  mesh.for_each = [&solution, options](CellId cell, const MeshSink& sink) {
    uint64_t first = 0;
    ForEachDisplayMesh(solution,
                       cell,
                       options,
                       [&](const DisplayMesh& piece, const Patch& patch) {
                         PassVertices(solution, piece, patch, sink);
                         PassFaces(cell, piece, first, sink);
                         first += piece.VertexCount();
                       });
  };
  return mesh;
}

MeshCensus TakeCensus(const MeshSource& source,
                      const ExportProgress& progress) {
  MeshCensus census;
  MeshSink sink;
  sink.vertex = [&](const MeshVertex& vertex) {
    ++census.vertices;
    census.bounds.Include(vertex.position);
    census.meter.Add(vertex.radiosity, vertex.area_m2);
  };
  sink.face = [&](const MeshFace& face) {
    ++census.faces;
    ++(face.count == 4 ? census.quads : census.triangles);
  };
  ForEachFace(source, progress, sink);
  return census;
}

}  // namespace enfilade
