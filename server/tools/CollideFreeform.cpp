#include "server/tools/CollideFreeform.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <span>
#include <string_view>
#include <variant>

#include "common/freeform/nurbs/ObjSurfaces.h"
#include "common/freeform/nurbs/tessellation/NurbsTriangles.h"
#include "common/freeform/subdivision/LimitTessellation.h"
#include "common/freeform/subdivision/PatchExtraction.h"
#include "server/tools/SceneTriangles.h"
#include "server/tools/evaluate/ObjControlMesh.h"

namespace tessera {
namespace {

std::string inJson(const Vec3d& v) {
    return fmt::format("[{:.17g},{:.17g},{:.17g}]", v.x(), v.y(), v.z());
}
std::string inWords(const Vec3d& v) {
    return fmt::format("({:.9g} {:.9g} {:.9g})", v.x(), v.y(), v.z());
}
std::string faceInJson(const FreeformPlace& p) {
    return p.face == kNoIndex ? "null" : fmt::format("{}", p.face);
}
std::string faceInWords(const FreeformPlace& p) {
    return p.face == kNoIndex ? "whole" : fmt::format("{}", p.face);
}

/// `"faces":[a,b],"uv":[[…],[…]],"points":[[…],[…]]`.
std::string placesInJson(const FreeformPlace& a, const FreeformPlace& b) {
    return fmt::format(R"("faces":[{},{}],"uv":[[{:.17g},{:.17g}],[{:.17g},{:.17g}]],"points":[{},{}])", faceInJson(a),
                       faceInJson(b), a.u, a.v, b.u, b.v, inJson(a.point), inJson(b.point));
}
std::string placesInWords(const FreeformPlace& a, const FreeformPlace& b) {
    return fmt::format("face {} at {:.6g} {:.6g} {}, face {} at {:.6g} {:.6g} {}", faceInWords(a), a.u, a.v,
                       inWords(a.point), faceInWords(b), b.u, b.v, inWords(b.point));
}

std::string unsure(bool complete, bool json) {
    return complete ? "" : json ? R"(,"complete":false)" : "; gave up before it was sure";
}

std::string contactsLine(const FreeformContacts& found, double tolerance, bool json) {
    const bool hit = !found.contacts.empty() || !found.complete;
    if (!json) {
        std::string line = fmt::format("{} contacts{}", found.contacts.size(), found.contacts.empty() ? "" : ":");
        for (std::size_t i = 0; i < std::min(found.contacts.size(), kPairsNamed); ++i)
            line += " " + placesInWords(found.contacts[i].a, found.contacts[i].b) + ";";
        return line + unsure(found.complete, json);
    }
    std::string list;
    for (const FreeformContact& c : found.contacts) {
        list += fmt::format(R"({}{{{},"point":{},"normal":{}}})", list.empty() ? "" : ",", placesInJson(c.a, c.b),
                            inJson(c.point), inJson(c.normal));
    }
    return fmt::format(R"({{"hit":{},"contacts":[{}],"error":{:.17g}{}}})", hit, list, tolerance,
                       unsure(found.complete, json));
}

}  // namespace

namespace {

/// What a file of smooth surfaces holds.
using FileSurfaces = std::variant<ControlMesh, std::vector<NurbsSurface>>;

/// Whether a line of an OBJ begins with this word.
bool hasStatement(std::string_view text, std::string_view word) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::string_view line = text.substr(at, end - at);
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        if (line.starts_with(word) && line.size() > word.size() &&
            (line[word.size()] == ' ' || line[word.size()] == '\t'))
            return true;
        at = end + 1;
    }
    return false;
}

/// A file may hold polygons beside free-form surfaces: of one kind, the other is left out, and that is said.
void noteOthers(const std::string& path, std::string_view text, FreeformKind kind) {
    const bool areOthers = kind == FreeformKind::kNurbs ? hasStatement(text, "f") : hasStatement(text, "surf");
    if (areOthers)
        fmt::print(stderr, "tessera-collide: {}: its {} are left out ('triangles' has both)\n", path,
                   kind == FreeformKind::kNurbs ? "polygons" : "free-form surfaces");
}

Expected<FileSurfaces> readSurfaces(const std::string& path, FreeformKind kind) {
    const Expected<std::string> text = readSurfaceText(path);
    if (!text) return tl::unexpected(text.error());
    noteOthers(path, *text, kind);
    if (kind == FreeformKind::kNurbs) {
        Expected<std::vector<NurbsSurface>> surfaces = readNurbsObj(*text, path);
        if (!surfaces) return tl::unexpected(surfaces.error());
        return std::move(*surfaces);
    }
    Expected<ObjControlMesh> mesh = parseObjControlMesh(
        *text, path, kind == FreeformKind::kLoop ? SubdivisionScheme::kLoop : SubdivisionScheme::kCatmullClark);
    if (!mesh) return tl::unexpected(mesh.error());
    for (const std::string& note : mesh->notes) fmt::print(stderr, "tessera-collide: {}: {}\n", path, note);
    return std::move(mesh->mesh);
}

Expected<TriangleMesh> readMesh(const std::string& path, const CollideArguments& arguments) {
    return readTriangles(path, {.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined});
}

/// Vertices at one place are one: of these triangles only what they enclose is asked.
TriangleMesh welded(std::span<const Vec3d> places, std::span<const std::uint32_t> corners) {
    std::map<std::array<double, 3>, std::uint32_t> numbers;
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    for (const std::uint32_t c : corners) {
        const Vec3d& p = places[c];
        const auto [at, isNew] =
            numbers.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(positions.size() / 3));
        if (isNew) positions.insert(positions.end(), {p.x(), p.y(), p.z()});
        indices.push_back(at->second);
    }
    return TriangleMesh::make(std::span<const double>(positions), indices).value_or(TriangleMesh());
}

Expected<TriangleMesh> trianglesOf(const ControlMesh& mesh) {
    constexpr int kLevel = 4;
    const Expected<std::shared_ptr<const LimitTessellation>> made = LimitTessellation::build(mesh, kLevel);
    if (!made) return tl::unexpected(made.error());
    std::vector<float> points, positions(3 * (*made)->vertexCount()), normals(positions.size());
    for (const Vec3d& p : mesh.positions)
        for (const double x : {p.x(), p.y(), p.z()}) points.push_back(static_cast<float>(x));
    (*made)->evaluate(points, positions, normals);
    std::vector<Vec3d> places;
    for (std::size_t i = 0; i < positions.size(); i += 3)
        places.emplace_back(positions[i], positions[i + 1], positions[i + 2]);
    return welded(places, (*made)->indices());
}

Expected<TriangleMesh> trianglesOf(const std::vector<NurbsSurface>& surfaces,
                                   std::size_t maxTriangles = TessellationLimits().maxTriangles) {
    Box around;
    for (const NurbsSurface& s : surfaces)
        for (const Vec4d& p : s.definition().points) around.extend(p.head<3>() / p.w());
    constexpr double kShare = 1e-3;
    std::vector<Vec3d> places;
    std::vector<std::uint32_t> corners;
    for (const NurbsSurface& s : surfaces) {
        const Expected<NurbsTriangles> made =
            tessellate(s, std::max(kShare * around.size().norm(), 1e-30), {.maxTriangles = maxTriangles});
        if (!made) return tl::unexpected(made.error());
        for (const auto& t : made->triangles)
            for (const std::uint32_t c : t) corners.push_back(static_cast<std::uint32_t>(places.size()) + c);
        places.insert(places.end(), made->positions.begin(), made->positions.end());
    }
    return welded(places, corners);
}

Expected<FreeformShape> smoothOf(FileSurfaces surfaces) {
    if (const auto* mesh = std::get_if<ControlMesh>(&surfaces)) return FreeformShape::ofSubdivision(*mesh);
    return FreeformShape::ofNurbs(std::move(std::get<std::vector<NurbsSurface>>(surfaces)));
}

/// The Bézier approximation of a limit surface, each patch with its ptex face and its parameters there.
Expected<FreeformShape> bezierOf(const ControlMesh& mesh, double tolerance, BezierFaces& faces) {
    const Expected<SubdivisionTopology> topology = SubdivisionTopology::build(mesh);
    if (!topology) return tl::unexpected(topology.error());
    NeighbourhoodGraph graph(*topology);
    Expected<std::vector<SurfacePatch>> patches = patchesOf(graph, mesh.positions, {.tolerance = tolerance});
    if (!patches) return tl::unexpected(patches.error());
    std::vector<NurbsSurface> surfaces;
    for (const SurfacePatch& patch : *patches) {
        const BezierPatch& bezier = std::get<BezierPatch>(patch.shape);
        const auto knots = [&](int degree, double from) {
            KnotVector out{.degree = degree, .knots = {}};
            out.knots.assign(static_cast<std::size_t>(degree) + 1, from);
            out.knots.insert(out.knots.end(), static_cast<std::size_t>(degree) + 1, from + patch.size);
            return out;
        };
        Expected<NurbsSurface> surface = NurbsSurface::make({.u = knots(bezier.degreeU, patch.u),
                                                             .v = knots(bezier.degreeV, patch.v),
                                                             .points = bezier.points,
                                                             .rangeU = {},
                                                             .rangeV = {},
                                                             .loops = {}});
        if (!surface) return tl::unexpected(surface.error());
        surfaces.push_back(std::move(*surface));
        faces.ptex.push_back(patch.ptex);
        faces.error = std::max(faces.error, patch.error);
    }
    return FreeformShape::ofNurbs(std::move(surfaces));
}

Expected<TriangleMesh> drawnOf(const FileSurfaces& surfaces) {
    Expected<TriangleMesh> drawn = std::visit([](const auto& of) { return trianglesOf(of); }, surfaces);
    if (drawn && drawn->faceCount() == 0) return fail(ErrorCode::kBadInput, "nothing of it has an area");
    return drawn;
}

/// Trims that a scene refuses are refused here too, and what has no area.
Expected<void> checkSurfaces(const std::vector<NurbsSurface>& surfaces) {
    constexpr std::size_t kEnoughToHaveAnArea = 10'000;
    const bool areTrimmed =
        std::ranges::any_of(surfaces, [](const NurbsSurface& s) { return !s.region().loops().empty(); });
    const Expected<TriangleMesh> drawn =
        trianglesOf(surfaces, areTrimmed ? TessellationLimits().maxTriangles : kEnoughToHaveAnArea);
    if (!drawn)
        return !areTrimmed && drawn.error().code == ErrorCode::kLimit ? Expected<void>()
                                                                      : tl::unexpected(drawn.error());
    if (drawn->faceCount() == 0) return fail(ErrorCode::kBadInput, "nothing of it has an area");
    return {};
}

}  // namespace

Expected<FreeformShape> loadFreeform(const std::string& path, const std::optional<FreeformKind>& kind,
                                     Representation otherwise, const CollideArguments& arguments, BezierFaces* faces) {
    const auto named = [&](Expected<FreeformShape> shape) -> Expected<FreeformShape> {
        if (!shape) return failWith(path, shape.error());
        return shape;
    };
    if (kind) {
        Expected<FileSurfaces> surfaces = readSurfaces(path, *kind);
        if (!surfaces) return tl::unexpected(surfaces.error());
        if (kind == FreeformKind::kNurbs)
            if (const Expected<void> sound = checkSurfaces(std::get<std::vector<NurbsSurface>>(*surfaces)); !sound)
                return failWith(path, sound.error());
        BezierFaces own;
        if (kind == FreeformKind::kBezier)
            return named(bezierOf(std::get<ControlMesh>(*surfaces),
                                  0.5 * arguments.tolerance.value_or(kFreeformTolerance), faces ? *faces : own));
        return named(smoothOf(std::move(*surfaces)));
    }
    Expected<TriangleMesh> mesh = readMesh(path, arguments);
    if (!mesh) return tl::unexpected(mesh.error());
    if (otherwise != Representation::kHull) return named(FreeformShape::ofTriangles(std::move(*mesh)));
    Expected<ConvexHull> hull = ConvexHull::make(*mesh);
    if (!hull) return failWith(path, hull.error());
    return named(FreeformShape::ofHull(std::move(*hull)));
}

Expected<std::shared_ptr<CollisionShape>> loadFreeformShape(const std::string& path,
                                                            const std::optional<FreeformKind>& kind,
                                                            Representation otherwise,
                                                            const CollideArguments& arguments) {
    if (!kind) {
        Expected<TriangleMesh> mesh = readMesh(path, arguments);
        if (!mesh) return tl::unexpected(mesh.error());
        if (otherwise != Representation::kHull) return CollisionShape::ofTriangles(std::move(*mesh), arguments.tree);
        std::shared_ptr<CollisionShape> hull = CollisionShape::ofHull(*mesh, arguments.tree);
        if (!hull) return fail(ErrorCode::kBadInput, fmt::format("{}: lies in one plane, so it has no hull", path));
        return hull;
    }
    Expected<FileSurfaces> surfaces = readSurfaces(path, *kind);
    if (!surfaces) return tl::unexpected(surfaces.error());
    Expected<TriangleMesh> drawn = drawnOf(*surfaces);
    if (!drawn) return failWith(path, drawn.error());
    Expected<FreeformShape> surface = smoothOf(std::move(*surfaces));
    if (!surface) return failWith(path, surface.error());
    const double size = drawn->bounds().size().norm();
    return CollisionShape::ofFreeform(std::move(*surface), std::move(*drawn),
                                      size > 0 ? arguments.tolerance.value_or(kFreeformTolerance) / size : 0,
                                      arguments.tree);
}

std::string freeformAnswer(FreeformPair& pair, const PoseLine& pose, const CollideArguments& arguments, double& us,
                           const BezierFaces& facesA, const BezierFaces& facesB) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    const auto stop = [&] { us = std::chrono::duration<double, std::micro>(Clock::now() - start).count(); };
    const bool json = arguments.format == AnswerFormat::kJson;
    // What meets is never told apart: approximations that are nearer than their errors may stand for surfaces that
    // meet.
    const double approximation = facesA.error + facesB.error,
                 tolerance = arguments.tolerance.value_or(kFreeformTolerance) + approximation;
    const auto name = [](FreeformPlace& place, const BezierFaces& of) {
        if (place.face < of.ptex.size()) place.face = of.ptex[place.face];
    };
    const auto named = [&](auto found) {
        name(found.a, facesA);
        name(found.b, facesB);
        return found;
    };
    const Affine3d a_T_b = pose.start.matrix();
    QueryWork work{.limit = kMostFreeformWork};
    switch (arguments.query) {
        case CollideQuery::kAny: {
            const FreeformTouch touch = named(pair.touch(a_T_b, tolerance, work));
            stop();
            const bool hit = touch.touch != Touch::kNo, known = touch.touch != Touch::kUnknown;
            if (json)
                return fmt::format(R"({{"hit":{}{},"error":{:.17g}{}}})", hit,
                                   hit && known ? "," + placesInJson(touch.a, touch.b) : "", tolerance,
                                   unsure(known, json));
            return (hit ? "touch" + (known ? ": " + placesInWords(touch.a, touch.b) : std::string()) : "do not touch") +
                   unsure(known, json);
        }
        case CollideQuery::kAll: {
            FreeformContacts found = pair.contacts(a_T_b, work, {.tolerance = tolerance});
            stop();
            for (FreeformContact& contact : found.contacts) contact = named(contact);
            return contactsLine(found, tolerance, json);
        }
        case CollideQuery::kImpact: {
            const FreeformImpact hit =
                named(pair.firstContact(BodyMotion{}, BodyMotion{pose.start, *pose.end}, tolerance, work));
            stop();
            if (!hit.hit) {
                if (json)
                    return fmt::format(R"({{"hit":{}{}{}}})", !hit.complete,
                                       hit.complete ? "" : fmt::format(R"(,"t":{:.17g})", hit.t),
                                       unsure(hit.complete, json));
                return (hit.complete ? "they do not touch on the way" : fmt::format("free up to t = {:.9g}", hit.t)) +
                       unsure(hit.complete, json);
            }
            if (json)
                return fmt::format(R"({{"hit":true,"t":{:.17g},"distance":{:.17g},{},"normal":{}}})", hit.t,
                                   hit.distance, placesInJson(hit.a, hit.b), inJson(hit.normal));
            return fmt::format("touch at t = {:.9g}, {:.3g} apart: {}", hit.t, hit.distance,
                               placesInWords(hit.a, hit.b));
        }
        default: {
            FreeformDistance d = named(pair.distance(a_T_b, work, {.tolerance = tolerance}));
            stop();
            d.least = std::max(0.0, d.least - approximation);
            if (!std::isfinite(d.distance)) {  // given up before any two places were compared
                if (json) return fmt::format(R"({{"distance":null,"least":{:.17g},"complete":false}})", d.least);
                return fmt::format("distance not known, at least {:.9g}", d.least) + unsure(false, json);
            }
            if (json)
                return fmt::format(R"({{"distance":{:.17g},"least":{:.17g},{},"error":{:.17g}{}}})", d.distance,
                                   d.least, placesInJson(d.a, d.b), std::max(d.distance - d.least, approximation),
                                   unsure(d.complete, json));
            return fmt::format("distance {:.9g}, at least {:.9g}: {}{}", d.distance, d.least, placesInWords(d.a, d.b),
                               unsure(d.complete, json));
        }
    }
}

}  // namespace tessera
