/// What the rows of the collision benchmark are measured on, and who measures which.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/query/TimeOfImpact.h"
#include "tests/bench/CollisionTable.h"
#include "tests/support/fcl/FclPeer.h"

namespace tessera {

struct BenchPair {
    std::string name;
    TriangleMesh a, b;
    std::vector<Affine3d> poses;      ///< a_T_b
    std::vector<std::size_t> near;    ///< those of `poses` that nearly touch
    std::vector<BodyMotion> motions;  ///< of B; A stays
};

struct BenchOptions {
    int passes = 3;
    std::set<std::string> only;  ///< groups of rows; empty: all
    [[nodiscard]] bool wants(const std::string& group) const { return only.empty() || only.count(group) > 0; }
};

/// The two kinds of FCL that its rows are beside.
struct FclPairs {
    FclPairs(const TriangleMesh& a, const TriangleMesh& b)
        : obb(a, b, FclVolume::kObb), obbRss(a, b, FclVolume::kObbRss) {}
    FclPair obb, obbRss;
};

/// any, any near, all: beside FCL.
void touchRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table);
/// Contacts with points and normals: beside FCL with contacts on.
void contactRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table);
/// distance cold and warm: beside FCL.
void distanceRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table);
/// toi: beside conservative advancement over FCL's distance.
void impactRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table);
/// Realigned 18-DOPs beside our own boxes.
void volumeRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table);
/// Boxes, planes and tables beside each other, in queries over k-DOPs. Only when asked for by name.
void realignmentRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table);
/// Build beside Bullet, refit and memory beside FCL.
void treeRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table);
/// Of them, memory beside FCL.
void memoryRows(const BenchPair& pair, CollisionTable& table);
/// Two threads beside one.
void threadRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table);

/// The values at some places.
[[nodiscard]] inline std::vector<double> pick(const std::vector<double>& all, const std::vector<std::size_t>& at) {
    std::vector<double> out;
    for (const std::size_t i : at) out.push_back(all[i]);
    return out;
}

/// The peer's better contender, by mean, with its name.
struct Better {
    Summary summary;
    std::string name;
};
[[nodiscard]] inline Better betterOf(const std::string& nameA, const std::vector<double>& a, const std::string& nameB,
                                     const std::vector<double>& b) {
    const Summary x = summarise(a), y = summarise(b);
    return x.mean <= y.mean ? Better{x, nameA} : Better{y, nameB};
}

}  // namespace tessera
