/// FCL 0.7 as Debian ships it, on two meshes: a witness in tests and the peer in benchmarks. Its package is built for
/// SSE2; whatever includes FCL's headers must be compiled without flags for newer processors, or layouts differ.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

enum class FclVolume : std::uint8_t { kObb, kObbRss };

class FclPair {
public:
    FclPair(const TriangleMesh& a, const TriangleMesh& b, FclVolume volume);
    ~FclPair();
    FclPair(FclPair&&) noexcept;

    /// Contacts off: the question FCL answers exactly as the peers' figures were taken. `a_T_b` must be rigid.
    [[nodiscard]] bool any(const Affine3d& a_T_b) const;
    /// Number of triangle pairs that meet.
    [[nodiscard]] std::size_t all(const Affine3d& a_T_b) const;
    /// Contacts on: number of contact points (up to two per pair of triangles).
    [[nodiscard]] std::size_t contacts(const Affine3d& a_T_b) const;
    /// 0 where they meet. With nearest points, as ours computes them too. kObbRss only.
    [[nodiscard]] double distance(const Affine3d& a_T_b) const;

private:
    struct Models;
    std::unique_ptr<Models> models_;
};

/// One model of FCL's KDOP<18> kind, for refits.
class FclDeformingModel {
public:
    explicit FclDeformingModel(const TriangleMesh& mesh);
    ~FclDeformingModel();
    /// States of one position per vertex of arraysOf(mesh); from here on in FCL's own type.
    void prepare(const std::vector<std::vector<double>>& states);
    /// To one of them, bottom up.
    void refit(std::size_t state);

private:
    struct Model;
    std::unique_ptr<Model> model_;
};

/// What FCL's own memUsage() prints for a model of its OBB kind: volumes, triangles, vertices. (Its nodes hold
/// more than their volume, so this flatters it.)
[[nodiscard]] std::size_t fclObbBytes(const TriangleMesh& mesh);

}  // namespace tessera
