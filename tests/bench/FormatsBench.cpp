/// What files of a format cost to read, beside others that hold the same: compressed glTF beside its plain twin, and
/// our own readers of OBJ, STL, PLY, 3MF and AMF beside assimp. Processor time of a process of its own each, the median
/// of some turns, both in each turn. `--json FILE`, `--triangles N` (3,000,000), `--turns N` (5); with `--large`
/// instead the memory of 30,000,000 triangles, beside the arrays that come out.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/import/reader/ReadScene.h"
#include "tests/bench/CaseFile.h"
#include "tests/bench/FormatFiles.h"

namespace tessera::bench {
namespace {

/// What one process took.
struct Taken {
    double seconds = 0, peakBytes = 0;
    std::uint64_t result = 0;  ///< what the work said
};

Taken inChild(const std::function<std::uint64_t()>& work) {
    int ends[2] = {};
    if (::pipe(ends) != 0) std::abort();
    const pid_t child = ::fork();
    if (child == 0) {
        const std::uint64_t result = work();
        const bool written = ::write(ends[1], &result, sizeof(result)) == sizeof(result);
        ::_exit(written ? 0 : 1);
    }
    ::close(ends[1]);
    Taken taken;
    rusage usage{};
    int status = 0;
    const bool isRead = ::read(ends[0], &taken.result, sizeof(taken.result)) == sizeof(taken.result);
    ::close(ends[0]);
    if (child < 0 || ::wait4(child, &status, 0, &usage) != child || !isRead || status != 0) {
        fmt::print(stderr, "a reader died\n");
        std::exit(1);
    }
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    taken.seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    taken.peakBytes = static_cast<double>(usage.ru_maxrss) * 1024;
    return taken;
}

/// Bytes of the arrays that come out of it.
std::uint64_t readByUs(const std::string& path) {
    const Expected<PlainScene> scene = readScene(path, {});
    if (!scene) {
        fmt::print(stderr, "{}: {}\n", path, scene.error().message);
        ::_exit(1);
    }
    std::uint64_t bytes = 0;
    for (const Bytes& blob : scene->blobs) bytes += blob.size();
    return bytes;
}

/// As the importer asks it for other formats; `isAlone`: what it reads, with nothing done to it.
std::uint64_t readByAssimp(const std::string& path, bool isAlone) {
    Assimp::Importer importer;
    importer.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, 60.0f);
    const unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_GenSmoothNormals |
                           aiProcess_GenUVCoords | aiProcess_ValidateDataStructure | aiProcess_FlipUVs |
                           aiProcess_JoinIdenticalVertices;
    const aiScene* const scene = importer.ReadFile(path, isAlone ? 0 : steps);
    if (scene == nullptr || scene->mNumMeshes == 0) {
        fmt::print(stderr, "{}: {}\n", path, importer.GetErrorString());
        ::_exit(1);
    }
    return scene->mMeshes[0]->mNumVertices;
}

double median(std::vector<double> all) {
    std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2));
    return all[all.size() / 2];
}

class FormatTable {
public:
    FormatTable(CaseFile file, int turns) : file_(std::move(file)), turns_(turns) {
        fmt::print("{:<44} {:<26} {:>8} {:>8} {:>6} {:>6}\n", "processor time, s", "beside", "ours", "theirs", "ratio",
                   "limit");
    }
    void row(const std::string& name, const std::string& peer, double limit, const std::function<std::uint64_t()>& ours,
             const std::function<std::uint64_t()>& theirs) {
        std::vector<double> own, other;
        for (int turn = 0; turn < turns_; ++turn) {
            own.push_back(inChild(ours).seconds);
            other.push_back(inChild(theirs).seconds);
        }
        print(name, peer, limit, median(own), median(other), "s");
    }
    void memory(const std::string& name, const std::function<std::uint64_t()>& ours) {
        const Taken taken = inChild(ours);
        print(name, "its arrays", 3, taken.peakBytes / 1e6, static_cast<double>(taken.result) / 1e6, "MB");
    }
    [[nodiscard]] int write() const { return file_.write(); }

private:
    void print(const std::string& name, const std::string& peer, double limit, double ours, double theirs,
               const std::string& unit) {
        fmt::print("{:<44} {:<26} {:>8.3f} {:>8.3f} {:>6.2f} {:>6.1f}\n", name, peer, ours, theirs, ours / theirs,
                   limit);
        std::fflush(stdout);
        file_.add(name, peer, ours, theirs, unit);
    }
    CaseFile file_;
    int turns_;
};

int run(CaseFile file, std::size_t triangles, int turns, bool isLarge) {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / fmt::format("tessera-formats-{}", ::getpid());
    std::filesystem::create_directories(folder);
    const auto at = [&](const char* name) { return (folder / name).string(); };
    FormatTable table(std::move(file), turns);
    const auto meshRow = [&](const char* name, const char* what, std::size_t many, auto&& write) {
        const std::string path = at(name);
        write(path, waves(many));
        const auto ours = [path] { return readByUs(path); };
        if (isLarge) {
            table.memory(fmt::format("{}, {:.0f} M triangles, MB", what, static_cast<double>(many) / 1e6), ours);
        } else {
            const std::string of = fmt::format("{}, {:.1f} M triangles", what, static_cast<double>(many) / 1e6);
            table.row(of, "assimp, as we asked it", 0.3, ours, [path] { return readByAssimp(path, false); });
            table.row(of, "assimp, reading alone", 1, ours, [path] { return readByAssimp(path, true); });
        }
        std::filesystem::remove(path);
    };
    meshRow("places.obj", "OBJ of places", triangles,
            [](const auto& path, const auto& w) { writeObj(path, w, false); });
    if (!isLarge)
        meshRow("all.obj", "OBJ with coordinates and normals", triangles,
                [](const auto& path, const auto& w) { writeObj(path, w, true); });
    meshRow("bytes.ply", "PLY in bytes", triangles, [](const auto& path, const auto& w) { writePly(path, w, false); });
    if (!isLarge)
        meshRow("text.ply", "PLY in text", triangles, [](const auto& path, const auto& w) { writePly(path, w, true); });
    meshRow("bytes.stl", "STL in bytes", triangles, [](const auto& path, const auto& w) { writeStl(path, w, false); });
    if (!isLarge)
        meshRow("text.stl", "STL in text", triangles / 3,
                [](const auto& path, const auto& w) { writeStl(path, w, true); });
    meshRow("packed.3mf", "3MF, deflated", triangles, [](const auto& path, const auto& w) { writeThreeMf(path, w); });
    // Assimp takes the square of it.
    if (!isLarge)
        meshRow("text.amf", "AMF", triangles / 30, [](const auto& path, const auto& w) { writeAmf(path, w); });
    if (!isLarge) {
        const Waves mesh = waves(triangles / 3);
        const std::string plain = at("plain.glb");
        writeGlb(plain, mesh, GlbKind::kPlain);
        for (const auto& [kind, what] : {std::pair(GlbKind::kDraco, "Draco"), std::pair(GlbKind::kMeshopt, "meshopt"),
                                         std::pair(GlbKind::kQuantised, "quantised")}) {
            const std::string path = at("packed.glb");
            writeGlb(path, mesh, kind);
            table.row(
                fmt::format("glTF, {}, {:.1f} M triangles", what, static_cast<double>(triangles) / 3e6),
                "its plain twin", 2, [path] { return readByUs(path); }, [plain] { return readByUs(plain); });
        }
    }
    std::filesystem::remove_all(folder);
    return table.write();
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    std::size_t triangles = 0;
    int turns = 5;
    bool isLarge = false;
    for (int i = 1; i < argc; ++i) {
        const std::string_view word = argv[i];
        isLarge = isLarge || word == "--large";
        if (word == "--triangles" && i + 1 < argc) triangles = std::strtoull(argv[i + 1], nullptr, 10);
        if (word == "--turns" && i + 1 < argc) turns = std::max(1, std::atoi(argv[i + 1]));
    }
    if (triangles == 0) triangles = isLarge ? 30'000'000 : 3'000'000;
    return tessera::bench::run(tessera::bench::CaseFile(argc, argv), triangles, turns, isLarge);
}
