// CGAL's as-rigid-as-possible deformation of the whole mesh.
//
//   cgal_arap JOB RUNS ITERATIONS
#include <CGAL/Eigen_solver_traits.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_deformation.h>

#include "peer.hpp"

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
// CGAL's default is an LU factorization; LDLT is the fastest that works with it.
using Solver = CGAL::Eigen_solver_traits<
    Eigen::SimplicialLDLT<CGAL::Eigen_sparse_matrix<double>::EigenType>>;
using Deformation =
    CGAL::Surface_mesh_deformation<Mesh, CGAL::Default, CGAL::Default, CGAL::ORIGINAL_ARAP, CGAL::Default, Solver>;

int main(int argc, char** argv) {
    if (argc != 4) {
        std::fprintf(stderr, "usage: cgal_arap JOB RUNS ITERATIONS\n");
        return 2;
    }
    const Job job = read_job(argv[1]);
    const unsigned iterations = unsigned(std::atoi(argv[3]));
    Phase build("build"), preprocess("preprocess"), iterate("iterations");
    for (int run = 0; run < std::atoi(argv[2]); ++run) {
        Clock building;
        Mesh mesh;
        mesh.reserve(job.points.size(), 3 * job.faces.size() / 2, job.faces.size());
        using Vertex = Mesh::Vertex_index;
        for (const auto& p : job.points) mesh.add_vertex(Kernel::Point_3(p[0], p[1], p[2]));
        for (const auto& f : job.faces) mesh.add_face(Vertex(f[0]), Vertex(f[1]), Vertex(f[2]));
        build.add(building.seconds());

        Clock preparing;
        Deformation deformation(mesh);
        deformation.insert_roi_vertices(mesh.vertices_begin(), mesh.vertices_end());
        for (uint32_t h : job.handles) deformation.insert_control_vertex(Vertex(h));
        if (!deformation.preprocess()) {
            std::fprintf(stderr, "CGAL: preprocess failed\n");
            return 1;
        }
        preprocess.add(preparing.seconds());
        for (size_t k = 0; k < job.handles.size(); ++k) {
            const auto& t = job.targets[k];
            deformation.set_target_position(Vertex(job.handles[k]), Kernel::Point_3(t[0], t[1], t[2]));
        }
        Clock deforming;
        deformation.deform(iterations, 0.0);
        iterate.add(deforming.seconds());
    }
    std::printf("{\"peer\": \"CGAL ARAP\", \"n\": %zu, \"num_iterations\": %u", job.points.size(), iterations);
    build.print();
    preprocess.print();
    iterate.print();
    std::printf(", \"megabytes\": %.1f}\n", peak_megabytes());
    return 0;
}
