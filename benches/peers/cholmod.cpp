// Supernodal CHOLMOD on the two matrices used to solve a deformation:
//   L    the cotangent matrix with its first vertex grounded
//   AtA  L'L plus one on the diagonal of each handle
//
//   cholmod JOB L|AtA amd|metis RUNS
#include <cholmod.h>

#include <cmath>
#include <cstring>

#include "peer.hpp"

// The lower triangle of the cotangent matrix, or the whole matrix if `full`.
static cholmod_sparse* cotangent_matrix(const Job& job, bool full, cholmod_common* c) {
    const int n = int(job.points.size());
    const size_t most = 12 * job.faces.size();
    cholmod_triplet* t = cholmod_allocate_triplet(n, n, most, full ? 0 : -1, CHOLMOD_REAL, c);
    auto* rows = static_cast<int*>(t->i);
    auto* columns = static_cast<int*>(t->j);
    auto* values = static_cast<double*>(t->x);
    auto add = [&](int i, int j, double w) {
        if (!full && i < j) return;
        rows[t->nnz] = i;
        columns[t->nnz] = j;
        values[t->nnz++] = w;
    };
    for (const auto& face : job.faces) {
        for (int k = 0; k < 3; ++k) {
            const int at = int(face[k]), i = int(face[(k + 1) % 3]), j = int(face[(k + 2) % 3]);
            double u[3], v[3];
            for (int x = 0; x < 3; ++x) {
                u[x] = job.points[i][x] - job.points[at][x];
                v[x] = job.points[j][x] - job.points[at][x];
            }
            const double dot = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
            const double cross[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                     u[0] * v[1] - u[1] * v[0]};
            const double w = dot / std::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
            add(i, i, w);
            add(j, j, w);
            add(i, j, -w);
            add(j, i, -w);
        }
    }
    cholmod_sparse* matrix = cholmod_triplet_to_sparse(t, 0, c);
    cholmod_free_triplet(&t, c);
    return matrix;
}

// Removes the first row and column of a lower triangle.
static cholmod_sparse* grounded(cholmod_sparse* matrix, cholmod_common* c) {
    const int n = int(matrix->nrow);
    std::vector<int> kept(n - 1);
    for (int i = 1; i < n; ++i) kept[i - 1] = i;
    // cholmod_submatrix accepts only unsymmetric matrices.
    matrix->stype = 0;
    cholmod_sparse* part = cholmod_submatrix(matrix, kept.data(), n - 1, kept.data(), n - 1, 1, 1, c);
    part->stype = -1;
    cholmod_free_sparse(&matrix, c);
    return part;
}

static cholmod_sparse* normal(const Job& job, cholmod_common* c) {
    cholmod_sparse* l = cotangent_matrix(job, true, c);
    // L is symmetric: L L' = L'L.
    cholmod_sparse* product = cholmod_aat(l, nullptr, 0, 1, c);
    cholmod_free_sparse(&l, c);
    cholmod_sparse* lower = cholmod_copy(product, -1, 1, c);
    cholmod_free_sparse(&product, c);
    cholmod_sort(lower, c);
    auto* starts = static_cast<int*>(lower->p);
    for (uint32_t h : job.handles) static_cast<double*>(lower->x)[starts[h]] += 1.0;
    return lower;
}

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: cholmod JOB L|AtA amd|metis RUNS\n");
        return 2;
    }
    const Job job = read_job(argv[1]);
    cholmod_common common, *c = &common;
    cholmod_start(c);
    c->supernodal = CHOLMOD_SUPERNODAL;
    c->nmethods = 1;
    c->method[0].ordering = std::strcmp(argv[3], "metis") == 0 ? CHOLMOD_METIS : CHOLMOD_AMD;
    c->postorder = 1;
    cholmod_sparse* matrix =
        std::strcmp(argv[2], "L") == 0 ? grounded(cotangent_matrix(job, false, c), c) : normal(job, c);

    const int n = int(matrix->nrow);
    cholmod_dense* right = cholmod_allocate_dense(n, 3, n, CHOLMOD_REAL, c);
    for (int i = 0; i < 3 * n; ++i) static_cast<double*>(right->x)[i] = std::sin(double(i));
    cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;
    Phase analyse("analyse"), numeric("numeric"), solve("solve");
    double entries = 0.0;
    for (int run = 0; run < std::atoi(argv[4]); ++run) {
        Clock order;
        cholmod_factor* factor = cholmod_analyze(matrix, c);
        analyse.add(order.seconds());
        Clock factorize;
        cholmod_factorize(matrix, factor, c);
        numeric.add(factorize.seconds());
        if (c->status != CHOLMOD_OK) {
            std::fprintf(stderr, "CHOLMOD status %d\n", c->status);
            return 1;
        }
        for (int k = 0; k < 3; ++k) {
            Clock clock;
            cholmod_solve2(CHOLMOD_A, factor, right, nullptr, &x, nullptr, &y, &e, c);
            solve.add(clock.seconds());
        }
        entries = double(factor->xsize);
        cholmod_free_factor(&factor, c);
    }
    std::printf("{\"peer\": \"CHOLMOD\", \"matrix\": \"%s\", \"ordering\": \"%s\", \"n\": %d", argv[2], argv[3], n);
    analyse.print();
    numeric.print();
    solve.print();
    std::printf(", \"entries\": %.0f, \"lnz\": %.0f, \"megabytes\": %.1f}\n", entries, c->lnz, peak_megabytes());
    return 0;
}
