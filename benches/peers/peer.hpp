// Code shared by the C++ peers: reading the mesh and the handles, clocks, medians, JSON.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <sys/resource.h>
#include <vector>

struct Job {
    std::vector<std::array<double, 3>> points;
    std::vector<std::array<uint32_t, 3>> faces;
    std::vector<uint32_t> handles;
    std::vector<std::array<double, 3>> targets;
};

// The format is described in README.md.
inline Job read_job(const char* path) {
    FILE* file = std::fopen(path, "rb");
    if (!file) {
        std::perror(path);
        std::exit(2);
    }
    uint64_t counts[3];
    auto read = [&](void* to, size_t size, size_t count) {
        if (std::fread(to, size, count, file) != count) {
            std::fprintf(stderr, "%s: too short\n", path);
            std::exit(2);
        }
    };
    read(counts, 8, 3);
    Job job;
    job.points.resize(counts[0]);
    job.faces.resize(counts[1]);
    job.handles.resize(counts[2]);
    job.targets.resize(counts[2]);
    read(job.points.data(), 24, counts[0]);
    read(job.faces.data(), 12, counts[1]);
    read(job.handles.data(), 4, counts[2]);
    read(job.targets.data(), 24, counts[2]);
    std::fclose(file);
    return job;
}

// Wall and processor seconds since its construction.
class Clock {
  public:
    Clock() : wall_(now(CLOCK_MONOTONIC)), cpu_(now(CLOCK_PROCESS_CPUTIME_ID)) {}
    std::array<double, 2> seconds() const {
        return {now(CLOCK_MONOTONIC) - wall_, now(CLOCK_PROCESS_CPUTIME_ID) - cpu_};
    }

  private:
    static double now(clockid_t id) {
        timespec t;
        clock_gettime(id, &t);
        return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
    }
    double wall_, cpu_;
};

// The medians of one phase over the runs, printed as "name": [wall, cpu].
class Phase {
  public:
    explicit Phase(const char* name) : name_(name) {}
    void add(std::array<double, 2> seconds) { runs_.push_back(seconds); }
    void print() const {
        std::array<double, 2> median{};
        for (int k = 0; k < 2; ++k) {
            std::vector<double> values;
            for (auto& run : runs_) values.push_back(run[k]);
            std::sort(values.begin(), values.end());
            median[k] = values.empty() ? 0.0 : values[values.size() / 2];
        }
        std::printf(", \"%s\": [%.6g, %.6g]", name_, median[0], median[1]);
    }

  private:
    const char* name_;
    std::vector<std::array<double, 2>> runs_;
};

inline double peak_megabytes() {
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024.0;
}
