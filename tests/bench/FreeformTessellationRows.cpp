// The peer: OpenSubdiv's tables of limit stencils, and its patches after three levels of adaptive refinement, whichever
// is faster; both in its plain CPU kernels, which give points and two tangents. Ours give points and unit normals,
// which are made of the tangents. Points that faces share count once on either side.
#include "tests/bench/FreeformTessellationRows.h"

#ifdef TESSERA_OPENSUBDIV
#include <fmt/format.h>
#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/osd/cpuEvaluator.h>
#include <opensubdiv/osd/cpuPatchTable.h>
#include <opensubdiv/osd/types.h>

#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include "common/freeform/subdivision/LimitEvaluator.h"
#include "common/freeform/subdivision/LimitTessellation.h"
#endif

namespace tessera {

#ifdef TESSERA_OPENSUBDIV
namespace {

namespace far = OpenSubdiv::Far;
namespace osd = OpenSubdiv::Osd;

constexpr int kAdaptiveLevel = 3;

std::unique_ptr<far::TopologyRefiner> refinerOf(const ControlMesh& mesh) {
    const std::vector<int> sizes(mesh.faceSizes.begin(), mesh.faceSizes.end()),
        vertices(mesh.faceVertices.begin(), mesh.faceVertices.end());
    far::TopologyDescriptor d;
    d.numVertices = static_cast<int>(mesh.positions.size());
    d.numFaces = static_cast<int>(sizes.size());
    d.numVertsPerFace = sizes.data();
    d.vertIndicesPerFace = vertices.data();
    OpenSubdiv::Sdc::Options options;
    options.SetVtxBoundaryInterpolation(OpenSubdiv::Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    using Factory = far::TopologyRefinerFactory<far::TopologyDescriptor>;
    std::unique_ptr<far::TopologyRefiner> refiner(
        Factory::Create(d, Factory::Options(OpenSubdiv::Sdc::SCHEME_CATMARK, options)));
    refiner->RefineAdaptive(far::TopologyRefiner::AdaptiveOptions(kAdaptiveLevel));
    return refiner;
}

/// Points and tangents in the order of the places.
struct PeerArrays {
    std::vector<float> points, du, dv;
    explicit PeerArrays(std::size_t count) : points(3 * count), du(3 * count), dv(3 * count) {}
};
const osd::BufferDescriptor kXyz(0, 3, 3);

class PeerStencils {
public:
    PeerStencils(const ControlMesh& mesh, const std::vector<PtexPoint>& places) {
        const auto refiner = refinerOf(mesh);
        using Factory = far::LimitStencilTableFactoryReal<float>;
        std::vector<float> s(places.size()), t(places.size());
        Factory::LocationArrayVec locations;
        for (std::size_t i = 0; i < places.size(); ++i) {
            s[i] = static_cast<float>(places[i].u);
            t[i] = static_cast<float>(places[i].v);
            if (i == 0 || places[i].face != places[i - 1].face) {
                Factory::LocationArray& next = locations.emplace_back();
                next.ptexIdx = static_cast<int>(places[i].face);
                next.s = &s[i];
                next.t = &t[i];
            }
            ++locations.back().numLocations;
        }
        table_.reset(static_cast<const far::LimitStencilTable*>(Factory::Create(*refiner, locations)));
    }
    [[nodiscard]] std::size_t count() const { return table_ ? static_cast<std::size_t>(table_->GetNumStencils()) : 0; }
    void evaluate(const std::vector<float>& control, PeerArrays& out) const {
        osd::CpuEvaluator::EvalStencils(control.data(), kXyz, out.points.data(), kXyz, out.du.data(), kXyz,
                                        out.dv.data(), kXyz, table_->GetSizes().data(), table_->GetOffsets().data(),
                                        table_->GetControlIndices().data(), table_->GetWeights().data(),
                                        table_->GetDuWeights().data(), table_->GetDvWeights().data(), 0,
                                        table_->GetNumStencils());
    }

private:
    std::unique_ptr<const far::LimitStencilTable> table_;
};

class PeerPatches {
public:
    PeerPatches(const ControlMesh& mesh, const std::vector<PtexPoint>& places) : controls_(mesh.positions.size()) {
        const auto refiner = refinerOf(mesh);
        far::PatchTableFactory::Options options;
        options.SetEndCapType(far::PatchTableFactory::Options::ENDCAP_GREGORY_BASIS);
        const std::unique_ptr<far::PatchTable> patches(far::PatchTableFactory::Create(*refiner, options));
        const std::unique_ptr<const far::StencilTable> vertices(far::StencilTableFactory::Create(*refiner));
        if (const far::StencilTable* local = patches->GetLocalPointStencilTable())
            stencils_.reset(far::StencilTableFactory::AppendLocalPointStencilTable(*refiner, vertices.get(), local));
        if (!stencils_) stencils_.reset(far::StencilTableFactory::Create(*refiner));
        patches_.reset(osd::CpuPatchTable::Create(patches.get()));
        const far::PatchMap map(*patches);
        for (const PtexPoint& at : places) {
            const far::PatchTable::PatchHandle* handle = map.FindPatch(static_cast<int>(at.face), at.u, at.v);
            if (handle != nullptr) coords_.emplace_back(*handle, static_cast<float>(at.u), static_cast<float>(at.v));
        }
        refined_.resize(3 * (controls_ + static_cast<std::size_t>(stencils_->GetNumStencils())));
    }
    [[nodiscard]] std::size_t count() const { return coords_.size(); }
    void evaluate(const std::vector<float>& control, PeerArrays& out) {
        std::copy(control.begin(), control.end(), refined_.begin());
        osd::CpuEvaluator::EvalStencils(refined_.data(), kXyz, refined_.data() + 3 * controls_, kXyz,
                                        stencils_->GetSizes().data(), stencils_->GetOffsets().data(),
                                        stencils_->GetControlIndices().data(), stencils_->GetWeights().data(), 0,
                                        stencils_->GetNumStencils());
        osd::CpuEvaluator::EvalPatches(refined_.data(), kXyz, out.points.data(), kXyz, out.du.data(), kXyz,
                                       out.dv.data(), kXyz, static_cast<int>(coords_.size()), coords_.data(),
                                       patches_->GetPatchArrayBuffer(), patches_->GetPatchIndexBuffer(),
                                       patches_->GetPatchParamBuffer());
    }

private:
    std::size_t controls_;
    std::unique_ptr<const far::StencilTable> stencils_;
    std::unique_ptr<osd::CpuPatchTable> patches_;
    std::vector<osd::PatchCoord> coords_;
    std::vector<float> refined_;
};

struct Places {
    std::vector<PtexPoint> at;
    std::vector<Vec3d> points;
};

/// Each point of the tessellation once, face by face.
Places placesOf(const ControlMesh& mesh, const LimitTessellation& ours) {
    LimitEvaluator evaluator(ours.topology());
    std::set<std::array<long, 3>> known;
    Places out;
    for (std::uint32_t f = 0; f < ours.topology().ptexFaceCount(); ++f) {
        const int n = (1 << ours.level()) / (ours.topology().ptexFace(f).corner == kNoIndex ? 1 : 2);
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) {
                const PtexPoint at{f, static_cast<double>(i) / n, static_cast<double>(j) / n};
                const Vec3d p = evaluator.evaluate(mesh.positions, at).value().point;
                if (!known.insert({std::lround(p.x() * 1e7), std::lround(p.y() * 1e7), std::lround(p.z() * 1e7)})
                         .second)
                    continue;
                out.at.push_back(at);
                out.points.push_back(p);
            }
    }
    return out;
}

double farthestOff(const std::vector<Vec3d>& wanted, const std::vector<float>& got) {
    double most = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i)
        most = std::max(most, (Vec3d(got[3 * i], got[3 * i + 1], got[3 * i + 2]) - wanted[i]).norm());
    return most;
}

}  // namespace

void addTessellationRows(const std::string& name, const ControlMesh& mesh, int passes, CollisionTable& table) {
    if (!mesh.creases.empty() || !mesh.corners.empty() || !mesh.holes.empty()) return;
    for (const int level : {2, 4}) {
        const auto ours = LimitTessellation::build(mesh, level).value();
        const Places places = placesOf(mesh, *ours);
        const std::string title =
            fmt::format("{}: {} control faces, {} points", name, mesh.faceSizes.size(), places.at.size());
        const PeerStencils stencils(mesh, places.at);
        PeerPatches patches(mesh, places.at);
        // Where a few points lie on both sides of a rounding they count twice.
        if (std::abs(static_cast<double>(places.at.size()) - static_cast<double>(ours->vertexCount())) >
                0.01 * static_cast<double>(ours->vertexCount()) ||
            stencils.count() != places.at.size() || patches.count() != places.at.size()) {
            table.complain(fmt::format("{}: {} points, {} of ours, {} stencils, {} places in patches", title,
                                       places.at.size(), ours->vertexCount(), stencils.count(), patches.count()));
            continue;
        }
        std::vector<float> control;
        for (const Vec3d& p : mesh.positions)
            for (int k = 0; k < 3; ++k) control.push_back(static_cast<float>(p[k]));
        std::vector<float> positions(3 * ours->vertexCount()), normals(positions.size());
        PeerArrays byStencils(places.at.size()), byPatches(places.at.size());
        const std::vector<std::uint32_t> one{0};
        constexpr std::size_t kFrames = 8;
        const auto taken = raceInTurns(kFrames, passes,
                                       {[&](std::size_t) { ours->evaluate(control, positions, normals); },
                                        [&](std::size_t) { stencils.evaluate(control, byStencils); },
                                        [&](std::size_t) { patches.evaluate(control, byPatches); },
                                        [&](std::size_t) { (void)ours->update(one, control, positions, normals); }});
        for (const PeerArrays* peer : {&byStencils, &byPatches})
            if (const double off = farthestOff(places.points, peer->points); off > 2e-3)
                table.complain(fmt::format("{}: OpenSubdiv's points are off by {}", title, off));
        std::array<Summary, 4> each;
        for (std::size_t c = 0; c < 4; ++c) each[c] = summarise(taken[c]);
        const bool byTable = each[1].mean < each[2].mean;
        table.add({.pair = title,
                   .operation = "points and tangents of a frame",
                   .peer = byTable ? "OpenSubdiv, stencils" : "OpenSubdiv, patches",
                   .ours = each[0],
                   .theirs = each[byTable ? 1 : 2],
                   .atMost = 1.0,
                   .aim = 0.5,
                   .remark = {}});
        table.add({.pair = title,
                   .operation = "points and tangents of a frame",
                   .peer = byTable ? "OpenSubdiv, patches" : "OpenSubdiv, stencils",
                   .ours = each[0],
                   .theirs = each[byTable ? 2 : 1],
                   .remark = {}});
        table.add({.pair = title,
                   .operation = "one control point moved",
                   .peer = "OpenSubdiv, all points",
                   .ours = each[3],
                   .theirs = each[byTable ? 1 : 2],
                   .remark = {}});
    }
}
#else
void addTessellationRows(const std::string&, const ControlMesh&, int, CollisionTable&) {}
#endif

}  // namespace tessera
