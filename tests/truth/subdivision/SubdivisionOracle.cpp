#include "tests/truth/subdivision/SubdivisionOracle.h"

#ifdef TESSERA_OPENSUBDIV
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/ptexIndices.h>
#include <opensubdiv/far/topologyDescriptor.h>

namespace tessera::test {
namespace {

namespace osd = OpenSubdiv;

/// What Far adds up: three numbers.
struct FarPoint {
    Vec3d p = Vec3d::Zero();
    void Clear(void* = nullptr) { p.setZero(); }
    void AddWithWeight(const FarPoint& other, double weight) { p += weight * other.p; }
    void AddWithWeight(const FarPoint& other, float weight) { p += static_cast<double>(weight) * other.p; }
};

std::unique_ptr<osd::Far::TopologyRefiner> makeRefiner(const ControlMesh& mesh) {
    using Options = osd::Sdc::Options;
    Options options;
    options.SetVtxBoundaryInterpolation(mesh.boundary == BoundaryInterpolation::kNone ? Options::VTX_BOUNDARY_NONE
                                        : mesh.boundary == BoundaryInterpolation::kEdgeOnly
                                            ? Options::VTX_BOUNDARY_EDGE_ONLY
                                            : Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    options.SetCreasingMethod(mesh.creaseMethod == CreaseMethod::kChaikin ? Options::CREASE_CHAIKIN
                                                                          : Options::CREASE_UNIFORM);
    options.SetTriangleSubdivision(mesh.triangles == TriangleRule::kSmooth ? Options::TRI_SUB_SMOOTH
                                                                           : Options::TRI_SUB_CATMARK);
    const osd::Sdc::SchemeType scheme = mesh.scheme == SubdivisionScheme::kLoop       ? osd::Sdc::SCHEME_LOOP
                                        : mesh.scheme == SubdivisionScheme::kBilinear ? osd::Sdc::SCHEME_BILINEAR
                                                                                      : osd::Sdc::SCHEME_CATMARK;
    const std::vector<int> sizes(mesh.faceSizes.begin(), mesh.faceSizes.end()),
        vertices(mesh.faceVertices.begin(), mesh.faceVertices.end()), holes(mesh.holes.begin(), mesh.holes.end());
    std::vector<int> creases, corners;
    std::vector<float> creaseSharpness, cornerSharpness;
    for (const auto& c : mesh.creases) {
        creases.push_back(static_cast<int>(c.from));
        creases.push_back(static_cast<int>(c.to));
        creaseSharpness.push_back(c.sharpness);
    }
    for (const auto& c : mesh.corners) {
        corners.push_back(static_cast<int>(c.vertex));
        cornerSharpness.push_back(c.sharpness);
    }
    osd::Far::TopologyDescriptor d;
    d.numVertices = static_cast<int>(mesh.positions.size());
    d.numFaces = static_cast<int>(sizes.size());
    d.numVertsPerFace = sizes.data();
    d.vertIndicesPerFace = vertices.data();
    d.numCreases = static_cast<int>(creaseSharpness.size());
    d.creaseVertexIndexPairs = creases.data();
    d.creaseWeights = creaseSharpness.data();
    d.numCorners = static_cast<int>(corners.size());
    d.cornerVertexIndices = corners.data();
    d.cornerWeights = cornerSharpness.data();
    d.numHoles = static_cast<int>(holes.size());
    d.holeIndices = holes.data();
    using Factory = osd::Far::TopologyRefinerFactory<osd::Far::TopologyDescriptor>;
    return std::unique_ptr<osd::Far::TopologyRefiner>(Factory::Create(d, Factory::Options(scheme, options)));
}

}  // namespace

struct SubdivisionOracle::Parts {
    ControlMesh mesh;
    std::unique_ptr<osd::Far::TopologyRefiner> refiner;
    std::unique_ptr<osd::Bfr::RefinerSurfaceFactory<>> factory;
    struct PtexFace {
        int face, corner, size;
    };
    std::vector<PtexFace> ptex;
    struct FaceSurface {
        osd::Bfr::Surface<double> surface;
        std::vector<double> points;
    };
    mutable std::vector<std::unique_ptr<FaceSurface>> surfaces;
};

bool hasOpenSubdiv() {
    return true;
}

SubdivisionOracle::SubdivisionOracle(const ControlMesh& mesh, int level) : parts_(std::make_unique<Parts>()) {
    parts_->mesh = mesh;
    parts_->refiner = makeRefiner(mesh);
    osd::Bfr::SurfaceFactory::Options options;
    options.SetApproxLevelSmooth(level).SetApproxLevelSharp(level);
    parts_->factory = std::make_unique<osd::Bfr::RefinerSurfaceFactory<>>(*parts_->refiner, options);
    const osd::Far::TopologyLevel& base = parts_->refiner->GetLevel(0);
    const int whole = mesh.scheme == SubdivisionScheme::kLoop ? 3 : 4;
    const osd::Far::PtexIndices indices(*parts_->refiner);
    for (int f = 0; f < base.GetNumFaces(); ++f) {
        const int size = base.GetFaceVertices(f).size();
        parts_->ptex.resize(static_cast<std::size_t>(indices.GetFaceId(f)));
        for (int i = 0; i < (size == whole ? 1 : size); ++i) parts_->ptex.push_back({f, size == whole ? -1 : i, size});
    }
    parts_->surfaces.resize(static_cast<std::size_t>(base.GetNumFaces()));
}

SubdivisionOracle::~SubdivisionOracle() = default;

std::size_t SubdivisionOracle::ptexFaceCount() const {
    return parts_->ptex.size();
}

std::optional<OraclePoint> SubdivisionOracle::bfr(std::size_t ptex, double u, double v) const {
    const Parts::PtexFace& face = parts_->ptex[ptex];
    auto& held = parts_->surfaces[static_cast<std::size_t>(face.face)];
    if (!held) {
        held = std::make_unique<Parts::FaceSurface>();
        if (parts_->factory->FaceHasLimitSurface(face.face) &&
            parts_->factory->InitVertexSurface(face.face, &held->surface)) {
            held->points.resize(static_cast<std::size_t>(held->surface.GetNumPatchPoints()) * 3);
            held->surface.PreparePatchPoints(parts_->mesh.positions.front().data(), 3, held->points.data(), 3);
        }
    }
    if (!held->surface.IsValid()) return std::nullopt;
    double uv[2] = {u, v}, at[2] = {u, v};
    double scale = 1;
    if (face.corner >= 0) {
        held->surface.GetParameterization().ConvertNormalizedSubFaceToCoord(face.corner, uv, at);
        scale = 0.5;
    }
    OraclePoint out;
    held->surface.Evaluate(at, held->points.data(), 3, out.point.data(), out.du.data(), out.dv.data());
    out.du *= scale;
    out.dv *= scale;
    return out;
}

std::vector<SubdivisionOracle::FarVertex> SubdivisionOracle::far(int level) const {
    const auto refiner = makeRefiner(parts_->mesh);
    osd::Far::TopologyRefiner::UniformOptions options(level);
    options.fullTopologyInLastLevel = true;
    refiner->RefineUniform(options);
    const osd::Far::PrimvarRefinerReal<double> primvar(*refiner);
    std::vector<FarPoint> points(parts_->mesh.positions.size());
    for (std::size_t i = 0; i < points.size(); ++i) points[i].p = parts_->mesh.positions[i];
    for (int l = 1; l <= level; ++l) {
        std::vector<FarPoint> finer(static_cast<std::size_t>(refiner->GetLevel(l).GetNumVertices()));
        primvar.Interpolate(l, points, finer);
        points.swap(finer);
    }
    std::vector<FarPoint> limits(points.size());
    primvar.Limit(points, limits);

    std::vector<FarVertex> out;
    const osd::Far::TopologyLevel& last = refiner->GetLevel(level);
    const int whole = parts_->mesh.scheme == SubdivisionScheme::kLoop ? 3 : 4;
    for (int f = 0; f < last.GetNumFaces(); ++f) {
        if (last.IsFaceHole(f) || whole == 3) continue;
        // Upwards through the parents: which quarter of a quarter it is.
        double u = 0, v = 0, size = 1;
        std::vector<int> quarters;
        int face = f, corner = -1, parentSize = 4;
        for (int l = level; l > 0; --l) {
            const int parent = refiner->GetLevel(l).GetFaceParentFace(face);
            const auto children = refiner->GetLevel(l - 1).GetFaceChildFaces(parent);
            int child = 0;
            while (children[child] != face) ++child;
            face = parent;
            parentSize = refiner->GetLevel(l - 1).GetFaceVertices(face).size();
            if (parentSize == 4)
                quarters.push_back(child);
            else
                corner = child;
        }
        for (auto q = quarters.rbegin(); q != quarters.rend(); ++q) {
            size /= 2;
            if (*q == 1 || *q == 2) u += size;
            if (*q >= 2) v += size;
        }
        std::size_t ptex = 0;
        while (parts_->ptex[ptex].face != face) ++ptex;
        if (corner >= 0) ptex += static_cast<std::size_t>(corner);
        const auto vertices = last.GetFaceVertices(f);
        for (int i = 0; i < 4; ++i) {
            const double pu = u + (i == 1 || i == 2 ? size : 0), pv = v + (i >= 2 ? size : 0);
            out.push_back(
                {ptex, pu, pv, limits[static_cast<std::size_t>(vertices[i])].p, pu > 0 && pu < 1 && pv > 0 && pv < 1});
        }
    }
    return out;
}

}  // namespace tessera::test

#else

namespace tessera::test {

struct SubdivisionOracle::Parts {};
bool hasOpenSubdiv() {
    return false;
}
SubdivisionOracle::SubdivisionOracle(const ControlMesh&, int) {}
SubdivisionOracle::~SubdivisionOracle() = default;
std::size_t SubdivisionOracle::ptexFaceCount() const {
    return 0;
}
std::optional<OraclePoint> SubdivisionOracle::bfr(std::size_t, double, double) const {
    return std::nullopt;
}
std::vector<SubdivisionOracle::FarVertex> SubdivisionOracle::far(int) const {
    return {};
}

}  // namespace tessera::test
#endif
